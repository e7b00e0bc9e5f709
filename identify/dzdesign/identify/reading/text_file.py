"""Text files: CSV of any delimiter, plain or gzip, with decimal point or comma; an open file in, a `TextTable` out.

A logger writes about itself above the table: operator, date, a line a channel. Rows of numbers tell where the table
begins, and the header is the line above them that has as many cells and reads best as labels of a ramp test. Rows that
look as samples do are taken as they are, all at once; each other line is looked at.
"""

import codecs
import csv
import gzip
import io
import logging
import os
import re
import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import BinaryIO, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.units import measures
from dzdesign.identify.reading.column_labels import QUANTITIES, names_a_quantity, split_label
from dzdesign.identify.reading.logger_blocks import COMMENT, with_stated_times, without_blocks
from dzdesign.identify.reading.missing_values import OF_A_SPREADSHEET, is_no_value
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, clean_label, numbered
from dzdesign.identify.reading.text_table import TextTable, is_number

#: A text is read into memory at once: a larger one is refused. Twelve million rows of five columns have half a GiB.
LARGEST_TEXT, PIECE_BYTES = 1 << 32, 1 << 23
#: A gzip file that holds more than this many times its bytes, and `FREE_BYTES`, is made to fill a memory or a day:
#: of a recording, whose clock runs and whose meter is noisy, some five to fifteen times are usual.
LARGEST_RATIO, FREE_BYTES = 64, 1 << 26
#: Bytes at the beginning of a file that tell what it is.
LONGEST_MARK = 512
#: Bytes that no text in Windows-1252 has: control codes, and the five that it leaves open.
NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x19\x1b\x7f\x81\x8d\x8f\x90\x9d]")
SAVE_AS_CSV = "; save it again as 'CSV UTF-8'"
#: Ways out of a file that is no table of text.
FROM_A_SPREADSHEET = "in the spreadsheet program, save the sheet of the recording by 'Save as', 'CSV UTF-8'"
FROM_ITS_PROGRAM = "export it from the program that recorded it as CSV or MATLAB"
UNPACK = "unpack it, and give the recording that is in it"
#: What is often given in place of a table, by the end of its name where it is no text, or by its first bytes, and the
#: way out. A zip archive tells what it is by the name of its first file.
NO_TABLES = (
    (rb"\.(?:dxd|dxz|d7d)", "a DEWESoft recording", "export it from DEWESoft as MATLAB, HDF5 or CSV"),
    (rb"\.(?:psdata|wfm|trc|wdf)", "a recording of an oscilloscope", FROM_ITS_PROGRAM),
    (rb"PK\x03\x04.{26,80}?(?:\[Content_Types\]|xl/|_rels)", "an Excel workbook (xlsx)", FROM_A_SPREADSHEET),
    (rb"PK\x03\x04.{26,80}?opendocument", "a workbook (ods)", FROM_A_SPREADSHEET),
    (rb"PK\x03\x04.{26,80}?\.npy", "a NumPy archive (npz)", "save its arrays by scipy.io.savemat, or as CSV"),
    (rb"PK[\x03\x05][\x04\x06]", "a zip archive", UNPACK),
    (rb"7z\xbc\xaf|Rar!\x1a|BZh[1-9]1AY|\xfd7zXZ|\x28\xb5\x2f\xfd", "a packed archive", UNPACK),
    (rb"\xd0\xcf\x11\xe0", "an Excel workbook (xls)", FROM_A_SPREADSHEET),
    (rb"MDF     |UnFinMF ", "an MDF recording (mf4, mdf)", "save it as MATLAB or CSV, for example by asammdf"),
    (rb"LOGG.\0\0\0", "a BLF log of a CAN bus", "export its decoded signals as CSV or MATLAB"),
    (rb"\|CF,[12],", "an imc recording", FROM_ITS_PROGRAM),
    (rb"SQLite format 3\0", "an SQLite database", "export the table of the recording as CSV"),
    (rb"\x93NUMPY", "a NumPy array (npy)", "save it by numpy.savetxt with a header of labels"),
    (rb"%PDF-", "a PDF document", FROM_ITS_PROGRAM),
)
#: An artefact of dzdesign begins with its schema; what else begins so is no table.
ARTEFACT = re.compile(rb'\s*\{\s*"(?:[^"{}]*"\s*:\s*"[^"]*",?\s*")*?schema"\s*:\s*"(dzdesign\.[\w.-]+/\d+)"')
DOCUMENTS = {b"{": "JSON", b"<": "HTML or XML"}
#: A recording has some ten columns; a header beyond this is not a table, and would take minutes to be searched.
MOST_COLUMNS, LONGEST_HEADER = 4096, 1 << 20
#: Lines in which the header is looked for, and the longest of them.
MOST_LINES, LONGEST_LINE = 1000, 1 << 16
#: Lines among which a cell in quotes is looked for that goes on in the next one, and of how many it may be.
MOST_BROKEN = 40
#: Rows below the header, without any number, that say the columns' types and units.
MOST_BELOW = 4
#: Rows of numbers, one after the other, that are a table and no lines of a preamble; and their share of numbers.
FEWEST_ROWS, SHARE_OF_NUMBERS = 5, 0.6
#: What may stand between cells; where none of them is in the header, blanks do.
SEPARATORS, BLANKS = ",;\t|", " "
#: The same in the order in which rows of numbers are tried: a comma may be a decimal one, a blank part of a date.
IN_DOUBT = ";\t|, "
#: How a comment begins, and what names the separator to a spreadsheet. A cell without a value is no comment.
COMMENT_LINE = re.compile(rf'[ \t"]*(?:#(?!{OF_A_SPREADSHEET[1:]} *(?:[,;\t|"]|$))|[sS][eE][pP]=.?"?$)')
#: A line that is neither a comment nor blank; what a spreadsheet makes of either has quotes or separators.
TABLE_LINE = re.compile(rb'^(?![ \t,;"]*$)(?!%b).+' % COMMENT_LINE.pattern.encode(), re.MULTILINE)
#: Joins the cells of a line that was looked at: no cell of a text file holds it.
CELL_END = "\x1f"
#: What a row of numbers may begin with, behind so many blanks or blank cells.
NUMERIC, LONGEST_INDENT = b"0123456789+-.", 8
#: Lines whose cells are counted at a time: what that takes of memory has a bound.
LINES_AT_ONCE = 1 << 16
#: What the first cell of a row of statistics says, in English and German, without what stands in brackets behind it.
STATISTIC = re.compile(
    r"(?:arithm\w*\W{0,2})?(?:mean|avg|average|mittel(?:wert)?|durchschnitt|median)(?:[ _]?value)?"
    r"|(?:min|max)(?:imum|imal)?(?:[ _-]?(?:value|wert))?|peak(?:[ -]to[ -]peak)?|pk-?pk|spitze-spitze"
    r"|(?:std|standard|st)[ ._-]{0,2}(?:dev|abw)\w{0,8}|std|sigma|var(?:iance|ianz)|spannweite"
    r"|rms|eff(?:ektiv)?wert|sum|summe|count|anzahl",
    re.IGNORECASE,
)
#: What a logger draws below a table, where nothing else stands in the row.
RULE = re.compile(r"[-*=_\u2013\u2014]{2,}")
logger = logging.getLogger(__name__)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A line that may belong to the table: its number in the file, its text, and where it ends in it all."""

    number: int
    text: str
    end: int


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """The header row.

    Attributes
    ----------
    line : int
        Its number in the file.
    labels : tuple of str
        Of the columns.
    separator : str
        What stands between two cells.
    units : mapping
        Label -> unit, by a row of units beside it.
    repeats : frozenset of str
        The header's line and that of the units: where they stand once more, they are no samples.
    """

    line: int
    labels: tuple[str, ...]
    separator: str
    units: Mapping[str, str] = field(default_factory=dict)
    repeats: frozenset[str] = frozenset()


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
    end = 0
    for _ in range(skip_rows or 0):
        end = (text.find(b"\n", end) + 1) or len(text)
    skipped, text = text[:end], text[end:]
    number = 1 + skipped.count(b"\n")
    _refuse_a_long_line(text, path)
    text, segments, has_blocks = without_blocks(text, path)
    header, start = _find_header(text, number, path, skip_rows, at_first_line=has_blocks or skip_rows is not None)
    end = len(text)
    while end > start and text[end - 1] == ord("\n"):  # bytes.rstrip would copy all of it
        end -= 1
    above, rows = text[:start], text[start:end]
    del text  # it is in memory once
    rows, separator, lines = _samples(rows, number + above.count(b"\n"), header, path)
    table = TextTable(
        path=path,
        labels=header.labels,
        units=header.units,
        comments=(skipped + above).decode(),
        rows=rows,
        separator=separator,
        header_line=header.line,
        lines=lines,
        missing=missing,
    )
    return with_stated_times(table, segments)


# the text of a file


def read_text(file: BinaryIO, path: Path) -> bytes:
    """Return the text of a file in UTF-8, without a byte order mark; every line but the last ends in a line feed.

    A byte order mark tells the encoding (UTF-8, UTF-16); else it is UTF-8, else Windows-1252, which holds Latin-1 but
    for control codes: what loggers in western Europe and America write. Rejected: to guess it from the frequency of
    letters, of which a heading has too few.

    Raises
    ------
    InputError
        If it is no text, or too much of it.
    """
    data = _unpacked(file, path)
    start, name = data[:LONGEST_MARK], path.suffix.lower().encode(errors="replace")
    is_utf_16 = start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    is_text = NO_TEXT.search(start) is None or is_utf_16
    for mark, what, way_out in NO_TABLES:
        by_name = mark.startswith(rb"\.") and not is_text and re.fullmatch(mark, name)
        if by_name or re.match(mark, start, re.DOTALL):
            raise InputError(f"'{path}' is {what}; {way_out}")
    text = _from_utf_16(data, path) if is_utf_16 else _in_utf_8(data, path)
    if b"\0" in text:
        raise InputError(
            f"'{path}' is UTF-16 without a byte order mark, or no text at all, expected UTF-8{SAVE_AS_CSV}"
        )
    # Not splitlines(): to an editor, whose line numbers the messages give, a form feed or U+0085 ends no line.
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in text else text


def _unpacked(file: BinaryIO, path: Path) -> bytes:
    """Return the bytes of a file, of a gzip file those that it holds."""
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    packed = file.read(2) == b"\x1f\x8b"
    file.seek(0)
    most = min(LARGEST_TEXT, FREE_BYTES + LARGEST_RATIO * size) if packed else LARGEST_TEXT
    if not packed and size <= most:
        return file.read()
    stream = gzip.GzipFile(fileobj=file) if packed else file
    out = io.BytesIO()
    try:
        # In pieces: to read so many bytes takes memory for as many, however few there are.
        while out.tell() <= most and out.write(stream.read(PIECE_BYTES)):
            pass
    except (gzip.BadGzipFile, EOFError, zlib.error) as error:
        raise InputError(f"'{path}' is not a whole gzip file ({error}); copy it again") from error
    if out.tell() > LARGEST_TEXT:
        raise InputError(
            f"'{path}' holds more than {LARGEST_TEXT >> 30} GiB of text, expected a ramp test; export only its columns "
            "of time, u, dP and Q, or record at a lower rate"
        )
    if out.tell() > most:
        raise InputError(
            f"'{path}' unpacks to more than {LARGEST_RATIO} times its size, as no recording does; give the "
            "recording itself, not packed"
        )
    return out.getvalue()


def _from_utf_16(data: bytes, path: Path) -> bytes:
    try:
        text = data.decode("utf-16").encode()
    except UnicodeError as error:
        reason = getattr(error, "reason", error)
        raise InputError(f"'{path}' begins as UTF-16 and is not ({reason}){SAVE_AS_CSV}") from error
    logger.debug("'%s' is text in UTF-16", path)
    return text


def _in_utf_8(data: bytes, path: Path) -> bytes:
    """Return text in UTF-8 or Windows-1252 as the former, without a byte order mark."""
    try:
        if not data.isascii():
            data.decode()
    except UnicodeDecodeError as error:
        if data.startswith(codecs.BOM_UTF8) or not data[: error.start].isascii():
            raise InputError(
                f"'{path}' is not a text file in UTF-8 throughout (byte {error.start + 1}){SAVE_AS_CSV}"
            ) from error
        if bad := NO_TEXT.search(data):
            raise InputError(
                f"'{path}' is not a text file, neither in UTF-8 nor in Windows-1252 (byte {bad.start() + 1})"
                f"{SAVE_AS_CSV}"
            ) from error
        logger.debug("'%s' is text in Windows-1252", path)
        return data.decode("cp1252").encode()
    return data.removeprefix(codecs.BOM_UTF8)


def _refuse_a_long_line(text: bytes, path: Path) -> None:
    """Refuse a line that no table has, before anything takes a minute for it."""
    start = 0
    while start + PIECE_BYTES < len(text):
        end = text.rfind(b"\n", start, start + PIECE_BYTES) + 1
        if not end:
            raise InputError(f"'{path}' has a line of more than {PIECE_BYTES} bytes; expected a table of numbers")
        start = end


# a line as cells


def cells_of(line: str, separator: str) -> list[str]:
    """Return the cells of a line without blanks and quotes around them, none of one whose quotes can't be read."""
    try:
        return _split(line, separator)
    except csv.Error:
        return []


