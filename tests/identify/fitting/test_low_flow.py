"""Flows measured by hand below the meter's floor: of valves whose small flows are known, behind a meter with one."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify_sides
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.low_flow import LowFlow

L_MIN, MPA = 1e-3 / 60, 1e6
PRESSURES = (1.0, 3.0, 5.0)
FLOOR = 0.6


@dataclass(frozen=True)
class Valve:
    """An edge that opens with a small gain first: a notch, whose flow the meter does not show. V, L/min, MPa."""

    knee_V: float = 5.4
    knee_V_MPa: float = -0.05
    hysteresis_V: float = 0.1
    gain: float = 4.0
    notch_V: float = 0.0
    notch_gain: float = 0.2

    def flow(self, u_V, dp_MPa, *, rising):
        knee = self.knee_V + self.knee_V_MPa * dp_MPa - (0.0 if rising else self.hysteresis_V)
        main = self.gain * np.maximum(u_V - knee, 0.0)
        notch = self.notch_gain * np.clip(u_V - (knee - self.notch_V), 0.0, self.notch_V)
        return (main + notch) * np.sqrt(dp_MPa)

    def ramp(self, dp_MPa, seed=0):
        up = np.linspace(0, 10, 5000)
        u = np.concatenate([up, up[::-1]])
        rising = np.arange(u.size) < up.size
        q = np.where(rising, self.flow(u, dp_MPa, rising=True), self.flow(u, dp_MPa, rising=False))
        noise = 0.05 * np.random.default_rng([seed, int(dp_MPa)]).standard_normal(u.size)
        read = np.where(q < FLOOR, 0.0, q + noise)
        return RampTest(
            source=f"ramp_{dp_MPa:g}.csv", sha256=f"{int(dp_MPa):064d}", time=np.arange(u.size) / 50.0, u=u,
            q=read * L_MIN, dp=np.full(u.size, dp_MPa * MPA),
        )  # fmt: skip

    def reading(self, u_V, dp_MPa, branch="falling", error=0.005):
        flow = float(self.flow(np.array(u_V), dp_MPa, rising=branch == "rising"))
        return LowFlow(
            source=f"low-flow reading {1e3 * u_V:.0f}{1e3 * dp_MPa:.0f}", branch=branch, u_V=u_V, dp_MPa=dp_MPa,
            q_L_min=flow, q_error_L_min=error,
        )  # fmt: skip


SHARP, NOTCHED = Valve(), Valve(notch_V=0.6)
RAMPS = {valve: [valve.ramp(dp) for dp in PRESSURES] for valve in (SHARP, NOTCHED)}


def identified(valve, rows=(), **options):
    chosen = IdentifyOptions(meter_floor=FLOOR * L_MIN, meter_lag=0.0, meter_lag_tolerance=0.0, **options)
    model = identify_sides(RAMPS[valve], chosen, None, rows).model
    return model


def side_of(*args, **options):
    return identified(*args, **options).positive


@cache
def thresholds(valve, **options):
    return side_of(valve, **options).curve.u_threshold_V


def at_thresholds(valve, beyond=0.0, branch="falling", **options):
    """Return readings at every test's threshold, or so many volts beyond."""
    pairs = zip(PRESSURES, thresholds(valve, **options), strict=True)
    return [valve.reading(u + beyond, dp, branch) for dp, u in pairs]


def confirming(valve, beyond=0.5):
    """Return a reading in the meter's range, which the ramps confirm."""
    return valve.reading(thresholds(valve)[1] + beyond, 3.0)


def codes(model):
    return [warning.code for warning in model.warnings]


