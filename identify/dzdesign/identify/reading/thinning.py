"""Thinning of long recordings: of every few rows in a row the median of each column is kept.

A ramp test needs some ten thousand samples per branch; what a logger writes beyond that only averages noise. Of a
recording of more than `MOST_ROWS` rows, runs of an odd number of rows become one row each. The median and not the mean,
because it is a value that was recorded:

- no spike of flow, pressure or command moves it;
- where a meter's floor parts readings from zeros, it is one of them: a mean would be a flow that the meter never reads;
- the flow of a valve rises with the command, so the medians of both belong together, also where a fast sweep, a step or
  a turning point lies in a run: a mean would lie on a chord of the characteristic.

Of white noise its standard deviation is about a quarter above that of the mean.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

#: Rows of one recording that are kept at most: more are thinned.
MOST_ROWS = 400_000
#: Runs whose medians are taken at a time: what that takes of memory has a bound.
PART = 1 << 17


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Thinned:
    """What is left of a recording: `rows` (C, M), medians of an odd number `run` of them (1: nothing was thinned)."""

    rows: np.ndarray
    run: int


def thin(rows: np.ndarray) -> Thinned:
    """Thin a recording of more than `MOST_ROWS` rows to that many at most.

    Parameters
    ----------
    rows : (C, N) array
        Columns that rise, fall or stand still together, but for their noise. Up to a run of rows at the end is left
        out, for a shorter run would scatter more.

    Examples
    --------
    >>> thin(np.array([[0.0, 1.0, 2.0]])).run
    1
    """
    run = -(-rows.shape[1] // MOST_ROWS)
    run += run % 2 == 0
    if run <= 1:
        return Thinned(rows=rows, run=1)
    few = np.empty((rows.shape[0], rows.shape[1] // run))
    for column, medians in zip(rows, few, strict=True):
        for start in range(0, medians.size, PART):
            stop = min(start + PART, medians.size)
            runs = column[start * run : stop * run].reshape(-1, run)
            medians[start:stop] = np.partition(runs, run // 2, axis=1)[:, run // 2]
    return Thinned(rows=few, run=run)
