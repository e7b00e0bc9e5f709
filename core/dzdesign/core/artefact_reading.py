"""Reads an artefact from JSON into its type; what is wrong is named: file, key, what was found, what was expected."""

import logging
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from fractions import Fraction
from typing import Any, TypeVar

from msgspec import ValidationError, convert

from dzdesign.core.artefact_types import Artefact, RuleError, as_document, own_result, schema_of
from dzdesign.core.documents import parse_document, written_by
from dzdesign.core.errors import InputError, and_more, quoted

#: Keys of a file that a log message names.
MOST_NAMED = 5
#: A message of msgspec: what is wrong, and where; a key of a mapping stands there as ``[...]``.
MESSAGE = re.compile(r"(?P<what>.*?)(?: - at `(?P<is_key>key` in `)?\$(?P<path>.*)`)?", re.DOTALL)
MISSING_KEY = re.compile(r"Object missing required field `(.*)`")
STEP = re.compile(r"\.([^.\[]+)|\[(\d+)\]|(\[\.\.\.\])")
ANY_KEY = "[...]"
#: Numerator and denominator of an exact number: a double can still approximate what they give.
LARGEST_INTEGER = 10**60

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
        raise InputError(f"'{source}'{_sentence(error, document, found)}; {remedy}") from error
    except InputError as error:
        raise InputError(f"'{source}': {error}; {remedy}") from error
    unknown = []
    for each in differences(document, as_document(artefact)):
        if each.follows is NOTHING:
            unknown.append(each.place)
        elif each.stated is NOTHING:
            raise InputError(f"'{source}' lacks the key '{each.place}'; {remedy}")
        else:
            raise InputError(
                f"'{source}': '{each.place}' is {quoted(each.stated)}, but the rest of the file gives "
                f"{quoted(each.follows)}; {remedy}"
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
    raise ValueError("expected [numerator, denominator]: whole numbers up to 60 digits, the denominator above zero")


def _sentence(error: ValidationError, document: dict[str, Any], kind: type[Artefact]) -> str:
    """Return what msgspec found wrong in a document, which is taken apart in search of the place."""
    match = MESSAGE.fullmatch(str(error))
    what, is_key, steps = (match["what"], match["is_key"], match["path"] or "") if match else (str(error), None, "")
    path: Path = [name or (int(index) if index else ANY_KEY) for name, index, _ in STEP.findall(steps)]
    path = [*path, ANY_KEY] if is_key else path  # one of the keys of the mapping that the path leads to
    path = _with_keys(path, document, str(error), kind)
    if isinstance(error.__cause__, RuleError):
        return f": '{_written(path)}': {what}" if path else f": {what}"
    if missing := MISSING_KEY.fullmatch(what):
        return f" lacks the key '{_written([*path, missing[1]])}'"
    what = re.sub("^Invalid enum.*", "expected another word", what).replace("`", "").replace("Expected", "expected", 1)
    if is_key:
        return f": '{_written(path[:-1])}' has the key {quoted(path[-1])}, {what}"
    value: Any = document
    for step in path:
        value = value[step]
    return f": '{_written(path)}' is {quoted(value)}, {what}"


def _with_keys(path: Path, document: dict[str, Any], message: str, kind: type[Artefact]) -> Path:
    """Put the keys of mappings into a path: that one at which a mapping of it alone brings the same message."""
    while ANY_KEY in path:
        at = path.index(ANY_KEY)
        mapping: Any = document
        for step in path[:at]:
            mapping = mapping[step]
        entries = dict(mapping)
        for key, value in entries.items():
            mapping.clear()
            mapping[key] = value
            try:
                convert(document, kind, dec_hook=_decoded)
            except ValidationError as error:
                if str(error) == message:
                    path = [*path[:at], key, *path[at + 1 :]]
                    break
        else:  # the fault is one of several keys together
            mapping |= entries
            return path[:at]
    return path


def _written(path: Path) -> str:
    """Return a path as a message writes it: ``sides.positive.tests[2].dp_MPa``."""
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


class _Nothing:
    """Stands for the value of a key that is not there."""

    def __repr__(self) -> str:
        return "nothing"


NOTHING = _Nothing()


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """A place such as ``sides.positive.tests[2].dp_MPa``, what is stated there and what follows."""

    place: str
    stated: object
    follows: object


def differences(stated: object, follows: object, *, rounding: float = 0.0, place: str = "") -> Iterator[Difference]:
    """Yield each place where two values of the same structure differ, such as two artefacts of one type.

    Two floats are one if they differ by `rounding` at most, or by that share of the larger one; without it only equal
    ones are. A key that one of both lacks is `NOTHING` there.

    Examples
    --------
    >>> [each.place for each in differences({"a": [1.0, 2.0]}, {"a": [1.0, 2.1], "b": 1})]
    ['a[1]', 'b']
    >>> list(differences(1.0, 1.0 + 1e-9, rounding=1e-6)), len(list(differences(1.0, 1.0 + 1e-9)))
    ([], 1)
    """
    if stated == follows:
        return
    if is_dataclass(stated) and type(stated) is type(follows):
        stated, follows = ({field.name: getattr(one, field.name) for field in fields(one)} for one in (stated, follows))
    if isinstance(stated, Mapping) and isinstance(follows, Mapping):
        for key in {**follows, **stated}:
            path = f"{place}.{key}" if place else key
            yield from differences(stated.get(key, NOTHING), follows.get(key, NOTHING), rounding=rounding, place=path)
    elif isinstance(stated, list | tuple) and isinstance(follows, list | tuple) and len(stated) == len(follows):
        for index, (one, other) in enumerate(zip(stated, follows, strict=True)):
            yield from differences(one, other, rounding=rounding, place=f"{place}[{index}]")
    elif not (
        isinstance(stated, float)  # True and False are none
        and isinstance(follows, float)
        and math.isclose(stated, follows, rel_tol=rounding, abs_tol=rounding)
    ):
        yield Difference(place=place, stated=stated, follows=follows)