def _cells_or_refusal(line: str, separator: str, number: int, path: Path) -> list[str]:
    """Return the cells of a line of the table."""
    try:
        return _split(line, separator)
    except csv.Error as error:  # a cell longer than 128 KiB, as after a quote that is never closed
        raise InputError(f"'{path}' row {number} has a cell that can't be read ({error}); mind its quotes") from error


def _split(line: str, separator: str) -> list[str]:
    """Return the cells of a line; inside quotes the separator is a character as any other."""
    if separator == BLANKS:
        # A unit in brackets belongs to the word before it. Of a bracket that is never closed only so much is looked
        # at: a long header of them would take hours. A line of blanks that only Unicode knows has a cell, too.
        cells = re.findall(r"[^\s\[(]+(?:\s{0,40}[\[(][^\])]{0,80}[\])])?", line) or [line]
    elif '"' in line:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    else:
        cells = line.split(separator)
    return [clean_label(cell) for cell in cells]


def _is_value(cell: str) -> bool:
    """Tell whether a cell is a number, or what stands for none."""
    return is_number(cell) or is_no_value(cell)


# the header


def _find_header(
    text: bytes, number: int, path: Path, skip_rows: int | None, *, at_first_line: bool
) -> tuple[Header, int]:
    """Return the header, and where in a text, whose first line is `number`, its rows begin.

    `at_first_line`: the first line is the header by the engineer's word, comments and blank lines aside.

    Raises
    ------
    InputError
        If there is none, or two lines could each be it.
    """
    lines = _first_lines(text, number)
    if not lines:
        raise _no_header(path, len(text), skip_rows)
    _refuse_a_document(text, path)
    found = None if at_first_line or len(lines[0].text) > LONGEST_LINE else _best_header(lines, path)
    at, separator = found or (0, _usual_separator(lines[0].text))
    line, below = lines[at], lines[at + 1 :]
    if found is None and (commented := _commented_header(text, number, line, separator)):
        line, below = commented, lines
    labels = _labels(line, separator, path)
    words = _rows_of_words(below, separator)
    rows = [cells_of(row.text, separator) for row in below[len(words) : len(words) + 1]]
    units = next((row for row in (*words, *lines[max(at - 1, 0) : at]) if _is_units(row, separator)), None)
    for row in words:
        if row is not units:
            text_of_row = row.text[:QUOTED_CHARACTERS]
            logger.debug("'%s' row %d, below the header, is passed over: %s", path, row.number, text_of_row)
    if skip_rows is None and line.number > lines[0].number:
        logger.debug("'%s': the header was found in row %d; what stands above it is passed over", path, line.number)
    stated: dict[str, str] = {}
    for label, cell in zip(labels, cells_of(units.text, separator) if units else [], strict=False):
        if _bare_unit(cell):
            stated.setdefault(label, _bare_unit(cell))
    header = Header(
        line=line.number,
        labels=_fitted(labels, rows[0] if rows else []),
        separator=separator,
        units=stated,
        repeats=frozenset({line.text} | ({units.text} if units else set())),
    )
    return header, (words[-1] if words else line).end + 1


