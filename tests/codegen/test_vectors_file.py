"""vectors.csv: it hits every node, corner and fault; the compiled core and verify's own law agree, wrong ones do not.

The reader in C is that of the documentation's page.
"""

import re
import subprocess
from dataclasses import replace

import pytest

from dzdesign.codegen.project import generate
from dzdesign.codegen.vectors import required_codes
from dzdesign.core.errors import InputError
from dzdesign.design.side_law import Sides
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.toolchain.host_compiler import host_compiler, words_of
from tests.support.core_variants import variant
from tests.support.documented_commands import FILE
from tests.support.golden_firmware import FULL, golden_compensator
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

READER = dict(FILE.findall((ROOT / "docs" / "howto" / "core-only.md").read_text("utf-8")))["check_vectors.c"]
#: A command of one sign; two solenoids, unlike sensors and the pressures turned round; one table, without a transition;
#: three pressures.
DEFAULT, FULL_SET, ONE_TABLE, THREE = NAMES = (
    "default", "everything switched on", "no transition", "three pressures"
)  # fmt: skip
#: Of each sign: what its functions' names end with, and its first column.
SIDES = {1: ("", 3), -1: ("_negative", 6)}
HEADERS = ("dz_comp.h", "dz_calibration.h", "dz_valve.h")


def fewest(compensator) -> int:
    """How many vectors are required."""
    return len({codes for group in required_codes(compensator).values() for codes in group})


def without_transition(compensator):
    """The same law from one table: no zero band, no transition."""
    side = replace(compensator.positive, transition_beta=None)
    functions = replace(compensator.drive_functions, leave_zero_codes=0)
    return replace(
        compensator, transition_codes=0, zero_band_codes=0, sides=Sides(positive=side), drive_functions=functions
    )


@pytest.fixture(scope="module")
def firmwares():
    """Firmware with no more vectors than are required."""
    default = golden_compensator("host")
    others = golden_compensator("host", FULL), without_transition(default), variant("three pressures")
    compensators = (default, *others)
    made = (generate(each, "host", vectors=fewest(each)) for each in compensators)
    return dict(zip(NAMES, made, strict=True))


def table(firmware):
    """The columns' names, and the rows."""
    names, *lines = firmware.files["vectors.csv"].splitlines()
    return names.split(","), [tuple(map(int, line.split(","))) for line in lines]


@pytest.mark.parametrize("name", NAMES)
def test_every_node_corner_and_fault_is_among_the_fewest(name, firmwares):
    compensator = firmwares[name].compensator
    signals, limit = compensator.signals, compensator.drive_functions.compare_limit
    _, rows = table(firmwares[name])
    assert len(rows) == len(set(rows)) == firmwares[name].manifest.vectors
    for sign in signals.signs:
        column, pair = SIDES[sign][1], signals.pair(sign)
        low_a, high_a = pair.ahead.valid_codes
        low_b, high_b = pair.behind.valid_codes
        sound = [row for row in rows if low_a <= row[1] <= high_a and low_b <= row[2] <= high_b]
        by_drop = {}
        for row in sound:
            away = signals.command.direction(sign) * (row[0] - signals.command.zero_code)
            by_drop.setdefault(pair.difference(row[1], row[2]), {})[away] = row[column]
        largest, step = pair.largest_difference, compensator.beta_step_codes
        nodes = {node + by for node in range(0, largest + 1, step) for by in (-1, 0, 1)}
        for drop in (drop for drop in nodes if drop <= largest):
            assert 0 in by_drop[drop] and any(away >= max(compensator.transition_end, 1) for away in by_drop[drop])
        reverse, span = compensator.reverse_codes, signals.command.span(sign)
        tested_to = int(pair.dp_code(compensator.side(sign).certificate.dp_MPa[1]))
        assert {-reverse - 1, -reverse, tested_to, tested_to + 1, largest} <= set(by_drop)
        corners = {compensator.zero_band_codes, compensator.transition_end, span}
        around = {corner + by for corner in corners for by in (-1, 0, 1)}
        beyond = signals.command.zero_code + signals.command.direction(sign) * (span + 1)
        for drop in (0, tested_to, largest):
            assert {away for away in around if away <= span or 0 <= beyond <= 65535} - {-1} <= set(by_drop[drop])
        for drop in (0, tested_to, largest):
            reached = [away for away in range(span + 1) if by_drop[drop].get(away) == limit]
            assert not reached or by_drop[drop][reached[0] - 1] < limit
        assert name != FULL_SET or reached  # the others stay below it
        bits = {row[column + 1] for row in rows}
        one, other = ({"A": 2, "B": 4, "C": 512}[each] for each in pair.names)
        assert {0, 1, one, other, one + other, 1 + one + other, 8, 16} <= bits
        for place, signal in enumerate((signals.command, pair.ahead, pair.behind)):
            low, high = signal.valid_codes
            tried = {row[place] for row in rows}
            assert {code for code in (low - 1, low, high, high + 1, signals.code_max + 1, 65535) if code >= 0} <= tried
        ends = {(row[1], row[2]) for row in rows}
        assert {(a, b) for a in (low_a, high_a) for b in (low_b, high_b)} <= ends


