"""The law of one side of a `Compensator` lowered to integers that the firmware can multiply, shift and compare, proved.

With beta = B / (D S), k x_max/u_max and u_min0/u_max over 2^16 and x = c / C, c being the codes of command from zero
on, the law (18) in counts, lowered inside the transition of E codes behind a zero band of Z, is

    compare = B_law (p X + o) + l X - (B_law - B) e (E - r),    r = min(max(c - Z, 0), E),

p, o, l and e rational. X is the command that the law is given, in codes over E: (Z + E) r within the transition and E c
beyond it, together E max(c - Z, 0) + Z r; without a transition it is c. Times the common denominator every term is an
integer; cancelling powers of two leaves
``total / (divisor 2^shift)`` with an integer `total` of 64 bits, so one shift and one division by a small constant give
the exactly rounded law. The division is a multiplication by a reciprocal that is proved exact for every dividend that
can occur. That the firmware's words hold every value is not proved here: of the C `acceptance` does, of another text
the ranges of its operations.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import lcm
from typing import NamedTuple

from dzdesign.core.errors import InputError
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import Line, evaluate_line, evaluate_transition
from dzdesign.design.compensator import Compensator

INT32_MAX = 2**31 - 1
INT64_MAX = 2**63 - 1
WORD_BITS = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Scaling:
    """Units of one side's command and output: counts of those from zero on."""

    #: Full command, the transition's length behind the zero band, and full output.
    span: int
    transition: int
    full: int
    #: Whether the output is rounded to the nearest, a half up; else it is rounded down.
    rounds: bool = True
    #: Bits that the sum's shift drops at least: rounding needs one, and a shift by a whole word of 32 costs nothing.
    least_shift: int = WORD_BITS


def scaling_of_codes(compensator: Compensator, sign: int) -> Scaling:
    """Return the scaling of converter codes and compare values."""
    signals = compensator.signals
    return Scaling(span=signals.command.span(sign), transition=compensator.transition_codes, full=signals.compare_max)


@dataclass(frozen=True, slots=True, kw_only=True)
class IntegerForm:
    """Constants of the core; see the module's text for the algebra.

    ``total = B_law * (slope * X + offset) + (linear * X << linear_shift) + half
    - (B_law - B) * transition * (E - r)``
    with B_law and B the tables interpolated without rounding; the output is ``(total >> shift) / divisor``, rounded
    down.
    """

    #: `scale_beta` times the numerators of the law's beta, then twice the smallest of them.
    table: tuple[int, ...]
    #: The same of the certified beta at zero command; empty without a transition.
    zero_table: tuple[int, ...]
    scale_beta: int
    #: 32 bits with sign.
    slope: int
    offset: int
    #: 32 bits; 0 without a transition.
    transition: int
    linear: int
    linear_shift: int
    half: int
    shift: int
    divisor: int


def integer_form(compensator: Compensator, sign: int = 1, scaling: Scaling | None = None) -> IntegerForm:
    """Lower the law of one side to integers, exactly; `scaling` is that of converter codes where none is given."""
    side, units = compensator.side(sign), scaling or scaling_of_codes(compensator, sign)
    terms = _terms(compensator, sign, units)
    divisor, shift, common = _denominator(terms, units.least_shift)
    slope, offset, linear, transition = (int(value * common) for value in terms)
    span = units.span * (units.transition or 1)
    scale_beta = _share((slope, offset, transition), (abs(slope) * span, abs(offset), transition * units.transition))
    linear, linear_shift = _odd_part(linear)
    return IntegerForm(
        table=_table(side.law_beta, scale_beta),
        zero_table=_table(side.beta, scale_beta) if units.transition else (),
        scale_beta=scale_beta,
        slope=slope // scale_beta,
        offset=offset // scale_beta,
        transition=transition // scale_beta,
        linear=linear,
        linear_shift=linear_shift,
        half=common // 2 if units.rounds else 0,
        shift=shift,
        divisor=divisor,
    )


