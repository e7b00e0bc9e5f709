"""Files of text: an open file in, its lines out, decoded; what is no text, or too much of it, is refused by name."""

import codecs
import gzip
import io
import logging
import os
import re
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from dzdesign.core.errors import InputError

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
logger = logging.getLogger(__name__)


def read_lines(file: BinaryIO, path: Path) -> "pl.Series":
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
    if b"\0" in text:
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
