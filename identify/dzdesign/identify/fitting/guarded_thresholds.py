"""The thresholds of one side that a certificate may guard, of both branches and their mean, and the trend of them."""

import math
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.identify.constants import MPA, REFUSED, Direction
from dzdesign.identify.fit.ramp_model import Ramps
from dzdesign.identify.fit.scatter import Scatter, measure_scatter
from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM, Trend, find_trend, lower_bounds
from dzdesign.identify.fitting.guarding import bound_threshold, edges_of_branch, mean_threshold, systematic_change
from dzdesign.identify.fitting.threshold import Threshold
from dzdesign.identify.knees.between_ramps import ASSUMED_REPEATABILITY, BetweenRamps
from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.knees.knee_table import Knees
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.guard_curve import Guard

#: Share of the error probability that bounds of single tests leave to others.
SHARE_OF_OTHERS = 0.25
#: Decimals of valve.json: the ramps are rounded before they are fitted, so that a reader finds the same bound.
DECIMALS = 7
#: Where ramps stand whose pressure drop is unknown, MPa.
ANYWHERE_MPa = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardedThreshold:
    """The threshold of one guard at each test, and by each ramp."""

    threshold: Threshold
    between: BetweenRamps
    #: By each ramp that tells its knee, and the names of these ramps.
    ramps: Ramps
    sources: tuple[str, ...]

    @property
    def least_sd(self) -> float:
        """Half the distance of two groups in which the ramps lie, V; 0 where they are one."""
        groups = self.between.checks.groups
        return math.ceil(groups.apart / 2 * 10**DECIMALS) / 10**DECIMALS if groups else 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Guarding:
    """All that one side's tests say of what may be guarded."""

    #: Branch that is guarded by default: 0 rising, 1 falling.
    column: int
    #: How its guarded threshold runs with the pressure drop.
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
    thresholds: dict[Guard, GuardedThreshold] = {}
    for each in columns:
        edges = edges_of_branch(group, each, options)
        found = bound_threshold(group, knees, each, edges, at_tests)
        thresholds[names[each]] = _by_ramps(group, knees, each, found, at_tests.confidence)
    if len(columns) > 1:
        thresholds["mean"] = _mean_of(group, thresholds["opening"], thresholds["closing"])
    of_default = thresholds[names[column]].threshold
    return Guarding(
        column=column,
        trend=_trend_of(group, column, of_default.value, of_default.se, options),
        knees=knees,
        thresholds=thresholds,
    )


def _by_ramps(
    group: DescribedTests, knees: Knees, column: int, found: Threshold, confidence: float
) -> GuardedThreshold:
    """Return a branch's threshold by each ramp: its own knee, less what the threshold lies below the test's knee.

    What the bound of a test takes off beside noise and scatter is a budget of its ramps.
    """
    between = group.between(column)
    knee, knee_se = knees.knee[:, column], knees.knee_se[:, column]
    statistical = lower_bounds(found.value, knee_se, between, confidence, np.zeros(knee.size))
    # One lag of the meter moves all tests the same way.
    shared = float(np.floor(found.lag_budget.min() * 10**DECIMALS) / 10**DECIMALS)
    budget = np.maximum(statistical - found.bound - shared, 0.0)
    ramps, sources = _ramps_of(group, knees, column, lower_by=knee - found.value, budget=budget)
    return GuardedThreshold(threshold=found, between=between, ramps=replace(ramps, shared=shared), sources=sources)


def scatter_of_knees(group: DescribedTests, knees: Knees, column: int, options: IdentifyOptions) -> Scatter:
    """Return the model of a branch's knees by the single ramps, and their scatter."""
    declared, assumed = assumed_sd(options)
    nothing = np.zeros(len(group.tests))
    ramps, _ = _ramps_of(group, knees, column, lower_by=nothing, budget=nothing)
    return measure_scatter(ramps, declared=declared, assumed=assumed)


def _ramps_of(
    group: DescribedTests, knees: Knees, column: int, *, lower_by: np.ndarray, budget: np.ndarray
) -> tuple[Ramps, tuple[str, ...]]:
    """Return the knee of each ramp of a branch, lower by so much at each test (T,), and the names of the ramps.

    A test of which no ramp tells its knee counts as one ramp.
    """
    known = group.between(column).known
    knee, knee_se = knees.knee[:, column], knees.knee_se[:, column]
    untold = np.setdiff1d(np.arange(knee.size), known.test)
    test = np.concatenate([known.test, untold])
    y = np.concatenate([known.knee, knee[untold]]) - lower_by[test]
    se = np.sqrt(np.concatenate([known.noise, knee_se[untold] ** 2]))
    when = np.concatenate([known.when, np.full(untold.size, math.nan)])
    sources = [group.tests[row].ramps[number] for row, number in zip(known.test, known.number, strict=True)]
    sources += [group.tests[row].test.source for row in untold]
    return _rounded(group, test, y, se, when, budget), tuple(sources)


