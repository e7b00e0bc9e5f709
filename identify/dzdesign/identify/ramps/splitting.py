"""Ramps of a recording: parted at the turning points of the command, put right for the meter's lag.

The rule. The command's sweeps run from one turning point to the next (`command.sweep_direction`); two sweeps in a row,
up and down, are one ramp, and the next two the next. Where two ramps meet in a hold at the bottom, the cut lies where
the pressure drop steps, or in the middle of the hold if it is not known. Two sweeps that were run at pressure drops
more than `TWO_PRESSURES` apart are of two ramps. A sweep of a few samples, or much faster than the slowest, is the jump
back of a saw-tooth and no branch. What was not run at the ramp's pressure drop is left out: see `sweep_pressure`. Which
ramps are one test is said by their pressure drops: see `pooling`.
"""

import bisect
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.ramps.branches import Branch, median
from dzdesign.identify.ramps.command import (
    SMALLEST_MOVE,
    TURN,
    lagged_command,
    sweep_direction,
    without_command_spikes,
)
from dzdesign.identify.ramps.staircases import find_staircase
from dzdesign.identify.ramps.sweep_pressure import (
    SHUT_FLOW,
    SweepLevel,
    joined,
    level_of_swings,
    off_level,
    spread_of,
    stretches,
    sweep_level,
    swings_about,
    why_no_ramp,
)
from dzdesign.identify.reading.ramp_test import RampTest, despiked, once_a_recording
from dzdesign.identify.valve.left_out import LeftOut

#: The valve is shut, and the pressure drop nominal, below this share of the range.
SHUT = 0.05
#: So near to the lowest command, as a share of the range, the command holds.
HOLD = 1e-3
#: A step between two ramps counts from this share of the pressure drop on (below it they are one test), and from so
#: many standard errors.
PRESSURE_STEP = 0.02
STEP_SIGNIFICANCE = 5.0
#: A ramp whose sweeps' pressure drops differ by more than this share was run at two.
TWO_PRESSURES = 0.1
#: Quantile of the flow from which it is largest.
LARGEST_FLOWS = 0.9
#: Fewest samples of a sweep that is a branch, and how many times faster than the slowest it may be.
SWEEP_SAMPLES, FASTEST = 5, 20
#: Fewest of them between its ends: with fewer the command steps, and a level tells nothing of the way to it.
BETWEEN_ENDS = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """One ramp of a recording."""

    #: Its samples, command as recorded.
    test: RampTest
    #: Which ramp of how many in its recording, from 1.
    number: int
    of: int
    #: Pressure drop at (almost) no flow, Pa, which the supply's droop has not touched.
    dp: float | None
    #: Its sweeps from zero up, command put right for the meter's lag.
    branches: tuple[Branch, ...]
    #: What was left out of it, or between it and the ramp before.
    left_out: tuple[LeftOut, ...] = ()

    @property
    def when(self) -> float:
        """When it was recorded, s on a clock common to all recordings; NaN if that is not known."""
        return math.nan if self.test.started is None else self.test.started + float(self.test.time.mean())


@dataclass(frozen=True, slots=True, kw_only=True)
class _Sweep:
    """The samples from one turning point of the command to the next."""

    rows: slice
    #: Those samples, command as recorded.
    test: RampTest
    #: 1 (up), -1 (down), or 0 where the command does not move.
    direction: int
    #: Whether it is slow and long enough for a branch.
    is_branch: bool
    level: SweepLevel


