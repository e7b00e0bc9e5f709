"""The thresholds that a certificate may guard, of both branches and their mean, with their bounds at the tests."""

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.fitting.bounds import (
    DEGREES_OF_FREEDOM,
    Trend,
    excess_departure,
    find_trend,
    lower_bounds,
)
from dzdesign.identify.fitting.constrained_fits import KneeFit, fit_knees
from dzdesign.identify.fitting.premises import confidence_at_tests
from dzdesign.identify.fitting.soft_edges import find_softness
from dzdesign.identify.knees.between_ramps import BetweenRamps
from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.guard_curve import Guard
from dzdesign.identify.valve.staircase import Direction

#: Standard errors by which the tail's zero must lie below the knee, in one test or in all together, to be taken for a
#: soft edge. At 3 one sharp valve in a hundred was, and beta(5 MPa) scattered by 7e-4 instead of 2.6e-4; which soft
#: edges are found hardly changes (a width of 0.6 V always is, with any meter).
SOFT_SIGNIFICANCE = 3.5


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderedKnees:
    """Knees of which those of one branch run the way of the trend."""

    #: That branch: 0 rising, 1 falling.
    column: int
    #: The fit under the trend; the free one where there is none.
    fit: KneeFit
    #: How far each of its knees departs from that direction, V, beyond its own error: data that contradict the
    #: certificate's one premise have to pay for it.
    departure: np.ndarray

    @property
    def knee(self) -> np.ndarray:
        """Knees of that branch, V."""
        return self.fit.knee[:, self.column]

    @property
    def knee_se(self) -> np.ndarray:
        """Their standard errors, V."""
        return self.fit.knee_se[:, self.column]


@dataclass(frozen=True, slots=True)
class Threshold:
    """A guarded threshold, its standard errors and simultaneous lower bounds (V), all (T,)."""

    value: np.ndarray
    se: np.ndarray
    bound: np.ndarray
    #: By how much the bounds were lowered for the tolerance of the meter's lag, V, (T,).
    lag_budget: np.ndarray


def systematic_change(group: DescribedTests, column: int, options: IdentifyOptions) -> float:
    """Return by how much systematic errors may make the knees of one branch differ from test to test, V.

    Beside what the engineer allows for, a lag that is a little wrong does so where tests were run at different rates,
    and a leak that was subtracted, if it stops where the valve opens.
    """
    by_lag = float(np.ptp(np.nan_to_num(group.rates(column)))) * max(group.lag.longer, group.lag.shorter)
    shifts = [leak / item.branch(column).slope for leak, item in zip(group.leak, group.tests, strict=True)]
    return options.flat_below * options.u_max + by_lag + float(np.ptp(shifts))


def order_knees(
    group: DescribedTests,
    free: KneeFit,
    direction: Direction,
    column: int,
    options: IdentifyOptions,
    *,
    alone: bool = False,
) -> OrderedKnees:
    """Fit the knees of one branch again under the trend's direction, and see how far they depart from it.

    From the fit without a direction. The other branch is left out if this one is fitted `alone`: the likelihood is a
    sum over branches, so the other does not move this one.

    Raises
    ------
    InputError
        If the fit does not converge.
    """
    if len(group.tests) < 2:
        return OrderedKnees(column=column, fit=free, departure=np.zeros(1))
    knee = free.knee[:, column]
    knee_se = np.sqrt(np.diag(group.between(column).covariance_of_mean(free.knee_se[:, column])))
    budget = systematic_change(group, column, options)
    if direction == "flat":
        departure = excess_departure(np.abs(knee - knee.mean()), knee_se, budget)
        return OrderedKnees(column=column, fit=free, departure=departure)
    shapes = [item.shapes for item in group.tests]
    if alone:
        shapes = [(None, falling) if column else (rising, None) for rising, falling in shapes]
    fit = fit_knees(shapes, floor=group.floor, u_max=options.u_max, trend=direction, ordered=column)
    departure = excess_departure(np.abs(knee - fit.knee[:, column]), knee_se, budget)
    return OrderedKnees(column=column, fit=fit, departure=departure)


