"""`verify` of a firmware whose drive is by current: what it requires, and faults that it must see."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.design.current.circuit import CoilCircuit, CurrentSensor
from dzdesign.design.current.drive import choose_loop, gains_of
from dzdesign.design.current.responses import Gains, margins, run_loop
from dzdesign.verify.current import corner_runs
from dzdesign.verify.current.coil import CoilLoop, CoilSimulation, least_rise_s
from dzdesign.verify.current.corner_runs import CURRENTS, stability_margins
from dzdesign.verify.current.current_checks import current_checks
from dzdesign.verify.exhaustive import machine_code
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4
from tests.support.block_cores import block_folder
from tests.support.current_loops import current_texts
from tests.support.designs import CURRENT, MEASURED, designed, replaced, written
from tests.support.evidence import verify
from tests.support.example_coil import COIL, CONVERTER, SAMPLING, SENSORS, asked, example_loop
from tests.support.golden_firmware import FULL, golden_valve
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
#: Fewer than `verify` compares, where a fault is a common one.
STATES = 200_000
STEPS = [6000] * 300 + [54000] * 200 + [30000] * 200


def silent(_: str) -> None:
    """Say nothing."""


@pytest.fixture(scope="module")
def controlled(example_valve):
    """The example's compensator with current control, the supply not measured."""
    return designed(example_valve, "cortex-m4", **CURRENT)


@pytest.fixture(autouse=True)
def short_holds(request, monkeypatch):
    """Hold each set point for 1 s, not 10 s: much of what these tests take. Whole where the windows are."""
    if "whole_windows" not in request.fixturenames:
        monkeypatch.setattr(corner_runs, "HELD_S", 1.0)


def firmware_of(compensator, folder, edit=str):
    return written(compensator, folder, "cortex-m4", edit, "core/dz_current.c")


def failing(checks) -> set[str]:
    return {check.id for check in checks if check.holds is False}


def test_a_firmware_with_current_control_holds(example_valve, tmp_path, whole_windows):
    """All that `verify` requires, every input and whole windows; 27 corners and each kind of fault are in evidence."""
    measured = designed(example_valve, "cortex-m4", **MEASURED)
    evidence = verify(firmware_of(measured, tmp_path / "firmware")).evidence
    assert failing(evidence.checks) == set()
    of_current = {"controller", "margins", "settles", "step", "faults", "valve"}
    assert {f"current-{name}" for name in of_current} <= {check.id for check in evidence.checks}
    found = evidence.current_loop
    assert found.states.states > 10_000_000 and found.states.wrong == 0
    assert len({(each.resistance_ohm, each.inductance_H, each.supply_V) for each in found.corners}) == 27
    assert {fault.expected for fault in found.faults} == {"OPEN", "SHORT", "OVER", "SENSOR"}
    assert all(fault.holds for fault in found.faults)


def test_a_drive_by_duty_has_no_such_requirement(example_compensator, tmp_path):
    assert current_checks(tmp_path, example_compensator, silent).checks == ()


#: What is edited in dz_current.c, and the requirements that must see it beside the comparison of states, which sees any
#: (test_controller.py) and the comparison of the files.
EDITS = {
    "twice the gain": (
        ("(error * numbers->proportional)", "(error * (2u * numbers->proportional))"),
        {"current-controller", "current-step"},
    ),
    "an offset that is not calibrated": (
        ("loop->offset = (loop->offset_total + half_of(shift)) >> shift;", "loop->offset = numbers->offset_nominal;"),
        {"current-controller", "current-settles"},
    ),
    "an open load that is not seen": (("* DZ_CURRENT_OPEN)", "* 0u)"), {"current-controller", "current-faults"}),
    "a short that is not seen": (("* DZ_CURRENT_SHORT)", "* 0u)"), {"current-controller", "current-faults"}),
    "an over-current that is not seen": (("* DZ_CURRENT_OVER)", "* 0u)"), {"current-controller", "current-faults"}),
    "faults that are not latched": (
        ("faults = loop->faults |", "faults = (loop->faults & DZ_CURRENT_NO_OFFSET) |"),
        {"current-controller", "current-faults"},
    ),
    "a zero too far off that is no fault": (
        ("? DZ_CURRENT_SENSOR : 0u", "? 0u : 0u"),
        {"current-controller", "current-faults"},
    ),
}


@pytest.mark.parametrize("fault", EDITS)
def test_an_edited_controller_is_seen(fault, controlled, tmp_path):
    pair, expected = EDITS[fault]
    found = current_checks(firmware_of(controlled, tmp_path / "fw", replaced(pair)), controlled, silent, STATES)
    assert expected <= failing(found.checks)


@pytest.fixture(scope="module")
def of_two():
    """A compensator of two solenoids with a shunt each, the supply measured."""
    each = {"current_signal": f"{CURRENT['current_signal']} each", "command_signal": "-10..10 V x 0.12 + 1.5 V"}
    return designed(golden_valve(FULL), "cortex-m4", **MEASURED | each, transition="2 %", negative_dp="wired")