def split_ramps(test: RampTest, lag: float) -> list[Ramp]:
    """Split a recording into ramps, by the rule of this module.

    By the lag of the flow meter, s, the flow read at t belongs to the command at t - lag.

    Raises
    ------
    InputError
        Where the command jumps back and forth within a ramp.
    """
    test = without_command_spikes(test)
    stairs = find_staircase(test.u, test.q, test.source, np.searchsorted(test.time, test.crossed))
    if stairs is not None:  # what has settled has no lag
        test = replace(test, u=stairs.u, q=stairs.q).part(stairs.settled)
    if test.beyond is not None:  # only now: a level whose flow is not seen is where the next one is reached from
        test = replace(test.part(~test.beyond), beyond=None)
    if stairs is not None and stairs.shuffled:
        test = _in_order_of_levels(test)
    side = 0 if stairs is None else stairs.reached
    u = lagged_command(test.time, test.u, lag) if stairs is None else test.u
    sweeps = _sweeps(test, u)
    slow = [sweep for sweep in sweeps if sweep.is_branch]
    why = iter(why_no_ramp([sweep.level for sweep in slow], [sweep.test.top for sweep in slow]))
    reasons = [next(why) if sweep.is_branch else None for sweep in sweeps]  # a jump goes with a ramp
    taken = [sweep for sweep, reason in zip(sweeps, reasons, strict=True) if reason is None]
    groups = _groups(taken, branches=1 if side else 2)
    # Before that, or after, the command that the flow belongs to was not recorded.
    kept = (test.time >= test.time[0] + lag) & (test.time <= test.time[-1] + lag)
    found, left_out = [], list(test.left_out)
    for sweep, reason in zip(sweeps, reasons, strict=True):
        if reason is not None:
            left_out += stretches(test, np.arange(sweep.rows.start, sweep.rows.stop), reason)
    for group in groups:
        rows = slice(group[0].rows.start, group[-1].rows.stop)
        off, part = _off_level(group, test), test.part(rows)
        in_ramp = kept.copy()
        in_ramp[rows] &= ~off
        slow = [sweep for sweep in group if sweep.is_branch]
        branches = [_branch(test, u, in_ramp, sweep.rows, side or sweep.direction) for sweep in slow]
        branches = [branch for branch in branches if branch.u.size >= SWEEP_SAMPLES]
        not_taken = rows.start + np.flatnonzero(off if branches else np.ones_like(off))
        left_out += stretches(test, not_taken, "pressure" if branches else "no-ramp")
        found.append((part.part(~off) if off.any() and not off.all() else part, tuple(branches)))
    if any(branches for _, branches in found):
        found = [(part, branches) for part, branches in found if branches]
    return _numbered(found, joined(left_out, test))


def _in_order_of_levels(test: RampTest) -> RampTest:
    """Return levels that were all reached from one side as one sweep over them, on the clock of the recording.

    A level's own time does not matter: it has settled.
    """
    order = np.argsort(test.u, kind="stable")
    if test.dp is not None:
        shut = test.dp[test.q <= np.quantile(test.q, 0.1)]
        if np.quantile(shut, 0.95) > (1 + TWO_PRESSURES) * np.quantile(shut, 0.05):
            raise InputError(
                f"'{test.source}': the levels of the command follow in no order, at several pressure drops; make a "
                "recording of each pressure drop, or give --from and --to"
            )
    return replace(test.part(order), time=test.time)


def _numbered(found: list[tuple[RampTest, tuple[Branch, ...]]], left_out: list[LeftOut]) -> list[Ramp]:
    """Return the ramps that a recording's parts and their branches are; what was left out goes with the next one."""
    ends = [float(part.time[-1]) for part, _ in found]
    owner = [min(bisect.bisect_left(ends, item.from_s), len(ends) - 1) for item in left_out]
    return [
        Ramp(
            test=part,
            number=index + 1,
            of=len(found),
            dp=nominal_dp(part),
            branches=branches,
            left_out=tuple(item for item, ramp in zip(left_out, owner, strict=True) if ramp == index),
        )
        for index, (part, branches) in enumerate(found)
    ]