def bound_threshold(group: DescribedTests, knees: OrderedKnees, options: IdentifyOptions) -> Threshold:
    """Bound the knee, or below it what a soft edge still passes: the tail's zero, if that lies below by more than its
    error, and where the flow falls to the noise level."""
    shapes = [item.branch(knees.column) for item in group.tests]
    knee, knee_se = knees.knee, knees.knee_se
    zero = np.array([shape.tail.zero for shape in shapes])
    zero_se = np.array([shape.tail.zero_se for shape in shapes])
    lag_budget = group.lag.shift_at(group.rates(knees.column), rising=knees.column == 0)
    # Steps of equal height stop the spool anywhere within the root of three standard deviations of its mean course.
    stops = math.sqrt(3) * np.array([shape.ripple for shape in shapes])
    shared = knees.departure.max() + lag_budget + stops
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
    between = group.between(knees.column)
    knee_bound = lower_bounds(knee, knee_se, between, options.confidence, knee_budget)
    zero_bound = lower_bounds(zero, zero_se, between, options.confidence, zero_budget)
    # What averages show below the knee at one pressure drop is one edge's, which all tests have.
    depth = max(shape.dead_zone.depth for shape in shapes)
    value = np.minimum(np.where(soft, zero, knee), knee - depth)
    bound = np.minimum(np.where(soft, np.minimum(knee_bound, zero_bound), knee_bound), knee_bound - depth)
    # Where the edge may pass more than the level below the knee, as credible as the bound is sure. Both errors are of
    # different readings, so they add by their squares.
    softness = find_softness(
        shapes, knee, level=group.noise_level, lag=group.lag, confidence=options.confidence, u_max=options.u_max
    )
    margin = np.hypot(knee - knee_bound, softness.at_most - softness.likely)
    return Threshold(
        np.minimum(value, knee - softness.likely),
        np.where(soft, zero_se, knee_se),
        np.minimum(bound, knee - softness.likely - margin),
        lag_budget,
    )


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


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardedThreshold:
    """The threshold of one guard, without a premise and with knees brought in the order of their trend."""

    free: Threshold
    ordered: Threshold
    between: BetweenRamps
    #: By how much systematic errors may make it differ from test to test, V.
    allowance: float
    #: Whether it departs from one direction beyond its error: then a threshold that runs one way is contradicted.
    departs: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Guarding:
    """All that one side's tests say of what may be guarded."""

    #: Branch that is guarded by default: 0 rising, 1 falling.
    column: int
    #: How its guarded threshold runs with the pressure drop.
    trend: Trend
    #: Without a direction, and with the knees of that branch in the order of their own trend.
    free: KneeFit
    knees: KneeFit
    #: How far the knees, and the guarded thresholds, depart from one direction at each test, V.
    departure: np.ndarray
    guarded_departure: np.ndarray
    #: Of every guard that the branches allow, the default one first.
    thresholds: dict[Guard, GuardedThreshold]
    #: Knees of the rising branch that run the way of the trend.
    opening: OrderedKnees | None


def guard_thresholds(group: DescribedTests, free: KneeFit, options: IdentifyOptions) -> Guarding:
    """Return the thresholds that may be guarded, and which way the guarded one runs.

    The trend is the guarded threshold's: a soft edge whose leak grows with the pressure drop may run against the knees.
    One edge opens and closes, so it is that of the default guard for all. A branch that runs otherwise departs from it,
    and its bounds are lowered by the departure.
    """
    column = 1 if group.tests[0].shapes[1] else 0  # falling wherever there is one: zero command comes after closing
    guard: Guard = "closing" if column else "opening"
    other: Guard = "opening" if column else "closing"
    single = {guard: _unordered(group, free, column, options)}
    trend = _trend_of(group, column, single[guard].value, single[guard].se, options)
    of_knees = _trend_of(group, column, free.knee[:, column], free.knee_se[:, column], options).direction
    knees = {guard: order_knees(group, free, of_knees, column, options)}
    # Where the solver finds no order of the other branch's knees, that guard is not on offer, and `design` says so.
    with suppress(InputError):
        if group.tests[0].shapes[1 - column]:
            knees[other] = order_knees(group, free, of_knees, 1 - column, options, alone=True)
            single[other] = _unordered(group, free, 1 - column, options)
    thresholds: dict[Guard, GuardedThreshold] = {}
    for name, ordered in knees.items():
        thresholds[name] = GuardedThreshold(
            free=single[name],
            ordered=bound_threshold(group, ordered, options),
            between=group.between(ordered.column),
            allowance=systematic_change(group, ordered.column, options),
            departs=bool(ordered.departure.max() > 0),
        )
    departure = guarded_departure(thresholds[guard], trend.direction)
    thresholds = {name: _lowered(each, trend.direction) for name, each in thresholds.items()}
    if other in thresholds:
        thresholds["mean"] = _mean_of(group, thresholds)
    return Guarding(
        column=column,
        trend=trend,
        free=free,
        knees=knees[guard].fit,
        departure=knees[guard].departure,
        guarded_departure=departure,
        thresholds=thresholds,
        opening=_opening(group, free, knees, of_knees, trend.direction, options),
    )


