"""That a lot setting over-compensates no valve of its lot: its offset under the bounds of each of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor

import numpy as np

from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.design.compensator import Compensator

#: Over-compensated valves that a sentence names.
NAMED = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class LotMargin:
    """How far the offset of a lot setting stays under the bound of one valve."""

    #: Of the valve.
    name: str
    #: Of the command, where that is least.
    sign: int
    #: Pressure drop, where it is least.
    dp_MPa: Fraction
    #: The least distance; negative of a valve that is over-compensated.
    margin_V: Fraction


def lot_margins(compensator: Compensator) -> tuple[LotMargin, ...]:
    """Return each valve's margin, exactly, at every code of its own tested interval, worst side, worst code.

    A code stands for all pressures that may have made it; rounding and dither count as drive.
    """
    signals = compensator.signals
    kept = (Fraction(1, 2) + compensator.drive_functions.dither_counts) / signals.compare_max
    margins: dict[str, LotMargin] = {}
    for sign in signals.signs:
        law = compensator.side(sign)
        low, high = signals.difference_error(sign)
        numerators = _numerators(law.beta, compensator.beta_step_codes, signals.largest_difference(sign))
        scale = compensator.beta_denominator * compensator.beta_step_codes
        unit_V = law.u_min0_over_u_max * compensator.u_max_V / scale
        for valve in compensator.lot:
            side = valve.side(sign)
            if side is None:
                raise InputError(f"'{valve.name}' of the lot has no bounds of the negative side; run `batch` again")
            for left, right, bound in side.steps():
                first = max(ceil(signals.dp_code(left)) - high, 0)
                last = min(floor(signals.dp_code(right)) - low, numerators.size - 1)
                if first > last and left == right:  # one test, between two codes: both of them count
                    first, last = last, min(first, numerators.size - 1)
                if first > last:
                    continue
                code = first + int(numerators[first : last + 1].argmax())
                margin = bound - int(numerators[code]) * unit_V - kept * compensator.u_max_V
                if valve.name not in margins or margin < margins[valve.name].margin_V:
                    margins[valve.name] = LotMargin(
                        name=valve.name, sign=sign, dp_MPa=signals.dp_MPa(code), margin_V=margin
                    )
    return tuple(margins.values())


def _numerators(nodes: Sequence[int], step: int, last: int) -> np.ndarray:
    """Return the table between its nodes, times their distance: whole numbers at every code from 0 to `last`."""
    index, past = np.divmod(np.arange(last + 1), step)
    table = np.array(nodes, dtype=np.int64)  # at most 2^31 times a step: far from 2^63
    between: np.ndarray = table[index] * (step - past) + table[index + 1] * past
    return between


def prove_lot(compensator: Compensator) -> tuple[LotMargin, ...]:
    """Prove that a lot setting over-compensates no valve of its lot, and return the margins."""
    margins = lot_margins(compensator)
    above = sorted((each for each in margins if each.margin_V < 0), key=lambda each: each.margin_V)
    if above:
        worst = above[0]
        raise RequirementError(
            f"the lot setting over-compensates {len(above)} of {len(margins)} valves of its lot: "
            f"{and_more([each.name for each in above], NAMED)}; {worst.name} by {-1e3 * float(worst.margin_V):.3f} mV "
            f"at {float(worst.dp_MPa):.2f} MPa"
        )
    return margins
