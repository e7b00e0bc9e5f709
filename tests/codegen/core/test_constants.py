"""Every number of the generated core stands in the manifest, with its origin, and nothing else does."""

import json
import re
from dataclasses import replace

import pytest

from dzdesign.codegen.core.constants import COLUMNS
from dzdesign.codegen.project import TARGET_NAMES, generate
from dzdesign.core.artefact_files import sha256_of
from tests.support.core_variants import NAMES, firmware, variant
from tests.support.golden_firmware import golden_compensator
from tests.support.paths import ROOT

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
TABLE = re.compile(r"static const struct segment\w* (\w+)\[(\d+)\] = \{(.*?)\n    \};", re.DOTALL)
PLAY = re.compile(r"static const uint16_t (play_\w+)\[(\d+)\] = \{(.*?)\};", re.DOTALL)
DEFINE = re.compile(r"^#define (\w+)[ \t]+(\S.*)$", re.MULTILINE)
ROW = re.compile(r"\{UINT32_C\((\d+)\), (-?\d+)u?\}")
NUMBER = r"(?:U?INT(?:32|64)_C\((\d+)\)|(0x[0-9A-Fa-f]+|\d+)u?)"
#: Widths of 64-, 32- and 16-bit words, their masks and top bits; none is a datum.
WIDTHS = {"0", "1", "15", "16", "31", "32", "0xFFFF"}


def number(text: str) -> int:
    """Read a literal as C does; the only operator in a `#define` is the sign."""
    match = re.fullmatch(rf"\((-){NUMBER}\)|{NUMBER}", text.strip())
    assert match, text
    value = next(int(group, 0) for group in match.groups()[1:] if group)
    return -value if match[1] else value


def constants_in(text: str) -> dict[str, object]:
    """Read every `#define` and every constant table of a file of C."""
    code = COMMENT.sub("", text)
    found: dict[str, object] = {name: number(value) for name, value in DEFINE.findall(code)}
    for name, size, body in PLAY.findall(code):
        found[name] = tuple((int(count), 0) for count in re.findall(r"(\d+)u", body))
        assert len(found[name]) == int(size)
    code = PLAY.sub("", code)
    tables = TABLE.findall(code)
    assert len(tables) == len(re.findall(r"\[\w*\]\s*=", code)), "a table of another form"
    for name, size, body in tables:
        found[name] = tuple((int(start), int(change)) for start, change in ROW.findall(body))
        assert len(found[name]) == int(size) and not re.search(r"\d", ROW.sub("", body))
    return found


def differences(files, manifest) -> list[str]:
    """Name every number of the core that is not in the manifest with that value, and every entry that has none."""
    in_c = {(path, name): value for path in manifest.core for name, value in constants_in(files[path]).items()}
    listed = {(entry.file, entry.symbol): entry.value for entry in manifest.constants}
    assert len(listed) == len(manifest.constants)
    return [
        f"{path}: {name} is {in_c.get((path, name))} in C and {listed.get((path, name))} in the manifest"
        for path, name in sorted(in_c.keys() | listed.keys())
        if in_c.get((path, name)) != listed.get((path, name))
    ]


def bare_numbers(text: str) -> set[str]:
    """Return the literals in the code itself, outside `#define`s, tables and names."""
    code = re.sub(r"^#.*$", "", TABLE.sub("", COMMENT.sub("", text)), flags=re.MULTILINE)
    code = PLAY.sub("", code)
    return set(re.findall(r"\b(0x[0-9A-Fa-f]+|\d+)(?=[uUlL]*\b)", code))


@pytest.mark.parametrize("target", TARGET_NAMES)
def test_the_core_of_every_target_has_the_constants_of_its_manifest(target):
    made = generate(golden_compensator(target), target)
    assert differences(made.files, made.manifest) == []


@pytest.mark.slow
@pytest.mark.parametrize(("name", "arithmetic"), NAMES)
def test_every_form_of_the_core_has_the_constants_of_its_manifest(name, arithmetic):
    made = firmware(name, arithmetic)
    assert differences(made.files, made.manifest) == []
    for path in made.manifest.core:
        assert bare_numbers(made.files[path]) <= WIDTHS, path
        assert max(map(len, made.files[path].splitlines())) <= COLUMNS, path


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("#define WORD_TOP", "#define NOBODY 7u\n#define WORD_TOP"),
        ("#define STEP_SHIFT 6u", "#define STEP_SHIFT 7u"),
        ("#define FACTOR_SLOPE (-INT32_C(", "#define FACTOR_SLOPE (-INT32_C(1"),
        (", 0}, /* from 0.000 MPa", ", -1}, /* from 0.000 MPa"),
        ("#define COMMAND_LOW 0u", ""),
    ],
)
def test_a_constant_that_is_not_the_manifests_is_seen(right, wrong):
    made = firmware("no transition", "wide")
    text = made.files["core/dz_comp.c"]
    assert right in text
    files = {**made.files, "core/dz_comp.c": text.replace(right, wrong)}
    assert len(differences(files, made.manifest)) == 1


