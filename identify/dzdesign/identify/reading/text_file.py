"""Files of text: CSV of any delimiter, plain or gzip, with decimal point or comma; an open file in, a `TextTable` out.

What is no text, or too much of it, is refused by name. Rows that look as samples do are taken as they are, all at once;
each other line is looked at. Some loggers write a block of words for each channel: see the end of this file.
"""

import codecs
import gzip
import io
import logging
import os
import re
import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, clean_label
from dzdesign.identify.reading.text_header import (
    ASIDE,
    BLANKS,
    COMMENT,
    MOST_LINES,
    Header,
    cells_of,
    find_header,
    is_value,
)
from dzdesign.identify.reading.text_table import TextTable, is_number
from dzdesign.identify.reading.time_stamps import start_of

if TYPE_CHECKING:
    import polars as pl

#: A text is read into memory at once: a larger one is refused. Twelve million rows of five columns have half a GiB.
LARGEST_TEXT, PIECE_BYTES = 1 << 32, 1 << 23
#: A gzip file that holds more than this many times its bytes, and `FREE_BYTES`, is made to fill a memory or a day:
#: of a recording, whose clock runs and whose meter is noisy, some five to fifteen times are usual.
LARGEST_RATIO, FREE_BYTES = 64, 1 << 26
#: Bytes at the beginning of a file that tell what it is.
LONGEST_MARK = 512
#: Bytes that no text in Windows-1252 has: control codes, and the five that it leaves open.
NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x19\x1b\x7f\x81\x8d\x8f\x90\x9d]")
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
#: Joins the cells of a line that was looked at: no text holds it.
CELL_END = "\x1f"
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
LABVIEW, END_OF_HEADER, X_VALUE = "LabVIEW Measurement", "***End_of_Header***", "X_Value"
#: First cells of a line that stands above a segment's header.
WORD = re.compile(r"[^\W\d]|\*\*\*")
#: A block of TwinCAT Scope: it begins with the channels' names, ends with their steps, and samples follow the words.
SCOPE_NAMES, SCOPE_STEP, SCOPE_WORD = re.compile(r"Name[\t;,]"), "SampleTime[ms]", re.compile(r"[^\W\d]|\s|$")
SCOPE_NAME, SCOPE_TIME = "Name", "Time (ms)"
#: Lines in which it is looked for, and lines that it has at most.
SCOPE_LINES, SCOPE_BLOCK = 1000, 42
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
    lines = _lines(file, path)
    start = min(skip_rows or 0, lines.len())
    lines, segments, has_blocks = without_blocks(lines, start, path)
    header = find_header(lines, start, path, skip_rows, at_first_line=has_blocks or skip_rows is not None)
    comments = "\n".join(lines.head(header.rows))
    cells, places = _samples(lines.slice(header.rows), header, path)
    table = TextTable(
        path=path, labels=header.labels, units=header.units, comments=comments, cells=cells, header_line=header.line,
        lines=places + 1, missing=missing,
    )  # fmt: skip
    return with_stated_times(table, segments)


# the lines of a file


def _lines(file: BinaryIO, path: Path) -> "pl.Series":
    """Return the lines of a file of text.

    A byte order mark tells the encoding (UTF-8, UTF-16); else it is UTF-8, else Windows-1252, which holds Latin-1 but
    for control codes: what loggers in western Europe and America write. Rejected: to guess it from the frequency of
    letters, of which a heading has too few.

    Raises
    ------
    InputError
        If it is no text, or too much of it, or has a line that no table has.
    """
    import polars as pl

    text = _decoded(file, path)
    pieces = [pl.Series([], dtype=pl.String)]
    start = 0
    while start < len(text):
        whole = len(text) - start <= PIECE_BYTES
        end = len(text) if whole else text.rfind(b"\n", start, start + PIECE_BYTES)
        if end < 0:  # before anything takes a minute for it
            raise InputError(f"'{path}' has a line of more than {PIECE_BYTES} bytes; expected a table of numbers")
        # Not splitlines(): to an editor, whose line numbers the messages give, a form feed or U+0085 ends no line.
        pieces.append(pl.Series([text[start:end].decode()]).str.split("\n").explode())
        start = end + 1
    return pl.concat(pieces)


