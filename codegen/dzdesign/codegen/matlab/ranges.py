"""The range of every intermediate value of dz_comp.m, and the proof that none leaves its class.

The integer classes of MATLAB and Octave saturate: what left its class would be another number than the C's, without a
word. Each range is computed from those of its operands; signs are kept, so that sums in any order are bounded, too.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from dzdesign.codegen.core.integer_form import IntegerForm
from dzdesign.codegen.telemetry.frame import beta_factor
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import WEIGHT_SHIFT, PressureSignal

#: Codes as they may come.
CODE_MAX = 65535
Kind = Literal["int32", "int64", "uint16"]
LIMITS: dict[Kind, tuple[int, int]] = {
    "int32": (-(2**31), 2**31 - 1),
    "int64": (-(2**63), 2**63 - 1),
    "uint16": (0, CODE_MAX),
}


@dataclass(frozen=True, slots=True)
class Range:
    """Least and largest value."""

    low: int
    high: int

    def __add__(self, other: "Range") -> "Range":
        return Range(self.low + other.low, self.high + other.high)

    def __sub__(self, other: "Range") -> "Range":
        return Range(self.low - other.high, self.high - other.low)

    def __mul__(self, other: "Range") -> "Range":
        ends = [x * y for x in (self.low, self.high) for y in (other.low, other.high)]
        return Range(min(ends), max(ends))

    def __rshift__(self, shift: int) -> "Range":
        return Range(self.low >> shift, self.high >> shift)

    def within(self, low: int, high: int) -> "Range":
        """Return the range of the values after a limitation."""
        return Range(*(min(max(end, low), high) for end in (self.low, self.high)))

    def with_zero(self) -> "Range":
        """Return the range where some values become zero."""
        return Range(min(self.low, 0), max(self.high, 0))

    def __str__(self) -> str:
        return f"{self.low} to {self.high}"


def exactly(value: int) -> Range:
    """Return the range of one value."""
    return Range(value, value)


@dataclass(slots=True)
class _Proof:
    """Ranges by name; a range that does not fit its class is an `InputError`."""

    found: dict[str, Range]

    def holds(self, name: str, value: Range, kind: Kind) -> Range:
        low, high = LIMITS[kind]
        if value.low < low or value.high > high:
            raise InputError(
                f"dz_comp.m: '{name}' goes from {value}, beyond its {kind}; choose scalings with smaller common "
                "denominators"
            )
        self.found[name] = value
        return value


def proved_ranges(compensator: Compensator, form: IntegerForm, sign: int) -> dict[str, Range]:
    """Return the range of each intermediate value of one side, by the name that the template prints it under."""
    proof = _Proof({})
    past = _command(proof, compensator, sign)
    drop = _pressures(proof, compensator, sign)
    beta, gap = _betas(proof, compensator, form, drop)
    _law(proof, compensator, form, past, beta, gap)
    step = compensator.beta_step_codes
    factor, shift = beta_factor(form.scale_beta * compensator.beta_denominator * step, max(form.table) * step)
    scaled = proof.holds("shown_scaled", beta * exactly(factor), "int64")
    proof.holds("shown", scaled >> shift, "uint16")
    return proof.found


def _command(proof: _Proof, compensator: Compensator, sign: int) -> Range:
    command = compensator.signals.command
    zero, direction, span = command.zero_code, command.direction(sign), command.span(sign)
    codes = Range(0, CODE_MAX)
    proof.holds("away", codes - exactly(zero) if direction > 0 else exactly(zero) - codes, "int32")
    valid = Range(*sorted(direction * (code - zero) for code in command.valid_codes)).with_zero()
    past = proof.holds("past", (valid - exactly(compensator.zero_band_codes)).within(0, CODE_MAX), "int32")
    return proof.holds("clipped", past.within(0, span - compensator.zero_band_codes), "int32")


def _pressures(proof: _Proof, compensator: Compensator, sign: int) -> Range:
    signals = compensator.signals
    like = signals.like_sensors
    weights = (1, 1) if like else (1 << WEIGHT_SHIFT, signals.weight_b)

    def weighted(name: str, sensor: PressureSignal, weight: int) -> Range:
        low, high = (code - sensor.zero_code for code in sensor.valid_codes)
        return proof.holds(name, Range(low, high).with_zero() * exactly(weight), "int32")

    a, b = weighted("a", signals.pressure_a, weights[0]), weighted("b", signals.pressure_b, weights[1])
    difference = proof.holds("difference", b - a if sign < 0 and signals.swapped else a - b, "int32")
    drop = proof.holds("drop", difference.within(0, LIMITS["int32"][1]), "int32")
    drop = proof.holds("dp", drop if like else drop >> WEIGHT_SHIFT, "int32")
    step = compensator.beta_step_codes
    proof.holds("row", drop >> step.bit_length() - 1, "int32")
    proof.holds("beyond", Range(0, min(step - 1, drop.high)), "int32")
    return drop


def _betas(proof: _Proof, compensator: Compensator, form: IntegerForm, drop: Range) -> tuple[Range, Range]:
    """Return the law's beta, and what it is more than the certified one at zero command."""
    step = compensator.beta_step_codes
    found, values = [], []
    for name, table in (("law", form.table), ("zero", form.zero_table)):
        if not table:
            continue
        nodes = table[:-2]
        if drop.high // step + 1 >= len(nodes):
            raise InputError(f"dz_comp.m: beta has {len(nodes)} nodes, too few for pressure drops up to {drop.high}")
        changes = [right - left for left, right in pairwise(nodes)]
        terms = Range(min(nodes), max(nodes)) * exactly(step)
        more = Range(min(changes), max(changes)).with_zero() * Range(0, step - 1)
        proof.holds(f"{name}_terms", Range(min(terms.low, more.low), max(terms.high, more.high)), "int32")
        found.append(proof.holds(f"{name}_beta", Range(min(table) * step, max(table) * step), "int32"))
        values.append(table)
    if len(values) == 1:
        return found[0], exactly(0)
    gaps = [law - zero for law, zero in zip(*values, strict=True)]
    return found[0], Range(min(gaps), max(gaps)).with_zero() * exactly(step)


