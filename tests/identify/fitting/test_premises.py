"""Premises about the threshold between the tests: the bound that each gives, its own test, and which one is taken."""

from dataclasses import replace
from fractions import Fraction

import cvxpy as cp
import numpy as np
import pytest
from curve_premises import failures
from scipy.special import ndtr

from dzdesign.core.errors import InputError
from dzdesign.design.lot_valves import LotSide
from dzdesign.identify.constants import REFUSED
from dzdesign.identify.fitting.offsets import PARTS, POINTS, fit_offset_under
from dzdesign.identify.fitting.premises import (
    bound_line,
    confidence_at_tests,
    critical_value,
    find_curvature,
    one_way_p,
)
from dzdesign.identify.knees.between_ramps import BetweenRamps
from dzdesign.identify.knees.scatter_checks import ScatterChecks
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve import estimated_curvature
from dzdesign.identify.valve.certified_bound import CertifiedBound, largest_excess
from dzdesign.identify.valve.estimated_curvature import second_differences
from dzdesign.verify.exhaustive.zero_command import sagging_least
from tests.support.repeatable_valves import identify
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

SIX = np.array([0.5, 1.0, 2.0, 3.0, 4.0, 5.0])
QUIET = IdentifyOptions(meter_lag=0.0)
#: Draws of each kind here; the benchmark takes 3000.
DRAWS = 500
#: Most failures of 500 at 1 %, by chance (binomial, 99.9 %).
MOST = 14


def between(tests: int, sd: float = 0.0) -> BetweenRamps:
    """What differs from ramp to ramp, of tests with one ramp each and a declared scatter."""
    return BetweenRamps(
        sd=sd, degrees=np.inf, origin="declared", noise=0.0, covariance=np.eye(tests), drift=None,
        no_drift="order unknown", shifts=(), checks=ScatterChecks(largest=None, outlying=None, serial=None),
    )  # fmt: skip


class TestLine:
    def test_a_path_that_does_not_turn_wants_one_quantile_and_one_that_turns_more(self):
        still, tests = np.ones((101, 101)), 6
        assert critical_value(still, np.inf, 0.99, tests) == pytest.approx(2.3263, abs=1e-3)
        angle = np.linspace(0, np.pi / 2, 101)
        turning = np.cos(angle[:, None] - angle[None, :])
        quarter = critical_value(turning, np.inf, 0.99, tests)
        assert np.exp(-(quarter**2) / 2) / 4 + ndtr(-quarter) == pytest.approx(0.01, rel=1e-3)
        assert critical_value(turning, 14.0, 0.99, tests) > 3.0
        # Two tests: Bonferroni over both is less than what the whole path wants.
        assert critical_value(turning, np.inf, 0.99, 2) == pytest.approx(2.5758, abs=1e-3)

    def test_it_is_sharper_than_the_tests_where_all_of_them_tell_of_it(self):
        se = np.full(6, 0.005)
        line = bound_line(SIX, 5 - 0.08 * SIX, se, np.zeros(6), between(6), confidence=0.99, u_max=10.0)
        np.testing.assert_allclose(line.value, 5 - 0.08 * SIX, atol=1e-9)
        assert np.all(line.value - line.bound < 0.8 * 3.55 * se) and line.p_value == pytest.approx(1.0)

    def test_a_systematic_error_of_a_test_reaches_the_line_by_its_weight(self):
        se, budget = np.full(6, 0.005), np.array([0, 0, 0, 0, 0, 0.03])
        plain, with_budget = (
            bound_line(SIX, 5 - 0.08 * SIX, se, each, between(6), confidence=0.99, u_max=10.0).bound
            for each in (np.zeros(6), budget)
        )
        worst = np.array(bound_line(SIX, 5 - 0.08 * SIX - budget, se, np.zeros(6), between(6), confidence=0.99,
                                    u_max=10.0).bound)  # fmt: skip
        assert np.all(with_budget <= np.minimum(plain, worst) + 1e-9)

    def test_a_bent_threshold_is_refused(self):
        se = np.full(6, 0.003)
        bent = 5 - 0.08 * SIX + 0.01 * SIX**2
        assert bound_line(SIX, bent, se, np.zeros(6), between(6), confidence=0.99, u_max=10.0).p_value < 1e-6
        # The same bend is nothing beside a scatter of 0.1 V.
        assert bound_line(SIX, bent, se, np.zeros(6), between(6, 0.1), confidence=0.99, u_max=10.0).p_value > 0.9


