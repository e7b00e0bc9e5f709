"""The JSON Schemas against the artefacts that the product writes: every key described, every fault seen."""

import json
from copy import deepcopy
from dataclasses import replace

import pytest
from jsonschema import Draft202012Validator

from docs.generated import SCHEMAS, one_line_a_field, schema_document, schema_text
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.identify.options import IdentifyOptions
from tests.support.golden_firmware import FULL, golden_compensator
from tests.support.paths import GOLDENS_FULL
from tests.support.schema_checks import overlooked, problems, resolved
from tests.support.synthetic import Truth, needs_compiler, synthetic_ramp

GOLDENS = GOLDENS_FULL
#: End of a key's name -> unit of its value.
UNITS = {"_V": "V", "_MPa": "MPa", "_L_min": "L/min", "_L_min_V": "L/min/V", "_V_mm": "V/mm", "_V_s": "V/s",
         "_Hz": "Hz", "_s": "s", "_N_MPa": "N/MPa", "_N_mm_MPa": "N/(mm MPa)"}  # fmt: skip


def identified(tests, **options):
    from dzdesign.identify.identification import identify

    return json.loads(to_json_bytes(identify(tests, IdentifyOptions(**options))))


def one_valve(case):
    """Return the valve.json of a case that is not the example's."""
    truth = Truth(noise=0.05)
    if case == "both sides":
        return json.loads((GOLDENS / "valve.json").read_text())
    if case == "flat":
        found = identified([synthetic_ramp(dp, truth) for dp in (1.0, 3.0, 5.0)], x_max=1.8e-3, meter_lag=0.1)
        assert found["sides"]["positive"]["trend"] == "flat" and found["meter"]["lag_is"] == "declared"
        return found
    ramp = synthetic_ramp(1.0, truth, falling=case != "no falling branch")
    if case == "no pressure":
        ramp = replace(ramp, dp=None)
    found = identified([ramp])
    assert found["sides"]["positive"]["trend"] is None
    return found


@pytest.fixture(scope="module")
def written_firmware(example_firmware, tmp_path_factory):
    folder = tmp_path_factory.mktemp("schemas") / "firmware"
    write_folder(folder, example_firmware.files, example_firmware.manifest)
    return folder


@pytest.fixture(scope="module")
def example_artefacts(example_valve, example_compensator, written_firmware):
    from dzdesign.core.artefact_types import to_json_bytes

    return {
        "valve": json.loads(to_json_bytes(example_valve)),
        "compensator": json.loads(to_json_bytes(example_compensator)),
        "firmware": json.loads((written_firmware / "manifest.json").read_text()),
    }


@pytest.fixture(scope="module")
def evidence(written_firmware, example_folder):
    """Return verification.json with all that can be asked for."""
    from dzdesign.verify.closed_loop.plant import read_plant
    from tests.support.evidence import verify

    plant = read_plant(example_folder / "plant.toml")
    return json.loads(to_json_bytes(verify(written_firmware, plant, plant_source="plant.toml").evidence))


@pytest.fixture(scope="module")
def assessment():
    from dzdesign.assess.assessing import assess
    from dzdesign.assess.options import AssessOptions

    before = [synthetic_ramp(dp, Truth(), source=f"before_{dp:g}.csv") for dp in (1.0, 5.0)]
    after = [synthetic_ramp(1.0, Truth(knee_rising=0.5), seed=1, source="after.csv")]
    options = AssessOptions(reading=IdentifyOptions(), limits={"dead_zone_opening": 0.01, "symmetry": 0.01})
    document = json.loads(to_json_bytes(assess(before, after, options)))
    assert {limit["holds"] for limit in document["limits"]} == {False, None}  # one missed, one that can't be checked
    assert any(item["after"] is None for item in document["pressures"])
    return document


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_schema_is_of_the_draft_and_describes_every_key_with_its_unit(name):
    schema = schema_document(name)
    Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    lacking = []

    def look(item, place):
        for key, value in item.get("properties", {}).items():
            described = value if "description" in value else resolved(value, schema)
            if not described.get("description", "").endswith("."):
                lacking.append(f"{place}.{key}: no sentence")
            ends = [end for end in UNITS if key.endswith(end)]
            types = value.get("type", "object")
            if ends and ("number" in types or "array" in types) and value.get("unit") != UNITS[max(ends, key=len)]:
                lacking.append(f"{place}.{key}: unit {value.get('unit')}")
            look(value, f"{place}.{key}")
        for key in ("items", "additionalProperties"):
            if isinstance(item.get(key), dict):
                look(item[key], f"{place}.{key}")

    for part, item in {"": schema, **schema.get("$defs", {})}.items():
        look(item, part)
    assert lacking == []


