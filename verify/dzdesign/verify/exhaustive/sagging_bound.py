"""The lower bound of a threshold whose second divided difference is at most M between neighbouring tests.

Argued from the ramp tests again: 2 f[a, x, b] <= M with f(a) >= A and f(b) >= B says, for x = a + s (b - a),
f(x) >= A + s (B - A) - M (b - a)² s (1 - s) / 2, a parabola that is open above. Its least value over an interval lies
at an end, or where its slope is zero.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from dzdesign.design.lot_valves import LotSide


@dataclass(frozen=True, slots=True)
class _Parabola:
    """A + B s + C s² from `start` on, s in units of `width`; MPa and V."""

    start: Fraction
    width: Fraction
    coefficients: tuple[Fraction, Fraction, Fraction]

    def at(self, share: Fraction) -> Fraction:
        constant, linear, square = self.coefficients
        return constant + share * (linear + share * square)

    @property
    def lowest(self) -> Fraction | None:
        """Where the slope is zero, as a share; None of a straight line."""
        _, linear, square = self.coefficients
        return -linear / (2 * square) if square else None


class SaggingBound:
    """What is known of a threshold of limited curvature, straight for M = 0, over its tested interval."""

    def __init__(self, bounds: LotSide) -> None:
        nodes = [Fraction(repr(dp)) for dp in bounds.dp_MPa]
        lower = [Fraction(repr(value)) for value in bounds.u_lower_V]
        self._parabolas = []
        for (a, b), (low, high), bend in zip(pairwise(nodes), pairwise(lower), bounds.curvature_V_MPa2, strict=True):
            sag = Fraction(repr(bend)) * (b - a) ** 2 / 2
            self._parabolas.append(_Parabola(a, b - a, (low, high - low - sag, sag)))

    def least(self, low_MPa: Fraction, high_MPa: Fraction) -> Fraction:
        """Return the least value over an interval, as far as tests reach, V; the interval touches the tested one."""
        return min(value for part in self._parabolas for value in self._values(part, low_MPa, high_MPa))

    @staticmethod
    def _values(part: _Parabola, low_MPa: Fraction, high_MPa: Fraction) -> Iterator[Fraction]:
        first, last = ((end - part.start) / part.width for end in (low_MPa, high_MPa))
        if last < 0 or first > 1:
            return
        first, last = max(first, Fraction(0)), min(last, Fraction(1))
        yield from (part.at(first), part.at(last))
        if part.lowest is not None and first < part.lowest < last:
            yield part.at(part.lowest)

    def least_in_doubles(self, low_MPa: np.ndarray, high_MPa: np.ndarray) -> np.ndarray:
        """Return the same of many intervals in double precision; infinite for one that no test reaches."""
        found = np.full(low_MPa.shape, np.inf)
        for part in self._parabolas:
            start, width = float(part.start), float(part.width)
            constant, linear, square = map(float, part.coefficients)
            first, last = (low_MPa - start) / width, (high_MPa - start) / width
            inside = (last >= 0) & (first <= 1)
            first, last = np.clip(first, 0, 1), np.clip(last, 0, 1)
            lowest = np.clip(-linear / (2 * square), first, last) if square else first
            for share in (first, last, lowest):
                value = constant + share * (linear + share * square)
                found = np.where(inside, np.minimum(found, value), found)
        return found
