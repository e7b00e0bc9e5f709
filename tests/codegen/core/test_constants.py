"""Every number of the generated core stands in the manifest, with its origin, and beside its own words in the C."""

import json
import re
from dataclasses import replace

import pytest

from dzdesign.codegen.core.constants import COLUMNS
from dzdesign.codegen.project import TARGET_NAMES, generate
from dzdesign.core.artefact_files import sha256_of
from tests.support.core_variants import NAMES, firmware, variant
from tests.support.golden_firmware import golden_compensator

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
DEFINE = re.compile(r"^#define (\w+)[ \t]+(\S.*)$", re.MULTILINE)
#: A member of the valve's numbers: `.name = number,`, or numbers in braces.
MEMBER = re.compile(r"\.(\w+) = (?:(\{(?:[^{}.]|\{[^{}.]*\})*\})|([^{},]+)),")
NUMBER = re.compile(r"(?:U?INT(?:32|64)_C\((\d+)\)|\b(\d+)u)")
VALVE = "core/dz_valve.h"
#: Widths of 64-, 32- and 16-bit words, their masks and top bits; none is a datum.
WIDTHS = {"0", "1", "15", "16", "31", "32", "0xFFFF", "65535", "2"}


def numbers(text: str) -> list[int]:
    return [int(wide or plain) for wide, plain in NUMBER.findall(text)]


def constants_in(path: str, text: str) -> dict[str, list[int]]:
    """Read every `#define` of a file of C, and the members of the valve's numbers, side by side."""
    code = COMMENT.sub("", text)
    found = {name: numbers(value) for name, value in DEFINE.findall(code)}
    if path == VALVE:
        place, body = "", code[code.index("{") :]
        side = 0
        for match in re.finditer(r"\.sides = \{|\.current = \{|\n {8}\{|" + MEMBER.pattern, body):
            if match[0].startswith(".sides") or match[0].startswith(".current"):
                place, side = match[0].split()[0][1:], -1
            elif match[0].startswith("\n"):
                side += 1
            else:
                name = f"{place}[{side}]." if place == "sides" else f"{place}." if place else ""
                found[name + match[1]] = numbers(match[2] or match[3])
    return found


def stated(entry) -> list[int]:
    """Give the numbers of an entry as the C has them, those of 64 bits in halves."""
    if isinstance(entry.value, int):
        wide = entry.symbol.partition(".")[2] in ("linear", "half")
        return [entry.value % 2**32, entry.value >> 32] if wide else [entry.value]
    flat = [number for row in entry.value for number in row]
    return flat if entry.symbol.endswith("nodes") else flat[::2]


def differences(files, manifest) -> list[str]:
    """Name every number of the core that is not in the manifest with that value, and every entry that has none."""
    in_c = {(path, name): value for path in manifest.core for name, value in constants_in(path, files[path]).items()}
    listed = {(entry.file, entry.symbol): stated(entry) for entry in manifest.constants}
    assert len(listed) == len(manifest.constants)
    return [
        f"{path}: {name} is {in_c.get((path, name))} in C and {listed.get((path, name))} in the manifest"
        for path, name in sorted(in_c.keys() | listed.keys())
        if in_c.get((path, name)) != listed.get((path, name))
    ]


def bare_numbers(text: str) -> set[str]:
    """Return the literals in the code itself, outside `#define`s and names."""
    code = re.sub(r"^#.*$", "", COMMENT.sub("", text), flags=re.MULTILINE)
    return set(re.findall(r"\b(0x[0-9A-Fa-f]+|\d+)(?=[uUlL]*\b)", code))


@pytest.mark.parametrize("target", TARGET_NAMES)
def test_the_core_of_every_target_has_the_constants_of_its_manifest(target):
    made = generate(golden_compensator(target), target)
    assert differences(made.files, made.manifest) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_form_of_the_core_has_the_constants_of_its_manifest(name):
    made = firmware(name)
    assert differences(made.files, made.manifest) == []
    for path in made.manifest.core:
        assert path == VALVE or bare_numbers(made.files[path]) <= WIDTHS, path
        assert max(map(len, made.files[path].splitlines())) <= COLUMNS, path


