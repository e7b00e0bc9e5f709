"""What a function block puts out at zero command, against the lower bounds of the threshold."""

from fractions import Fraction
from math import lcm

import numpy as np

from dzdesign.verify.exhaustive.test_vectors import differences
from dzdesign.verify.exhaustive.zero_command import (
    PressureDrops,
    ZeroCommandMargin,
    guarded_bounds,
    margins_of_drives,
    pressure_drops,
)
from dzdesign.verify.structured_text.every_pair import TriedBlock
from dzdesign.verify.structured_text.exact_block import ExactBlock, PER_MPa


def zero_output_margin(tried: TriedBlock, exact: ExactBlock) -> ZeroCommandMargin | None:
    """Return what the output of one side at zero command leaves to the bounds, at every pressure drop.

    In units of a PLC a pressure drop stands for all within one unit, and the sensors' own errors come on top.
    """
    bounds = guarded_bounds(exact.compensator, exact.sign)
    tested = {Fraction(repr(dp)) for dp in bounds.dp_MPa}
    if exact.of_codes:
        found = differences(exact)
        drops = pressure_drops(exact, found, tested)
        b = np.minimum(found.b_first, exact.code_max)
        a = exact.turn * found.values + found.slant[b]
    else:
        values, a, b = _pairs(exact)
        drops = _drops(exact, values, tested)
    outputs = _at_zero(tried, exact, a, b)
    unit_V = exact.compensator.u_max_V / exact.compare_max
    (margin,) = margins_of_drives(drops, outputs, unit_V, [bounds])
    return margin


def _pairs(exact: ExactBlock) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return every pressure drop that valid pressures make in units of a PLC, and a pair that makes it."""
    ahead, behind = exact.sensors if exact.turn > 0 else exact.sensors[::-1]
    values = np.arange(ahead.low - behind.high, ahead.high - behind.low + 1)
    second = np.maximum(behind.low, ahead.low - values)
    pair = (values + second, second)
    return values, *(pair if exact.turn > 0 else pair[::-1])


def _drops(exact: ExactBlock, values: np.ndarray, tested: set[Fraction]) -> PressureDrops:
    """Return the least and the largest pressure drop that each number may stand for."""
    (a_least, a_most), (b_least, b_most) = exact.a.error_MPa, exact.b.error_MPa
    ends = sorted(exact.turn * error for error in (a_least - b_most, a_most - b_least))
    scale = lcm(PER_MPa, *(value.denominator for value in (*ends, *tested)))
    unit = scale // PER_MPa
    least = (values - 1).astype(object) * unit + int(ends[0] * scale)
    most = (values + 1).astype(object) * unit + int(ends[1] * scale)
    small = max(abs(int(each)) for each in (least[0], most[-1])) < 2**61
    kind = np.int64 if small else object
    return PressureDrops(
        scale=scale, least=least.astype(kind), most=most.astype(kind), made=np.ones(values.size, dtype=bool)
    )


def _at_zero(tried: TriedBlock, exact: ExactBlock, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return what the block puts out at zero command with this side driven."""
    inputs = np.stack([np.full(a.size, exact.command_zero), a, b], axis=1)
    states = [exact.sign if each.kind == "DINT" else 1 for each in tried.block.of_section("VAR")]
    outputs, _, _ = tried.as_it_is(inputs, np.tile(np.array(states, dtype=np.int64), (a.size, 1)))
    found: np.ndarray = outputs[:, 0 if exact.sign > 0 else 1]
    return found
