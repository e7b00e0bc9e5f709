"""A threshold that the tests show lowest between two of them: `monotone` is not relied on there."""

from dataclasses import replace

import curve_choice
import numpy as np
import pytest
from curve_choice import certify, draw_curve, unsaid

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.identify.constants import REFUSED
from dzdesign.identify.fitting import certifying
from dzdesign.identify.fitting.premises import find_curvature
from dzdesign.identify.fitting.vertices import find_vertex
from dzdesign.identify.options import IdentifyOptions
from tests.identify.fitting.test_premises import codes, ramps
from tests.support.repeatable_valves import identify

QUIET = IdentifyOptions(meter_lag=0.0)
UNEVEN = np.array([0.5, 1.0, 2.0, 4.0, 5.0])


def lowest_at_4(dp, bend=0.08):
    """A threshold that opens at 5.1 V at 3 and at 5 MPa, and at 4 MPa by the bend, V/MPa², below."""
    return 5.1 + bend * ((dp - 4) ** 2 - 1)


class TestVertex:
    @pytest.mark.parametrize("mirrored", [False, True])
    def test_it_is_that_of_a_parabola_through_uneven_tests(self, mirrored):
        dp = -UNEVEN[::-1] if mirrored else UNEVEN
        curve = 0.05 * (UNEVEN - 2.7) ** 2
        vertex = find_vertex(dp, curve[::-1] if mirrored else curve, 1e-10 * np.eye(5), 14.0)
        assert (vertex.from_MPa, vertex.to_MPa) == ((-4.0, -2.0) if mirrored else (2.0, 4.0))
        assert vertex.at_MPa == pytest.approx(-2.7 if mirrored else 2.7)
        assert vertex.depth_V == pytest.approx(0.05 * 0.7**2) and vertex.significant

    @pytest.mark.parametrize("curve", [-((UNEVEN - 2.7) ** 2), -UNEVEN, (UNEVEN - 5) ** 2, (UNEVEN - 0.5) ** 2])
    def test_there_is_none_of_a_curve_that_runs_one_way_or_is_highest_between_two(self, curve):
        assert find_vertex(UNEVEN, curve, 1e-10 * np.eye(5), 14.0) is None

    def test_a_decay_whose_steps_are_a_third_of_the_former_is_not_touched_and_one_of_a_quarter_is(self):
        dp, covariance = np.arange(1.0, 6.0), 1e-12 * np.eye(5)
        assert find_vertex(dp, 0.34**dp, covariance, 14.0) is None
        assert find_vertex(dp, 0.25**dp, covariance, 14.0).significant

    def test_what_the_errors_may_make_is_not_significant(self):
        """Student, Bonferroni: with five degrees of freedom more of the same bend is wanted than with a hundred."""
        dp = np.array([1.0, 3.0, 5.0])
        curve, covariance = 0.004 * (dp - 4) ** 2, 0.001**2 * np.eye(3)
        few, many = (find_vertex(dp, curve, covariance, degrees).p_value for degrees in (5.0, 100.0))
        assert few > 10 * many and many < REFUSED
        assert not find_vertex(dp, curve, 100 * covariance, 100.0).significant
        # Errors that all tests share, as a drift's, hide no bend.
        assert find_vertex(dp, curve, covariance + 0.01, 100.0).p_value == pytest.approx(many)


class TestChoice:
    def test_the_staircase_is_not_taken_though_it_certifies_more(self):
        """The bound of the staircase is 80 mV too high at 4 MPa."""
        by_default = identify(ramps(lowest_at_4, (1.0, 2.0, 3.0, 5.0)), QUIET)
        curve = by_default.positive.curve
        assert curve.premise == "smooth" and "vertex-between-tests" in codes(by_default)
        fine = np.linspace(1, 5, 401)
        assert np.all(np.interp(fine, curve.offset_dp_MPa, curve.offset_V) < lowest_at_4(fine) - 0.1)
        checks = {each.premise: each for each in curve.premises}
        assert checks["monotone"].lack_of_fit_p < REFUSED
        assert checks["monotone"].dead_zone_over_u_max < checks["smooth"].dead_zone_over_u_max

    def test_who_asks_for_it_gets_it_with_a_warning(self):
        asked = identify(ramps(lowest_at_4, (1.0, 2.0, 3.0, 5.0)), replace(QUIET, curve="monotone"))
        assert asked.positive.curve.premise == "monotone"
        (warning,) = [each for each in asked.warnings if each.code == "vertex-between-tests"]
        assert "3 and 5 MPa" in warning.text and "test at 4 MPa" in warning.text

    def test_a_test_at_the_vertex_settles_it(self):
        settled = identify(ramps(lowest_at_4, (1.0, 2.0, 3.0, 4.0, 5.0)), QUIET)
        assert settled.positive.curve.premise == "smooth" and "vertex-between-tests" not in codes(settled)

    def test_without_a_curvature_that_leaves_an_offset_it_is_refused(self):
        tests = ramps(lambda dp: lowest_at_4(dp, 0.16), (1.0, 3.0, 5.0))
        with pytest.raises(InputError, match="Record a test at about 4 MPa"):
            identify(tests, QUIET)
        assert identify(tests, replace(QUIET, curve="monotone")).positive.curve.premise == "monotone"
        declared = identify(tests, replace(QUIET, curvature=0.33 / 1e12)).positive.curve
        fine = np.linspace(1, 5, 401)
        offset = np.interp(fine, declared.offset_dp_MPa, declared.offset_V)
        assert np.all(offset < lowest_at_4(fine, 0.16) - 0.1)

    def test_a_large_curvature_that_is_declared_makes_the_certificate_no_bolder(self):
        """The staircase certified more than 0.6 V/MPa² do, and was taken in its place."""
        tests = ramps(lambda dp: 5.1 + 0.02 * (dp - 4) ** 2, (1.0, 5.0))
        curves = [identify(tests, replace(QUIET, curvature=bend / 1e12)).positive.curve for bend in (0.05, 0.6)]
        assert [each.premise for each in curves] == ["smooth", "smooth"]
        assert curves[1].u_offset_V[-1] < curves[0].u_offset_V[-1]

    def test_a_curvature_that_leaves_nothing_is_named_as_the_reason(self):
        with pytest.raises(InputError, match="curvature M of up to"):
            identify(ramps(lambda dp: 5.6 - 0.06 * dp, (1.0, 5.0)), replace(QUIET, curvature=9.0 / 1e12))


