"""Text tables: CSV of any delimiter, plain or gzip, with decimal point or comma; an open file in, `TextTable`s out.

A file is read block by block, see `text_blocks`: one longer than memory is a table like any other. Rows that all look
alike are read at once; where one does not, each line of its block is looked at.
"""

import logging
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.decimal_marks import FEW_ROWS, DecimalMarks
from dzdesign.identify.table import QUOTED_CHARACTERS, Table, clean_label
from dzdesign.identify.text_blocks import text_blocks
from dzdesign.identify.text_header import (
    BLANKS,
    LONGEST_HEADER,
    LONGEST_LINE,
    MOST_LINES,
    NO_VALUE,
    TABLE_LINE,
    Header,
    find_header,
    is_number,
    split_line,
)
from dzdesign.identify.time_stamps import EXAMPLE, Stamps, is_stamp, is_unclear

if TYPE_CHECKING:
    import polars as pl

#: The number of a line in its file (1 is the first), and the line.
Lines = list[tuple[int, str]]

#: Joins the cells of a line inside: no cell of a text file holds it.
CELL_END = "\x1f"
#: What a row of numbers may begin with.
NUMERIC = "0123456789+-."
#: A cell with a date.
DATE = re.compile(r"\d[-/.:]\d+[-/.:]\d")
#: Characters of a row whose first cells are looked at; of longer rows fewer are.
LONGEST_ROW = 256
logger = logging.getLogger(__name__)


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
            self.marks.see_points(label, read, lambda: self._first_cells(label), self.place)
            return read
        texts = self._texts(label)
        column = self.marks.with_points(label, texts, self.place)
        numbers = column.cast(pl.Float64, strict=False)
        bad = (~(column.is_null() | (column == "")) & numbers.is_null()).arg_true()
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


def text_tables(file: BinaryIO, path: Path, skip_rows: int | None = None) -> Iterator[TextTable]:
    """Read a table of text, block by block.

    Parameters
    ----------
    file : binary file
        UTF-8, UTF-16 with a byte order mark or Windows-1252, plain or gzip: a header row, then samples; lines that
        start with ``#`` are comments. Cells are parted by comma, semicolon, tab or ``|``, or by blanks where the
        header has none of these. What a logger writes above the header and below the samples is passed over.
    path : Path
        For messages.
    skip_rows : int, optional
        Lines of the file that stand above the header. None: the header is found.

    Raises
    ------
    InputError
        If it is no such text, or a row has not as many cells as the header.
    """
    header, number, foot, above = None, 1, _Foot(path), b""
    marks = DecimalMarks(path)
    for block in text_blocks(file, path):
        whole = block
        skipped = _end_of_lines(block, (skip_rows or 0) + 1 - number)
        number += _count(block[:skipped], "\n")
        block = block[skipped:]
        if header is None:
            header, rows = find_header(block, number, path, told=skip_rows is not None)
            if header is None and len(block) >= LONGEST_HEADER:
                raise InputError(
                    f"'{path}' begins with {len(block)} bytes of comments and blank lines; expected a header row such "
                    "as time_s,u_V,dP_MPa,Q_Lmin near its beginning"
                )
            above += whole[: len(whole) - len(rows)]
            if header is not None and skip_rows is None:
                _tell(header, block, number, path)
        else:
            rows = block
        if header is not None:
            first = number + block.count(b"\n", 0, len(block) - len(rows))
            yield _table(rows, first, header, foot, marks, above.decode())
        number += _count(block, "\n")
    if header is None:
        below = f" below its first {skip_rows} rows (--skip-rows)" if skip_rows else ""
        raise InputError(
            f"'{path}' is empty{below}; expected a header row such as time_s,u_V,dP_MPa,Q_Lmin and samples"
        )


def _end_of_lines(block: bytes, count: int) -> int:
    """Return where the first `count` lines of a block end."""
    end = 0
    for _ in range(max(count, 0)):
        end = block.find(b"\n", end) + 1
        if not end:
            return len(block)
    return end


def _tell(header: Header, block: bytes, number: int, path: Path) -> None:
    """Log where the header was found, where something stands above it, and its units, where they stand below it."""
    first = TABLE_LINE.search(block)
    if first is not None and number + block.count(b"\n", 0, first.start()) < header.line:
        logger.debug("'%s': the header was found in row %d; what stands above it is passed over", path, header.line)
    if header.units:
        logger.debug("'%s': the row below the header says units: %s", path, ", ".join(header.units.values()))