class TestCurvature:
    def test_second_differences_are_the_curvature_of_a_parabola(self):
        np.testing.assert_allclose(second_differences(SIX) @ (0.03 * SIX**2 / 2 + SIX - 4), 0.03)

    def test_m_covers_a_kink_anywhere_between_two_tests(self):
        for kink in np.arange(1.1, 4.0, 0.1):
            truth = 5 - 0.1 * SIX + 0.06 * np.maximum(SIX - kink, 0)
            found = find_curvature(SIX, truth, 1e-12 * np.eye(6), 14.0, None)
            bound = CertifiedBound.of("smooth", SIX.tolist(), truth.tolist(), found.allowed.tolist(), "decreasing")
            fine = np.linspace(0.5, 5, 901)
            assert np.all(bound.in_doubles(fine) <= 5 - 0.1 * fine + 0.06 * np.maximum(fine - kink, 0) + 1e-9)
        chords = np.interp(2.5, SIX, 5 + 0.06 * np.maximum(SIX - 2.5, 0))
        assert chords > 5 + 0.01  # without M the kink lies far below

    def test_a_declared_one_that_the_tests_contradict_is_refused(self):
        covariance, bent = 1e-6 * np.eye(6), 0.05 * SIX**2 / 2
        assert find_curvature(SIX, bent, covariance, 14.0, 0.01).p_value < 1e-4
        assert find_curvature(SIX, bent, covariance, 14.0, 0.06).p_value == 1.0
        assert find_curvature(SIX, -bent, covariance, 14.0, 0.01).p_value == 1.0  # it lies above its chords

    @pytest.mark.parametrize("shape", ["line", "convex", "concave", "kink"])
    def test_the_bound_lies_above_the_threshold_in_one_per_cent_at_most(self, shape):
        for tests in (3, 6):
            assert failures("smooth", shape, tests, (0.006, 0.0), DRAWS, declared=False, seed=3)[0] <= MOST
            assert failures("smooth", shape, tests, (0.0012, 0.005), DRAWS, declared=True, seed=4)[0] <= MOST
        if shape == "line":
            assert failures("line", shape, 2, (0.006, 0.0), DRAWS, declared=False, seed=5)[0] <= MOST
            assert failures("line", shape, 6, (0.001, 0.005), DRAWS, declared=False, seed=6)[0] <= MOST

    def test_the_check_would_see_chords_that_sag_too_little(self, monkeypatch):
        monkeypatch.setattr(estimated_curvature, "INNER_FACTOR", 0.0)
        monkeypatch.setattr(estimated_curvature, "END_FACTOR", 0.0)
        assert failures("smooth", "kink", 6, (0.001, 0.0), 200, declared=False, seed=3)[0] > MOST