def _decoded(file: BinaryIO, path: Path) -> bytes:
    """Return the text of a file in UTF-8, without a byte order mark; lines end in a line feed."""
    data = _unpacked(file, path)
    start, name = data[:LONGEST_MARK], path.suffix.lower().encode(errors="replace")
    is_utf_16 = start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    is_text = NO_TEXT.search(start) is None or is_utf_16
    for mark, what, way_out in NO_TABLES:
        by_name = mark.startswith(rb"\.") and not is_text and re.fullmatch(mark, name)
        if by_name or re.match(mark, start, re.DOTALL):
            raise InputError(f"'{path}' is {what}; {way_out}")
    try:
        text = data if data.isascii() else data.decode("utf-16" if is_utf_16 else "utf-8").encode()
    except UnicodeError as error:
        bad, byte = NO_TEXT.search(data), getattr(error, "start", 0)
        if is_utf_16 or data.startswith(codecs.BOM_UTF8) or not data[:byte].isascii() or bad:
            byte = bad.start() if bad and data[:byte].isascii() else byte
            raise _no_text(path, byte) from error
        text = data.decode("cp1252").encode()
        logger.debug("'%s' is text in Windows-1252", path)
    if is_utf_16:
        logger.debug("'%s' is text in UTF-16", path)
    if (byte := max(text.find(b"\0"), text.find(CELL_END.encode()))) >= 0:
        raise _no_text(path, byte)
    text = text.removeprefix(codecs.BOM_UTF8)
    return text.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in text else text


def _no_text(path: Path, byte: int) -> InputError:
    return InputError(
        f"'{path}' is not a text file in UTF-8, UTF-16 with a byte order mark, or Windows-1252 (byte {byte + 1}); save "
        "it again as 'CSV UTF-8'"
    )


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


# the samples


def _samples(lines: "pl.Series", header: Header, path: Path) -> "tuple[pl.DataFrame, np.ndarray]":
    """Return the cells of the lines below a header that are samples, and the places of those lines in the file.

    Comments, blank lines, the header when it stands there again, and what a logger wrote above or below the samples
    are left out. Words amid samples are refused, and so are lines that begin as a sample does and are none.
    """
    import polars as pl

    separator = header.separator
    plain = _look_like_samples(lines, header)
    kept = plain.to_numpy().copy()
    others: list[tuple[int, list[str]]] = []
    split: dict[int, str] = {}
    for index, line in zip(np.flatnonzero(~kept).tolist(), lines.filter(~plain), strict=True):
        if ASIDE.match(line) or line in header.repeats:
            continue
        cells = cells_of(line, separator, f"'{path}' row {header.rows + index + 1}")
        kept[index] = len(cells) == len(header.labels) and not _is_no_sample(cells)
        if kept[index]:
            split[index] = CELL_END.join(cells)
            continue
        others.append((index, cells))
        if len(others) > MOST_LINES:
            break
    samples = np.flatnonzero(kept)
    first, last = (samples[0], samples[-1]) if samples.size else (kept.size, 0)
    for index, cells in others:
        number = header.rows + index + 1
        if is_number(cells[0]) or first < index < last or len(others) > MOST_LINES:
            raise _wrong_row(cells, number, header, path)
        logger.debug("'%s' row %d is passed over: %s", path, number, " ".join(cells)[:QUOTED_CHARACTERS])
    if split:
        lines, separator = lines.str.replace_all(separator, CELL_END, literal=True), CELL_END
        lines = lines.scatter(list(split), list(split.values()))
    rows = lines.filter(pl.Series(kept)).str.split_exact(separator, len(header.labels) - 1)
    return rows.struct.unnest(), header.rows + samples


def _look_like_samples(lines: "pl.Series", header: Header) -> "pl.Series":
    """Tell of each line whether it begins with a number, has as many cells as the header, and no quotes."""
    separator, width = header.separator, len(header.labels)
    if separator == BLANKS or width < 2:
        return lines.str.starts_with("\n")
    found = lines.str.contains(rf"^[ \t{separator}]{{0,8}}[0-9+.-]") & ~lines.str.contains('"', literal=True)
    return found & (lines.str.count_matches(separator, literal=True) == width - 1) & ~lines.is_in(list(header.repeats))


