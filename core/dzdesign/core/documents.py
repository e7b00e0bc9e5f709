"""Files of users, read or refused in one sentence without unbounded memory; documents in JSON and TOML, and their hash.

What is no regular file can be read only once. A shell's pipe is held in memory; a device is refused, for it may have no
end, and so is a pipe with a name in a folder, for it may have nobody at its other end.
"""

import contextlib
import hashlib
import json
import logging
import os
import stat
import tomllib
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from dzdesign.core.errors import InputError, neighbour, quoted

#: Largest file of options, plant or artefact, some hundred times the largest that dzdesign writes; read as JSON it
#: takes at most some thirty times as much memory.
MOST_DOCUMENT = 1 << 24
#: Largest recording that is held in memory whole.
MOST_RECORDING = 1 << 30
#: Largest recording from a pipe.
MOST_PIPED = 1 << 28
#: Git takes a file for binary that has a zero in so many octets at its beginning.
TEXT_SHOWS = 8000
#: Lists and objects in one another; dzdesign's own artefacts have eight. Beyond some hundred, what reads or prints the
#: value would end in the interpreter's own limit, at a depth that depends on who called.
DEEPEST = 32
#: Digits of a whole number: a double holds no more, and a part of a fraction has some sixty.
MOST_DIGITS = 300
#: Largest TOML file and longest row, octets: ten times what people write. The parser keeps the beginning of every part
#: of a dotted key: of one row of 64 kB it would make 4 GB, of such a file in rows of this length 0.5 GB.
MOST_OCTETS, LONGEST_ROW = 1 << 16, 1 << 13
#: What writes the artefacts that are given to another command, by the schema's name without its version.
WRITTEN_BY = {
    "dzdesign.valve": "dzdesign identify",
    "dzdesign.compensator": "dzdesign design",
    "dzdesign.firmware": "dzdesign codegen",
    "dzdesign.evidence": "dzdesign verify",
}

logger = logging.getLogger(__name__)


def read_bytes(path: Path, what: str) -> bytes:
    """Read a whole document (options, plant, artefact), or say in one sentence why that fails; `what` names it."""
    with open_bytes(path, what) as file:
        content = file.read(MOST_DOCUMENT + 1)
    if len(content) > MOST_DOCUMENT:
        raise InputError(
            f"{what} '{path}' is larger than {MOST_DOCUMENT >> 20} MiB, which none is; check that it is the right file"
        )
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


@contextlib.contextmanager
def open_bytes(path: Path, what: str) -> Iterator[BinaryIO]:
    """Open a file that may be larger than memory, or say in one sentence why it can't be read; `what` names it.

    One that is changed until the context is left is refused: what was computed of it is then of no one file.
    """
    file = _opened(path, what)
    with file:
        logger.debug("reading %s '%s'", what, path)
        before = _stamp(file)
        try:
            yield file
        except OSError as error:  # a disk that fails, a share that is gone
            raise InputError(f"{what} '{path}' can't be read: {reason_of(error)}") from error
        except InputError:  # whatever is wrong with a file that is still being written
            if _stamp(file) == before:
                raise
        if _stamp(file) != before:
            raise InputError(f"{what} '{path}' was changed while it was read; wait until it is written, then try again")


def _opened(path: Path, what: str) -> BinaryIO:
    try:
        mode = os.stat(path).st_mode
        if stat.S_ISFIFO(mode) and os.fspath(path).startswith(("/dev/", "/proc/")):  # as of <(zcat a.gz)
            return _piped(path, what)
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # opening a folder says that it is one
            raise InputError(f"{what} '{path}' is a device, a pipe or a socket, expected a file")
        return open(path, "rb")
    except (FileNotFoundError, NotADirectoryError) as error:
        raise InputError(f"{what} '{path}' does not exist{neighbour(path)}; check the name and the folder") from error
    except (OSError, ValueError) as error:
        if isinstance(error, OSError) and os.path.isdir(path):  # Windows calls reading a folder a lack of permission
            raise InputError(f"{what} '{path}' is a folder, expected a file") from error
        raise InputError(f"{what} '{path}' can't be read: {reason_of(error)}") from error


def _piped(path: Path, what: str) -> BinaryIO:
    with open(path, "rb") as pipe:
        content = pipe.read(MOST_PIPED + 1)
    if len(content) > MOST_PIPED:
        raise InputError(
            f"{what} '{path}' is a pipe with more than {MOST_PIPED >> 20} MiB; write that to a file and give the file"
        )
    return BytesIO(content)


def _stamp(file: BinaryIO) -> tuple[int, int]:
    if isinstance(file, BytesIO):
        return 0, 0
    found = os.fstat(file.fileno())
    return found.st_size, found.st_mtime_ns


def reason_of(error: OSError | ValueError) -> str:
    """Return why a file can't be read or written: the system's own words, where it has some."""
    if isinstance(error, ValueError) and "embedded null" in str(error):  # each version of Python words it otherwise
        return "a file's name has no NUL character"
    return getattr(error, "strerror", None) or str(error)


def json_object(path: Path) -> dict[str, Any] | None:
    """Return the JSON object that a file holds, or None if it holds anything else; a long measurement is not read."""
    try:
        if not path.is_file() or path.stat().st_size > MOST_DOCUMENT:
            return None
        document = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return document if isinstance(document, dict) else None


