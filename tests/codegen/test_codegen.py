"""The integer form against the exact law, and what the C may not contain."""

import dataclasses
import re
import subprocess
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.core.integer_form import integer_form
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import InputError
from dzdesign.design.designing import design
from dzdesign.design.options import DesignOptions
from dzdesign.design.side_design import finest_units
from dzdesign.design.side_law import SideLaw, Sides
from dzdesign.design.signals import CommandSignal
from dzdesign.verify.toolchain.host_compiler import STRICT, check_strictly, find_compilers
from tests.support.paths import DEVICES
from tests.support.synthetic import needs_compiler, with_side


def evaluate(form, compensator, command: int, dp_code: int) -> int:
    """Do in Python, with integers of any size, what the C is meant to do."""
    step, codes = compensator.beta_step_codes, compensator.transition_codes
    place = max(dp_code, 0) if dp_code >= -compensator.reverse_codes else (len(form.table) - 2) * step
    node, share = divmod(place, step)

    def between(table):
        return table[node] * (step - share) + table[node + 1] * share

    past = max(command - compensator.zero_band_codes, 0)
    reached = min(past, codes)
    given = codes * past + compensator.zero_band_codes * reached if codes else command
    total = between(form.table) * (form.slope * given + form.offset)
    total += (form.linear * given << form.linear_shift) + form.half
    if codes:
        total -= (between(form.table) - between(form.zero_table)) * form.transition * (codes - reached)
    assert total >= 0
    quotient = min(total >> form.shift, form.largest)
    return quotient // form.divisor


def random_compensators(base, count: int, seed: int):
    """Vary every coefficient of a compensator at random, within what a valve can have."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        transition = int(rng.choice([0, 1, 32]))
        units = finest_units(base.signals, transition)
        unit = units.beta
        falling = np.sort(rng.integers(unit // 2, unit + 1, base.nodes(1)))[::-1]
        side = SideLaw(
            drive_range_over_u_max=Fraction(
                int(rng.integers(units.coefficient // 32, units.coefficient)), units.coefficient
            ),
            u_min0_over_u_max=Fraction(int(rng.integers(20, units.coefficient)), units.coefficient),
            beta=tuple(int(value) for value in falling),
            transition_beta=tuple(int(value) + unit // 16 for value in falling) if transition else None,
            certificate=base.positive.certificate,
        )
        law_name = str(rng.choice(["paper", "target"]))
        band = int(rng.integers(1, 60)) if transition else 0
        yield dataclasses.replace(
            base,
            law=law_name,
            sides=Sides(positive=side),
            transition_codes=transition,
            zero_band_codes=band,
            drive_functions=dataclasses.replace(base.drive_functions, leave_zero_codes=band + 1 if band else 0),
            beta_denominator=unit,
        )


def test_integer_form_equals_the_exact_law_at_random_and_at_corners(example_compensator):
    rng = np.random.default_rng(20)
    for compensator in random_compensators(example_compensator, 60, seed=19):
        form = integer_form(compensator)
        commands = [0, 1, 4094, 4095, *rng.integers(0, 4096, 20)]
        codes = [-3326, -31, -30, -1, 0, 1, 63, 64, 65, 3325, 3326, *rng.integers(-100, 3327, 20)]
        for command in map(int, commands):
            for code in map(int, codes):
                assert evaluate(form, compensator, command, code) == compensator.compare(command, code)


@pytest.mark.parametrize("seed", range(20))
def test_whatever_units_design_takes_the_firmware_can_count_in(example_compensator, seed):
    """Converters, attenuators, PWMs and transitions as they come: the coarsest units of design are enough."""
    rng = np.random.default_rng(seed)
    compare_max = int(rng.choice([60000, 40000, 10000, 4096, 1023]))
    span = int(rng.choice([4095, 3276, 3277, 2047, 2048, 4000, 1021]))
    signals = dataclasses.replace(
        example_compensator.signals, compare_max=compare_max, command=CommandSignal(full_code=span)
    )
    functions = dataclasses.replace(example_compensator.drive_functions, compare_limit=compare_max)
    base = dataclasses.replace(example_compensator, signals=signals, drive_functions=functions)
    for compensator in random_compensators(base, 6, seed):
        form = integer_form(compensator)
        band, end = compensator.zero_band_codes, compensator.transition_end
        for command in (0, 1, band, band + 1, max(end - 1, 0), end, end + 1, span // 3, span - 1, span):
            for code in (-31, -30, 0, 63, 700, 3326):
                assert evaluate(form, compensator, command, code) == compensator.compare(command, code)


@pytest.mark.slow
def test_reciprocal_is_exact_for_every_quotient_that_can_occur(example_compensator):
    form = integer_form(example_compensator)
    quotients = np.arange(0, 2 * 60000 * form.divisor, dtype=np.uint64)
    by_product = (quotients * np.uint64(form.reciprocal)) >> np.uint64(form.reciprocal_shift)
    assert np.array_equal(by_product, quotients // np.uint64(form.divisor))


def test_same_input_same_bytes(example_compensator, example_firmware):
    again = generate(example_compensator, "f28335")
    assert dict(again.files) == dict(example_firmware.files)


@pytest.mark.parametrize("law_name", ["paper", "target"])
@needs_compiler
def test_core_compiles_strictly_with_every_compiler(example_valve, law_name, tmp_path):
    firmware = generate(design(example_valve, DesignOptions(law=law_name)), "f28335")
    write_folder(tmp_path / "fw", firmware.files, firmware.manifest)
    sources, compilers = sorted((tmp_path / "fw" / "core").glob("*.c")), find_compilers()
    assert sources and compilers
    for compiler in compilers:
        for source in sources:
            check_strictly(source, compiler)


def test_core_has_no_floating_point_no_division_and_no_state(example_firmware):
    code = re.sub(r"/\*.*?\*/", "", example_firmware.files["core/dz_comp.c"], flags=re.DOTALL)
    assert not re.search(r"\b(float|double)\b|\d\.\d|%", code)
    assert "/" not in code.replace("#include", "")
    static_data = re.findall(r"^static (?!const )(?!(?:inline )?(?:struct )?\w+ \w+\()", code, flags=re.MULTILINE)
    assert static_data == []


def test_generated_files_carry_the_hash_of_their_compensator_and_no_date(example_firmware):
    """But for the user's to fill in: kept through the next generation, theirs would be the hash of another."""
    digest = example_firmware.manifest.made_from[0].sha256
    assert example_firmware.files[".gitattributes"] == "* -text\n"
    for name, text in example_firmware.files.items():
        if name not in ("compensator.json", ".gitattributes"):
            board = name in example_firmware.manifest.board
            assert (digest in text) is not board and ("Do not edit" in text) is not board, name
            assert ("Yours to edit" in text[:300]) is board, name
            assert not re.search(r"20\d\d-\d\d-\d\d", text), name


