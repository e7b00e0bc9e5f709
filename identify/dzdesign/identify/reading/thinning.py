"""Thinning of long recordings while they are read: runs of rows become one row each, so memory has a bound.

A ramp test needs some ten thousand samples a branch; what a logger writes beyond that only averages noise, and that can
be done on the way. As long as a recording has no more than `MOST_ROWS` rows, nothing is touched. From then on every k
rows in a row are averaged, k a power of two that doubles whenever the rows kept exceed the limit again. What must not
be averaged is left out of its run, and all columns are averaged over the same rows, so that a reading still belongs to
its command, its time and its pressure drop:

- a spike of flow or pressure: further from the median of its `WINDOW` rows than the rest of them spread;
- in a window that a meter's floor parts into zeros and readings, whichever are fewer: their mean would be a flow that
  the meter never reads;
- a command more than a quarter of a bin from the median of its run: a step, a turning point or a fast sweep is not
  smeared over several bins, whatever k is. Rejected: not to thin such stretches, which leaves memory without a bound,
  and makes the pace of a sweep, by which a saw-tooth's jump back is told, depend on how far it was thinned.
"""

from typing import final

import numpy as np

from dzdesign.identify.ramps.branches import BIN_WIDTH

#: Rows that one recording may have in memory: more are thinned.
MOST_ROWS = 400_000
#: Rows in which spikes are looked for; its quarters say what is common in it.
WINDOW = 16
QUARTER, HALF = WINDOW // 4, WINDOW // 2
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
class Thinner:
    """Takes the rows of a recording block by block, and keeps `MOST_ROWS` at most.

    Parameters
    ----------
    u_max : float
        Full command, V.

    Attributes
    ----------
    read, kept, run : int
        Rows that were taken and that are kept, and rows that were averaged to one (1: none were).
    """

    def __init__(self, u_max: float) -> None:
        self.read = self.kept = 0
        self.run = 1
        self._reach = BIN_WIDTH * u_max / 4
        self._blocks: list[np.ndarray] = []
        self._steps: dict[int, float] = {}

    def add(self, rows: np.ndarray) -> None:
        """Take the next rows.

        Parameters
        ----------
        rows : (3 or 4, N) array
            Time, command, flow and, if there is one, pressure drop; nothing missing, the clock never back.
        """
        self.read += rows.shape[1]
        by = 1
        while by < self.run:
            rows = self._averaged(rows, min(WINDOW, self.run // by), raw=by == 1)
            by *= WINDOW
        self._blocks.append(rows)
        self.kept += rows.shape[1]
        while self.kept > MOST_ROWS:
            halved = self._averaged(self.rows(), 2, raw=self.run == 1)
            self._blocks, self.kept, self.run = [halved], halved.shape[1], 2 * self.run

    def rows(self) -> np.ndarray:
        """Return what is kept, as `add` takes it."""
        return np.concatenate(self._blocks, axis=1) if len(self._blocks) != 1 else self._blocks[0]

    def _averaged(self, rows: np.ndarray, by: int, raw: bool) -> np.ndarray:
        """Return the means of `by` rows each; a run of which nothing may count is left out."""
        size = rows.shape[1]
        rows = np.pad(rows, ((0, 0), (0, -size % WINDOW)), mode="edge")
        counts = np.arange(rows.shape[1]) < size
        for column in range(Q, rows.shape[0]):
            windows = rows[column].reshape(-1, WINDOW)
            ordered = np.sort(windows, axis=1)
            if raw:  # the means of a coarse converter's codes are no codes
                self._steps[column] = min(self._steps.get(column, np.inf), _smallest_step(ordered))
            counts &= _typical(windows, ordered, self._steps[column]).ravel()
        counts = counts.reshape(-1, by) & _near_their_median(rows[U].reshape(-1, by), self._reach)
        number = counts.sum(axis=1)
        some = number > 0
        runs = rows.reshape(rows.shape[0], -1, by)
        means = np.einsum("crk,rk->cr", runs, counts.astype(float))[:, some] / number[some]
        if size > 1 and np.mean(np.diff(rows[TIME, :size]) == 0) > REPEATS:
            # A stamp between two of a coarse clock would pass for one that lasts. All runs are early alike.
            means[TIME] = runs[TIME, some, 0]
        return means


def _near_their_median(u: np.ndarray, reach: float) -> np.ndarray:
    """Tell which commands count in their runs (R, k): those near the median, and the nearest in any case."""
    away = np.abs(u - np.median(u, axis=1, keepdims=True))
    near = away <= reach
    lost = np.flatnonzero(~near.any(axis=1))
    near[lost, np.argmin(away[lost], axis=1)] = True
    return near


def _smallest_step(ordered: np.ndarray) -> float:
    """Return the smallest step between readings that are common in their windows: a spike is not, a code is."""
    gaps = np.diff(ordered[:, QUARTER - 1 : -QUARTER + 1], axis=1)
    return float(np.min(gaps, where=gaps > 0, initial=np.inf))


def _typical(windows: np.ndarray, ordered: np.ndarray, step: float) -> np.ndarray:
    """Tell which readings belong to the majority of their windows.

    Parameters
    ----------
    windows, ordered : (R, WINDOW) array
        In the order of time, and sorted.
    step : float
        Between two codes of the converter; infinite if none was seen.
    """
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
    return away & above & under
