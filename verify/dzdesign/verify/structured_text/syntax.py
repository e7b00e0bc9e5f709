"""The subset of Structured Text that is verified, as a tree; `parser` states its grammar."""

from dataclasses import dataclass
from typing import Literal, NamedTuple

Kind = Literal["DINT", "UDINT", "BOOL"]
#: Least and largest number of each type.
RANGES: dict[Kind, tuple[int, int]] = {"DINT": (-(2**31), 2**31 - 1), "UDINT": (0, 2**32 - 1), "BOOL": (0, 1)}


class Place(NamedTuple):
    """Line and column of a text, from 1 on."""

    line: int
    column: int

    def __str__(self) -> str:
        return f"line {self.line}, column {self.column}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Number:
    """A literal; a BOOL is 0 or 1. The type of a whole number is that of what it meets."""

    place: Place
    value: int
    kind: Kind | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Name:
    """A variable, or an element of an array."""

    place: Place
    name: str
    index: "Expression | None" = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Operation:
    """An operator, or a function, and its operands; one that only negates is ``NEG`` or ``NOT``."""

    place: Place
    operator: str
    operands: tuple["Expression", ...]


Expression = Number | Name | Operation


@dataclass(frozen=True, slots=True, kw_only=True)
class Assignment:
    """``target := value;``."""

    place: Place
    target: Name
    value: Expression


@dataclass(frozen=True, slots=True, kw_only=True)
class If:
    """Conditions with the statements that follow each; the last of them has the condition None where it is ELSE."""

    place: Place
    branches: tuple[tuple[Expression | None, tuple["Statement", ...]], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class For:
    """A loop over whole numbers that stand in the text."""

    place: Place
    variable: Name
    first: int
    last: int
    body: tuple["Statement", ...]


Statement = Assignment | If | For


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """A declared variable."""

    place: Place
    name: str
    #: Such as ``VAR_INPUT``, or ``VAR CONSTANT``.
    section: str
    kind: Kind
    #: First and last index of an array.
    bounds: tuple[int, int] | None
    #: Of a constant or a state its first value, or values; None where none is given.
    initial: tuple[int, ...] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class FunctionBlock:
    """A function block."""

    name: str
    variables: dict[str, Variable]
    body: tuple[Statement, ...]

    def of_section(self, section: str) -> list[Variable]:
        """Return the variables of a section, in their order."""
        return [variable for variable in self.variables.values() if variable.section == section]
