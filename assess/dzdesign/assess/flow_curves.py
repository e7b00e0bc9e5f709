"""Flow over command of recorded ramps, one curve a branch, for the quantities of a valve test.

Reading, parting, pooling and the straight part are `identify`'s. One thing is not: a reading at zero command is left as
it is. `identify` takes it for the meter's zero error, and here it may be what the compensator lets through.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.assess.assessment import MeasuredBranch, MeasuredCurve
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.knees.curve_thinning import TOLERANCE, decimals_of, evenly_spaced, fewest_points
from dzdesign.identify.knees.gated_line import GATE, GatedLine, PreparedBranch, prepare_branch
from dzdesign.identify.knees.linear_region import USEFUL_FLOW, find_straight_parts
from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.knees.prepared_tests import split_recordings
from dzdesign.identify.knees.profile import largest_flow
from dzdesign.identify.knees.refusals import refuse_a_jump
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.pooling import PooledTest, group_by_pressure, pool_ramps
from dzdesign.identify.ramps.splitting import Ramp, nominal_dp
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.ramp_result import RampConditions, conditions_of

#: Width over u_max of the cells in which a curve is averaged: a mean over some tens of samples.
CELL = 0.01
#: Fewest samples of a cell that tell how they scatter.
FEWEST_IN_CELL = 3
#: A sample so far off the smoothed course, over the largest flow, may be an outlier; a finer meter's steps are not.
LEAST_GATE = 0.01
#: Commands that stay within this share of u_max are a hold; commands within `ZERO` of it are zero.
HOLD, ZERO = 2e-3, 0.01
#: A hold takes at least so long, s, and so many times longer than the ramp takes to cross it; and so many samples.
SHORTEST_HOLD_S, LONGER_THAN_RAMP, HOLD_SAMPLES = 0.5, 3.0, 10
#: A gap of so many usual steps of the clock is one: the other side of the valve was left out there.
GAP = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowCurve:
    """One branch: flow (m³/s) at the test's pressure drop over the command (V)."""

    #: Its samples and their course, smoothed over 0.1 % of u_max.
    read: PreparedBranch
    #: Means over cells of `CELL` u_max without outliers, in the order of rising command; the standard error is NaN
    #: where a cell holds too few samples to tell it, as in a table.
    u: np.ndarray
    q: np.ndarray
    q_se: np.ndarray
    #: Robust standard deviation of one sample about the course where the flow is small.
    sigma: float
    #: Long-run variance of the noise over its variance; 1 where no line tells it.
    variance_inflation: float
    #: Flow that counts as flow: the meter's floor, its noise or 0.5 % of the largest flow.
    level: float
    #: Through the straight part; where there is none, `no_line` says why.
    line: GatedLine | None
    no_line: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureCurves:
    """All ramps of one set at one pressure drop (Pa), on one side of the valve."""

    source: str
    ramps: tuple[str, ...]
    dp: float | None
    rising: FlowCurve | None
    falling: FlowCurve | None
    #: Largest flow as recorded, m³/s, and largest command, V.
    q_max: float
    u_top: float
    #: Flow in the later half of the holds at zero command after closing, m³/s; empty where there is no such hold.
    at_zero: np.ndarray
    #: How the ramps were recorded.
    conditions: RampConditions

    @property
    def curves(self) -> tuple[FlowCurve, ...]:
        """The branches that there are."""
        return tuple(curve for curve in (self.rising, self.falling) if curve)

    @property
    def y_max(self) -> float:
        """Largest flow at the nominal pressure drop, m³/s."""
        return max(curve.read.y_max for curve in self.curves)

    @property
    def variance_inflation(self) -> float:
        """Long-run variance of the meter's noise over its variance."""
        return max(curve.variance_inflation for curve in self.curves)

    @property
    def counts(self) -> float:
        """Flow that counts as flow on both branches, m³/s."""
        return max(curve.level for curve in self.curves)


