"""Artefacts as documents: JSON back and forth, hash, schema."""

import contextlib
import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from io import BytesIO
from typing import Any, BinaryIO

from dzdesign.core.errors import QUOTED, InputError

#: Lists and objects in one another; dzdesign's own artefacts have eight. Beyond some hundred, what reads or prints the
#: value would end in the interpreter's own limit, at a depth that depends on who called.
DEEPEST = 32
#: Bytes of a file that are hashed at a time.
PIECE = 1 << 20
#: Largest JSON of which the content is hashed, as large as an artefact may be.
MOST_JSON = 1 << 24
#: Git takes a file for binary that has a zero in so many octets at its beginning.
TEXT_SHOWS = 8000
#: Digits of a whole number; a part of a fraction has some sixty.
MOST_DIGITS = 1000
#: What writes the artefacts that are given to another command, by the schema's name without its version.
WRITTEN_BY = {
    "dzdesign.valve": "dzdesign identify",
    "dzdesign.compensator": "dzdesign design",
    "dzdesign.firmware": "dzdesign codegen",
    "dzdesign.evidence": "dzdesign verify",
}


def sha256_of(content: bytes) -> str:
    """Return the SHA-256 of what a file says, in hex: the same after a checkout that rewrites line endings.

    JSON counts without its spacing and the order of its keys, other text with line feeds alone, and what git takes for
    binary as it is.

    Examples
    --------
    >>> sha256_of(b"a\\r\\nb\\n") == sha256_of(b"a\\nb\\n"), sha256_of(b'{"a": 1.0}') == sha256_of(b'{ "a": 1 }\\r\\n')
    (True, True)
    """
    if content.lstrip()[:1] == b"{" and len(content) <= MOST_JSON:
        with contextlib.suppress(ValueError, RecursionError):
            document = json.loads(content.decode("utf-8"), parse_float=_shortest)
            return sha256_of_octets(json.dumps(document, sort_keys=True, separators=(",", ":")).encode())
    return _sha256_of_pieces(BytesIO(content))


def sha256_of_octets(content: bytes) -> str:
    """Return the SHA-256 of octets as they are, in hex: of what is built here, and not kept."""
    return hashlib.sha256(content).hexdigest()


def sha256_of_file(file: BinaryIO) -> str:
    """Return what `sha256_of` returns of a file of any size; the file is at its beginning again then."""
    file.seek(0)
    content = file.read(MOST_JSON + 1) if file.read(PIECE).lstrip()[:1] == b"{" and not file.seek(0) else b""
    file.seek(0)
    digest = sha256_of(content) if 0 < len(content) <= MOST_JSON else _sha256_of_pieces(file)
    file.seek(0)
    return digest


def _sha256_of_pieces(file: BinaryIO) -> str:
    digest, piece = hashlib.sha256(), file.read(PIECE)
    is_text = b"\0" not in piece[:TEXT_SHOWS]
    while piece:
        while piece.endswith(b"\r") and (more := file.read(1)):  # a line's end is not taken apart
            piece += more
        digest.update(piece.replace(b"\r\n", b"\n") if is_text else piece)
        piece = file.read(PIECE)
    return digest.hexdigest()


def _shortest(text: str) -> float | int:
    value = float(text)
    return int(value) if value.is_integer() else value


def to_json(document: Mapping[str, Any]) -> str:
    """Return the document as JSON text; a NaN or an infinity is an error, never written."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is not a number of JSON")


def _number(text: str) -> float:
    value = float(text)
    if math.isinf(value):
        raise ValueError(f"the number {text[:QUOTED]} is too large")
    return value


def _whole_number(text: str) -> int:
    if len(text) > MOST_DIGITS:
        raise ValueError(f"it holds a whole number of {len(text)} digits, of {MOST_DIGITS} at most")
    return int(text)


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {twice[:40]!r} is there twice")
    return found


def parse_document(content: bytes, source: str, schemas: tuple[str, ...]) -> dict[str, Any]:
    """Read a JSON artefact and check that its schema is one of `schemas`.

    Refused is what is not a JSON object in UTF-8, holds a key twice or what can't be written again (NaN, half a
    character), or has another schema.
    """
    expected = " or ".join(f"{schema}{_writer(schema)}" for schema in schemas)
    try:
        # JSON in UTF-16, or after a byte order mark, would be read here and stumbled over later.
        document = json.loads(
            content.decode("utf-8"),
            parse_constant=_no_number,
            parse_float=_number,
            parse_int=_whole_number,
            object_pairs_hook=_unique_keys,
        )
        _refuse_deep(document)
        if b"\\u" in content:  # half a character, which can't be written again
            json.dumps(document, ensure_ascii=False).encode()
    except (ValueError, RecursionError) as error:
        raise InputError(f"'{source}' is not JSON ({error}); expected an artefact of schema {expected}") from error
    found = None
    if isinstance(document, dict):
        found = document.get("schema")
        if found in schemas:
            return document
    same_kind = next((schema for schema in schemas if family_of(found) == family_of(schema)), None)
    command = written_by(same_kind) if same_kind else None
    remedy = f"make it again with `{command}` of this version" if command else "give another file"
    raise InputError(f"'{source}' has the schema {str(found)[:QUOTED]!r}, expected {expected}; {remedy}")


def family_of(schema: object) -> str:
    """Return a schema's name without its version: ``dzdesign.valve`` of ``dzdesign.valve/1``."""
    return str(schema).partition("/")[0]


def _writer(schema: str) -> str:
    command = written_by(schema)
    return f" (which `{command}` writes)" if command else ""


def written_by(schema: str) -> str | None:
    """Return the command that writes artefacts of a schema, or None of one that no other command takes.

    Examples
    --------
    >>> written_by("dzdesign.valve/1")
    'dzdesign identify'
    """
    return WRITTEN_BY.get(family_of(schema))


def _refuse_deep(document: Any) -> None:
    level = [document]
    for _ in range(DEEPEST):
        level = [item for value in level if isinstance(value, dict | list) for item in _items(value)]
        if not level:
            return
    raise ValueError(f"it nests lists and objects more than {DEEPEST} deep")


def _items(value: dict[str, Any] | list[Any]) -> Iterable[Any]:
    return value.values() if isinstance(value, dict) else value