def _no_header(path: Path, size: int, skip_rows: int | None) -> InputError:
    if size >= LONGEST_HEADER:
        return InputError(
            f"'{path}' begins with {size} bytes of comments and blank lines; expected a header row such "
            "as time_s,u_V,dP_MPa,Q_Lmin near its beginning"
        )
    below = f" below its first {skip_rows} rows (--skip-rows)" if skip_rows else ""
    return InputError(f"'{path}' is empty{below}; expected a header row such as time_s,u_V,dP_MPa,Q_Lmin and samples")


def _first_lines(text: bytes, number: int) -> list[Line]:
    """Return the first lines that are neither a comment nor blank; those broken inside quotes are joined."""
    lines: list[Line] = []
    before = 0
    for match in TABLE_LINE.finditer(text):
        if lines and (len(lines) == MOST_LINES or match.end() - match.start() > LONGEST_LINE):
            break
        number += text.count(b"\n", before, match.start())
        before = match.start()
        lines.append(Line(number=number, text=match[0].decode(), end=match.end()))
    for first, line in enumerate(lines[:MOST_BROKEN]):
        if line.text.count('"') % 2 == 0 or len(line.text) > LONGEST_LINE:
            continue
        for last in range(first + 1, min(first + MOST_BROKEN, len(lines))):
            joined = " ".join(each.text for each in lines[first : last + 1])
            if joined.count('"') % 2 == 0:  # a cell of two lines
                return [*lines[:first], Line(number=line.number, text=joined, end=lines[last].end), *lines[last + 1 :]]
    return lines