def _rounded(
    group: DescribedTests, test: np.ndarray, y: np.ndarray, se: np.ndarray, when: np.ndarray, budget: np.ndarray
) -> Ramps:
    """Return ramps with the numbers that valve.json will have; the budget rounded up."""
    dp = np.array([ANYWHERE_MPa if item.dp is None else item.dp / MPA for item in group.tests])
    told = len(group.tests) > 1 and np.isfinite(when).all() and np.ptp(when) > 0
    clock = (when - when.min()) / np.ptp(when) - 0.5 if told else None
    return Ramps(
        dp_MPa=np.round(dp, DECIMALS)[test],
        y=np.round(y, DECIMALS),
        se=np.round(se, DECIMALS),
        clock=None if clock is None else np.round(clock, DECIMALS),
        budget=np.ceil(budget * 10**DECIMALS)[test] / 10**DECIMALS,
    )


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


def departures(guarded: GuardedThreshold, direction: Direction, p_value: float | None) -> np.ndarray:
    """Return how far the tests depart from one direction, V (T,): zero unless that is significant."""
    from scipy.optimize import isotonic_regression

    value = guarded.threshold.value
    if p_value is None or p_value >= REFUSED or direction == "flat":
        return np.zeros(value.size)
    apart = np.abs(value - isotonic_regression(value, increasing=direction == "increasing").x)
    found: np.ndarray = np.where(apart >= apart.max() / 2, apart, 0.0)
    return found


def _mean_of(group: DescribedTests, opening: GuardedThreshold, closing: GuardedThreshold) -> GuardedThreshold:
    """Return the mean of both branches' thresholds: of each ramp that tells both, the mean of its two.

    Both branches of a ramp may share their errors, so the standard errors are averaged.
    """
    threshold = mean_threshold(group, opening.threshold, closing.threshold)
    place = {source: at for at, source in enumerate(opening.sources)}
    pairs = [(place[source], at) for at, source in enumerate(closing.sources) if source in place]
    if {closing.ramps.dp_MPa[at] for _, at in pairs} != set(closing.ramps.dp_MPa):
        pairs = []
    rising, falling = np.array(pairs, dtype=int).reshape(-1, 2).T
    up, down = opening.ramps, closing.ramps
    if up.budget is None or down.budget is None:
        raise ValueError("ramps without a budget have no mean")
    # The lag moves the branches against each other: of what both allow for it only their difference is left.
    shared = float(np.floor(threshold.lag_budget.min() * 10**DECIMALS) / 10**DECIMALS)
    credit = (opening.threshold.lag_budget + closing.threshold.lag_budget) / 2 - threshold.lag_budget
    credit = credit + shared - (up.shared + down.shared) / 2
    if not pairs:  # no ramp tells both branches: each test counts as one
        rows = np.arange(threshold.value.size)
        budget = np.maximum(threshold.value - threshold.bound, 0.0)
        shared = 0.0
        none = np.full(rows.size, math.nan)
        ramps = _rounded(group, rows, threshold.value, threshold.se, none, budget)
        sources = tuple(item.test.source for item in group.tests)
    else:
        dp = np.unique(down.dp_MPa)
        of_test = np.searchsorted(dp, down.dp_MPa[falling])
        budget = np.maximum((up.budget[rising] + down.budget[falling]) / 2 - credit[of_test], 0.0)
        ramps = Ramps(
            dp_MPa=down.dp_MPa[falling],
            y=np.round((up.y[rising] + down.y[falling]) / 2, DECIMALS),
            se=np.round((up.se[rising] + down.se[falling]) / 2, DECIMALS),
            clock=None if down.clock is None else down.clock[falling],
            budget=np.ceil(budget * 10**DECIMALS) / 10**DECIMALS,
        )
        sources = tuple(closing.sources[at] for at in falling)
    ramps = replace(ramps, shared=shared)
    between = max(opening.between, closing.between, key=lambda each: each.sd)
    return GuardedThreshold(threshold=threshold, between=between, ramps=ramps, sources=sources)


def assumed_sd(options: IdentifyOptions) -> tuple[float | None, float]:
    """Return the declared standard deviation from ramp to ramp, V, and the one that is assumed where nothing tells."""
    declared = None if options.repeatability is None else options.repeatability * options.u_max
    return declared, ASSUMED_REPEATABILITY * options.u_max