def test_more_vectors_begin_with_the_same_ones_and_have_sound_random_codes(firmwares):
    fewer, compensator = firmwares[DEFAULT].files["vectors.csv"], firmwares[DEFAULT].compensator
    more = generate(compensator, "host", vectors=fewest(compensator) + 200).files["vectors.csv"]
    assert more.startswith(fewer)
    rest = [tuple(map(int, line.split(","))) for line in more[len(fewer) :].splitlines()]
    assert len(set(rest)) == 200 and all(row[4] in (0, 16) for row in rest)
    assert len({row[0] for row in rest}) > 150 < len({row[1] - row[2] for row in rest})


def test_too_few_vectors_are_refused_with_how_many_are_needed(wording):
    compensator = golden_compensator("host")
    with wording.refusal(InputError, "vectors file: too few"):
        generate(compensator, "host", vectors=fewest(compensator) - 1)
    assert "vectors.csv" not in generate(compensator, "host").files


# ---- the compiled core ----


def read_by_the_page(tmp_path, firmware, sign) -> tuple[int, str]:
    """Compile one side's core and the page's reader, and run it."""
    ending, first = SIDES[sign]
    names, rows = table(firmware)
    assert names[first].startswith("compare") and names[first + 2].startswith("beta")
    reader = re.sub(r"\bdz_(comp|status|beta)\(", rf"dz_\1{ending}(", READER)
    lines = [f"{{{','.join(map(str, (*row[:3], *row[first : first + 3])))}}},\n" for row in rows]
    sources = {"check.c": reader, "vectors.inc": "".join(lines)}
    sources |= {name: firmware.files[f"core/{name}"] for name in ("dz_comp.c", *HEADERS)}
    for each, text in sources.items():
        (tmp_path / each).write_text(text, encoding="utf-8")
    command = [*words_of(host_compiler()), "-std=c99", "-Werror", "check.c", "dz_comp.c", "-o", "check"]
    subprocess.run(command, cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "check"], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


@needs_compiler
@pytest.mark.parametrize(("name", "sign"), [(DEFAULT, 1), (FULL_SET, 1), (FULL_SET, -1), (ONE_TABLE, 1), (THREE, -1)])
def test_the_compiled_core_gives_every_vector(name, sign, firmwares, tmp_path):
    status, said = read_by_the_page(tmp_path, firmwares[name], sign)
    assert (status, said) == (0, f"{firmwares[name].manifest.vectors} vectors, 0 wrong\n")


# ---- verify ----


@pytest.mark.parametrize("name", NAMES)
def test_verify_has_the_same_values_from_its_own_law(name, firmwares):
    """Of the same rationals by other code."""
    compensator = firmwares[name].compensator
    answers = [ExactLaw(compensator, sign).answer for sign in compensator.signals.signs]
    rows = [tuple(map(int, line.split(","))) for line in firmwares[name].files["vectors.csv"].splitlines()[1:]]
    assert len(rows) > 100
    assert all(row[3:] == tuple(value for answer in answers for value in answer(*row[:3])) for row in rows)
