"""The JSON Schemas of the artefacts, as the tests use them: validation, and documents made wrong in every place."""

import copy
from collections.abc import Iterator
from functools import cache
from typing import Any

from jsonschema import Draft202012Validator

from docs.generated import schema_document

#: Of no type that a schema here asks for beside "object" and "array".
OTHER = {"string": 1.5, "number": "1", "integer": "1", "boolean": "true", "array": {}, "object": []}


def resolved(schema: dict[str, Any], whole: dict[str, Any]) -> dict[str, Any]:
    """Return the schema that a reference is to; of a choice with null the other one."""
    if "anyOf" in schema and {"type": "null"} in schema["anyOf"]:
        schema = next(one for one in schema["anyOf"] if one != {"type": "null"})
    return whole["$defs"][schema["$ref"].removeprefix("#/$defs/")] if "$ref" in schema else schema


def closed(schema: Any) -> Any:
    """Return a schema in which an object has no keys but those that are described."""
    if isinstance(schema, list):
        return [closed(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    strict = {key: closed(value) for key, value in schema.items()}
    if schema.get("type") in ("object", ["object", "null"]) and "properties" in schema and "description" in schema:
        strict.setdefault("additionalProperties", False)
    return strict


@cache
def validator(name: str, every_key_described: bool) -> Draft202012Validator:
    """Return the validator of a schema, or of the same in which a key that is not described is an error."""
    schema = schema_document(name)
    if every_key_described:
        schema = closed(schema)
    return Draft202012Validator(schema)


def problems(name: str, document: Any, *, every_key_described: bool = True) -> list[str]:
    """Return what is wrong with a document, each with its place; a key that no schema describes is."""
    found = validator(name, every_key_described).iter_errors(document)
    return [f"{error.json_path}: {error.message}" for error in found]


def overlooked(name: str, document: Any, at_least: int = 1, apart: str = "") -> list[str]:
    """Return the faults of `wrong_documents` that the schema lets pass; there must be enough to try.

    Those within the key `apart`, which another schema has too, are not tried.
    """
    tried = [one for one in wrong_documents(name, document) if not apart or not one[0].startswith(f"{apart}.")]
    if len(tried) < at_least:
        return [f"{len(tried)} tried"]
    return [place for place, wrong in tried if validator(name, False).is_valid(wrong)]


def wrong_documents(name: str, document: Any) -> Iterator[tuple[str, Any]]:
    """Yield, for every required key and every value of a type, the document without it or with another type."""
    whole, document = schema_document(name), _short(document)
    for place, fault in _faults(whole, whole, document, ()):
        wrong = copy.deepcopy(document)
        parent = wrong
        for key in place[:-1]:
            parent = parent[key]
        if fault == "missing":
            del parent[place[-1]]
        else:
            parent[place[-1]] = fault
        yield f"{'.'.join(map(str, place))} {fault!r}", wrong


def _faults(schema: dict[str, Any], whole: dict[str, Any], value: Any, place: tuple) -> Iterator[tuple[tuple, Any]]:
    schema = resolved(schema, whole)
    kinds = schema.get("type", [])
    kinds = [kinds] if isinstance(kinds, str) else kinds
    if place and kinds and value is not None:
        yield place, OTHER[next(kind for kind in kinds if kind != "null")]
    if isinstance(value, dict):
        for key, item in value.items():
            its = schema.get("properties", {}).get(key, schema.get("additionalProperties"))
            if key in schema.get("required", ()):
                yield (*place, key), "missing"
            if isinstance(its, dict):
                yield from _faults(its, whole, item, (*place, key))
    elif isinstance(value, list) and value and isinstance(schema.get("items"), dict):
        yield from _faults(schema["items"], whole, value[0], (*place, 0))


def _short(value: Any) -> Any:
    """Return a document whose lists of objects end after the first: the others are of the same kind."""
    if isinstance(value, list):
        return [_short(item) for item in (value[:1] if value and isinstance(value[0], dict) else value)]
    return {key: _short(item) for key, item in value.items()} if isinstance(value, dict) else value
