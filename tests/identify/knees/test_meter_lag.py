"""The meter's lag and its tolerance: each guard's bound goes down on its unsafe side; what contradicts it is said."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.core.option_readers import with_tolerance
from dzdesign.identify.identification import identify
from dzdesign.identify.knees.meter import LONGEST_UNKNOWN
from dzdesign.identify.options import IdentifyOptions
from dzdesign.stages.identify import IdentifyArguments, identify_options
from tests.support.bench_recordings import Valve, record

OPENING, CLOSING = 5.4, 5.2
TRUTH = {"opening": OPENING, "closing": CLOSING, "mean": (OPENING + CLOSING) / 2}


def recordings(lag, *, seconds=25.0, noise=0.03, opening=OPENING, pressures=(1.0, 4.0)):
    """Ramps of a quarter of the usual time: the same samples, four times as fast."""
    found = []
    for dp in pressures:
        valve = Valve(opening=opening, closing=CLOSING, noise=noise, lag=lag * 100 / seconds)
        test = record(valve, dp, source=f"{dp:g}_{seconds:g}.csv")
        found.append(replace(test, time=test.time * seconds / 100))
    return found


def bounds(tests, **choices):
    """The offsets of the three guards at the first test, with what the bounds allow for scatter set to none."""
    valve = identify(tests, IdentifyOptions(repeatability=0.0, **choices))
    return {name: guard.u_min0_V for name, guard in valve.positive.certified.items()}


def codes(tests, **choices):
    return [warning.code for warning in identify(tests, IdentifyOptions(repeatability=0.0, **choices)).warnings]


class TestTolerance:
    @pytest.mark.parametrize(("lag", "guards"), [(0.055, ("closing", "mean")), (0.145, ("opening", "mean"))])
    def test_a_wrong_lag_within_its_tolerance_leaves_the_bounds_below_the_thresholds(self, lag, guards):
        tests = recordings(lag, seconds=50.0)
        found, exact = bounds(tests, meter_lag=0.1), bounds(tests, meter_lag=0.1, meter_lag_tolerance=0.0)
        for guard in guards:
            assert TRUTH[guard] - 0.06 < found[guard] < TRUTH[guard]
        assert exact[guards[0]] - found[guards[0]] == pytest.approx(0.05 * 0.2, rel=0.05)
        assert exact["mean"] == pytest.approx(found["mean"], abs=1e-4)  # both ways at the same rate: it cancels
        assert guards[0] == "opening" or exact["closing"] > CLOSING  # it takes the tolerance

    def test_no_lag_declared_is_the_safe_side_of_the_closing_and_counts_on_the_opening(self):
        tests = recordings(0.19)
        found = bounds(tests)
        for guard, truth in TRUTH.items():
            assert found[guard] < truth
        valve = identify(tests)
        assert (valve.meter.lag_longer_s, valve.meter.lag_shorter_s) == (LONGEST_UNKNOWN, 0.0)
        assert "lag-unknown" in [warning.code for warning in valve.warnings]

    @pytest.mark.parametrize(
        ("lag", "stated", "longer", "shorter"),
        [(0.1, None, 0.05, 0.05), (1.0, None, 0.2, 0.2), (0.1, 0.02, 0.02, 0.02), (0.02, None, 0.05, 0.02)],
    )
    def test_without_a_word_it_is_a_fifth_and_no_meter_runs_ahead_of_the_flow(self, lag, stated, longer, shorter):
        tests = recordings(lag, seconds=100.0, pressures=(1.0,))
        meter = identify(tests, IdentifyOptions(meter_lag=lag, meter_lag_tolerance=stated)).meter
        assert (meter.lag_longer_s, meter.lag_shorter_s) == (pytest.approx(longer), pytest.approx(shorter))

    def test_each_test_pays_at_its_own_rate(self):
        slow, fast = recordings(0.1, seconds=100.0)[:1], recordings(0.1, seconds=20.0)[1:]
        options = IdentifyOptions(repeatability=0.0, meter_lag=0.1)
        some, none = (
            identify([*slow, *fast], each).positive.certified["closing"].u_lower_V
            for each in (options, replace(options, meter_lag_tolerance=0.0))
        )
        paid = [without - with_it for with_it, without in zip(some, none, strict=True)]
        assert paid == pytest.approx([0.1 * 0.05, 0.5 * 0.05], rel=0.02)

    @pytest.mark.parametrize(
        "text", ["0.1 s +- 0.02 s", "0.1 s ± 20 ms", "100ms +/- 0.02s", "0.1 s +- 20 %", "0.1s±20.0%"]
    )
    def test_it_is_read_beside_the_lag(self, text):
        assert with_tolerance("time")(text, "--meter-lag") == pytest.approx((0.1, 0.02))

    def test_the_options_carry_it(self):
        given = identify_options(IdentifyArguments(["a.csv"], meter_lag="0.1 s ± 0.02 s", noise_level="0.3 L/min"))
        assert (given.meter_lag, given.meter_lag_tolerance) == pytest.approx((0.1, 0.02))
        assert given.noise_level == pytest.approx(0.3 / 6e4)
        plain = identify_options(IdentifyArguments(["a.csv"], meter_lag="0.1 s"))
        assert (plain.meter_lag, plain.meter_lag_tolerance) == (0.1, None)

    @pytest.mark.parametrize(
        "text",
        ["0.1 s +- 0.02", "0.1 s +-", "± 0.02 s", "0.1 s ± 1 ms ± 1 ms", "0.1 s ± 1 V",
         "0.1 s ± -3 %", "0.1 s +- 20"],
    )  # fmt: skip
    def test_half_a_tolerance_is_refused(self, text):
        with pytest.raises(InputError, match="--meter-lag"):
            with_tolerance("time")(text, "--meter-lag")

    def test_a_negative_one_is_refused(self):
        with pytest.raises(InputError, match="meter_lag_tolerance is negative"):
            IdentifyOptions(meter_lag=0.1, meter_lag_tolerance=-0.1)


class TestOneRate:
    """Ramps of one rate show neither whether a declared lag is right, nor whether a hysteresis is the valve's."""

    @staticmethod
    def warned(tests, code, **choices):
        valve = identify(tests, IdentifyOptions(repeatability=0.0, **choices))
        return [warning for warning in valve.warnings if warning.code == code]

    def test_a_wide_hysteresis_may_be_the_lag(self, wording):
        """The meter lags by 0.5 s, and 0.1 s are declared: half of the difference is the meter's."""
        fast = recordings(0.5, seconds=50.0)
        (warning,) = self.warned(fast, "hysteresis", meter_lag=0.1)
        wording("meter lag: a hysteresis on ramps of one rate", warning.text)

    def test_on_ramps_of_two_rates_it_is_the_valve(self, wording):
        both = recordings(0.0, seconds=100.0, opening=5.6) + recordings(0.0, seconds=50.0, opening=5.6)
        (warning,) = self.warned(both, "hysteresis", meter_lag=0.0)
        wording("meter lag: a hysteresis on ramps of two rates", warning.text)

    @pytest.mark.parametrize(
        ("seconds", "lag", "said"),
        [((50.0,), 0.1, True), ((100.0,), 0.1, False), ((50.0,), 0.0, False), ((100.0, 50.0), 0.1, False)],
        ids=["it matters", "it is small", "none is declared to matter", "two rates check it"],
    )
    def test_a_declared_lag_that_nothing_checks_is_said_where_it_matters(self, seconds, lag, said, wording):
        tests = [test for each in seconds for test in recordings(0.1, seconds=each)]
        warnings = self.warned(tests, "lag-unchecked", meter_lag=lag)
        assert bool(warnings) is said
        for warning in warnings:
            wording("meter lag: a declared one that nothing checks", warning.text)