class TestAReadingThatAgrees:
    def test_lowers_the_level_below_which_nothing_is_seen(self):
        rows = at_thresholds(SHARP, 0.002)
        before, after = side_of(SHARP), identified(SHARP, [*rows, confirming(SHARP)])
        assert before.certificate.unseen_below_L_min == before.certificate.level_L_min >= FLOOR
        basis = after.positive.certificate
        worst = max(row.at_most_L_min for row in rows)
        assert basis.unseen_below_L_min == pytest.approx(worst, abs=1e-6) and worst < 0.05
        assert basis.level_L_min == before.certificate.level_L_min
        assert after.positive.curve.u_lower_V == before.curve.u_lower_V
        assert "onset-hidden" in codes(identified(SHARP)) and "onset-hidden" not in codes(after)
        assert "low-flow" not in codes(after)

    def test_is_kept(self):
        rows = at_thresholds(SHARP, 0.002)
        kept = identified(SHARP, rows).positive.low_flow
        assert [row.source for row in kept] == [row.source for row in rows]

    def test_says_nothing_where_it_is_below_the_threshold(self):
        """The next closing may be lower than the one that was measured: the bound counts on that, the reading not."""
        bounds = side_of(SHARP).curve.u_lower_V
        rows = [SHARP.reading(u, dp) for dp, u in zip(PRESSURES, bounds, strict=True)]
        model = identified(SHARP, [*rows, confirming(SHARP)])
        assert model.positive.certificate.unseen_below_L_min >= FLOOR
        assert "low-flow" in codes(model) and "onset-hidden" in codes(model)

    def test_says_nothing_of_closing_where_it_was_taken_on_opening(self):
        model = identified(SHARP, [*at_thresholds(SHARP, 0.002, "rising"), confirming(SHARP)])
        assert model.positive.certificate.unseen_below_L_min >= FLOOR and "low-flow" in codes(model)

    def test_says_nothing_of_a_test_at_another_pressure_drop(self):
        model = identified(SHARP, [*at_thresholds(SHARP, 0.002)[1:], confirming(SHARP)])
        assert model.positive.certificate.unseen_below_L_min >= FLOOR and "low-flow" in codes(model)

    def test_in_the_range_of_the_meter_tells_nothing_of_the_bound(self):
        """Seeded: the reading that confirms the table stood for the one that the test lacked, and nothing said so."""
        rows = [row for row in at_thresholds(SHARP, 0.002) if row.dp_MPa != 3.0]
        model = identified(SHARP, [*rows, confirming(SHARP)])
        assert model.positive.certificate.unseen_below_L_min >= FLOOR and "low-flow" in codes(model)

    def test_at_a_lower_pressure_drop_counts_for_more_flow_at_the_test(self):
        rows = at_thresholds(SHARP, 0.002)
        near = [LowFlow(**{**_fields(row), "dp_MPa": 0.96 * row.dp_MPa, "q_L_min": 0.02}) for row in rows]
        near = [LowFlow(**{**_fields(row), "u_V": row.u_V + 0.02}) for row in near]
        found = side_of(SHARP, [*near, confirming(SHARP)])
        assert found.certificate.unseen_below_L_min == pytest.approx(0.025 / 0.96, abs=1e-6)

    def test_at_a_lower_pressure_drop_counts_from_the_threshold_there(self):
        """Seeded: 12 mV lower at 5 MPa than at 4.75 MPa, a threshold took that reading for one above it."""
        rows = [LowFlow(**{**_fields(row), "dp_MPa": 0.96 * row.dp_MPa}) for row in at_thresholds(SHARP, 0.002)]
        model = identified(SHARP, [*rows, confirming(SHARP)])
        assert model.positive.certificate.unseen_below_L_min >= FLOOR and "low-flow" in codes(model)

    def test_takes_the_least_of_several_and_the_worst_of_the_tests(self):
        rows = [row for beyond in (0.002, 0.02) for row in at_thresholds(SHARP, beyond)]
        first = max(row.at_most_L_min for row in rows[:3])
        found = side_of(SHARP, [*rows, confirming(SHARP)])
        assert found.certificate.unseen_below_L_min == pytest.approx(first, abs=1e-6)

    def test_whose_error_is_larger_than_the_level_lowers_nothing(self):
        rows = [SHARP.reading(row.u_V, row.dp_MPa, error=2.0) for row in at_thresholds(SHARP, 0.002)]
        assert side_of(SHARP, [*rows, confirming(SHARP)]).certificate.unseen_below_L_min >= FLOOR

    def test_comes_in_any_order(self):
        rows = [*at_thresholds(SHARP, 0.002), confirming(SHARP)]
        assert side_of(SHARP, rows).certificate == side_of(SHARP, rows[::-1]).certificate


