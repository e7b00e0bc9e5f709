"""The integer form against the exact law, and what the C may not contain."""

import dataclasses
import re
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.calibration.block import numbers_of
from dzdesign.codegen.core.integer_form import exact_reciprocal, integer_form
from dzdesign.codegen.project import generate
from dzdesign.core.errors import InputError
from dzdesign.design.side_design import finest_units
from dzdesign.design.side_law import SideLaw, Sides
from dzdesign.design.signals import CommandSignal
from tests.support.synthetic import with_side


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
    code = re.sub(r"/\*.*?\*/", "", example_firmware.files["core/dz_comp.c"], flags=re.DOTALL)
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
