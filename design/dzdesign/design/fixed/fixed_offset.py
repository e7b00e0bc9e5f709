"""The largest fixed offset that opens at no tested pressure drop: the least of what is certified over all of them.

An amplifier without pressure sensors holds one offset whatever the pressure drop is. It is safe where it lies under
the lower bound of the guarded threshold on the whole tested interval, between the tests too, on the machine that lowers
the threshold furthest.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.design.certificate import guarded_curve
from dzdesign.design.compensator import Compensator
from dzdesign.design.machine.budget import Component
from dzdesign.design.offset.above_tests import AboveChoice
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.design.table.linear_programme import STEP_CODES
from dzdesign.identify.valve.certified_bound import BoundPiece

BENCH_ERROR: Component = "bench pressure drop"
#: A fixed offset reads no pressure, and it is rounded to the steps of an amplifier, not of a PWM.
NOT_OF_AN_AMPLIFIER: tuple[Component, ...] = ("rounding of the drive",)


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedOffset:
    """The largest fixed offset of one sign of command, exact, before an amplifier rounds it."""

    sign: int
    #: Over full drive.
    share: Fraction
    #: Pressure drop at which the bound is lowest, MPa; of a lot that of the valve whose bound is.
    lowest_at_MPa: Fraction
    #: Interval of the pressure drop on which it is safe, MPa.
    dp_MPa: tuple[Fraction, Fraction]


def fixed_offset(compensator: Compensator, sign: int = 1) -> FixedOffset:
    """Return the largest offset of a side that is certified at every tested pressure drop at once.

    Of a lot setting it is safe for each valve of the lot, over all pressure drops that this valve was tested at.

    Raises
    ------
    InputError
        If no positive offset is left, or a valve of the lot has no bounds of this side.
    """
    allowance = compensator.allowance(sign)
    model = compensator.valve.sides[SIDE_NAMES[sign]]
    # Above the tests the bound goes down: a gauge that read too little there had tests at higher pressure drops.
    above = AboveChoice.on(compensator.machine, "lower", STEP_CODES)
    curve = guarded_curve(model, compensator.side(sign).certificate.guard, compensator.below_dp0, above)
    pieces = [*(curve.certified.pieces if curve.certified else ()), *_of_the_lot(compensator, sign)]
    bounds = [(piece.at(place), place) for piece in pieces for place in _lowest_places(piece)]
    if error_MPa := allowance.pressures_MPa.get(BENCH_ERROR):
        highest = curve.dp_MPa[-1] + error_MPa
        bounds.append((curve.at(highest), highest))  # above the tests it never rises
    least_V, lowest_at = min(bounds)
    kept = sum((share for name, share in allowance.shares.items() if name not in NOT_OF_AN_AMPLIFIER), Fraction(0))
    share = least_V * allowance.factor / compensator.u_max_V - kept
    if share <= 0:
        raise InputError(
            f"no fixed offset of the {SIDE_NAMES[sign]} side is safe at every pressure drop: budget and dither take "
            "all of the certified one; use the law with pressure sensors, or declare a smaller budget"
        )
    return FixedOffset(sign=sign, share=share, lowest_at_MPa=lowest_at, dp_MPa=(curve.dp_MPa[0], curve.dp_MPa[-1]))


def _lowest_places(piece: BoundPiece) -> Iterator[Fraction]:
    """Yield where a piece of the bound may be lowest, MPa: its ends, and where its sag is deepest if that is inside."""
    yield piece.from_MPa
    yield piece.to_MPa
    if piece.curvature > 0:
        slope = (piece.high_V - piece.low_V) / (piece.to_MPa - piece.from_MPa)
        deepest = (piece.from_MPa + piece.to_MPa) / 2 - slope / piece.curvature
        if piece.from_MPa < deepest < piece.to_MPa:
            yield deepest


def _of_the_lot(compensator: Compensator, sign: int) -> Iterator[BoundPiece]:
    """Yield the bounds of every valve of a lot."""
    for valve in compensator.lot:
        side = valve.side(sign)
        if side is None:
            raise InputError(f"'{valve.name}' of the lot has no bounds of the negative side; run `batch` again")
        yield from side.bound().pieces
