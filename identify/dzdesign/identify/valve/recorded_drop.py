"""Where one side's pressure drop comes from: which columns of the recordings, and the sign that they gave it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError

#: 1 if the pressure drop was recorded above zero at a side's commands, -1 if below.
DropSign = Literal[1, -1]
#: Pressure drop itself, or ports of the valve, as columns are called.
DropQuantity = Literal["dP", "pP", "pA", "pB", "pT"]
Label = Annotated[str, Meta(max_length=10_000)]


@dataclass(frozen=True, slots=True, kw_only=True)
class DropColumns:
    """Columns that make a pressure drop: one that holds it, or two pressures, the second one subtracted."""

    quantities: Annotated[tuple[DropQuantity, ...], Meta(min_length=1, max_length=2)]
    """Quantities, such as pP and pA; the second one is subtracted."""
    labels: Annotated[tuple[Label, ...], Meta(min_length=1, max_length=2)]
    """Labels of these columns in the recordings."""

    def __post_init__(self) -> None:
        if len(self.quantities) != len(self.labels) or (len(self.labels) == 1) != (self.quantities == ("dP",)):
            raise RuleError(
                f"the pressure drop is made of {', '.join(self.quantities)} in {len(self.labels)} columns, expected dP "
                "in one or two ports in two"
            )

    def in_words(self, sign: DropSign = 1) -> str:
        """Return the drop as a difference of labels, the pressure ahead first.

        Examples
        --------
        >>> DropColumns(quantities=("pA", "pB"), labels=("A (bar)", "B (bar)")).in_words(-1)
        'B (bar) - A (bar)'
        >>> DropColumns(quantities=("dP",), labels=("dP_MPa",)).in_words(-1)
        '-(dP_MPa)'
        """
        if len(self.labels) == 1:
            return self.labels[0] if sign > 0 else f"-({self.labels[0]})"
        return " - ".join(self.labels[::sign])


def drop_in_words(columns: Sequence[DropColumns], sign: DropSign = 1) -> str:
    """Return which columns make a pressure drop; of several recordings all ways, nothing where none does."""
    return " or ".join(dict.fromkeys(each.in_words(sign) for each in columns))


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedDrop:
    """Recorded pressure drop of one side."""

    columns: Annotated[tuple[DropColumns, ...], Meta(min_length=1)]
    """Columns that make the pressure drop; several if the recordings differ."""
    sign: DropSign
    """Sign of the recorded pressure drop at this side's commands. -1: it was recorded below zero, so the pressure of
    the second column is the higher one."""

    @property
    def ways(self) -> set[tuple[DropQuantity, ...]]:
        """The quantities of each entry."""
        return {each.quantities for each in self.columns}

    def in_words(self) -> str:
        """Return the pressure drop as a difference of labels, the pressure ahead first."""
        return drop_in_words(self.columns, self.sign)
