"""Staircases: levels of the command that are held, one step after the other.

Only the settled part of a dwell tells which flow belongs to its level; what comes before is the valve's and the meter's
way there. How long that takes is read from the mean step response of all dwells. Where a dwell ends before the flow has
settled, the rest of the way is what an exponential leaves, and the command that the flow has come to stands for the
level. A ramp that was recorded in coarse steps is no staircase: its flow goes on through each of them.

A level belongs to the branch from whose side it was reached, whatever the order of the levels. Steps up from one level,
such as zero, are all of opening, and steps down from one level, such as full command, all of closing; the level between
them shows neither. Levels in no order, reached from both sides, are refused: how far the spool came back is not known.
"""

import logging
from dataclasses import dataclass
from typing import final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import BIN_WIDTH
from dzdesign.identify.reading.ramp_test import despiked

#: A step of the command stands out of its noise by so many standard deviations, and of its range by this share.
STEP_SIGMAS, SMALLEST_STEP = 6.0, 2.5e-3
#: Fewest samples of a dwell and dwells of a staircase, and share of the samples that lie in dwells.
DWELL_SAMPLES, FEWEST_DWELLS, IN_DWELLS = 8, 8, 0.8
#: Between levels that are reached from one side the command may be slewed: this share is enough, of so many levels.
IN_SLEWED_DWELLS, SLEWED_LEVELS = 0.4, 6
#: Levels follow each other up and down if no more of their steps than the first share turn, and no more than the second
#: lead over a command beyond both levels.
TURNING, LED_BEYOND = 1 / 3, 0.25
#: A command that comes to a level from less than this share of how far it was away, on the other side, overshot.
OVERSHOOT = 0.5
#: Share of the dwells between steps that stand at the one level from which these are made.
AT_BASE = 0.9
#: A level at which the valve is open passes this share of the largest flow.
FLOWING = 0.05
#: Within a dwell the command moves by less than this share of a step.
LEVEL = 0.1
#: A reading that stands out of its neighbours by this share of the flow's range is a spike.
SPIKE = 0.1
#: The flow has settled once it is within this share of its step, and so many standard errors, of the dwell's end.
SETTLED, SETTLED_SIGMAS = 0.01, 4.0
#: Time constants that are tried, over the dwell: where the longest fits best, or more than this share of the step is
#: left, the flow does not settle. It is followed from where it has gone this share of its way.
TIME_CONSTANTS, LARGEST_REST, RISEN = np.geomspace(0.02, 0.7, 40), 0.3, 0.3
logger = logging.getLogger(__name__)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Staircase:
    """What counts of a staircase: which samples (N,) bool, command (V, else NaN) and flow of each (N,)."""

    settled: np.ndarray
    u: np.ndarray
    q: np.ndarray
    #: Side from which each of these levels was reached: 1 from below, -1 from above, 0 as the levels follow each other.
    reached: int
    #: Whether the levels of one side follow each other in no order.
    shuffled: bool