class TestContradiction:
    def test_two_rates_that_show_another_lag_are_said_and_the_bounds_allow_for_both(self):
        tests = recordings(0.1, seconds=100.0) + recordings(0.1, seconds=20.0)
        assert "lag-contradicted" not in codes(tests, meter_lag=0.1)
        assert "lag-contradicted" in codes(tests, meter_lag=0.4)
        found = bounds(tests, meter_lag=0.4)
        assert found["closing"] < CLOSING
        assert bounds(tests, meter_lag=0.02, meter_lag_tolerance=0.0)["opening"] < OPENING

    def test_a_lag_that_turns_the_branches_round_is_said(self):
        tests = recordings(0.1, opening=CLOSING + 0.01)
        assert "branch-order" not in codes(tests, meter_lag=0.1)
        assert "branch-order" in codes(tests, meter_lag=0.2)


def late(tests, seconds):
    """The same, their column of the command late: what a fieldbus reads back."""
    return [replace(test, u=np.interp(test.time - seconds, test.time, test.u)) for test in tests]


class TestLateCommand:
    @pytest.mark.parametrize(("seconds", "lag", "sign"), [(0.3, 0.0, 1), (0.06, 0.0, 1), (1.1, 0.1, 1), (0.3, 0.1, -1)])
    def test_it_is_said_and_taken_out(self, seconds, lag, sign, wording):
        tests = late(recordings(lag, seconds=100.0) + recordings(lag, seconds=40.0), seconds)
        tests = [replace(test, u=sign * test.u, q=sign * test.q) for test in tests]
        valve = identify(tests, IdentifyOptions(repeatability=0.0))
        assert valve.meter.lag_s == pytest.approx(lag - seconds, abs=0.02)
        (side,) = valve.sides.values()
        for test in side.tests:
            assert test.u_knee_falling_V == pytest.approx(CLOSING, abs=0.004)
        bound = side.certified["closing"].u_min0_V
        assert CLOSING - 0.02 < bound < CLOSING
        (said,) = [warning for warning in valve.warnings if warning.code == "command-late"]
        if sign > 0 and seconds == 0.3:
            wording("meter lag: a command that comes late", said.text)

    def test_a_declared_lag_that_it_contradicts_is_said_and_the_bounds_allow_for_it(self, wording):
        tests = late(recordings(0.0, seconds=100.0) + recordings(0.0, seconds=40.0), 0.3)
        options = IdentifyOptions(repeatability=0.0, meter_lag=0.0, meter_lag_tolerance=0.02)
        valve = identify(tests, options)
        assert valve.positive.certified["closing"].u_min0_V < CLOSING
        (said,) = [warning for warning in valve.warnings if warning.code == "lag-contradicted"]
        wording("meter lag: a declared one beside a late command", said.text)

    def test_what_does_not_stand_out_is_not_taken_but_counts_in_the_bounds(self):
        tests = late(recordings(0.0, seconds=100.0) + recordings(0.0, seconds=40.0), 0.005)
        meter = identify(tests, IdentifyOptions(repeatability=0.0)).meter
        assert (meter.lag_s, meter.lag_is) == (0.0, "identified") and meter.lag_shorter_s > 0.005

    def test_a_meter_that_lags_makes_no_command_late(self):
        assert "command-late" not in codes(recordings(0.1, seconds=100.0) + recordings(0.1, seconds=40.0))
