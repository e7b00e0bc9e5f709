"""The thresholds of one side that a certificate may guard, of both branches and their mean, and the trend of them.

What noise and scatter take off a ramp's threshold the certificate says (`fit.certificate`). Here it is found at each
test how far below its knee the valve may still pass flow, and what errors take off beside: meter, leak, stick-slip, and
a soft edge that is known worse than its knee. All that is a budget of the ramps.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.identify.constants import REFUSED, Direction
from dzdesign.identify.fit.ramp_model import Ramps
from dzdesign.identify.fit.scatter import Scatter, measure_scatter
from dzdesign.identify.fitting.soft_edges import find_softness, fit_edge_shapes
from dzdesign.identify.fitting.zero_flow import find_zero_flow, student_errors
from dzdesign.identify.knees.between_ramps import DECIMALS
from dzdesign.identify.knees.described_tests import DescribedTests, Knees
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.guard_curve import Guard

#: Standard errors by which the tail's zero must lie below the knee, in one test or in all together, to be taken for a
#: soft edge. At 3 one sharp valve in a hundred was, and beta(5 MPa) scattered by 7e-4 instead of 2.6e-4; which soft
#: edges are found hardly changes (a width of 0.6 V always is, with any meter).
SOFT_SIGNIFICANCE = 3.5
#: Probability, of a flat valve, of a change as large as the one found: a trend is called only below this.
TREND_SIGNIFICANCE = 0.01
#: Share of the error probability that bounds of single tests leave to others.
SHARE_OF_OTHERS = 0.25
#: Errors below this share of u_max weigh alike: an exact table has none.
FINEST_ERROR = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True)
class Threshold:
    """A threshold that a certificate may guard, at each test, V (T,)."""

    value: np.ndarray
    #: Its standard error beyond that of the ramps' own knees.
    se: np.ndarray
    #: Its lower bound at the test alone; and by how much that was lowered for the tolerance of the meter's lag.
    bound: np.ndarray
    lag_budget: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """How the threshold runs with the pressure drop; from one test its numbers are NaN."""

    direction: Direction
    #: Over the tested range, by a straight line, and the standard error, V.
    change: float
    change_se: float
    #: Probability of so large a change, either way, if the threshold were flat (Student).
    p_value: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardedThreshold:
    """The threshold of one guard at each test, and by each ramp."""

    threshold: Threshold
    #: By each ramp that tells its knee, the test of each, and the names of these ramps.
    ramps: Ramps
    test: np.ndarray
    sources: tuple[str, ...]
    #: Half the distance of two groups in which the ramps lie, V; 0 where they are one.
    least_sd: float

    def scatter(self, options: IdentifyOptions) -> Scatter:
        """Measure the scatter of the ramps."""
        declared, assumed = options.scatter_V
        return measure_scatter(self.ramps, declared=declared, assumed=assumed, least=self.least_sd)


@dataclass(frozen=True, slots=True, kw_only=True)
class Guarding:
    """All that one side's tests say of what may be guarded."""

    #: How the threshold that is guarded by default runs with the pressure drop.
    trend: Trend
    knees: Knees
    #: Of every guard that the branches allow, the default one first.
    thresholds: dict[Guard, GuardedThreshold]


def guard_thresholds(group: DescribedTests, knees: Knees, options: IdentifyOptions) -> Guarding:
    """Return the thresholds that may be guarded, and which way the guarded one runs.

    The trend is the guarded threshold's: a soft edge whose leak grows with the pressure drop may run against the knees.
    One edge opens and closes, so it is that of the default guard for all.
    """
    column = 1 if group.tests[0].shapes[1] else 0  # falling wherever there is one: zero command comes after closing
    names: tuple[Guard, Guard] = ("opening", "closing")
    columns = [column, *([1 - column] if group.tests[0].shapes[1 - column] else [])]
    at_tests = replace(options, confidence=1 - (1 - SHARE_OF_OTHERS) * (1 - options.confidence))
    thresholds: dict[Guard, GuardedThreshold] = {
        names[each]: _by_ramps(group, knees, each, bound_threshold(group, knees, each, at_tests), at_tests)
        for each in columns
    }
    if len(columns) > 1 and (mean := _mean_of(group, thresholds["opening"], thresholds["closing"])):
        thresholds["mean"] = mean
    default = thresholds[names[column]]
    trend = find_trend(
        default.scatter(options), default.test, default.threshold.se,
        u_max=options.u_max, budget=systematic_change(group, column, options),
    )  # fmt: skip
    return Guarding(trend=trend, knees=knees, thresholds=thresholds)