def _refuse_a_document(text: bytes, path: Path) -> None:
    """Refuse what a pattern such as ``ramps/*`` catches beside recordings."""
    artefact = ARTEFACT.match(text[:LONGEST_LINE])
    if artefact:
        raise InputError(
            f"'{path}' is no recording but a file that dzdesign wrote ({artefact[1].decode()}); leave it out, for "
            "example by a pattern such as *.csv"
        )
    document = DOCUMENTS.get(text[:LONGEST_HEADER].lstrip()[:1])
    if document:
        raise InputError(f"'{path}' is {document}, expected a table of numbers; export the recording as CSV")


def _best_header(lines: list[Line], path: Path) -> tuple[int, str] | None:
    """Return which line is the header, and what parts its cells; None if no rows of numbers tell."""
    first = _usual_separator(lines[0].text)
    if len(lines) > 1 and _could_be_labels(cells := cells_of(lines[0].text, first)):
        second = cells_of(lines[1].text, first)
        if len(cells) == len(second) and _is_row_of_numbers(second):
            return 0, first
    for separator in IN_DOUBT:
        rows = _first_row(lines, separator)
        if rows is None:
            continue
        width = len(cells_of(lines[rows].text, separator))
        fitting = [
            (_score(cells, lines[index + 1], separator), index)
            for index in range(rows)
            if _fits(cells := cells_of(lines[index].text, separator), width)
            and _could_be_labels(cells)
            and not (index and _is_units(lines[index], separator))
        ]
        best = [index for score, index in fitting if score == max(fitting)[0]]
        if len(best) > 1:
            one, other = lines[best[0]], lines[best[-1]]
            raise InputError(
                f"'{path}': rows {one.number} ('{one.text[:QUOTED_CHARACTERS]}') and {other.number} "
                f"('{other.text[:QUOTED_CHARACTERS]}') could each be the header; say how many rows stand above it by "
                f"--skip-rows, for example --skip-rows {other.number - 1}"
            )
        return (best[0], separator) if best else None
    return None


