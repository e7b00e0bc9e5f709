"""Staircases: levels of the command that are held, one step after the other.

Only the settled part of a dwell tells which flow belongs to its level; what comes before is the valve's and the meter's
way there. How long that takes is read from the mean step response of all dwells. Where a dwell ends before the flow has
settled, the rest of the way is what an exponential leaves, and the command that the flow has come to stands for the
level. A ramp that was recorded in coarse steps is no staircase: its flow goes on through each of them.
"""

import logging
from dataclasses import dataclass
from typing import final

import numpy as np

from dzdesign.identify.constants import BIN_WIDTH
from dzdesign.identify.ramps.command import despiked

#: A step of the command stands out of its noise by so many standard deviations, and of its range by this share.
STEP_SIGMAS, SMALLEST_STEP = 6.0, 2.5e-3
#: Fewest samples of a dwell and dwells of a staircase, and share of the samples that lie in dwells.
DWELL_SAMPLES, FEWEST_DWELLS, IN_DWELLS = 8, 8, 0.8
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
    """What counts of a staircase: which samples (N,) bool, and the command of each, V (N,); of the others NaN."""

    settled: np.ndarray
    u: np.ndarray


def find_staircase(u: np.ndarray, q: np.ndarray, source: str = "") -> Staircase | None:
    """Return the settled samples of a staircase, None if the command is none.

    Command u in V and flow q, both (N,), in the order of time; `source` is for the log.
    """
    dwells = _dwells(u)
    if dwells is None:
        return None
    starts, ends = dwells
    levels = np.array([np.median(u[start:end]) for start, end in zip(starts, ends, strict=True)])
    steps = np.diff(levels, prepend=levels[0])
    smooth = despiked(q)
    spikes = np.abs(q - smooth) > SPIKE * float(np.ptp(smooth))
    response = _mean_response(np.where(spikes, smooth, q), starts, ends, levels, steps)
    if response is None:
        return None
    first, rest = response
    # One level of the command whenever it comes again, whatever the noise.
    grid = BIN_WIDTH / 10 * float(np.ptp(levels))
    levels = np.round((levels - rest * steps) / grid) * grid
    length = np.median(ends - starts)
    logger.info("'%s': a staircase, whose flow settles in %d of the %d samples of a dwell", source, first, length)
    settled, command = np.zeros(u.size, dtype=bool), np.full(u.size, np.nan)
    for start, end, level in zip(starts, ends, levels.tolist(), strict=True):
        begin = start + min(first, 3 * (end - start) // 4) if start else start
        settled[begin:end], command[begin:end] = True, level
    return Staircase(settled=settled, u=command)


def _dwells(u: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return where the dwells of a staircase begin and end, None if the command is none."""
    moves = np.abs(np.diff(u))
    span = float(np.ptp(u))
    noise = 1.4826 * float(np.median(moves)) if moves.size else 0.0
    still = np.concatenate([[False], moves <= max(STEP_SIGMAS * noise, SMALLEST_STEP * span), [False]])
    edges = np.flatnonzero(np.diff(still.astype(np.int8)))
    starts, ends = edges[::2], edges[1::2] + 1
    long = ends - starts >= DWELL_SAMPLES
    starts, ends = starts[long], ends[long]
    if starts.size < FEWEST_DWELLS or np.sum(ends - starts) < IN_DWELLS * u.size:
        return None
    middles = (starts + ends) // 2
    halves = [(np.median(u[a:b]), np.median(u[b:c])) for a, b, c in zip(starts, middles, ends, strict=True)]
    before, after = np.array(halves).T
    step = float(np.median(np.abs(np.diff((before + after) / 2))))
    # A ramp with a hole or two, or with holds, has stretches that are no level.
    flat = np.abs(after - before) <= LEVEL * step + STEP_SIGMAS * noise / np.sqrt(ends - starts)
    if step < SMALLEST_STEP * span or not np.sum((ends - starts)[flat]) >= IN_DWELLS * u.size:
        return None
    return starts[flat], ends[flat]


def _mean_response(
    q: np.ndarray, starts: np.ndarray, ends: np.ndarray, levels: np.ndarray, steps: np.ndarray
) -> tuple[int, float] | None:
    """Return after how many samples the flow has settled, and the share of its step that is left at a dwell's end.

    None where no flow follows the steps, or where it goes on through the dwells.
    """
    length = int(np.median(ends - starts))
    last = np.array([np.mean(q[end - (end - start) // 4 : end]) for start, end in zip(starts, ends, strict=True)])
    size = np.abs(last)
    flowing = (np.minimum(size[1:], size[:-1]) > FLOWING * size.max()) & ((ends - starts)[1:] >= length)
    whole = np.flatnonzero(flowing) + 1
    # The direction of the flow's step is that of the command's: of the readings, their noise would pass for a step.
    sign = np.sign(steps[whole]) * np.where(levels[whole] > 0, *_directions(last, levels, steps, whole))
    before = last[whole - 1]
    total = float(sign @ (last[whole] - before))
    if whole.size < FEWEST_DWELLS // 2 or total <= 0:
        return None
    rows = q[starts[whole][:, None] + np.arange(length)]
    response = (sign @ (rows - before[:, None])) / total
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