def bound_threshold(group: DescribedTests, knees: Knees, column: int, options: IdentifyOptions) -> Threshold:
    """Bound the knee, or below it what a soft edge still passes: the tail's zero, if that lies below by more than its
    error, and where the flow falls to the noise level; or where it comes to the flow that is allowed at zero."""
    shapes = [item.branch(column) for item in group.tests]
    between, errors = group.between(column), student_errors(options, len(shapes))
    knee, knee_se = knees.knee[:, column], knees.knee_se[:, column]
    zero, zero_se, tail_slope = np.array([(each.tail.zero, each.tail.zero_se, each.tail.slope) for each in shapes]).T
    slope = np.array([shape.slope for shape in shapes])
    lag_budget = group.lag.shift_at(group.rates(column), rising=column == 0)
    # Steps of equal height stop the spool anywhere within the root of three standard deviations of its mean course.
    shared = lag_budget + math.sqrt(3) * np.array([shape.ripple for shape in shapes])
    # What was subtracted as the meter's zero has an error of its own, which moves all readings of a test together.
    subtracted = np.array(group.zero_se) * np.sqrt([shape.variance_inflation for shape in shapes])
    knee_extra = subtracted / slope
    zero_extra = np.sqrt((subtracted / tail_slope) ** 2 + np.maximum(zero_se**2 - knee_se**2, 0.0))
    # A zero error of the meter moves each zero by the error over the slope of the line that was extrapolated; so does a
    # leak that was subtracted, if it stops where the valve opens.
    amiss = options.meter_zero + np.array(group.leak)
    variance = between.variance_of_next()
    knee_bound = lower_bounds(knee, variance + knee_extra**2, errors, shared + amiss / slope)
    zero_bound = lower_bounds(zero, variance + zero_extra**2, errors, shared + amiss / tail_slope)
    # A soft edge passes flow below the knee. Where the tail agrees with the knee's line, that line is all there is.
    gap, error = knee - zero, np.hypot(np.hypot(knee_se, knee_extra), np.hypot(zero_se, subtracted / tail_slope))
    # One edge has passed the flow of all tests, so together they show a softness that none shows alone.
    together = np.sum(gap / error**2) > SOFT_SIGNIFICANCE * math.sqrt(np.sum(error**-2))
    soft = (gap > SOFT_SIGNIFICANCE * error) | (together & (gap > 0))
    # What averages show below the knee at one pressure drop is one edge's, which all tests have.
    depth = max(shape.dead_zone.depth for shape in shapes)
    value = np.minimum(np.where(soft, zero, knee), knee - depth)
    bound = np.minimum(np.where(soft, np.minimum(knee_bound, zero_bound), knee_bound), knee_bound - depth)
    # Where the edge may pass more than the level below the knee, as credible as the bound is sure. Both errors are of
    # different readings, so they add by their squares.
    edges = fit_edge_shapes(shapes, level=group.noise_level, lag=group.lag, u_max=options.u_max)
    softness = find_softness(edges, knee, options.confidence)
    margin = np.hypot(knee - knee_bound, softness.at_most - softness.likely)
    found = Threshold(
        value=np.minimum(value, knee - softness.likely),
        se=np.where(soft, zero_extra, knee_extra),
        bound=np.minimum(bound, knee - softness.likely - margin),
        lag_budget=lag_budget,
    )
    allowed = find_zero_flow(group, column, options)
    if allowed is None:
        return found
    safe = lower_bounds(allowed.safe, between.variance_of_next(noise=False), errors, shared)
    moved = safe > found.bound
    return replace(
        found,
        value=np.where(moved, np.maximum(allowed.at, safe), found.value),
        se=np.where(moved, allowed.at_se, found.se),
        bound=np.where(moved, safe, found.bound),
    )


def lower_bounds(threshold: np.ndarray, variance: np.ndarray, errors: float, budget: np.ndarray | float) -> np.ndarray:
    """Return a lower bound (V) at each test, so many standard errors and a systematic one below the threshold."""
    found: np.ndarray = threshold - errors * np.sqrt(variance) - budget
    return found


def _by_ramps(
    group: DescribedTests, knees: Knees, column: int, found: Threshold, options: IdentifyOptions
) -> GuardedThreshold:
    """Return a branch's threshold by each ramp: its own knee, less what the threshold lies below the test's knee.

    What the bound of a test takes off beside noise and scatter is a budget of its ramps.
    """
    between, groups = group.between(column), group.between(column).checks.groups
    # One lag of the meter moves all tests the same way.
    shared = _floor(float(found.lag_budget.min()))
    errors = student_errors(options, found.value.size)
    statistical = lower_bounds(found.value, between.variance_of_next(), errors, 0.0)
    budget = np.maximum(statistical - found.bound - shared, 0.0)
    below = knees.knee[:, column] - found.value
    y = np.round(between.ramps.y - below[between.test], DECIMALS)
    return GuardedThreshold(
        threshold=found,
        ramps=replace(between.ramps, y=y, budget=_ceil(budget)[between.test], shared=shared),
        test=between.test,
        sources=between.sources,
        least_sd=float(_ceil(groups.apart / 2)) if groups else 0.0,
    )


def _floor(value: float) -> float:
    return math.floor(value * 10.0**DECIMALS) / 10.0**DECIMALS


def _ceil(values: np.ndarray | float) -> np.ndarray:
    found: np.ndarray = np.ceil(np.asarray(values) * 10**DECIMALS) / 10**DECIMALS
    return found


