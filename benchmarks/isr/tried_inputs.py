"""The inputs on which instructions and cycles are counted, and the law's exact values on them."""

import random
from collections.abc import Sequence
from fractions import Fraction

from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import PressureSignal, Signals
from dzdesign.verify.exhaustive.exact_law import ExactLaw

SEED = 7
RANDOM_INPUTS = 64

Codes = tuple[int, int, int]  # u_adc, p_a_adc, p_b_adc

#: A sensor over the whole range of the converter, without a live zero: the rivals know no other.
WHOLE_RANGE = PressureSignal(
    zero_code=0, full_code=4095, valid_codes=(0, 4095), error_MPa=(-Fraction(20, 4096), Fraction(20, 4096))
)
SIGNALS = Signals(pressure_a=WHOLE_RANGE, pressure_b=WHOLE_RANGE)


def has_whole_range(signals: Signals) -> bool:
    """Return whether every code that the converter has is a pressure and a command, from zero on."""
    ends = (0, signals.code_max)
    pressures = (signals.pressure_a, signals.pressure_b)
    return signals.command.valid_codes == ends and all(
        (each.zero_code, each.full_code) == each.valid_codes == ends for each in pressures
    )


def tried_inputs(compensator: Compensator) -> list[Codes]:
    """Return corners, node edges, impossible codes and random codes of command and two pressures.

    Commands 0, 1, middle, last but one, last; differences about 0, about the failed-sensor limit, about the first,
    second, middle and last node, and the ends, each with the pressures as low and as high as they go; impossible
    codes just outside and at 65535; `RANDOM_INPUTS` more with seed `SEED`.
    """
    signals, step, reverse = compensator.signals, compensator.beta_step_codes, compensator.reverse_codes
    u_max, p_max = signals.code_max, signals.code_max
    last = p_max // step * step
    nodes = (step, 2 * step, p_max // 2 // step * step, last)
    differences = {-p_max, -p_max // 2, -reverse - 1, -reverse, -1, 0, 1, p_max - 1, p_max}
    differences |= {node + near for node in nodes for near in (-1, 0, 1)}
    pairs = []
    for dp in sorted(differences):
        spare = p_max - abs(dp)
        pairs += [(back + max(dp, 0), back + max(-dp, 0)) for back in sorted({0, spare})]
    commands = (0, 1, u_max // 2, u_max - 1, u_max)
    inputs = [(u, *pair) for u in commands for pair in pairs]
    inputs += [(u, *pair) for u in (u_max + 1, 65535) for pair in ((0, 0), (p_max, 0), (0, p_max), (65535, 65535))]
    inputs += [(u, *pair) for u in commands for pair in ((p_max + 1, 0), (0, p_max + 1), (65535, 0), (0, 65535))]
    draw = random.Random(SEED)
    inputs += [(draw.randint(0, u_max), draw.randint(0, p_max), draw.randint(0, p_max)) for _ in range(RANDOM_INPUTS)]
    return inputs


def expected_compares(compensator: Compensator, inputs: Sequence[Codes]) -> list[int]:
    """Return the exactly rounded law at `inputs`, by the reference of `dzdesign.verify`."""
    exact = ExactLaw(compensator)
    compares = []
    for u, p_a, p_b in inputs:
        possible = max(p_a, p_b) <= exact.code_max
        corners = exact.corners(exact.betas(p_a - p_b if possible else -exact.reverse - 1))
        # An impossible command lets the valve go.
        compares.append(exact.compare_value(u, corners) if u <= exact.code_max else 0)
    return compares


def inputs_header(inputs: Sequence[Codes], repeats: int, *, program_memory: bool = False) -> str:
    """Return ``inputs.h``; with `program_memory` for AVR, whose data memory is small."""
    rows = "\n".join(f"    {{{u}u, {p_a}u, {p_b}u}}," for u, p_a, p_b in inputs)
    place = " PROGMEM" if program_memory else ""
    reader = "#define input(i, j) pgm_read_word(&inputs[i][j])\n" if program_memory else ""
    include = "#include <avr/pgmspace.h>\n" if program_memory else ""
    return (
        f"#include <stdint.h>\n{include}{reader}#define INPUT_COUNT {len(inputs)}\n#define REPEATS {repeats}\n"
        f"static const uint16_t inputs[INPUT_COUNT][3]{place} = {{\n{rows}\n}};\n"
    )


def exact_rows_header(compensator: Compensator) -> str:
    """Return ``exact_rows.h``: start and slope of each straight part of every row of constant pressure difference."""
    from itertools import pairwise
    from math import lcm

    exact = ExactLaw(compensator)
    # Half a count more, so that the floor rounds to nearest, a half up.
    lines = {}
    for dp in range(-exact.code_max, exact.code_max + 1):
        corners = exact.corners(exact.betas(dp))
        lines[dp] = [
            (start + Fraction(1, 2), (end - start) / (last - first))
            for (first, start), (last, end) in pairwise(corners)
        ]
    places = [first for first, _ in corners[:-1]]
    denominator = lcm(*(value.denominator for parts in lines.values() for line in parts for value in line))
    if denominator >= 2**62:
        raise ValueError(f"the rows' common denominator needs {denominator.bit_length()} bits, expected at most 62")
    rows = []
    for start, slope in (line for parts in lines.values() for line in parts):
        numbers = [*divmod(int(start * denominator), denominator), *divmod(int(slope * denominator), denominator)]
        rows.append(f"    {{{numbers[0]}, INT64_C({numbers[1]}), {numbers[2]}, INT64_C({numbers[3]})}},")
    return f"""\
#include <stdint.h>
#define DENOMINATOR INT64_C({denominator})
#define PRESSURE_MAX {exact.code_max}
#define COMMAND_MAX {exact.code_max}
#define COMPARE_MAX {exact.compare_max}
struct exact_row {{
    int32_t start_quotient;
    int64_t start_remainder;
    int32_t slope_quotient;
    int64_t slope_remainder;
}};
#define PARTS {len(places)}
/* Commands at which the parts of a row begin, the first at zero. */
static const int32_t part_from[PARTS] = {{{", ".join(map(str, places))}}};
static const struct exact_row rows[{len(rows)}] = {{
{chr(10).join(rows)}
}};
"""
