"""Text of a recording, block by block: an open file in, whole lines out, in UTF-8 whatever the file is in.

A byte order mark tells the encoding (UTF-8, UTF-16); else it is UTF-8, else Windows-1252, which holds Latin-1 but for
control codes: what loggers in western Europe and America write. Rejected: to guess it from the frequency of letters, of
which a heading has too few.
"""

import codecs
import gzip
import logging
import os
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, final

from dzdesign.core.errors import InputError

#: Bytes of text that are read at a time.
BLOCK_BYTES = 1 << 23
#: A gzip file that holds more than this many times its bytes, and `FREE_BYTES`, is made to fill a memory or a day:
#: of a recording, whose clock runs and whose meter is noisy, some five to fifteen times are usual.
LARGEST_RATIO, FREE_BYTES = 64, 1 << 26
#: Bytes that no text in Windows-1252 has: control codes, and the five that it leaves open.
NO_TEXT = re.compile(rb"[\x00-\x08\x0e-\x19\x1b\x7f\x81\x8d\x8f\x90\x9d]")
UTF_8, WINDOWS = "UTF-8", "Windows-1252"
UTF_8_MARK = codecs.BOM_UTF8
#: First bytes of what a spreadsheet program saves, and what it is.
WORKBOOKS = {b"PK": "an Excel workbook (xlsx) or a zip archive", b"\xd0\xcf\x11\xe0": "an Excel workbook (xls)"}
SAVE_AS_CSV = "; save it again as 'CSV UTF-8'"

logger = logging.getLogger(__name__)


def text_blocks(file: BinaryIO, path: Path) -> Iterator[bytes]:
    """Return whole lines that end in a line feed, some `BLOCK_BYTES` at a time, without a byte order mark.

    Parameters
    ----------
    file : binary file
        Text, plain or gzip.
    path : Path
        For messages.

    Raises
    ------
    InputError
        If it is no text, or has a line longer than a block.
    """
    encoding, rest, offset = _Encoding(path), b"", 0
    for data, last in _pieces(file, path):
        if not offset and not rest:
            _refuse_a_workbook(data, path)
        block = rest + encoding.begun(data, last)
        # The last end of line may be half of one: a carriage return whose line feed is still to come.
        end = len(block) if last else max(block.rfind(b"\n"), block.rfind(b"\r", 0, -1)) + 1
        lines = encoding.utf_8(block[:end] if end else block, offset)
        if not end and not last:
            raise InputError(f"'{path}' has a line of more than {len(block)} bytes; expected a table of numbers")
        # Not splitlines(): to an editor, whose line numbers the messages give, a form feed or U+0085 ends no line.
        yield lines.replace(b"\r\n", b"\n").replace(b"\r", b"\n") if b"\r" in lines else lines
        rest, offset = block[end:], offset + end


def _pieces(file: BinaryIO, path: Path) -> Iterator[tuple[bytes, bool]]:
    """Return the bytes of the text, `BLOCK_BYTES` at a time, and whether they are the last."""
    packed = file.read(2) == b"\x1f\x8b"
    file.seek(0)
    stream = gzip.GzipFile(fileobj=file) if packed else file
    most = FREE_BYTES + LARGEST_RATIO * _size(file) if packed else None
    count, last = 0, False
    while not last:
        try:
            data = stream.read(BLOCK_BYTES)
        except (gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise InputError(f"'{path}' is not a whole gzip file ({error}); copy it again") from error
        count, last = count + len(data), len(data) < BLOCK_BYTES
        if most is not None and count > most:
            raise InputError(
                f"'{path}' unpacks to more than {LARGEST_RATIO} times its size, as no recording does; give the "
                "recording itself, not packed"
            )
        yield data, last


def _size(file: BinaryIO) -> int:
    """Return how many bytes a file has, and go back to its beginning."""
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    return size


def _refuse_a_workbook(data: bytes, path: Path) -> None:
    for mark, name in WORKBOOKS.items():
        if data.startswith(mark):
            raise InputError(
                f"'{path}' is {name}; in the spreadsheet program, save the sheet of the recording by 'Save as', 'CSV "
                "UTF-8', and give that file"
            )


@final
class _Encoding:
    """The encoding of one file, as far as it is known: bytes of ASCII alone leave it open."""

    def __init__(self, path: Path) -> None:
        self._path, self._name = path, ""
        self._decoder: codecs.IncrementalDecoder | None = None
        self._begun = False
        self._mark = 0

    def begun(self, data: bytes, last: bool) -> bytes:
        """Return the next piece of the file: without its mark, and UTF-16 as UTF-8."""
        if not self._begun:
            self._begun = True
            if data.startswith(UTF_8_MARK):
                self._name, self._mark = UTF_8, len(UTF_8_MARK)
                return data[self._mark :]
            if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
                self._decoder = codecs.getincrementaldecoder("utf-16")()
                self._told("UTF-16")
        if self._decoder is None:
            return data
        try:
            return self._decoder.decode(data, last).encode()
        except UnicodeError as error:
            raise InputError(
                f"'{self._path}' begins as UTF-16 and is not ({_reason(error)}){SAVE_AS_CSV}"
            ) from error

    def utf_8(self, lines: bytes, offset: int) -> bytes:
        """Return lines in UTF-8; `offset` bytes stand before them in the file."""
        if not lines.isascii() and self._decoder is None:
            lines = self._decoded(lines, offset)
        if b"\0" in lines:
            raise InputError(
                f"'{self._path}' is UTF-16 without a byte order mark, or no text at all, expected UTF-8{SAVE_AS_CSV}"
            )
        return lines

    def _decoded(self, lines: bytes, offset: int) -> bytes:
        offset += self._mark
        if self._name != WINDOWS:
            try:
                lines.decode()
                self._name = UTF_8
                return lines
            except UnicodeDecodeError as error:
                if self._name == UTF_8:
                    raise InputError(
                        f"'{self._path}' is not a text file in UTF-8 throughout (byte {offset + error.start + 1})"
                        f"{SAVE_AS_CSV}"
                    ) from error
        bad = NO_TEXT.search(lines)
        if bad:
            raise InputError(
                f"'{self._path}' is not a text file, neither in UTF-8 nor in Windows-1252 "
                f"(byte {offset + bad.start() + 1}){SAVE_AS_CSV}"
            )
        if not self._name:
            self._told(WINDOWS)
        return lines.decode("cp1252").encode()

    def _told(self, name: str) -> None:
        self._name = name
        logger.debug("'%s' is text in %s", self._path, name)


def _reason(error: UnicodeError) -> str:
    return str(getattr(error, "reason", error))