class TestBound:
    @pytest.mark.parametrize("seed", range(5))
    def test_what_verify_argues_anew_is_the_same_and_exact(self, seed):
        rng = np.random.default_rng(seed)
        lower = np.round(5 - 0.08 * SIX + 0.01 * rng.standard_normal(6), 7).tolist()
        bends = np.round(rng.uniform(0, 0.4, 5), 7).tolist()
        ours = CertifiedBound.of("smooth", SIX.tolist(), lower, bends, "decreasing")
        side = LotSide(
            trend="decreasing", confidence=0.99, premise="smooth", curvature_V_MPa2=tuple(bends),
            dp_MPa=tuple(SIX.tolist()), u_lower_V=tuple(lower),
        )  # fmt: skip
        for low, width in zip(rng.uniform(0.5, 4.5, 40), rng.uniform(0, 0.5, 40), strict=True):
            ends = Fraction(low).limit_denominator(10**6), Fraction(low + width).limit_denominator(10**6)
            pieces = ours.touching(*ends)
            least = min(each.least(max(ends[0], each.from_MPa), min(ends[1], each.to_MPa)) for each in pieces)
            assert sagging_least(side, *(np.array([end], dtype=object) for end in ends))[0] == least
            assert float(least) <= float(ours.in_doubles(np.linspace(*map(float, ends), 200)).min()) + 1e-12
            doubles = sagging_least(side, *(np.array([float(end)]) for end in ends))[0]
            assert doubles == pytest.approx(float(least), abs=1e-12)

    @pytest.mark.parametrize("trend", ["decreasing", "increasing"])
    def test_the_referee_finds_the_same_offset(self, trend):
        sign = -1 if trend == "decreasing" else 1
        value = 5 + sign * 0.08 * SIX + np.array([0.004, -0.002, 0.01, 0, -0.006, 0.003])
        lower, bends = value - 0.02, [0.3, 0.08, 0.08, 0.08, 0.6]
        bound = CertifiedBound.of("smooth", SIX.tolist(), lower.tolist(), bends, trend)
        found = fit_offset_under(bound, SIX, value, 1, trend=trend, u_max=10.0)
        nodes = found.dp_MPa
        points = np.interp(np.arange(5 * PARTS * POINTS + 1) / (PARTS * POINTS), np.arange(6), SIX)
        offset = cp.Variable(nodes.size)
        shares = np.array([np.interp(points, nodes, unit) for unit in np.eye(nodes.size)]).T
        length = np.gradient(nodes) / np.ptp(nodes)
        problem = cp.Problem(
            cp.Minimize(cp.sum(cp.multiply(length, cp.square(np.interp(nodes, SIX, value) - offset))) * 1e4),
            [shares @ offset <= bound.in_doubles(points), sign * cp.diff(offset) >= 0],
        )
        problem.solve(solver=cp.CLARABEL, tol_gap_abs=1e-12, tol_gap_rel=1e-12, tol_feas=1e-12)
        # Ours is lowered by what the bound lacks between the points.
        lowered = float(np.max(offset.value - found.offset))
        assert 0 < lowered < 1e-4
        np.testing.assert_allclose(found.offset, offset.value - lowered, atol=2e-6)
        assert largest_excess(bound, nodes, found.offset) <= 0
        # Somewhere the offset lies on the bound, somewhere it does not.
        slack = bound.in_doubles(points) - shares @ offset.value
        assert 3 < np.sum(slack < 1e-6) < points.size / 2 and found.active


def ramps(threshold, pressures=(1.0, 2.0, 3.0, 4.0, 5.0), **options) -> list[RampTest]:
    """Ramp tests of valves that open at a threshold of the pressure drop and close 0.1 V below."""
    return [
        synthetic_ramp(dp, Truth(knee_rising=threshold(dp), slope=4 * np.sqrt(dp), noise=0.02), seed=row, **options)
        for row, dp in enumerate(pressures)
    ]


def codes(valve) -> list[str]:
    return [warning.code for warning in valve.warnings]


