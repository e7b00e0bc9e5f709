"""The compiled core against the law in volts at 50 digits, and the faults in the scaling that this must see."""

import random
from fractions import Fraction

import pytest
import sympy

from dzdesign.core.artefact_files import write_folder
from dzdesign.derivation import scaling
from dzdesign.derivation.law import LAW_NAMES, law
from dzdesign.derivation.scaling import COMMAND_CODE, COMPARE_VALUE, Line
from dzdesign.derivation.symbols import beta, k, n_adc, n_full, u_i, u_max, u_min0, u_O, x_max
from tests.support.synthetic import needs_compiler

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
