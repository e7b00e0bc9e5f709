"""The certified bound of a threshold over the pressure drop, exactly from the nodes of valve.json: straight between."""

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import numpy as np

#: Pressure drops closer than this are one to a double, MPa.
NEAR_MPa = 1e-9


@dataclass(frozen=True, slots=True)
class BoundPiece:
    """The bound between two neighbouring nodes: the chord from `low_V` to `high_V`."""

    from_MPa: Fraction
    to_MPa: Fraction
    low_V: Fraction
    high_V: Fraction

    def at(self, dp_MPa: Fraction) -> Fraction:
        """Return the bound at a pressure drop inside, V."""
        if self.from_MPa == self.to_MPa:
            return min(self.low_V, self.high_V)
        before, after = dp_MPa - self.from_MPa, self.to_MPa - dp_MPa
        return (self.low_V * after + self.high_V * before) / (self.to_MPa - self.from_MPa)

    def least(self, low_MPa: Fraction, high_MPa: Fraction) -> Fraction:
        """Return the least bound from `low_MPa` to `high_MPa`, both inside: at one of the ends."""
        return min(self.at(low_MPa), self.at(high_MPa))


@dataclass(frozen=True, slots=True, kw_only=True)
class CertifiedBound:
    """Lower bound of a threshold, exact, on the whole tested interval or at its nodes alone; elsewhere is none."""

    pieces: tuple[BoundPiece, ...]

    @classmethod
    def of(cls, dp_MPa: Sequence[float], lower_V: Sequence[float], *, apart: bool = False) -> "CertifiedBound":
        """Return the bound with these nodes, straight between them; `apart` says nothing between them."""
        nodes, bounds = ([Fraction(repr(float(value))) for value in values] for values in (dp_MPa, lower_V))
        if len(nodes) == 1 or apart:
            alone = zip(nodes, bounds, strict=True)
            return cls(pieces=tuple(BoundPiece(node, node, bound, bound) for node, bound in alone))
        ends = zip(pairwise(nodes), pairwise(bounds), strict=True)
        return cls(pieces=tuple(BoundPiece(*between, *levels) for between, levels in ends))

    @property
    def dp_MPa(self) -> tuple[Fraction, Fraction]:
        """The tested interval."""
        return self.pieces[0].from_MPa, self.pieces[-1].to_MPa

    def at(self, dp_MPa: Fraction) -> Fraction | None:
        """Return the bound at a pressure drop, V; None where there is none."""
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
        """Return the bound at many pressure drops in double precision; infinite where there is none."""
        least = np.full(dp_MPa.shape, np.inf)
        for piece in self.pieces:
            low, high, low_V, high_V = map(float, (piece.from_MPa, piece.to_MPa, piece.low_V, piece.high_V))
            inside = (dp_MPa >= low - NEAR_MPa) & (dp_MPa <= high + NEAR_MPa)
            share = (dp_MPa - low) / (high - low) if high > low else 0.0
            least = np.where(inside, np.minimum(least, low_V + share * (high_V - low_V)), least)
        return least


def largest_excess(bound: CertifiedBound, nodes: np.ndarray, offset: np.ndarray) -> float:
    """Return by how much an offset, linear between its nodes (MPa, V), exceeds a bound at most, V."""
    ends = [float(end) for piece in bound.pieces for end in (piece.from_MPa, piece.to_MPa)]
    at = np.union1d(nodes, np.clip(ends, nodes[0], nodes[-1]))
    known = bound.in_doubles(at)
    return float(np.max(np.interp(at, nodes, offset)[np.isfinite(known)] - known[np.isfinite(known)]))
