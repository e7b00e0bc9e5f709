"""The integer form and the compiled core, fixed and in block form, against the exact law and the law in volts."""

import dataclasses
import random
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy

from dzdesign.codegen.calibration.block import block_of, built_for, numbers_of
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.packing import pack
from dzdesign.codegen.core.integer_form import exact_reciprocal, integer_form
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import InputError
from dzdesign.derivation import scaling
from dzdesign.derivation.law import LAW_NAMES, law
from dzdesign.derivation.scaling import COMMAND_CODE, COMPARE_VALUE, Line
from dzdesign.derivation.symbols import beta, k, n_adc, n_full, u_i, u_max, u_min0, u_O, x_max
from dzdesign.design.side_design import finest_units
from dzdesign.design.side_law import SideLaw, Sides
from dzdesign.design.signals import CommandSignal
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from tests.support.block_cores import block_folder
from tests.support.core_texts import texts
from tests.support.core_variants import firmware, variant
from tests.support.synthetic import needs_compiler, with_side

pytestmark = needs_compiler

DIGITS = 50
U_MAX_V, X_MAX_M = sympy.Integer(10), sympy.Rational(18, 10_000)
#: The nearest a value that is no tie comes to one is 1/(2 * 2^62); the 50 digits err by far less.
TIE = sympy.Float("1e-30", DIGITS)
COMMANDS = (0, 1, 19, 20, 35, 50, 51, 52, 4094, 4095)
CORNERS = [(command, dp) for command in COMMANDS for dp in (-3326, -31, -30, 0, 1, 63, 64, 3325, 3326)]


def rational(value) -> sympy.Rational:
    """Return a fraction, or a double, exactly."""
    return sympy.Rational(value.numerator, value.denominator) if isinstance(value, Fraction) else sympy.Rational(value)


def test_the_scaling_is_anchored_at_numbers():
    """Typed here, not taken from the statement: 10 V is code 4095, full drive 60000 counts, 20 MPa code 4095."""
    codes = [COMMAND_CODE.subs({u_i: volts, u_max: 10, n_adc: 4095}) for volts in (0, 5, 10)]
    counts = [COMPARE_VALUE.subs({u_O: volts, u_max: 10, n_full: 60000}) for volts in (0, 5, 10)]
    assert codes == [0, sympy.Rational(4095, 2), 4095]
    assert counts == [0, 30000, 60000]
    assert [scaling.pressure_drop(code, span=20, code_max=4095) for code in (-4095, 0, 819, 4095)] == [-20, 0, 4, 20]


def stated_compare(compensator, command: int, dp_code: int) -> int:
    """Go the way of the signal in volts: code -> u_i -> law -> u_O -> compare value, nearest count, limited.

    In the zero band u_O is the certified offset, and over the transition it runs straight from there to the law.
    """
    signals = compensator.signals
    volts = U_MAX_V * command / signals.code_max
    ends = (compensator.zero_band_codes, compensator.transition_end)
    begin, end = (U_MAX_V * codes / signals.code_max for codes in ends)
    values = {
        u_i: max(volts, end),
        beta: rational(compensator.law_beta(dp_code)),
        k: rational(compensator.positive.drive_range_over_u_max) * U_MAX_V / X_MAX_M,
        x_max: X_MAX_M,
        u_max: U_MAX_V,
        u_min0: rational(compensator.positive.u_min0_over_u_max) * U_MAX_V,
    }
    output = law(compensator.law).output.subs(values)
    if volts < end:
        offset = rational(compensator.beta(dp_code)) * values[u_min0]
        output = offset + (output - offset) * max(volts - begin, sympy.Integer(0)) / (end - begin)
    output = sympy.N(output, DIGITS)
    counts = sympy.N(COMPARE_VALUE.subs({u_O: output, u_max: U_MAX_V, n_full: signals.compare_max}), DIGITS)
    nearest = int(sympy.floor(counts + sympy.Rational(1, 2) + TIE))  # a half goes up
    return min(max(nearest, 0), signals.compare_max)


def wrong_codes(compensator, folder, seed: int) -> int:
    """Count where the compiled core differs from `stated_compare`, of 300 random pairs of codes and the corners."""
    from dzdesign.codegen.project import generate
    from tests.support.c_library import load_library

    firmware = generate(compensator, "f28335")
    write_folder(folder, firmware.files, firmware.manifest)
    names = ("dz_comp.c", "dz_comp.h", "dz_calibration.h", "dz_valve.h")
    library = load_library({name: (folder / "core" / name).read_text() for name in names}, "core")
    draw = random.Random(seed)
    pairs = CORNERS + [(draw.randint(0, 4095), draw.randint(-200, 3326)) for _ in range(300)]
    wrong = 0
    for command, dp_code in pairs:
        back = draw.randint(688, 4014 - abs(dp_code))  # any two valid pressures with this difference
        p_a, p_b = (back + dp_code, back) if dp_code >= 0 else (back, back - dp_code)
        found = library.dz_comp(command, p_a, p_b) & 0xFFFF
        wrong += found != stated_compare(compensator, command, dp_code)
    return wrong


@pytest.fixture(params=LAW_NAMES)
def compensator(request, example_valve):
    from dzdesign.design.designing import design
    from dzdesign.design.options import DesignOptions

    return design(example_valve, DesignOptions(law=request.param))


