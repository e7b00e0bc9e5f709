"""A table as recorded: labelled columns of numbers, from whatever file; what the readers give to `ramp_files`.

What a file is read into, text or binary; columns that nobody asks for are never read as numbers.
"""

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
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


def numbered(labels: Sequence[str]) -> tuple[str, ...]:
    """Return labels, of which equal ones carry their number behind a ``#``; one that ends so in the file goes first.

    Examples
    --------
    >>> numbered(["t_s", "Q_Lmin", "Q_Lmin"])
    ('t_s', 'Q_Lmin#1', 'Q_Lmin#2')
    """
    times, seen, found = Counter(labels), Counter[str](), list[str]()
    for label in labels:
        seen[label] += 1
        address = f"{label}#{seen[label]}" if label and times[label] > 1 else label
        while address != label and address in times:
            address = f"{label}#{address.removeprefix(label)}"
        found.append(address)
    return tuple(found)


@dataclass(frozen=True, slots=True, kw_only=True)
class Table(ABC):
    """The labelled columns of a file."""

    #: The file, for messages.
    path: Path
    #: In the order of the file; equal ones are `numbered`.
    labels: tuple[str, ...]
    #: Label -> unit, where the file states it beside the label and not in it.
    units: Mapping[str, str] = field(default_factory=dict)
    #: The lines that stand above the labels, as they are in the file.
    comments: str = ""
    #: Label -> label of its own column of time, where the file states it for each channel; see
    #: `column_labels.clock_of`.
    clocks: Mapping[str, str] = field(default_factory=dict)
    #: Of columns that were read: what stood there for no value.
    marked: dict[str, Missing] = field(default_factory=dict)

    def load(self, labels: Collection[str]) -> None:  # noqa: B027
        """Read columns at once, where that takes less time than one after the other by `numbers`."""

    @abstractmethod
    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64, NaN where a sample is missing; InputError where a cell is not a number."""

    @abstractmethod
    def length(self, label: str) -> int:
        """Return how many samples a column has, as far as the reader knows."""

    @abstractmethod
    def place(self, row: int) -> str:
        """Return where a sample stands, in the words of a person who opens the file: ``row 8``."""

    def group(self, label: str) -> str:
        """Return the group of the file in which a column stands, or nothing."""
        return ""

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

    def in_file(self, label: str) -> str:
        """Return a label as it stands in the file: without its number, if it is one of equal ones."""
        bare, _, number = label.rpartition("#")
        equal = number.isdecimal() and f"{bare}#1" in self.labels and f"{bare}#2" in self.labels
        return bare if equal else label

    def found_labels(self) -> str:
        """Return the labels for a message, the first `QUOTED_COLUMNS` of them."""
        labels = ", ".join(label[:QUOTED_CHARACTERS] for label in self.labels[:QUOTED_COLUMNS])
        return labels + (", ..." if len(self.labels) > QUOTED_COLUMNS else "")

    def no_column(self, label: str, wanted_by: str, quantity: str = "Q") -> InputError:
        """Return the error for a label that is none of the table's, with the nearest one; or is that of several."""
        equal = [each for each in self.labels if each != label and self.in_file(each) == label]
        if equal:
            return InputError(
                f"'{self.path}'{self.header} has {len(equal)} columns '{label}'; choose one by its number, for example "
                f'--columns "{quantity}={equal[1]}"'
            )
        return InputError(
            f"'{self.path}' has no column '{label}', which {wanted_by} (columns found: {self.found_labels()})"
            f"{nearest(label, self.labels)}; write the label as it stands in the file"
        )


def unreadable(path: Path, name: str, error: Exception) -> InputError:
    """Return the error for a file that a library can't read."""
    reason = one_line(str(error).strip().partition("\n")[0])[:LONGEST_REASON] or type(error).__name__
    return InputError(f"'{path}' is not a {name} file that can be read ({reason}); save it again, or export it as CSV")