class _Terms(NamedTuple):
    """Rational factors of the law in counts, in the units of the table: p, o, l and e of the module's text."""

    per_command: Fraction
    constant: Fraction
    plain: Fraction
    per_transition_code: Fraction


def _terms(compensator: Compensator, sign: int, units: Scaling) -> _Terms:
    """Return the law's terms: Eq. (18) is affine in beta, in counts beta (per_command c + constant) + plain c."""
    c, side = compensator, compensator.side(sign)

    def line(beta: int) -> Line:
        return evaluate_line(
            law(c.law),
            beta=beta,
            kappa=side.drive_range_over_u_max,
            u_min0_over_u_max=side.u_min0_over_u_max,
            n_adc=units.span,
            n_full=units.full,
        )

    without, whole = line(beta=0), line(beta=1)
    beta_unit = c.beta_denominator * c.beta_step_codes
    per_code = units.transition or 1
    per_transition_code = Fraction(0)
    if units.transition:  # what one unit of the gap lowers at zero command, over the transition's codes
        lowered = evaluate_transition(
            beta_opening=1,
            beta_closing=0,
            u_min0_over_u_max=side.u_min0_over_u_max,
            share_of_transition=0,
            n_full=units.full,
        )
        per_transition_code = lowered / beta_unit / units.transition
    return _Terms(
        per_command=(whole.slope - without.slope) / beta_unit / per_code,
        constant=(whole.start - without.start) / beta_unit,
        plain=without.slope / per_code,
        per_transition_code=per_transition_code,
    )


def _denominator(terms: _Terms, least_shift: int) -> tuple[int, int, int]:
    """Return (divisor, shift, divisor 2^shift): what all terms times it are integers, the divisor odd."""
    divisor, shift = _odd_part(lcm(*(value.denominator for value in terms)))
    shift = max(shift, least_shift)
    return divisor, shift, divisor << shift


def _odd_part(value: int) -> tuple[int, int]:
    """Return (odd, shift) with ``odd << shift == value``; of zero (0, 0)."""
    shift = (value & -value).bit_length() - 1 if value else 0
    return value >> shift, shift


def _table(numerators: tuple[int, ...], scale: int) -> tuple[int, ...]:
    """Return the scaled nodes, then twice the smallest of them: the fallback's segment."""
    return tuple(scale * numerator for numerator in (*numerators, *(min(numerators),) * 2))


def _share(coefficients: tuple[int, ...], sizes: tuple[int, ...]) -> int:
    """Return the smallest common factor of the coefficients that, moved into the tables, leaves `sizes` 32 bits."""
    smallest = max(1, -(-max(sizes) // INT32_MAX))
    factors = range(smallest, 2**16)
    return next((factor for factor in factors if all(value % factor == 0 for value in coefficients)), 1)


def exact_factors(share: Fraction, largest: int, shifts: range) -> Iterator[tuple[int, int]]:
    """Yield (m, s) with ``v * m >> s`` equal to v times `share`, rounded down, for every v up to `largest`.

    With n/d the share in lowest terms, m at or above 2^s n/d and e = m d - 2^s n, the quotient errs by v e / (d 2^s).
    That must stay below 1/d, the least distance of v n/d to the integer above it. No m has more than 32 bits, and no
    product more than 64.
    """
    numerator, denominator = share.as_integer_ratio()
    for shift in shifts:
        factor = -(-(numerator << shift) // denominator)
        excess = factor * denominator - (numerator << shift)
        if factor < 1 << 32 and factor * largest < 1 << 64 and largest * excess < 1 << shift:
            yield factor, shift


def exact_reciprocal(divisor: int, largest: int) -> tuple[int, int]:
    """Return (m, s) with ``n // divisor == n * m >> s`` for every n up to `largest`, s at least a word of 32."""
    for factor, shift in exact_factors(Fraction(1, divisor), largest, range(WORD_BITS, 2 * WORD_BITS)):
        return factor, shift
    raise InputError(f"no 32-bit reciprocal divides by {divisor} exactly up to {largest}; choose other scalings")
