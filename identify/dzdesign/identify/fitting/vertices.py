"""Whether the tests show a threshold that is lowest between two of them: the vertex of a parabola through three.

Between two tests `monotone` certifies the lower of both, on the premise that the threshold runs one way there. Steps
the right way do not support that by themselves: where they shrink so fast that the curve has turned before the last
test, the bend that the three show has its lowest point between two of them, below both. Of a decay, whose steps each
are a third of the former or more (equal distances), no parabola through neighbouring tests turns inside an interval.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import REFUSED
from dzdesign.identify.fitting.premises import LARGEST_DEGREES


@dataclass(frozen=True, slots=True, kw_only=True)
class Vertex:
    """The lowest point of a parabola through three neighbouring tests, strictly between two of them."""

    #: Those two, and the place itself, MPa.
    from_MPa: float
    to_MPa: float
    at_MPa: float
    #: By how much it lies below the lower of both, V.
    depth_V: float
    #: Probability of slopes at both ends as steep as these, if no parabola turned between any two tests.
    p_value: float

    @property
    def significant(self) -> bool:
        """Whether the tests contradict a threshold that runs one way between them."""
        return self.p_value < REFUSED


def find_vertex(dp_MPa: np.ndarray, threshold: np.ndarray, covariance: np.ndarray, degrees: float) -> Vertex | None:
    """Return the vertex that the tests show most surely; None where no parabola has its lowest point between two.

    A parabola turns upwards inside an interval where its slope at the left end falls and at the right end rises. Both
    are contrasts of the thresholds, V, whose `covariance` (T, T), V², has so many `degrees` of freedom. Both must be
    significant (Student), so that no share of the error probability is spent on the pair; Bonferroni over the intervals
    of all triples. A parabola that is highest between two tests lies above both there and harms no bound.
    """
    from scipy.special import stdtr

    found = []
    for left, right, triple in _intervals(dp_MPa.size):
        slopes = np.array([_slope(dp_MPa, triple, dp_MPa[end]) for end in (left, right)])
        falls, rises = slopes @ threshold * (-1, 1)
        if falls <= 0 or rises <= 0:
            continue
        error = np.sqrt(np.einsum("ni,ij,nj->n", slopes, covariance, slopes))
        least = float(np.min(np.array([falls, rises]) / np.maximum(error, np.finfo(float).tiny)))
        width = dp_MPa[right] - dp_MPa[left]
        # From slope -falls to slope rises over the width: straight in between.
        to_vertex = falls / (falls + rises) * width
        below_left, below_right = falls * to_vertex / 2, rises * (width - to_vertex) / 2
        found.append(
            Vertex(
                from_MPa=float(dp_MPa[left]),
                to_MPa=float(dp_MPa[right]),
                at_MPa=float(dp_MPa[left] + to_vertex),
                depth_V=float(min(below_left, below_right)),
                p_value=min(1.0, 2 * (dp_MPa.size - 2) * float(stdtr(min(degrees, LARGEST_DEGREES), -least))),
            )
        )
    return min(found, key=lambda each: (each.p_value, -each.depth_V), default=None)


def _intervals(tests: int) -> Iterator[tuple[int, int, int]]:
    """Yield the ends of both intervals of every three neighbouring tests, and the first of the three."""
    for triple in range(tests - 2):
        yield triple, triple + 1, triple
        yield triple + 1, triple + 2, triple


def _slope(dp_MPa: np.ndarray, triple: int, at_MPa: float) -> np.ndarray:
    """Return the weights (T,) of the slope there of the parabola through a test and the two after it."""
    weights = np.zeros(dp_MPa.size)
    three = dp_MPa[triple : triple + 3]
    for row, place in enumerate(three):
        others = np.delete(three, row)
        weights[triple + row] = (2 * at_MPa - others.sum()) / np.prod(place - others)
    return weights