@pytest.mark.parametrize("name", ["valve", "compensator", "firmware"])
def test_the_example_fits_and_every_fault_in_it_is_seen(example_artefacts, name):
    document = example_artefacts[name]
    assert problems(name, document) == []
    assert overlooked(name, document, at_least=40, apart="valve") == []  # those of a valve are seen in valve.json


@pytest.mark.parametrize("case", ["both sides", "flat", "one pressure", "no pressure", "no falling branch"])
def test_other_valves_fit(case):
    assert problems("valve", one_valve(case)) == []


def test_a_compensator_with_every_option_fits():
    document = json.loads(to_json_bytes(golden_compensator(root=FULL)))
    assert document["sides"]["negative"] and document["transition_codes"]
    assert problems("compensator", document) == [] and problems("valve", document["valve"]) == []


@pytest.mark.slow
@needs_compiler
def test_evidence_fits_and_every_fault_in_it_is_seen(evidence):
    assert problems("evidence", evidence) == []
    assert overlooked("evidence", evidence, at_least=150) == []


@needs_compiler
def test_evidence_of_a_core_that_does_not_compile_fits(firmware_folder):
    from tests.support.evidence import verify

    source = firmware_folder / "core" / "dz_comp.c"
    source.write_text(source.read_text() + "\nint unused = 1.5;;\n")
    found = verify(firmware_folder)
    assert not found.holds and found.evidence.inputs == ()
    assert problems("evidence", json.loads(to_json_bytes(found.evidence))) == []


@pytest.mark.slow
def test_an_assessment_fits_and_every_fault_in_it_is_seen(assessment):
    assert problems("assessment", assessment) == []
    assert overlooked("assessment", assessment, at_least=60) == []


def test_a_key_that_no_schema_describes_is_seen(example_artefacts):
    document = {**example_artefacts["valve"], "colour": "red"}
    assert any("colour" in text for text in problems("valve", document))
    assert problems("valve", document, every_key_described=False) == [], "more keys are welcome"


#: The schemas, for review.
STATED = GOLDENS_FULL.parent / "goldens" / "schemas"


def listings(schemas):
    """Return the golden of every schema: all of it, but a definition that is in a golden before only by reference."""
    seen, texts = {}, {}
    for name, schema in schemas.items():
        definitions = {}
        for part, definition in schema["$defs"].items():
            before, at = seen.setdefault(part, (definition, name))
            definitions[part] = f"as in {at}" if before == definition and at != name else definition
        texts[f"{name}.json"] = one_line_a_field({**schema, "$defs": definitions}) + "\n"
    return texts


@pytest.fixture(scope="module")
def schemas():
    return {name: schema_document(name) for name in SCHEMAS}


def test_a_schema_is_its_golden(request, schemas):
    """After a change that is meant: `--update-goldens`, and read the diff."""
    listed = listings(schemas)
    if request.config.getoption("--update-goldens"):
        for name, text in listed.items():
            (STATED / name).write_text(text, encoding="utf-8", newline="\n")
    assert {path.name: path.read_text(encoding="utf-8") for path in STATED.iterdir()} == listed


def test_a_schema_as_text_has_all_of_it(schemas):
    """So no change of a type, a bound or a unit passes the golden."""
    for name in SCHEMAS:
        assert json.loads(schema_text(name)) == schemas[name]


@pytest.mark.parametrize(
    ("part", "key", "keyword", "changed"),
    [
        ("TestResult", "dp_MPa", "type", "number"),
        ("TestResult", "dp_MPa", "maximum", 1),
        ("TestResult", "dp_MPa", "unit", "kPa"),
        ("TestResult", "dp_MPa", "description", "Another."),
        ("SideModel", "trend", "enum", ["decreasing"]),
        ("SideModel", None, "required", ["tests"]),
        ("SideModel", None, "additionalProperties", False),
    ],
)
def test_a_change_of_a_field_is_one_line_of_one_golden(schemas, part, key, keyword, changed):
    other = deepcopy(schemas)
    for schema in other.values():
        if part in schema["$defs"]:
            node = schema["$defs"][part]
            node = node["properties"][key] if key else node
            assert node.get(keyword) != changed
            node[keyword] = changed
    before, after = (
        {line for text in listings(one).values() for line in text.splitlines()} for one in (schemas, other)
    )
    # Behind a new key at the end of a definition the one before it gets a comma.
    assert len(after - before) == (2 if keyword == "additionalProperties" else 1)