@final
class _Foot:
    """What a logger writes below the samples: lines of text, after which no sample may follow."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._error: InputError | None = None
        self._count = 0

    def add(self, number: int, cells: Sequence[str], header: Header) -> None:
        """Take a line of text."""
        logger.debug("'%s' row %d is passed over: %s", self.path, number, " ".join(cells)[:QUOTED_CHARACTERS])
        self._error = self._error or _wrong_row(cells, number, header, self.path)
        self._count += 1
        if self._count > MOST_LINES:
            self.refuse_what_follows()

    def refuse_what_follows(self) -> None:
        """Refuse samples below lines of text."""
        if self._error is not None:
            raise self._error


def _table(
    rows: bytes, number: int, header: Header, foot: _Foot, marks: DecimalMarks, above: str
) -> TextTable:
    """Return the table of rows; `number` is that of their first line in the file, `above` what stands over them all."""
    if b"#" in rows and header.separator != BLANKS:
        rows = NO_VALUE.sub(rb"\1", rows)
    cells = None if _has_other_lines(rows, header) else _plain_cells(rows, header.separator, len(header.labels))
    if cells is not None:
        foot.refuse_what_follows()
        lines: Sequence[int] = range(number, number + cells.height)
    else:
        kept = _table_lines(rows.decode(), number, header)
        cells, numbers = _read_cells(kept, header, foot)
        lines, rows = numbers, b""
    return TextTable(
        path=foot.path,
        labels=header.labels,
        units=header.units,
        comments=above,
        cells=cells,
        header_line=header.line,
        lines=lines,
        plain=rows,
        separator=header.separator,
        marks=marks,
    )


def _has_other_lines(rows: bytes, header: Header) -> bool:
    """Tell whether the header stands among rows once more, or a line of text at their end."""
    last = rows[-LONGEST_LINE:].rstrip(b"\n").rpartition(b"\n")[2].decode(errors="replace")
    return _is_text(last.split(header.separator)) or any(line.encode() in rows for line in header.repeats)


def _is_text(cells: list[str]) -> bool:
    """Tell whether a row is a word of the logger: nothing but text in its first cell."""
    filled = [bare for cell in cells if (bare := clean_label(cell))]
    return len(filled) == 1 and bool(clean_label(cells[0])) and not is_number(filled[0])


def _plain_cells(rows: bytes, separator: str, width: int) -> "pl.DataFrame | None":
    """Return the cells of rows that all have as many as the header, without a look at each; None if one has not."""
    import polars as pl

    rows = rows.rstrip(b"\n")
    if separator == BLANKS or not rows or width < 2 or b"#" in rows or b'"' in rows:
        return None
    height = _count(rows, "\n") + 1
    if _count(rows, separator) != (width - 1) * height:
        return None
    # A column whose first cell is a number holds numbers, unless reading it as such fails.
    first = rows.split(b"\n", 1)[0].decode().split(separator)
    numbers = {f"c{index}": pl.Float64 if _is_number(cell) else pl.String for index, cell in enumerate(first)}
    for schema in (numbers, dict.fromkeys(numbers, pl.String)) if len(first) == width else ():
        try:
            cells = pl.read_csv(rows, separator=separator, has_header=False, schema=schema, quote_char=None)
        except pl.exceptions.PolarsError:  # a cell is no number, or a row has too many cells
            continue
        # As many cells in all, and no row with too many: none has too few. A blank one at the end may be one too many.
        exact = not cells.to_series(-1).null_count() or _every_row_has(rows, separator, width)
        return cells if cells.height == height and exact else None
    return None


def _count(data: bytes, character: str) -> int:
    # bytes.count stops at every one of them, and takes several times as long.
    return int(np.count_nonzero(np.frombuffer(data, np.uint8) == ord(character)))


def _is_number(cell: str) -> bool:
    return re.fullmatch(r"\s*[-+]?[\d.]+([eE][-+]?\d+)?", cell) is not None


def _every_row_has(rows: bytes, separator: str, width: int) -> bool:
    characters = np.frombuffer(rows, np.uint8)
    starts = np.concatenate([[0], np.flatnonzero(characters == ord("\n")) + 1])
    return not np.any(np.add.reduceat(characters == ord(separator), starts, dtype=np.int32) != width - 1)


def _table_lines(text: str, first: int, header: Header) -> Lines:
    """Return every line that is neither comment, blank nor the header again; `first` is the number of the first line.

    A spreadsheet that has saved a file again leaves comments in quotes, and blank lines as a row of separators.
    """
    return [
        (number, line)
        for number, line in enumerate(text.split("\n"), start=first)
        if line.strip(' \t,;"') and not line.lstrip(' \t"').startswith("#") and line not in header.repeats
    ]


def _read_cells(lines: Lines, header: Header, foot: _Foot) -> tuple["pl.DataFrame", list[int]]:
    """Return all cells as strings, and their rows' numbers: numbers are read column by column, to name a wrong row."""
    import polars as pl

    separator, width = header.separator, len(header.labels)
    table, numbers = [CELL_END.join(f"c{index}" for index in range(width))], []
    for number, line in lines:
        if line[0] in NUMERIC and '"' not in line and separator != BLANKS and line.count(separator) == width - 1:
            text = line.replace(separator, CELL_END)
        else:
            cells = split_line(line, separator, number, foot.path)
            if len(cells) != width or _is_text(cells):
                if is_number(clean_label(cells[0])):
                    raise _wrong_row(cells, number, header, foot.path)
                foot.add(number, cells, header)
                continue
            text = CELL_END.join(cells)
        foot.refuse_what_follows()
        table.append(text)
        numbers.append(number)
    try:
        return (
            pl.read_csv("\n".join(table).encode(), separator=CELL_END, infer_schema=False, quote_char=None),
            numbers,
        )
    except pl.exceptions.PolarsError as error:
        raise InputError(f"'{foot.path}' can't be read as a table: {str(error).splitlines()[0]}") from error


def _wrong_row(cells: Sequence[str], number: int, header: Header, path: Path) -> InputError:
    """Return the error for a row that has too many or too few cells, or is a word of the logger."""
    width = len(header.labels)
    comma = header.separator == "," and len(cells) == 2 * width
    hint = "; decimal commas need ';' or a tab between the cells" if comma else ""
    one = f"one cell that is filled, '{cells[0][:QUOTED_CHARACTERS]}'"
    found = f"{len(cells)} cells" if len(cells) != width else one
    return InputError(
        f"'{path}' row {number} has {found}, expected {width} as in the header, row {header.line} "
        f"('{', '.join(header.labels)[:QUOTED_CHARACTERS]}'){hint}; correct the row, or begin it with # if it is no "
        "sample; --skip-rows says how many rows stand above the header"
    )
