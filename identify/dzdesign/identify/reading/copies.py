"""A recording that is a copy of another or of a part of it: saved again, rounded, in other units, decimated or cut.

Rows are compared, not times: where flow passes, a copy's rows of command, flow and pressure drop are in the other
recording too, within the rounding of the coarser one. In a true repeat the valve opens elsewhere. If it did so by
`LEAST_SHIFT` of full command only, the flow gain and the step of the flow tell how many rows would differ; where these
are too few, as in a table of ten coarse readings, nothing is said. A copy whose samples are others, such as means of
ten, is not found here: see `knees.scatter_checks`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.reading.ramp_test import RampTest

#: Flow passes above this share of the largest one. A copy has so many rows there, over this share of the commands.
LARGE_FLOW, FEWEST, SAME_RANGE = 0.05, 20, 0.25
#: Rows that are looked for first, and how many of them may be missed.
FIRST_LOOK, MOST_MISSED = 16, 3
#: Share of the rows that a copy may have changed, such as a spike that was taken out.
SPOILT = 1e-3
#: Shift of the thresholds, over the largest command, that two repeats of a valve show at least; rows that then differ.
LEAST_SHIFT, LEAST_DIFFERING = 1e-4, 8
#: Differences below this share of a step, or of the largest number, are none; two level channels differ by more.
SAME_STEP, ROUNDING, LEVEL = 1e-3, 1e-7, 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Copy:
    """Two recordings, by number, the later one a copy of the earlier one or of a part of it, or the reverse."""

    one: int
    other: int
    #: Rows that were compared, and those of them that agree.
    compared: int
    agree: int


@dataclass(frozen=True, slots=True)
class _Rows:
    """Rows of command, flow and, if it was recorded, pressure drop (N, 2 or 3), and the step of each column."""

    all: np.ndarray
    steps: list[float]

    @property
    def flowing(self) -> np.ndarray:
        """The rows with a large flow."""
        size = np.abs(self.all[:, 1])
        found: np.ndarray = self.all[size > LARGE_FLOW * float(size.max(initial=0.0))]
        return found


def find_copy(tests: Sequence[RampTest]) -> Copy | None:
    """Return the first recording that is a copy of an earlier one, or of a part of it; None where none is."""
    every = [_rows(test) for test in tests]
    for other, late in enumerate(every):
        for one, early in enumerate(every[:other]):
            part, whole = sorted((early, late), key=lambda rows: len(rows.all))
            rows = part.flowing
            if len(part.steps) == len(whole.steps) and len(rows) >= FEWEST and (agree := _agree(rows, part, whole)):
                return Copy(one=one, other=other, compared=len(rows), agree=agree)
    return None


def _rows(test: RampTest) -> _Rows:
    channels = [test.u, test.q, *([] if test.dp is None or test.dp_is_declared else [test.dp])]
    return _Rows(np.stack(channels, axis=1), [_step(channel) for channel in channels])


def _agree(rows: np.ndarray, part: _Rows, whole: _Rows) -> int:
    """Return how many rows with flow of a part are in the whole; zero where it is no part of it."""
    from scipy.spatial import cKDTree

    steps = [max(pair) for pair in zip(part.steps, whole.steps, strict=True)]
    # What was rounded lies within half a step; a pressure drop is the difference of two such columns. Of two level
    # ones it is not known how they were rounded.
    within = [
        (0.5 + SAME_STEP) * step * (2 if number == 2 else 1) or LEVEL * float(np.abs(rows[:, number]).max())
        for number, step in enumerate(steps)
    ]
    missed = 0
    for row in rows[np.linspace(0, len(rows) - 1, FIRST_LOOK).astype(int)]:
        near = whole.all[np.abs(whole.all[:, 0] - row[0]) <= within[0]]
        missed += not np.any(np.all(np.abs(near - row) <= within, axis=1))
        if missed > MOST_MISSED:
            return 0
    apart, _ = cKDTree(whole.all / within).query(rows / within, p=np.inf, distance_upper_bound=1.0)
    agree = int(np.count_nonzero(np.isfinite(apart)))
    u, q = np.abs(rows[:, 0]), np.abs(rows[:, 1])
    # So many rows would differ, each by itself, if the thresholds were shifted by the least that repeats show.
    by_shift = float(np.ptp(q) / np.ptp(u)) * LEAST_SHIFT * float(u.max()) if np.ptp(u) else 0.0
    differing = len(rows) * min(by_shift / steps[1], 1.0) if steps[1] else 0.0
    is_copy = agree >= (1 - SPOILT) * len(rows) - 1 and np.ptp(u) > SAME_RANGE * u.max() and differing > LEAST_DIFFERING
    return agree if is_copy else 0


def _step(channel: np.ndarray) -> float:
    """Return the largest step of which all differences of a channel's numbers are multiples (Euclid); 0 if it is level.

    Numbers without a step have one that is rounding.
    """
    least = ROUNDING * float(np.abs(channel).max(initial=0.0))
    gaps = np.diff(np.unique(channel))
    gaps = gaps[gaps > least]
    step = 0.0
    while gaps.size:
        step = float(gaps.min())
        rest = np.abs(gaps - step * np.round(gaps / step))
        gaps = rest[rest > max(SAME_STEP * step, least)]
    return step