def _law(proof: _Proof, compensator: Compensator, form: IntegerForm, past: Range, beta: Range, gap: Range) -> None:
    """Prove the law's sum: its terms one after the other, and what the total is as a whole."""
    transition = compensator.transition_codes
    command = past
    if transition:
        reached = proof.holds("reached", past.within(0, transition), "int32")
        long = past * exactly(transition)
        proof.holds("command_terms", long, "int32")
        command = long + exactly(compensator.zero_band_codes) * reached
    proof.holds("command", command, "int32" if transition else "int64")
    factor = proof.holds("factor", exactly(form.slope) * command + exactly(form.offset), "int64")
    total = proof.holds("product", beta * factor + exactly(form.half), "int64")
    if form.linear:
        straight = exactly(form.linear << form.linear_shift) * command
        total = proof.holds("straight", total + straight, "int64")
    if transition:
        missing = proof.holds("missing", exactly(form.transition) * Range(0, transition), "int64")
        total = proof.holds("lowered", total - gap * missing, "int64")
    # The form proves at every corner of the law that the total is never negative, and whether it exceeds the limit.
    quotient = Range(max(total.low, 0), total.high) >> form.shift
    quotient = proof.holds("quotient", quotient if form.exceeds else quotient.within(0, form.largest), "int64")
    limited = proof.holds("limited", quotient.within(0, form.largest), "int64")
    if form.divisor != 1:
        scaled = proof.holds("scaled", limited * exactly(form.reciprocal), "int64")
        limited = scaled >> form.reciprocal_shift
    proof.holds("count", limited, "uint16")
