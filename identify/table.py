"""A table as recorded: labelled columns of numbers, from whatever file; what the readers give to `ramp_files`."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import final

import numpy as np

from dzdesign.core.errors import InputError, nearest

#: Characters of a cell, and columns of a file, that a message quotes.
QUOTED_CHARACTERS, QUOTED_COLUMNS = 40, 12


@dataclass(frozen=True, slots=True, kw_only=True)
class Table(ABC):
    """Labelled columns.

    Attributes
    ----------
    path : Path
        The file, for messages.
    labels : tuple of str
        In the order of the file; one may repeat.
    units : mapping
        Label -> unit, where the file states it beside the label and not in it.
    """

    path: Path
    labels: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=dict)

    @abstractmethod
    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64, NaN where a sample is missing; InputError where a cell is no number."""

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

    def found(self) -> str:
        """Return the labels for a message, the first `QUOTED_COLUMNS` of them."""
        labels = ", ".join(label[:QUOTED_CHARACTERS] for label in self.labels[:QUOTED_COLUMNS])
        return labels + (", ..." if len(self.labels) > QUOTED_COLUMNS else "")

    def no_column(self, label: str, wanted_by: str) -> InputError:
        """Return the error for a label that is none of the table's, with the nearest one."""
        return InputError(
            f"'{self.path}' has no column '{label}', which {wanted_by} (columns found: {self.found()})"
            f"{nearest(label, self.labels)}; write the label as it stands in the file"
        )


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ArrayTable(Table):
    """A table whose columns came as arrays: from TDMS, MAT, HDF5, Parquet, Feather.

    Attributes
    ----------
    arrays : mapping
        Label -> (N,) array.
    """

    arrays: Mapping[str, np.ndarray]

    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64."""
        array = np.asarray(self.arrays[label])
        if array.dtype.kind not in "fiub":
            raise InputError(
                f"'{self.path}' column '{label}' holds no numbers (first: '{str(array[:1])[:QUOTED_CHARACTERS]}'); "
                "give another column by --columns, or save it as numbers"
            )
        return array.astype(np.float64)

    def place(self, row: int) -> str:
        """Return ``sample 8``: such files have no rows that an editor would count."""
        return f"sample {row + 1}"
