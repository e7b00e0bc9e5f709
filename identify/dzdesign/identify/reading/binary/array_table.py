"""A table of a binary file: its columns as arrays."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.binary.file_format import NO_NUMBERS_UNIT, FileFormat
from dzdesign.identify.reading.binary.reader_process import list_columns, read_columns
from dzdesign.identify.reading.binary.reader_server import ListedColumn
from dzdesign.identify.reading.table import Table, numbered
from dzdesign.identify.reading.time_stamps import Start, start_of


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ArrayTable(Table):
    """A table whose columns are arrays.

    Attributes
    ----------
    file : binary file
        Open as long as columns are loaded.
    file_format : FileFormat
        Of the file.
    columns : mapping
        Label -> number of the column in the file, and what the file says of it.
    """

    file: BinaryIO
    file_format: FileFormat
    columns: Mapping[str, tuple[int, ListedColumn]]
    _loaded: dict[str, np.ndarray] = field(default_factory=dict)

    def load(self, labels: Collection[str]) -> None:
        """Read columns at once."""
        numbers = [self.columns[label][0] for label in labels]
        arrays = read_columns(self.file, self.path, self.file_format.name, numbers)
        self._loaded.update(zip(labels, arrays, strict=True))

    def length(self, label: str) -> int:
        """Return how many samples a column has."""
        return self.columns[label][1].size

    def group(self, label: str) -> str:
        """Return the group of a column, which its label may lack."""
        return self.columns[label][1].group

    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64."""
        if label not in self._loaded:
            self.load([label])
        return self._loaded.pop(label)

    def started(self, label: str) -> Start | None:
        """Return the date and time at which a column of time counts zero, where the file states them."""
        return start_of(self.columns[label][1].start)

    def found_labels(self) -> str:
        """Return the labels for a message, and what to do about what could not be read."""
        return Table.found_labels(self) + (self.file_format.hint if NO_NUMBERS_UNIT in self.units.values() else "")

    def place(self, row: int) -> str:
        """Return ``sample 8``: such files have no rows that an editor would count."""
        return f"sample {row + 1}"


def read_binary_table(file: BinaryIO, path: Path, file_format: FileFormat) -> ArrayTable:
    """Read a table of a binary format.

    Raises
    ------
    InputError
        If the file is not a whole one of that format, or holds no columns of numbers.
    """
    found = list_columns(file, path, file_format.name)
    if not found:
        raise InputError(
            f"'{path}' ({file_format.name}) holds no columns of numbers; "
            f"expected one vector per quantity, such as u_V{file_format.hint}"
        )
    labels = _unique_labels(found)
    return ArrayTable(
        path=path,
        labels=labels,
        units={label: column.unit for label, column in zip(labels, found, strict=True) if column.unit},
        clocks={label: labels[each.clock] for label, each in zip(labels, found, strict=True) if each.clock >= 0},
        file=file,
        file_format=file_format,
        columns={label: (number, column) for number, (label, column) in enumerate(zip(labels, found, strict=True))},
    )


def _unique_labels(found: Sequence[ListedColumn]) -> tuple[str, ...]:
    """Return a label for each column: its name, and before it its group where another group has that name too."""
    names = Counter(column.name for column in found)
    groups = [f"{column.group}/" if column.group and names[column.name] > 1 else "" for column in found]
    return numbered([group + column.name for group, column in zip(groups, found, strict=True)])
