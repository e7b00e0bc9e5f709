"""Reading of user files: each is opened or read, or one sentence says why not, without unbounded memory.

What is no regular file can be read only once. A pipe is held in memory, `MOST_PIPED` bytes of it; a device is refused,
for it may have no end.
"""

import contextlib
import io
import json
import logging
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from dzdesign.core.errors import InputError, neighbour

#: Largest file of options, plant or artefact, some hundred times the largest that dzdesign writes; read as JSON it
#: takes at most some thirty times as much memory.
MOST_DOCUMENT = 1 << 24
#: Largest recording that is held in memory whole.
MOST_RECORDING = 1 << 30
#: Largest recording from a pipe.
MOST_PIPED = 1 << 28

logger = logging.getLogger(__name__)


def read_bytes(path: Path, what: str) -> bytes:
    """Read a whole document (options, plant, artefact), or say in one sentence why that fails; `what` names it."""
    with _refusing(path, what):
        if _is_pipe(path, what):
            return _piped(path, what, MOST_DOCUMENT)
        with open(path, "rb") as file:
            content = file.read(MOST_DOCUMENT + 1)
    if len(content) > MOST_DOCUMENT:
        raise InputError(
            f"{what} '{path}' is larger than {MOST_DOCUMENT >> 20} MiB, which none is; check that it is the right file"
        )
    logger.debug("read %s '%s', %d bytes", what, path, len(content))
    return content


def read_recording(path: Path, what: str) -> bytes:
    """Read a whole recording, which may be far larger than a document; `what` names it."""
    with open_bytes(path, what) as file:
        content = file.read(MOST_RECORDING + 1)
    if len(content) > MOST_RECORDING:
        raise InputError(
            f"{what} '{path}' is larger than {MOST_RECORDING >> 20} MiB, too large to be handed to a process of a "
            "batch; compress it, thin it out, or give it to `dzdesign identify`"
        )
    return content


def json_object(path: Path) -> dict[str, Any] | None:
    """Return the JSON object that a file holds, or None if it holds anything else; a long measurement is not read."""
    try:
        if not path.is_file() or path.stat().st_size > MOST_DOCUMENT:
            return None
        document = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return document if isinstance(document, dict) else None


def reason_of(error: OSError | ValueError) -> str:
    """Return why a file can't be read or written: the system's own words, where it has some."""
    if isinstance(error, ValueError) and "embedded null" in str(error):  # each version of Python words it otherwise
        return "a file's name has no NUL character"
    return getattr(error, "strerror", None) or str(error)


@contextlib.contextmanager
def open_bytes(path: Path, what: str) -> Iterator[BinaryIO]:
    """Open a recording that may be larger than memory, or say in one sentence why it can't be read; `what` names it.

    One that is changed until the context is left is refused: what was computed of it is then of no one file.
    """
    with _refusing(path, what):
        piped = _is_pipe(path, what)
        file = io.BytesIO(_piped(path, what, MOST_PIPED)) if piped else open(path, "rb")  # noqa: SIM115
    with file:
        logger.debug("reading %s '%s'", what, path)
        before = None if piped else _stamp(file)
        try:
            yield file
        except OSError as error:  # a disk that fails, a share that is gone
            raise InputError(f"{what} '{path}' can't be read: {error.strerror or error}") from error
        except InputError:  # whatever is wrong with a file that is still being written
            _refuse_a_changed_file(file, before, path, what)
            raise
        _refuse_a_changed_file(file, before, path, what)


def _refuse_a_changed_file(file: BinaryIO, before: tuple[int, int] | None, path: Path, what: str) -> None:
    if before is not None and _stamp(file) != before:
        raise InputError(f"{what} '{path}' was changed while it was read; wait until it is written, then try again")


def _stamp(file: BinaryIO) -> tuple[int, int]:
    found = os.fstat(file.fileno())
    return found.st_size, found.st_mtime_ns


def _is_pipe(path: Path, what: str) -> bool:
    """Tell a shell's pipe, as of ``<(zcat a.gz)``, from a regular file; refuse what is neither.

    A pipe with a name in a folder may have nobody at its other end, and whoever opens it waits for ever.
    """
    mode = os.stat(path).st_mode
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode):  # opening a folder says that it is one
        return False
    if stat.S_ISFIFO(mode) and os.fspath(path).startswith(("/dev/", "/proc/")):
        return True
    raise InputError(f"{what} '{path}' is a device, a pipe or a socket, expected a file")


def _piped(path: Path, what: str, most: int) -> bytes:
    """Return what a pipe gives until its end."""
    with open(path, "rb") as pipe:
        content = pipe.read(most + 1)
    if len(content) > most:
        raise InputError(
            f"{what} '{path}' is a pipe with more than {most >> 20} MiB; write that to a file and give the file"
        )
    return content


@contextlib.contextmanager
def _refusing(path: Path, what: str) -> Iterator[None]:
    try:
        yield
    except (FileNotFoundError, NotADirectoryError) as error:
        raise InputError(f"{what} '{path}' does not exist{neighbour(path)}; check the name and the folder") from error
    except OSError as error:
        if os.path.isdir(path):  # Windows calls reading a folder a lack of permission
            raise InputError(f"{what} '{path}' is a folder, expected a file") from error
        raise InputError(f"{what} '{path}' can't be read: {error.strerror}") from error
    except ValueError as error:  # a name with a NUL, from a TOML file
        raise InputError(f"{what} '{path}' can't be read: {reason_of(error)}") from error