def read_curves(
    tests: Sequence[RampTest], options: IdentifyOptions, *, floor: float, lag: float
) -> list[PressureCurves]:
    """Read the curves of one side, its commands positive, from one set of recordings: by rising pressure drop.

    The meter shows nothing below `floor` (m³/s); its `lag` (s) is taken out.

    Raises
    ------
    InputError
        For a recording without a ramp, without flow, or without a pressure drop beside others.
    """
    ramps = split_recordings(tests, options, lag)
    pooled, groups = pool_ramps(ramps), group_by_pressure(ramps)
    for item in pooled:
        if item.branches == (None, None):
            u, dp = item.test.u, nominal_dp(item.test)
            at = "an unknown pressure drop" if dp is None else worded("{dp:.3g MPa}", dp=dp / MPA)
            raise InputError(
                worded(
                    "'{source}' has no ramp from near zero up at {at}: the command runs from {low:.2f #V} to "
                    "{high:.2f V}, expected a sweep over half of it at least; record it so, and give the compensator's "
                    "input, not its output",
                    source=item.test.source,
                    at=at,
                    low=u.min(),
                    high=u.max(),
                )
            )
    reads = [
        None if branch is None else prepare_branch(branch, item.test, u_max=options.u_max, floor=floor)
        for item in pooled
        for branch in item.branches
    ]
    curves = _curves(reads, options)
    return [
        _at_pressure(item, group, rising, falling, options)
        for item, group, rising, falling in zip(pooled, groups, curves[::2], curves[1::2], strict=True)
    ]


def _curves(reads: Sequence[PreparedBranch | None], options: IdentifyOptions) -> list[FlowCurve | None]:
    """Return a curve for each branch; straight parts are those of all together, or of each that has one by itself."""
    branches = {index: read for index, read in enumerate(reads) if read is not None}
    reasons: dict[int, str] = {}
    for index, read in branches.items():
        try:
            refuse_a_jump(read, options.u_max)
        except InputError as error:
            reasons[index] = str(error)
    known = [index for index in branches if index not in reasons]
    found: dict[int, tuple[GatedLine, float]] = {}
    # One meter has read all branches, and one valve has made them: together they tell more of noise and of bends.
    for group in (known, *([index] for index in known)):
        missing = [index for index in group if index not in found]
        if not missing:
            continue
        try:
            group_reads = [branches[index] for index in missing]
            parts = find_straight_parts(group_reads, u_max=options.u_max, window=options.knee_window)
        except InputError as error:
            reasons |= {index: str(error) for index in missing}
            continue
        found |= dict(zip(missing, zip(parts.lines, parts.levels, strict=True), strict=True))
    curves = {
        index: _curve(read, found.get(index), reasons.get(index, ""), options.u_max) for index, read in branches.items()
    }
    return [curves.get(index) for index in range(len(reads))]


def _curve(read: PreparedBranch, straight: tuple[GatedLine, float] | None, reason: str, u_max: float) -> FlowCurve:
    """Average a branch over cells of the command, samples far off its smoothed course left out."""
    line, level = straight or (None, max(read.floor, USEFUL_FLOW * read.y_max))
    u, y = read.branch.u, read.y
    about = y - np.interp(u, *read.profile)
    kept = np.abs(about) <= max(GATE * robust_sigma(about), LEAST_GATE * read.y_max)
    u, y, about = u[kept], y[kept], about[kept]
    cell = np.floor(u / (CELL * u_max)).astype(int)
    filled, index, n = np.unique(cell, return_inverse=True, return_counts=True)

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(index, weights=values, minlength=filled.size) / n

    # Noise with a memory averages out no better than 1/inflation of its samples would, white.
    inflation = line.variance_inflation if line else 1.0
    small = np.interp(u, *read.profile) < 0.05 * read.y_max
    return FlowCurve(
        read=read,
        u=mean(u),
        q=mean(y),
        q_se=np.where(n < FEWEST_IN_CELL, np.nan, np.sqrt(mean(about**2) * np.minimum(inflation, n) / n)),
        sigma=robust_sigma(about[small] if small.sum() >= 20 else about),
        variance_inflation=inflation,
        level=level,
        line=line,
        no_line="" if line else reason,
    )


