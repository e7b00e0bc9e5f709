"""Exact numbers at consecutive pressure codes: whole numerators and denominators, and the doubles that order them.

A quotient of two whole numbers in Python is the nearest double, and rounding to the nearest never turns an order round:
of two numbers with unlike doubles the larger double is of the larger number. Only equal doubles are compared exactly.
"""

from collections import deque
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
        doubles, found = self.doubles.tolist(), list[int]()
        rising = deque[int]()  # places of a window, of numbers that rise: the first has its least
        for place, double in enumerate(doubles):
            while rising and (double < doubles[rising[-1]] or self._is_less(place, rising[-1])):
                rising.pop()
            rising.append(place)
            if rising[0] <= place - width:
                rising.popleft()
            if place >= width - 1:
                found.append(rising[0])
        parts = (tuple(map(part.__getitem__, found)) for part in (self.numerators, self.denominators))
        return ExactRow(*parts)

    def _is_less(self, place: int, other: int) -> bool:
        """Tell whether one number is less than another, exactly."""
        return self.numerators[place] * self.denominators[other] < self.numerators[other] * self.denominators[place]


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
