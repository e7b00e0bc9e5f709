"""What is read at zero command: the same at every pressure it is the meter's zero error, growing with it a leak."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from tests.support.bench_recordings import L_MIN, Valve, record

PRESSURES = (1.0, 3.0, 5.0)
CLOSING = 5.2
OPTIONS = IdentifyOptions(meter_lag=0.0, repeatability=0.0)


def recordings(per_MPa, *, zero=0.0, stops=True, noise=0.05, pressures=PRESSURES, memory=0.0):
    """Ramps of a valve with a leak that stops where it opens, or goes on beside the main flow."""
    tests = []
    for dp in pressures:
        quiet = record(Valve(closing=CLOSING, noise=0.0), dp)
        scatter = record(Valve(noise=noise, memory=memory, gain=0.0), dp).q
        leak = per_MPa * dp * L_MIN
        main = np.maximum(quiet.q, leak) if stops else quiet.q + leak
        tests.append(replace(quiet, q=main + zero * L_MIN + scatter))
    return tests


def warned(valve, code):
    return [warning for warning in valve.warnings if warning.code == code]


class TestLeak:
    @pytest.mark.parametrize("zero", [0.0, -0.4, 0.3])
    @pytest.mark.parametrize("stops", [True, False])
    @pytest.mark.parametrize("noise", [0.05, 0.75])
    def test_it_is_reported_for_each_pressure_and_in_the_bounds_whether_it_stops_or_not(self, zero, stops, noise):
        valve = identify(recordings(0.2, zero=zero, stops=stops, noise=noise), OPTIONS)
        for test, dp in zip(valve.positive.tests, PRESSURES, strict=True):
            assert test.leak_L_min == pytest.approx(0.2 * dp, rel=0.02 if noise < 0.5 else 0.3)
            assert test.u_guard_lower_V < CLOSING
        assert max(valve.positive.curve.u_offset_V) < CLOSING
        (warning,) = warned(valve, "leak")
        assert "0.2" in warning.text and warning.source == "p_5_1.csv"
        assert bool(warned(valve, "meter-zero")) == (zero != 0.0) or noise > 0.5

    def test_taken_for_a_zero_error_it_would_open_the_valve(self):
        """The recordings of one pressure drop can't tell: what the bounds are worth without the leak in them."""
        (test,) = identify(recordings(0.2, pressures=(5.0,)), OPTIONS).positive.tests
        assert test.leak_L_min == 0.0
        assert test.u_guard_lower_V > CLOSING + 0.09

    def test_two_pressures_in_one_recording_tell_it(self):
        low, high = recordings(0.2, pressures=(1.0, 5.0))
        later = high.time + low.time[-1] + 0.02
        one = replace(
            low,
            time=np.concatenate([low.time, later]),
            **{name: np.concatenate([getattr(low, name), getattr(high, name)]) for name in ("u", "q", "dp")},
        )
        tests = identify([one], OPTIONS).positive.tests
        assert [test.leak_L_min for test in tests] == pytest.approx([0.2, 1.0], rel=0.02)
        assert all(test.u_guard_lower_V < CLOSING for test in tests)

    def test_one_that_stops_feigns_no_trend(self):
        side = identify(recordings(0.2), OPTIONS).positive
        assert side.trend == "flat"

    def test_it_sags_with_the_pressure(self):
        tests = []
        for test in recordings(0.2, stops=False):
            sagging = test.dp * (1 - 0.2 * (test.q / test.q.max()))
            tests.append(replace(test, dp=sagging, q=test.q * np.sqrt(sagging / test.dp)))
        side = identify(tests, OPTIONS).positive
        for test in side.tests:
            assert test.u_knee_falling_V == pytest.approx(CLOSING, abs=0.015)


