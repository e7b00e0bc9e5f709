"""An artefact declared as a type: it is read, written and described, and every fault in a file is named."""

import json
import logging
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from types import MappingProxyType
from typing import Annotated, ClassVar, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from msgspec import Meta

from docs.generated import json_schema
from dzdesign.core.artefact_files import write_files
from dzdesign.core.artefact_reading import LARGEST_INTEGER, read_artefact
from dzdesign.core.artefact_types import (
    THIS_TOOL,
    Artefact,
    RuleError,
    SourceFile,
    as_document,
    quantity,
    to_json_bytes,
)
from dzdesign.core.documents import DEEPEST, MOST_DIGITS
from dzdesign.core.errors import InputError

REMEDY = "measure it again"


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One point of a pump's curve.

    Nothing of this second paragraph reaches the schema.
    """

    p_MPa: Annotated[float, quantity("MPa", "Pressure.", ge=0, le=200)]
    q_L_min: Annotated[float, quantity("L/min", "Flow.", ge=0)] | None
    note: Annotated[Literal["stable", "drifts"] | None, Meta(description="How it was read.")] = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Points at one speed, pressures rising."""

    points: Annotated[tuple[Point, ...], Meta(description="At rising pressure.", min_length=1)]
    gain: Annotated[Fraction, quantity("L/min/MPa", "Slope at the first point.")]
    spares: Annotated[
        Mapping[Annotated[str, Meta(min_length=1, max_length=3)], int], Meta(description="Part to its number in stock.")
    ] = field(default_factory=dict)
    range_MPa: Annotated[tuple[float, float], quantity("MPa", "First and last pressure.")] = field(init=False)

    def __post_init__(self) -> None:
        pressures = [point.p_MPa for point in self.points]
        if sorted(set(pressures)) != pressures:
            raise RuleError("the pressures do not rise, expected each above the one before")
        object.__setattr__(self, "range_MPa", (pressures[0], pressures[-1]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Pump(Artefact):
    """A pump as its data sheet has it."""

    FILE_NAME: ClassVar[str] = "pump.json"
    schema: Annotated[Literal["dzdesign.pump/2"], Meta(description="Name and version.")] = "dzdesign.pump/2"
    runs: Annotated[int, Meta(description="Runs.", ge=1, le=100)]
    variable: Annotated[bool, Meta(description="Whether its displacement can be changed.")]
    name: Annotated[str, Meta(description="Type plate.", min_length=1, max_length=20)]
    curves: Annotated[Mapping[str, Curve], Meta(description="By speed.")]
    spare: Annotated[Curve | None, Meta(description="Of the spare pump.")] = None

    def __post_init__(self) -> None:
        if self.spare is not None and not self.curves:
            raise InputError("there is a spare curve without a first one, expected both")


def pump(**changes) -> Pump:
    points = (Point(p_MPa=1.0, q_L_min=20.5), Point(p_MPa=5.0, q_L_min=None, note="drifts"))
    curve = Curve(points=points, gain=Fraction(-1, 3))
    source = SourceFile(source="sheet.pdf", sha256="0f" * 32)
    whole = Pump(
        tool=THIS_TOOL, made_from=(source,), runs=3, variable=True, name="A4", curves={"1500": curve}, spare=curve
    )
    return replace(whole, **changes)


def read(document: object) -> Pump:
    content = document if isinstance(document, bytes) else json.dumps(document).encode()
    return read_artefact(content, Pump, "pump.json", REMEDY)


def changed(*place, to=..., without=False) -> dict:
    """Return the document with one value changed, or a key taken away."""
    document = json.loads(to_json_bytes(pump()))
    parent = document
    for step in place[:-1]:
        parent = parent[step]
    if without:
        del parent[place[-1]]
    else:
        parent[place[-1]] = to
    return document


def refusal(document: object) -> str:
    with pytest.raises(InputError) as caught:
        read(document)
    text = str(caught.value)
    assert (
        text.startswith("'pump.json'") and "\n" not in text and "`" not in text and "$" not in text.partition("[0-9")[0]
    )
    assert len(text) < 500
    return text


def test_what_is_written_is_read_again_and_gives_the_same_bytes():
    content = to_json_bytes(pump())
    assert read(content) == pump()
    assert to_json_bytes(read(content)) == content
    assert content.decode() == json.dumps(json.loads(content), indent=1, ensure_ascii=False) + "\n"
    assert list(json.loads(content)) == ["schema", "tool", "made_from", "runs", "variable", "name", "curves", "spare"]
    assert json.loads(content)["curves"]["1500"]["gain"] == [-1, 3]


def test_a_read_only_mapping_is_written_like_a_dict():
    other = pump(curves=MappingProxyType(dict(pump().curves)))
    assert to_json_bytes(other) == to_json_bytes(pump())


finite = st.floats(0, 200, allow_nan=False)
points = st.builds(
    Point, p_MPa=finite, q_L_min=st.none() | st.floats(0, 1e300), note=st.sampled_from([None, "stable", "drifts"])
)
integers = st.integers(-LARGEST_INTEGER, LARGEST_INTEGER)
curves = st.builds(
    Curve,
    points=st.lists(points, min_size=1, unique_by=lambda one: one.p_MPa).map(
        lambda some: tuple(sorted(some, key=lambda one: one.p_MPa))
    ),
    gain=st.fractions() | st.builds(Fraction, integers, integers.filter(bool).map(abs)),
)
texts = st.text(st.characters(exclude_categories=["Cs"]))
pumps = st.builds(
    pump,
    runs=st.integers(1, 100),
    name=st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20),
    curves=st.dictionaries(texts, curves, min_size=1, max_size=3),
    spare=st.none() | curves,
)


@given(pumps)
@pytest.mark.slow
def test_every_pump_comes_back_as_it_was(one):
    content = to_json_bytes(one)
    assert read(content) == one and to_json_bytes(read(content)) == content
    assert Draft202012Validator(json_schema(Pump)).is_valid(json.loads(content))


@pytest.mark.parametrize(
    ("place", "fault", "named", "expected"),
    [
        (("runs",), "three", "'runs' is 'three'", "int, got str"),
        (("runs",), 101, "'runs' is 101", "int <= 100"),
        (("runs",), 1.5, "'runs' is 1.5", "int, got float"),
        (("runs",), True, "'runs' is True", "int, got bool"),
        (("runs",), 2**70, "'runs' is 1180591620717411303424", "int"),
        (("variable",), 1, "'variable' is 1", "bool, got int"),
        (("name",), "", "'name' is ''", "str of length >= 1"),
        (("name",), None, "'name' is None", "str, got null"),
        (("curves",), [], "'curves' is []", "object, got array"),
        (("curves", "1500", "points"), [], "'curves.1500.points' is []", "array of length >= 1"),
        (("curves", "1500", "points", 1), 7, "'curves.1500.points[1]' is 7", "object, got int"),
        (("curves", "1500", "points", 1, "p_MPa"), "5", "'curves.1500.points[1].p_MPa' is '5'", "float, got str"),
        (("curves", "1500", "points", 1, "p_MPa"), 201, "'curves.1500.points[1].p_MPa' is 201", "float <= 200"),
        (("curves", "1500", "points", 1, "p_MPa"), 10**299, "'curves.1500.points[1].p_MPa' is 1000", "float <= 200"),
        (("spare", "points", 0, "q_L_min"), -1, "'spare.points[0].q_L_min' is -1", "float >= 0"),
        (("spare", "points", 0, "note"), "odd", "'spare.points[0].note' is 'odd'", ""),
        (("spare", "gain"), [1], "'spare.gain' is [1]", "[numerator, denominator]"),
        (("spare", "gain"), [1, 0], "'spare.gain' is [1, 0]", "[numerator, denominator]"),
        (("spare", "gain"), [1, -2], "'spare.gain' is [1, -2]", "[numerator, denominator]"),
        (("spare", "gain"), [1, True], "'spare.gain' is [1, True]", "[numerator, denominator]"),
        (("spare", "gain"), 0.5, "'spare.gain' is 0.5", "[numerator, denominator]"),
        (("spare", "gain"), [10 * LARGEST_INTEGER, 1], "'spare.gain' is [1000", "[numerator, denominator]"),
        (("spare", "range_MPa"), [1], "'spare.range_MPa' is [1]", "array of length 2"),
        (("made_from", 0, "sha256"), "0F" * 32, "'made_from[0].sha256' is '0F", "str matching regex"),
        (("made_from", 0, "sha256"), "0f" * 32 + "\n", "'made_from[0].sha256' is '0f", "str"),
    ],
)
def test_a_value_that_does_not_fit_is_named_with_what_was_expected(place, fault, named, expected):
    text = refusal(changed(*place, to=fault))
    assert named in text and expected in text and text.endswith(REMEDY)
    assert not Draft202012Validator(json_schema(Pump)).is_valid(changed(*place, to=fault))


@pytest.mark.parametrize(
    "place",
    [
        *(("tool",), ("made_from", 0, "source"), ("runs",), ("curves", "1500", "gain"), ("spare",)),
        *(("spare", "points", 1, "p_MPa"), ("spare", "points", 0, "note")),
    ],
)
def test_a_missing_key_is_named_by_its_place(place):
    text = refusal(changed(*place, without=True))
    path = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in place)[1:]
    assert f"lacks the key '{path}'" in text and text.endswith(REMEDY)


