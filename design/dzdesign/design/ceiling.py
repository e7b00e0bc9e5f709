"""The certified offset over the pressure drop, exactly from valve.json; at every code; and what may be put out of it.

At consecutive codes a curve is a line on each span between its nodes: whole numbers over one denominator.

Above the highest tested pressure drop the offset is held, lowered with the continued bound, or released. Released means
a beta of one unit: the compensation ends, and the command drives the valve on. A drive of zero would shut a valve that
a pressure spike reaches at full command, which is a motion of its own; without an offset the dead zone is back, and
nothing else.
"""

from bisect import bisect_left
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate, pairwise
from math import ceil, floor, lcm
from typing import NamedTuple

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.recorded_units import worded
from dzdesign.design.design_choices import Above
from dzdesign.design.exact_row import ExactRow
from dzdesign.design.machine import Allowance, Machine
from dzdesign.design.signals import PressurePair
from dzdesign.identify.valve.certified_bound import BoundPiece, CertifiedBound
from dzdesign.identify.valve.guard_curve import CertifiedCurve

#: valve.json has seven decimals, so a sum of two of its numbers is right to this, in V.
DECIMALS = Fraction(1, 10**6)
#: Beyond the span of any sensor.
FURTHEST_MPa = 1000
NONE = Fraction(0)


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


def offset_above(curve: CertifiedCurve, choice: Above, machine: Machine | None) -> OffsetAbove | None:
    """Return how the offset of a curve goes on above its last test; None: it is held.

    One test says nothing of a slope, so its offset can't be lowered: it is held, and nothing is certified there. An
    error of the bench's gauge counts above the tests too, where it grows with the pressure drop.
    """
    continued = curve.above
    if choice == "hold" or not curve.offset_dp_MPa or (choice == "lower" and continued is None):
        return None
    last_MPa, last_V = (Fraction(repr(values[-1])) for values in (curve.offset_dp_MPa, curve.offset_V))
    if continued is not None:
        error_MPa = Fraction(repr(machine.bench_pressure_error_MPa)) if machine else NONE
        bound = _drawn_together(continued.bound(), error_MPa)
        return OffsetAbove.under(bound, last_V, certified=continued.certified)
    held = BoundPiece(last_MPa, last_MPa + FURTHEST_MPa, last_V, last_V)
    return OffsetAbove.under(CertifiedBound(pieces=(held,)), last_V, certified=False)


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
            )
            for piece in bound.pieces
        )
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetCurve:
    """An offset over the pressure drop and the bounds that hold it, exactly from the decimal numbers of valve.json."""

    #: Nodes, from the first tested pressure drop to the last, rising.
    dp_MPa: tuple[Fraction, ...]
    #: Offset at each; linear between them.
    offset_V: tuple[Fraction, ...]
    #: Lower bound of the guarded threshold on that interval; None of an offset that nothing has to bound.
    certified: CertifiedBound | None
    #: Up to this dP0 the offset is at most the one there, as Eq. (7) holds beta = 1; None follows the tests.
    hold_below_MPa: Fraction | None
    #: How it goes on above the tests; None: the last offset is held, and nothing is certified.
    above: OffsetAbove | None = None

    def at(self, dp_MPa: Fraction) -> Fraction:
        """Return the offset in V by the selector of Eq. (7).

        For dP <= dP0 the paper holds beta = 1; where the threshold grows with dP that would over-compensate, so there
        the smaller of the two is taken. Below the tested interval the first node is held.
        """
        if self.above is not None and dp_MPa > self.dp_MPa[-1]:
            return self.above.at(dp_MPa)
        value = self.straight(dp_MPa)
        if self.hold_below_MPa is not None and dp_MPa <= self.hold_below_MPa:
            value = min(value, self.straight(self.hold_below_MPa))
        return value

    def straight(self, dp_MPa: Fraction) -> Fraction:
        """Return the line through the nodes, V, whatever is held below dP0; outside them the nearest one's offset."""
        nodes, offset = self.dp_MPa, self.offset_V
        if dp_MPa >= nodes[-1]:
            return offset[-1]
        if dp_MPa <= nodes[0]:
            return offset[0]
        right = bisect_left(nodes, dp_MPa)
        share = (dp_MPa - nodes[right - 1]) / (nodes[right] - nodes[right - 1])
        return offset[right - 1] + share * (offset[right] - offset[right - 1])

    def bound(self, dp_MPa: Fraction) -> Fraction | None:
        """Return the lower bound of the guarded threshold at dP in V, or None where nothing is certified."""
        if self.above is not None and dp_MPa > self.dp_MPa[-1]:
            return self.above.bound_at(dp_MPa)
        return None if self.certified is None else self.certified.at(dp_MPa)


