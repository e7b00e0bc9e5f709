"""Pressures as recorded, wired to the inputs: the recorded drop of each side is what the law reads."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.recorded_drop import DropColumns
from dzdesign.verify.exhaustive.recorded_inputs import recorded_inputs_follow
from tests.support.designs import BOTH_SIGNS, designed
from tests.support.golden_firmware import FULL, golden_valve

AB = DropColumns(quantities=("pA", "pB"), labels=("Druck A", "Druck B"))
DP = DropColumns(quantities=("dP",), labels=("dP",))
P_A, P_B = (DropColumns(quantities=("pP", port), labels=("Druck P", f"Druck {port[1]}")) for port in ("pA", "pB"))

B_T, A_T = (DropColumns(quantities=(port, "pT"), labels=(f"Druck {port[1]}", "Druck T")) for port in ("pB", "pA"))


def declared(choice):
    """Return a compensator whose direction is declared, of a valve that says nothing of it."""
    valve = golden_valve(FULL)
    silent = replace(valve, sides={name: replace(side, recorded_drop=None) for name, side in valve.sides.items()})
    return designed(silent, command_signal=BOTH_SIGNS, negative_dp=choice)


def recorded(*, sign, columns=(AB, AB)):
    """Recordings of both sides; at negative commands the drop has that sign."""
    u = np.concatenate([np.linspace(0, 10, 50), np.linspace(0, -10, 50)])
    return [
        RampTest(
            source=f"ramp_{dp:g}.csv", sha256="0" * 64, time=np.arange(u.size) / 10, u=u.copy(), q=u.copy(),
            dp=np.where(u < 0, sign, 1) * dp * 1e6, dp_from=tuple((each,) for each in columns),
        )
        for dp in (1.0, 3.0, 5.0)
    ]  # fmt: skip


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("choice", ["A-B", "B-A"])
@pytest.mark.parametrize("columns", [AB, DP], ids=["two sensors", "signed dP"])
def test_only_the_recorded_direction_is_read(sign, choice, columns):
    compensator = declared(choice)
    check = recorded_inputs_follow(compensator, recorded(sign=sign, columns=(columns,) * 2))
    magnitude = choice == "B-A" and columns is DP and sign > 0
    assert check.holds is ((choice == "B-A") == (sign < 0) or magnitude)
    assert ("taken as declared" in check.text) is magnitude


def test_a_permanent_fault_is_said_of_its_recording(wording):
    compensator = declared("A-B")
    check = recorded_inputs_follow(compensator, recorded(sign=-1))
    wording.of_test(check.text)


@pytest.mark.parametrize("choice", ["A-B", "B-A"])
def test_three_sensors_are_no_pair(choice, wording):
    compensator = declared(choice)
    check = recorded_inputs_follow(compensator, recorded(sign=1, columns=(P_A, P_B)))
    assert check.holds is False
    wording("recorded inputs: three sensors", check.text)


#: Ports of both sides' edges, and the inputs that read them at negative commands.
THREE_PORTS = {"A-C": (P_A, P_B), "C-B": (B_T, A_T), "B-C": (P_A, A_T), "C-A": (B_T, P_B)}


@pytest.mark.parametrize("recorded_as", THREE_PORTS)
@pytest.mark.parametrize("choice", THREE_PORTS)
def test_of_three_inputs_those_of_the_recorded_edge_are_read_and_no_others(choice, recorded_as):
    check = recorded_inputs_follow(declared(choice), recorded(sign=1, columns=THREE_PORTS[recorded_as]))
    assert check.holds is (choice == recorded_as)
    if check.holds:
        ahead, behind = choice.split("-")
        assert f"and {ahead} minus {behind} {THREE_PORTS[choice][1].in_words()}" in check.text


def test_switched_inputs_are_the_machine_s(wording):
    compensator = declared("wired")
    check = recorded_inputs_follow(compensator, recorded(sign=1, columns=(P_A, P_B)))
    assert check.holds
    wording.of_test(check.text)