def _unordered(group: DescribedTests, free: KneeFit, column: int, options: IdentifyOptions) -> Threshold:
    """Return a branch's threshold for a premise that is no direction."""
    alone = OrderedKnees(column=column, fit=free, departure=np.zeros(len(group.tests)))
    return bound_threshold(group, alone, replace(options, confidence=confidence_at_tests(options.confidence)))


def _trend_of(
    group: DescribedTests, column: int, value: np.ndarray, se: np.ndarray, options: IdentifyOptions
) -> Trend:
    """Test which way the thresholds (V) of a branch run with the pressure drop."""
    between = group.between(column)
    return find_trend(
        np.array([item.dp or math.nan for item in group.tests]),
        value,
        between.covariance_of_mean(se),
        float(between.degrees_of_freedom(se, DEGREES_OF_FREEDOM).min()),
        options.u_max,
        systematic_change(group, column, options),
    )


def _opening(
    group: DescribedTests,
    free: KneeFit,
    knees: dict[Guard, OrderedKnees],
    of_knees: Direction,
    direction: Direction,
    options: IdentifyOptions,
) -> OrderedKnees | None:
    """Return the rising knees that run the way of the guarded threshold's trend."""
    if "opening" not in knees or of_knees == direction:
        return knees.get("opening")
    with suppress(InputError):
        return order_knees(group, free, direction, 0, options, alone=True)
    return None


def guarded_departure(guarded: GuardedThreshold, direction: Direction) -> np.ndarray:
    """Return how far a guarded threshold departs from the direction of the trend at each test, V, beyond its error."""
    from scipy.optimize import isotonic_regression

    value, se = guarded.ordered.value, guarded.ordered.se
    if value.size < 2:
        return np.zeros(value.size)
    error = np.sqrt(np.diag(guarded.between.covariance_of_mean(se)))
    if direction == "flat":
        return excess_departure(np.abs(value - value.mean()), error, guarded.allowance)
    weights = error**-2.0 if np.all(error > 0) else None
    nearest = isotonic_regression(value, weights=weights, increasing=direction == "increasing").x
    return excess_departure(np.abs(value - nearest), error, guarded.allowance)


def _lowered(guarded: GuardedThreshold, direction: Direction) -> GuardedThreshold:
    """Lower the bounds under one direction by what the guarded threshold departs from it.

    Without a direction the lowest bound of all tests holds everywhere, whatever the others do.
    """
    departure = float(guarded_departure(guarded, direction).max())
    lowered = guarded.ordered.bound - (0.0 if direction == "flat" else departure)
    return replace(guarded, ordered=replace(guarded.ordered, bound=lowered), departs=guarded.departs or departure > 0)


def _mean_of(group: DescribedTests, thresholds: dict[Guard, GuardedThreshold]) -> GuardedThreshold:
    """Return the mean of both branches' thresholds; from ramp to ramp it scatters no more than the worse of the two."""
    opening, closing = thresholds["opening"], thresholds["closing"]
    return GuardedThreshold(
        free=mean_threshold(group, opening.free, closing.free),
        ordered=mean_threshold(group, opening.ordered, closing.ordered),
        between=max(opening.between, closing.between, key=lambda each: each.sd),
        allowance=max(opening.allowance, closing.allowance),
        departs=opening.departs or closing.departs,
    )