def _is_no_sample(cells: Sequence[str]) -> bool:
    """Tell whether a row is a word of the logger, alone in its first cell, or one of statistics.

    Examples
    --------
    >>> [_is_no_sample(cells) for cells in (["End", "", ""], ["Mittelwert:", "5,0", "1,0"], ["x", "5,0", "1,0"])]
    [True, True, False]
    """
    first = cells[0]
    if not first or (is_value(first) and not RULE.fullmatch(first)):
        return False
    bare = re.sub(r"[\[(].{0,40}$", "", first[:QUOTED_CHARACTERS]).strip(" :=.")
    return not any(cells[1:]) or STATISTIC.fullmatch(bare) is not None


def _wrong_row(cells: Sequence[str], number: int, header: Header, path: Path) -> InputError:
    """Return the error for a row that has too many or too few cells, or is a word of the logger amid samples."""
    width, word = len(header.labels), cells[0][:QUOTED_CHARACTERS]
    found = f"{len(cells)} cells" if len(cells) > 1 else f"1 cell, {word!r}"
    amiss = len(cells) != width
    what = f"has {found}, expected {width} as in" if amiss else f"is {word!r}, expected samples below"
    is_comma = header.separator == "," and len(cells) == 2 * width
    comma = "decimal commas need ';' or a tab between the cells; " if is_comma else ""
    return InputError(
        f"'{path}' row {number} {what} the header, row {header.line} ('"
        f"{', '.join(header.labels)[:QUOTED_CHARACTERS]}'); {comma}correct or delete the row, begin it with # if it is "
        "no sample, or say by --skip-rows how many rows stand above the header"
    )