def _at_pressure(
    item: PooledTest,
    group: Sequence[Ramp],
    rising: FlowCurve | None,
    falling: FlowCurve | None,
    options: IdentifyOptions,
) -> PressureCurves:
    return PressureCurves(
        source=item.test.source,
        ramps=item.ramps,
        dp=nominal_dp(item.test),
        rising=rising,
        falling=falling,
        q_max=largest_flow(item.branches, options.u_max),
        u_top=max(float(branch.u.max()) for branch in item.branches if branch),
        at_zero=np.concatenate([_hold_after_closing(ramp, options.u_max) for ramp in group]),
        conditions=conditions_of([branch.rate for branch in item.branches if branch], item.test.time),
    )


def _hold_after_closing(ramp: Ramp, u_max: float) -> np.ndarray:
    """Return the flow in the later half of the hold at zero command that follows a ramp's falling branch, m³/s.

    The first half is left to the valve, the hoses and the meter to come to rest. A ramp that ends at zero without
    standing there has no such hold: the flow of its last volts is no flow at zero.
    """
    falling = [branch for branch in ramp.branches if not branch.rising]
    if not falling:
        return np.empty(0)
    time, u, q = ramp.test.time, ramp.test.u, ramp.test.q
    closed = int(np.flatnonzero(u > ZERO * u_max)[-1]) + 1 if np.any(u > ZERO * u_max) else 0
    time, u, q = time[closed:], u[closed:], q[closed:]
    usual = float(np.median(np.diff(ramp.test.time)))
    gaps = np.flatnonzero(np.diff(time) > GAP * usual) if usual > 0 else np.empty(0, dtype=int)
    if gaps.size:
        time, u, q = time[: gaps[0] + 1], u[: gaps[0] + 1], q[: gaps[0] + 1]
    if u.size < HOLD_SAMPLES:
        return np.empty(0)
    held = np.flatnonzero(np.abs(u - np.median(u)) <= HOLD * u_max)
    rate = falling[-1].rate
    crossed = 2 * HOLD * u_max / rate if rate > 0 else math.nan
    seconds = float(time[held[-1]] - time[held[0]])
    if seconds > 0 and not seconds >= np.fmax(SHORTEST_HOLD_S, LONGER_THAN_RAMP * crossed):
        return np.empty(0)
    hold = q[held]
    return hold[hold.size // 2 :] if hold.size >= HOLD_SAMPLES else np.empty(0)


#: Most points of a line in assessment.json, and most samples beside it.
MOST_POINTS, MOST_SAMPLES = 104, 24


def measured_curve(curves: PressureCurves, u_max: float) -> MeasuredCurve:
    """Return the curve of one set at one pressure drop, thinned to at most `MOST_POINTS` points a branch.

    Full command `u_max` in V.
    """
    rising, falling = (
        None if curve is None else _branch(curve, u_max, TOLERANCE * curves.y_max)
        for curve in (curves.rising, curves.falling)
    )
    return MeasuredCurve(rising=rising, falling=falling, conditions=curves.conditions)


def _branch(curve: FlowCurve, u_max: float, tolerance: float) -> MeasuredBranch:
    u, q = curve.read.profile
    at, flows = fewest_points(u, q, np.full(q.size, tolerance))
    kept = evenly_spaced(curve.read.branch.u, MOST_SAMPLES)
    decimals = decimals_of(curve.read.y_max / L_MIN)
    # Of two points that round to one command the later one stands for both.
    line = dict(zip(_rounded(100 * u[at] / u_max, 3), _rounded(flows / L_MIN, decimals), strict=True))
    return MeasuredBranch(
        command_percent=tuple(line),
        q_L_min=tuple(line.values()),
        sample_command_percent=_rounded(100 * curve.read.branch.u[kept] / u_max, 3),
        sample_q_L_min=_rounded(curve.read.y[kept] / L_MIN, decimals),
    )


def _rounded(values: np.ndarray, decimals: int) -> tuple[float, ...]:
    return tuple(round(value, decimals) + 0.0 for value in values.tolist())