def test_a_key_that_does_not_fit_is_named():
    assert "'spare.spares' has the key 'abcd', expected str of length <= 3" in refusal(
        changed("spare", "spares", to={"a": 1, "abcd": 2})
    )


def test_the_fault_in_one_of_several_entries_of_a_mapping_is_found():
    document = changed("runs", to=3)
    document["curves"] = {name: json.loads(json.dumps(document["spare"])) for name in ("900", "1500", "2.900")}
    document["curves"]["2.900"]["points"][1]["p_MPa"] = None
    assert "'curves.2.900.points[1].p_MPa' is None" in refusal(document)


def test_a_rule_between_fields_is_named_with_its_place():
    document = changed("curves", "1500", "points", 1, "p_MPa", to=0.5)
    assert "'curves.1500': the pressures do not rise" in refusal(document)
    assert "'pump.json': there is a spare curve without a first one" in refusal(changed("curves", to={}))
    with pytest.raises(InputError, match="do not rise"):
        replace(pump().spare, points=pump().spare.points[::-1])


@pytest.mark.parametrize(
    ("place", "fault"),
    [(("spare", "range_MPa"), [1.0, 6.0]), (("spare", "range_MPa", 0), 2), (("spare", "gain"), [-2, 6])],
)
def test_a_value_that_would_be_written_otherwise_is_refused(place, fault):
    text = refusal(changed(*place, to=fault))
    assert "'spare." in text and "the rest of the file gives" in text


