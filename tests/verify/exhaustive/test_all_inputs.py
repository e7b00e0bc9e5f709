"""The check of every input is checked: each count fires on a core that has just that fault, on every machine."""

import re
import subprocess
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from dzdesign.core.errors import RequirementError
from dzdesign.verify.exhaustive import machine_code
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs, first_wrong, input_check
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.machine_code import check_on_machine, machine_code_checks
from dzdesign.verify.exhaustive.test_vectors import (
    DIRECTION,
    OUTSIDE,
    PAIR,
    PART,
    PLAN,
    ROW,
    SAMPLED_ROWS,
    PreparedInputs,
    differences,
)
from dzdesign.verify.exhaustive.zero_command import pressure_drops
from dzdesign.verify.folder import read_compensator
from dzdesign.verify.toolchain import machines
from dzdesign.verify.toolchain.compiled_core import COUNTED, CompiledCore, Findings
from dzdesign.verify.toolchain.host_compiler import host_compiler
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4, Machine
from tests.support.golden_firmware import FULL, golden_folder
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler

CODES = "uint16_t u_adc, uint16_t p_a_adc, uint16_t p_b_adc"


def needs(machine):
    return pytest.mark.skipif(bool(machine.missing()), reason=f"{machine.name}: {machine.missing()}")


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    return golden_folder("f28335", tmp_path_factory.mktemp("plain") / "fw")


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    """Both signs, unlike sensors with live zeros, swapped pressures, an edge."""
    return golden_folder("f28335", tmp_path_factory.mktemp("full") / "fw", FULL)


def exact_law(folder, sign: int = 1) -> ExactLaw:
    return ExactLaw(read_compensator(folder), sign)


def wrapped(core: CompiledCore, statement: str) -> CompiledCore:
    """The core whose drive has a statement that may change `compare`, the right value of the law, after a sample."""
    name, body = "dz_drive.c", "right(drive, u_adc, p_a_adc, p_b_adc); uint16_t compare = drive->law;"
    text = core.sources[name].decode()
    head = f"void dz_drive_sample(struct dz_drive *drive, {CODES})\n{{"
    text, count = re.subn(
        r"void dz_drive_sample\(struct dz_drive \*drive, [^)]*\)\n\{",
        f"static void right(struct dz_drive *drive, {CODES})\n{{",
        text,
    )
    assert count == 1
    text += f"{head}\n    {body}\n\n    {statement}\n    drive->law = compare;\n}}\n"
    return core.edited(name, text.encode())


#: One count each, and how often it must fire: at a command and a difference, or at a pair of pressures.
FAULTS = {
    "wrong": ("if (u_adc == 3000u && p_a_adc == p_b_adc + 77u) compare++;", {"wrong": 1}),
    "out of range": ("if (u_adc == 4095u && p_a_adc == p_b_adc) compare = 60001u;", {"out_of_range": 1, "wrong": 1}),
    # The row after it goes against the law too, where that rises with dP.
    "not_monotone_in_u": (
        "if (u_adc == 2000u && p_a_adc == p_b_adc + 9u) compare = (uint16_t)(compare - 20u);",
        {"not_monotone_in_u": 1, "wrong": 1},
    ),
    "not_monotone_in_dp": (
        "if (u_adc <= 5u && p_a_adc == p_b_adc + 500u) compare = 33000u;",
        {"not_monotone_in_dp": 6, "wrong": 6},
    ),
    # Of each sensor six codes are paired, three sound ones and three others.
    "fallback": ("if (u_adc == 65535u) compare = 1u;", {"bad_fallbacks": 36}),
    "fallback of a pressure": ("if (p_b_adc == 65535u && u_adc == 17u) compare++;", {"bad_fallbacks": 6}),
}


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_each_count_fires(plain, fault):
    statement, expected = FAULTS[fault]
    prepared = PreparedInputs(exact_law(plain))
    found = wrapped(CompiledCore(plain), statement).check(prepared.everything())
    assert {name: getattr(found, name) for name in expected} == expected
    assert found.faults


