"""The thresholds of one side that a certificate may guard, of both branches and their mean, and the trend of them."""

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import REFUSED
from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM, FINEST_ERROR, Trend, excess_departure, find_trend
from dzdesign.identify.fitting.constrained_fits import KneeFit
from dzdesign.identify.fitting.guarding import (
    OrderedKnees,
    bound_threshold,
    edges_of_branch,
    mean_threshold,
    order_knees,
    systematic_change,
)
from dzdesign.identify.fitting.premises import confidence_at_tests, one_way_p
from dzdesign.identify.fitting.soft_edges import EdgeShapes
from dzdesign.identify.fitting.threshold import Threshold
from dzdesign.identify.knees.between_ramps import BetweenRamps
from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.guard_curve import Guard
from dzdesign.identify.valve.staircase import Direction


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
    #: Probability of steps against the direction as large as these, if it ran one way; None without a direction.
    one_way_p: float | None = None


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
    edges = {guard: edges_of_branch(group, column, options)}
    single = {guard: _unordered(group, free, column, edges[guard], options)}
    trend = _trend_of(group, column, single[guard].value, single[guard].se, options)
    of_knees = _trend_of(group, column, free.knee[:, column], free.knee_se[:, column], options).direction
    knees = {guard: order_knees(group, free, of_knees, column, options)}
    # Where the solver finds no order of the other branch's knees, that guard is not on offer, and `design` says so.
    with suppress(InputError):
        if group.tests[0].shapes[1 - column]:
            knees[other] = order_knees(group, free, of_knees, 1 - column, options)
            edges[other] = edges_of_branch(group, 1 - column, options)
            single[other] = _unordered(group, free, 1 - column, edges[other], options)
    thresholds: dict[Guard, GuardedThreshold] = {}
    for name, ordered in knees.items():
        thresholds[name] = GuardedThreshold(
            free=single[name],
            ordered=bound_threshold(group, ordered, edges[name], options),
            between=group.between(ordered.column),
            allowance=systematic_change(group, ordered.column, options),
            departs=bool(ordered.departure.max() > 0),
        )
    departure = guarded_departure(thresholds[guard], trend.direction)
    finest = FINEST_ERROR * options.u_max
    thresholds = {name: lowered(each, trend.direction, finest) for name, each in thresholds.items()}
    departure = _said(thresholds[guard], trend.direction, departure)
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


def _unordered(
    group: DescribedTests, free: KneeFit, column: int, edges: EdgeShapes, options: IdentifyOptions
) -> Threshold:
    """Return a branch's threshold for a premise that is no direction."""
    alone = OrderedKnees(column=column, fit=free, departure=np.zeros(len(group.tests)))
    return bound_threshold(group, alone, edges, replace(options, confidence=confidence_at_tests(options.confidence)))


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
        return order_knees(group, free, direction, 0, options)
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


def lowered(guarded: GuardedThreshold, direction: Direction, finest: float) -> GuardedThreshold:
    """Lower the bounds under one direction by what the guarded threshold departs from it, and test the direction.

    Errors below `finest`, V, weigh alike. Without a direction the lowest bound of all tests holds everywhere, whatever
    the others do.
    """
    departure = float(guarded_departure(guarded, direction).max())
    bound = guarded.ordered.bound - (0.0 if direction == "flat" else departure)
    free, between = guarded.free, guarded.between
    p_value = one_way_p(
        free.value,
        between.covariance_of_mean(free.se) + finest**2 * np.eye(free.value.size),
        float(between.degrees_of_freedom(free.se, DEGREES_OF_FREEDOM).min()),
        direction,
    )
    return replace(
        guarded,
        ordered=replace(guarded.ordered, bound=bound),
        departs=guarded.departs or departure > 0,
        one_way_p=p_value,
    )


def _said(guarded: GuardedThreshold, direction: Direction, departure: np.ndarray) -> np.ndarray:
    """Return what is to be said of departures, V: where steps against the direction are significant, all of them."""
    from scipy.optimize import isotonic_regression

    if guarded.one_way_p is None or guarded.one_way_p >= REFUSED:
        return departure
    value = guarded.free.value
    nearest = isotonic_regression(value, increasing=direction == "increasing").x
    apart = np.abs(value - nearest)
    said: np.ndarray = np.maximum(departure, np.where(apart >= apart.max() / 2, apart, 0.0))
    return said


def _mean_of(group: DescribedTests, thresholds: dict[Guard, GuardedThreshold]) -> GuardedThreshold:
    """Return the mean of both branches' thresholds; from ramp to ramp it scatters no more than the worse of the two."""
    opening, closing = thresholds["opening"], thresholds["closing"]
    return GuardedThreshold(
        free=mean_threshold(group, opening.free, closing.free),
        ordered=mean_threshold(group, opening.ordered, closing.ordered),
        between=max(opening.between, closing.between, key=lambda each: each.sd),
        allowance=max(opening.allowance, closing.allowance),
        departs=opening.departs or closing.departs,
        one_way_p=min((each.one_way_p for each in (opening, closing) if each.one_way_p is not None), default=None),
    )
