"""The certified bound of a threshold over the pressure drop: bounds at the tests, and what a premise makes of them."""

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

from dzdesign.identify.constants import Premise
from dzdesign.identify.valve.staircase import Direction, staircase

#: Pressure drops closer than this are one to a double, MPa.
NEAR_MPa = 1e-9


@dataclass(frozen=True, slots=True)
class BoundPiece:
    """The bound between two neighbouring tests: the chord from `low_V` to `high_V` less M/2 (x - from) (to - x)."""

    from_MPa: Fraction
    to_MPa: Fraction
    low_V: Fraction
    high_V: Fraction
    #: M: the second divided difference that the premise allows, V/MPa².
    curvature: Fraction

    def at(self, dp_MPa: Fraction) -> Fraction:
        """Return the bound at a pressure drop inside, V."""
        if self.from_MPa == self.to_MPa:
            return min(self.low_V, self.high_V)
        before, after = dp_MPa - self.from_MPa, self.to_MPa - dp_MPa
        chord = (self.low_V * after + self.high_V * before) / (self.to_MPa - self.from_MPa)
        return chord - self.curvature / 2 * before * after

    def least(self, low_MPa: Fraction, high_MPa: Fraction) -> Fraction:
        """Return the least bound from `low_MPa` to `high_MPa`, both inside: at an end, or where a sag is deepest."""
        values = [self.at(low_MPa), self.at(high_MPa)]
        if self.curvature > 0:
            slope = (self.high_V - self.low_V) / (self.to_MPa - self.from_MPa)
            deepest = (self.from_MPa + self.to_MPa) / 2 - slope / self.curvature
            if low_MPa < deepest < high_MPa:
                values.append(self.at(deepest))
        return min(values)


@dataclass(frozen=True, slots=True, kw_only=True)
class CertifiedBound:
    """Lower bound of a threshold on the whole tested interval, exact; outside there is none."""

    pieces: tuple[BoundPiece, ...]

    @classmethod
    def of(
        cls,
        premise: Premise,
        dp_MPa: Sequence[float],
        lower_V: Sequence[float],
        curvature: Sequence[float],
        trend: Direction,
    ) -> "CertifiedBound":
        """Return the bound that follows from simultaneous bounds at the tests.

        `monotone`: between two tests the lower bound of both sides, by the trend. Otherwise, with 2 f[a, x, b] <= M
        for every x between neighbouring tests a and b, f(x) >= chord - M/2 (x - a) (b - x); `line` has M = 0.
        """
        nodes, bounds = ([Fraction(repr(float(value))) for value in values] for values in (dp_MPa, lower_V))
        if len(nodes) == 1:
            only = BoundPiece(nodes[0], nodes[0], bounds[0], bounds[0], Fraction(0))
            return cls(pieces=(only,))
        if premise == "monotone":
            steps, _ = staircase(np.array(lower_V, dtype=float), trend)
            exact = [Fraction(repr(float(step))) for step in steps]
            levels = [(step, step, Fraction(0)) for step in exact]
        else:
            bends = [Fraction(repr(float(value))) for value in curvature]
            levels = [(low, high, bend) for (low, high), bend in zip(pairwise(bounds), bends, strict=True)]
        ends = pairwise(nodes)
        return cls(
            pieces=tuple(BoundPiece(low, high, *level) for (low, high), level in zip(ends, levels, strict=True))
        )

    @property
    def dp_MPa(self) -> tuple[Fraction, Fraction]:
        """The tested interval."""
        return self.pieces[0].from_MPa, self.pieces[-1].to_MPa

    def at(self, dp_MPa: Fraction) -> Fraction | None:
        """Return the bound at a pressure drop, V; None outside the tested interval."""
        touching = [piece.at(dp_MPa) for piece in self.touching(dp_MPa, dp_MPa)]
        return min(touching) if touching else None

    def touching(self, low_MPa: Fraction, high_MPa: Fraction) -> Iterator[BoundPiece]:
        """Yield the pieces that share a pressure drop with the interval from `low_MPa` to `high_MPa`."""
        first = bisect_left(self.pieces, low_MPa, key=lambda piece: piece.to_MPa)
        for piece in self.pieces[first:]:
            if piece.from_MPa > high_MPa:
                return
            yield piece

    def in_doubles(self, dp_MPa: np.ndarray) -> np.ndarray:
        """Return the bound at many pressure drops in double precision; infinite outside the tested interval."""
        least = np.full(dp_MPa.shape, np.inf)
        for piece in self.pieces:
            low, high, low_V, high_V, bend = map(
                float, (piece.from_MPa, piece.to_MPa, piece.low_V, piece.high_V, piece.curvature)
            )
            inside = (dp_MPa >= low - NEAR_MPa) & (dp_MPa <= high + NEAR_MPa)
            share = (dp_MPa - low) / (high - low) if high > low else 0.0
            value = low_V + share * (high_V - low_V) - bend / 2 * (dp_MPa - low) * (high - dp_MPa)
            least = np.where(inside, np.minimum(least, value), least)
        return least


def largest_excess(bound: CertifiedBound, nodes: np.ndarray, offset: np.ndarray) -> float:
    """Return by how much an offset, linear between its nodes (MPa, V), exceeds a bound at most, V."""
    return max(_excess(piece, nodes, offset) for piece in bound.pieces)


def _excess(piece: BoundPiece, nodes: np.ndarray, offset: np.ndarray) -> float:
    """Return by how much it exceeds the bound between two tests at most, V."""
    ends = [float(piece.from_MPa), float(piece.to_MPa)]
    at = np.array([ends[0], *nodes[(nodes > ends[0]) & (nodes < ends[1])], ends[1]])
    value, bend = np.interp(at, nodes, offset), float(piece.curvature)
    places = [at]
    if bend > 0:  # the bound is convex: where its slope is the offset's, it comes nearest
        chord = float(piece.high_V - piece.low_V) / (ends[1] - ends[0])
        nearest = (ends[0] + ends[1]) / 2 + (np.diff(value) / np.diff(at) - chord) / bend
        places.append(np.clip(nearest, at[:-1], at[1:]))
    points = np.concatenate(places)
    bound = CertifiedBound(pieces=(piece,)).in_doubles(points)
    return float(np.max(np.interp(points, nodes, offset) - bound))
