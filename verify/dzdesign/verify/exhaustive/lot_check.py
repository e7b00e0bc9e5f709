"""A lot setting against every valve of its lot: the core's drive at zero command under each valve's own bounds.

The input check need not be repeated for each valve: the integers that the core gives at zero command are the same, one
a difference of pressure codes. Each valve has its staircase of bounds, argued from its ramp tests as in `zero_command`.
"""

from collections.abc import Sequence

import numpy as np

from dzdesign.core.errors import InputError, and_more
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_setting import NAMED
from dzdesign.verify.evidence import InputCheck, LotCheck
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import Differences
from dzdesign.verify.exhaustive.zero_command import zero_command_margins
from dzdesign.verify.requirements import LOT, Check


def check_lot(exact: ExactLaw, found: Differences, at_zero: np.ndarray) -> LotCheck | None:
    """Compare the drive at zero command with the bounds of every valve of the lot; None of a valve's own setting."""
    lot = exact.compensator.lot
    if not lot:
        return None
    bounds = []
    for valve in lot:
        side = valve.positive if exact.side == "positive" else valve.negative
        if side is None:
            raise InputError(
                f"'{valve.name}' of the lot has no bounds of the {exact.side} side; run `dzdesign batch` again"
            )
        bounds.append(side)
    margins = zero_command_margins(exact, found, at_zero, bounds)
    names = [valve.name for valve in lot]
    ordered = sorted(
        ((margin.margin_V, name, margin.dp_MPa) for name, margin in zip(names, margins, strict=True) if margin),
        key=lambda each: each[:2],
    )
    worst_V, worst, worst_dp_MPa = ordered[0]
    confidence = [side.confidence for side in bounds]
    return LotCheck(
        valves=len(ordered),
        over_compensated=tuple(name for margin, name, _ in ordered if margin < 0),
        worst=worst,
        worst_dp_MPa=worst_dp_MPa,
        smallest_margin_V=float(worst_V),
        confidence=(min(confidence), max(confidence)),
    )


def lot_checked(inputs: Sequence[InputCheck], compensator: Compensator) -> list[Check]:
    """Tell whether the core of a lot setting over-compensates any valve of its lot; nothing of a valve's own."""
    count, units = len(compensator.lot), compensator.valve.recorded_units
    found = [each.lot for each in inputs if each.lot is not None]
    if not found:
        return []
    worst = min(found, key=lambda each: each.smallest_margin_V)
    least, most = (f"{100 * ends:.6g}" for ends in worst.confidence)
    over = list(dict.fromkeys(name for each in found for name in each.over_compensated))
    text = (
        f"{min(each.valves for each in found)} of {count} valves, each at every difference of pressure codes that it "
        f"was tested over, against its own bounds ({least if least == most else f'{least} to {most}'} % for each): "
        f"{len(over)} over-compensated" + (f": {and_more(over, NAMED)}" if over else "") + "; smallest margin of the "
        f"C code's compare values {units.text(1e3 * worst.smallest_margin_V, '.3f mV')}: {worst.worst}, "
        f"{units.text(worst.worst_dp_MPa, '.2f MPa')}"
    )
    all_there = all(each.valves == count for each in found)
    return [LOT.check(holds=not over and all_there, text=text)]
