"""Recordings that show no threshold are refused with the reason; weak sweeps are said to be weak."""

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.errors import InputError
from dzdesign.identify.options import IdentifyOptions
from tests.dzdesign.command_line.test_bad_input import csv
from tests.support.repeatable_valves import identify
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp


def with_share(test, column, share, value, seed=1):
    """Return a recording in which a share of one column's samples, at random, is one value."""
    cells = getattr(test, column).copy()
    cells[np.random.default_rng(seed).random(cells.size) < share] = value
    return dataclasses.replace(test, **{column: cells})


def codes(*tests, **options):
    return {warning.code for warning in identify(tests, IdentifyOptions(**options)).warnings}


@pytest.mark.parametrize(("noise", "floor"), [(0.0, 0.51), (0.4, 0.51), (0.02, 0.8), (0.0, 0.95), (0.4, 0.95)])
def test_a_meter_that_starts_above_the_straight_part_is_refused(floor, noise, wording):
    """The line through the jump would put the closing threshold volts above the true one, and certify it."""
    truth = Truth(slope=4.0, floor=floor * 4.0 * 4.6, noise=noise)
    with wording.refusal(InputError):
        identify([synthetic_ramp(1.0, truth)])


@pytest.mark.parametrize("floor", [0.1, 0.3, 0.4])
def test_a_floor_inside_the_straight_part_is_no_jump(floor):
    side = identify([synthetic_ramp(1.0, Truth(floor=floor * 4.0 * 4.6))]).positive
    assert side.tests[0].u_guard_lower_V < 5.3


def test_a_steep_valve_is_no_jump():
    side = identify([synthetic_ramp(1.0, Truth(slope=60.0, saturation=20.0))]).positive
    assert side.tests[0].u_knee_rising_V == pytest.approx(5.4, abs=0.01)


def test_a_flow_of_the_wrong_sign_is_not_called_a_shut_valve(wording):
    test = synthetic_ramp(1.0, Truth())
    with wording.refusal(InputError):
        identify([dataclasses.replace(test, q=-test.q)])


def test_flows_of_two_signs_under_commands_of_one_are_two_sides(wording):
    one, other = (synthetic_ramp(1.0, Truth(), seed=seed, source=f"{seed}.csv") for seed in (1, 2))
    other = dataclasses.replace(other, q=-0.8 * other.q)
    with wording.refusal(InputError):
        identify([one, other])


def test_a_refused_rise_is_said_beside_what_was_expected(wording):
    with wording.refusal(InputError) as refusal:
        identify([synthetic_ramp(1.0, Truth(noise=6.0))])
    rise, least = (float(str(refusal.value).split(before)[1].split()[0]) for before in ("rises by ", "more than "))
    assert rise < least


def test_spikes_of_the_flow_that_leave_no_rise_are_refused(wording):
    with wording.refusal(InputError):
        identify([with_share(synthetic_ramp(1.0, Truth()), "q", 0.15, 30 * L_MIN)])


@pytest.mark.parametrize("share", [0.02, 0.05, 0.1])
def test_fewer_spikes_move_neither_the_knee_nor_the_flow_at_full_command(share):
    plain = synthetic_ramp(1.0, Truth())
    clean, spoilt = (identify([test]).positive.tests[0] for test in (plain, with_share(plain, "q", share, 999 * L_MIN)))
    assert spoilt.u_knee_falling_V == pytest.approx(clean.u_knee_falling_V, abs=1e-3)
    assert spoilt.q_max_L_min == pytest.approx(clean.q_max_L_min, rel=0.01)


def test_drop_outs_of_the_command_that_leave_no_ramp_are_refused(wording):
    with wording.refusal(InputError):
        identify([with_share(synthetic_ramp(1.0, Truth()), "u", 0.05, 0.0)])


def test_a_clock_that_stands_still_is_said_and_a_lag_on_it_refused(wording):
    test = synthetic_ramp(1.0, Truth())
    still = dataclasses.replace(test, time=np.zeros(test.time.size))
    assert "clock" in codes(still)
    assert "clock" not in codes(test)
    with wording.refusal(InputError):
        identify([still], IdentifyOptions(meter_lag=0.1))


