"""The pressure drop of a sweep, and what of a recording was not run at it.

A pump is started, set and stopped while the logger runs. The rule. The level of a sweep is the pressure drop over the
shut valve that goes with its first flow: what the supply did before it came up, or after it went, is none. A hold at
the bottom whose pressure drop is off that level is left out, and so is a part of a sweep where the pressure is gone;
a flow at another pressure drop stays, for it is brought to the nominal one sample by sample.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.ramps.branches import median
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.left_out import LeftOut

#: The first flow lies between these shares of the largest, and the valve is shut below the third.
FIRST_FLOW, SHUT_FLOW = (0.05, 0.3), 0.03
#: A flow counts from so many standard deviations of a reading on.
FLOW_SIGNIFICANCE = 4.0
#: The pressure drop over the shut valve goes with one at the first flow within this share of it: supplies sag.
GOES_WITH = 0.25
#: A first flow was run at one pressure drop if that of its two halves differs by less than this share.
ONE_LEVEL = 0.15
#: Fewest samples of the first flow, and of the shut valve, that show a level.
FIRST_SAMPLES, SHUT_SAMPLES = 5, 10
#: Share of the command at the first flow from which the shut valve is near its edge.
NEAR_EDGE = 0.5
#: The pressure drop near zero is off the level by more than this share of it, and so many spreads of the shut valve's.
OFF_LEVEL, OFF_SPREADS = 0.02, 5.0
#: Spread of a pressure drop over itself from which it swings or scatters: then what a moment shows is not its level.
SWINGS = 0.03
#: Within a sweep the pressure is another where it is off by this factor with no flow, and gone below this share of it.
ANOTHER, GONE = 2.0, 0.1
#: A sweep with no flow has no pressure below this share of the largest level.
NO_PRESSURE = 0.02
#: Share of the largest command that a sweep of a ramp test comes to: less is an exercise of the valve.
WHOLE = 0.5
#: Samples whose median is no spike.
RUN = 5
#: Samples of the shut valve between two stretches that are left out which go with them.
BETWEEN = 20
#: Usual steps of the clock beyond which rows are missing, as those of the other side.
LOST_ROWS = 20

Reason = Literal["option", "pressure", "no-pressure", "partial", "no-ramp"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepLevel:
    """The pressure drop of one sweep at (almost) no flow, Pa; None if it is unknown."""

    dp: float | None
    #: Whether a flow shows that it is the sweep's.
    sure: bool
    #: Whether there is a flow at its largest command.
    flows: bool
    #: Largest flow at which the valve counts as shut, m³/s, and spread of the pressure drop there, Pa.
    shut_below: float
    spread: float
    #: Whether the pressure drop near zero is another, all in all: it had not come up yet, or had gone.
    moves_at_zero: bool = False


def sweep_level(test: RampTest, nominal: float | None, shut_share: float) -> SweepLevel:
    """Return the level of a sweep.

    Parameters
    ----------
    test : RampTest
        Samples of the sweep, holds included.
    nominal : float or None
        What its samples below `shut_share` of the largest command show all together, Pa: the level where no flow tells.
    shut_share : float
        Share of the largest command below which the pressure drop is read.
    """
    top = float(test.u.max())
    full = _largest_flow(test.q[test.u >= 0.9 * top])
    noise = 1.4826 * median(np.abs(np.diff(test.q))) / 2**0.5 if test.q.size > 1 else 0.0
    flows = full > max(FLOW_SIGNIFICANCE * noise, 0.01 * L_MIN)
    shut_below = max(SHUT_FLOW * full, FLOW_SIGNIFICANCE * noise)
    unknown = SweepLevel(dp=nominal, sure=False, flows=flows, shut_below=shut_below, spread=0.0)
    if test.dp is None or nominal is None or not flows:
        return unknown
    low, high = (share * full for share in FIRST_FLOW)
    first = (test.q > max(low, shut_below)) & (test.q < high)
    if np.count_nonzero(first) < FIRST_SAMPLES:
        return unknown
    at_first, edge = median(test.dp[first]), median(test.u[first])
    halves = [median(half) for half in np.array_split(test.dp[first], 2)]
    if at_first <= 0 or abs(halves[0] - halves[1]) > ONE_LEVEL * at_first:
        return unknown
    goes_with = (test.q <= shut_below) & (np.abs(test.dp - at_first) <= GOES_WITH * at_first)
    if np.count_nonzero(goes_with) < SHUT_SAMPLES:
        return unknown
    near_zero = test.dp[goes_with & (test.u >= 0) & (test.u <= shut_share * top)]
    # Near zero the pressure may not have come up yet, or have gone already: below the edge it has been there longest.
    near_edge = test.dp[goes_with & (test.u >= NEAR_EDGE * edge) & (test.u <= edge)]
    if near_edge.size < FIRST_SAMPLES:
        near_edge = test.dp[goes_with]
    dp = float(np.median(near_edge))
    spread = spread_of(near_edge)
    # A slow swing may stay at its crest near the edge.
    below = test.dp[goes_with]
    moves, swings = False, swings_about(median(below), max(spread, spread_of(below)))
    if swings:
        dp, spread = level_of_swings(below), max(spread, spread_of(below))
    if near_zero.size >= FIRST_SAMPLES:
        at_zero = float(np.median(near_zero))
        error = 3 * spread / (1.0 if swings else math.sqrt(min(near_zero.size, near_edge.size)))
        moves = abs(at_zero - dp) > max(OFF_LEVEL * dp, error)
        dp = dp if moves or swings else at_zero
    return SweepLevel(dp=dp, sure=True, flows=flows, shut_below=shut_below, spread=spread, moves_at_zero=moves)


def swings_about(level: float, spread: float) -> bool:
    """Tell whether a pressure drop of such a spread swings, and neither stands still nor was switched."""
    return SWINGS * level < spread <= GOES_WITH * level


def level_of_swings(dp: np.ndarray) -> float:
    """Return what a pressure drop that swings does so about: the mean, without what is far off."""
    middle = float(np.median(dp))
    return float(dp[np.abs(dp - middle) <= GOES_WITH * abs(middle)].mean())


def spread_of(dp: np.ndarray) -> float:
    """Return the spread of a pressure drop that stands still, at least a step of a coarse converter."""
    steps = np.abs(np.diff(dp))
    steps = steps[steps > 0]
    step = float(np.median(steps)) if steps.size else 0.0
    return max(1.4826 * float(np.median(np.abs(dp - np.median(dp)))), step)


def _largest_flow(q: np.ndarray) -> float:
    """Return the largest flow that is no spike; a pump may have run for a part of the time only."""
    if q.size < RUN:
        return float(np.median(q))
    return float(np.median(q[: q.size // RUN * RUN].reshape(-1, RUN), axis=1).max())


def off_level(test: RampTest, at_bottom: np.ndarray, level: SweepLevel) -> np.ndarray:
    """Return which samples of a sweep were not run at its level (N,).

    Parameters
    ----------
    test : RampTest
        Samples of the sweep, their pressure drop freed of single odd ones.
    at_bottom : (N,) array of bool
        Where the command rests at its lowest.
    level : SweepLevel
        Of this sweep, or of the one that it makes a ramp with.
    """
    if test.dp is None or not level.dp or level.dp < 0 or not level.sure:
        return np.zeros(test.u.size, dtype=bool)
    shut, away = test.q <= level.shut_below, np.abs(test.dp - level.dp)
    resting = shut & at_bottom & (away > OFF_LEVEL * level.dp)
    moving = shut & ((test.dp * ANOTHER < level.dp) | (test.dp > ANOTHER * level.dp))
    off: np.ndarray = (resting | moving | (test.dp < GONE * level.dp)) & (away > OFF_SPREADS * level.spread)
    if level.moves_at_zero:  # of noisy readings each may be the level's
        off |= shut & at_bottom
    # A few samples between two such stretches are where a moving pressure crosses the level.
    for start, end in pairwise(np.flatnonzero(off).tolist()):
        if 1 < end - start <= BETWEEN + 1:
            off[start:end] |= shut[start:end]
    return off


def stretches(test: RampTest, rows: np.ndarray, reason: Reason) -> list[LeftOut]:
    """Return the stretches that some rows of a recording make, given by number in rising order."""
    step = float(np.median(np.diff(test.time))) if test.time.size > 1 else 0.0
    ends = np.flatnonzero((np.diff(rows) > 1) | (np.diff(test.time[rows]) > LOST_ROWS * step)) + 1
    return [left_out(test, part, reason) for part in np.split(rows, ends) if part.size]


def joined(parts: Sequence[LeftOut], test: RampTest) -> list[LeftOut]:
    """Return what was left out of a recording in the order of time, stretches that follow each other as one.

    What lies between two where the command was on the other side of zero is that side's, and left out of none.
    """
    found: list[LeftOut] = []
    for part in sorted(parts, key=lambda part: part.from_s):
        last = found[-1] if found else None
        crossed = last is not None and any(last.to_s < time <= part.from_s for time in test.crossed)
        follows = last and not crossed and not np.any((test.time > last.to_s) & (test.time < part.from_s))
        if last and follows and last.reason == part.reason:
            dp = (*(last.dp_MPa or ()), *(part.dp_MPa or ()))
            found[-1] = replace(last, to_s=part.to_s, dp_MPa=(min(dp), max(dp)) if dp else None)
        else:
            found.append(part)
    return found


def left_out(test: RampTest, rows: np.ndarray, reason: Reason) -> LeftOut:
    """Return what the record says of rows in a row."""
    return LeftOut(
        recording=test.source,
        from_s=float(test.time[rows[0]]),
        to_s=float(test.time[rows[-1]]),
        reason=reason,
        dp_MPa=None if test.dp is None else (float(test.dp[rows].min()) / MPA, float(test.dp[rows].max()) / MPA),
    )


def why_no_ramp(levels: Sequence[SweepLevel], reach: Sequence[float]) -> list[Reason | None]:
    """Tell of each sweep why it is none of a ramp test, None of those that are.

    `reach` is the largest command of each, V. Where no whole sweep opens the valve all are of a test: it is shut.
    """
    opening = [level for level in levels if level.flows]
    best = max((level.dp or 0.0 for level in opening), default=0.0)
    found: list[Reason | None] = []
    for level, far in zip(levels, reach, strict=True):
        no_pressure = not level.flows and level.dp is not None and level.dp < NO_PRESSURE * best
        found.append("no-pressure" if no_pressure else "partial" if far < WHOLE * max(reach) else None)
    whole = [level for level, reason in zip(levels, found, strict=True) if reason is None]
    return found if any(level.flows for level in whole) else [None] * len(found)
