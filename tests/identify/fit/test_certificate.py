"""The certified bound: its proof, a referee in cvxpy, and the laws that any bound of a next closing keeps."""

import pickle
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.fit.certificate import (
    NoCurveAgreesError,
    certify,
    continue_above,
    critical,
    known_rows,
    largest_offsets,
    prove,
    running_minimum,
)
from dzdesign.identify.fit.curve_class import class_of_bends, find_class, lack_of_fit, one_way
from dzdesign.identify.fit.ramp_model import Ramps
from dzdesign.identify.fit.scatter import measure_scatter

ASSUMED = 25e-3
SHAPES = {
    "line": lambda p: 5.2 - 0.06 * (p - 1),
    "kink": lambda p: 5.2 - 0.12 * np.minimum(p - 1, 2.0),
    "U": lambda p: 5.0 + 0.03 * (p - 3) ** 2,
}


def ramps_of(shape="line", *, scatter=12.5e-3, by_hand=0.0, drift=False, seed=1, pressures=5, repeats=3):
    """Return ramps of a valve that scatters."""
    rng = np.random.default_rng([seed, pressures, repeats])
    dp = rng.permutation(np.repeat(np.linspace(1, 5, pressures), repeats))
    dp = dp * (1 + by_hand * rng.standard_normal(dp.size))
    y = SHAPES[shape](dp) + scatter * rng.standard_normal(dp.size)
    return Ramps(dp_MPa=dp, y=y, se=np.full(dp.size, 2e-3), clock=np.linspace(-0.5, 0.5, dp.size) if drift else None)


def scatter_of(ramps, declared=None):
    return measure_scatter(ramps, declared=declared, assumed=ASSUMED)


CASES = [
    (shape, by_hand, drift, curve)
    for shape in SHAPES
    for by_hand, drift in ((0.0, False), (0.03, True))
    for curve in ((None, None), ("smooth", 0.2), ("monotone", None))
    if shape != "U" or curve[0] != "monotone"
]


def certified(shape, by_hand, drift, curve):
    scatter = scatter_of(ramps_of(shape, by_hand=by_hand, drift=drift))
    curves = find_class(scatter, curve=curve[0], curvature=curve[1])
    return certify(scatter, curves)


def programmes_of(found):
    """Yield class and data set of every programme that has a solution."""
    for curves in one_way(found.curves):
        for known in found.data:
            with suppress(NoCurveAgreesError):
                yield curves, known, largest_offsets(curves, known)


@pytest.fixture(scope="module")
def refereed():
    """The programmes of all cases, by the product and by cvxpy in a process of its own."""
    programmes, ours = [], []
    for case in CASES:
        for curves, known, proof in programmes_of(certified(*case)):
            programmes.append(known_rows(curves, known))
            ours.append(proof.offsets)
    done = subprocess.run(
        [sys.executable, Path(__file__).with_name("referee.py")], input=pickle.dumps(programmes), capture_output=True,
        check=True, timeout=240,
    )  # fmt: skip
    return ours, pickle.loads(done.stdout)


def test_no_threshold_that_data_and_premise_allow_lies_below_and_no_larger_offset_is_safe(refereed):
    for ours, theirs in zip(*refereed, strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=3e-6)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_multipliers_prove_the_offsets_without_a_solver(case):
    every = list(programmes_of(certified(*case)))
    assert every
    for curves, known, proof in every:
        left, right = known_rows(curves, known)
        base = known.floor.max()  # from a zero that all rows share, what a proof misses counts with what is left
        for at, (rows, multipliers, offset) in enumerate(
            zip(proof.rows, proof.multipliers, proof.offsets, strict=True)
        ):
            assert multipliers.min() > 0
            miss = multipliers @ left[rows]
            miss[at] -= 1
            assert np.abs(miss).sum() < 1e-6
            proved = base + multipliers @ (right - base * left.sum(axis=1))[rows]
            assert proved - 2e-6 <= offset <= proved + 1e-9
        np.testing.assert_allclose(prove(curves, known, proof.rows).offsets, proof.offsets, atol=1e-7)


def test_a_programme_in_which_the_first_solver_gives_up_is_proved():
    """Seven pressures by hand: the rows that a solver with loose tolerances then named missed their proof by 2e-6."""
    scatter = scatter_of(ramps_of(scatter=5e-3, by_hand=0.03, seed=9, pressures=7, repeats=2))
    assert certify(scatter, find_class(scatter, curve="smooth", curvature=0.2)).bound.min() > 4.8


def test_data_that_contradict_a_premise_are_refused():
    scatter = scatter_of(ramps_of("U", scatter=2e-3))
    for curve, direction in (("line", 0), ("monotone", 0), ("monotone", -1)):
        with pytest.raises(NoCurveAgreesError, match="no curve of the premise"):
            certify(scatter, find_class(scatter, curve=curve, curvature=None, direction=direction))