def sha256_of(content: bytes) -> str:
    """Return the SHA-256 of what a file says, in hex: the same after a checkout that rewrites line endings.

    JSON counts without its spacing and the order of its keys, other text with line feeds alone, and what git takes for
    binary as it is.

    Examples
    --------
    >>> sha256_of(b"a\\r\\nb\\n") == sha256_of(b"a\\nb\\n"), sha256_of(b'{"a": 1.0}') == sha256_of(b'{ "a": 1 }\\r\\n')
    (True, True)
    """
    return sha256_of_file(BytesIO(content))


def sha256_of_octets(content: bytes) -> str:
    """Return the SHA-256 of octets as they are, in hex: of what is built here, and not kept."""
    return hashlib.sha256(content).hexdigest()


def sha256_of_file(file: BinaryIO) -> str:
    """Return what `sha256_of` returns of a file of any size; the file is at its beginning again then."""
    file.seek(0)
    piece = file.read(MOST_DOCUMENT + 1)
    digest, is_text = hashlib.sha256(), b"\0" not in piece[:TEXT_SHOWS]
    if piece.lstrip()[:1] == b"{" and len(piece) <= MOST_DOCUMENT:
        with contextlib.suppress(ValueError, RecursionError):
            document = json.loads(piece.decode("utf-8"), parse_float=_shortest)
            piece = json.dumps(document, sort_keys=True, separators=(",", ":")).encode()
    while piece:
        while piece.endswith(b"\r") and (more := file.read(1)):  # a line's end is not taken apart
            piece += more
        digest.update(piece.replace(b"\r\n", b"\n") if is_text else piece)
        piece = file.read(MOST_DOCUMENT)
    file.seek(0)
    return digest.hexdigest()


def _shortest(text: str) -> float | int:
    value = float(text)
    return int(value) if value.is_integer() else value


def to_json(document: Mapping[str, Any]) -> str:
    """Return the document as JSON text; a NaN or an infinity is an error, never written."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def parse_document(content: bytes, source: str, schemas: tuple[str, ...]) -> dict[str, Any]:
    """Read a JSON artefact and check that its schema is one of `schemas`.

    Refused is what is not a JSON object in UTF-8, holds a key twice or what can't be written again (NaN, half a
    character), or has another schema.
    """
    commands = {schema: written_by(schema) for schema in schemas}
    expected = " or ".join(f"{schema} (which `{by}` writes)" if by else schema for schema, by in commands.items())
    try:
        # JSON in UTF-16, or after a byte order mark, would be read here and stumbled over later.
        text = content.decode("utf-8")
        document: dict[str, Any] = json.loads(
            text, parse_int=_whole_number, parse_constant=_no_number, object_pairs_hook=_unique_keys
        )
        _refuse_deep(document)
        json.dumps(document, ensure_ascii=False, allow_nan=False).encode()
    except (ValueError, RecursionError) as error:
        raise InputError(f"'{source}' is not JSON ({error}); expected an artefact of schema {expected}") from error
    found = document.get("schema") if isinstance(document, dict) else None
    found = found if isinstance(found, str) else quoted(found)
    if found in schemas:
        return document
    command = next((by for schema, by in commands.items() if by and family_of(found) == family_of(schema)), None)
    remedy = f"make it again with `{command}` of this version" if command else "give another file"
    raise InputError(f"'{source}' has the schema {quoted(found)}, expected {expected}; {remedy}")


def _refuse_deep(document: Any) -> None:
    level = [document]
    for _ in range(DEEPEST):
        values = [value for value in level if isinstance(value, dict | list)]
        level = [item for value in values for item in (value.values() if isinstance(value, dict) else value)]
    if level:
        raise ValueError(f"it nests lists and objects more than {DEEPEST} deep")


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is not a number of JSON")


def _whole_number(text: str) -> int:
    if len(text) > MOST_DIGITS:
        raise ValueError(f"it holds a whole number of {len(text)} digits, of {MOST_DIGITS} at most")
    return int(text)


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"the key {key[:40]!r} is there twice")
        found[key] = value
    return found


def family_of(schema: object) -> str:
    """Return a schema's name without its version: ``dzdesign.valve`` of ``dzdesign.valve/1``."""
    return str(schema).partition("/")[0]


def written_by(schema: str) -> str | None:
    """Return the command that writes artefacts of a schema, or None of one that no other command takes.

    Examples
    --------
    >>> written_by("dzdesign.valve/1")
    'dzdesign identify'
    """
    return WRITTEN_BY.get(family_of(schema))


def read_toml(content: bytes, source: str, expected: str, parse_float: Callable[[str], Any] = float) -> dict[str, Any]:
    """Return the content of a TOML file in UTF-8; what is none, or too large, is an `InputError`.

    `source` names the file, `expected` says what was expected in it, for the message.
    """
    try:
        if len(content) > MOST_OCTETS:
            raise ValueError(f"it is larger than {MOST_OCTETS >> 10} KiB")
        for row, octets in enumerate(content.split(b"\n"), start=1):
            if len(octets) > LONGEST_ROW:
                raise ValueError(f"row {row} is longer than {LONGEST_ROW >> 10} KiB; break it, or make it a table")
        return tomllib.loads(content.decode("utf-8-sig"), parse_float=parse_float)
    except (ValueError, RecursionError) as error:
        reason = str(error).partition("; use sys.")[0]  # Python's advice to a programmer
        raise InputError(f"'{source}' is not TOML: {reason}; expected {expected}") from error