def _first_row(lines: list[Line], separator: str) -> int | None:
    """Return the first of `FEWEST_ROWS` rows of numbers that have the same number of cells."""
    run, width = 0, 0
    for index, line in enumerate(lines):
        cells = cells_of(line.text, separator)
        if not _is_row_of_numbers(cells):
            run = 0
            continue
        run, width = (run + 1 if len(cells) == width else 1), len(cells)
        if run == FEWEST_ROWS:
            return index - run + 1
    return None


def _is_row_of_numbers(cells: list[str]) -> bool:
    """Tell whether cells are a row of samples: mostly numbers, the first one too."""
    filled = [cell for cell in cells if cell]
    numbers = sum(map(_is_value, filled))
    return numbers >= 2 and is_number(filled[0]) and numbers >= SHARE_OF_NUMBERS * len(filled)


def _could_be_labels(cells: list[str]) -> bool:
    """Tell whether cells may be labels: mostly words, and not all the same."""
    texts = sum(bool(cell) and not is_number(cell) for cell in cells)
    return texts >= 2 and 2 * texts >= len(cells) and len(set(filter(None, cells))) > 1


def _fits(cells: list[str], width: int) -> bool:
    """Tell whether labels fit rows of some width: one cell more or less may be blank, or LabVIEW's comment."""
    if len(cells) == width + 1:
        return cells[-1].lower() in ("", COMMENT)
    return len(cells) in (width, width - 1)


