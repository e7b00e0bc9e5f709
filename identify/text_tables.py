"""Text tables: CSV of any delimiter, plain or gzip, with decimal point or comma; an open file in, `TextTable`s out.

A file is read `BLOCK_BYTES` at a time, cut at an end of line: one longer than memory is a table like any other.
"""

import csv
import gzip
import os
import re
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.table import QUOTED_CHARACTERS, Table

if TYPE_CHECKING:
    import polars as pl

#: The number of a line in its file (1 is the first), and the line.
Lines = list[tuple[int, str]]

#: Bytes of text that are read at a time.
BLOCK_BYTES = 1 << 23
#: A recording has some ten columns; a header beyond this is no table, and would take minutes to be searched.
MOST_COLUMNS, LONGEST_HEADER = 4096, 1 << 20
#: A gzip file that holds more than this many times its bytes, and `FREE_BYTES`, is made to fill a memory or a day:
#: of a recording, whose clock runs and whose meter is noisy, some five to fifteen times are usual.
LARGEST_RATIO, FREE_BYTES = 64, 1 << 26
#: A line that is neither a comment nor blank; what a spreadsheet makes of either has quotes or separators.
TABLE_LINE = re.compile(rb'^(?![ \t,;"]*$)(?![ \t"]*#).+', re.MULTILINE)
#: Joins the cells of a line inside: no cell of a text file holds it.
CELL_END = "\x1f"
#: A cell with a date or a time of day.
DATE = re.compile(r"\d[-/.:]\d+[-/.:]\d")
#: What may stand between cells; where none of them is in the header, blanks do.
SEPARATORS, BLANKS = ",;\t|", " "


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """The header row: its number in the file, the labels, what stands between two cells, and the lines above it."""

    line: int
    labels: tuple[str, ...]
    separator: str
    comments: str


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
    """

    cells: "pl.DataFrame"
    header_line: int
    lines: Sequence[int]
    plain: bytes
    separator: str

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
        if numbers.dtype != pl.Float64:
            column = self._texts(label)
            numbers = column.cast(pl.Float64, strict=False)
            bad = (~(column.is_null() | (column == "")) & numbers.is_null()).arg_true()
            if len(bad):
                row = int(bad[0])
                date = " (the time has to be in seconds, not a date)" if DATE.search(column[row]) else ""
                raise InputError(
                    f"'{self.path}' {self.place(row)}, column '{label}': '{column[row][:QUOTED_CHARACTERS]}' is not a "
                    f"number{date}; correct it, or leave the cell blank if the sample is missing"
                )
        return numbers.fill_null(np.nan).to_numpy().copy()

    def _texts(self, label: str) -> "pl.Series":
        column = self.cells.to_series(self.labels.index(label)).str.strip_chars(' \t"')
        # A decimal comma can only stand where the comma does not separate the cells.
        return column.str.replace(",", ".", literal=True)


def text_tables(file: BinaryIO, path: Path) -> Iterator[TextTable]:
    """Read a table of text, block by block.

    Parameters
    ----------
    file : binary file
        UTF-8, plain or gzip: a header row, then samples; lines that start with ``#`` are comments. Cells are parted
        by comma, semicolon, tab or ``|``, or by blanks where the header has none of these.
    path : Path
        For messages.

    Raises
    ------
    InputError
        If it is no such text, or a row has not as many cells as the header.
    """
    header, number = None, 1
    for block in _blocks(file, path):
        if header is None:
            header, rows = _find_header(block, number, path)
            if header is None and len(block) >= LONGEST_HEADER:
                raise InputError(
                    f"'{path}' begins with {len(block)} bytes of comments and blank lines; expected a header row such "
                    "as time_s,u_V,dP_MPa,Q_Lmin near its beginning"
                )
        else:
            rows = block
        if header is not None:
            first = number + block.count(b"\n", 0, len(block) - len(rows))
            yield _table(rows, first, header, path)
        number += _count(block, "\n")
    if header is None:
        raise InputError(f"'{path}' is empty; expected a header row such as time_s,u_V,dP_MPa,Q_Lmin and samples")


def _blocks(file: BinaryIO, path: Path) -> Iterator[bytes]:
    """Return whole lines that end in a line feed, some `BLOCK_BYTES` at a time, without a byte order mark."""
    packed = file.read(2) == b"\x1f\x8b"
    file.seek(0)
    stream = gzip.GzipFile(fileobj=file) if packed else file
    most = FREE_BYTES + LARGEST_RATIO * _size(file) if packed else None
    rest, offset = b"", 0
    while True:
        try:
            data = stream.read(BLOCK_BYTES)
        except (gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise InputError(f"'{path}' is not a whole gzip file ({error}); copy it again") from error
        if most is not None and offset + len(rest) + len(data) > most:
            raise InputError(
                f"'{path}' unpacks to more than {LARGEST_RATIO} times its size, as no recording does; give the "
                "recording itself, not packed"
            )
        block, last = rest + data, len(data) < BLOCK_BYTES
        # The last end of line may be half of one: a carriage return whose line feed is still to come.
        end = len(block) if last else max(block.rfind(b"\n"), block.rfind(b"\r", 0, -1)) + 1
        _refuse_no_text(block[:end] if end else block, offset, path)
        if not end and not last:
            raise InputError(f"'{path}' has a line of more than {len(block)} bytes; expected a table of numbers")
        bare = block[:end] if offset else block[:end].removeprefix(b"\xef\xbb\xbf")
        # Not splitlines(): to an editor, whose line numbers the messages give, a form feed or U+0085 ends no line.
        yield bare.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in bare else bare
        if last:
            return
        rest, offset = block[end:], offset + end


def _size(file: BinaryIO) -> int:
    """Return how many bytes a file has, and go back to its beginning."""
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    return size


def _refuse_no_text(data: bytes, offset: int, path: Path) -> None:
    """Refuse what is no text in UTF-8; `offset` bytes stand before it in the file."""
    if not offset and data.startswith(b"PK"):
        raise InputError(f"'{path}' is an Excel workbook or a zip archive; save the table as 'CSV UTF-8'")
    try:
        if not data.isascii():
            data.decode()
    except UnicodeDecodeError as error:
        raise InputError(
            f"'{path}' is not a text file in UTF-8 (byte {offset + error.start + 1}); save the table as 'CSV UTF-8'"
        ) from error
    if b"\0" in data:
        raise InputError(f"'{path}' is UTF-16 or no text at all, expected UTF-8; save the table as 'CSV UTF-8'")


def _find_header(block: bytes, number: int, path: Path) -> tuple[Header | None, bytes]:
    """Return the first line that is neither a comment nor blank, read as the header, and what follows it."""
    found = TABLE_LINE.search(block)
    if found is None:
        return None, b""
    number += block.count(b"\n", 0, found.start())
    header = _header(number, found[0].decode(), path, comments=block[: found.start()].decode())
    return header, block[found.end() + 1 :]


def _header(number: int, line: str, path: Path, comments: str) -> Header:
    """Return the header that a line holds; refuse a line of numbers."""
    separator = max(SEPARATORS, key=line.count)
    separator = separator if separator in line else BLANKS
    columns = len(line.split()) if separator == BLANKS else line.count(separator) + 1
    if columns > MOST_COLUMNS or len(line) > LONGEST_HEADER:
        raise InputError(
            f"'{path}' row {number} has {columns} cells, expected the columns of a ramp test, at most {MOST_COLUMNS}; "
            "export only those"
        )
    labels = tuple(clean_label(label) for label in _labels(line, separator, number, path))
    if all(re.fullmatch(r"[-+\d.,eE\s]*", label) for label in labels):
        raise InputError(
            f"'{path}' has no header row (row {number} is '{line[:QUOTED_CHARACTERS]}'); "
            "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
        )
    return Header(line=number, labels=labels, separator=separator, comments=comments)


def _table(rows: bytes, number: int, header: Header, path: Path) -> TextTable:
    """Return the table of rows; `number` is that of their first line in the file."""
    cells = _plain_cells(rows, header.separator, len(header.labels))
    if cells is not None:
        lines: Sequence[int] = range(number, number + cells.height)
    else:
        kept = _table_lines(rows.decode(), number)
        cells = _read_cells(kept, header, path)
        lines, rows = [number for number, _ in kept], b""
    return TextTable(
        path=path,
        labels=header.labels,
        comments=header.comments,
        cells=cells,
        header_line=header.line,
        lines=lines,
        plain=rows,
        separator=header.separator,
    )


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


def _table_lines(text: str, first: int) -> Lines:
    """Return every line that is neither a comment nor blank; `first` is the number of the first line.

    A spreadsheet that has saved a file again leaves comments in quotes, and blank lines as a row of separators.
    """
    return [
        (number, line)
        for number, line in enumerate(text.split("\n"), start=first)
        if line.strip(' \t,;"') and not line.lstrip(' \t"').startswith("#")
    ]


def clean_label(label: str) -> str:
    """Return a column's label without the blanks and quotes around it."""
    return label.strip(' \t"')


