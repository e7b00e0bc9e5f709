"""Proof that a lot setting over-compensates no valve of its lot: its offset lies below the bounds of each."""

from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor

import numpy as np

from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.design.compensator import Compensator
from dzdesign.design.machine.allowance import Allowance
from dzdesign.design.offset.beta_table import between_nodes
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.certified_bound import BoundPiece, CertifiedBound

#: Over-compensated valves that a sentence names.
NAMED = 5
#: Drives that are this near to the nearest one by doubles, V, are compared exactly.
CLOSE_V = 1e-9


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

    A code stands for all pressures that may have made it; rounding, dither and the machine count as in a ceiling.
    """
    signals = compensator.signals
    margins: dict[str, LotMargin] = {}
    for sign in signals.signs:
        law = compensator.side(sign)
        allowance = compensator.allowance(sign)
        low, high = window = allowance.window
        count = signals.largest_difference(sign) + 1
        numerators = between_nodes(law.beta, count, compensator.beta_step_codes)
        scale = compensator.beta_denominator * compensator.beta_step_codes
        unit_V = law.u_min0_over_u_max * compensator.u_max_V / scale
        for valve in compensator.lot:
            side = valve.side(sign)
            if side is None:
                raise InputError(f"'{valve.name}' of the lot has no bounds of the negative side; run `batch` again")
            for piece in side.bound().pieces:
                left, right = piece.from_MPa, piece.to_MPa
                first = max(ceil(signals.dp_code(left)) - high, 0)
                last = min(floor(signals.dp_code(right)) - low, numerators.size - 1)
                if first > last and left == right:  # one test, between two codes: both of them count
                    first, last = last, min(first, numerators.size - 1)
                if first > last:
                    continue
                drive_V = numerators[first : last + 1] * float(unit_V)
                nearest = first + _nearest(piece, allowance, first, drive_V)
                over, code = max(
                    (
                        int(numerators[code]) * unit_V - allowance.factor * _least(piece, signals, int(code), window),
                        -int(code),
                    )
                    for code in nearest
                )
                code = -code
                margin = -over - allowance.kept * compensator.u_max_V
                if valve.name not in margins or margin < margins[valve.name].margin_V:
                    margins[valve.name] = LotMargin(
                        name=valve.name, sign=sign, dp_MPa=signals.dp_MPa(code), margin_V=margin
                    )
    return tuple(margins.values())


def _least(piece: BoundPiece, signals: Signals, code: int, error: tuple[int, int]) -> Fraction:
    """Return the least bound over the pressure drops that a code may stand for, as far as the piece reaches, V."""
    low, high = (signals.dp_MPa(code + each) for each in error)
    return piece.least(max(min(low, piece.to_MPa), piece.from_MPa), min(max(high, piece.from_MPa), piece.to_MPa))


def _nearest(piece: BoundPiece, allowance: Allowance, first: int, drive_V: np.ndarray) -> np.ndarray:
    """Return which drives, from the code `first` on, may come nearest to a piece: by doubles, to `CLOSE_V`."""
    signals = allowance.signals
    codes = first + np.arange(drive_V.size)
    zero, step = float(signals.dp_MPa(0)), float(signals.dp_MPa(1) - signals.dp_MPa(0))
    from_MPa, to_MPa = float(piece.from_MPa), float(piece.to_MPa)
    low, high = (np.clip(zero + step * (codes + each), from_MPa, to_MPa) for each in allowance.window)
    places = [low, high]
    if piece.curvature > 0:
        slope = (piece.high_V - piece.low_V) / (piece.to_MPa - piece.from_MPa)
        places.append(np.clip(float((piece.from_MPa + piece.to_MPa) / 2 - slope / piece.curvature), low, high))
    bound = CertifiedBound(pieces=(piece,))
    least = np.min([bound.in_doubles(place) for place in places], axis=0)
    left_V = float(allowance.factor) * least - drive_V
    near: np.ndarray = np.flatnonzero(left_V <= left_V.min() + CLOSE_V)
    if piece.curvature == 0 and piece.low_V == piece.high_V:  # a step: the largest drive comes nearest, the first of it
        return np.array([int(drive_V.argmax())])
    return near


def prove_lot(compensator: Compensator) -> tuple[LotMargin, ...]:
    """Prove that a lot setting over-compensates no valve of its lot, and return the margins."""
    margins = lot_margins(compensator)
    above = sorted((each for each in margins if each.margin_V < 0), key=lambda each: each.margin_V)
    if above:
        worst, units = above[0], compensator.valve.recorded_units
        raise RequirementError(
            f"the lot setting over-compensates {len(above)} of {len(margins)} valves of its lot: "
            f"{and_more([each.name for each in above], NAMED)}; {worst.name} by "
            f"{units.text(-1e3 * float(worst.margin_V), '.3f mV')} at {units.text(float(worst.dp_MPa), '.2f MPa')}"
        )
    return margins