def test_further_keys_are_ignored_and_logged(caplog):
    document = changed("spare", "colour", to="red")
    document["notes"] = {"bench": 2}
    with caplog.at_level(logging.INFO):
        assert read(document) == pump()
    assert "spare.colour, notes" in caplog.text
    assert Draft202012Validator(json_schema(Pump)).is_valid(document)


TEXT = to_json_bytes(pump()).decode()


@pytest.mark.parametrize(
    ("content", "code"),
    [
        (TEXT.replace('"runs": 3', '"runs": 3, "runs": 4').encode(), "twice"),
        (TEXT.replace('"p_MPa": 1.0', '"p_MPa": NaN').encode(), "NaN is not a number"),
        (TEXT.replace('"p_MPa": 1.0', '"p_MPa": -Infinity').encode(), "-Infinity is not a number"),
        (TEXT.replace('"p_MPa": 1.0', '"p_MPa": 1e999').encode(), "Out of range"),
        (TEXT.replace('"runs": 3', f'"runs": {"3" * (MOST_DIGITS + 1)}').encode(), "digits"),
        (TEXT.replace('"runs": 3', f'"runs": {"3" * 5000}').encode(), "digits"),
        (TEXT.replace('"runs": 3', f'"x": {"[" * DEEPEST}{"]" * DEEPEST}').encode(), "deep"),
        (TEXT.replace('"runs": 3', f'"x": {"[" * 100000}').encode(), "not JSON"),
        (TEXT.replace("A4", "A\u00e4").encode("latin-1"), "utf-8"),
        (TEXT.replace("A4", r"A\ud800").encode(), "surrogates"),
        (b"\xef\xbb\xbf" + TEXT.encode(), "BOM"),
        (TEXT.encode("utf-16"), "utf-8"),
        (TEXT[:-3].encode(), "not JSON"),
        (b"", "not JSON"),
        (b"[]", "has the schema 'None'"),
        (b'{"schema": 3}', "has the schema '3'"),
        (b'{"schema": "' + b"x" * 9999 + b'"}', "has the schema 'xxx"),
        (TEXT.replace("pump/2", "valve/1").encode(), "has the schema 'dzdesign.valve/1', expected dzdesign.pump/2"),
        (TEXT.replace("pump/2", "pump/1").encode(), "has the schema 'dzdesign.pump/1', expected dzdesign.pump/2"),
    ],
)
def test_what_is_no_such_artefact_is_refused(content, code):
    assert code in refusal(content)