def certified_V(curve: OffsetCurve, dp_MPa: Fraction) -> Fraction:
    """Return the offset that is certified at a pressure drop, V; a curve above its bound is refused."""
    offset, bound = curve.at(dp_MPa), curve.bound(dp_MPa)
    if bound is None:
        return offset
    if offset > bound + DECIMALS:
        raise RequirementError(
            worded(
                "beta u_min0 is {offset:.4f V} at {dp:.3f MPa}, above the threshold's lower bound of {bound:.4f V}; "
                "make valve.json again with `dzdesign identify`",
                offset=float(offset),
                dp=float(dp_MPa),
                bound=float(bound),
            )
        )
    return min(offset, bound)


#: Value at zero, V, and slope, V/MPa.
Line = tuple[Fraction, Fraction]
#: Curve, pressure inputs, first and last code of the latest rows. Found again by comparing: a hash of that many
#: fractions takes longer.
KNOWN: deque[tuple[OffsetCurve, PressurePair, int, int, ExactRow]] = deque(maxlen=8)


class _Span(NamedTuple):
    """A curve from the end of the span before up to its own: a line."""

    #: Pressure drop up to which it goes, itself included; None: all others.
    to_MPa: Fraction | None
    line: Line
    #: What it is at most, and at least.
    most_V: Fraction | None = None
    least_V: Fraction | None = None


def certified_row(curve: OffsetCurve, pair: PressurePair, first: int, last: int) -> ExactRow:
    """Return what is certified at each of the codes, V, as `certified_V` does; kept for whoever proves it again."""
    for known, of_pair, begin, end, row in tuple(KNOWN):
        if (begin, end) == (first, last) and (known is curve or known == curve) and of_pair == pair:
            return row
    row = _held_under(curve, offset_row(curve, pair, first, last), pair.dp_MPa(1), first)
    KNOWN.append((curve, pair, first, last, row))
    return row


def _held_under(curve: OffsetCurve, offset: ExactRow, step: Fraction, first: int) -> ExactRow:
    """Return the least of an offset from the code `first` on and of the bounds; one above its bound is refused."""
    numerators, denominators = list(offset.numerators), list(offset.denominators)
    for begin, end, span in _bounds(curve, step, first, first + len(offset)):
        values, unit = _values(span, step, range(begin, end))
        slack = int(DECIMALS * unit)
        for place, value in enumerate(values, begin - first):
            own, bound = numerators[place] * unit, value * denominators[place]
            if own > bound + slack * denominators[place]:
                certified_V(curve, (first + place) * step)  # says so
            if bound < own:
                numerators[place], denominators[place] = value, unit
    return ExactRow(tuple(numerators), tuple(denominators))


def _bounds(curve: OffsetCurve, step: Fraction, first: int, end: int) -> Iterator[tuple[int, int, _Span]]:
    """Yield the codes, from and up to, of each piece of the bounds, and its span: where two meet, both count."""
    tests = curve.certified.pieces if curve.certified else ()
    above = curve.above.bound.pieces if curve.above and curve.above.certified else ()
    after = floor(curve.dp_MPa[-1] / step) + 1  # the last test has its own bound
    for piece, begin, least_V in [*((each, first, None) for each in tests), *((each, after, NONE) for each in above)]:
        codes = max(ceil(piece.from_MPa / step), begin, first), min(floor(piece.to_MPa / step) + 1, end)
        yield *codes, _Span(None, _chord(piece), least_V=least_V)