def _is_units(line: Line, separator: str) -> bool:
    """Tell whether a row says the units of the columns, such as ``s;V;l/min;bar`` or ``(ms),(V),(V)``."""
    filled = [_bare_unit(cell) for cell in cells_of(line.text, separator) if cell]
    known = sum(map(names_a_quantity, filled)) + sum(measures(unit, "current") for unit in filled)
    return known >= 2 and 2 * known >= len(filled) and not any(map(is_number, filled))


def _bare_unit(unit: str) -> str:
    return unit.strip(" \t[](){}")


def _score(cells: list[str], below: Line, separator: str) -> int:
    """Return how many quantities and units the labels of a line say, and whether units stand below it."""
    known = set()
    for label in cells[:MOST_COLUMNS]:
        quantity, unit = split_label(label)
        known |= {quantity} if quantity else {unit} if unit != label and names_a_quantity(unit) else set()
    return len(known) + (len(QUANTITIES) if _is_units(below, separator) else 0)


def _usual_separator(line: str) -> str:
    """Return what is most often in a line; in a row of numbers with decimal commas that is not what parts its cells."""
    for separator in IN_DOUBT[:3]:
        if len(line) <= LONGEST_LINE and separator in line and _is_row_of_numbers(cells_of(line, separator)):
            return separator
    separator = max(SEPARATORS, key=line.count)
    return separator if separator in line else BLANKS


def _rows_of_words(rows: list[Line], separator: str) -> list[Line]:
    """Return the rows directly below a header that hold no number, if numbers follow: units, types of the columns."""
    first = rows[: MOST_BELOW + 1]
    words = list(takewhile(lambda row: not any(map(is_number, cells_of(row.text, separator))), first))
    return words if len(words) < len(first) else [row for row in words[:1] if _is_units(row, separator)]


