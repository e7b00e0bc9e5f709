"""A table as recorded: labelled columns of numbers, from whatever file; what the readers give to `ramp_files`.

What a file is read into, text or binary; columns that nobody asks for are never read as numbers.
"""

from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dzdesign.core.errors import InputError, nearest, one_line
from dzdesign.identify.reading.missing_values import Missing
from dzdesign.identify.reading.time_stamps import Start

#: Characters of a cell, and columns of a file, that a message quotes.
QUOTED_CHARACTERS, QUOTED_COLUMNS = 40, 12
#: Stands between the labels of two columns, one of dates and one of times of day, that are the time together.
AND = " + "
#: Characters of a library's own error that are quoted.
LONGEST_REASON = 200


def clean_label(label: str) -> str:
    """Return a column's label without the blanks and quotes around it."""
    return label.strip(' \t"')


@dataclass(frozen=True, slots=True, kw_only=True)
class Table(ABC):
    """The labelled columns of a file.

    Attributes
    ----------
    path : Path
        The file, for messages.
    labels : tuple of str
        In the order of the file; one may repeat.
    units : mapping
        Label -> unit, where the file states it beside the label and not in it.
    comments : str
        The lines that stand above the labels, as they are in the file.
    """

    path: Path
    labels: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    comments: str = ""
    #: Of columns that were read: what stood there for no value.
    marked: dict[str, Missing] = field(default_factory=dict)

    @abstractmethod
    def load(self, labels: Collection[str]) -> None:
        """Read columns at once, which takes less time than one after the other by `numbers`."""

    @abstractmethod
    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64, NaN where a sample is missing; InputError where a cell is not a number."""

    @abstractmethod
    def length(self, label: str) -> int:
        """Return how many samples a column has, as far as the reader knows."""

    @abstractmethod
    def place(self, row: int) -> str:
        """Return where a sample stands, in the words of a person who opens the file: ``row 8``."""

    @property
    def header(self) -> str:
        """Where the labels stand, with a blank before it, or nothing."""
        return ""

    def cell(self, label: str, row: int) -> str:
        """Return what stands in a cell, for messages."""
        return f"{self.numbers(label)[row]:g}"

    def is_clock(self, label: str) -> bool:
        """Tell whether a column holds dates or times of day, which `numbers` can't give and `seconds` can."""
        return False

    def seconds(self, label: str) -> np.ndarray:
        """Return a column of dates or times of day, as `is_clock` tells, as seconds since the first row of the file."""
        raise TypeError(f"column '{label}' holds numbers")

    def dated(self, label: str) -> str:
        """Return a column of times of day with the only one of their dates, as ``Date + Time``; else the label itself.

        `is_clock`, `seconds` and `started` take such a pair as they take a column.
        """
        return label

    def pair(self, text: str) -> tuple[str, str] | None:
        """Return the labels of the dates and of the times of day that a text such as ``Date + Time`` names."""
        return None

    def started(self, label: str) -> Start | None:
        """Return the date and time at which a column of time counts zero; None if they are not known."""
        return None

    def found_labels(self) -> str:
        """Return the labels for a message, the first `QUOTED_COLUMNS` of them."""
        labels = ", ".join(label[:QUOTED_CHARACTERS] for label in self.labels[:QUOTED_COLUMNS])
        return labels + (", ..." if len(self.labels) > QUOTED_COLUMNS else "")

    def no_column(self, label: str, wanted_by: str) -> InputError:
        """Return the error for a label that is none of the table's, with the nearest one."""
        return InputError(
            f"'{self.path}' has no column '{label}', which {wanted_by} (columns found: {self.found_labels()})"
            f"{nearest(label, self.labels)}; write the label as it stands in the file"
        )


def unreadable(path: Path, name: str, error: Exception) -> InputError:
    """Return the error for a file that a library can't read."""
    reason = one_line(str(error).strip().partition("\n")[0])[:LONGEST_REASON] or type(error).__name__
    return InputError(f"'{path}' is not a {name} file that can be read ({reason}); save it again, or export it as CSV")
