"""Reads an artefact from JSON into its type; what is wrong is named: file, key, what was expected, what was found.

What was expected is in the JSON Schema of the type, which is also what the page of the files shows.
"""

import logging
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from fractions import Fraction
from typing import Any, TypeVar

import msgspec
from msgspec import ValidationError, convert

from dzdesign.core.artefact_types import Artefact, JsonText, as_document, own_result, schema_of
from dzdesign.core.documents import parse_document, written_by
from dzdesign.core.errors import InputError, and_more, quoted
from dzdesign.core.options import field_docstrings

#: Keys of a file that a log message names.
MOST_NAMED = 5
#: A message of msgspec: what is wrong, and where; a key of a mapping stands there as ``[...]``.
MESSAGE = re.compile(r"(?P<what>.*?)(?: - at `(?P<is_key>key` in `)?\$(?P<path>.*)`)?", re.DOTALL)
MISSING_KEY = re.compile(r"Object missing required field `(.*)`")
STEP = re.compile(r"\.([^.\[]+)|\[(\d+)\]|(\[\.\.\.\])")
ANY_KEY = "[...]"
#: Numerator and denominator of an exact number: a double can still approximate what they give.
LARGEST_INTEGER = 10**60
#: A Fraction in JSON.
FRACTION: dict[str, Any] = {
    "type": "array",
    "prefixItems": [
        {"title": "numerator", "type": "integer", "minimum": -LARGEST_INTEGER, "maximum": LARGEST_INTEGER},
        {"title": "denominator", "type": "integer", "minimum": 1, "maximum": LARGEST_INTEGER},
    ],
    "items": False,
    "minItems": 2,
    "maxItems": 2,
}

AnArtefact = TypeVar("AnArtefact", bound=Artefact)
#: An artefact, or a dataclass in one.
Stored = TypeVar("Stored")
Path = list[str | int]
#: Node of a JSON Schema.
Node = dict[str, Any]

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
    raise _MisfitError


class _MisfitError(ValueError):
    """A value is not what the schema says; its words are in the schema."""


def _sentence(error: ValidationError, document: dict[str, Any], kind: type[Artefact]) -> str:
    """Return in our words what msgspec found wrong in a document, which is taken apart in search of the place."""
    match = MESSAGE.fullmatch(str(error))
    what, is_key, steps = (match["what"], match["is_key"], match["path"] or "") if match else (str(error), None, "")
    path: Path = [name or (int(index) if index else ANY_KEY) for name, index, _ in STEP.findall(steps)]
    path = [*path, ANY_KEY] if is_key else path  # one of the keys of the mapping that the path leads to
    path = _with_keys(path, document, str(error), kind)
    if isinstance(error.__cause__, ValueError) and not isinstance(error.__cause__, _MisfitError):
        return f": '{_written(path)}': {what}" if path else f": {what}"
    if missing := MISSING_KEY.fullmatch(what):
        return f" lacks the key '{_written([*path, missing[1]])}'"
    schema = json_schema(kind)
    if is_key:
        expected = in_words({"type": "string", **node_at(schema, path[:-1]).get("propertyNames", {})})
        return f": '{_written(path[:-1])}' has the key {quoted(path[-1])}, expected {expected}"
    return f": '{_written(path)}' is {quoted(_value_at(document, path))}, expected {in_words(node_at(schema, path))}"


def _with_keys(path: Path, document: dict[str, Any], message: str, kind: type[Artefact]) -> Path:
    """Put the keys of mappings into a path: that one at which a mapping of it alone brings the same message."""
    while ANY_KEY in path:
        at = path.index(ANY_KEY)
        mapping = _value_at(document, path[:at])
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


def _value_at(document: Any, path: Path) -> Any:
    for step in path:
        document = document[step]
    return document


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


def json_schema(kind: type[Artefact]) -> Node:
    """Return the JSON Schema (draft 2020-12) of an artefact, with units, bounds and descriptions.

    Further keys are welcome in every object (no ``additionalProperties: false``), as they are to the reader; a rule
    between fields is not in it.
    """
    components = msgspec.json.schema(kind, schema_hook=_schema_of_other_types)["$defs"]
    definitions: dict[str, Node] = {name: _tidy(node) for name, node in components.items()}
    for found in _dataclasses(msgspec.inspect.type_info(kind)):
        node, names = definitions[found.__name__], [field.name for field in fields(found)]
        for name, sentence in field_docstrings(found).items():
            node["properties"][name] = {"description": "", **node["properties"][name]} | {"description": sentence}
        # In the order of the file, and each of them: a default is for who makes one in Python. A field that may be
        # unset stands in the file only where it says something.
        required = [field.name for field in fields(found) if field.default is not msgspec.UNSET]
        node |= {"properties": {name: node["properties"][name] for name in names}, "required": required}
    root = definitions.pop(kind.__name__)
    if "#/$defs/Fraction" in str((root, definitions)):
        definitions["Fraction"] = {"description": "An exact number.", **FRACTION}
    family, _, version = schema_of(kind).removeprefix("dzdesign.").partition("/")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": f"urn:dzdesign:schema:{family}:{version}",
        "title": kind.FILE_NAME,
        **root,
        "$defs": definitions,
    }


