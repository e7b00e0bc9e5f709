"""The text of a file: its bytes enter, whole lines in UTF-8 leave, whatever the file is in.

A byte order mark tells the encoding (UTF-8, UTF-16); else it is UTF-8, else Windows-1252, which holds Latin-1 but for
control codes: what loggers in western Europe and America write. Rejected: to guess it from the frequency of letters, of
which a heading has too few.
"""

import codecs
import gzip
import io
import logging
import os
import re
import zlib
from pathlib import Path
from typing import BinaryIO

from dzdesign.core.errors import InputError

#: A text is read into memory at once: a larger one is refused. Twelve million rows of five columns have half a GiB.
LARGEST_TEXT, PIECE_BYTES = 1 << 32, 1 << 23
#: A gzip file that holds more than this many times its bytes, and `FREE_BYTES`, is made to fill a memory or a day:
#: of a recording, whose clock runs and whose meter is noisy, some five to fifteen times are usual.
LARGEST_RATIO, FREE_BYTES = 64, 1 << 26
#: Bytes that no text in Windows-1252 has: control codes, and the five that it leaves open.
NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x19\x1b\x7f\x81\x8d\x8f\x90\x9d]")
#: First bytes of what a spreadsheet program saves, and what it is.
WORKBOOKS = {b"PK": "an Excel workbook (xlsx) or a zip archive", b"\xd0\xcf\x11\xe0": "an Excel workbook (xls)"}
SAVE_AS_CSV = "; save it again as 'CSV UTF-8'"

logger = logging.getLogger(__name__)


def read_text(file: BinaryIO, path: Path) -> bytes:
    """Return the text of a file in UTF-8, without a byte order mark; every line but the last ends in a line feed.

    Raises
    ------
    InputError
        If it is no text, or too much of it.
    """
    data = _unpacked(file, path)
    _refuse_a_workbook(data, path)
    text = _in_utf_8(data, path)
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


def _refuse_a_workbook(data: bytes, path: Path) -> None:
    for mark, name in WORKBOOKS.items():
        if data.startswith(mark):
            raise InputError(
                f"'{path}' is {name}; in the spreadsheet program, save the sheet of the recording by 'Save as', 'CSV "
                "UTF-8', and give that file"
            )


def _in_utf_8(data: bytes, path: Path) -> bytes:
    """Return text in UTF-8, without a byte order mark."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        try:
            text = data.decode("utf-16").encode()
        except UnicodeError as error:
            reason = getattr(error, "reason", error)
            raise InputError(f"'{path}' begins as UTF-16 and is not ({reason}){SAVE_AS_CSV}") from error
        logger.debug("'%s' is text in UTF-16", path)
        return text
    marked = data.startswith(codecs.BOM_UTF8)
    if not data.isascii():
        try:
            data.decode()
        except UnicodeDecodeError as error:
            if marked or not data[: error.start].isascii():
                raise InputError(
                    f"'{path}' is not a text file in UTF-8 throughout (byte {error.start + 1}){SAVE_AS_CSV}"
                ) from error
            return _from_windows(data, path)
    return data.removeprefix(codecs.BOM_UTF8)


def _from_windows(data: bytes, path: Path) -> bytes:
    bad = NO_TEXT.search(data)
    if bad:
        raise InputError(
            f"'{path}' is not a text file, neither in UTF-8 nor in Windows-1252 (byte {bad.start() + 1}){SAVE_AS_CSV}"
        )
    logger.debug("'%s' is text in Windows-1252", path)
    return data.decode("cp1252").encode()