def _sweeps(test: RampTest, u: np.ndarray) -> list[_Sweep]:
    """Return the sweeps of a recording, `u` its command put right for the lag."""
    direction = sweep_direction(u)
    turns = np.flatnonzero(np.diff(direction)) + 1
    cuts = [0, *(_cut(u, test.dp, int(turn), direction) for turn in turns), u.size]
    rows = [slice(*ends) for ends in pairwise(cuts)]
    if any(part.stop <= part.start for part in rows):
        raise InputError(
            f"'{test.source}': the command jumps back and forth ({turns.size} turns), expected ramps; if the logger "
            "lost samples of the command, leave their cells blank"
        )
    # Volts per sample between the holds: over the middle of the range.
    pace = [0.8 * float(np.ptp(u[part])) / max(int(np.sum(_between_ends(u[part]))), 1) for part in rows]
    slowest = min(one for one, part in zip(pace, rows, strict=True) if np.ptp(u[part]) >= 0.5 * np.ptp(u))
    sweeps = []
    for part, one, turn in zip(rows, pace, [0, *turns], strict=True):
        samples = test.part(part)
        way = int(direction[turn])
        level = sweep_level(samples, nominal_dp(samples), SHUT)
        steps = samples.u.size < SWEEP_SAMPLES or np.sum(_between_ends(u[part])) < BETWEEN_ENDS
        is_branch = way != 0 and one <= FASTEST * slowest and not steps
        sweeps.append(_Sweep(rows=part, test=samples, direction=way, is_branch=is_branch, level=level))
    return sweeps


def _groups(sweeps: Sequence[_Sweep], branches: int) -> list[list[_Sweep]]:
    """Return sweeps that make a ramp together: two branches in a row (or one), and the jump before or after them."""
    groups: list[list[_Sweep]] = []
    for sweep in sweeps:
        if groups and groups[-1][-1].rows.stop == sweep.rows.start and _belongs(sweep, groups[-1], branches):
            groups[-1].append(sweep)
        else:
            groups.append([sweep])
    return groups


def _belongs(sweep: _Sweep, group: Sequence[_Sweep], branches: int) -> bool:
    """Tell whether a sweep goes on with the ramp that the sweeps before it make."""
    last = group[-1]
    if not sweep.is_branch:
        return sweep.direction < 0  # a jump down leads back from a rising ramp, a jump up to a falling one
    if not last.is_branch:
        return last.direction >= 0
    return sum(one.is_branch for one in group) < branches and not _apart(last.level, sweep.level)


def _apart(one: SweepLevel, other: SweepLevel) -> bool:
    """Tell whether two sweeps were run at two pressure drops; one that shows none goes with the other."""
    if one.sure is not other.sure:
        return False
    levels = one.dp or 0.0, other.dp or 0.0
    return max(levels) - min(levels) > TWO_PRESSURES * max(levels)


def _off_level(group: Sequence[_Sweep], test: RampTest) -> np.ndarray:
    """Return which samples of a ramp were not run at its pressure drop (N,)."""
    sure = [sweep.level for sweep in group if sweep.level.sure]
    found = []
    lowest = min(float(sweep.test.smooth.min()) for sweep in group) + SHUT * float(np.ptp(test.u))
    for sweep in group:
        level = sweep.level
        if not level.sure and sure:
            level = replace(level, dp=sure[0].dp, spread=sure[0].spread, sure=True)
        part = sweep.test if sweep.test.dp is None else replace(sweep.test, dp=despiked(sweep.test.dp))
        found.append(off_level(part, part.u <= lowest, level))
    return np.concatenate(found)


def _between_ends(u: np.ndarray) -> np.ndarray:
    """Return which samples of a sweep lie in the middle of its range, away from the holds at its ends (N,)."""
    between: np.ndarray = (u > u.min() + 0.1 * np.ptp(u)) & (u < u.max() - 0.1 * np.ptp(u))
    return between


@once_a_recording
def nominal_dp(test: RampTest) -> float | None:
    """Return the pressure drop at (almost) no flow, Pa; None if it is unknown.

    Read where the command is near zero; a fragment that never comes there is read at its smallest flows. One that
    swings is seen and read wherever the valve is shut: near zero a slow swing may stay at its crest.
    """
    if test.dp is None:
        return None
    shut = test.dp[(test.u >= 0) & (test.u <= SHUT * max(test.u.max(), 0))]
    if shut.size < 5:
        return median(test.dp[test.q <= np.quantile(test.q, 0.1)])
    wherever_shut = test.dp[(test.u >= 0) & (np.abs(test.q) <= SHUT_FLOW * np.abs(test.q).max())]
    if wherever_shut.size and swings_about(median(wherever_shut), spread_of(wherever_shut)):
        return level_of_swings(wherever_shut)
    return median(shut)


