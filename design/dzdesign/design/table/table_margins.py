"""How far the offset of a table of beta stays under its ceiling: by doubles, and exactly where these can't tell."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from dzdesign.design.ceiling.exact_row import ExactRow
from dzdesign.design.table.linear_programme import between_nodes

#: Share of the largest number that no margin in doubles is wrong by: four roundings of 2^-53 each, and to spare.
NEAR = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class TableMargins:
    """Ceiling and table at every difference of pressure codes."""

    limit: ExactRow
    nodes: Sequence[int]
    #: Offset over u_max of a beta whose numerator between the nodes is one, see `between_nodes`.
    unit: Fraction
    #: Numerators of the table at every code.
    numerators: np.ndarray = field(init=False)
    #: The margins in doubles, and by how much each of them may be wrong.
    doubles: np.ndarray = field(init=False)
    error: float = field(init=False)

    def __post_init__(self) -> None:
        numerators = between_nodes(self.nodes, len(self.limit))
        offset = numerators * float(self.unit)
        largest = max(float(np.abs(self.limit.doubles).max()), float(np.abs(offset).max()))
        for name, value in (
            ("numerators", numerators), ("doubles", self.limit.doubles - offset), ("error", NEAR * largest)
        ):  # fmt: skip
            object.__setattr__(self, name, value)

    def at(self, code: int) -> Fraction:
        """Return the margin at a code, exactly; negative where the offset lies above the ceiling."""
        return self.limit[code] - int(self.numerators[code]) * self.unit

    def least(self, codes: np.ndarray) -> Fraction:
        """Return the least margin at some codes, of which there is one at least, exactly."""
        doubles = self.doubles[codes]
        near = codes[doubles <= doubles.min() + 2 * self.error].tolist()
        different = {
            (self.limit.numerators[code], self.limit.denominators[code], int(self.numerators[code])): code
            for code in near
        }
        return min(map(self.at, different.values()))

    def exceeded(self) -> list[int]:
        """Return the codes, rising, at which the offset lies above the ceiling."""
        up, unit = self.unit.numerator, self.unit.denominator
        numerators, denominators = self.limit.numerators, self.limit.denominators
        return [
            code
            for code in np.flatnonzero(self.doubles <= self.error).tolist()
            if numerators[code] * unit < int(self.numerators[code]) * up * denominators[code]
        ]
