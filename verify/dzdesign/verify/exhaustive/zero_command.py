"""What the zero-command drive leaves to a threshold's lower bound, at every difference of pressure codes.

The bound is argued from the nodes in valve.json again: straight between them, so that its least value over an interval
lies at an end or at a node inside. A code stands for all pressures that may have made it; what of a dither the
recordings do not have counts as drive.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, lcm

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_valves import LotSide
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import Differences


class StraightBound:
    """What is known of a threshold over its tested interval: straight between the nodes of its bound."""

    def __init__(self, bounds: LotSide) -> None:
        self._dp_MPa = [Fraction(repr(dp)) for dp in bounds.dp_MPa]
        self._lower_V = [Fraction(repr(value)) for value in bounds.u_lower_V]
        self._in_doubles = np.array(bounds.dp_MPa), np.array(bounds.u_lower_V)

    def at(self, dp_MPa: Fraction) -> Fraction:
        """Return the bound at a pressure drop; outside the nodes that of the nearest one."""
        nodes, values = self._dp_MPa, self._lower_V
        if dp_MPa <= nodes[0] or dp_MPa >= nodes[-1]:
            return values[0] if dp_MPa <= nodes[0] else values[-1]
        right = bisect_left(nodes, dp_MPa)
        share = (dp_MPa - nodes[right - 1]) / (nodes[right] - nodes[right - 1])
        return values[right - 1] + share * (values[right] - values[right - 1])

    def least(self, low_MPa: Fraction, high_MPa: Fraction) -> Fraction:
        """Return the least value over an interval, as far as tests reach, V; the interval touches the tested one."""
        inside = [value for dp, value in zip(self._dp_MPa, self._lower_V, strict=True) if low_MPa < dp < high_MPa]
        return min([self.at(low_MPa), self.at(high_MPa), *inside])

    def least_in_doubles(self, low_MPa: np.ndarray, high_MPa: np.ndarray) -> np.ndarray:
        """Return the same of many intervals in double precision; infinite for one that no test reaches."""
        nodes, values = self._in_doubles
        found = np.minimum(np.interp(low_MPa, nodes, values), np.interp(high_MPa, nodes, values))
        for dp, value in zip(nodes, values, strict=True):
            found = np.where((low_MPa < dp) & (dp < high_MPa), np.minimum(found, value), found)
        return np.where((high_MPa >= nodes[0]) & (low_MPa <= nodes[-1]), found, np.inf)


#: Margins that differ by less than this in doubles, V, are compared exactly.
CLOSE_V = 1e-9
#: Whole numbers below this, and their differences, fit 64 bits with a sign.
LARGEST = 2**62


def guarded_bounds(compensator: Compensator, sign: int) -> LotSide:
    """Return the lower bounds of the threshold that a compensator was certified for."""
    side = compensator.valve.side(sign)
    guard = compensator.side(sign).certificate.guard
    if guard not in side.certified:
        raise InputError(
            f"the certificate guards the {guard} threshold, of which its valve has no bounds; make the compensator "
            "again with `dzdesign design`"
        )
    return LotSide.of(side, guard)


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureDrops:
    """The least and the largest pressure drop that may have made each difference, over all its pairs."""

    #: 1 MPa, in the unit of `least` and `most`.
    scale: int
    #: (D,) whole numbers.
    least: np.ndarray
    most: np.ndarray
    #: (D,): which differences sound codes make.
    made: np.ndarray

    def ends(self, row: int) -> tuple[Fraction, Fraction]:
        """Return the ends of one difference, MPa."""
        return Fraction(int(self.least[row]), self.scale), Fraction(int(self.most[row]), self.scale)


def pressure_drops(exact: ExactLaw, found: Differences, tested_MPa: Iterable[Fraction]) -> PressureDrops:
    """Return the pressure drops of all differences, over a scale by which the tested ones are whole numbers, too."""
    tested = set(tested_MPa)
    ahead, behind = exact.ahead, exact.behind
    a_MPa, b_MPa, (a_least, a_most), (b_least, b_most) = (
        ahead.per_code_MPa, behind.per_code_MPa, ahead.error_MPa, behind.error_MPa,
    )  # fmt: skip
    ends = (a_least - b_most, a_most - b_least)
    scale = lcm(*(value.denominator for value in (a_MPa, b_MPa, *ends, *tested)))
    a_unit, b_unit = int(a_MPa * scale), int(b_MPa * scale)
    # A pair's drop is (a - a0) a_MPa - (b - b0) b_MPa, and a - a0 is the difference + slant[b] - a0.
    codes = np.arange(found.slant.size, dtype=object)
    rest = (found.slant.astype(object) - ahead.zero_code) * a_unit - (codes - behind.zero_code) * b_unit
    values = found.values.astype(object) * a_unit
    first, last = np.minimum(found.b_first, codes.size - 1), np.maximum(found.b_last, found.b_first)
    least = values + _extreme(rest, first, last, np.minimum) + int(ends[0] * scale)
    most = values + _extreme(rest, first, last, np.maximum) + int(ends[1] * scale)
    largest = max(*(int(dp * scale) for dp in tested), *(abs(each[end]) for each in (least, most) for end in (0, -1)))
    kind = np.int64 if largest < LARGEST else object
    return PressureDrops(scale=scale, least=least.astype(kind), most=most.astype(kind), made=found.made)


def _extreme(values: np.ndarray, first: np.ndarray, last: np.ndarray, extreme: np.ufunc) -> np.ndarray:
    """Return the least or largest of `values` from each of `first` to its `last`, by ranges of powers of two."""
    last = np.minimum(last, values.size - 1)
    if np.all(values == values[0]):  # like sensors: nothing is rounded
        return np.full(first.size, values[0])
    ranges = [values]
    while 2 ** len(ranges) <= values.size:
        half = 2 ** (len(ranges) - 1)
        ranges.append(extreme(ranges[-1][:-half], ranges[-1][half:]))
    level = np.array([int(width).bit_length() - 1 for width in last - first + 1])
    windows = zip(level, first, last, strict=True)
    return np.array([extreme(ranges[k][begin], ranges[k][end - 2**k + 1]) for k, begin, end in windows], dtype=object)


@dataclass(frozen=True, slots=True, kw_only=True)
class ZeroCommandMargin:
    """What the drive at zero command leaves to one valve's bounds: where it is least, and how often too little."""

    #: Negative if the bound is exceeded.
    margin_V: Fraction
    #: The middle of the pressure drops that the difference of codes stands for.
    dp_MPa: float
    #: Differences of pressure codes at which the drive lies above the bound.
    exceeded: int


