"""The certified offset over the pressure drop, exactly from valve.json; at every code; and what may be put out of it.

At consecutive codes a curve is a polynomial on each stretch between its nodes: whole numbers over one denominator.

Above the highest tested pressure drop the offset is held, lowered with the continued bound, or released. Released means
a beta of one unit: the compensation ends, and the command drives the valve on. A drive of zero would shut a valve that
a pressure spike reaches at full command, which is a motion of its own; without an offset the dead zone is back, and
nothing else.
"""

from bisect import bisect_left
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import accumulate
from math import ceil, floor, lcm

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.worded import worded
from dzdesign.design.design_choices import Above
from dzdesign.design.exact_row import ExactRow
from dzdesign.design.machine import Allowance, Machine
from dzdesign.design.signals import Signals
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
        value = self._straight(dp_MPa)
        if self.hold_below_MPa is not None and dp_MPa <= self.hold_below_MPa:
            value = min(value, self._straight(self.hold_below_MPa))
        return value

    def _straight(self, dp_MPa: Fraction) -> Fraction:
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


#: Coefficients of 1, x and x².
Polynomial = tuple[Fraction, Fraction, Fraction]
#: Curve, signals, first and last code of the latest rows. Found again by comparing: a hash of that many fractions takes
#: longer.
KNOWN: deque[tuple[OffsetCurve, Signals, int, int, ExactRow]] = deque(maxlen=8)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stretch:
    """A curve between two neighbouring corners, in MPa and V: the offset is the least of some polynomials."""

    offset: tuple[Polynomial, ...]
    #: Neither offset nor bound falls below zero: above the tests.
    never_below_zero: bool
    bound: Polynomial | None


def certified_row(curve: OffsetCurve, signals: Signals, first: int, last: int) -> ExactRow:
    """Return what is certified at each of the codes, V, as `certified_V` does; kept for whoever proves it again."""
    for known, of_signals, begin, end, row in tuple(KNOWN):
        if (begin, end) == (first, last) and (known is curve or known == curve) and of_signals == signals:
            return row
    row = _row(curve, signals, first, last)
    KNOWN.append((curve, signals, first, last, row))
    return row


def _row(curve: OffsetCurve, signals: Signals, first: int, last: int) -> ExactRow:
    step, parts = signals.dp_MPa(1), []
    for begin, end, stretch in _stretches(curve, step, first, last):
        part = None if stretch is None else _least(stretch, step, begin, end)
        if part is None:  # a corner, or refused
            values = [certified_V(curve, code * step) for code in range(begin, end)]
            parts += [([value.numerator], value.denominator) for value in values]
        else:
            parts.append(part)
    return ExactRow.joined(parts)


def offset_row(curve: OffsetCurve, signals: Signals, first: int, last: int) -> ExactRow:
    """Return the offset at each of the codes, V, whatever is certified."""
    above = curve.above and replace(curve.above, certified=False)
    return _row(replace(curve, certified=None, above=above), signals, first, last)


def _stretches(
    curve: OffsetCurve, step: Fraction, first: int, last: int
) -> Iterator[tuple[int, int, _Stretch | None]]:
    """Yield the codes, from and up to, of each corner that has one, and of each stretch between two corners."""
    corners, begin = _corners(curve), first
    for index, corner in enumerate([*corners, None]):
        place = None if corner is None else corner / step
        end = last + 1 if place is None else min(max(ceil(place), begin), last + 1)
        if end > begin:
            low = corners[index - 1] if index else None
            yield begin, end, _stretch(curve, low, corner)
            begin = end
        if place is not None and place == begin <= last:
            yield begin, begin + 1, None
            begin += 1


def _corners(curve: OffsetCurve) -> list[Fraction]:
    """Return the pressure drops between which the curve is one polynomial, or the least of some, MPa."""
    corners = set(curve.dp_MPa)
    if curve.hold_below_MPa is not None:
        corners.add(curve.hold_below_MPa)
    pieces = list(curve.certified.pieces) if curve.certified else []
    if curve.above is not None:
        pieces += curve.above.bound.pieces
    return sorted(corners | {end for piece in pieces for end in (piece.from_MPa, piece.to_MPa)})


