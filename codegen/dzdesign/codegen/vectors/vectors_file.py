"""vectors.csv: codes in, and what the core must answer, from the exact law in rationals."""

from dzdesign.codegen.core.constants import STATUS_BITS
from dzdesign.codegen.vectors.choosing import Codes, chosen_codes
from dzdesign.design.compensator import Compensator

INPUTS = ("u_adc", "p_a_adc", "p_b_adc")
#: Of each sign of command: what `dz_comp()`, `dz_status()` and `dz_beta()` return.
ANSWERS = {
    1: ("compare_counts", "status_bits", "beta_x_32768"),
    -1: ("compare_negative_counts", "status_negative_bits", "beta_negative_x_32768"),
}
BETA_UNIT = 2**15
COMMAND, PRESSURE_A, PRESSURE_B, DIFFERENCE, ABOVE = (1 << place for place in range(len(STATUS_BITS)))


def vectors_text(compensator: Compensator, count: int) -> str:
    """Return vectors.csv with so many rows of whole numbers below the names of its columns.

    Fewer than hit every node, corner and fault are an `InputError`.
    """
    signs = compensator.signals.signs
    header = (*INPUTS, *(name for sign in signs for name in ANSWERS[sign]))
    rows = [
        (*codes, *(value for sign in signs for value in answers(compensator, codes, sign)))
        for codes in chosen_codes(compensator, count)
    ]
    return "".join(",".join(map(str, row)) + "\n" for row in (header, *rows))


def answers(compensator: Compensator, codes: Codes, sign: int) -> tuple[int, int, int]:
    """Return what the core of one sign must answer: compare value, bits of status, beta over 2^15 rounded down."""
    signals, u = compensator.signals, codes.u_adc
    ranges = (signal.valid_codes for signal in (signals.command, signals.pressure_a, signals.pressure_b))
    valid_u, valid_a, valid_b = (low <= code <= high for code, (low, high) in zip(codes, ranges, strict=True))
    difference, too_low = signals.difference(codes.p_a_adc, codes.p_b_adc, sign), -compensator.reverse_codes - 1
    status = (not valid_u) * COMMAND + (not valid_a) * PRESSURE_A + (not valid_b) * PRESSURE_B
    if valid_a and valid_b:
        tested_to = signals.dp_code(compensator.side(sign).certificate.dp_MPa[1])
        status += (difference <= too_low) * DIFFERENCE + (difference > tested_to) * ABOVE
    else:
        difference = too_low  # a failed sensor, and the smallest beta as for it
    compare = compensator.compare(u, difference, sign) if valid_u else 0
    return compare, status, int(compensator.law_beta(difference, sign) * BETA_UNIT)
