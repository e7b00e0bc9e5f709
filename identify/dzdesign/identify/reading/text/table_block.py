"""A block of a table of text: its columns as numbers, as times, and as they stand in the file."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, Table, clean_label
from dzdesign.identify.reading.text.decimal_marks import BETWEEN_THOUSANDS, FEW_ROWS, DecimalMarks
from dzdesign.identify.reading.time_stamps import EXAMPLE, Stamps, is_stamp, is_unclear

if TYPE_CHECKING:
    import polars as pl

#: A cell with a date.
DATE = re.compile(r"\d[-/.:]\d+[-/.:]\d")
#: Characters of a row whose first cells are looked at; of longer rows fewer are.
LONGEST_ROW = 256


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TextTable(Table):
    """A table of text: every column as strings or as numbers, and where it stands in the file.

    Attributes
    ----------
    cells : DataFrame
        A column is of numbers only where each of its cells is one, or blank.
    header_line : int
        Number of the header's line.
    lines : sequence of int
        Numbers of the rows' lines.
    plain : bytes
        The rows as they stand in the file, where they were read without a look at each.
    separator : str
        Between two cells.
    marks : DecimalMarks
        Of the file.
    """

    cells: "pl.DataFrame"
    header_line: int
    lines: Sequence[int]
    plain: bytes
    separator: str
    marks: DecimalMarks

    @property
    def header(self) -> str:
        """Where the labels stand."""
        return f" row {self.header_line}"

    def length(self, label: str) -> int:
        """Return how many rows this table has, whatever the column."""
        return self.cells.height

    def place(self, row: int) -> str:
        """Return ``row 8``, as an editor counts."""
        return f"row {self.lines[row]}"

    def cell(self, label: str, row: int) -> str:
        """Return a cell as it stands in the file."""
        if self.plain:
            line = self.plain.split(b"\n")[row].decode()
            return clean_label(line.split(self.separator)[self.labels.index(label)])
        return self._texts(label)[row]

    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64, NaN where the cell is blank."""
        import polars as pl

        numbers = self.cells.to_series(self.labels.index(label))
        if numbers.dtype == pl.Float64 and not (self.marks.has_commas(label) and b"." in self.plain):
            read = numbers.fill_null(np.nan).to_numpy().copy()
            first, one = partial(self._first_cells, label), partial(self.cell, label)
            self.marks.see_points(label, read, first, one, self.place)
            return read
        texts = self._texts(label)
        column = self.marks.with_points(label, texts, self.place)
        numbers = column.cast(pl.Float64, strict=False)
        filled = ~(column.is_null() | (column == ""))
        if (filled & numbers.is_null()).any():
            numbers = numbers.fill_null(_plainly_written(column).cast(pl.Float64, strict=False))
        bad = (filled & numbers.is_null()).arg_true()
        if len(bad):
            raise self._no_number(label, int(bad[0]), texts[int(bad[0])])
        return numbers.fill_null(np.nan).to_numpy().copy()

    def is_clock(self, label: str) -> bool:
        """Tell whether the first cell of a column that is not blank holds a time of day."""
        import polars as pl

        if self.cells.to_series(self.labels.index(label)).dtype == pl.Float64:
            return False
        cell = self._first(label)
        if is_unclear(cell):
            raise InputError(
                f"'{self.path}' column '{label}': '{cell}' may be hours and minutes, minutes and seconds or a date, "
                f"expected seconds as a number, or a time such as {EXAMPLE}"
            )
        return is_stamp(cell)

    def seconds(self, label: str, stamps: Stamps) -> np.ndarray:
        """Return a column of dates or times of day as seconds since the first row of the file."""
        texts = self._texts(label)
        seconds = stamps.seconds(texts, f"'{self.path}' column '{label}'")
        bad = np.flatnonzero((~(texts.is_null() | (texts == ""))).to_numpy() & np.isnan(seconds))
        if bad.size:
            row = int(bad[0])
            raise InputError(
                f"'{self.path}' {self.place(row)}, column '{label}': '{texts[row][:QUOTED_CHARACTERS]}' is no time, "
                f"expected one such as {EXAMPLE}, as above; correct it, or leave the cell blank if it is missing"
            )
        return seconds

    def _first(self, label: str) -> str:
        texts = self._texts(label)
        filled = texts.filter(texts.is_not_null() & (texts != ""))
        return filled[0] if len(filled) else ""

    def _texts(self, label: str) -> "pl.Series":
        import polars as pl

        index = self.labels.index(label)
        column = self.cells.to_series(index)
        if column.dtype == pl.Float64:  # its cells as they stand in the file
            names = [f"c{number}" for number in range(len(self.labels))]
            schema = dict.fromkeys(names, pl.String)
            column = pl.read_csv(
                self.plain, separator=self.separator, has_header=False, schema=schema, columns=[index], quote_char=None
            ).to_series()
        return column.str.strip_chars(' \t"')

    def _first_cells(self, label: str) -> "pl.Series":
        import polars as pl

        index = self.labels.index(label)
        lines = self.plain[: FEW_ROWS * LONGEST_ROW].split(b"\n", FEW_ROWS)[:FEW_ROWS]
        cells = [line.decode(errors="replace").split(self.separator) for line in lines]
        return pl.Series([clean_label(row[index]) for row in cells if len(row) == len(self.labels)], dtype=pl.String)

    def _no_number(self, label: str, row: int, cell: str) -> InputError:
        date = f" (a column of the time may hold stamps such as {EXAMPLE})" if DATE.search(cell) else ""
        return InputError(
            f"'{self.path}' {self.place(row)}, column '{label}': '{cell[:QUOTED_CHARACTERS]}' is not a "
            f"number{date}; correct it, or leave the cell blank if the sample is missing"
        )


def _plainly_written(numbers: "pl.Series") -> "pl.Series":
    """Return numbers with a decimal point without blanks behind a sign or between thousands, and with a plain minus."""
    signed = numbers.str.replace("^\u2212", "-").str.replace(r"^([-+])\s", "${1}")
    grouped = signed.str.contains(rf"^[-+]?\d{{1,3}}(?:[{BETWEEN_THOUSANDS}]\d{{3}})+(?:\.\d*)?$").fill_null(False)
    return signed.str.replace_all(f"[{BETWEEN_THOUSANDS}]", "").zip_with(grouped, signed)
