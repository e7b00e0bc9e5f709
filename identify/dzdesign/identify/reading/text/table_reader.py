"""Text tables: CSV of any delimiter, plain or gzip, with decimal point or comma; an open file in, a `TextTable` out.

Rows that all look alike are taken as they are; where one does not, each line of its piece of the file is looked at.
"""

import logging
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.text.cells import BLANKS, split_line
from dzdesign.identify.reading.text.decimal_marks import DecimalMarks
from dzdesign.identify.reading.text.encoding import read_text
from dzdesign.identify.reading.text.footer import Footer, is_no_sample
from dzdesign.identify.reading.text.header import COMMENT_LINE, COMMENTS, TABLE_LINE, Header, find_header
from dzdesign.identify.reading.text.header_search import LONGEST_HEADER, LONGEST_LINE
from dzdesign.identify.reading.text.logger_blocks import with_stated_times, without_blocks
from dzdesign.identify.reading.text.text_table import TextTable

#: The number of a line in its file (1 is the first), and the line.
Lines = list[tuple[int, str]]

#: Joins the cells of a line that was looked at: no cell of a text file holds it.
CELL_END = "\x1f"
#: What a row of numbers may begin with.
NUMERIC = "0123456789+-."
#: Bytes of a piece of a file, and of the longest line of one.
PIECE_BYTES = 1 << 23
logger = logging.getLogger(__name__)


def read_text_table(
    file: BinaryIO, path: Path, skip_rows: int | None = None, missing: Collection[str] = ()
) -> TextTable:
    """Read a table of text.

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
    missing : collection of str
        What stands for no value, beside what `missing_values` knows.

    Raises
    ------
    InputError
        If it is no such text, or a row has not as many cells as the header.
    """
    text = read_text(file, path)
    skipped = text[: _end_of_lines(text, skip_rows or 0)]
    number = 1 + skipped.count(b"\n")
    text = text[len(skipped) :]
    _refuse_a_long_line(text, path)
    text, segments, has_blocks = without_blocks(text, path)
    found = find_header(text, number, path, at_first_line=has_blocks or skip_rows is not None)
    if found is None:
        raise _no_header(path, len(text), skip_rows)
    header, start = found
    if skip_rows is None:
        _log_header(header, text, number, path)
    above, rows = text[:start], text[start : _end_of_samples(text)]
    del text  # it is in memory once
    number += above.count(b"\n")
    rows, separator, lines = _rows_alike(rows, number, header, path)
    table = TextTable(
        path=path,
        labels=header.labels,
        units=header.units,
        comments=(skipped + above).decode(),
        rows=rows,
        separator=separator,
        header_line=header.line,
        lines=lines,
        marks=DecimalMarks(path),
        missing=missing,
    )
    return with_stated_times(table, segments)


def _end_of_lines(text: bytes, count: int) -> int:
    """Return where the first `count` lines of a text end."""
    end = 0
    for _ in range(count):
        end = text.find(b"\n", end) + 1
        if not end:
            return len(text)
    return end


def _end_of_samples(text: bytes) -> int:
    """Return where a text ends but for blank lines; bytes.rstrip would copy all of it."""
    end = len(text)
    while end and text[end - 1] == ord("\n"):
        end -= 1
    return end


def _refuse_a_long_line(text: bytes, path: Path) -> None:
    """Refuse a line that no table has, before anything takes a minute for it."""
    start = 0
    while start + PIECE_BYTES < len(text):
        end = text.rfind(b"\n", start, start + PIECE_BYTES) + 1
        if not end:
            raise InputError(f"'{path}' has a line of more than {PIECE_BYTES} bytes; expected a table of numbers")
        start = end


def _no_header(path: Path, size: int, skip_rows: int | None) -> InputError:
    if size >= LONGEST_HEADER:
        return InputError(
            f"'{path}' begins with {size} bytes of comments and blank lines; expected a header row such "
            "as time_s,u_V,dP_MPa,Q_Lmin near its beginning"
        )
    below = f" below its first {skip_rows} rows (--skip-rows)" if skip_rows else ""
    return InputError(f"'{path}' is empty{below}; expected a header row such as time_s,u_V,dP_MPa,Q_Lmin and samples")


def _log_header(header: Header, text: bytes, number: int, path: Path) -> None:
    """Log where the header was found, where something stands above it, and its units, where they stand below it."""
    first = TABLE_LINE.search(text)
    if first is not None and number + text.count(b"\n", 0, first.start()) < header.line:
        logger.debug("'%s': the header was found in row %d; what stands above it is passed over", path, header.line)
    if header.units:
        logger.debug("'%s': the row below the header says units: %s", path, ", ".join(header.units.values()))


