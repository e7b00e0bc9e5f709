"""A common setting against every valve of its lot: the core's drive at zero command under each valve's own bounds.

The input check need not be repeated for each valve: the integers that the core gives at zero command are the same, one
a difference of pressure codes. Each valve has its staircase of bounds, argued from its ramp tests as in `zero_command`.
"""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import Differences
from dzdesign.verify.exhaustive.zero_command import best_bounds, pressure_drops

#: Over-compensated valves that a sentence names.
NAMED = 5
#: Whole numbers below this, and their differences, fit 64 bits with a sign.
LARGEST = 2**62


@dataclass(frozen=True, slots=True, kw_only=True)
class LotCheck:
    """What one sign of command of a core leaves to the bounds of every valve of a lot.

    Attributes
    ----------
    valves : int
        How many were compared.
    over_compensated : tuple of str
        Names of those above whose bound the core drives at zero command, the worst first.
    worst : str
        Name of the valve with the smallest margin.
    worst_dp_MPa : float
        Where it has it.
    smallest_margin_V : float
        That margin; negative if the bound is exceeded.
    confidence : tuple of float
        The least and the largest with which a valve's bounds hold.
    """

    valves: int
    over_compensated: tuple[str, ...]
    worst: str
    worst_dp_MPa: float
    smallest_margin_V: float
    confidence: tuple[float, float]


def check_lot(document: dict[str, Any], exact: ExactLaw, found: Differences, at_zero: np.ndarray) -> LotCheck | None:
    """Compare the drive at zero command with the bounds of every valve of the lot; None of a valve's own setting.

    Parameters
    ----------
    document : dict
        compensator.json.
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
    lot = document.get("lot") or ()
    if not lot:
        return None
    sides = {each["name"]: each["sides"][exact.side] for each in lot}
    for name, side in sides.items():
        if side is None:
            raise InputError(f"'{name}' of the lot has no bounds of the {exact.side} side; run `dzdesign batch` again")
    tested = {dp: Fraction(repr(dp)) for side in sides.values() for dp in side["dp_MPa"]}
    scale, lowest, highest = pressure_drops(exact, found, sorted({dp.denominator for dp in tested.values()}))
    ends = {dp: int(value * scale) for dp, value in tested.items()}
    fits = max(*map(abs, (lowest[0], lowest[-1], highest[0], highest[-1])), *ends.values()) < LARGEST
    kind = np.int64 if fits else object
    low, high = np.array(lowest, dtype=kind), np.array(highest, dtype=kind)
    drive = np.where(found.made, at_zero, -1)
    unit_V, peak = Fraction(*document["u_max_V"]) / exact.compare_max, document["amplifier"]["dither_counts"]
    margins: list[tuple[Fraction, str, int]] = []
    for name, side in sides.items():
        nodes = np.array([ends[dp] for dp in side["dp_MPa"]], dtype=kind)
        bounds = best_bounds(side["trend"], [Fraction(repr(bound)) for bound in side["u_lower_V"]])
        if side["trend"] == "decreasing":
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
    confidence = [side["confidence"] for side in sides.values()]
    return LotCheck(
        valves=len(margins),
        over_compensated=tuple(name for margin, name, _ in margins if margin < 0),
        worst=worst,
        worst_dp_MPa=round(float(Fraction(low[code] + high[code], 2 * scale)), 4),
        smallest_margin_V=float(worst_margin),
        confidence=(min(confidence), max(confidence)),
    )
