"""JSON Schema of a type: what the page of the files shows, and what a message says was expected."""

from collections.abc import Iterator
from dataclasses import fields
from fractions import Fraction
from typing import Any

import msgspec

from dzdesign.core.artefact_types import Artefact, JsonText, schema_of
from dzdesign.core.options import field_docstrings

#: Node of a JSON Schema.
Node = dict[str, Any]
#: Numerator and denominator of an exact number: a double can still approximate what they give.
LARGEST_INTEGER = 10**60
#: A Fraction in JSON.
FRACTION: Node = {
    "type": "array",
    "prefixItems": [
        {"title": "numerator", "type": "integer", "minimum": -LARGEST_INTEGER, "maximum": LARGEST_INTEGER},
        {"title": "denominator", "type": "integer", "minimum": 1, "maximum": LARGEST_INTEGER},
    ],
    "items": False,
    "minItems": 2,
    "maxItems": 2,
}


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