@pytest.mark.slow
def test_a_pair_of_pressures_that_is_not_its_difference_is_odd_and_not_wrong(plain):
    prepared = PreparedInputs(exact_law(plain))
    odd = wrapped(CompiledCore(plain), "if (p_a_adc == 2500u && p_b_adc == 2001u) compare++;")
    found = odd.check(prepared.everything())
    assert found.wrong == 0 and found.odd_pairs >= 2, "at the commands that take it in turn, and at zero command"
    at_zero = wrapped(CompiledCore(plain), "if (u_adc == 0u && p_a_adc == 2500u && p_b_adc == 2001u) compare++;")
    assert at_zero.check(prepared.everything()).odd_pairs >= 1
    assert at_zero.check(prepared.everything(cube=False)).odd_pairs == 0
    low = wrapped(CompiledCore(plain), "if (p_a_adc == 100u && p_b_adc == 4000u) compare++;")
    assert low.check(prepared.everything()).odd_pairs >= 1, "where the law does not follow, the commands still take it"


@pytest.mark.parametrize("sign", [1, -1])
def test_what_is_shown_is_checked_on_both_sides(full, sign):
    prepared, core = PreparedInputs(exact_law(full, sign)), CompiledCore(full, sign)
    for name, old, new, count in (
        ("dz_comp.h", "_command(block, u) & DZ_STATUS_COMMAND", "_command(block, u) & DZ_STATUS_ABOVE", "bad_status"),
        ("dz_comp.h", "tested_to - difference", "tested_to * 0u - difference", "bad_status"),
        ("dz_comp.c", "side->beta_shift & LARGEST_WIDE_SHIFT", "34u", "bad_betas"),
    ):
        text = core.sources[name].decode()
        assert old in text
        found = core.edited(name, text.replace(old, new).encode()).check(prepared.sample(), sample=True)
        assert getattr(found, count) > 0
        # The drive's outputs depend on the status, and on no beta that is shown.
        assert found.faults == getattr(found, count) or count == "bad_status"