EDITS_OF_TWO = {
    "none": (None, set()),
    "the other one driven at once": (
        ("loop->on_b ^= changes & decayed;", "loop->on_b ^= changes;"),
        {"current-controller", "current-solenoids", "current-faults"},
    ),
    "the decay judged while the output is on": (
        (" & negative(loop->compare - 1u);", ";"), {"current-controller"},
    ),
    "a decay to a tenth of the current": (
        ("~negative(above - numbers->open_sum)", "~negative(above - (5u * numbers->open_sum))"),
        {"current-controller", "current-solenoids"},
    ),
    "a side that never changes": (
        ("changes & decayed;", "0u;"), {"current-controller", "current-solenoids", "current-faults"},
    ),
    "a switch that stays on is not seen": (("* DZ_CURRENT_HELD)", "* 0u)"), {"current-controller", "current-faults"}),
    "a fault that names the other": (
        ("found << (loop->on_b & OF_B)", "found << (~loop->on_b & OF_B)"), {"current-controller", "current-faults"},
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", EDITS_OF_TWO)
def test_an_edited_controller_of_two_solenoids_is_seen(fault, of_two, tmp_path):
    pair, expected = EDITS_OF_TWO[fault]
    found = current_checks(
        firmware_of(of_two, tmp_path / "fw", replaced(pair) if pair else str), of_two, silent, STATES
    )
    assert failing(found.checks) == expected
    assert "current-solenoids" in {check.id for check in found.checks}
    assert len(found.result.faults) == 9 and found.result.changes.phases > of_two.current_drive.loop.held_ticks


def test_a_firmware_in_block_form_with_two_solenoids_holds(of_two, tmp_path):
    folder = block_folder(of_two, tmp_path / "fw")
    found = current_checks(folder, of_two, silent, STATES)
    assert failing(found.checks) == set() and len(found.checks) == 6


def test_one_code_too_many_in_one_of_a_million_states_is_seen(controlled, tmp_path):
    """With the states that every verification compares."""
    right = "smaller(counts, limit) & on"
    mixed = "(asked * 0x9E3779B1u) ^ (((uint32_t)sum + loop->offset) * 0x85EBCA6Bu) ^ (aim * 0xC2B2AE35u)"
    wrong = f"({right}) + ((((({mixed}) * 0x27D4EB2Fu) >> 8) % 1000000u) == 0u)"
    found = current_checks(firmware_of(controlled, tmp_path, replaced((right, wrong))), controlled, silent)
    assert 1 <= found.result.states.wrong <= 60
    assert failing(found.checks) == {"current-controller"}


TAMPERED = {
    "gain": {"proportional": 2}, "feed-forward": {"feed_forward": 3}, "rate": {"rate": 6}, "release": {"release": 0},
}  # fmt: skip


@pytest.mark.parametrize("number", TAMPERED)
def test_another_loop_in_compensator_json_is_seen(number, controlled, tmp_path):
    """C and compensator.json agree: what is stated of the loop, and the loop itself, must tell."""
    drive = controlled.current_drive
    changed = {name: min(getattr(drive.loop, name) * by, 8191) for name, by in TAMPERED[number].items()}
    changed |= {"rate": {"rate": 60000}, "release": {"release": 0}}.get(number, {})
    tampered = replace(controlled, current_drive=replace(drive, loop=replace(drive.loop, **changed)))
    found = current_checks(firmware_of(tampered, tmp_path / "firmware"), tampered, silent, STATES)
    assert "current-controller" not in failing(found.checks)
    assert failing(found.checks) & {"current-margins", "current-step", "current-settles"}


@pytest.mark.parametrize("name", SENSORS)
def test_the_margins_are_those_of_design_by_another_way(name):
    """Eigenvalues of a turned loop against the crossovers of a transfer function: 0.02 degrees, 1 %."""
    around = CoilLoop(
        loop=example_loop(name), circuit=COIL, sensor=SENSORS[name], converter=CONVERTER, sampling=SAMPLING
    )
    assert set(around.corners()) == set(COIL.corners())
    for corner in around.corners()[::5]:
        ours = stability_margins(around, corner)
        theirs = [
            margins(COIL, corner, SAMPLING, gains_of(around.loop, COIL), share)
            for share in CURRENTS
            if COIL.duty(corner, share) < 1
        ]
        assert ours.phase_deg == pytest.approx(min(each.phase_deg for each in theirs), abs=0.02)
        assert ours.gain == pytest.approx(min(each.gain for each in theirs), rel=0.01)


@pytest.mark.parametrize("name", SENSORS)
def test_what_design_reckons_with_is_what_the_c_does(name):
    """Every compare value of every corner over steps up and down, from rest on; the current to a nanoampere."""
    loop, corners = example_loop(name), list(COIL.corners())
    around = CoilLoop(loop=loop, circuit=COIL, sensor=SENSORS[name], converter=CONVERTER, sampling=SAMPLING)
    simulated = CoilSimulation(around, current_texts(loop))
    means, compares = run_loop(loop, asked(SENSORS[name]), corners, STEPS)
    for place, corner in enumerate(corners):
        found = simulated.run(corner, STEPS)
        assert not found["faults"].any()
        assert np.array_equal(found["compare"], compares[:, place])
        assert found["means_A"][:, 0] == pytest.approx(means[:, place], abs=1e-9)


def test_a_small_fast_coil_has_the_margins_that_were_chosen():
    """Gains without a crossover up to half the PWM's frequency were once read as 180 degrees, and the largest taken."""
    coil = CoilCircuit(resistance_ohm=3.5, inductance_H=0.01, rated_A=1.0, supply_V=(18.0, 32.0))
    sensor = SENSORS["supply measured"]
    huge = Gains(proportional=1e4, integral=1.0, feed_forward=1.0, supply_measured=True)
    assert margins(coil, coil.nominal, SAMPLING, huge, 0.5).phase_deg == 0
    loop = choose_loop(asked(sensor, coil), 60000)
    around = CoilLoop(loop=loop, circuit=coil, sensor=sensor, converter=CONVERTER, sampling=SAMPLING)
    assert min(stability_margins(around, corner).phase_deg for corner in around.corners()) >= 50


def test_the_least_rise_is_that_of_an_exponential():
    corner = COIL.nominal
    assert least_rise_s(corner, 0.1, 0.82) == pytest.approx(COIL.fastest_rise_s(corner, 0.1, 0.82))
    assert least_rise_s(corner._replace(resistance_ohm=40.0), 0.1, 0.82) == float("inf")


@pytest.mark.parametrize(
    ("machine", "why"), [pytest.param(each, each.missing(), id=each.name) for each in (CORTEX_M4, AVR)]
)
def test_other_machines_are_checked_and_a_wrong_one_is_seen(machine, why, controlled, tmp_path, monkeypatch):
    from dzdesign.verify.current import current_checks as checks

    if why:
        pytest.skip(why)
    monkeypatch.setattr(checks, "STATES", 50_000)
    right = checks.controller_on_machine(firmware_of(controlled, tmp_path / "right"), controlled, machine, 50_000)
    assert right.holds, right.text
    # What another compiler alone sees.
    mark = "__arm__" if machine is CORTEX_M4 else "__AVR__"
    edit = f"#ifdef {mark}\n#define half_of(shift) UINT32_C(7)\n#endif\n\nvoid dz_current_init("
    folder = firmware_of(controlled, tmp_path / "wrong", lambda text: text.replace("void dz_current_init(", edit, 1))
    assert checks.controller_on_machine(folder, controlled, machine, 50_000).holds is False


def test_machine_code_has_a_row_for_the_controller(controlled, tmp_path, monkeypatch):
    monkeypatch.setattr(machine_code, "MACHINES", (replace(CORTEX_M4, needs={"no-such-compiler": "its-package"}),))
    names = [check.name for check in machine_code.machine_code_checks(firmware_of(controlled, tmp_path / "f"), ())]
    assert names == ["current controller's machine code of the Cortex-M4", "machine code of the Cortex-M4"]


def test_a_set_point_that_the_supply_cannot_carry_is_said(controlled, tmp_path):
    weak = CoilCircuit(resistance_ohm=16.0, inductance_H=0.04, rated_A=1.0, supply_V=(18.0, 32.0))
    loop = choose_loop(asked(CurrentSensor(V_per_A=2.0, offset_V=0.15), weak), 60000)
    assert loop.compare_limit == 60000 and Fraction(loop.full_counts, 60000) == 1
    drive = replace(controlled.current_drive, circuit=weak, loop=loop)
    other = replace(controlled, current_drive=drive)
    found = current_checks(firmware_of(other, tmp_path / "firmware"), other, silent, STATES)
    assert found.result.not_carried > 0
    settles = next(check for check in found.checks if check.id == "current-settles")
    assert str(found.result.not_carried) in settles.text


@pytest.mark.parametrize("kept", ["what the coil makes", "the set point's peak alone"])
def test_a_dither_that_the_current_overshoots_is_kept_free_or_seen(kept, example_valve, tmp_path):
    made = designed(example_valve, "cortex-m4", **CURRENT, dither="150 Hz 1 %")
    if kept == "the set point's peak alone":
        made = replace(made, current_drive=replace(made.current_drive, dither_above_counts=0))
    found = current_checks(firmware_of(made, tmp_path / "firmware"), made, silent, STATES)
    assert failing(found.checks) == ({"current-settles"} if kept == "the set point's peak alone" else set())
    assert found.result.dither_above_counts > 150 and found.result.dither_below_counts > 100
