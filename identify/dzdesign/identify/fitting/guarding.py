"""The thresholds that a certificate may guard, of both branches and their mean, with their bounds at the tests."""

import math

import numpy as np

from dzdesign.identify.fitting.bounds import lower_bounds
from dzdesign.identify.fitting.soft_edges import EdgeShapes, find_softness, fit_edge_shapes
from dzdesign.identify.fitting.threshold import Threshold
from dzdesign.identify.fitting.zero_flow import with_zero_flow
from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.knees.knee_table import Knees
from dzdesign.identify.options import IdentifyOptions

#: Standard errors by which the tail's zero must lie below the knee, in one test or in all together, to be taken for a
#: soft edge. At 3 one sharp valve in a hundred was, and beta(5 MPa) scattered by 7e-4 instead of 2.6e-4; which soft
#: edges are found hardly changes (a width of 0.6 V always is, with any meter).
SOFT_SIGNIFICANCE = 3.5


def systematic_change(group: DescribedTests, column: int, options: IdentifyOptions) -> float:
    """Return by how much systematic errors may make the knees of one branch differ from test to test, V.

    Beside what the engineer allows for, a lag that is a little wrong does so where tests were run at different rates,
    and a leak that was subtracted, if it stops where the valve opens.
    """
    by_lag = float(np.ptp(np.nan_to_num(group.rates(column)))) * max(group.lag.longer, group.lag.shorter)
    shifts = [leak / item.branch(column).slope for leak, item in zip(group.leak, group.tests, strict=True)]
    return options.flat_below * options.u_max + by_lag + float(np.ptp(shifts))


def edges_of_branch(group: DescribedTests, column: int, options: IdentifyOptions) -> EdgeShapes:
    """Fit the shapes of the edge to the tests' rising (0) or falling (1) branch."""
    shapes = [item.branch(column) for item in group.tests]
    return fit_edge_shapes(shapes, level=group.noise_level, lag=group.lag, u_max=options.u_max)


def bound_threshold(
    group: DescribedTests, knees: Knees, column: int, edges: EdgeShapes, options: IdentifyOptions
) -> Threshold:
    """Bound the knee, or below it what a soft edge still passes: the tail's zero, if that lies below by more than its
    error, and where the flow falls to the noise level; or where it comes to the flow that is allowed at zero. `edges`
    are those of the same branch."""
    shapes = [item.branch(column) for item in group.tests]
    knee, knee_se = knees.knee[:, column], knees.knee_se[:, column]
    zero = np.array([shape.tail.zero for shape in shapes])
    zero_se = np.array([shape.tail.zero_se for shape in shapes])
    lag_budget = group.lag.shift_at(group.rates(column), rising=column == 0)
    # Steps of equal height stop the spool anywhere within the root of three standard deviations of its mean course.
    stops = math.sqrt(3) * np.array([shape.ripple for shape in shapes])
    shared = lag_budget + stops
    # What was subtracted as the meter's zero has an error of its own, which moves all readings of a test together.
    inflations = [shape.variance_inflation for shape in shapes]
    subtracted = np.array([se * math.sqrt(factor) for se, factor in zip(group.zero_se, inflations, strict=True)])
    knee_se = np.hypot(knee_se, subtracted / [shape.slope for shape in shapes])
    zero_se = np.hypot(zero_se, subtracted / [shape.tail.slope for shape in shapes])
    # A zero error of the meter moves each zero by the error over the slope of the line that was extrapolated; so does a
    # leak that was subtracted, if it stops where the valve opens.
    amiss = options.meter_zero + np.array(group.leak)
    knee_budget = shared + amiss / [shape.slope for shape in shapes]
    zero_budget = shared + amiss / [shape.tail.slope for shape in shapes]
    # A soft edge passes flow below the knee. Where the tail agrees with the knee's line, that line is all there is.
    gap, error = knee - zero, np.hypot(knee_se, zero_se)
    # One edge has passed the flow of all tests, so together they show a softness that none shows alone.
    together = np.sum(gap / error**2) > SOFT_SIGNIFICANCE * math.sqrt(np.sum(error**-2))
    soft = (gap > SOFT_SIGNIFICANCE * error) | (together & (gap > 0))
    between = group.between(column)
    knee_bound = lower_bounds(knee, knee_se, between, options.confidence, knee_budget)
    zero_bound = lower_bounds(zero, zero_se, between, options.confidence, zero_budget)
    # What averages show below the knee at one pressure drop is one edge's, which all tests have.
    depth = max(shape.dead_zone.depth for shape in shapes)
    value = np.minimum(np.where(soft, zero, knee), knee - depth)
    bound = np.minimum(np.where(soft, np.minimum(knee_bound, zero_bound), knee_bound), knee_bound - depth)
    # Where the edge may pass more than the level below the knee, as credible as the bound is sure. Both errors are of
    # different readings, so they add by their squares.
    softness = find_softness(edges, knee, options.confidence)
    margin = np.hypot(knee - knee_bound, softness.at_most - softness.likely)
    found = Threshold(
        np.minimum(value, knee - softness.likely),
        np.where(soft, zero_se, knee_se),
        np.minimum(bound, knee - softness.likely - margin),
        lag_budget,
    )
    return with_zero_flow(group, column, found, shared, options)


def mean_threshold(group: DescribedTests, opening: Threshold, closing: Threshold) -> Threshold:
    """Return the mean of both branches' thresholds, its error as large as their covariance could make it.

    The branches have no sample in common, but slow noise, the correction of the lag and the meter's zero act on both,
    and how much they share is not known. The standard error of a sum is never above the sum of standard errors (their
    correlation is at most 1), so half of that is taken; the mean of two bounds, each of the same number of standard
    errors, is then the mean's bound at the same confidence, with no allowance for a second set of tests. The meter's
    lag moves the branches against each other, so what the bounds allow for it does not add up.
    """
    lag_budget = group.lag.shift_of_mean_at(group.rates(0), group.rates(1))
    credit = (opening.lag_budget + closing.lag_budget) / 2 - lag_budget
    return Threshold(
        (opening.value + closing.value) / 2,
        (opening.se + closing.se) / 2,
        (opening.bound + closing.bound) / 2 + credit,
        lag_budget,
    )
