"""The bound of a guarded threshold continued above the last test by the premise that its curve is taken with.

A threshold that is straight, or whose slope is known from two tests and that bends by at most M, is a weighted sum of
the tests less that bend. What the tests err by counts by the weights, which grow with the distance; the bounds of all
nodes hold at once, and with those at the tests, for a share of the error probability of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import MPA, REFUSED, Premise
from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM, FINEST_ERROR
from dzdesign.identify.fitting.error_statement import budget_of_free
from dzdesign.identify.fitting.guarded_thresholds import GuardedThreshold
from dzdesign.identify.fitting.premises import (
    LARGEST_DEGREES,
    line_weights,
    of_whole_path,
)
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.above_tests import LOWEST_V, AboveTests, continued_threshold, largest_bend
from dzdesign.identify.valve.estimated_curvature import curvature_above, second_differences
from dzdesign.identify.valve.staircase import Direction

#: Share of the error probability that the bounds above the tests take: half of what a smooth curve leaves to its
#: premise, a quarter of what a line leaves.
SHARE_ABOVE = 0.125
#: The first node above the last test, over its pressure drop; then each over the one before; the last node at most.
FIRST_STEP, STEP, FURTHEST = 1.05, 1.1, 16.0
#: Largest pressure drop that valve.json holds, MPa.
LARGEST_MPa = 1e3
#: Points at which the path of the error is followed.
PATH_POINTS = 101
#: Times the last tested pressure drop at which the test that gives the slope is chosen: as far as `verify` tries.
CHOSEN_AT = 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AtTests:
    """What is to be continued: the threshold at the tests under one premise, and its bound at the last of them."""

    premise: Premise
    trend: Direction
    dp_MPa: np.ndarray
    #: V.
    value: np.ndarray
    last_lower: float


def bound_above(at_tests: AtTests, guarded: GuardedThreshold, options: IdentifyOptions) -> AboveTests:
    """Continue a bound above the last of two tests or more."""
    dp, premise = at_tests.dp_MPa, at_tests.premise
    last = float(dp[-1])
    steps = [1.0, FIRST_STEP]
    while steps[-1] * STEP < FURTHEST:
        steps.append(steps[-1] * STEP)
    nodes = np.minimum(last * np.array(steps), LARGEST_MPa)
    nodes = np.round(nodes[np.concatenate([[True], np.diff(nodes) > 0])], 6)
    nodes[0] = last
    if premise == "monotone":
        band, start, bend, p_value = np.full(nodes.size, at_tests.value[-1] - at_tests.last_lower), None, 0.0, None
        certified = at_tests.trend == "increasing"
    else:
        bend, p_value = _bend(guarded, dp, options) if premise == "smooth" else (0.0, None)
        start, band = _least_band(guarded, dp, premise, bend, nodes, options)
        band[0] = at_tests.value[-1] - at_tests.last_lower
        certified = p_value is None or p_value >= REFUSED
    row = start or 0
    continued = continued_threshold(premise, at_tests.trend, dp.tolist(), at_tests.value.tolist(), row, nodes)
    lower = np.maximum(continued - band - largest_bend(bend, dp.tolist(), row, nodes), LOWEST_V)
    ends = np.flatnonzero(lower[1:] <= 0)
    kept = slice(0, int(ends[0]) + 2 if ends.size else nodes.size)
    return AboveTests(
        certified=certified,
        slope_from_MPa=None if start is None else float(dp[start]),
        curvature_V_MPa2=bend,
        lack_of_fit_p=p_value,
        dp_MPa=tuple(map(float, nodes[kept])),
        band_V=tuple(map(float, band[kept])),
        u_lower_V=tuple(map(float, lower[kept])),
    )


def _bend(guarded: GuardedThreshold, dp: np.ndarray, options: IdentifyOptions) -> tuple[float, float | None]:
    """Return M above the tests, and of a declared one the probability of tests that bend downwards as much as these."""
    from scipy.special import stdtr

    free, between = guarded.free, guarded.between
    weights = second_differences(dp)
    found = weights @ free.value
    if options.curvature is None:
        return curvature_above(found), None
    declared = options.curvature * MPA**2
    if not found.size:
        return declared, None
    covariance = between.covariance_of_mean(free.se) + (FINEST_ERROR * options.u_max) ** 2 * np.eye(dp.size)
    degrees = float(between.degrees_of_freedom(free.se, DEGREES_OF_FREEDOM).min())
    se = np.sqrt(np.diag(weights @ covariance @ weights.T))
    beyond = float(np.max((-found - declared) / np.maximum(se, np.finfo(float).tiny)))
    return declared, min(1.0, float(found.size * stdtr(min(degrees, LARGEST_DEGREES), -beyond)))


def _least_band(
    guarded: GuardedThreshold,
    dp: np.ndarray,
    premise: Premise,
    bend: float,
    nodes: np.ndarray,
    options: IdentifyOptions,
) -> tuple[int | None, np.ndarray]:
    """Return the test whose chord to the last gives the slope, None of a line, and the band at the nodes, V.

    Of all tests below the last the one that takes off least, bend and band together: a near one errs much, a far one
    leaves room for a bend. What the tests read is no part of that choice.
    """
    if premise == "line":
        covariance = guarded.between.covariance_of_mean(guarded.free.se)
        weights_of = line_weights(dp, covariance + (FINEST_ERROR * options.u_max) ** 2 * np.eye(dp.size))
        return None, _band(guarded, dp, weights_of, nodes, options)
    found = []
    for row in range(dp.size - 1):
        band = _band(guarded, dp, _through_two(dp, row), nodes, options)
        taken_off = band + largest_bend(bend, dp.tolist(), row, nodes)
        found.append((float(np.interp(CHOSEN_AT * dp[-1], nodes, taken_off)), row, band))
    _, start, band = min(found, key=lambda each: each[:2])
    return start, band


def _through_two(dp: np.ndarray, row: int) -> Callable[[np.ndarray], np.ndarray]:
    """Return what gives the weights (N, T) of the straight line through one test and the last."""

    def weights(at_MPa: np.ndarray) -> np.ndarray:
        found = np.zeros((at_MPa.size, dp.size))
        found[:, -1] = (at_MPa - dp[row]) / (dp[-1] - dp[row])
        found[:, row] = 1 - found[:, -1]
        return found

    return weights


def _band(
    guarded: GuardedThreshold,
    dp: np.ndarray,
    weights_of: Callable[[np.ndarray], np.ndarray],
    nodes: np.ndarray,
    options: IdentifyOptions,
) -> np.ndarray:
    """Return what errors take off weighted sums of the tests at the nodes, V: convex, so that chords of bounds hold.

    The bound is of the next closing (or opening), of a valve in any state of the series, as at the tests. The path from
    the last test to the last node is followed, so that it holds everywhere on it at once. Systematic errors of the
    tests count by the weights' size.
    """
    free, between = guarded.free, guarded.between
    budget = budget_of_free(guarded, options.confidence)
    at_nodes, along = weights_of(nodes), weights_of(np.geomspace(nodes[0], nodes[-1], PATH_POINTS))
    drift, uneven = (between.drift.change, between.drift.uneven) if between.drift else (0.0, 0.0)
    taken_off = []
    for state in (None, -0.5, 0.5):
        # What the repeats scatter by may be less than their noise by chance: the noise alone counts too.
        error, path = (between.covariance_of_next(free.se, weights, state) for weights in (at_nodes, along))
        degrees = between.degrees_of_next(free.se, along, DEGREES_OF_FREEDOM, state)
        critical = of_whole_path(path, degrees, SHARE_ABOVE * (1 - options.confidence))
        shift = 0.0 if state is None else drift * state - uneven
        taken_off.append(critical * np.sqrt(np.diag(error)) - shift)
    found: np.ndarray = np.max(taken_off, axis=0) + np.abs(at_nodes) @ budget
    return found
