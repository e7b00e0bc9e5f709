"""Every number of the generated core stands behind its own words, which lead to its datum."""

import json
import re

import pytest

from dzdesign.codegen.core.constants import COLUMNS
from tests.support.core_variants import NAMES, firmware, variant

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
#: A `#define`, or a member of the valve's numbers, of an array its first line; and the comment before it.
NUMBER = re.compile(r"^#define (\w+)[ \t]+(\S.*)$|^ *\.(?!sensors|sides|current)(\w+) = (.+?),?$", re.MULTILINE)
BEFORE = re.compile(r"/\*((?:(?!\*/).)*)\*/\s*\Z", re.DOTALL)
VALVE = "core/dz_valve.h"
#: Widths of 64-, 32- and 16-bit words, their masks and top bits; none is a datum.
WIDTHS = {"0", "1", "15", "16", "31", "32", "0xFFFF", "65535", "2"}


def bare_numbers(text: str) -> set[str]:
    """Return the literals in the code itself, outside `#define`s and names."""
    code = re.sub(r"^#.*$", "", COMMENT.sub("", text), flags=re.MULTILINE)
    return set(re.findall(r"\b(0x[0-9A-Fa-f]+|\d+)(?=[uUlL]*\b)", code))


def numbers_of(text: str) -> list[tuple[str, str, str]]:
    """Return name, number and comment of each `#define` and each member of a file of C; in its order."""
    found = []
    for match in NUMBER.finditer(text):
        comment = BEFORE.search(text[: match.start()])
        words = " ".join(re.sub(r"\n *\* ", " ", comment[1]).split()) if comment else ""
        found.append((match[1] or match[3], match[2] or match[4], words))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_every_number_of_the_core_has_its_words_and_no_other_stands_in_the_code(name):
    made = firmware(name)
    for path in made.manifest.core:
        text = made.files[path]
        assert path == VALVE or bare_numbers(text) <= WIDTHS, path
        assert max(map(len, text.splitlines())) <= COLUMNS, path
        without = [symbol for symbol, _, words in numbers_of(text) if not words]
        assert without == [], path


def test_a_number_without_words_and_a_bare_one_are_seen():
    text = firmware("no transition").files["core/dz_comp.c"]
    assert bare_numbers(text.replace("DZ_BETA_STEP - past", "64u - past")) - WIDTHS == {"64"}
    bare = text.replace("#define BETA_STEP_SHIFT", "#define NOBODY 7u\n#define BETA_STEP_SHIFT")
    assert [symbol for symbol, _, words in numbers_of(bare) if not words] == ["BETA_STEP_SHIFT"]


@pytest.mark.parametrize("name", NAMES)
def test_every_member_leads_to_its_datum(name):
    made, keys = firmware(name), set()
    document = json.loads(made.files["compensator.json"])
    for symbol, _, words in numbers_of(made.files[VALVE]):
        for key in re.findall(r"From ([\w.]+)\.$", words):
            found = document
            for part in key.split("."):
                found = found[part]
            assert found is not None or key.endswith("interlock_codes"), (symbol, key)
            keys.add(key)
    sides = {f"sides.{side}.beta" for side, sign in (("positive", 1), ("negative", -1)) if sign in
             variant(name).signals.signs}  # fmt: skip
    assert keys >= sides | {"transition_codes", "signals.command.valid_codes"} and len(keys) > 15


def test_a_datum_is_the_numbers_value():
    """The codes that the C has as they stand in compensator.json."""
    made = firmware("bipolar, all options")
    document = json.loads(made.files["compensator.json"])
    values = [(symbol, value) for symbol, value, _ in numbers_of(made.files[VALVE])]
    signals, functions = document["signals"], document["drive_functions"]
    assert {
        ("command_zero", f"{signals['command']['zero_code']}u"),
        ("high", f"{signals['pressure_b']['valid_codes'][1]}u"),
        ("compare_limit", f"{functions['compare_limit']}u"),
        ("dither_counts", f"{functions['dither_counts']}u"),
    } <= set(values)
    ramps = [value for symbol, value in values if symbol == "ramp_up"]
    assert ramps == [f"UINT32_C({step})" for step in functions["ramp_up"]]


def test_the_engineering_values_are_those_of_the_numbers():
    """By numbers typed here: 10 V over 60000 counts and 4095 codes, 20 MPa over 3058 codes (4 to 20 mA)."""
    made = firmware("no transition")
    found = {symbol: words for symbol, _, words in numbers_of(made.files[VALVE])}
    side = variant("no transition").positive
    assert f": {30 * 20 / 3058:.3f} MPa (" in found["reverse"]
    assert f": {10 / 60000 / 2:.3g} V (" in found["half"]
    assert f": u_min0 = {10 * float(side.u_min0_over_u_max):.6f} V," in found["offset"]
    assert f": k x_max/u_max - 1 = {float(side.drive_range_over_u_max) - 1:.6f}," in found["slope"]
    assert ": 1.000000 (" in found["linear"]
    assert f": beta {min(side.beta) / 32768:.6f} to {max(side.beta) / 32768:.6f}," in found["nodes"]
    assert f"/* {64 * 20 / 3058:.3f} MPa: beta " in made.files[VALVE]
