"""Exact numbers at consecutive pressure codes: whole numerators and denominators, and the doubles that order them.

A quotient of two whole numbers in Python is the nearest double, and rounding to the nearest never turns an order round:
of two numbers with unlike doubles the larger double is of the larger number. Only equal doubles are compared exactly.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import chain
from operator import truediv
from typing import overload

import numpy as np


@dataclass(frozen=True, eq=False)
class ExactRow(Sequence[Fraction]):
    """A row of exact numbers; the denominators are positive, and nothing is in lowest terms."""

    numerators: tuple[int, ...]
    denominators: tuple[int, ...]

    @cached_property
    def doubles(self) -> np.ndarray:
        """The nearest double of each number."""
        quotients = map(truediv, self.numerators, self.denominators)
        doubles = np.fromiter(quotients, dtype=float, count=len(self.numerators))
        doubles.setflags(write=False)
        return doubles

    @classmethod
    def joined(cls, parts: "Sequence[tuple[Sequence[int], int]]") -> "ExactRow":
        """Return a row from parts, each numerators over one denominator."""
        numerators = tuple(chain.from_iterable(part for part, _ in parts))
        denominators = tuple(chain.from_iterable((denominator,) * len(part) for part, denominator in parts))
        return cls(numerators, denominators)

    def __len__(self) -> int:
        return len(self.numerators)

    @overload
    def __getitem__(self, place: int) -> Fraction: ...
    @overload
    def __getitem__(self, place: slice) -> "ExactRow": ...
    def __getitem__(self, place: int | slice) -> "Fraction | ExactRow":
        if isinstance(place, slice):
            return ExactRow(self.numerators[place], self.denominators[place])
        return Fraction(self.numerators[place], self.denominators[place])

    def __iter__(self) -> Iterator[Fraction]:
        return map(Fraction, self.numerators, self.denominators)

    def followed_by(self, other: "ExactRow") -> "ExactRow":
        """Return this row and behind it another."""
        return ExactRow(self.numerators + other.numerators, self.denominators + other.denominators)

    def line(self, factor: Fraction, less: Fraction = Fraction(0)) -> "ExactRow":
        """Return each number times a factor, less another number."""
        up, down = factor.numerator * less.denominator, less.numerator * factor.denominator
        unit = factor.denominator * less.denominator
        if not down:
            up, unit = factor.numerator, factor.denominator
            return ExactRow(tuple(up * n for n in self.numerators), tuple(unit * d for d in self.denominators))
        pairs = zip(self.numerators, self.denominators, strict=True)
        return ExactRow(tuple(up * n - down * d for n, d in pairs), tuple(unit * d for d in self.denominators))

    def plus(self, other: "ExactRow") -> "ExactRow":
        """Return the sums, place by place."""
        left, right = (zip(row.numerators, row.denominators, strict=True) for row in (self, other))
        pairs = [
            (n + m, d) if d == e else (n * e + m * d, d * e) for (n, d), (m, e) in zip(left, right, strict=True)
        ]
        return ExactRow(tuple(n for n, _ in pairs), tuple(d for _, d in pairs))

    def at_least(self, least: Fraction) -> "ExactRow":
        """Return the larger of each number and `least`."""
        up, unit, bound = least.numerator, least.denominator, float(least)
        numerators, denominators = list(self.numerators), list(self.denominators)
        for place in np.flatnonzero(self.doubles <= bound).tolist():
            if self.doubles[place] < bound or numerators[place] * unit < up * denominators[place]:
                numerators[place], denominators[place] = up, unit
        return ExactRow(tuple(numerators), tuple(denominators))

    def least(self) -> Fraction:
        """Return the least of all numbers."""
        places = np.flatnonzero(self.doubles == self.doubles.min())
        return min(Fraction(n, d) for n, d in {(self.numerators[at], self.denominators[at]) for at in places})

    def least_of_windows(self, width: int) -> "ExactRow":
        """Return the least of each `width` neighbouring numbers."""
        ranks, holders = self._ranks()
        found = np.lib.stride_tricks.sliding_window_view(ranks, width).min(axis=1)
        places = holders[found].tolist()
        parts = (tuple(map(part.__getitem__, places)) for part in (self.numerators, self.denominators))
        return ExactRow(*parts)

    def _ranks(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the rank of each number among all, equal ones alike, and of each rank a place that has it."""
        order = np.argsort(self.doubles, kind="stable")
        ordered = self.doubles[order]
        starts = np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1]))
        ends = np.append(starts[1:], len(self))
        larger: list[int] = []  # where, among equal doubles, a larger number begins
        for group in np.flatnonzero(ends - starts > 1).tolist():
            larger += self._sorted_among_equals(order, int(starts[group]), int(ends[group]))
        firsts = np.sort(np.append(starts, larger)).astype(np.intp)
        ranks = np.empty(len(self), dtype=np.intp)
        ranks[order] = np.repeat(np.arange(firsts.size), np.diff(np.append(firsts, len(self))))
        return ranks, order[firsts]

    def _sorted_among_equals(self, order: np.ndarray, begin: int, end: int) -> list[int]:
        """Sort a stretch of `order` whose doubles are equal; return where in it a larger number begins."""
        places = order[begin:end].tolist()
        written = {(self.numerators[place], self.denominators[place]) for place in places}
        if len(written) == 1:
            return []
        numbers = {place: self[place] for place in places}
        places.sort(key=numbers.__getitem__)
        order[begin:end] = places
        return [
            begin + at for at in range(1, len(places)) if numbers[places[at]] != numbers[places[at - 1]]
        ]


def least_of(rows: Sequence[ExactRow]) -> ExactRow:
    """Return, place by place, the least of several rows of one length."""
    if len(rows) == 1:
        return rows[0]
    doubles = np.array([row.doubles for row in rows])
    chosen, ties = doubles.argmin(axis=0), (doubles == doubles.min(axis=0)).sum(axis=0) > 1
    for place in np.flatnonzero(ties).tolist():
        among = np.flatnonzero(doubles[:, place] == doubles[chosen[place], place]).tolist()
        chosen[place] = min(among, key=lambda row: rows[row][place])
    picked = [(rows[row].numerators[place], rows[row].denominators[place]) for place, row in enumerate(chosen.tolist())]
    return ExactRow(tuple(n for n, _ in picked), tuple(d for _, d in picked))