def test_a_proof_that_lacks_a_row_proves_nothing():
    found = certified(*CASES[0])
    rows = [each.copy() for each in found.proofs[0].rows]
    rows[3] = rows[3][found.proofs[0].multipliers[3] < found.proofs[0].multipliers[3].max()]
    with pytest.raises(InputError, match="miss their proof"):
        prove(found.curves, found.data[0], rows)


@pytest.mark.parametrize("curve", [(None, None), ("smooth", 0.1), ("line", None)])
def test_a_bound_moves_and_scales_with_the_thresholds(curve):
    ramps = ramps_of("line")
    scatter = scatter_of(ramps)
    bound = certify(scatter, find_class(scatter, curve=curve[0], curvature=curve[1])).bound
    moved = scatter_of(replace(ramps, y=ramps.y + 1.5))
    higher = certify(moved, find_class(moved, curve=curve[0], curvature=curve[1])).bound
    np.testing.assert_allclose(higher, bound + 1.5, atol=3e-6)
    wider = scatter_of(replace(ramps, y=5 + 2 * (ramps.y - 5), se=2 * ramps.se))
    scaled = certify(wider, find_class(wider, curve=curve[0], curvature=curve[1] and 2 * curve[1])).bound
    np.testing.assert_allclose(scaled, 5 + 2 * (bound - 5), atol=5e-6)


def test_the_order_of_the_ramps_is_of_no_matter_where_it_tells_no_drift():
    ramps = ramps_of("kink", by_hand=0.03)
    order = np.random.default_rng(3).permutation(ramps.y.size)
    both = [scatter_of(each) for each in (ramps, ramps.only(order))]
    bounds = [certify(each, find_class(each, curve=None, curvature=None)).bound for each in both]
    np.testing.assert_allclose(*bounds, atol=3e-6)


def test_a_stronger_premise_certifies_more_and_a_larger_budget_less():
    scatter = scatter_of(ramps_of("line"))
    by_premise = [
        certify(scatter, find_class(scatter, curve=curve, curvature=curvature)).bound
        for curve, curvature in (("line", None), ("smooth", 0.05), ("smooth", 0.5))
    ]
    assert np.all(by_premise[0] >= by_premise[1] - 1e-9) and np.all(by_premise[1] >= by_premise[2] - 1e-9)
    ramps = ramps_of("line")
    with_budget = scatter_of(replace(ramps, budget=np.full(ramps.y.size, 0.02)))
    lower = certify(with_budget, find_class(with_budget, curve=None, curvature=None)).bound
    free = certify(scatter, find_class(scatter, curve=None, curvature=None)).bound
    assert np.all(free - lower >= 0.02 - 1e-6)


def test_chords_between_the_grid_points_lie_below_every_curve_of_the_class():
    """The deepest curves with one kink a cell: where two slopes meet that the class allows at both knots."""
    scatter = scatter_of(ramps_of("kink"))
    found = certify(scatter, find_class(scatter, curve=None, curvature=None))
    grid = found.curves.grid_MPa
    fine = np.linspace(grid[0], grid[-1], 3001)
    finer = class_of_bends(scatter.model.knots_MPa, np.unique(np.round(np.concatenate([grid, fine[::40]]), 6)),
                           found.curves.change)  # fmt: skip
    data = certify(scatter, finer)
    assert np.all(np.interp(data.curves.grid_MPa, grid, found.bound) <= data.bound + 1e-3)


def test_two_pressures_are_certified_alone_and_one_is_too():
    for pressures in (1, 2):
        scatter = scatter_of(ramps_of("line", pressures=pressures))
        curves = find_class(scatter, curve=None, curvature=None)
        assert curves.kind == "points" and curves.grid_MPa.size == pressures
        found = certify(scatter, curves)
        assert np.all(found.bound < SHAPES["line"](curves.grid_MPa)) and np.all(found.bound > 4.5)
        assert continue_above(scatter, found) is None


@pytest.mark.parametrize("curve", [(None, None), ("smooth", 0.05), ("line", None)])
def test_above_the_tests_the_bound_falls_faster_and_faster(curve):
    scatter = scatter_of(ramps_of("line"))
    found = certify(scatter, find_class(scatter, curve=curve[0], curvature=curve[1]))
    above = continue_above(scatter, found)
    assert above.dp_MPa[0] == found.curves.grid_MPa[-1] and above.bound[0] <= found.bound[-1]
    slope = np.diff(above.bound) / np.diff(above.dp_MPa)
    assert np.all(slope <= 0) and np.all(np.diff(slope[1:]) <= 1e-9)
    assert np.all(above.bound < SHAPES["line"](above.dp_MPa))


