"""Artefacts as documents: JSON back and forth, hash, schema."""

import hashlib
import json
import math
from collections.abc import Iterable, Mapping
from typing import Any, BinaryIO

from dzdesign.core.errors import QUOTED, InputError

#: Lists and objects in one another; dzdesign's own artefacts have eight. Beyond some hundred, what reads or prints the
#: value would end in the interpreter's own limit, at a depth that depends on who called.
DEEPEST = 32
#: Bytes of a file that are hashed at a time.
PIECE = 1 << 20
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
    """Return the SHA-256 of `content` in hex."""
    return hashlib.sha256(content).hexdigest()


def sha256_of_file(file: BinaryIO) -> str:
    """Return the SHA-256 of a whole file in hex, read piece by piece; the file is at its beginning again then."""
    file.seek(0)
    digest = hashlib.sha256()
    while piece := file.read(PIECE):
        digest.update(piece)
    file.seek(0)
    return digest.hexdigest()


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
