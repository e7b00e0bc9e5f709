"""A recording that is a copy of another or of a part of it: saved again, rounded, in other units, decimated or cut.

Rows are compared, not times: where flow passes, a copy's commands and flows are in the other recording too, rounded to
the coarser steps of both, at the same pressure drop. In a true repeat the valve opens elsewhere. If it did so by
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
#: Share of the rows that a copy may have changed, such as a spike that was taken out.
SPOILT = 1e-3
#: Shift of the thresholds, over the largest command, that two repeats of a valve show at least; rows that then differ.
LEAST_SHIFT, LEAST_DIFFERING = 1e-4, 8
#: Differences below this share of a step, or of the largest number, are none; two pressure drops differ by more.
SAME_STEP, ROUNDING, LEVEL = 1e-3, 1e-7, 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class Copy:
    """Two recordings, by number, the later one a copy of the earlier one or of a part of it, or the reverse."""

    one: int
    other: int
    #: Rows that were compared, and those of them that agree.
    compared: int
    agree: int


def find_copy(tests: Sequence[RampTest]) -> Copy | None:
    """Return the first recording that is a copy of an earlier one, or of a part of it; None where none is."""
    steps = [np.array([_step(test.u), _step(test.q)]) for test in tests]
    for other, late in enumerate(tests):
        for one, early in enumerate(tests[:other]):
            part, whole = sorted((early, late), key=lambda test: test.u.size)
            size = np.abs(part.q)
            rows = np.stack([part.u, part.q])[:, size > LARGE_FLOW * size.max(initial=0.0)]
            if rows.shape[1] >= FEWEST and _is_at_the_pressure_of(part, whole):
                agree = _agreeing(rows, whole, np.maximum(steps[one], steps[other]))
                if agree:
                    return Copy(one=one, other=other, compared=rows.shape[1], agree=agree)
    return None


def _is_at_the_pressure_of(part: RampTest, whole: RampTest) -> bool:
    """Tell whether neither recorded its pressure drop, or both did and it is the same one."""
    known = [test.dp for test in (part, whole) if test.dp is not None and not test.dp_is_declared]
    usual = [float(np.median(dp)) for dp in known]
    return len(known) != 1 and (not known or abs(usual[0] - usual[1]) <= LEVEL * abs(usual[1]))


def _agreeing(rows: np.ndarray, whole: RampTest, steps: np.ndarray) -> int:
    """Return how many rows (2, N) of command and flow, rounded to steps, are in a recording; 0 if it has no copy."""
    ours, its = _keys(rows, steps), _keys(np.stack([whole.u, whole.q]), steps)
    agree = int(np.count_nonzero(np.isin(ours, its).any(axis=0)))
    u, q = np.abs(rows)
    # So many rows would differ, each by itself, if the thresholds were shifted by the least that repeats show.
    by_shift = float(np.ptp(q) / np.ptp(u)) * LEAST_SHIFT * float(u.max()) if np.ptp(u) else 0.0
    differing = u.size * min(by_shift / steps[1], 1.0)
    is_copy = agree >= (1 - SPOILT) * u.size - 1 and np.ptp(u) > SAME_RANGE * u.max() and differing > LEAST_DIFFERING
    return agree if is_copy else 0


def _keys(rows: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return rows of command and flow, rounded to steps, as one number each (4, N).

    What lies midway between two steps may have been rounded to either.
    """
    below, above = (np.round(rows / steps[:, None] + side).astype(np.int64) for side in (-SAME_STEP, SAME_STEP))
    return np.stack([u + (q << 32) for u in (below[0], above[0]) for q in (below[1], above[1])])


def _step(channel: np.ndarray) -> float:
    """Return the largest step of which all numbers of a channel are multiples from the least on (Euclid).

    Numbers without a step have one that is rounding; those of a level channel have the largest itself.
    """
    largest = float(np.abs(channel).max(initial=0.0))
    gaps = np.diff(np.unique(channel))
    gaps = gaps[gaps > ROUNDING * largest]
    step = 0.0
    while gaps.size:
        step = float(gaps.min())
        rest = np.abs(gaps - step * np.round(gaps / step))
        gaps = rest[rest > max(SAME_STEP * step, ROUNDING * largest)]
    span = float(np.ptp(channel))
    return span / round(span / step) if step else largest or 1.0  # written with few digits, single steps differ
