"""Ramps of a recording: parted at the turning points of the command, put right for the meter's lag.

The rule. The command's sweeps run from one turning point to the next (`sweep_direction`); two sweeps in a row, up and
down, are one ramp, and the next two the next. Where two ramps meet in a hold at the bottom, the cut lies where the
pressure drop steps, or in the middle of the hold if it is not known. A ramp whose two sweeps were run at pressure drops
more than `TWO_PRESSURES` apart is two ramps. A sweep of a few samples, or much faster than the recording's longest, is
the jump back of a saw-tooth and no branch. Which ramps are one test is said by their pressure drops: see `pooling`.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.ramps.branches import Branch
from dzdesign.identify.reading.ramp_test import RampTest

#: A change of direction is real when the command has gone back by this share of its range.
TURN = 0.1
#: Points to which a recording is thinned before the search for changes of direction.
TURN_SEARCH_POINTS = 4000
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
#: Fewest samples of a sweep that is a branch, and how many times faster than the longest it may be.
SWEEP_SAMPLES, FASTEST = 5, 20
#: A command is a spike if it stands out of its neighbours by this share of the range and this many usual steps.
SPIKE, SPIKE_STEPS = 0.02, 10


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


def split_ramps(test: RampTest, lag: float) -> list[Ramp]:
    """Split a recording into ramps, by the rule of this module.

    By the lag of the flow meter, s, the flow read at t belongs to the command at t - lag.

    Raises
    ------
    InputError
        Where the command jumps back and forth within a ramp.
    """
    test = _without_command_spikes(test)
    u = lagged_command(test.time, test.u, lag)
    direction = sweep_direction(u)
    turns = np.flatnonzero(np.diff(direction)) + 1
    cuts = [0, *(_cut(u, test.dp, int(turn), direction) for turn in turns), u.size]
    sweeps = [(slice(*ends), int(direction[turn])) for ends, turn in zip(pairwise(cuts), [0, *turns], strict=True)]
    if any(part.stop <= part.start for part, _ in sweeps):
        raise InputError(
            f"'{test.source}': the command jumps back and forth ({turns.size} turns), expected ramps; if the logger "
            "lost samples of the command, leave their cells blank"
        )
    known = test.time >= test.time[0] + lag  # before that, the command that the flow belongs to was not recorded
    pace = [_pace(u[part]) for part, _ in sweeps]
    slowest = pace[int(np.argmax([part.stop - part.start for part, _ in sweeps]))]
    groups: list[list[int]] = []
    for index in range(0, len(sweeps), 2):
        pair = [index, index + 1][: len(sweeps) - index]
        levels = [nominal_dp(test.part(sweeps[one][0])) or 0.0 for one in pair]
        apart = max(levels) - min(levels) > TWO_PRESSURES * max(levels)
        groups += [[one] for one in pair] if apart else [pair]
    ramps = []
    for number, group in enumerate(groups, start=1):
        whole = test.part(slice(sweeps[group[0]][0].start, sweeps[group[-1]][0].stop))
        branches = tuple(
            _branch(test, u, known, *sweeps[one]) for one in group if pace[one] <= FASTEST * slowest and sweeps[one][1]
        )
        branches = tuple(branch for branch in branches if branch.u.size >= SWEEP_SAMPLES)
        ramps.append(Ramp(test=whole, number=number, of=len(groups), dp=nominal_dp(whole), branches=branches))
    return ramps


def _pace(u: np.ndarray) -> float:
    """Return volts per sample between the holds of a sweep: over the middle of its range."""
    low, high = u.min() + 0.1 * np.ptp(u), u.max() - 0.1 * np.ptp(u)
    return 0.8 * float(np.ptp(u)) / max(int(np.sum((u > low) & (u < high))), 1)


def nominal_dp(test: RampTest) -> float | None:
    """Return the pressure drop at (almost) no flow, Pa; None if it is unknown.

    Read where the command is near zero; a fragment that never comes there is read at its smallest flows.
    """
    if test.dp is None:
        return None
    shut = test.dp[(test.u >= 0) & (test.u <= SHUT * max(test.u.max(), 0))]
    return float(np.median(shut if shut.size >= 5 else test.dp[test.q <= np.quantile(test.q, 0.1)]))


def lagged_command(time: np.ndarray, u: np.ndarray, lag: float) -> np.ndarray:
    """Return the command to which each reading of a meter with a lag (s) belongs.

    The clock (s) may stand still, as of a logger that stamps in whole seconds.
    """
    if lag <= 0:
        return u
    clock = _spread(time)
    return np.asarray(np.interp(clock - lag, clock, u))


def _spread(time: np.ndarray) -> np.ndarray:
    """Return the clock with stamps that repeat spread evenly over the time to the next stamp, lost rows apart."""
    stamps, first, count = np.unique(time, return_index=True, return_counts=True)
    if count.max() == 1 or stamps.size < 2:
        return time
    gaps = np.diff(stamps, append=np.nan)
    usual = float(np.nanmedian(gaps))
    gaps = np.minimum(np.where(np.isnan(gaps), usual, gaps), usual)
    rank = np.arange(time.size) - np.repeat(first, count)
    return time + rank * np.repeat(gaps / count, count)


def _without_command_spikes(test: RampTest) -> RampTest:
    """Leave out samples whose command stands alone: their flow belongs to another command."""
    away = np.abs(test.u - despiked(test.u))
    usual = float(np.median(np.abs(np.diff(test.u))))
    kept = away <= max(SPIKE * np.ptp(despiked(test.u)), SPIKE_STEPS * usual)
    return test if kept.all() else test.part(kept)


def _branch(test: RampTest, u: np.ndarray, known: np.ndarray, rows: slice, direction: int) -> Branch:
    inside = np.zeros(u.size, dtype=bool)
    inside[rows] = True
    inside &= known & (u >= 0)
    part, u = test.part(inside), u[inside]
    return Branch(rising=direction > 0, u=u, q=part.q, dp=part.dp, rate=_rate(part.time, u))


def _rate(time: np.ndarray, u: np.ndarray) -> float:
    """Return the pace of the command between the holds of a sweep, V/s; NaN if it can't be told."""
    if u.size < SWEEP_SAMPLES:
        return math.nan
    middle = (u > u.min() + 0.1 * np.ptp(u)) & (u < u.max() - 0.1 * np.ptp(u))
    seconds = float(np.ptp(time[middle])) if middle.sum() > 1 else 0.0
    return float(np.ptp(u[middle])) / seconds if seconds > 0 else math.nan