class TestChoice:
    def test_two_pressures_take_no_premise_but_monotone_and_say_what_others_leave(self):
        valve = identify(ramps(lambda dp: 5.6 - 0.06 * dp, (1.0, 5.0)), QUIET)
        curve = valve.positive.curve
        assert curve.premise == "monotone"
        assert [(each.premise, each.lack_of_fit_p) for each in curve.premises] == [("line", None), ("monotone", None)]
        line, monotone = (each.dead_zone_over_u_max for each in curve.premises)
        assert monotone - line > 0.02

    def test_what_a_premise_leaves_is_the_largest_between_the_tests_too(self):
        """With three tests M is large, and the offset sags most in the middle of an interval."""
        tests = ramps(lambda dp: 5.6 - 0.06 * dp + 0.002 * dp**2, (1.0, 3.0, 5.0))
        curve = identify(tests, replace(QUIET, curve="smooth")).positive.curve
        left = next(each.dead_zone_over_u_max for each in curve.premises if each.premise == "smooth")
        fine = np.linspace(1, 5, 2001)
        offset = np.interp(fine, curve.offset_dp_MPa, curve.offset_V)
        knee = np.interp(fine, curve.dp_MPa, curve.u_threshold_V) + 0.1  # opening lies above by the hysteresis
        dead = (knee - offset) / (10 - offset)
        assert left == pytest.approx(dead.max(), abs=2e-3)
        assert left > 1.2 * max(dead[np.searchsorted(fine, curve.dp_MPa)])

    def test_three_pressures_take_the_smooth_curve_and_two_with_a_declared_curvature(self):
        tests = ramps(lambda dp: 5.6 - 0.06 * dp)
        estimated = identify(tests, QUIET).positive.curve
        assert (estimated.premise, estimated.curvature_is) == ("smooth", "estimated")
        declared = identify([tests[0], tests[-1]], replace(QUIET, curvature=5e-3 / 1e12)).positive.curve
        assert (declared.premise, declared.curvature_is, declared.curvature_V_MPa2) == ("smooth", "declared", (5e-3,))
        for curve in (estimated, declared):
            fine = np.linspace(1, 5, 401)
            assert np.all(curve.bound("decreasing").in_doubles(fine) < 5.5 - 0.06 * fine)

    def test_smooth_with_two_pressures_needs_its_curvature(self):
        with pytest.raises(InputError, match="--curvature"):
            identify(ramps(lambda dp: 5.6 - 0.06 * dp, (1.0, 5.0)), replace(QUIET, curve="smooth"))

    @pytest.mark.parametrize(
        ("options", "refused"), [({"curve": "line"}, "line"), ({"curve": "smooth", "curvature": 1e-15}, "smooth")]
    )
    def test_a_premise_that_the_tests_refuse_is_not_taken(self, options, refused):
        valve = identify(ramps(lambda dp: 5.6 - 0.12 * dp + 0.01 * dp**2), replace(QUIET, **options))
        curve = valve.positive.curve
        assert curve.premise != refused and "premise-refused" in codes(valve)
        assert next(each.lack_of_fit_p for each in curve.premises if each.premise == refused) < 0.01

    def test_a_line_that_fits_is_taken_and_its_beta_is_known_better(self):
        tests = ramps(lambda dp: 5.6 - 0.06 * dp)
        line, smooth = (identify(tests, replace(QUIET, curve=curve)).positive for curve in ("line", "smooth"))
        assert line.curve.premise == "line" and not any(line.curve.curvature_V_MPa2)
        assert line.beta.beta[-1] == pytest.approx(5.2 / 5.44, abs=4 * line.beta.beta_se[-1])
        assert line.beta.beta_se[-1] < smooth.beta.beta_se[-1] and line.beta.beta_se[0] == 0
        np.testing.assert_allclose(np.diff(line.beta.beta, 2), 0, atol=2e-6)

    @pytest.mark.parametrize(("curvature", "got"), [(-2e-14, "-20 mV/MPa"), (1e296, "1e.311|inf mV/MPa")])
    def test_a_curvature_of_no_valve_is_refused_in_its_unit(self, curvature, got):
        with pytest.raises(InputError, match=got):
            IdentifyOptions(curvature=curvature)

    def test_a_curvature_beside_another_premise_is_refused(self):
        with pytest.raises(InputError, match="curvature"):
            IdentifyOptions(curve="line", curvature=1e-14)


