"""How much the meter's noise scatters a ramp's knee at least: repeats that agree better than that are no repeats.

The noise of a line comes from its slow part. Here it is taken from second differences of means of 1, 4 and 16 readings,
whichever tells the least: a bent line, a ripple of the pump and the steps of a converter are in none or not in all of
them. Below one step of the flow nothing is counted, because without noise the readings of two ramps are the same.
"""

import numpy as np

#: Readings in a mean, and fewest means whose differences tell a noise.
MEANS, FEWEST = (1, 4, 16), 8
#: Share of the largest reading below which two differ by rounding.
ROUNDING = 1e-9
#: Variance of the second difference of independent numbers, over theirs.
OF_SECOND_DIFFERENCE = 6.0


def least_step(q: np.ndarray) -> float:
    """Return the least difference of two readings of flow (N,), beyond the rounding of a number; infinite without."""
    gaps = np.diff(np.unique(q))
    return float(gaps[gaps > ROUNDING * np.abs(q).max(initial=0.0)].min(initial=np.inf))


def least_noise(q: np.ndarray, step: float) -> float:
    """Return the variance of one of these readings of flow, in the order of time, as white noise at least.

    0 where it is below one step of the readings, which is taken from more of them than those on a line: they may be
    further apart than that.
    """
    found = [np.inf]
    for count in MEANS:
        whole = q.size // count * count
        if whole >= FEWEST * count:
            means = q[:whole].reshape(-1, count).mean(axis=1)
            found.append(count * float(np.mean(np.diff(means, n=2) ** 2)) / OF_SECOND_DIFFERENCE)
    return min(found) if step**2 < min(found) < np.inf else 0.0