@pytest.mark.parametrize(
    ("file", "right", "wrong"),
    [
        ("core/dz_comp.c", "#define WEIGHT_SHIFT", "#define NOBODY 7u\n#define WEIGHT_SHIFT"),
        ("core/dz_comp.c", "#define BETA_STEP_SHIFT 6u", "#define BETA_STEP_SHIFT 7u"),
        (VALVE, ".offset = UINT32_C(", ".offset = UINT32_C(1"),
        (VALVE, "{UINT32_C(", "{UINT32_C(1"),
        (VALVE, ".command_low = 0u,", ""),
    ],
)
def test_a_constant_that_is_not_the_manifests_is_seen(file, right, wrong):
    made = firmware("no transition")
    assert right in made.files[file]
    files = {**made.files, file: made.files[file].replace(right, wrong, 1)}
    assert len(differences(files, made.manifest)) == 1


def test_an_entry_without_a_constant_and_a_bare_number_are_seen():
    made = firmware("no transition")
    (first, *_), text = made.manifest.constants, made.files["core/dz_comp.c"]
    manifest = replace(made.manifest, constants=(*made.manifest.constants, replace(first, symbol="NOBODY")))
    assert differences(made.files, manifest) == [
        f"{first.file}: NOBODY is None in C and [{first.value}] in the manifest"
    ]
    assert bare_numbers(text.replace("DZ_BETA_STEP - past", "64u - past")) - WIDTHS == {"64"}


@pytest.mark.parametrize("name", NAMES)
def test_every_entry_leads_to_its_datum(name):
    """Keys are followed in the documents; the C's comment has the entry's text."""
    made, compensator = firmware(name), variant(name)
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
            assert found is not None or key.endswith("interlock_codes"), key
        comments = " ".join(re.sub(r"\n *\* ", " ", made.files[entry.file]).split()).lower()
        words = [entry.equation, f"({entry.rounding}).", *([] if entry.engineering == "as it is" else
                 [f": {entry.engineering} ({entry.rounding})."])]  # fmt: skip
        for each in (*words, *(f"from {key}." for key in entry.compensator_json if entry.file == VALVE)):
            assert each.lower().replace("²", "^2") in comments, each


def test_a_datum_is_the_numbers_value():
    """The codes that the C has as they stand in compensator.json."""
    made = firmware("bipolar, all options")
    document = json.loads(made.files["compensator.json"])
    values = {entry.symbol: entry.value for entry in made.manifest.constants if entry.file == VALVE}
    signals, functions = document["signals"], document["drive_functions"]
    assert values["command_zero"] == signals["command"]["zero_code"]
    assert values["b_high"] == signals["pressure_b"]["valid_codes"][1]
    assert values["compare_limit"] == functions["compare_limit"]
    assert values["dither_counts"] == functions["dither_counts"]
    assert values["sides[1].ramp_up"] == functions["ramp_up"][1]


def test_the_engineering_values_are_those_of_the_numbers():
    """By numbers typed here: 10 V over 60000 counts and 4095 codes, 20 MPa over 3058 codes (4 to 20 mA)."""
    made = firmware("no transition")
    found = {entry.symbol: entry.engineering for entry in made.manifest.constants if entry.file == VALVE}
    side = variant("no transition").positive
    assert found["reverse"].startswith(f"{30 * 20 / 3058:.3f} MPa")
    assert found["sides[0].half"] == f"{10 / 60000 / 2:.3g} V"
    assert found["sides[0].offset"].startswith(f"u_min0 = {10 * float(side.u_min0_over_u_max):.6f} V")
    assert found["sides[0].slope"].startswith(f"k x_max/u_max - 1 = {float(side.drive_range_over_u_max) - 1:.6f}")
    assert found["sides[0].linear"] == "1.000000"
    assert found["sides[0].nodes"].startswith(f"beta {min(side.beta) / 32768:.6f} to 1.000000")
    assert f"/* {64 * 20 / 3058:.3f} MPa: beta " in made.files[VALVE]