@pytest.mark.parametrize("curve", [None, "line"])
def test_above_the_tests_the_bound_goes_on_from_the_last_one(curve):
    """With an error probability of its own it lay 372 mV lower at once, of three pressures with two ramps each."""
    ramps = ramps_of("line", pressures=3, repeats=2)
    scatter = scatter_of(ramps)
    found = certify(scatter, find_class(scatter, curve=curve, curvature=None))
    above = continue_above(scatter, found)
    assert above.bound[0] == pytest.approx(found.bound[-1], abs=1e-6)
    assert above.bound[1] > found.bound[-1] - 0.04


def test_a_direction_that_is_not_known_is_the_worse_of_both():
    scatter = scatter_of(ramps_of("line"))
    bounds = {
        direction: certify(scatter, find_class(scatter, curve="monotone", curvature=None, direction=direction)).bound
        for direction in (-1, 0)
    }
    assert np.all(bounds[0] <= bounds[-1] + 1e-9)


def test_the_law_s_offset_is_the_largest_that_runs_one_way():
    bound = np.array([5.0, 5.2, 4.8, 4.9, 4.1])
    np.testing.assert_array_equal(running_minimum(bound, -1), [5.0, 5.0, 4.8, 4.8, 4.1])
    np.testing.assert_array_equal(running_minimum(bound, 1), np.full(5, 4.1))
    np.testing.assert_array_equal(running_minimum(bound, 0), np.full(5, 4.1))
    np.testing.assert_array_equal(running_minimum(bound[::-1], 1), running_minimum(bound, -1)[::-1])


def test_of_one_test_the_critical_value_is_student_s():
    from scipy.stats import norm, t

    for degrees, law in ((2.0, t(2)), (8.0, t(8)), (np.inf, norm)):
        found = critical(np.full((1, 3), 1 / 3), degrees, 1.0, 0.0075)
        assert found == pytest.approx(law.isf(0.0075), rel=0.02)


def test_of_two_single_ramps_each_bound_is_as_sure_as_its_own_error():
    """With one mean error for both, 2.9 % of the bounds at the ramp with 39 mV lay above the truth."""
    truth, se = np.array([5.2, 5.0]), np.array([39e-3, 10e-3])
    scatter = measure_scatter(Ramps(dp_MPa=np.array([1.0, 4.0]), y=truth, se=se), declared=0.0, assumed=ASSUMED)
    margin = truth - certify(scatter, find_class(scatter, curve=None, curvature=None)).bound
    assert margin[0] / margin[1] == pytest.approx(3.9)
    above = se * np.random.default_rng(1).standard_normal((20_000, 2)) > margin
    assert np.mean(above.any(axis=1)) < 0.01 and np.mean(above[:, 0]) > 1e-3


def test_what_all_ramps_have_in_common_is_taken_off_once():
    ramps = ramps_of("line", drift=True)
    free, shared = (scatter_of(each) for each in (ramps, replace(ramps, shared=0.02)))
    bounds = [certify(each, find_class(each, curve=None, curvature=None)).bound for each in (free, shared)]
    np.testing.assert_allclose(bounds[0] - bounds[1], 0.02, atol=3e-6)


def test_a_threshold_that_may_fall_is_not_certified_above_the_tests():
    scatter = scatter_of(ramps_of("line"))
    for direction, certified_above in ((-1, False), (1, True)):
        rising = scatter_of(replace(ramps_of("line"), y=10 - ramps_of("line").y)) if direction > 0 else scatter
        found = certify(rising, find_class(rising, curve="monotone", curvature=None, direction=direction))
        above = continue_above(rising, found)
        assert above.certified == certified_above
        assert (above.bound[-1] < above.bound[0] - 1) == (not certified_above)


@pytest.mark.parametrize(
    ("curve", "curvature", "shape"), [("line", None, "kink"), ("smooth", 0.005, "U"), ("monotone", None, "U")]
)
def test_tests_that_contradict_a_premise_say_so_and_others_do_not(curve, curvature, shape):
    def p_values(name):
        scatters = [scatter_of(ramps_of(name, scatter=5e-3, seed=seed)) for seed in range(60)]
        return np.array([lack_of_fit(each, curve=curve, curvature=curvature) for each in scatters])

    # Of 60 true ones 0.6 lie below 1 %.
    assert np.sum(p_values("line") < 0.01) <= 4
    assert np.mean(p_values(shape) < 0.01) > 0.9


@pytest.mark.parametrize(("confidence", "expected"), [(0.99, 2.62), (0.8, 0.87), (0.5, 0.0)])
def test_a_critical_of_one_sum_is_student_s_at_any_confidence(confidence, expected):
    """One ramp with 14 degrees of freedom, one-sided; at low confidence less than a standard deviation."""
    assert critical(np.ones((1, 1)), 14.0, 0.0, 1 - confidence) == pytest.approx(expected, abs=0.04)