class TestZero:
    @pytest.mark.parametrize("zero", [0.5, -0.5])
    def test_the_same_at_every_pressure_it_stays_the_meters(self, zero):
        valve = identify(recordings(0.0, zero=zero), OPTIONS)
        assert all(test.leak_L_min == 0 for test in valve.positive.tests)
        (warning,) = warned(valve, "meter-zero")  # one for all recordings
        assert warning.source is None and not warned(valve, "leak")
        assert valve.positive.tests[0].u_guard_lower_V > CLOSING - 0.02

    @pytest.mark.parametrize("zeros", [(0.1, -0.2, 0.1), (0.5, 0.3, 0.1)])
    def test_what_does_not_grow_with_the_pressure_is_no_leak(self, zeros):
        tests = [recordings(0.0, zero=zero, pressures=(dp,))[0] for zero, dp in zip(zeros, PRESSURES, strict=True)]
        assert not warned(identify(tests, OPTIONS), "leak")

    @pytest.mark.slow
    def test_slow_noise_is_no_leak(self):
        feigned = 0
        for seed in range(8):
            pressures = [dp + 0.01 * seed for dp in PRESSURES]
            valve = identify(recordings(0.0, noise=0.75, memory=0.98, pressures=pressures), OPTIONS)
            feigned += valve.positive.tests[0].leak_L_min > 0
        assert feigned == 0


class TestHiddenZero:
    """A meter that writes nothing below zero: its zero error puts every knee too high, unseen at rest."""

    @staticmethod
    def cut_off(zero, *, at=0.0, noise=0.05, pressures=PRESSURES, step=0.0, sign=1, memory=0.0):
        tests = recordings(0.0, zero=zero, noise=noise, pressures=pressures, memory=memory)
        tests = [replace(test, q=np.maximum(test.q, at * L_MIN)) for test in tests]
        if step:
            tests = [replace(test, q=np.round(test.q / L_MIN / step) * step * L_MIN) for test in tests]
        return [replace(test, u=sign * test.u, q=sign * test.q) for test in tests]

    @pytest.mark.parametrize(
        ("zero", "changes"),
        [
            (-0.6, {}), (-0.3, {"noise": 0.02}), (-0.75, {"noise": 0.2}), (-0.6, {"pressures": (1.0,)}),
            (-0.6, {"noise": 0.1, "step": 0.1}), (-0.6, {"noise": 0.003}), (-0.6, {"sign": -1}), (-0.6, {"at": -0.02}),
            (-0.6, {"memory": 0.9}),
        ],
        ids=["0.6", "little noise", "much noise", "one pressure", "coarse", "hardly any noise", "negative",
             "below zero", "slow noise"],
    )  # fmt: skip
    def test_it_is_said_and_the_level_counts_it(self, zero, changes, wording):
        tests = self.cut_off(zero, **changes)
        valve = identify(tests, OPTIONS)
        (said,) = warned(valve, "zero-hidden")
        (side,) = valve.sides.values()
        assert side.certificate.unseen_below_L_min > -zero > side.certificate.level_L_min
        for guard in ("closing", "opening"):
            assert side.unseen_below_L_min(guard) > -zero
            assert "--meter-zero" in side.none_in_words(guard, valve.recorded_units)
        if not changes:
            wording("readings at rest: a hidden zero", said.text)
            wording("readings at rest: a level with a hidden zero", side.none_in_words("closing", valve.recorded_units))
        # Declared, it is in the bounds, and there is nothing to say.
        declared = identify(tests, replace(OPTIONS, meter_zero=-zero * L_MIN))
        assert not warned(declared, "zero-hidden")
        for test in next(iter(declared.sides.values())).tests:
            assert test.u_guard_lower_V < CLOSING

    @pytest.mark.parametrize("noise", [0.003, 0.06, 0.18])
    def test_readings_without_their_sign_fall_before_they_rise_and_noise_hides_it_from_single_ones_only(self, noise):
        tests = [replace(test, q=np.abs(test.q)) for test in recordings(0.0, zero=-0.6, noise=noise)]
        valve = identify(tests, OPTIONS)
        assert warned(valve, "zero-hidden") and valve.positive.certificate.unseen_below_L_min > 1.1
        honest = identify(recordings(0.0, zero=0.6, noise=min(noise, 0.12)), OPTIONS)
        assert not warned(honest, "zero-hidden")

    def test_a_flow_allowed_at_zero_is_said_to_come_beside_it(self):
        valve = identify(self.cut_off(-0.6), replace(OPTIONS, zero_flow=0.3 * L_MIN))
        assert "beside a zero error" in valve.positive.zero_flow_in_words(valve.recorded_units)

    @pytest.mark.parametrize(
        "tests",
        [
            recordings(0.0),
            recordings(0.0, noise=0.0),
            recordings(0.0, zero=-0.6),
            [record(Valve(floor=0.6, noise=0.0), dp) for dp in PRESSURES],
            [replace(test, q=np.where(test.q < 0.6 * L_MIN, 0.0, test.q)) for test in recordings(0.0)],
            [replace(test, q=np.round(test.q / L_MIN, 1) * L_MIN) for test in recordings(0.0, noise=0.01)],
            [
                replace(test, q=test.q * (1 + 0.02 * np.random.default_rng(1).standard_normal(test.q.size)))
                for test in recordings(0.0, noise=0.0)
            ],
        ],
        ids=["noise", "simulated", "zero seen", "floor, no noise", "floor", "coarse", "noise of the flow itself"],
    )
    def test_a_meter_that_shows_its_zero_or_has_a_floor_is_not_blamed(self, tests):
        valve = identify(tests, OPTIONS)
        assert not warned(valve, "zero-hidden")
        assert valve.positive.certificate.unseen_below_L_min == valve.positive.certificate.level_L_min