def offset_row(curve: OffsetCurve, pair: PressurePair, first: int, last: int) -> ExactRow:
    """Return the offset at each of the codes, V, whatever is certified."""
    step, parts, begin = pair.dp_MPa(1), [], first
    for span in _spans(curve):
        end = last + 1 if span.to_MPa is None else min(max(floor(span.to_MPa / step), begin - 1), last) + 1
        parts.append(_values(span, step, range(begin, end)))
        begin = end
    return ExactRow.joined(parts)


def _spans(curve: OffsetCurve) -> Iterator[_Span]:
    """Yield the offset from below the first node to beyond all bounds."""
    nodes, hold = curve.dp_MPa, curve.hold_below_MPa
    held = None if hold is None else curve.at(hold)
    inside = (hold,) if hold is not None and nodes[0] < hold < nodes[-1] else ()
    ends = sorted({*nodes, *inside})
    yield _Span(ends[0], (curve.offset_V[0], NONE), held)
    for left, right in pairwise(ends):
        low, high = curve.straight(left), curve.straight(right)
        slope = (high - low) / (right - left)
        yield _Span(right, (high - slope * right, slope), held if hold is not None and right <= hold else None)
    if curve.above is None:
        yield _Span(None, (curve.offset_V[-1], NONE))
        return
    for passed_V, piece in zip(curve.above.least_V, curve.above.bound.pieces, strict=False):
        yield _Span(piece.to_MPa, _chord(piece), min(passed_V, piece.low_V), NONE)
    yield _Span(None, (NONE, NONE))


def _chord(piece: BoundPiece) -> Line:
    """Return the chord of a piece of a bound."""
    if piece.from_MPa == piece.to_MPa:
        return piece.low_V, NONE
    slope = (piece.high_V - piece.low_V) / (piece.to_MPa - piece.from_MPa)
    return piece.low_V - slope * piece.from_MPa, slope


def at_codes(piece: BoundPiece, step: Fraction, codes: range) -> tuple[list[int], int]:
    """Return a piece of a bound at codes, V: whole numbers over one denominator."""
    return _values(_Span(None, _chord(piece)), step, codes)


def _values(span: _Span, step: Fraction, codes: range) -> tuple[list[int], int]:
    """Return a span at codes, V: whole numbers over one denominator."""
    parts = [span.line[0], span.line[1] * step]
    limits = [limit for limit in (span.most_V, span.least_V) if limit is not None]
    unit = lcm(DECIMALS.denominator, *(part.denominator for part in (*parts, *limits)))
    none, one = (int(part * unit) for part in parts)
    found = [none + code * one for code in codes] if one else [none] * len(codes)
    if span.most_V is not None:
        most = int(span.most_V * unit)
        found = [min(value, most) for value in found]
    if span.least_V is not None:
        least = int(span.least_V * unit)
        found = [max(value, least) for value in found]
    return found, unit


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetCeiling:
    """Largest offset over u_max that the certificate allows, at every difference of pressure codes 0...code_max."""

    #: Limit at each code, exact: the least over the pressures that the code may stand for.
    limit: ExactRow
    #: Codes inside the tested interval of the pressure drop.
    certified: range


def offset_ceiling(curve: OffsetCurve, u_max_V: Fraction, allowance: Allowance) -> OffsetCeiling:
    """Return the limit of the offset at every pressure code.

    It is the least certified offset over all pressure drops that the code may stand for, on the machine that moves the
    threshold furthest, less what rounding and the dither add to the drive. A curve that lies above its bound somewhere
    is refused: valve.json contradicts itself.
    """
    pair = allowance.pair
    first, last = (pair.dp_code(end) for end in (curve.dp_MPa[0], curve.dp_MPa[-1]))
    code_max = pair.largest_difference
    if last > code_max:
        raise InputError(
            worded(
                "the sensor's span of {span:g MPa} ends below the tested pressure drop of {tested:g MPa}; give the "
                "real span with --pressure-span",
                span=float(pair.ahead.span_MPa),
                tested=float(curve.dp_MPa[-1]),
            )
        )
    low, high = allowance.window
    factor, kept = allowance.factor / u_max_V, allowance.kept
    least = certified_row(curve, pair, low, code_max + high).least_of_windows(high - low + 1)
    return OffsetCeiling(limit=least.line(factor, kept), certified=range(ceil(first), floor(last) + 1))