class TestOneWay:
    def test_steps_the_wrong_way_by_three_margins_are_seen(self):
        """Ten standard errors of a test: three times the distance of its bound."""
        rng, covariance, seen = np.random.default_rng(8), 0.003**2 * np.eye(6), []
        for draw in range(200):
            truth = 5 - 0.08 * SIX
            row = draw % 5
            truth[row + 1] = truth[row] + 10 * 0.003
            p_value = one_way_p(truth + 0.003 * rng.standard_normal(6), covariance, 14.0, "decreasing")
            seen.append(p_value < REFUSED)
        assert np.mean(seen) > 0.95
        flat = [one_way_p(5 + 0.003 * rng.standard_normal(6), covariance, 1e6, "decreasing") for _ in range(1000)]
        assert np.mean(np.array(flat) < REFUSED) < 0.02

    @pytest.mark.parametrize("curve", [None, "monotone"])
    def test_it_is_said_and_by_default_not_relied_on(self, curve):
        dips = {1.0: 0.0, 2.0: 0.0, 3.0: -0.15, 4.0: 0.0, 5.0: 0.0}
        valve = identify(ramps(lambda dp: 5.6 - 0.06 * dp + dips[dp]), replace(QUIET, curve=curve))
        assert valve.positive.curve.premise == (curve or "smooth") and "not-monotone" in codes(valve)


def soft_ramp(dp: float, knee: float, width: float, seed: int) -> RampTest:
    """A ramp test whose flow begins as a square over `width`, half of it below the knee, 0.1 V lower on closing.

    The meter reads nothing below 0.6 L/min.
    """
    test = synthetic_ramp(dp, Truth(noise=0.0), rate_Hz=100)
    rising = np.arange(test.u.size) < test.u.size // 2
    beyond = np.clip(test.u - np.where(rising, knee, knee - 0.1) + width / 2, 0, None)
    flow = 4 * np.sqrt(dp) * np.where(beyond < width, beyond**2 / (2 * width), beyond - width / 2)
    read = flow + 0.15 * np.random.default_rng(seed).standard_normal(flow.size)
    return replace(test, q=np.where(read < 0.6, 0.0, read) * L_MIN, source=f"soft_{dp:g}.csv")


class TestTrend:
    @pytest.mark.parametrize("curve", ["monotone", None])
    def test_the_guarded_threshold_may_run_against_the_knees(self, curve):
        """The knee grows with dP, and the soft edge below it faster: the bound follows what is guarded."""
        pressures = (1.0, 2.0, 3.0, 4.0, 5.0)
        tests = [soft_ramp(dp, 5.0 + 0.01 * dp, 0.12 * dp, row) for row, dp in enumerate(pressures)]
        side = identify(tests, replace(QUIET, curve=curve)).positive
        knees = np.array([test.u_knee_falling_V for test in side.tests])
        assert np.all(np.diff(knees) > 0) and knees[-1] - knees[0] > 0.03
        assert side.trend != "increasing"
        guarded = np.array([test.u_guard_V for test in side.tests])
        assert guarded[-1] < guarded[0] - 0.03
        assert np.all(side.curve.bound(side.trend).in_doubles(np.array(pressures)) <= guarded)
        assert np.all(np.array(side.curve.u_offset_V) <= guarded)


def test_the_share_of_the_premise_is_kept():
    assert confidence_at_tests(0.99) == pytest.approx(0.9925)


@pytest.mark.parametrize(
    ("pressures", "curve", "said"),
    [
        ((1.0,), None, "at one tested pressure drop"),
        ((1.0, 5.0), None, "premise monotone, untested"),
        ((1.0, 3.0, 5.0), "smooth", "premise smooth, untested"),
        ((1.0, 2.0, 3.0, 5.0), "line", "premise line, not contradicted by the tests"),
    ],
)
def test_what_the_bounds_rest_on_between_the_tests_is_said(pressures, curve, said):
    tests = [synthetic_ramp(dp, Truth(knee_rising=5.4 - 0.05 * dp), rate_Hz=10.0) for dp in pressures]
    model = identify(tests, IdentifyOptions(curve=curve))
    assert said in model.positive.between_in_words("closing")