# Blocks of words per channel or segment: LabVIEW measurement files (.lvm), TwinCAT Scope's CSV. They are made comments,
# which keeps the numbers of the lines, and one row of labels stays. What they say of units and times goes into the
# table: a LabVIEW file may state only start and step of each channel, for each segment anew.


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A segment of a LabVIEW file: the line of its labels, and what its header says, a cell a column."""

    line: int
    header: Mapping[str, list[str]]

    def cell(self, key: str, column: int) -> str:
        """Return what the header says of a column of values, or nothing."""
        cells = self.header.get(key, [])
        return cells[column].strip() if column < len(cells) else ""

    def start(self, column: int) -> str:
        """Return the date and time at which a channel begins to count, or nothing."""
        date, time = self.cell("Date", column), self.cell("Time", column)
        time = re.sub(r"([.,]\d{1,6})\d*$", r"\1", time)
        return f"{date} {time}" if date and time else ""

    def number(self, key: str, column: int) -> float:
        """Return a number for a channel; NaN where there is none."""
        try:
            return float(self.cell(key, column).replace(",", "."))
        except ValueError:
            return np.nan


def without_blocks(lines: "pl.Series", start: int, path: Path) -> "tuple[pl.Series, tuple[Segment, ...], bool]":
    """Return lines whose blocks are comments, the segments of a LabVIEW file, and whether there were any blocks.

    The file begins with the line `start`.

    Raises
    ------
    InputError
        If the segments of a LabVIEW file have other columns.
    """
    first = lines.slice(start, SCOPE_LINES).to_list()
    if first and first[0].startswith(LABVIEW):
        plain, segments = _of_labview(lines.to_list(), start, path)
        return plain, tuple(segments), bool(segments)
    names = next((place for place, line in enumerate(first) if place and SCOPE_NAMES.match(line)), 0)
    block = range(names + 1, min(names + SCOPE_BLOCK, len(first))) if names else ()
    times = next((place for place in block if first[place].startswith(SCOPE_STEP)), 0)
    if not times:
        return lines, (), False
    end = next((place for place in range(times + 1, len(first)) if not SCOPE_WORD.match(first[place])), len(first))
    separator = first[names][len(SCOPE_NAME)]
    labels = [cell.strip() for cell in first[names].split(separator)]
    pairs = [SCOPE_TIME if index % 2 == 0 and cell == SCOPE_NAME else cell for index, cell in enumerate(labels)]
    commented = [f"# {line}" if line.strip() else line for line in first[:end]]
    commented[names] = separator.join(pairs)
    return lines.scatter(range(start, start + end), commented), (), True


def _of_labview(lines: list[str], start: int, path: Path) -> "tuple[pl.Series, list[Segment]]":
    import polars as pl

    separator = "," if any(line.startswith("Separator,Comma") for line in lines[:SCOPE_LINES]) else "\t"
    segments: list[Segment] = []
    header: dict[str, list[str]] = {}
    samples, ended, labels = False, False, [""]
    for index, line in enumerate(lines[start:], start=start):
        cells = line.split(separator)
        word = clean_label(cells[0])
        if samples and not WORD.match(word):
            if len(cells) > len(labels):  # a comment behind it
                lines[index] = separator.join(cells[: len(labels)])
            continue
        samples = False
        if word == END_OF_HEADER:
            ended = True
        elif ended and word == X_VALUE:
            segments.append(Segment(line=index + 1, header=header))
            header, samples, ended = {}, True, False
            cells = cells[: len(cells) - (clean_label(cells[-1]).lower() == COMMENT)]
            if len(segments) == 1:
                labels, lines[index] = cells, separator.join(cells)
                continue
            if cells != labels:
                raise InputError(
                    f"'{path}' row {index + 1} begins a segment with other columns ('{line[:QUOTED_CHARACTERS]}') than "
                    f"row {segments[0].line}; make a file of each segment"
                )
        elif word:
            header, ended = ({} if ended else header), False
            header.setdefault(word, cells)
        if line.strip():
            lines[index] = f"# {line}"
    return pl.Series(lines, dtype=pl.String), segments


def with_stated_times(table: TextTable, segments: tuple[Segment, ...]) -> TextTable:
    """Return the table of a LabVIEW file with the units and the times that its headers state."""
    import polars as pl

    if not segments:
        return table
    units, starts, cells = dict(table.units), {}, table.cells
    clocks: dict[str, str] = {}
    waveforms: dict[tuple[str, str], str] = {}
    labels, first, clock = list(table.labels), segments[0], ""
    for column, label in enumerate(table.labels):
        if table.in_file(label) == X_VALUE:
            clock = label
            continue
        if unit := first.cell("Y_Unit_Label", column):
            units.setdefault(label, unit)
        stated = tuple(
            (each.start(column), each.number("X0", column), each.number("Delta_X", column)) for each in segments
        )
        own = waveforms.setdefault((clock, str(stated)), clock if clock not in clocks.values() else f"time of {label}")
        clocks[label] = own
        if own in starts:
            continue
        units[own], starts[own] = "s", first.start(column)
        times = _times(table, clock if own == clock else "", segments, column)
        if own not in labels:
            labels.append(own)
        if times is not None:  # a new column, or in place of that which the file left blank
            name = f"field_{labels.index(own)}"
            cells = cells.with_columns(pl.Series(name, times))
    return replace(table, labels=tuple(labels), units=units, clocks=clocks, starts=starts, cells=cells)


def _times(table: TextTable, label: str, segments: tuple[Segment, ...], column: int) -> np.ndarray | None:
    """Return the times of a channel, s; None where they are what stands in the file.

    Where the numbers of a segment begin anew, the date and time in its header say by how much it is later.
    """
    count = len(table.lines)
    segment = np.searchsorted([each.line for each in segments], np.asarray(table.lines), side="right") - 1
    begins = np.searchsorted(segment, np.arange(len(segments)))
    numbers = table.numbers(label) if label else np.full(count, np.nan)
    blank = bool(np.all(np.isnan(numbers)))
    if len(segments) == 1 and not blank:
        return None
    if blank:
        zero, step = (np.array([each.number(key, column) for each in segments]) for key in ("X0", "Delta_X"))
        if np.isnan(step).any():
            raise InputError(
                f"'{table.path}' states no Delta_X for '{table.labels[column]}', and no X_Value; export it with X_Value"
            )
        numbers = np.nan_to_num(zero)[segment] + (np.arange(count) - begins[segment]) * step[segment]
    moments = [start_of(each.start(column)) for each in segments]
    shift, before = 0.0, 0.0
    times = numbers.copy()
    for index, (begin, end) in enumerate(zip(begins, [*begins[1:], count], strict=True)):
        start, moment = moments[0], moments[index]
        if index and end > begin and numbers[begin] <= before and start and moment:
            shift = moment.seconds - start.seconds
            times[begin:end] += round(shift, 5)
        before = numbers[end - 1] if end > begin else before
    return times