class TestThreeTests:
    def test_a_bend_down_at_the_test_between_may_hide_one_up(self):
        """Level from 1.5 to 3 MPa and falling on both sides: the chord from 1 to 3 MPa lies 50 mV above it."""

        def kinked(dp):
            return np.interp(dp, [1.0, 1.5, 3.0, 5.0], [5.4, 5.3, 5.3, 5.15])

        curve = identify(ramps(kinked, (1.0, 3.0, 5.0)), QUIET).positive.curve
        fine = np.linspace(1, 5, 401)
        assert np.all(np.interp(fine, curve.offset_dp_MPa, curve.offset_V) < kinked(fine) - 0.1)

    def test_a_curvature_that_the_tests_gave_is_not_called_tested(self):
        curve = identify(ramps(lambda dp: 5.6 - 0.06 * dp, (1.0, 3.0, 5.0)), replace(QUIET, curve="smooth"))
        assert "not proved by them" in curve.positive.curve.premise_in_words(AS_COMPUTED)

    def test_its_second_difference_counts_whatever_its_sign(self):
        dp = np.array([1.0, 3.0, 5.0])
        up, down = (
            find_curvature(dp, sign * 0.01 * (dp - 3) ** 2, 1e-8 * np.eye(3), 14.0, None).allowed for sign in (1, -1)
        )
        np.testing.assert_allclose(up, down)
        assert up.min() > 1.0


class TestDraws:
    @pytest.mark.parametrize("tests", [3, 4, 6])
    def test_offsets_lie_under_parabolas_with_their_vertex_between_two_tests(self, tests):
        rng = np.random.default_rng([71, tests])
        dp = {3: (1.0, 3.0, 5.0), 4: (1.0, 2.0, 3.5, 5.0), 6: (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)}[tests]
        found = [certify(draw_curve("vertex", np.array(dp), rng), tests, rng) for _ in range(60)]
        assert sum(each.above > 0 for each in found) <= 4
        assert sum(each.certified is not None for each in found) > 20

    def test_without_the_test_of_the_vertex_they_would_not(self, monkeypatch):
        monkeypatch.setattr(certifying, "find_vertex", lambda *_: None)
        rng = np.random.default_rng([71, 3])
        found = [certify(draw_curve("vertex", np.array([1.0, 3.0, 5.0]), rng), 3, rng) for _ in range(60)]
        assert sum(each.above > 0 for each in found) > 10

    @pytest.mark.parametrize("shape", ["line", "decay", "concave", "kink"])
    def test_curves_that_run_one_way_are_let_alone(self, shape):
        rng = np.random.default_rng([72, len(shape)])
        dp = np.array([1.0, 2.0, 3.5, 5.0])
        found = [certify(draw_curve(shape, dp, rng), 4, rng) for _ in range(60)]
        assert all(each.certified and each.above <= 0 for each in found)
        assert sum(each.certified.vertex is not None for each in found) <= 3


@pytest.mark.parametrize("premise", ["line", "smooth", "monotone"])
def test_a_premise_that_the_tests_break_by_three_margins_is_not_certified_in_silence(premise, monkeypatch):
    draws = 40
    assert unsaid(premise, 4, draws, np.random.default_rng(7)) <= curve_choice.UNSAID * draws
    monkeypatch.setattr(curve_choice, "VISIBLE", 0.05)  # what the errors hide is not said: the count can fail
    assert unsaid(premise, 4, draws, np.random.default_rng(7)) > curve_choice.UNSAID * draws