def test_a_ramp_from_above_the_threshold_is_said():
    test = synthetic_ramp(1.0, Truth(knee_rising=3.0))
    above, below = (dataclasses.replace(test, u=start + test.u * (10 - start) / 10) for start in (3.5, 1.0))
    assert "edge-not-swept" not in codes(below)
    flow = 4.0 * np.clip(above.u - np.where(np.arange(above.u.size) < above.u.size // 2, 3.0, 2.9), 0, None) * L_MIN
    assert "edge-not-swept" in codes(dataclasses.replace(above, q=flow))


def test_a_flow_that_falls_at_the_top_is_said():
    test = synthetic_ramp(1.0, Truth())
    assert "flow-falls" not in codes(test)
    assert "flow-falls" in codes(dataclasses.replace(test, q=test.q - 6 * L_MIN * np.clip(test.u - 8, 0, None)))


def test_a_curve_that_bends_away_from_its_straight_part_is_said():
    """Full drive of the law is where the line would reach the largest flow; a curved valve passes less there."""
    test = synthetic_ramp(1.0, Truth())
    assert "curved" not in codes(test)
    bent = test.q.max() * (1 - np.exp(-1.8 * test.q / test.q.max())) / (1 - np.exp(-1.8))
    assert "curved" in codes(dataclasses.replace(test, q=bent))


def test_many_outliers_are_said():
    test = synthetic_ramp(1.0, Truth())
    assert not {"outliers", "flow-falls"} & codes(with_share(test, "q", 0.01, 999 * L_MIN))
    assert "outliers" in codes(with_share(test, "q", 0.05, 999 * L_MIN))


@pytest.mark.parametrize(("hysteresis", "said"), [(-0.1, True), (0.0, False), (0.1, False)])
def test_thresholds_in_the_wrong_order_are_said_beyond_their_noise(hysteresis, said):
    tests = [synthetic_ramp(dp, Truth(hysteresis=hysteresis), seed=seed) for seed, dp in enumerate((0.5, 1, 2, 3, 5))]
    assert ("branch-order" in codes(*tests)) is said


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """Return the message about a recording of some columns, the label with its unit -> what stands in it."""
    monkeypatch.chdir(tmp_path)

    def refused_(columns, *options):
        Path("ramp.csv").write_text(csv(np.column_stack(list(columns.values())), ",".join(columns)))
        assert main(["-q", "identify", "ramp.csv", "--meter-lag", "0 s", *options]) == 2
        return capsys.readouterr().err

    return refused_


#: A reversed or normally open valve, a meter mounted backwards, or both: labels of command and flow, and what --columns
#: says of them at first.
TURNED = {
    "valve": ("u_V", "Q_Lmin", lambda u, q: (10 - u, q), ""),
    "valve in percent": ("u [%]", "Q_Lmin", lambda u, q: (100 - 10 * u, q), ""),
    "valve in mV": ("u_mV", "Q_Lmin", lambda u, q: (1e4 - 1e3 * u, q), ""),
    "valve in mA": ("I", "Q_Lmin", lambda u, q: (20 - 1.6 * u, q), "u=I:4..20 mA = 0..10 V"),
    "meter": ("u_V", "Q_Lmin", lambda u, q: (u, -q), ""),
    "meter in m3/h": ("u_V", "Q (m3/h)", lambda u, q: (u, -0.06 * q), ""),
    "meter in mA": ("u_V", "I", lambda u, q: (u, 12 - 0.32 * q), "Q=I:4..20 mA = -25..25 L/min"),
    "meter in volts": ("u_V", "I", lambda u, q: (u, -0.2 * q), "Q=I:0..10 V = 50 L/min"),
    "both": ("u_V", "Q_Lmin", lambda u, q: (10 - u, -q), ""),
    "both, with a zero error": ("u_V", "Q_Lmin", lambda u, q: (10 - u, -q - 0.5), ""),
}


@pytest.mark.parametrize("name", TURNED)
def test_the_message_says_how_to_turn_it_and_that_works(refused, name, wording):
    label, of_flow, make, columns = TURNED[name]
    test = synthetic_ramp(1.0, Truth(), ramp_s=20.0)
    u, q = make(test.u, test.q / L_MIN)
    table = {"time_s": test.time, label: u, "dP_MPa": test.dp / 1e6, of_flow: q}
    text = refused(table, *(["--columns", columns] if columns else []))
    wording.of_test(text)
    option = re.search(r'--columns "([^"]+)"', text)[1]
    assert {part.partition("=")[0].strip() for part in re.split(r",\s*(?=Q=)", option)} == {
        "v": {"u"}, "m": {"Q"}, "b": {"u", "Q"}
    }[name[0]]  # fmt: skip
    assert main(["-q", "identify", "ramp.csv", "--meter-lag", "0 s", "--columns", option, "-o", "v.json"]) == 0
    (found,) = json.loads(Path("v.json").read_text())["sides"]["positive"]["tests"]
    (truth,) = identify([test], IdentifyOptions(meter_lag=0.0)).positive.tests
    assert found["u_knee_falling_V"] == pytest.approx(truth.u_knee_falling_V, abs=0.015)
    assert found["u_knee_rising_V"] == pytest.approx(truth.u_knee_rising_V, abs=0.015)


@pytest.mark.parametrize(
    ("label", "make"),
    [
        ("Total_L:L/min", lambda q: q),
        ("Total_L:L/min", lambda q: 1e4 - q),
        ("pulses:0..500 = 0..60 L/min", lambda q: np.floor(300 * q)),
        ("pos_mm:L/min", lambda q: 900 * q + 0.05 * np.random.default_rng(1).standard_normal(q.size)),
    ],
)
def test_a_total_is_no_flow(refused, label, make):
    test = synthetic_ramp(1.0, Truth(), ramp_s=20.0)
    volume = np.cumsum(np.maximum(test.q, 0) / L_MIN) * np.median(np.diff(test.time)) / 60
    table = {"time_s": test.time, "u_V": test.u, "dP_MPa": test.dp / 1e6, label.partition(":")[0]: make(volume)}
    assert "never goes back, though the command does: a volume, a count of" in refused(table, "--columns", f"Q={label}")


@pytest.mark.parametrize("way", ["opening", "closing"])
def test_a_knee_outside_the_command_that_was_swept_is_refused(way):
    test = synthetic_ramp(1.0, Truth())
    bent = (np.arange(test.u.size) < test.u.size // 2) == (way == "opening")
    flow = np.where(bent, 6.0 * np.sqrt(np.clip(test.u - 1.0, 0, None)) * L_MIN, test.q)
    with pytest.raises(InputError, match=rf"synthetic_1.* {way} .*-\d+\.\d\d V.* 0\.00 to 10\.00 V.*knee-window"):
        identify([dataclasses.replace(test, q=flow)], IdentifyOptions(knee_window=(0.9, 0.98)))


class TestPressureOnItsWay:
    """A pump that starts with the ramp: the rising branch is run at another pressure drop than the falling one."""

    @staticmethod
    def recorded(dp_MPa, settles_s=30.0):
        truth = Truth(slope=4.0 * dp_MPa**0.5)
        test = synthetic_ramp(dp_MPa, truth, ramp_s=50.0, source=f"late_{dp_MPa:g}.csv")
        share = np.clip(test.time / settles_s, 0.01, 1) ** 2
        return dataclasses.replace(test, dp=test.dp * share, q=test.q * np.sqrt(share))

    def test_the_refusal_says_so(self, wording):
        tests = [self.recorded(1.0), self.recorded(4.0)]
        with wording.refusal(InputError):
            identify(tests)


class TestPumpOffAtTheStart:
    """A long rest without pressure before the ramp: signs are judged where oil flows."""

    @staticmethod
    def recorded(sign_of_dp=1, sign_of_q=1, rest=-1.0):
        """Return a ramp behind 20 s of rest, at a pressure drop that scatters about `rest`, in kPa."""
        test = synthetic_ramp(1.0, Truth())
        step = float(np.median(np.diff(test.time)))
        count = round(20 / step)
        noise = np.random.default_rng(3).normal(size=(2, count))
        return dataclasses.replace(
            test,
            time=np.concatenate([test.time[0] - step * np.arange(count, 0, -1), test.time]),
            u=np.concatenate([np.zeros(count), test.u]),
            q=np.concatenate([0.01 * L_MIN * noise[0], sign_of_q * test.q]),
            dp=np.concatenate([1e3 * (rest + noise[1]), sign_of_dp * test.dp]),
        )

    def test_the_ramp_itself_is_fine(self):
        assert identify([self.recorded()]).positive.tests[0].dp_MPa == pytest.approx(1.0, abs=0.01)

    @pytest.mark.parametrize("rest", [-1.0, 0.0, 3.0])
    def test_a_flow_of_the_wrong_sign_is_no_pressure_of_the_wrong_sign(self, rest):
        with pytest.raises(InputError, match=r"the flow falls with the command.*reverse the sign of Q"):
            identify([self.recorded(sign_of_q=-1, rest=rest)])

    @pytest.mark.parametrize("rest", [-1.0, 0.0, 3.0])
    def test_swapped_pressures_are_refused_with_their_value(self, rest):
        with pytest.raises(
            InputError, match=r"the pressure drop is -(1\.0|0\.9)\d+ MPa, expected a positive one; swap"
        ):
            identify([self.recorded(sign_of_dp=-1, rest=rest)])

    def test_a_pump_that_never_ran_is_refused_as_before(self):
        test = self.recorded()
        dp = np.concatenate([test.dp[:100], np.full(test.dp.size - 100, -1e3)])
        with pytest.raises(InputError, match=r"the pressure drop is -0\.001 MPa, expected a positive one"):
            identify([dataclasses.replace(test, dp=dp, q=0.01 * test.q)])