@once_a_recording
def dp_under_flow(test: RampTest) -> float | None:
    """Return the pressure drop where the flow is largest, of whatever sign, Pa; None if it is unknown."""
    if test.dp is None:
        return None
    size = np.abs(test.q)
    return median(test.dp[size >= np.quantile(size, LARGEST_FLOWS)])


def _branch(test: RampTest, u: np.ndarray, known: np.ndarray, rows: slice, direction: int) -> Branch:
    inside = np.zeros(u.size, dtype=bool)
    inside[rows] = True
    inside &= known & (u >= 0)
    inside[_hold_from_the_other_side(u, rows, direction)] = False
    part, u = test.part(inside), u[inside]
    return Branch(rising=direction > 0, u=u, q=part.q, dp=part.dp, rate=_rate(part.time, u))


def _hold_from_the_other_side(u: np.ndarray, rows: slice, direction: int) -> slice:
    """Return the samples at a sweep's beginning that hold between the ends of the command: the sweep before came there.

    At the ends themselves, in the dead zone or at full command, both branches are one.
    """
    part, span = direction * u[rows], float(np.ptp(u))
    if part.min() - (direction * u).min() <= SHUT * span:
        return slice(0)
    away = part - part.min() > TURN * span
    held = np.flatnonzero(part[: int(np.argmax(away))] - part.min() <= SMALLEST_MOVE * span)
    return slice(rows.start, rows.start + int(held[-1]) + 1) if held.size else slice(0)


def _rate(time: np.ndarray, u: np.ndarray) -> float:
    """Return the pace of the command between the holds of a sweep, V/s; NaN if it can't be told."""
    if u.size < SWEEP_SAMPLES:
        return math.nan
    middle = _between_ends(u)
    seconds = float(np.ptp(time[middle])) if middle.sum() > 1 else 0.0
    return float(np.ptp(u[middle])) / seconds if seconds > 0 else math.nan


def _cut(u: np.ndarray, dp: np.ndarray | None, turn: int, direction: np.ndarray) -> int:
    """Return where two sweeps are parted: where the pressure steps in a hold, or else at the turn, below in the middle.

    A step that the noise may have made, or that leaves the pressure the same, parts nothing: the sweeps would lose what
    lies between it and the turn, and with it an edge that opens there.
    """
    at_top = direction[turn] < 0
    if at_top:
        held = u >= u[turn - 1 : turn + 1].max() - SMALLEST_MOVE * np.ptp(u)
    else:
        held = u <= u[turn - 1 : turn + 1].min() + SHUT * np.ptp(u)
    before, after = np.flatnonzero(~held[:turn]), np.flatnonzero(~held[turn:])
    start = int(before[-1]) + 1 if before.size else 0
    stop = turn + int(after[0]) if after.size else u.size
    at_rest = turn
    if not at_top:  # the middle of the samples that stand at the lowest command
        at_bottom = start + np.flatnonzero(u[start:stop] <= u[start:stop].min() + HOLD * np.ptp(u))
        at_rest = int(at_bottom[at_bottom.size // 2]) if at_bottom.size else turn
    if dp is None or stop - start < 4:
        return at_rest
    # Two levels with the least squares about them; n m^2 of both sides is largest there.
    mean = dp[start:stop].mean()
    off = dp[start:stop] - mean
    left, n = np.cumsum(off)[:-1], np.arange(1, off.size)
    gain = left**2 / n + left**2 / (off.size - n)
    cut = int(np.argmax(gain))
    step = abs(left[cut]) * (1 / n[cut] + 1 / (off.size - n[cut]))
    about_levels = max(float(np.sum(off**2) - gain[cut]), 0.0) / (off.size - 2)
    share = TWO_PRESSURES if at_top else PRESSURE_STEP  # under flow the pressure drop may sink in a hold
    real = step > share * abs(mean) and gain[cut] > STEP_SIGNIFICANCE**2 * about_levels
    return start + 1 + cut if real else at_rest
