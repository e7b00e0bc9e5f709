"""The law of each side in whole numbers for a PLC: no product of more than 32 bits, every division at the end.

With beta in the table's unit U the law is ``out = (B (slope c + offset) + U linear c) / (D U)``; c is the command.
Between zero band and transition's end it runs straight, so with the transition's E units, of which r are passed,
``E out = (E - r) out(at zero) + r out(c, at least at the end)``: two laws with whole weights. Each product of two
numbers of 32 bits is made of four of 16 bits; the sum, over ``D U E = 2^32 2^shift divisor``, is divided at the end.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm

from dzdesign.codegen.structured_text.interface import DINT_MAX, Interface
from dzdesign.core.errors import InputError
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import evaluate_line
from dzdesign.design.compensator import Compensator

#: By how much the lower limbs of the sum are lifted, so that a division that truncates rounds them down.
LIFT = 2**14
#: Bits of a limb, and of the limbs that are dropped whole.
LIMB, WORD = 16, 32
PROPOSED = "choose scalings with smaller common denominators, or take the other --interface"


@dataclass(frozen=True, slots=True, kw_only=True)
class LawForm:
    """Constants of one side; see the module's text."""

    slope: int
    offset: int
    linear: int
    #: Bits that the third limb drops, and what is divided then: an even number where the output is rounded.
    shift: int
    divisor: int
    #: What a node's numerator is multiplied by beside the step, and what stands for beta = 1.
    beta_scale: int
    beta_unit: int


def law_form(compensator: Compensator, interface: Interface, sign: int) -> LawForm:
    """Return the constants of one side; what needs more than 32 bits is an `InputError`."""
    unit = compensator.beta_denominator * compensator.beta_step_codes
    scaling = interface.sides[sign]
    terms = _terms(compensator, interface, sign)
    common, weight = lcm(*(value.denominator for value in terms)), max(scaling.transition, 1)
    kept = 1 if interface.rounds else 0  # of an even divisor the half is whole
    common <<= max(0, WORD + kept - _twos(common * unit * weight))
    slope, offset, linear = (int(value * common) for value in terms)
    span = scaling.span
    largest = max(abs(slope) * span, abs(offset), abs(slope * span + offset), abs(linear) * span)
    shared, least = gcd(slope, offset, linear), -(-largest // DINT_MAX)
    scale = next((each for each in range(max(1, least), shared + 1) if shared % each == 0), 0)
    if not scale or 2 * scale * unit > DINT_MAX:
        raise InputError(f"the law's coefficients need more than the 32 bits of a PLC's DINT; {PROPOSED}")
    over = common * unit * weight >> WORD
    shift = min(LIMB, _twos(over) - kept)
    divisor = over >> shift
    largest_output = interface.full + interface.full // 8
    if 3 * 3 * weight * (2**LIMB - 1) >= LIFT << LIMB or largest_output * divisor > DINT_MAX // 2:
        raise InputError(f"the law's sum needs more than the 32 bits of a PLC's DINT; {PROPOSED}")
    return LawForm(
        slope=slope // scale,
        offset=offset // scale,
        linear=linear // scale,
        shift=shift,
        divisor=divisor,
        beta_scale=scale,
        beta_unit=scale * unit,
    )


def _twos(value: int) -> int:
    return (value & -value).bit_length() - 1


def _terms(compensator: Compensator, interface: Interface, sign: int) -> tuple[Fraction, Fraction, Fraction]:
    """Return what beta multiplies, by command and alone, and the command's own term, in units of the output."""
    side, span = compensator.side(sign), interface.sides[sign].span

    def line(beta: int) -> tuple[Fraction, Fraction]:
        found = evaluate_line(
            law(compensator.law),
            beta=beta,
            kappa=side.drive_range_over_u_max,
            u_min0_over_u_max=side.u_min0_over_u_max,
            n_adc=span,
            n_full=interface.full,
        )
        return Fraction(found.slope), Fraction(found.start)

    (plain, nothing), (slope, start) = line(0), line(1)
    if nothing:
        raise InputError(f"law {compensator.law} drives without beta at zero command, which no PLC's block has")
    return slope - plain, start, plain