class TestReadingsThatNothingConfirms:
    """Below the meter's floor the ramps contradict nothing: of another valve no flow at all is right anywhere there."""

    @staticmethod
    def rows(flow=0.0, *more):
        at = at_thresholds(SHARP, 0.002)
        return [*(LowFlow(**{**_fields(row), "q_L_min": flow}) for row in at), *more]

    def assert_unseen(self, rows):
        model = identified(SHARP, rows)
        assert model.positive.certificate.unseen_below_L_min >= FLOOR
        assert {"low-flow", "onset-hidden"} <= set(codes(model))
        return model

    def test_leaves_the_level_as_the_meter_has_it(self, wording):
        model = self.assert_unseen(self.rows())
        found = next(each for each in model.warnings if each.code == "low-flow")
        wording("low flow: a table that nothing confirms", found.text)

    def test_is_not_confirmed_by_a_reading_below_the_level(self):
        self.assert_unseen(self.rows(0.0, SHARP.reading(thresholds(SHARP)[1] + 0.05, 3.0)))

    def test_is_not_confirmed_by_a_reading_whose_error_hides_the_flow(self):
        self.assert_unseen(self.rows(0.0, SHARP.reading(thresholds(SHARP)[1] + 0.5, 3.0, error=2.5)))

    def test_is_not_confirmed_by_one_on_opening(self):
        self.assert_unseen(self.rows(0.0, SHARP.reading(thresholds(SHARP)[1] + 0.6, 3.0, "rising")))

    def test_of_a_valve_that_opens_a_quarter_of_a_volt_later_is_refused_where_it_could_be_seen(self, wording):
        with wording.refusal(InputError):
            identified(SHARP, self.rows(0.0, Valve(knee_V=5.65).reading(thresholds(SHARP)[1] + 0.5, 3.0)))


class TestReadingsThatContradictOneAnother:
    """The one that shows more, at a lower command, counts: seeded, the least of all was taken."""

    def unseen(self, *more):
        at_threshold = [*at_thresholds(SHARP, 0.002), confirming(SHARP)]
        return side_of(SHARP, [*at_threshold, *more]).certificate.unseen_below_L_min

    @pytest.mark.parametrize(("where", "dp"), [(-0.02, 3.0), (-0.02, 2.0), (0.001, 3.0)])
    @pytest.mark.parametrize("branch", ["falling", "rising"])
    def test_at_a_test_and_between_two(self, where, dp, branch):
        u = float(np.interp(dp, PRESSURES, thresholds(SHARP))) + where
        row = LowFlow(**{**_fields(SHARP.reading(u, dp, branch)), "q_L_min": 0.3})
        assert row.at_least_L_min > 0.05  # of what flows at the thresholds
        assert self.unseen(row) == pytest.approx(row.at_most_L_min, abs=1e-6)

    def test_one_that_shows_no_more_than_its_error_contradicts_none(self):
        row = SHARP.reading(thresholds(SHARP)[1] - 0.02, 3.0, error=0.5)
        assert self.unseen(row) == self.unseen()


def _fields(row):
    return {name: getattr(row, name) for name in row.__slots__}