def systematic_change(group: DescribedTests, column: int, options: IdentifyOptions) -> float:
    """Return by how much systematic errors may make the knees of one branch differ from test to test, V.

    Beside what the engineer allows for, a lag that is a little wrong does so where tests were run at different rates,
    and a leak that was subtracted, if it stops where the valve opens.
    """
    by_lag = float(np.ptp(np.nan_to_num(group.rates(column)))) * max(group.lag.longer, group.lag.shorter)
    shifts = [leak / item.branch(column).slope for leak, item in zip(group.leak, group.tests, strict=True)]
    return options.flat_below * options.u_max + by_lag + float(np.ptp(shifts))


def find_trend(scatter: Scatter, test: np.ndarray, extra_se: np.ndarray, *, u_max: float, budget: float) -> Trend:
    """Test in which direction the ramps' threshold runs with the pressure drop, by a straight line and their drift.

    `test` (n,) is that of each ramp, those set aside too; `extra_se` the error that a test's ramps have in common, V
    (T,). The budget is the change that systematic errors may make, V: a smaller one is flat, however significant.
    """
    from scipy.special import stdtr

    ramps, test = scatter.model.ramps, test[scatter.kept]
    dp = ramps.dp_MPa
    if not np.ptp(dp) > 0:
        return Trend(direction="flat", change=math.nan, change_se=math.nan, p_value=math.nan)
    # Generalised least squares: each ramp has its own noise; what is uncertain of a test beyond that, its ramps share.
    covariance = np.diag(scatter.of_ramps + (FINEST_ERROR * u_max) ** 2)
    covariance += np.where(test[:, None] == test, extra_se[test] ** 2, 0.0)
    line = scatter.model.with_clock(np.column_stack([np.ones_like(dp), (dp - dp.min()) / np.ptp(dp)]))
    weighted = np.linalg.solve(covariance, line).T
    of_line = np.linalg.inv(weighted @ line)
    change, change_se = float((of_line @ weighted @ ramps.y)[1]), math.sqrt(float(of_line[1, 1]))
    p_value = float(2 * stdtr(scatter.degrees, -abs(change) / change_se))
    flat = abs(change) < budget or p_value > TREND_SIGNIFICANCE
    direction: Direction = "flat" if flat else "decreasing" if change < 0 else "increasing"
    return Trend(direction=direction, change=change, change_se=change_se, p_value=p_value)


def departures(guarded: GuardedThreshold, direction: Direction, p_value: float | None) -> np.ndarray:
    """Return how far the tests depart from one direction, V (T,): zero unless that is significant."""
    from scipy.optimize import isotonic_regression

    value = guarded.threshold.value
    if p_value is None or p_value >= REFUSED or direction == "flat":
        return np.zeros(value.size)
    apart = np.abs(value - isotonic_regression(value, increasing=direction == "increasing").x)
    found: np.ndarray = np.where(apart >= apart.max() / 2, apart, 0.0)
    return found


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
        value=(opening.value + closing.value) / 2,
        se=(opening.se + closing.se) / 2,
        bound=(opening.bound + closing.bound) / 2 + credit,
        lag_budget=lag_budget,
    )


def _mean_of(group: DescribedTests, opening: GuardedThreshold, closing: GuardedThreshold) -> GuardedThreshold | None:
    """Return the mean of both branches' thresholds: of each ramp that tells both, the mean of its two.

    None where a test has no such ramp, as of branches that were recorded apart.
    Both branches of a ramp may share their errors, so the standard errors are averaged.
    """
    threshold = mean_threshold(group, opening.threshold, closing.threshold)
    place = {source: at for at, source in enumerate(opening.sources)}
    rising, falling = np.array(
        [(place[source], at) for at, source in enumerate(closing.sources) if source in place], dtype=int
    ).reshape(-1, 2).T  # fmt: skip
    up, down = opening.ramps, closing.ramps
    least_sd = max(opening.least_sd, closing.least_sd)
    if set(closing.test[falling]) != set(closing.test):
        return None
    # The lag moves the branches against each other: of what both allow for it only their difference is left.
    shared = _floor(float(threshold.lag_budget.min()))
    credit = (opening.threshold.lag_budget + closing.threshold.lag_budget) / 2 - threshold.lag_budget
    credit = credit + shared - (up.shared + down.shared) / 2
    test = closing.test[falling]
    budget = np.maximum((up.budgets[rising] + down.budgets[falling]) / 2 - credit[test], 0.0)
    ramps = Ramps(
        dp_MPa=down.dp_MPa[falling],
        y=np.round((up.y[rising] + down.y[falling]) / 2, DECIMALS),
        se=np.round((up.se[rising] + down.se[falling]) / 2, DECIMALS),
        clock=None if down.clock is None else down.clock[falling],
        budget=_ceil(budget),
        shared=shared,
    )
    sources = tuple(closing.sources[at] for at in falling)
    return GuardedThreshold(threshold=threshold, ramps=ramps, test=test, sources=sources, least_sd=least_sd)