def test_an_entry_without_a_constant_and_a_bare_number_are_seen():
    made = firmware("no transition", "wide")
    (first, *_), text = made.manifest.constants, made.files["core/dz_comp.c"]
    manifest = replace(made.manifest, constants=(*made.manifest.constants, replace(first, symbol="NOBODY")))
    assert differences(made.files, manifest) == [f"{first.file}: NOBODY is None in C and {first.value} in the manifest"]
    assert bare_numbers(text.replace("dp + STEP_CODES", "dp + 64u")) - WIDTHS == {"64"}


@pytest.mark.parametrize(("name", "arithmetic"), NAMES)
def test_every_entry_leads_to_its_datum(name, arithmetic):
    """Keys are followed in the documents, sources in this repository; the C's comment is the entry's text."""
    made, compensator = firmware(name, arithmetic), variant(name, arithmetic)
    document = json.loads(made.files["compensator.json"])
    valve = document["valve"]
    origin = made.manifest.origin
    assert origin.compensator_json == sha256_of(made.files["compensator.json"].encode())
    assert origin.valve_json == compensator.valve_json_sha256
    assert origin.ramp_tests == compensator.valve.made_from
    for entry in made.manifest.constants:
        for key, holder in [(key, document) for key in entry.compensator_json] + [
            (key, valve)
            for key in entry.valve_json
            if not key.endswith(".opening_curve")  # added by the variants
        ]:
            found = holder
            for part in key.split("."):
                found = found[part]
            assert found is not None, key
        assert (ROOT / entry.generator).is_file()
        comments = " ".join(re.sub(r"\n *\* ", " ", made.files[entry.file]).split()).lower()
        said = f"{entry.equation}: {entry.engineering} ({entry.rounding}). */"
        assert f"/* {said.lower()}" in comments


def test_a_datum_is_the_constants_value():
    """The codes that the C has as they stand in compensator.json."""
    made = firmware("bipolar, all options", "wide")
    document = json.loads(made.files["compensator.json"])
    values = {(entry.file, entry.symbol): entry.value for entry in made.manifest.constants}
    signals = document["signals"]
    assert values["core/dz_comp_negative.c", "COMMAND_ZERO"] == signals["command"]["zero_code"]
    assert values["core/dz_comp.c", "PRESSURE_B_HIGH"] == signals["pressure_b"]["valid_codes"][1]
    assert values["core/dz_comp.h", "DZ_COMPARE_LIMIT"] == document["drive_functions"]["compare_limit"]
    assert values["core/dz_drive.c", "DITHER_COUNTS"] == document["drive_functions"]["dither_counts"]
    assert values["core/dz_drive.c", "RAMP_UP_NEGATIVE"] == document["drive_functions"]["ramp_up"][1]


def test_the_engineering_values_are_those_of_the_constants():
    """By numbers typed here: 10 V over 60000 counts and 4095 codes, 20 MPa over 3058 codes (4 to 20 mA)."""
    manifest = firmware("no transition", "wide").manifest
    said = {(entry.file, entry.symbol): entry.engineering for entry in manifest.constants}
    side = variant("no transition", "wide").positive
    core = "core/dz_comp.c"
    assert said[core, "REVERSE"].startswith(f"{30 * 20 / 3058:.3f} MPa")
    assert said[core, "STEP_CODES"] == f"{64 * 20 / 3058:.4f} MPa"
    assert said[core, "HALF"] == f"{10 / 60000 / 2:.3g} V"
    assert said[core, "FACTOR_OFFSET"] == f"u_min0 = {10 * float(side.u_min0_over_u_max):.6f} V"
    assert said[core, "FACTOR_SLOPE"] == f"k x_max/u_max - 1 = {float(side.drive_range_over_u_max) - 1:.6f}"
    assert said[core, "COMMAND_HIGH_WORD"] == "1.000000"
    assert said[core, "law_segment"] == f"beta {min(side.beta) / 32768:.6f} to 1.000000"