def _commented_header(text: bytes, number: int, row: Line, separator: str) -> Line | None:
    """Return the last comment above a table without a header, if it can be one: numpy.savetxt writes it so."""
    cells = cells_of(row.text, separator)
    if not _are_numbers(cells):
        return None
    above = text[: row.end].split(b"\n")[: row.number - number]
    for back, line in enumerate(reversed(above), start=1):
        comment = line.decode(errors="replace").strip()
        if not comment:
            continue
        bare = comment.lstrip('" \t#')
        names = cells_of(bare, separator)
        if not (comment.startswith("#") and len(names) == len(cells) and _could_be_labels(names)):
            return None
        end = sum(len(each) + 1 for each in above[: len(above) - back + 1]) - 1
        return Line(number=row.number - back, text=bare, end=end)
    return None


def _are_numbers(labels: list[str]) -> bool:
    return all(not label or is_number(label) for label in labels)


def _labels(line: Line, separator: str, path: Path) -> tuple[str, ...]:
    """Return the labels that a line holds; refuse a line of numbers."""
    columns = len(line.text.split()) if separator == BLANKS else line.text.count(separator) + 1
    if columns > MOST_COLUMNS or len(line.text) > LONGEST_HEADER:
        raise InputError(
            f"'{path}' row {line.number} has {columns} cells, expected the columns of a ramp test, at most "
            f"{MOST_COLUMNS}; export only those"
        )
    labels = _cells_or_refusal(line.text, separator, line.number, path)
    if _are_numbers(labels):
        raise InputError(
            f"'{path}' has no header row (row {line.number} is '{line.text[:QUOTED_CHARACTERS]}'); "
            "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
        )
    return numbered(labels)


def _fitted(labels: tuple[str, ...], cells: list[str]) -> tuple[str, ...]:
    """Return labels, one more or less where the rows end in a separator and the header does not, or the reverse."""
    if not _is_row_of_numbers(cells):
        return labels
    if len(cells) == len(labels) - 1 and labels[-1].lower() in ("", COMMENT):
        return labels[:-1]
    return (*labels, "") if len(cells) == len(labels) + 1 and not cells[-1] else labels


# the samples


def _samples(rows: bytes, number: int, header: Header, path: Path) -> tuple[bytes, str, range | np.ndarray]:
    """Return rows that all have as many cells as the header, what parts their cells, and the numbers of their lines.

    `number` is that of the first line. Comments, blank lines, the header when it stands there again, and what a logger
    wrote above or below the samples are left out. Words amid samples are refused, and so are lines that begin as a
    sample does and are none.
    """
    if not rows:
        return rows, header.separator, range(number, number)
    starts = np.flatnonzero(np.frombuffer(rows, np.uint8) == ord("\n")) + 1
    starts = np.concatenate([[0], starts, [len(rows) + 1]])
    kept = _look_like_samples(rows, starts[:-1], header)
    if kept.all():
        return rows, header.separator, range(number, number + kept.size)
    others: list[tuple[int, list[str]]] = []
    out, after = io.BytesIO(), 0  # behind the last line that was looked at
    for index in (*np.flatnonzero(~kept).tolist(), kept.size):
        if index > after:
            plain = rows[starts[after] : starts[index] - 1]
            out.write(plain.replace(header.separator.encode(), CELL_END.encode()) + b"\n")
        after = index + 1
        if index == kept.size or len(others) > MOST_LINES:
            break
        line = rows[starts[index] : starts[after] - 1].decode()
        if not line.strip(' \t,;"') or COMMENT_LINE.match(line) or line in header.repeats:
            continue
        cells = _cells_or_refusal(line, header.separator, number + index, path)
        if len(cells) != len(header.labels) or _is_no_sample(cells):
            others.append((index, cells))
        else:
            out.write(CELL_END.join(cells).encode() + b"\n")
            kept[index] = True
    samples = np.flatnonzero(kept)
    first, last = (samples[0], samples[-1]) if samples.size else (kept.size, 0)
    for index, cells in others:
        if is_number(cells[0]) or first < index < last or len(others) > MOST_LINES:
            raise _wrong_row(cells, number + index, header, path, above=index < first)
        logger.debug("'%s' row %d is passed over: %s", path, number + index, " ".join(cells)[:QUOTED_CHARACTERS])
    out.truncate(max(out.tell() - 1, 0))
    return out.getvalue(), CELL_END, number + samples


