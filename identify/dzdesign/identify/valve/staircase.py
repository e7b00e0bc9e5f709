"""The staircase: what lower bounds at the tests certify on the whole interval of the pressure drop."""

from typing import Literal

import numpy as np

#: How a threshold runs with the pressure drop.
Direction = Literal["decreasing", "flat", "increasing"]


def staircase(bound: np.ndarray, trend: Direction) -> tuple[np.ndarray, np.ndarray]:
    """Turn bounds at the tests into bounds on the whole interval, by monotonicity alone.

    A threshold that falls with the pressure drop is, anywhere between two tests, at least the upper test's bound; one
    that rises, at least the lower test's. Chords between the bounds would not be safe: a convex threshold lies below
    its chords.

    The tests come in the order of rising pressure drop. A trend that is "flat" assumes no direction: the lowest bound
    holds everywhere.

    Returns
    -------
    steps : (T - 1,) array
        Bound on each closed interval between neighbouring tests.
    ceiling : (T,) array
        The largest offset at each test such that straight chords stay under the steps on both sides.
    """
    if trend == "decreasing":
        tightened = np.maximum.accumulate(bound[::-1])[::-1]
        steps = tightened[1:]
    elif trend == "increasing":
        tightened = np.maximum.accumulate(bound)
        steps = tightened[:-1]
    else:
        tightened = np.full_like(bound, bound.min())
        steps = tightened[1:]
    ceiling = tightened.copy()
    ceiling[:-1] = np.minimum(ceiling[:-1], steps)
    ceiling[1:] = np.minimum(ceiling[1:], steps)
    return steps, ceiling
