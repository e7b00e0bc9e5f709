"""Reads an artefact from JSON into its type; what is wrong is named: file, key, what was expected, what was found."""

import logging
import re
from collections.abc import Iterator, Sequence
from dataclasses import MISSING
from fractions import Fraction
from typing import Any, TypeVar

from msgspec import ValidationError, convert

from dzdesign.core.artefact_schema import LARGEST_INTEGER, in_words, json_schema, node_at
from dzdesign.core.artefact_types import Artefact, as_document, own_result, schema_of
from dzdesign.core.documents import parse_document, written_by
from dzdesign.core.errors import InputError, and_more, quoted

#: Keys of a file that a log message names.
MOST_NAMED = 5
#: A message of msgspec: what is wrong, and where; a key of a mapping stands there as ``[...]``.
MESSAGE = re.compile(r"(?P<what>.*?)(?: - at `(?P<is_key>key` in `)?\$(?P<path>.*)`)?", re.DOTALL)
MISSING_KEY = re.compile(r"Object missing required field `(.*)`")
STEP = re.compile(r"\.([^.\[]+)|\[(\d+)\]|(\[\.\.\.\])")
ANY_KEY = "[...]"

AnArtefact = TypeVar("AnArtefact", bound=Artefact)
#: An artefact, or a dataclass in one.
Stored = TypeVar("Stored")
Path = list[str | int]

logger = logging.getLogger(__name__)


def read_artefact(
    content: bytes, kind: type[AnArtefact] | Sequence[type[AnArtefact]], source: str, remedy: str | None = None
) -> AnArtefact:
    """Read an artefact; what is missing, does not fit or contradicts the rest is named, with the file and the key.

    Every key of the type must be there: a default is for who makes one in Python. Keys that the type does not know are
    ignored, and logged. A value that would be written in another way than it was read, such as a derived one that does
    not follow from the others, is refused: no value is changed silently.

    Of several kinds the schema in the file decides. A message ends with the remedy: unless one is given, to run the
    command again that writes such a file.
    """
    kinds = {schema_of(each): each for each in ([kind] if isinstance(kind, type) else kind)}
    document = parse_document(content, source, tuple(kinds))
    found = kinds[document["schema"]]
    command = written_by(document["schema"])
    remedy = remedy or found.REMEDY or (f"make it again with `{command}`" if command else "make it again")
    try:
        artefact = convert(document, found, dec_hook=_decoded)
    except ValidationError as error:
        raise InputError(f"{_sentence(error, document, found, source)}; {remedy}") from error
    except InputError as error:
        raise InputError(f"'{source}': {error}; {remedy}") from error
    unknown: list[str] = []
    for place, value, follows in _differences(document, as_document(artefact), "", unknown):
        if value is MISSING:
            raise InputError(f"'{source}' lacks the key '{place}'; {remedy}")
        raise InputError(
            f"'{source}': '{place}' is {quoted(value)}, but the rest of the file gives {quoted(follows)}; {remedy}"
        )
    if unknown:
        logger.info("'%s': keys without a meaning here are ignored: %s", source, and_more(unknown, MOST_NAMED))
    return artefact


@own_result()
def rounded(artefact: Stored, decimals: int) -> Stored:
    """Return an artefact, or a part of one, with every float in it rounded, as its file is to have them."""
    return convert(_rounded(as_document(artefact), decimals), type(artefact), dec_hook=_decoded)


def _rounded(value: Any, decimals: int) -> Any:
    if isinstance(value, float):
        return round(value, decimals)
    if isinstance(value, dict):
        return {key: _rounded(item, decimals) for key, item in value.items()}
    return [_rounded(item, decimals) for item in value] if isinstance(value, list | tuple) else value


def _decoded(kind: type, value: object) -> object:
    """Read what JSON has no type for."""
    if kind is not Fraction:
        raise NotImplementedError  # msgspec then names the type
    if isinstance(value, list) and [type(item) for item in value] == [int, int]:
        numerator, denominator = value
        if denominator > 0 and max(abs(numerator), denominator) <= LARGEST_INTEGER:
            return Fraction(numerator, denominator)
    raise _MisfitError


class _MisfitError(ValueError):
    """A value is not what the schema says; its words are in the schema."""


def _sentence(error: ValidationError, document: dict[str, Any], kind: type[Artefact], source: str) -> str:
    """Return in our words what msgspec found wrong in a document."""
    match = MESSAGE.fullmatch(str(error))
    what, is_key, steps = (match["what"], match["is_key"], match["path"] or "") if match else (str(error), None, "")
    path: Path = [name or (int(index) if index else ANY_KEY) for name, index, _ in STEP.findall(steps)]
    path = [*path, ANY_KEY] if is_key else path  # one of the keys of the mapping that the path leads to
    path = _with_keys(path, document, str(error), kind)
    if isinstance(error.__cause__, ValueError) and not isinstance(error.__cause__, _MisfitError):
        return f"'{source}': '{_written(path)}': {what}" if path else f"'{source}': {what}"
    if missing := MISSING_KEY.fullmatch(what):
        return f"'{source}' lacks the key '{_written([*path, missing[1]])}'"
    schema = json_schema(kind)
    if is_key:
        expected = in_words({"type": "string", **node_at(schema, path[:-1]).get("propertyNames", {})})
        return f"'{source}': '{_written(path[:-1])}' has the key {quoted(path[-1])}, expected {expected}"
    expected = in_words(node_at(schema, path))
    return f"'{source}': '{_written(path)}' is {quoted(_value_at(document, path))}, expected {expected}"


def _with_keys(path: Path, document: dict[str, Any], message: str, kind: type[Artefact]) -> Path:
    """Put the keys of mappings into a path: that one at which a mapping of it alone brings the same message."""
    while ANY_KEY in path:
        place = path[: path.index(ANY_KEY)]
        mapping = _value_at(document, place)
        for key, value in mapping.items():
            candidate = _replaced(document, place, {key: value})
            try:
                convert(candidate, kind, dec_hook=_decoded)
            except ValidationError as error:
                if str(error) == message:
                    path, document = [*place, key, *path[len(place) + 1 :]], candidate
                    break
        else:
            return place  # the fault is one of several keys together
    return path


def _value_at(document: Any, path: Path) -> Any:
    for step in path:
        document = document[step]
    return document


def _replaced(document: Any, path: Path, value: object) -> Any:
    """Return a document with another value at a path; the rest is shared."""
    if not path:
        return value
    changed: Any = list(document) if isinstance(document, list) else dict(document)
    changed[path[0]] = _replaced(document[path[0]], path[1:], value)
    return changed


def _written(path: Path) -> str:
    """Return a path as a message writes it: ``sides.positive.tests[2].dp_MPa``."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


def _differences(found: Any, written: Any, place: str, unknown: list[str]) -> Iterator[tuple[str, object, object]]:
    """Yield place, value and what would be written, of each that differs; collect keys that would not be written."""
    if isinstance(written, dict) and isinstance(found, dict):
        for key in written:
            if key not in found:
                yield f"{place}.{key}" if place else key, MISSING, written[key]
        for key, value in found.items():
            path = f"{place}.{key}" if place else key
            if key in written:
                yield from _differences(value, written[key], path, unknown)
            else:
                unknown.append(path)
    elif isinstance(written, list | tuple) and isinstance(found, list | tuple) and len(found) == len(written):
        for index, (one, other) in enumerate(zip(found, written, strict=True)):
            yield from _differences(one, other, f"{place}[{index}]", unknown)
    elif found != written:
        yield place, found, written