def _look_like_samples(rows: bytes, starts: np.ndarray, header: Header) -> np.ndarray:
    """Tell of each line whether it begins with a number, has as many cells as the header, and no quotes."""
    likely = header.separator != BLANKS and len(header.labels) >= 2
    if not likely or any(line.encode() in rows for line in header.repeats if line[:1].encode() in NUMERIC):
        return np.zeros(starts.size, dtype=bool)
    characters = np.frombuffer(rows, np.uint8)
    is_indent, is_numeric = np.zeros((2, 256), dtype=bool)
    is_indent[list(f" \t{header.separator}".encode())] = True
    is_numeric[list(NUMERIC)] = True
    first = starts.copy()
    for _ in range(LONGEST_INDENT):
        first += is_indent[characters[first]] & (first < characters.size - 1)
    found = is_numeric[characters[first]]
    for begin in range(0, starts.size, LINES_AT_ONCE):  # a count takes four times the memory of what is counted
        lines = slice(begin, begin + LINES_AT_ONCE)
        piece = characters[starts[begin] :]
        piece = piece[: starts[lines.stop] - starts[begin]] if lines.stop < starts.size else piece
        of_lines = starts[lines] - starts[begin]
        separators = np.add.reduceat(piece == ord(header.separator), of_lines, dtype=np.int32)
        found[lines] &= separators == len(header.labels) - 1
        found[lines] &= ~np.logical_or.reduceat(piece == ord('"'), of_lines)
    return np.asarray(found)


def _is_no_sample(cells: Sequence[str]) -> bool:
    """Tell whether a row is a word of the logger, alone in its first cell, or one of statistics.

    Examples
    --------
    >>> [_is_no_sample(cells) for cells in (["End", "", ""], ["Mittelwert:", "5,0", "1,0"], ["x", "5,0", "1,0"])]
    [True, True, False]
    """
    first = cells[0]
    if not first or (_is_value(first) and not RULE.fullmatch(first)):
        return False
    return not any(cells[1:]) or _is_statistic(first)


def _is_statistic(cell: str) -> bool:
    bare = re.sub(r"[\[(].{0,40}$", "", cell[:QUOTED_CHARACTERS]).strip(" :=.")
    return STATISTIC.fullmatch(bare) is not None


def _wrong_row(cells: Sequence[str], number: int, header: Header, path: Path, *, above: bool) -> InputError:
    """Return the error for a row that has too many or too few cells, or is a word of the logger amid samples.

    `above`: it stands above all samples, so the header may be none.
    """
    width, word = len(header.labels), cells[0][:QUOTED_CHARACTERS]
    the_header = f"the header, row {header.line} ('{', '.join(header.labels)[:QUOTED_CHARACTERS]}')"
    begin = f"'{path}' row {number} has"
    if len(cells) != width:
        comma = header.separator == "," and len(cells) == 2 * width
        advice = [
            "decimal commas need ';' or a tab between the cells" if comma else "",
            "complete the row, or delete it, as a logger that was stopped may have left half of one"
            if len(cells) < width and is_number(word) and not above
            else "correct the row, or begin it with # if it is no sample",
            "--skip-rows says how many rows stand above the header" if above else "",
        ]
        found = f"{len(cells)} cell{'s' if len(cells) > 1 else f', {word!r}'}"
        return InputError(f"{begin} {found}, expected {width} as in {the_header}; {'; '.join(filter(None, advice))}")
    kind = "a statistic" if _is_statistic(word) else "a word and no number"
    return InputError(
        f"{begin} {kind}, '{word}', and samples below it, expected nothing but samples below {the_header}; begin "
        "the row with # if it is no sample, or delete it; --skip-rows says how many rows stand above the header"
    )