#: Wrong where the law that the drive holds is right: at one pair of command and pressure difference, and at one value.
BESIDE_THE_LAW = {
    "dz_comp()": ("dz_comp.c", "u = u_adc;\n    const uint32_t let_go",
                  "u = u_adc + (u_adc == 1234u && p_a_adc - p_b_adc == 567);\n    const uint32_t let_go"),
    "status": ("dz_drive.c", "    drive->status = (uint16_t)(",
               "    drive->status = (uint16_t)((u_adc == 1234u && p_a_adc - p_b_adc == 567) | "),
    "compare value": ("dz_drive.c", "drive->compare_a = (uint16_t)compare;",
                      "drive->compare_a = (uint16_t)(compare + (drive->law == 40028u));"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("part", BESIDE_THE_LAW)
def test_what_a_right_law_becomes_is_tried_too(plain, part):
    name, old, new = BESIDE_THE_LAW[part]
    prepared, core = PreparedInputs(exact_law(plain)), CompiledCore(plain)
    text = core.sources[name].decode()
    assert old in text
    found = core.edited(name, text.replace(old, new, 1).encode()).check(prepared.everything())
    assert found.wrong >= 1 and (found.wrong == 1 or part == "compare value")
    assert found.first_found == found.first_expected and "do not agree" in first_wrong(prepared, found)


@pytest.mark.slow
def test_both_sides_of_everything_see_a_fault_at_one_place(full):
    for sign in (1, -1):
        prepared = PreparedInputs(exact_law(full, sign))
        core = CompiledCore(full, sign)
        code = 2048 + sign * 1000
        found = wrapped(core, f"if (u_adc == {code}u && p_a_adc >> 4 == 125u) compare++;").check(prepared.everything())
        assert found.wrong + found.odd_pairs >= 1
        words = first_wrong(prepared, found)
        assert words is None or f"command code {code}," in words
        honest = core.check(prepared.everything())
        assert honest.faults == 0 and honest.inputs == prepared.differences.made.sum() * 4096
        assert core.check(prepared.sample(), sample=True).faults == 0


@pytest.mark.slow
def test_the_hash_is_of_all_compare_values(plain):
    prepared = PreparedInputs(exact_law(plain)).everything()
    core = CompiledCore(plain)
    hashes = {core.check(prepared).outputs_hash}
    for code in (0, 1, 4095):
        hashes.add(wrapped(core, f"if (u_adc == {code}u && p_a_adc == 4014u && p_b_adc == 688u) compare++;")
                   .check(prepared).outputs_hash)  # fmt: skip
    assert len(hashes) == 4
    assert core.check(prepared).object_sha256 != wrapped(core, ";").check(prepared).object_sha256


def test_a_core_that_crashes_or_hangs_does_not_pass(plain, monkeypatch):
    prepared = PreparedInputs(exact_law(plain)).everything()
    crash = wrapped(CompiledCore(plain), "if (u_adc == 9u) *(volatile char *)0 = 1;")
    with pytest.raises(RequirementError, match="ended with signal"):
        crash.check(prepared)
    hang = wrapped(CompiledCore(plain), "while (u_adc == 9u) { *(volatile uint16_t *)&compare = 1u; }")
    with pytest.raises(RequirementError, match="did not end"):
        hang.check(prepared, replace(machines.HOST, run_timeout_s=2.0))


# --- what is prepared ---------------------------------------------------------------------------------------


def test_the_layouts_are_those_of_the_header(tmp_path):
    structs = {"dz_plan": PLAN, "dz_part": PART, "dz_row": ROW, "dz_direction": DIRECTION, "dz_pair": PAIR}
    asked = [f"sizeof(struct {name})" for name in structs]
    asked += [f"offsetof(struct {name}, {field})" for name, dtype in structs.items() for field in dtype.names]
    prints = "".join(f'printf("%d\\n", (int)({each}));' for each in asked)
    (tmp_path / "sizes.c").write_text(
        f'#include <stddef.h>\n#include <stdio.h>\n#include "every_input.h"\nint main(void) {{ {prints} return 0; }}\n'
    )
    command = [host_compiler(), f"-I{machines.PROGRAMS}", "sizes.c", "-o", "sizes"]
    subprocess.run(command, cwd=tmp_path, check=True)
    said = subprocess.run([str(tmp_path / "sizes")], capture_output=True, text=True, check=True).stdout.split()
    expected = [dtype.itemsize for dtype in structs.values()]
    expected += [dtype.fields[field][1] for dtype in structs.values() for field in dtype.names]
    assert list(map(int, said)) == expected


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1, -1])
def test_the_pairs_of_a_difference_are_those_that_make_it(full, sign):
    exact = exact_law(full, sign)
    codes = np.arange(exact.code_max + 1)
    made = exact.difference(codes[:, None], codes[None, :])
    valid = (exact.ahead.valid_codes, exact.behind.valid_codes)
    sound_ahead, sound_behind = ((codes >= low) & (codes <= high) for low, high in valid)
    sound = sound_ahead[:, None] & sound_behind[None, :]
    found = differences(exact)
    counts = np.bincount(made[sound] - found.values[0], minlength=found.values.size)
    assert (counts == np.maximum(found.b_last - found.b_first + 1, 0)).all() and found.pairs == sound.sum()
    for place in np.flatnonzero(found.made)[::97]:
        b = np.arange(found.b_first[place], found.b_last[place] + 1)
        a = found.values[place] + found.slant[b]
        assert (made[a, b] == found.values[place]).all() and sound[a, b].all()


@pytest.mark.parametrize("sign", [1, -1])
def test_the_pressure_drops_of_a_difference_are_the_extremes_over_its_pairs(full, sign):
    exact = exact_law(full, sign)
    found = differences(exact)
    found_drops = pressure_drops(exact, found, [Fraction(1, 7)])
    scale, least, most = found_drops.scale, found_drops.least, found_drops.most
    sensors = (exact.ahead, exact.behind)
    a_MPa, b_MPa = (float(s.span_MPa) / (s.full_code - s.zero_code) for s in sensors)
    errors = [[float(error) for error in s.error_MPa] for s in sensors]
    ends = (errors[0][0] - errors[1][1], errors[0][1] - errors[1][0])
    for place in np.flatnonzero(found.made)[::61]:
        b = np.arange(found.b_first[place], found.b_last[place] + 1)
        a = found.values[place] + found.slant[b]
        drops = (a - exact.ahead.zero_code) * a_MPa - (b - exact.behind.zero_code) * b_MPa
        assert least[place] / scale == pytest.approx(drops.min() + ends[0], abs=1e-9)
        assert most[place] / scale == pytest.approx(drops.max() + ends[1], abs=1e-9)


