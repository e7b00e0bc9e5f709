"""The law of a `Compensator` lowered to integers that the firmware can multiply, shift and compare, with proofs.

With beta = B / (D S), k x_max/u_max and u_min0/u_max over 2^16 and x = command code / C, the law (18) in counts is

    compare = (M B (p1 c + p0) / (D S 2^16 C)) + (M g0 c / C),        M = compare_max.

Cancelling the powers of two and the common factors of M and C leaves ``total / (divisor 2^shift)`` with an integer
`total` of 64 bits, so one shift and one division by a small constant give the exactly rounded law. The division is a
multiplication by a reciprocal that is proved exact for every dividend that can occur.
"""

from dataclasses import dataclass
from math import lcm

from dzdesign.core.errors import InputError
from dzdesign.derivation.law import law
from dzdesign.derivation.scaling import Line, evaluate_line
from dzdesign.design.compensator import Compensator

INT32_MAX = 2**31 - 1
INT64_MAX = 2**63 - 1


@dataclass(frozen=True, slots=True, kw_only=True)
class IntegerForm:
    """Constants of the core; see the module's text for the algebra.

    ``total = scale_beta * B(dp) * (slope * c + offset) + (linear * c << linear_shift) + half``, with B the table
    interpolated without rounding; ``compare = min((total >> shift) / divisor, compare_max)``; the division is
    ``(quotient_scaled * reciprocal) >> reciprocal_shift``.

    Attributes
    ----------
    table : tuple of int
        scale_beta times the beta numerators: 32-bit values.
    step_shift : int
        log2 of the pressure codes between nodes.
    slope, offset : int
        32-bit signed.
    linear, linear_shift : int
        Command term that beta does not touch.
    half, shift, divisor : int
        Rounding and denominator.
    reciprocal, reciprocal_shift : int
        Of the divisor.
    fallback : int
        scale_beta times the smallest beta numerator: for a pressure signal that can't be right.
    """

    table: tuple[int, ...]
    step_shift: int
    slope: int
    offset: int
    linear: int
    linear_shift: int
    half: int
    shift: int
    divisor: int
    reciprocal: int
    reciprocal_shift: int
    fallback: int


def integer_form(compensator: Compensator) -> IntegerForm:
    """Lower the law to integers and prove that nothing overflows and every division is exact.

    Raises
    ------
    InputError
        If the coefficients need more than 64-bit arithmetic.
    """
    c = compensator
    command_max, compare_max = c.signals.command_code_max, c.signals.compare_max
    chosen = law(c.law_name)

    def line(beta: int) -> Line:
        return evaluate_line(
            chosen,
            beta=beta,
            kappa=c.k_x_max_over_u_max,
            u_min0_over_u_max=c.u_min0_over_u_max,
            n_adc=command_max,
            n_full=compare_max,
        )

    # Eq. (18) is affine in beta: in counts it is beta (per_command c + constant) + plain c.
    without, whole = line(beta=0), line(beta=1)
    beta_unit = c.beta_denominator * c.beta_step_codes
    per_command = (whole.slope - without.slope) / beta_unit
    constant = (whole.start - without.start) / beta_unit
    plain = without.slope
    common = lcm(per_command.denominator, constant.denominator, plain.denominator)
    divisor = common
    shift = 0
    while divisor % 2 == 0:
        divisor, shift = divisor // 2, shift + 1
    if shift == 0:  # rounding to nearest needs half a unit, so the denominator is made even
        shift, common = 1, 2 * common
    slope, offset, linear = (int(value * common) for value in (per_command, constant, plain))
    scale_beta = _share(slope, offset, command_max)
    slope, offset = slope // scale_beta, offset // scale_beta
    linear_shift = 0
    while linear and linear % 2 == 0:
        linear, linear_shift = linear // 2, linear_shift + 1
    half = common // 2
    largest = _largest_quotient(compensator, common, divisor)
    reciprocal, reciprocal_shift = _exact_reciprocal(divisor, largest)
    form = IntegerForm(
        table=tuple(scale_beta * numerator for numerator in c.beta_numerators),
        step_shift=c.beta_step_codes.bit_length() - 1,
        slope=slope,
        offset=offset,
        linear=linear,
        linear_shift=linear_shift,
        half=half,
        shift=shift,
        divisor=divisor,
        reciprocal=reciprocal,
        reciprocal_shift=reciprocal_shift,
        fallback=scale_beta * min(c.beta_numerators),
    )
    _prove_widths(form, compensator)
    return form


def _share(slope: int, offset: int, command_max: int) -> int:
    """Return the smallest common factor of slope and offset that, moved into the table, leaves them 32 bits."""
    needed = max(abs(offset), abs(slope * command_max + offset), abs(slope) * command_max)
    smallest = max(1, -(-needed // INT32_MAX))
    return next((factor for factor in range(smallest, 2**16) if slope % factor == 0 and offset % factor == 0), 1)


def _largest_quotient(compensator: Compensator, common: int, divisor: int) -> int:
    """Return a bound of ``total >> shift``: the law's largest value at any node, times divisor."""
    command_max, pressure_max = compensator.signals.command_code_max, compensator.signals.pressure_code_max
    # Every node that a code reaches, and the fallback's smallest beta: along dP the law is straight between them.
    codes = [index * compensator.beta_step_codes for index in range(len(compensator.beta_numerators) - 1)]
    codes += [pressure_max, -pressure_max]
    ends = [compensator.drive(command_max, code) for code in codes]
    starts = [compensator.drive(0, code) for code in codes]
    if min(ends + starts) < 0:
        raise InputError("the law asks for a negative drive somewhere; check k x_max/u_max and u_min0")
    # One count more for rounding.
    largest = max(ends + starts) * compensator.signals.compare_max + 2
    return int(largest * divisor) + divisor


def _exact_reciprocal(divisor: int, largest: int) -> tuple[int, int]:
    """Return (m, s) with ``n // divisor == n * m >> s`` for every n up to `largest`.

    With m = ceil(2^s / d) and e = m d - 2^s the quotient is exact as long as ``n e < 2^s`` (for n = q d + r the error
    n e / (d 2^s) must stay below 1/d).
    """
    if divisor == 1:
        return 1, 0
    for shift in range(32, 64):
        reciprocal = -(-(1 << shift) // divisor)
        if largest * (reciprocal * divisor - (1 << shift)) < 1 << shift:
            if reciprocal * largest >= 1 << 64 or reciprocal >= 1 << 32:
                break
            return reciprocal, shift
    raise InputError(f"no 32-bit reciprocal divides by {divisor} exactly up to {largest}")


def _prove_widths(form: IntegerForm, compensator: Compensator) -> None:
    """Prove that every intermediate value fits the type that the template gives it."""
    command = compensator.signals.command_code_max
    step = compensator.beta_step_codes
    beta = max(form.table) * step
    inner = max(abs(form.offset), abs(form.slope * command + form.offset))
    straight = form.linear * command << form.linear_shift
    checks = {
        "the interpolated table": (beta, INT32_MAX),
        "slope times command": (abs(form.slope) * command, INT32_MAX),
        "the command-dependent factor": (inner, INT32_MAX),
        "the 64-bit sum": (beta * inner + straight + form.half, INT64_MAX),
        "the command's own term": (form.linear, 2**32 - 1),
    }
    for what, (value, limit) in checks.items():
        if value > limit:
            raise InputError(
                f"{what} needs {value.bit_length()} bits, more than the firmware's {limit.bit_length()}; "
                "choose scalings with smaller common denominators"
            )