def _labels(header: str, separator: str, number: int, path: Path) -> list[str]:
    """Return the labels of the header; between blanks, a unit in brackets belongs to the label before it."""
    if separator == BLANKS:
        # Of a bracket that is never closed only so much is looked at: a long header of them would take hours.
        return re.findall(r"[^\s\[(]+(?:\s{0,40}[\[(][^\])]{0,80}[\])])?", header)
    return _split(header, separator, number, path)


def _split(line: str, separator: str, number: int, path: Path) -> list[str]:
    """Return the cells of a line; inside quotes the separator is a character as any other."""
    if separator == BLANKS:
        return line.split()
    if '"' not in line:
        return line.split(separator)
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:  # a cell longer than 128 KiB, as after a quote that is never closed
        raise InputError(f"'{path}' row {number} has a cell that can't be read ({error}); mind its quotes") from error


def _read_cells(lines: Lines, header: Header, path: Path) -> "pl.DataFrame":
    """Return all cells as strings: numbers are read column by column, so that an error can name its row."""
    import polars as pl

    separator, width = header.separator, len(header.labels)
    table = [CELL_END.join(f"c{index}" for index in range(width))]
    for number, line in lines:
        cells = _split(line, separator, number, path) if '"' in line or separator == BLANKS else None
        count = line.count(separator) + 1 if cells is None else len(cells)
        if count != width:
            comma = separator == "," and count == 2 * width
            hint = "; decimal commas need ';' or a tab between the cells" if comma else ""
            raise InputError(
                f"'{path}' row {number} has {count} cells, expected {width} as in the header, row {header.line} "
                f"('{', '.join(header.labels)[:QUOTED_CHARACTERS]}'){hint}; correct the row, or begin rows that stand "
                "above the header with #"
            )
        table.append(line.replace(separator, CELL_END) if cells is None else CELL_END.join(cells))
    try:
        return pl.read_csv("\n".join(table).encode(), separator=CELL_END, infer_schema=False, quote_char=None)
    except pl.exceptions.PolarsError as error:
        raise InputError(f"'{path}' can't be read as a table: {str(error).splitlines()[0]}") from error