@needs_compiler
@pytest.mark.parametrize("seed", [31, 32])
def test_the_core_gives_the_count_nearest_to_the_law_in_volts(compensator, seed, tmp_path):
    assert wrong_codes(compensator, tmp_path / "fw", seed) == 0


FAULTS = {
    "converter of 4096": lambda line: Line(slope=line.slope.subs(n_adc, n_adc + 1), start=line.start),
    # Eq. (30) as printed adds u_min0 in volts to counts of the command.
    "u_min0 left in volts": lambda line: Line(slope=line.slope, start=line.start * U_MAX_V / n_adc),
}


@needs_compiler
@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.slow
def test_a_fault_in_the_scaling_is_seen_in_the_core(fault, example_valve, tmp_path, monkeypatch):
    """Design, codegen and verify share the scaling, so they agree on a wrong one; the way in volts does not."""
    from dzdesign.design.designing import design
    from dzdesign.design.options import DesignOptions

    # With a zero band a drive below zero is refused before there is a core.
    compensator = design(example_valve, DesignOptions(transition=Fraction(0)))
    true_line = scaling.law_in_counts
    monkeypatch.setattr(scaling, "law_in_counts", lambda each: FAULTS[fault](true_line(each)))
    assert wrong_codes(compensator, tmp_path / "fw", seed=33) > 100


# --- the law in counts and the pressures, in doubles of every kind ------------------------------------------


def folder_of(name, form, folder):
    if form == "block":
        return block_folder(variant(name), folder)
    made = firmware(name)
    write_folder(folder, made.files, made.manifest)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "form"),
    [("default", "fixed"), ("default", "block"), ("bipolar, all options", "fixed"), ("bipolar, all options", "block"),
     ("target law, no transition", "fixed"), ("inverted", "fixed"), ("live zero", "fixed")],
)  # fmt: skip
def test_every_input_gives_what_the_law_does(name, form, tmp_path):
    folder = folder_of(name, form, tmp_path / "fw")
    for sign in variant(name).signals.signs:
        result = check_all_inputs(folder, sign)
        assert result.holds and result.inputs > 20_000_000, result


def test_a_core_is_compiled_once_and_a_wrong_number_is_seen(tmp_path):
    compensator = variant("bipolar, all options")
    folder = block_folder(compensator, tmp_path / "fw")
    block = block_of(compensator, "0" * 64)
    core = CompiledCore(folder, -1)
    sample = PreparedInputs(ExactLaw(compensator, -1)).sample()
    right = core.check(sample, sample=True)
    assert not right.faults
    side = block.sides[1]
    for wrong in (
        {"offset": side.offset - side.offset // 1000},
        {"nodes": (*side.nodes[:20], side.nodes[20] + 300, *side.nodes[21:])},
        {"nodes": (*side.nodes[:-1], side.nodes[-1] + 3000)},
        {"transition": side.transition - side.transition // 1000},
        {"room": side.room // 2},
        {"quotient_limit": side.quotient_limit // 2},
        {"beta_factor": side.beta_factor - side.beta_factor // 1000},
        {"tested_to": side.tested_to // 2},
    ):
        octets = pack(replace(block, sides=(block.sides[0], replace(side, **wrong))))
        found = CompiledCore(folder, -1, octets).check(sample, sample=True)
        assert found.faults and found.object_sha256 == right.object_sha256, wrong


def test_the_same_block_firmware_serves_other_valves_and_a_fixed_one_does_not():
    first, second = (variant(name) for name in ("default", "no transition"))
    assert built_for(first) == built_for(second)
    assert texts(block_core_files(built_for(first))) == texts(block_core_files(built_for(second)))
    assert firmware("default").files["core/dz_valve.h"] != firmware("no transition").files["core/dz_valve.h"]


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
    return min((total >> form.shift) // form.divisor, compensator.drive_functions.compare_limit)


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
    divisor = integer_form(example_compensator).divisor
    quotients = np.arange(0, 2 * 60000 * divisor, dtype=np.uint64)
    reciprocal, shift = exact_reciprocal(divisor, quotients.size - 1)
    by_product = (quotients * np.uint64(reciprocal)) >> np.uint64(shift)
    assert np.array_equal(by_product, quotients // np.uint64(divisor))


def test_core_has_no_floating_point_no_division_and_no_state(example_firmware):
    files = example_firmware.files
    code = re.sub(r"/\*.*?\*/", "", files["core/dz_comp.h"] + files["core/dz_comp.c"], flags=re.DOTALL)
    code = code.replace("DZ_STATUS_ABOVE / DZ_STATUS_DIFFERENCE", "")  # of two constants
    assert not re.search(r"\b(float|double)\b|\d\.\d|%", code)
    assert "/" not in code.replace("#include", "")
    static_data = re.findall(r"^static (?!const )(?!(?:inline )?(?:struct )?\w+ \w+\()", code, flags=re.MULTILINE)
    assert static_data == []


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
        numbers_of(awkward)


def test_a_law_whose_divisor_cancels_needs_no_reciprocal(example_compensator):
    even = with_side(
        dataclasses.replace(example_compensator, law="target"), drive_range_over_u_max=Fraction(273 * 100, 65536)
    )
    form = integer_form(even)
    assert form.divisor == 1
    for command in (0, 1, 1000, 4095):
        assert evaluate(form, even, command, 500) == even.compare(command, 500)