def test_names_from_users_do_not_reach_the_c(example_valve):
    tests = tuple(dataclasses.replace(test, source='*/ #error "x" \n.csv') for test in example_valve.positive.tests)
    side = dataclasses.replace(example_valve.positive, tests=tests)
    hostile = dataclasses.replace(example_valve, sides={"positive": side})
    firmware = generate(design(hostile), "f28335")
    for name, text in firmware.files.items():
        assert name == "compensator.json" or '#error "x"' not in text


def test_a_target_with_another_pwm_is_refused(example_compensator, wording):
    signals = dataclasses.replace(example_compensator.signals, compare_max=30000)
    functions = dataclasses.replace(example_compensator.drive_functions, compare_limit=30000)
    with wording.refusal(InputError):
        generate(dataclasses.replace(example_compensator, signals=signals, drive_functions=functions), "f28335")


def test_scalings_too_rich_for_the_integers_are_refused(example_compensator, wording):
    awkward = with_side(
        example_compensator,
        drive_range_over_u_max=Fraction(10**12 + 39, 3 * 10**12),
        u_min0_over_u_max=Fraction(7, 10**9 + 7),
    )
    with wording.refusal(InputError):
        integer_form(awkward)


@needs_compiler
def test_core_and_hardware_link_as_one_program(example_firmware, tmp_path):
    """The generated core takes the place of the stand-in: the ISR calls it on the model of the device."""
    stub = DEVICES / "f28335"
    for name, text in example_firmware.files.items():
        target = tmp_path / name
        target.parent.mkdir(exist_ok=True)
        target.write_text(text)
    command = [find_compilers()[0], *STRICT, "-c", f"-I{tmp_path / 'core'}", f"-I{stub}", f"-I{tmp_path / 'f28335'}"]
    for source in ("core/dz_comp.c", "f28335/dz_isr.c", "f28335/dz_hardware.c"):
        done = subprocess.run(
            [*command, str(tmp_path / source), "-o", str(tmp_path / "one.o")],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr


def test_a_law_whose_divisor_cancels_needs_no_reciprocal(example_compensator):
    even = with_side(
        dataclasses.replace(example_compensator, law="target"), drive_range_over_u_max=Fraction(273 * 100, 65536)
    )
    form = integer_form(even)
    assert form.divisor == 1
    for command in (0, 1, 1000, 4095):
        assert evaluate(form, even, command, 500) == even.compare(command, 500)