def find_staircase(
    u: np.ndarray, q: np.ndarray, source: str = "", from_other_side: np.ndarray | None = None
) -> Staircase | None:
    """Return the settled samples of a staircase, None if the command is none.

    Parameters
    ----------
    u, q : (N,) array
        Command in V and flow, in the order of time.
    source : str, optional
        For messages and the log.
    from_other_side : array of int, optional
        Samples before which the command was on the other side of zero, whose samples are left out.

    Raises
    ------
    InputError
        Where the levels were reached from both sides in no order, or the flow of steps from one level does not settle.
    """
    dwells = _dwells(u)
    if dwells is None:
        return None
    starts, ends, share = dwells
    levels = np.array([np.median(u[start:end]) for start, end in zip(starts, ends, strict=True)])
    steps = np.diff(levels, prepend=levels[0])
    reached, beyond = _reached(u, starts, ends, levels, from_other_side)
    in_order = _turning(levels, _smallest_step(u)) <= TURNING and beyond <= LED_BEYOND
    if share < IN_DWELLS and in_order:
        return None
    everything = np.ones(levels.size, dtype=bool)
    side, taken = (0, everything) if in_order else _one_side(levels, reached, _smallest_step(u), source)
    smooth = despiked(q)
    spikes = np.abs(q - smooth) > SPIKE * float(np.ptp(smooth))
    smooth = np.where(spikes, smooth, q)
    last = np.array([np.mean(smooth[end - (end - start) // 4 : end]) for start, end in zip(starts, ends, strict=True)])
    base = ~taken  # the level from which each step of one side starts
    base[0] &= base.sum() == 1
    start = float(np.median(last[base])) if base.any() else 0.0 if side > 0 else float(last.max())
    before = np.full(last.size, start)
    response = (
        _response_from_one_level(smooth, starts, ends, last, before, taken, source)
        if side
        else _mean_response(smooth, starts, ends, last, levels, steps)
    )
    if response is None:
        return None
    first, rest = response
    # One level of the command whenever it comes again, whatever the noise.
    grid = BIN_WIDTH / 10 * float(np.ptp(levels))
    levels = np.round((levels if side else levels - rest * steps) / grid) * grid
    length = np.median(ends - starts)
    logger.info("'%s': a staircase, whose flow settles in %d of the %d samples of a dwell", source, first, length)
    settled, command, flow = np.zeros(u.size, dtype=bool), np.full(u.size, np.nan), q.copy()
    for index in np.flatnonzero(taken).tolist():
        start, end = starts[index], ends[index]
        begin = start + min(first, 3 * (end - start) // 4) if start else start
        settled[begin:end], command[begin:end] = True, levels[index]
        if side:  # steps across the dead zone: it is the flow that has a part of its way to go, not the command
            flow[begin:end] += rest * (flow[begin:end] - before[index])
    shuffled = bool(side) and _turning(levels[taken], grid) > TURNING
    return Staircase(settled=settled, u=command, q=flow, reached=side, shuffled=shuffled)


def _smallest_step(u: np.ndarray) -> float:
    """Return the least change of the command from sample to sample that is a step, V."""
    moves = np.abs(np.diff(u))
    noise = 1.4826 * float(np.median(moves)) if moves.size else 0.0
    return max(STEP_SIGMAS * noise, SMALLEST_STEP * float(np.ptp(u)))


def _reached(
    u: np.ndarray, starts: np.ndarray, ends: np.ndarray, levels: np.ndarray, from_other_side: np.ndarray | None
) -> tuple[np.ndarray, float]:
    """Return from which side each dwell was reached: 1 from below, -1 from above, 0 if unknown (D,).

    The command's last samples off the level tell, be they of the dwell before or of a visit too short for one; if they
    are much nearer than others were, the command overshot, and the spool may have followed or not. Beside them the
    share of the dwells that were reached over a command well beyond the two levels.
    """
    least = _smallest_step(u)
    crossed = np.array([], dtype=int) if from_other_side is None else from_other_side
    reached, beyond = np.zeros(levels.size, dtype=int), np.zeros(levels.size, dtype=bool)
    for index in range(1, levels.size):
        way = u[ends[index - 1] - 1 : starts[index]]
        off = way - levels[index]
        off = off[np.abs(off) > least]
        others = np.flatnonzero(off * off[-1:] < 0)  # on the other side of the level than the last ones
        last = off[int(others[-1]) + 1 if others.size else 0 :]
        if off.size and np.max(np.abs(last)) >= OVERSHOOT * np.max(np.abs(off)):
            reached[index] = -int(np.sign(off[-1]))
        low, high = sorted(levels[index - 1 : index + 1].tolist())
        well = max(least, (high - low) / 2)
        beyond[index] = np.min(way, initial=low) < low - well or np.max(way, initial=high) > high + well
        if np.any((crossed >= ends[index - 1]) & (crossed <= starts[index])):
            reached[index], beyond[index] = 1, True
    return reached, float(beyond.mean())


def _turning(levels: np.ndarray, least: float) -> float:
    """Return the share of the steps from level to level that turn back."""
    steps = np.diff(levels)
    ways = np.sign(steps[np.abs(steps) > least])
    return float(np.mean(ways[1:] != ways[:-1])) if ways.size > 1 else 0.0


def _one_side(levels: np.ndarray, reached: np.ndarray, least: float, source: str) -> tuple[int, np.ndarray]:
    """Return from which side the levels that count were reached, and which they are (D,).

    From one level, such as zero, all others are reached from one side; that level itself shows neither branch.
    """
    for side in (1, -1) if np.mean(reached == 0) <= 1 - AT_BASE else ():
        between = levels[reached == -side]
        base = float(np.median(between)) if between.size else np.nan
        at_base = np.abs(between - base) <= least
        # Few of them: the levels themselves were reached from this side, with visits too short for a dwell between.
        if np.mean(at_base) >= AT_BASE if between.size > (1 - AT_BASE) * levels.size else True:
            away = np.isnan(base) | (side * (levels - base) > least)
            return side, (reached == side) & away
    raise InputError(
        f"'{source}': the levels of the command follow in no order, each reached from either side by chance, so they "
        "show neither threshold. Step up and down in order, or each time from zero"
    )


def _response_from_one_level(
    q: np.ndarray,
    starts: np.ndarray,
    ends: np.ndarray,
    last: np.ndarray,
    before: np.ndarray,
    taken: np.ndarray,
    source: str,
) -> tuple[int, float]:
    """Return what `_mean_response` does, of steps that all start from one level; an InputError if they don't settle."""
    length = int(np.median((ends - starts)[taken])) if taken.any() else DWELL_SAMPLES
    change = last - before
    far = taken & (np.abs(change) > FLOWING * np.abs(last).max()) & (ends - starts >= length)
    whole = np.flatnonzero(far)
    if whole.size < FEWEST_DWELLS // 2:  # what is seen of the valve will tell whether that is enough
        return 3 * length // 4, 0.0
    response = _settling(q, starts, last, before, whole, np.sign(change[whole]), length)
    if response is None:
        raise InputError(
            f"'{source}': the flow does not settle within the levels of the command, of {length} samples each. Hold "
            "each level until the flow stands still, or record a slow ramp"
        )
    return response


def _dwells(u: np.ndarray) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Return where the dwells of a staircase begin and end, and the share of the samples that lie in them.

    None if the command is none.
    """
    moves = np.abs(np.diff(u))
    span = float(np.ptp(u))
    noise = 1.4826 * float(np.median(moves)) if moves.size else 0.0
    still = np.concatenate([[False], moves <= _smallest_step(u), [False]])
    edges = np.flatnonzero(np.diff(still.astype(np.int8)))
    starts, ends = edges[::2], edges[1::2] + 1
    long = ends - starts >= DWELL_SAMPLES
    starts, ends = starts[long], ends[long]
    if starts.size < FEWEST_DWELLS:
        return None
    middles = (starts + ends) // 2
    halves = [(np.median(u[a:b]), np.median(u[b:c])) for a, b, c in zip(starts, middles, ends, strict=True)]
    before, after = np.array(halves).T
    step = float(np.median(np.abs(np.diff((before + after) / 2))))
    # A ramp with a hole or two, or with holds, has stretches that are no level.
    flat = np.abs(after - before) <= LEVEL * step + STEP_SIGMAS * noise / np.sqrt(ends - starts)
    share = float(np.sum((ends - starts)[flat])) / u.size
    if step < SMALLEST_STEP * span or not step > 0:
        return None
    many = np.unique(np.round((before + after)[flat] / 2 / (LEVEL * step))).size >= SLEWED_LEVELS
    return (starts[flat], ends[flat], share) if share >= (IN_SLEWED_DWELLS if many else IN_DWELLS) else None


def _mean_response(
    q: np.ndarray, starts: np.ndarray, ends: np.ndarray, last: np.ndarray, levels: np.ndarray, steps: np.ndarray
) -> tuple[int, float] | None:
    """Return after how many samples the flow has settled, and the share of its step that is left at a dwell's end.

    None where no flow follows the steps, or where it goes on through the dwells.
    """
    length = int(np.median(ends - starts))
    size = np.abs(last)
    flowing = (np.minimum(size[1:], size[:-1]) > FLOWING * size.max()) & ((ends - starts)[1:] >= length)
    whole = np.flatnonzero(flowing) + 1
    # The direction of the flow's step is that of the command's: of the readings, their noise would pass for a step.
    sign = np.sign(steps[whole]) * np.where(levels[whole] > 0, *_directions(last, levels, steps, whole))
    return _settling(q, starts, last, np.roll(last, 1), whole, sign, length)


def _settling(
    q: np.ndarray,
    starts: np.ndarray,
    last: np.ndarray,
    before: np.ndarray,
    whole: np.ndarray,
    sign: np.ndarray,
    length: int,
) -> tuple[int, float] | None:
    """Return the same by the dwells `whole`, whose flow goes from `before` to `last` (D,), up or down by their sign."""
    total = float(sign @ (last - before)[whole])
    if whole.size < FEWEST_DWELLS // 2 or total <= 0:
        return None
    rows = q[starts[whole][:, None] + np.arange(length)]
    response = (sign @ (rows - before[whole][:, None])) / total
    residual = rows - last[whole][:, None]
    error = _scatter(residual[:, 3 * length // 4 :].ravel()) * np.sqrt(whole.size) / total
    away = np.flatnonzero(np.abs(response - 1) > max(SETTLED, SETTLED_SIGMAS * error))
    first = int(away[-1]) + 1 if away.size else 0
    if first <= length // 2:
        return first, 0.0
    rest = _rest_of_the_way(response)
    return None if rest is None else (3 * length // 4, rest)


def _directions(last: np.ndarray, levels: np.ndarray, steps: np.ndarray, whole: np.ndarray) -> tuple[float, float]:
    """Return whether the flow rises (1) or falls (-1) with the command, where that is positive and where negative."""
    rises = steps[whole] * (last[whole] - last[whole - 1])
    positive, negative = (float(np.sign(rises[side].sum())) for side in (levels[whole] > 0, levels[whole] <= 0))
    return positive, negative


def _rest_of_the_way(response: np.ndarray) -> float | None:
    """Return the share of its step that the flow still has to go at a dwell's end, None where it does not settle.

    Its end is 1 here, the mean of the last quarter. The best exponential through what follows the first rise tells.
    """
    tail = response[int(np.argmax(response >= RISEN)) :]
    if tail.size < DWELL_SAMPLES // 2:
        return None
    time = np.arange(tail.size) / response.size
    fits = []
    for constant in TIME_CONSTANTS.tolist():
        decay = np.exp(-time / constant)
        away = decay - decay.mean()
        height = float(away @ tail) / float(away @ away)
        final = float(tail.mean()) - height * float(decay.mean())
        fits.append((float(np.sum((tail - final - height * decay) ** 2)), constant, final))
    _, constant, final = min(fits)
    settles = constant < TIME_CONSTANTS[-1] and final - 1 < LARGEST_REST
    return max(final - 1, 0.0) if settles else None


def _scatter(values: np.ndarray) -> float:
    """Return the standard deviation of the middle half."""
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))