class TestAReadingBelowTheThreshold:
    """A notch passes flow that the meter does not show: what the certificate would deny."""

    NONE = 0.02 * L_MIN

    def rows(self, depths=(0.1, 0.5, 0.65)):
        return [
            NOTCHED.reading(u - depth, dp) for dp, u in zip(PRESSURES, thresholds(NOTCHED), strict=True)
            for depth in depths
        ]  # fmt: skip

    def test_the_notch_is_one_that_the_meter_hides(self):
        found = side_of(NOTCHED)
        pairs = zip(PRESSURES, found.curve.u_lower_V, strict=True)
        flows = [float(NOTCHED.flow(np.array(u), dp, rising=False)) for dp, u in pairs]
        assert 0.05 < max(flows) < FLOOR

    def test_lowers_all_thresholds_to_a_command_at_which_there_is_none(self):
        before = side_of(NOTCHED, noise_level=self.NONE)
        model = identified(NOTCHED, [*self.rows(), confirming(NOTCHED)], noise_level=self.NONE)
        after = model.positive
        flows = [
            float(NOTCHED.flow(np.array(u), dp, rising=False))
            for dp, u in zip(PRESSURES, after.curve.u_lower_V, strict=True)
        ]
        assert max(flows) * L_MIN <= self.NONE
        depth = np.subtract(before.curve.u_threshold_V, after.curve.u_threshold_V)
        assert np.ptp(depth) < 1e-5 and depth[0] > 0.5
        assert after.certificate.unseen_below_L_min < 0.03
        warning = next(each for each in model.warnings if each.code == "low-flow")
        assert "closing" in warning.text and warning.source.startswith("low-flow reading")

    def test_counts_the_depth_from_the_threshold_at_the_pressure_drop_of_the_one_that_shows_none(self):
        """Seeded: a command below that of 5 MPa was taken for as far below that of 4.75 MPa, which is higher."""
        at_5, at_4_75 = (float(np.interp(dp, PRESSURES, thresholds(NOTCHED))) for dp in (5.0, 4.75))
        rows = [NOTCHED.reading(at_5 - 0.1, 5.0), NOTCHED.reading(at_5 - 0.65, 4.75)]
        depth = at_5 - side_of(NOTCHED, rows, noise_level=self.NONE).curve.u_threshold_V[2]
        assert depth == pytest.approx(0.65 + at_4_75 - at_5, abs=1e-5) and at_4_75 > at_5 + 0.01

    def test_lowers_them_all_by_one_reading_too(self):
        rows = [row for row in self.rows() if row.dp_MPa == 3.0]
        depths = np.subtract(thresholds(NOTCHED), side_of(NOTCHED, rows, noise_level=self.NONE).curve.u_threshold_V)
        assert depths.min() > 0.5

    def test_on_opening_lowers_closing_too_for_after_closing_as_much_flows_at_least(self):
        opens = side_of(NOTCHED).certified["opening"].u_threshold_V[1]
        closes = thresholds(NOTCHED)[1]
        rows = [NOTCHED.reading(closes - 0.1, 3.0, "rising"), NOTCHED.reading(closes - 0.8, 3.0, "falling")]
        assert opens > closes
        assert side_of(NOTCHED, rows, noise_level=self.NONE).curve.u_threshold_V[1] == pytest.approx(
            closes - 0.8, abs=2e-3
        )

    def test_without_one_that_shows_none_is_refused_in_one_sentence(self, wording):
        with wording.refusal(InputError):
            identified(NOTCHED, self.rows((0.1,)), noise_level=self.NONE)

    def test_of_less_than_what_may_flow_at_zero_is_none(self):
        before = thresholds(NOTCHED, zero_flow=0.5 * L_MIN)
        after = side_of(NOTCHED, self.rows(), zero_flow=0.5 * L_MIN)
        assert after.curve.u_threshold_V == before

    def test_within_its_error_of_none_lowers_nothing(self):
        rows = [NOTCHED.reading(row.u_V, row.dp_MPa, error=0.6) for row in self.rows()]
        assert side_of(NOTCHED, rows, noise_level=self.NONE).curve.u_threshold_V == thresholds(
            NOTCHED, noise_level=self.NONE
        )


class TestAReadingThatNoRampAgreesWith:
    @pytest.mark.parametrize("factor", [1e-3, 1e3], ids=["mL/min for L/min", "L/min for mL/min"])
    def test_by_its_unit_is_refused(self, wording, factor):
        row = SHARP.reading(thresholds(SHARP)[1] + 0.8, 3.0)
        wrong = LowFlow(**{**_fields(row), "q_L_min": factor * row.q_L_min})
        assert side_of(SHARP, [row])
        with wording.refusal(InputError):
            identified(SHARP, [wrong])

    def test_of_a_valve_that_opens_earlier_is_refused(self, wording):
        with wording.refusal(InputError):
            identified(SHARP, [Valve(knee_V=4.4).reading(5.0, 3.0)])

    def test_at_no_tested_pressure_drop_is_refused(self, wording):
        with wording.refusal(InputError):
            identified(SHARP, [SHARP.reading(5.0, 7.0)])

    def test_beside_the_only_tested_pressure_drop_is_refused(self, wording, monkeypatch):
        monkeypatch.setitem(RAMPS, SHARP, RAMPS[SHARP][:1])
        with wording.refusal(InputError):
            identified(SHARP, [SHARP.reading(5.0, 7.0)])

    def test_of_a_side_without_a_ramp_is_refused(self, wording):
        row = SHARP.reading(5.0, 3.0)
        with wording.refusal(InputError):
            identified(SHARP, [LowFlow(**{**_fields(row), "u_V": -5.0})])


def test_the_negative_side_has_its_own_readings():
    from dataclasses import replace

    tests = [replace(test, u=-test.u, q=-test.q) for test in RAMPS[SHARP]]
    given = [*at_thresholds(SHARP, 0.002), confirming(SHARP)]
    rows = [LowFlow(**{**_fields(row), "u_V": -row.u_V}) for row in given]
    options = IdentifyOptions(meter_floor=FLOOR * L_MIN, meter_lag=0.0, meter_lag_tolerance=0.0)
    both = identify_sides([*RAMPS[SHARP], *tests], options, None, rows).model.sides
    assert both["negative"].certificate.unseen_below_L_min < 0.05 < both["positive"].certificate.unseen_below_L_min
    assert [row.u_V > 0 for row in both["negative"].low_flow] == [True] * 4 and not both["positive"].low_flow
