"""Text tables: CSV of any delimiter, plain or gzip, with decimal point or comma; an open file in, `TextTable`s out.

A file is read block by block, see `text_blocks`: one longer than memory is a table like any other. Rows that all look
alike are read at once; where one does not, each line of its block is looked at.
"""

import logging
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.text.blocks import text_blocks
from dzdesign.identify.reading.text.cells import BLANKS, split_line
from dzdesign.identify.reading.text.decimal_marks import DecimalMarks
from dzdesign.identify.reading.text.footer import Foot, is_no_sample
from dzdesign.identify.reading.text.header import (
    LONGEST_HEADER,
    LONGEST_LINE,
    NO_VALUE,
    TABLE_LINE,
    Header,
    find_header,
)
from dzdesign.identify.reading.text.table_block import TextTable

if TYPE_CHECKING:
    import polars as pl

#: The number of a line in its file (1 is the first), and the line.
Lines = list[tuple[int, str]]

#: Joins the cells of a line inside: no cell of a text file holds it.
CELL_END = "\x1f"
#: What a row of numbers may begin with.
NUMERIC = "0123456789+-."
logger = logging.getLogger(__name__)


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
    header, number, foot, above = None, 1, Foot(path), b""
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


def _table(
    rows: bytes, number: int, header: Header, foot: Foot, marks: DecimalMarks, above: str
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
    """Tell whether the header stands among rows once more, or a line of text at their beginning or end."""
    first = rows[:LONGEST_LINE].lstrip(b"\n").partition(b"\n")[0].decode(errors="replace")
    last = rows[-LONGEST_LINE:].rstrip(b"\n\t ,;|").rpartition(b"\n")[2].decode(errors="replace")
    ends = (line.split(header.separator) for line in (first, last))
    return any(map(is_no_sample, ends)) or any(line.encode() in rows for line in header.repeats)


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


def _read_cells(lines: Lines, header: Header, foot: Foot) -> tuple["pl.DataFrame", list[int]]:
    """Return all cells as strings, and their rows' numbers: numbers are read column by column, to name a wrong row."""
    import polars as pl

    separator, width = header.separator, len(header.labels)
    table, numbers = [CELL_END.join(f"c{index}" for index in range(width))], []
    for number, line in lines:
        if line[0] in NUMERIC and '"' not in line and separator != BLANKS and line.count(separator) == width - 1:
            text = line.replace(separator, CELL_END)
        else:
            cells = split_line(line, separator, number, foot.path)
            if len(cells) != width or is_no_sample(cells):
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