def _cut(u: np.ndarray, dp: np.ndarray | None, turn: int, direction: np.ndarray) -> int:
    """Return where two sweeps are parted: at the turning point, or at the bottom where the pressure steps.

    A step that the noise may have made, or that leaves the pressure the same, parts nothing: the sweeps would lose what
    lies between it and the turn, and with it an edge that opens there.
    """
    if direction[turn] < 0:
        return turn
    shut = u <= u[turn - 1 : turn + 1].min() + SHUT * np.ptp(u)
    before, after = np.flatnonzero(~shut[:turn]), np.flatnonzero(~shut[turn:])
    start = int(before[-1]) + 1 if before.size else 0
    stop = turn + int(after[0]) if after.size else u.size
    at_rest = _middle_of_hold(u, turn, start, stop)
    if dp is None or stop - start < 4:
        return at_rest
    # Two levels with the least squares about them; n m^2 of both sides is largest there.
    mean = dp[start:stop].mean()
    held = dp[start:stop] - mean
    left, n = np.cumsum(held)[:-1], np.arange(1, held.size)
    gain = left**2 / n + left**2 / (held.size - n)
    cut = int(np.argmax(gain))
    step = abs(left[cut]) * (1 / n[cut] + 1 / (held.size - n[cut]))
    about_levels = max(float(np.sum(held**2) - gain[cut]), 0.0) / (held.size - 2)
    real = step > PRESSURE_STEP * abs(mean) and gain[cut] > STEP_SIGNIFICANCE**2 * about_levels
    return start + 1 + cut if real else at_rest


def _middle_of_hold(u: np.ndarray, turn: int, start: int, stop: int) -> int:
    """Return the middle of the samples about a turn at the bottom that stand at its lowest command."""
    lowest = u[start:stop].min() + HOLD * np.ptp(u)
    at_bottom = start + np.flatnonzero(u[start:stop] <= lowest)
    return int(at_bottom[at_bottom.size // 2]) if at_bottom.size else turn


def despiked(u: np.ndarray) -> np.ndarray:
    """Return the running median of three: a single sample that stands out is gone, a step stays where it was."""
    if u.size < 3:
        return u
    left, middle, right = u[:-2], u[1:-1], u[2:]
    inner = np.maximum(np.minimum(left, middle), np.minimum(np.maximum(left, middle), right))
    return np.concatenate([u[:1], inner, u[-1:]])


def sweep_direction(u: np.ndarray) -> np.ndarray:
    """Return +1 or -1 for every sample: the direction of the sweep it lies in, deaf to noise and holds.

    A turning point is an extreme after which the command has gone back by `TURN` of its range.
    """
    step = max(1, u.size // TURN_SEARCH_POINTS)
    blocks = despiked(u)[: u.size // step * step].reshape(-1, step)
    thinned = despiked(np.median(blocks, axis=1))
    threshold = TURN * np.ptp(thinned)
    direction = np.zeros(u.size, dtype=int)
    low = high = start = 0
    heading = 0
    values = thinned.tolist()  # one number after the other: a list is several times faster than an array
    for index, value in enumerate(values):
        low = index if value < values[low] else low
        high = index if value > values[high] else high
        if heading >= 0 and values[high] - value > threshold:
            direction[start * step : high * step] = 1
            heading, start, low = -1, high, index
        elif heading <= 0 and value - values[low] > threshold:
            direction[start * step : low * step] = -1
            heading, start, high = 1, low, index
    direction[start * step :] = heading
    return direction