class TestAnotherSolenoid:
    """Flow that the other solenoid drives while the command rests is no rest: case 65 and its kin."""

    @staticmethod
    def beside(zero=0.0, *, first=True, sign=-1, share=1.0, steps=False):
        """Ramps of one solenoid, before or after those of the other, whose command is not in the recording."""
        tests = []
        for test in recordings(0.0, zero=zero):
            at = np.linspace(0, 2, test.u.size)
            other = np.where((at > 0.5) & (at < 1.5), 1.0, 0.0) if steps else np.clip(1 - 2 * abs(at - 1), 0, None)
            noise = np.random.default_rng(5).normal(0, 0.05, at.size)
            flow = (sign * share * other * test.q.max() / L_MIN + zero + noise) * L_MIN
            own = [(flow, 0.0 * test.u), (test.q, test.u)][:: 1 if first else -1]
            q, u = (np.concatenate(each) for each in zip(*own, strict=True))
            time = np.arange(q.size) * (test.time[1] - test.time[0])
            tests.append(replace(test, time=time, u=u, q=q, dp=np.full(q.size, test.dp[0])))
        return tests

    @pytest.mark.parametrize(
        "made",
        [
            {}, {"sign": 1}, {"first": False}, {"first": False, "sign": 1}, {"steps": True}, {"share": 0.3},
            {"zero": 0.2}, {"steps": True, "sign": 1, "first": False},
        ],
    )  # fmt: skip
    def test_it_does_not_shift_the_zero_and_is_said(self, made):
        valve = identify(self.beside(**made), OPTIONS)
        alone = identify(recordings(0.0, zero=made.get("zero", 0.0)), OPTIONS)
        for test, one in zip(valve.positive.tests, alone.positive.tests, strict=True):
            assert test.u_knee_falling_V == pytest.approx(one.u_knee_falling_V, abs=2e-3)
            assert test.u_guard_lower_V < CLOSING
        assert len(warned(valve, "flow-at-rest")) == 1
        assert bool(warned(valve, "meter-zero")) == bool(made.get("zero"))

    @pytest.mark.parametrize("tau_s", [0.2, 2.0])
    def test_a_flow_that_dies_away_after_a_step_is_none(self, tau_s):
        tests = []
        for test in recordings(0.0):
            left = test.q.max() * np.exp(-np.arange(1000) / 50 / tau_s)
            rest = left + np.random.default_rng(6).normal(0, 0.05 * L_MIN, 1000)
            q, u = np.concatenate([test.q, rest]), np.concatenate([test.u, np.zeros(1000)])
            u[test.u.size - 1] = 10.0
            time = np.arange(q.size) * 0.02
            tests.append(replace(test, time=time, u=u, q=q, dp=np.full(q.size, test.dp[0])))
        assert not warned(identify(tests, OPTIONS), "flow-at-rest")

    @pytest.mark.parametrize("per_MPa", [0.0, 0.3])
    def test_neither_is_a_leak(self, per_MPa):
        assert not warned(identify(recordings(per_MPa), OPTIONS), "flow-at-rest")
