"""Files of text: CSV of any delimiter, plain or gzip, with decimal point or comma; an open file in, a `TextTable` out.

What is no text, or too much of it, is refused by name. Rows that look as samples do are taken as they are, all at once;
each other line is looked at.
"""

import codecs
import gzip
import io
import logging
import os
import re
import zlib
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.logger_blocks import with_stated_times, without_blocks
from dzdesign.identify.reading.table import QUOTED_CHARACTERS
from dzdesign.identify.reading.text_header import ASIDE, BLANKS, MOST_LINES, Header, cells_of, find_header, is_value
from dzdesign.identify.reading.text_table import TextTable, is_number

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
    text = _from_utf_16(data, path) if is_utf_16 else _in_utf_8(data, path)
    if b"\0" in text or CELL_END.encode() in text:
        raise InputError(
            f"'{path}' is UTF-16 without a byte order mark, or no text at all, expected UTF-8{SAVE_AS_CSV}"
        )
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
            raise _wrong_row(cells, number, header, path, above=index < first)
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