def _stretch(curve: OffsetCurve, low_MPa: Fraction | None, high_MPa: Fraction | None) -> _Stretch:
    """Return the curve between two neighbouring corners; None is beyond all of them."""
    if low_MPa is None:
        inside = (high_MPa or NONE) - 1
    else:
        inside = low_MPa + 1 if high_MPa is None else (low_MPa + high_MPa) / 2
    if curve.above is not None and inside > curve.dp_MPa[-1]:
        return _stretch_above(curve, inside)
    offset = [_straight(curve, inside)]
    if curve.hold_below_MPa is not None and inside <= curve.hold_below_MPa:
        offset.append(_constant(curve.at(curve.hold_below_MPa)))
    bounding = list(curve.certified.touching(inside, inside)) if curve.certified else []
    bound = _of_piece(bounding[0]) if bounding else None
    return _Stretch(offset=tuple(offset), never_below_zero=False, bound=bound)


def _stretch_above(curve: OffsetCurve, inside_MPa: Fraction) -> _Stretch:
    above = curve.above
    if above is None or inside_MPa > above.bound.pieces[-1].to_MPa:
        return _Stretch(offset=(_constant(NONE),), never_below_zero=True, bound=None)
    place = bisect_left(above.bound.pieces, inside_MPa, key=lambda piece: piece.to_MPa)
    piece = above.bound.pieces[place]
    passed = [above.least_V[place], piece.at(piece.from_MPa)]
    polynomial = _of_piece(piece)
    return _Stretch(
        offset=(polynomial, _constant(min(passed))),
        never_below_zero=True,
        bound=polynomial if above.certified else None,
    )


def _constant(value: Fraction) -> Polynomial:
    return value, NONE, NONE


def _straight(curve: OffsetCurve, inside_MPa: Fraction) -> Polynomial:
    """Return the line between the two nodes about a pressure drop; outside all nodes the nearest one's offset."""
    nodes, offset = curve.dp_MPa, curve.offset_V
    if inside_MPa <= nodes[0] or inside_MPa >= nodes[-1]:
        return _constant(offset[0] if inside_MPa <= nodes[0] else offset[-1])
    right = next(place for place, node in enumerate(nodes) if node > inside_MPa)
    slope = (offset[right] - offset[right - 1]) / (nodes[right] - nodes[right - 1])
    return offset[right] - slope * nodes[right], slope, NONE


def _of_piece(piece: BoundPiece) -> Polynomial:
    """Return the chord."""
    slope = (piece.high_V - piece.low_V) / (piece.to_MPa - piece.from_MPa)
    return piece.low_V - slope * piece.from_MPa, slope, NONE


def _least(stretch: _Stretch, step: Fraction, begin: int, end: int) -> tuple[list[int], int] | None:
    """Return the least of offset and bound at the codes from `begin` up to `end`, V; None where the bound is broken."""
    wanted = dict.fromkeys((*stretch.offset, *((stretch.bound,) if stretch.bound else ())))
    in_codes = {each: (each[0], each[1] * step, each[2] * step * step) for each in wanted}
    unit = lcm(DECIMALS.denominator, *(part.denominator for parts in in_codes.values() for part in parts))
    codes, values = range(begin, end), {}
    for each, parts in in_codes.items():
        none, one, two = (part.numerator * (unit // part.denominator) for part in parts)
        if two:
            found = [none + code * (one + code * two) for code in codes]
        else:
            found = [none + code * one for code in codes] if one else [none] * len(codes)
        values[each] = [max(value, 0) for value in found] if stretch.never_below_zero else found
    offset = values[stretch.offset[0]]
    for other in stretch.offset[1:]:
        offset = list(map(min, offset, values[other]))
    if stretch.bound is None or stretch.bound in stretch.offset:  # of which the offset is the least
        return offset, unit
    bound, slack = values[stretch.bound], int(DECIMALS * unit)
    if any(value > limit + slack for value, limit in zip(offset, bound, strict=True)):
        return None
    return list(map(min, offset, bound)), unit


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
    signals = allowance.signals
    first, last = (signals.dp_code(end) for end in (curve.dp_MPa[0], curve.dp_MPa[-1]))
    code_max = signals.largest_difference(allowance.sign)
    if last > code_max:
        raise InputError(
            worded(
                "the sensor's span of {span:g MPa} ends below the tested pressure drop of {tested:g MPa}; give the "
                "real span with --pressure-span",
                span=float(signals.pressure_a.span_MPa),
                tested=float(curve.dp_MPa[-1]),
            )
        )
    low, high = allowance.window
    factor, kept = allowance.factor / u_max_V, allowance.kept
    least = certified_row(curve, signals, low, code_max + high).least_of_windows(high - low + 1)
    return OffsetCeiling(limit=least.line(factor, kept), certified=range(ceil(first), floor(last) + 1))
