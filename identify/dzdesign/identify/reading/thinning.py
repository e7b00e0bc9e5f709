"""Thinning of long recordings: runs of rows become one row each, so what follows takes no longer for them.

A ramp test needs some ten thousand samples a branch; what a logger writes beyond that only averages noise. As long as a
recording has no more than `MOST_ROWS` rows, nothing is touched. Of a longer one every k rows in a row are averaged, k
the smallest power of two that keeps to the limit. What must not be averaged is left out of its run, and all columns are
averaged over the same rows, so that a reading still belongs to its command, its time and its pressure drop:

- a spike of flow or pressure: further from the median of its `WINDOW` rows than the rest of them spread;
- in a window that a meter's floor parts into zeros and readings, whichever are fewer: their mean would be a flow that
  the meter never reads;
- a command more than a quarter of a bin from the median of its run: a step, a turning point or a fast sweep is not
  smeared over several bins, whatever k is. Rejected: not to thin such stretches, which makes the pace of a sweep, by
  which a saw-tooth's jump back is told, depend on how far it was thinned.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from dzdesign.identify.constants import BIN_WIDTH

#: Rows of one recording that are kept: more are thinned.
MOST_ROWS = 400_000
#: Rows in which spikes are looked for; its quarters say what is common in it.
WINDOW = 16
QUARTER, HALF = WINDOW // 4, WINDOW // 2
#: Rows that are averaged at a time, whole windows of them: what that takes of memory has a bound.
PART = 1 << 20
#: A reading is a spike beyond this many times the range of the closest half of its window (which is about one
#: standard deviation of white noise), and this many steps of the converter: what two of its codes tell is no spike.
GATE, STEPS = 6.0, 3.0
#: A window has two levels if the widest gap inside exceeds either level's width this many times. White noise looks so
#: in 3 % of the windows; that does no harm, as it looks so on either side alike.
PARTED = 1.0
#: Share of rows that repeat the stamp before them, from which a clock is a coarse one.
REPEATS = 0.1
#: Columns of a block of rows; the pressure drop need not be there.
TIME, U, Q = range(3)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Thinned:
    """What is left of a recording.

    Attributes
    ----------
    rows : (3 or 4, M) array
        Time, command, flow and, if there is one, pressure drop.
    run : int
        Rows in a row that were averaged to one (1: none were).
    """

    rows: np.ndarray
    run: int


def thin(rows: np.ndarray, u_max: float) -> Thinned:
    """Average a recording of more than `MOST_ROWS` rows to that many at most.

    Parameters
    ----------
    rows : (3 or 4, N) array
        Time, command, flow and, if there is one, pressure drop; nothing missing, the clock never back.
    u_max : float
        Full command, V.
    """
    run, left = 1, 1
    while -(-rows.shape[1] // run) > MOST_ROWS:
        run *= 2
    steps: list[float] | None = None
    while left < run:
        by = min(WINDOW, run // left)
        parts = [rows[:, start : start + PART] for start in range(0, rows.shape[1], PART)]
        if steps is None:  # of what was recorded: the means of a coarse converter's codes are no codes
            steps = [min(_smallest_step(_in_windows(part[column])) for part in parts) for column in range(Q, len(rows))]
        coarse_clock = bool(np.mean(np.diff(rows[TIME]) == 0) > REPEATS)
        rows = np.concatenate([_averaged(part, by, steps, coarse_clock, u_max) for part in parts], axis=1)
        left *= by
    return Thinned(rows=rows, run=run)


def _in_windows(column: np.ndarray, by: int = WINDOW) -> np.ndarray:
    """Return a column as rows of so many values each, its last value repeated to fill the last window."""
    return np.pad(column, (0, -column.size % WINDOW), mode="edge").reshape(-1, by)


def _averaged(rows: np.ndarray, by: int, steps: Sequence[float], coarse_clock: bool, u_max: float) -> np.ndarray:
    """Return the means of `by` rows each; a run of which nothing may count is left out."""
    counts = _in_windows(np.ones(rows.shape[1], dtype=bool))
    counts.ravel()[rows.shape[1] :] = False
    for column, step in zip(rows[Q:], steps, strict=True):
        windows = _in_windows(column)
        counts &= _typical(windows, step)
    counts = counts.reshape(-1, by) & _near_their_median(_in_windows(rows[U], by), BIN_WIDTH * u_max / 4)
    number = counts.sum(axis=1)
    some = number > 0
    runs = np.stack([_in_windows(column, by) for column in rows])
    means: np.ndarray = np.einsum("crk,rk->cr", runs, counts.astype(float))[:, some] / number[some]
    if coarse_clock:
        # A stamp between two of a coarse clock would pass for one that lasts. All runs are early alike.
        means[TIME] = runs[TIME, some, 0]
    return means


def _near_their_median(u: np.ndarray, reach: float) -> np.ndarray:
    """Tell which commands count in their runs (R, k): those near the median, and the nearest in any case."""
    away = np.abs(u - np.median(u, axis=1, keepdims=True))
    near: np.ndarray = away <= reach
    lost = np.flatnonzero(~near.any(axis=1))
    near[lost, np.argmin(away[lost], axis=1)] = True
    return near


def _smallest_step(windows: np.ndarray) -> float:
    """Return the smallest step between readings that are common in their windows: a spike is not, a code is."""
    gaps = np.diff(np.sort(windows, axis=1)[:, QUARTER - 1 : -QUARTER + 1], axis=1)
    return float(np.min(gaps, where=gaps > 0, initial=np.inf))


def _typical(windows: np.ndarray, step: float) -> np.ndarray:
    """Tell which readings belong to the majority of their windows.

    Parameters
    ----------
    windows : (R, WINDOW) array
        In the order of time.
    step : float
        Between two codes of the converter; infinite if none was seen.
    """
    ordered = np.sort(windows, axis=1)
    step = step if np.isfinite(step) else 0.0
    rows = np.arange(ordered.shape[0])
    gaps = np.diff(ordered[:, QUARTER - 1 : -QUARTER + 1], axis=1)
    below = np.argmax(gaps, axis=1) + QUARTER - 1  # the last of the lower level
    low, high = ordered[rows, below], ordered[rows, below + 1]
    # A few spikes at either end belong to no level.
    lower_width, upper_width = low - ordered[:, QUARTER - 2], ordered[:, 1 - QUARTER] - high
    parted = high - low > np.maximum(PARTED * np.maximum(lower_width, upper_width), STEPS * step)
    # Half against half the narrower level is taken: always the upper would be a bias.
    upper = (below < HALF - 1) | ((below == HALF - 1) & (upper_width < lower_width))
    inner, outer = ordered[:, HALF - 1], ordered[:, HALF]
    centre = np.where(parted, np.where(upper, outer, inner), (inner + outer) / 2)
    spread = np.min(ordered[:, HALF:] - ordered[:, :HALF], axis=1)
    away = np.abs(windows - centre[:, None]) <= np.maximum(GATE * spread, STEPS * step)[:, None]
    above = windows >= np.where(parted & upper, high, -np.inf)[:, None]
    under = windows <= np.where(parted & ~upper, low, np.inf)[:, None]
    typical: np.ndarray = away & above & under
    return typical