def test_the_schema_in_the_file_chooses_among_several_types():
    @dataclass(frozen=True, slots=True, kw_only=True)
    class Motor(Artefact):
        """A motor."""

        FILE_NAME: ClassVar[str] = "motor.json"
        schema: Annotated[Literal["dzdesign.motor/1"], Meta(description="Name.")] = "dzdesign.motor/1"

    motor = Motor(tool=THIS_TOOL, made_from=())
    assert read_artefact(to_json_bytes(motor), (Pump, Motor), "x.json") == motor
    assert read_artefact(to_json_bytes(pump()), (Pump, Motor), "x.json") == pump()
    with pytest.raises(InputError, match=r"expected dzdesign\.motor"):
        read_artefact(to_json_bytes(pump()), Motor, "x.json")


@pytest.mark.parametrize("number", [float("nan"), float("inf")])
def test_no_file_is_written_of_what_is_no_number(number):
    with pytest.raises(ValueError, match="JSON"):
        to_json_bytes(pump(curves={"1": Curve(points=(Point(p_MPa=number, q_L_min=0.0),), gain=Fraction(1))}))


def test_no_file_is_written_of_a_numpy_number():
    import numpy as np

    with pytest.raises(TypeError, match="float64"):
        to_json_bytes(pump(curves={"1": Curve(points=(Point(p_MPa=np.float64(1), q_L_min=0.0),), gain=Fraction(1))}))


def test_the_schema_says_unit_bounds_and_meaning_of_every_key():
    schema = json_schema(Pump)
    Draft202012Validator.check_schema(schema)
    assert (schema["$id"], schema["title"]) == ("urn:dzdesign:schema:pump:2", "pump.json")
    assert schema["required"] == list(schema["properties"]) == list(as_document(pump()))
    point = schema["$defs"]["Point"]
    assert point["description"] == "One point of a pump's curve."
    assert point["properties"]["p_MPa"] == {
        "type": "number", "minimum": 0, "maximum": 200, "unit": "MPa", "description": "Pressure."
    }  # fmt: skip
    assert point["properties"]["q_L_min"]["type"] == ["number", "null"]
    assert json.dumps(schema) == json.dumps(json_schema(Pump))
    assert "additionalProperties" not in point


def test_a_name_that_is_no_utf_8_is_written_with_question_marks(tmp_path):
    name = os.fsdecode(b"f\xe4rm")
    made = SourceFile(source=name, sha256="0" * 64)
    supply = Artefact(schema="dzdesign.supply/1", tool=THIS_TOOL, made_from=(made,))
    assert json.loads(to_json_bytes(supply))["made_from"][0]["source"].isprintable()
    write_files(tmp_path, {"page.html": name}, "-o")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == "f?rm"