def zero_command_margins(
    exact: ExactLaw, found: Differences, at_zero: np.ndarray, bounds: Sequence[LotSide]
) -> list[ZeroCommandMargin | None]:
    """Return what the drive at zero command leaves to each valve's bounds; None where no code reaches its tests.

    `at_zero` are the compare values that the core gives at zero command, one a difference of pressure codes.
    """
    drops = pressure_drops(exact, found, {Fraction(repr(dp)) for each in bounds for dp in each.dp_MPa})
    unit_V = exact.compensator.u_max_V / exact.compare_max
    return margins_of_drives(drops, at_zero + counted_dither(exact.compensator), unit_V, bounds)


def margins_of_drives(
    drops: PressureDrops, at_peak: np.ndarray, unit_V: Fraction, bounds: Sequence[LotSide]
) -> list[ZeroCommandMargin | None]:
    """Return what drives at zero command, counts of `unit_V`, leave to each valve's bounds.

    By doubles, and exactly where they decide.
    """
    return [_margin(drops, at_peak, unit_V, each) for each in bounds]


def _margin(drops: PressureDrops, at_peak: np.ndarray, unit_V: Fraction, bounds: LotSide) -> ZeroCommandMargin | None:
    known_V, exactly = _known(drops, bounds)
    left_V = np.where(np.isnan(known_V), np.inf, known_V) - float(unit_V) * at_peak
    if not np.isfinite(left_V).any():
        return None
    near = np.flatnonzero((left_V <= left_V.min() + CLOSE_V) | (np.abs(left_V) <= CLOSE_V)).tolist()
    exact = [(exactly(row) - unit_V * int(at_peak[row]), row) for row in near]
    margin, place = min(exact)
    exceeded = int(np.sum(left_V < -CLOSE_V)) + sum(value < 0 for value, at in exact if abs(left_V[at]) <= CLOSE_V)
    return ZeroCommandMargin(margin_V=margin, dp_MPa=round(float(sum(drops.ends(place)) / 2), 4), exceeded=exceeded)


def bounds_at(drops: PressureDrops, bounds: LotSide) -> np.ndarray:
    """Return what is known of a valve's threshold at each difference of codes, V in doubles; NaN where nothing is."""
    return _known(drops, bounds)[0]


def bound_at(bounds: LotSide, dp_MPa: float) -> Fraction:
    """Return what is known of a valve's threshold at a pressure drop, V; beyond the tests what is at their end."""
    return StraightBound(bounds).at(Fraction(repr(dp_MPa)))


def _known(drops: PressureDrops, bounds: LotSide) -> tuple[np.ndarray, Callable[[int], Fraction]]:
    """Return what is known of a threshold, V: in doubles at each difference, and exactly at one."""
    straight = StraightBound(bounds)
    known = straight.least_in_doubles(*(each.astype(float) / drops.scale for each in (drops.least, drops.most)))
    values = np.where(drops.made & np.isfinite(known), known, np.nan)
    return values, lambda row: straight.least(*drops.ends(row))


def counted_dither(compensator: Compensator) -> int:
    """Return how many counts of the dither are drive at zero command, written from the documentation again.

    The whole peak, unless the ramps were recorded with a dither: then by how much its peak is another, and what a
    motion that falls with the square of the frequency makes of the frequency's difference. Of a controlled current
    also by how much its wave departs from the set point's, which `current_checks` holds to the coil.
    """
    functions, signals, recorded = compensator.drive_functions, compensator.signals, compensator.valve.dither
    drive = compensator.current_drive
    above, below = (drive.dither_above_counts, drive.dither_below_counts) if drive else (0, 0)
    if recorded is None:
        return functions.dither_counts + above
    half_waves = 2 * Fraction(repr(recorded.frequency_Hz)) * functions.dither_ticks / signals.tick_Hz
    other_peak = abs(Fraction(repr(recorded.peak)) * signals.compare_max - functions.dither_counts)
    return ceil(other_peak + functions.dither_counts * abs(1 - half_waves * half_waves)) + max(above, below)