def _rows_alike(rows: bytes, number: int, header: Header, path: Path) -> tuple[bytes, str, range | np.ndarray]:
    """Return rows that all have as many cells as the header, what parts their cells, and the numbers of their lines.

    `number` is that of the first line. What a logger wrote below the samples is left out.
    """
    if rows and all(_are_alike(piece, header) for piece in _pieces(rows)):
        return rows, header.separator, range(number, number + sum(map(_lines_of, _pieces(rows))))
    footer = Footer(path)
    kept: list[bytes] = []
    numbers: list[np.ndarray] = []
    for piece in _pieces(rows):
        if _are_alike(piece, header):
            footer.refuse_samples_below()
            part = piece.rstrip(b"\n").replace(header.separator.encode(), CELL_END.encode())
            found = np.arange(number, number + _lines_of(piece))
        else:
            part, found = _looked_at(_table_lines(piece.decode(), number, header), header, footer)
        if found.size:
            kept.append(part)
            numbers.append(found)
        number += _count(piece, "\n")
    lines = np.concatenate(numbers) if numbers else np.empty(0, dtype=int)
    return b"\n".join(kept), CELL_END, lines


def _lines_of(piece: bytes) -> int:
    """Return how many lines there are, the last of which may lack its end."""
    return _count(piece, "\n") + (not piece.endswith(b"\n"))


def _pieces(rows: bytes) -> Iterator[bytes]:
    """Yield whole lines, some `PIECE_BYTES` of them at a time."""
    start = 0
    while start < len(rows):
        end = rows.rfind(b"\n", start, start + PIECE_BYTES) + 1
        end = end if end and start + PIECE_BYTES < len(rows) else len(rows)
        yield rows[start:end]
        start = end


def _are_alike(rows: bytes, header: Header) -> bool:
    """Tell whether rows are nothing but samples, in which a separator is no part of a cell, and have one width."""
    separator, width = header.separator, len(header.labels)
    if separator == BLANKS or width < 2 or b'"' in rows or _has_other_lines(rows, header):
        return False
    if b"#" in rows and COMMENTS.search(rows):
        return False
    rows = rows.removesuffix(b"\n")
    if not rows or rows.endswith(b"\n"):
        return False
    characters = np.frombuffer(rows, np.uint8)
    starts = np.concatenate([[0], np.flatnonzero(characters == ord("\n")) + 1])
    return bool(np.all(np.add.reduceat(characters == ord(separator), starts, dtype=np.int32) == width - 1))


def _has_other_lines(rows: bytes, header: Header) -> bool:
    """Tell whether the header stands among rows once more, or a line of text at their beginning or end."""
    first = rows[:LONGEST_LINE].lstrip(b"\n").partition(b"\n")[0].decode(errors="replace")
    last = rows[-LONGEST_LINE:].rstrip(b"\n\t ,;|").rpartition(b"\n")[2].decode(errors="replace")
    ends = (line.split(header.separator) for line in (first, last))
    return any(map(is_no_sample, ends)) or any(line.encode() in rows for line in header.repeats)


def _count(data: bytes, character: str) -> int:
    # bytes.count stops at every one of them, and takes several times as long.
    return int(np.count_nonzero(np.frombuffer(data, np.uint8) == ord(character)))


def _table_lines(text: str, first: int, header: Header) -> Lines:
    """Return every line that is neither comment, blank nor the header again; `first` is the number of the first line.

    A spreadsheet that has saved a file again leaves comments in quotes, and blank lines as a row of separators.
    """
    return [
        (number, line)
        for number, line in enumerate(text.split("\n"), start=first)
        if line.strip(' \t,;"') and not COMMENT_LINE.match(line) and line not in header.repeats
    ]


def _looked_at(lines: Lines, header: Header, footer: Footer) -> tuple[bytes, np.ndarray]:
    """Return those of some lines that are samples, their cells joined by `CELL_END`, and their numbers."""
    separator, width = header.separator, len(header.labels)
    rows, numbers = [], []
    for number, line in lines:
        if line[0] in NUMERIC and '"' not in line and separator != BLANKS and line.count(separator) == width - 1:
            row = line.replace(separator, CELL_END)
        else:
            cells = split_line(line, separator, number, footer.path)
            if len(cells) != width or is_no_sample(cells):
                footer.add(number, cells, header)
                continue
            row = CELL_END.join(cells)
        footer.refuse_samples_below()
        rows.append(row)
        numbers.append(number)
    return "\n".join(rows).encode(), np.array(numbers, dtype=int)