def node_at(schema: Node, path: list[str | int]) -> Node:
    """Return the node of the value at a path of keys and indices, without references and without "or null"."""
    node = _resolved(schema, schema)
    for step in path:
        if isinstance(step, int):
            positions = node.get("prefixItems", [])
            node = positions[step] if step < len(positions) else node["items"]
        else:
            node = node.get("properties", {}).get(step) or node["additionalProperties"]
        node = _resolved(node, schema)
    return node


def in_words(node: Node) -> str:
    """Return what a node of a schema asks for, such as "a number from 0 to 200 MPa".

    Examples
    --------
    >>> in_words({"type": "number", "minimum": 0, "maximum": 200, "unit": "MPa"})
    'a number from 0 to 200 MPa'
    >>> in_words({"enum": ["closing", "mean", "opening"]})
    "'closing', 'mean' or 'opening'"
    """
    if choices := node.get("enum", [node["const"]] if "const" in node else []):
        *most, last = [repr(value) for value in choices if value is not None]
        return f"{', '.join(most)} or {last}" if most else last
    kinds = node.get("type", "object")
    kind = kinds if isinstance(kinds, str) else kinds[0]
    match kind:
        case "number" | "integer":
            unit = f" {node['unit']}" if node.get("unit", "1") != "1" else ""
            return f"{'a number' if kind == 'number' else 'a whole number'}{_bounds_in_words(node)}{unit}"
        case "string":
            return _text_in_words(node)
        case "boolean":
            return "true or false"
        case "array":
            return _list_in_words(node)
    required = ", ".join(node.get("required", ()))
    return f"an object with {required}" if required else "an object"


def _bounds_in_words(node: Node) -> str:
    low, high = node.get("minimum"), node.get("maximum")
    above, below = node.get("exclusiveMinimum"), node.get("exclusiveMaximum")
    if low is not None and high is not None:
        return f" from {low:.12g} to {high:.12g}"
    words = ((above, "above"), (low, "of at least"), (high, "of at most"), (below, "below"))
    return "".join(f" {word} {bound:.12g}" for bound, word in words if bound is not None)


def _text_in_words(node: Node) -> str:
    if "pattern" in node:
        return f"text that matches {node['pattern']}"
    low, high = node.get("minLength", 0), node.get("maxLength")
    return f"text of {low} to {high} characters" if high is not None else "text that is not empty" if low else "text"


def _list_in_words(node: Node) -> str:
    low, high = node.get("minItems", 0), node.get("maxItems")
    titles = [str(item["title"]) for item in node.get("prefixItems", ()) if "title" in item]
    if titles:  # of a Fraction
        return f"[{', '.join(titles)}]: whole numbers of at most 60 digits, the {titles[-1]} above zero"
    if high is not None:
        return f"a list of {high} items" if low == high else f"a list of {low} to {high} items"
    return "a list that is not empty" if low == 1 else f"a list of at least {low} items" if low else "a list"


def _resolved(node: Node, schema: Node) -> Node:
    """Follow a reference, and of a choice with null take the other one."""
    if "anyOf" in node:
        node = next(one for one in node["anyOf"] if one != {"type": "null"})
    return schema["$defs"][node["$ref"].removeprefix("#/$defs/")] if "$ref" in node else node


def _schema_of_other_types(kind: type) -> Node:
    if kind is Fraction:
        return dict(FRACTION)
    if issubclass(kind, JsonText):
        return {"type": "string"}
    raise NotImplementedError  # msgspec then names the type


def _dataclasses(info: object) -> Iterator[type]:
    """Yield the dataclasses that a type is made of, some of them more than once."""
    if isinstance(info, msgspec.inspect.DataclassType):
        yield info.cls
    for name in getattr(info, "__struct_fields__", ()):
        value = getattr(info, name)
        for part in value if isinstance(value, tuple) else (value,):
            if isinstance(part, msgspec.inspect.Type | msgspec.inspect.Field):
                yield from _dataclasses(part)


def _tidy(node: Any) -> Any:
    """Return a node as a person would write it: a short description, and null as one of the types."""
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    node = {key: _tidy(value) for key, value in node.items()}
    if "properties" in node:  # of a class: its name is the definition's, and of its docstring the first paragraph
        node.pop("title", None)
        for value in node["properties"].values():
            value.pop("default", None)  # it stands in every file
        node["description"] = " ".join(node["description"].partition("\n\n")[0].split())
    match node:
        case {"prefixItems": [{"title": "numerator"}, _]}:
            about = {key: value for key, value in node.items() if key not in FRACTION}
            return {**about, "$ref": "#/$defs/Fraction"}
        case {"anyOf": [{"type": str(kind)} as one, {"type": "null"}], **rest}:
            return {**rest, **one, "type": [kind, "null"]}
        case {"anyOf": [{"enum": [*values]}, {"type": "null"}], **rest}:
            return {**rest, "enum": [*values, None]}
        case {"enum": [value], **rest}:
            return {**rest, "const": value}
    return node
