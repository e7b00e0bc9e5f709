"""The offset above the last tested pressure drop: held, lowered with the continued bound, or released.

Let go means a beta of one unit: the compensation ends, and the command drives the valve on. A drive of zero would shut
a valve that a pressure spike reaches at full command, which is a motion of its own; without an offset the dead zone is
back, and nothing else.
"""

from bisect import bisect_left
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.design_choices import Above
from dzdesign.design.machine.machine import Machine
from dzdesign.design.side_law import Certificate
from dzdesign.identify.valve.certified_bound import BoundPiece, CertifiedBound
from dzdesign.identify.valve.guard_curve import CertifiedCurve
from dzdesign.identify.valve.side_model import SideModel

#: Segments of the table in which an offset that is released comes down, beside that in which the tests end: a table is
#: linear between its nodes, and the tests keep their offset.
RELEASE_SEGMENTS = 1
#: Beyond the span of any sensor.
FURTHEST_MPa = 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetAbove:
    """How the offset goes on above the last test: under the continued bound, never rising, never below zero."""

    #: From the last test on.
    bound: CertifiedBound
    certified: bool
    #: Offset at the last test, V, and the least of it and the bound up to the end of each piece.
    last_V: Fraction
    least_V: tuple[Fraction, ...]

    @classmethod
    def under(cls, bound: CertifiedBound, last_V: Fraction, *, certified: bool) -> "OffsetAbove":
        """Return the largest such offset."""
        lows = (piece.least(piece.from_MPa, piece.to_MPa) for piece in bound.pieces)
        least = tuple(accumulate(lows, min, initial=last_V))
        return cls(bound=bound, certified=certified, last_V=last_V, least_V=least)

    def at(self, dp_MPa: Fraction) -> Fraction:
        """Return the offset at a pressure drop above the last test, V."""
        pieces = self.bound.pieces
        if dp_MPa > pieces[-1].to_MPa:
            return Fraction(0)
        place = bisect_left(pieces, dp_MPa, key=lambda piece: piece.to_MPa)
        return max(min(self.least_V[place], pieces[place].least(pieces[place].from_MPa, dp_MPa)), Fraction(0))

    def bound_at(self, dp_MPa: Fraction) -> Fraction | None:
        """Return the certified bound there, V; None where there is none, and 0 where it says nothing any more."""
        found = self.bound.at(dp_MPa) if self.certified else None
        return None if found is None else max(found, Fraction(0))


@dataclass(frozen=True, slots=True, kw_only=True)
class AboveChoice:
    """What is to happen above the tests, of one sign of command."""

    choice: Above
    #: Codes between two nodes of the table.
    step_codes: int
    #: Of a pressure drop that the tests were recorded at, up to the last one, MPa; above them it grows with the drop.
    bench_error_MPa: Fraction = Fraction(0)

    @classmethod
    def on(cls, machine: Machine | None, choice: Above, step_codes: int) -> "AboveChoice":
        """Return a choice for a machine, whose bench's gauge counts above the tests too."""
        error_MPa = Fraction(repr(machine.bench_pressure_error_MPa)) if machine else Fraction(0)
        return cls(choice=choice, step_codes=step_codes, bench_error_MPa=error_MPa)

    def of(self, curve: CertifiedCurve) -> OffsetAbove | None:
        """Return how the offset of a curve goes on above its last test; None: it is held.

        One test says nothing of a slope, so its offset can't be lowered: it is held, and nothing is certified there.
        """
        continued = curve.above
        if self.choice == "hold" or not curve.offset_dp_MPa or (self.choice == "lower" and continued is None):
            return None
        last_MPa, last_V = (Fraction(repr(values[-1])) for values in (curve.offset_dp_MPa, curve.offset_V))
        if continued is not None:
            bound = _drawn_together(continued.bound(), self.bench_error_MPa)
            return OffsetAbove.under(bound, last_V, certified=continued.certified)
        held = BoundPiece(last_MPa, last_MPa + FURTHEST_MPa, last_V, last_V, Fraction(0))
        return OffsetAbove.under(CertifiedBound(pieces=(held,)), last_V, certified=False)

    def released_from(self, tested: range) -> int | None:
        """Return the code from which an offset is released that was tested at codes in a range; None: it is not.

        It is that of a node of the table: the offset comes down in the segment before it, under the continued bound.
        """
        if self.choice != "release":
            return None
        return ((tested.stop - 1) // self.step_codes + 1 + RELEASE_SEGMENTS) * self.step_codes


def _drawn_together(bound: CertifiedBound, error_MPa: Fraction) -> CertifiedBound:
    """Return a bound above the tests where each pressure drop of the bench was wrong by up to an error at the last one.

    A gauge's gain is wrong by as much at each test, so the drop at which a threshold truly is goes on as far beyond the
    last test as the drop that was read, times 1 + error / last; the error at the last test itself counts as elsewhere.
    Errors that change their sign from test to test are those of no gauge.
    """
    last = bound.dp_MPa[0]
    factor = 1 + error_MPa / last
    return CertifiedBound(
        pieces=tuple(
            BoundPiece(
                last + (piece.from_MPa - last) / factor,
                last + (piece.to_MPa - last) / factor,
                piece.low_V,
                piece.high_V,
                piece.curvature * factor**2,
            )
            for piece in bound.pieces
        )
    )


def above_in_words(choice: Above, certificate: Certificate, side: SideModel, units: RecordedUnits) -> str:
    """Return what the law does above the tests, up to where that is certified, and on what premise."""
    curve, last = side.certified[certificate.guard], units.text(float(certificate.dp_MPa[1]), ".2f MPa")
    if choice == "hold" or (choice == "lower" and curve.above is None):
        why = "" if choice == "hold" else " (a single test gives no slope for lowering it)"
        return (
            f"above {last} the offset of the highest test is held{why} and nothing is certified: where the threshold "
            "falls, flow at zero command is possible"
        )
    released = certificate.released_from_MPa
    text = f"above {last} the offset falls with the continued bound"
    if choice == "release":
        text = f"above {last} the offset is released"
    if released is not None:
        at = units.text(float(released), ".3g MPa")
        text += f" and is zero from {at} on. There the full dead zone is back"
    holds_to = certificate.holds_to_MPa
    if curve.above is None:
        return f"{text}. Not certified: a single test gives no slope"
    rests = curve.above.in_words(curve.premise, side.trend or "flat", units)
    if released is not None and holds_to >= released > certificate.dp_MPa[1]:  # no offset is left beyond
        return f"{text}. Up to there this offset is {rests}"
    if holds_to > certificate.dp_MPa[1]:
        return f"{text}. Up to {units.text(float(holds_to), '.3g MPa')} this offset is {rests}"
    return f"{text}. {rests[0].upper()}{rests[1:]}"


def below_in_words(certificate: Certificate, side: SideModel, units: RecordedUnits) -> str:
    """Return what the law does below the lowest test, and what is known of the threshold there."""
    first = units.text(float(certificate.dp_MPa[0]), ".2f MPa")
    text = f"below {first} the offset of the lowest test is held and nothing is certified"
    if side.trend == "increasing":
        return f"{text}: the threshold grows with the pressure drop, so flow at zero command is possible there"
    if side.trend == "decreasing":
        return f"{text}. A threshold that keeps rising towards zero pressure drop stays above this offset"
    return text
