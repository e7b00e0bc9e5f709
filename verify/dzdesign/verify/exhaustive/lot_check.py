"""A lot setting against every valve of its lot: the core's drive at zero command under each valve's own bounds.

The input check need not be repeated for each valve: the integers that the core gives at zero command are the same, one
a difference of pressure codes. Each valve has its staircase of bounds, argued from its ramp tests as in `zero_command`.
"""

from fractions import Fraction

import numpy as np

from dzdesign.core.errors import InputError, and_more
from dzdesign.design.compensator import Compensator
from dzdesign.verify.evidence import Check, InputCheck, LotCheck
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import Differences
from dzdesign.verify.exhaustive.zero_command import best_bounds, pressure_drops
from dzdesign.verify.requirements import LOT

#: Over-compensated valves that a sentence names.
NAMED = 5
#: Whole numbers below this, and their differences, fit 64 bits with a sign.
LARGEST = 2**62


def check_lot(compensator: Compensator, exact: ExactLaw, found: Differences, at_zero: np.ndarray) -> LotCheck | None:
    """Compare the drive at zero command with the bounds of every valve of the lot; None of a valve's own setting.

    Parameters
    ----------
    compensator : Compensator
        Which the core was made from.
    exact : ExactLaw
        The side's law.
    found : Differences
        All differences.
    at_zero : (D,) array
        Compare values that the core gives at zero command.

    Raises
    ------
    InputError
        If a valve of the lot has no bounds of this side.
    """
    if not compensator.lot:
        return None
    sides = {}
    for valve in compensator.lot:
        name, side = valve.name, valve.positive if exact.side == "positive" else valve.negative
        if side is None:
            raise InputError(f"'{name}' of the lot has no bounds of the {exact.side} side; run `dzdesign batch` again")
        sides[name] = side
    tested = {dp: Fraction(repr(dp)) for side in sides.values() for dp in side.dp_MPa}
    scale, lowest, highest = pressure_drops(exact, found, sorted({dp.denominator for dp in tested.values()}))
    ends = {dp: int(value * scale) for dp, value in tested.items()}
    fits = max(*map(abs, (lowest[0], lowest[-1], highest[0], highest[-1])), *ends.values()) < LARGEST
    kind = np.int64 if fits else object
    low, high = np.array(lowest, dtype=kind), np.array(highest, dtype=kind)
    drive = np.where(found.made, at_zero, -1)
    unit_V, peak = compensator.u_max_V / exact.compare_max, compensator.drive_functions.dither_counts
    margins: list[tuple[Fraction, str, int]] = []
    for name, side in sides.items():
        nodes = np.array([ends[dp] for dp in side.dp_MPa], dtype=kind)
        bounds = best_bounds(side.trend, [Fraction(repr(bound)) for bound in side.u_lower_V])
        if side.trend == "decreasing":
            place = np.searchsorted(nodes, np.minimum(high, nodes[-1]), side="left")
        else:
            place = np.searchsorted(nodes, np.maximum(low, nodes[0]), side="right") - 1
        known = np.where((high >= nodes[0]) & (low <= nodes[-1]), drive, -1)
        each = []
        for index, bound in enumerate(bounds):
            here = np.where(place == index, known, -1)
            code = int(here.argmax())
            if here[code] >= 0:
                each.append((bound - unit_V * (int(here[code]) + peak), name, code))
        if each:
            margins.append(min(each))
    margins.sort()
    worst_margin, worst, code = margins[0]
    confidence = [side.confidence for side in sides.values()]
    return LotCheck(
        valves=len(margins),
        over_compensated=tuple(name for margin, name, _ in margins if margin < 0),
        worst=worst,
        worst_dp_MPa=round(float(Fraction(low[code] + high[code], 2 * scale)), 4),
        smallest_margin_V=float(worst_margin),
        confidence=(min(confidence), max(confidence)),
    )


def lot_checked(inputs: tuple[InputCheck, ...], compensator: Compensator) -> list[Check]:
    """Tell whether the core of a lot setting over-compensates any valve of its lot; nothing of a valve's own.

    Parameters
    ----------
    inputs : tuple of InputCheck
        One a sign of command.
    compensator : Compensator
        Which the core was made from.
    """
    count = len(compensator.lot)
    found = [each.lot for each in inputs if each.lot is not None]
    if not found:
        return []
    worst = min(found, key=lambda each: each.smallest_margin_V)
    least, most = (f"{100 * ends:.6g}" for ends in worst.confidence)
    text = (
        f"{min(each.valves for each in found)} of {count} valves, each at every difference of pressure codes that it "
        f"was tested over, against its own bounds ({least if least == most else f'{least} to {most}'} % for each): "
    )
    over = list(dict.fromkeys(name for each in found for name in each.over_compensated))
    text += f"{len(over)} over-compensated" + (f": {and_more(over, NAMED)}" if over else "")
    text += f"; smallest margin of the C's compare values {1e3 * worst.smallest_margin_V:.3f} mV: {worst.worst}, "
    text += f"{worst.worst_dp_MPa:.2f} MPa"
    all_there = all(each.valves == count for each in found)
    return [LOT.check(holds=not over and all_there, text=text)]