def test_a_sample_has_the_corners(plain):
    prepared = PreparedInputs(exact_law(plain))
    chosen = prepared.differences.values[prepared.sampled_rows()].tolist()
    assert {-3326, -31, -30, -1, 0, 1, 3326} <= set(chosen) and len(chosen) >= SAMPLED_ROWS - 7
    assert {0, 1, 4094, 4095} <= set(prepared.sampled_places().tolist())
    assert OUTSIDE % 257 == 0


# --- other processors ---------------------------------------------------------------------------------------


@pytest.mark.slow
@needs(CORTEX_M4)
@pytest.mark.parametrize("sign", [1, -1])
def test_the_machine_code_of_the_cortex_m4_gives_what_the_host_gives_at_every_input(sign, tmp_path):
    folder = golden_folder("cortex-m4", tmp_path / "fw", FULL)
    host = check_all_inputs(folder, sign)
    done = check_on_machine(folder, CORTEX_M4, host)
    assert done.holds and done.found.inputs == host.inputs and done.found.outputs_hash == host.outputs_hash


@pytest.mark.slow
@needs(AVR)
def test_the_machine_code_of_the_avr_gives_what_the_host_gives_at_the_sample(tmp_path):
    folder = golden_folder("host", tmp_path / "fw")
    done = check_on_machine(folder, AVR, check_all_inputs(folder))
    assert done.holds and done.found.inputs > 5000


@pytest.mark.slow
@needs(AVR)
def test_an_int_of_16_bits_is_seen_on_the_avr_alone(tmp_path):
    """A product that needs a longer int, which no PC shows."""
    folder = golden_folder("host", tmp_path / "fw")
    core = folder / "core" / "dz_comp.c"
    text, count = re.subn(r"pressure_difference\(side, p_a_adc,",
                          "pressure_difference(side, (uint16_t)(p_a_adc * 101 / 101),", core.read_text())  # fmt: skip
    assert count >= 1
    core.write_text(text)
    host = check_all_inputs(folder)
    assert host.holds
    done = check_on_machine(folder, AVR, host)
    assert not done.holds and done.found.wrong > 100


def test_a_machine_that_is_not_here_is_not_passed(plain, monkeypatch):
    monkeypatch.setattr(machines, "find_program", lambda _: None)
    host = input_check_of(plain)
    checks = machine_code_checks(plain, (host,))
    assert [check.holds for check in checks] == [None, None]
    assert checks[0].text == (
        "not run: arm-none-eabi-gcc and qemu-system-arm not found; apt install gcc-arm-none-eabi qemu-system-arm"
    )
    assert [check.holds for check in machine_code_checks(plain, ())] == [None, None]


def input_check_of(folder):
    """An InputCheck without running anything."""
    prepared = PreparedInputs(exact_law(folder))
    at_zero = np.zeros(prepared.differences.values.size, dtype=int)
    found = Findings(outputs_hash="", object_sha256="", at_zero=at_zero, **dict.fromkeys(COUNTED, 0))
    return input_check(prepared, CompiledCore(folder).sha256, found)


@pytest.mark.parametrize(
    ("target", "tried"), [("cortex-m4", ["Cortex-M4"]), ("f28335", ["Cortex-M4", "AVR"])]
)
def test_without_tools_the_targets_own_machine_alone_is_required(tmp_path, monkeypatch, target, tried):
    monkeypatch.setattr(machine_code, "read_compensator", lambda _: SimpleNamespace(current_drive=None))
    monkeypatch.setattr(machine_code, "read_firmware_manifest", lambda _: SimpleNamespace(target=target))
    monkeypatch.setattr(Machine, "missing", lambda _: "no tools")
    (tmp_path / "manifest.json").touch()
    checks = machine_code.machine_code_checks(tmp_path, inputs=())
    assert [check.name.removeprefix("machine code of the ") for check in checks] == tried
    assert all(check.holds is None for check in checks)
    monkeypatch.setattr(Machine, "missing", lambda _: "")
    assert len(machine_code.machine_code_checks(tmp_path, inputs=())) == 2, "others are tried where they can be"
