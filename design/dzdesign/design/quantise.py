"""The units of beta and of the law's coefficients: as fine as the firmware's 64-bit arithmetic takes them."""

from dataclasses import dataclass
from math import gcd

from dzdesign.core.errors import InputError
from dzdesign.design.signals import Signals
from dzdesign.design.table.linear_programme import STEP_CODES

#: Finest and coarsest, as powers of two. Beta stays below 2, so a node fits 16 bits; a coefficient over 2^16 is finer
#: than half a count of a PWM of 60 000.
BETA_BITS = (15, 11)
COEFFICIENT_BITS = (16, 12)
#: What either factor of the firmware's product may take: 31 bits.
FACTOR_LIMIT = 2**31


@dataclass(frozen=True, slots=True, kw_only=True)
class Units:
    """Denominators, powers of two: of beta's nodes, and of k x_max/u_max and u_min0/u_max."""

    beta: int
    coefficient: int


def finest_units(signals: Signals, transition_codes: int) -> Units:
    """Return the finest units with which the law in counts fits the firmware's arithmetic; refuse where none do.

    In counts the law is ``B (p c + o) / (D S K C E) * M``, with C codes of command, E of the transition (0 without one)
    and M counts of the PWM. What M has in common with the denominator cancels, and what remains of M goes with the
    table B or with the factor in c, each of which has 31 bits.
    """
    units = _finest_that_fit(signals, transition_codes)
    if units is not None:
        return units
    spans = " and ".join(str(signals.command.span(sign)) for sign in signals.signs)
    what = f"a full command of {spans} codes over {signals.compare_max} counts"
    shorter = transition_codes
    while shorter and _finest_that_fit(signals, shorter) is None:
        shorter //= 2
    if shorter:
        share = shorter / min(signals.command.span(sign) for sign in signals.signs)
        raise InputError(
            f"a transition of {transition_codes} codes of command, with {what}, needs more than 64-bit arithmetic; "
            f"choose one of {100 * share + 0.01:.2f} % ({shorter} codes) at most"
        )
    raise InputError(
        f"{what} needs more than 64-bit arithmetic; choose an attenuator whose full command has more factors in common "
        "with the counts" + (", or give --transition off" if transition_codes else "")
    )


def fits(signals: Signals, transition_codes: int) -> bool:
    """Tell whether the law with such a transition fits the firmware's arithmetic."""
    return _finest_that_fit(signals, transition_codes) is not None


def _finest_that_fit(signals: Signals, transition_codes: int) -> Units | None:
    spans = [signals.command.span(sign) for sign in signals.signs]
    finest, coarsest = sum((BETA_BITS[0], COEFFICIENT_BITS[0])), sum((BETA_BITS[1], COEFFICIENT_BITS[1]))
    for total in range(finest, coarsest - 1, -1):
        for coefficient in range(COEFFICIENT_BITS[0], COEFFICIENT_BITS[1] - 1, -1):
            beta = total - coefficient
            if BETA_BITS[1] <= beta <= BETA_BITS[0] and all(
                _fits(span, signals.compare_max, transition_codes, beta, coefficient) for span in spans
            ):
                return Units(beta=1 << beta, coefficient=1 << coefficient)
    return None


def _fits(span: int, compare_max: int, transition_codes: int, beta_bits: int, coefficient_bits: int) -> bool:
    """Tell whether table and factor fit with some divisor of what remains of the PWM's range moved to the table."""
    transition = max(transition_codes, 1)
    powers = STEP_CODES << (beta_bits + coefficient_bits)
    shared = gcd(compare_max, powers * span * transition)
    remains = compare_max // shared
    table = STEP_CODES << (beta_bits + 1)
    factor = span * transition << coefficient_bits
    return any(
        table * moved < FACTOR_LIMIT and factor * (remains // moved) < FACTOR_LIMIT
        for moved in range(1, remains + 1)
        if remains % moved == 0
    )
