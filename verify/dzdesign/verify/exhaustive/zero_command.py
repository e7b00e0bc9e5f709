"""What the zero-command drive leaves to a threshold's lower bound, at every difference of pressure codes.

The bound is argued from the ramp tests again. By monotonicity a threshold that falls with dP is at least the bound of
any test at a higher dP, one that rises at least that of any test at a lower dP, and of a flat one only the lowest bound
is known. One of limited curvature sags below the chord of two tests by a parabola at most (`SaggingBound`). A code
stands for all pressures that may have made it; what of a dither the recordings do not have counts as drive.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate
from math import ceil, floor, lcm

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_valves import LotSide
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.sagging_bound import SaggingBound
from dzdesign.verify.exhaustive.test_vectors import Differences

#: Margins that differ by less than this in doubles, V, are compared exactly.
CLOSE_V = 1e-9
#: Whole numbers below this, and their differences, fit 64 bits with a sign.
LARGEST = 2**62


class Staircase:
    """What is known of a threshold's lower bound, `bounds_V`, at each tested pressure drop, rising, by its monotony."""

    def __init__(self, bounds: LotSide) -> None:
        pairs = zip(bounds.dp_MPa, bounds.u_lower_V, strict=True)
        tests = sorted((Fraction(repr(dp)), Fraction(repr(bound))) for dp, bound in pairs)
        self.dp_MPa, values = [dp for dp, _ in tests], [bound for _, bound in tests]
        self.falling = bounds.trend == "decreasing"
        if self.falling:
            self.bounds_V = list(accumulate(values[::-1], max))[::-1]  # of a test and all above it
        elif bounds.trend == "increasing":
            self.bounds_V = list(accumulate(values, max))  # of a test and all below it
        else:
            self.bounds_V = [min(values)] * len(values)


def guarded_bounds(compensator: Compensator, sign: int) -> LotSide:
    """Return the lower bounds of the threshold that a compensator was certified for."""
    side = compensator.valve.sides["positive" if sign > 0 else "negative"]
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

    def steps_of(self, staircase: Staircase) -> np.ndarray:
        """Return which bound of a staircase is known at each difference, by its place; -1: none."""
        ends = np.array([int(dp * self.scale) for dp in staircase.dp_MPa], dtype=self.least.dtype)
        if staircase.falling:
            place = np.searchsorted(ends, np.minimum(self.most, ends[-1]), side="left")
        else:
            place = np.searchsorted(ends, np.maximum(self.least, ends[0]), side="right") - 1
        return np.where(self.made & (self.most >= ends[0]) & (self.least <= ends[-1]), place, -1)


def pressure_drops(exact: ExactLaw, found: Differences, tested_MPa: Iterable[Fraction]) -> PressureDrops:
    """Return the pressure drops of all differences, over a scale by which the tested ones are whole numbers, too."""
    tested = set(tested_MPa)
    a_MPa, b_MPa, (a_least, a_most), (b_least, b_most) = (
        exact.a.per_code_MPa, exact.b.per_code_MPa, exact.a.error_MPa, exact.b.error_MPa,
    )  # fmt: skip
    ends = sorted(exact.turn * error for error in (a_least - b_most, a_most - b_least))
    scale = lcm(*(value.denominator for value in (a_MPa, b_MPa, *ends, *tested)))
    a_unit, b_unit = int(a_MPa * scale), int(b_MPa * scale)
    # A pair's drop is turn ((a - a0) a_MPa - (b - b0) b_MPa), and a - a0 is turn (difference) + slant[b] - a0.
    codes = np.arange(found.slant.size, dtype=object)
    rest = exact.turn * (
        (found.slant.astype(object) - exact.a.zero_code) * a_unit - (codes - exact.b.zero_code) * b_unit
    )
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
    """What the drive at zero command leaves to one staircase of bounds: where it is least, and how often too little."""

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
    """Return what drives at zero command, in units of `unit_V`, leave to each valve's bounds."""
    return [
        _margin(Staircase(each), drops, at_peak, unit_V)
        if _is_staircase(each)
        else margin_of_sagging(SaggingBound(each), drops, at_peak, unit_V)
        for each in bounds
    ]


def bounds_at(drops: PressureDrops, bounds: LotSide) -> np.ndarray:
    """Return what is known of a valve's threshold at each difference of codes, V in doubles; NaN where nothing is."""
    if _is_staircase(bounds):
        staircase = Staircase(bounds)
        steps = drops.steps_of(staircase)
        return np.where(steps >= 0, np.array(staircase.bounds_V, dtype=float)[steps], np.nan)
    least, most = (values.astype(float) / drops.scale for values in (drops.least, drops.most))
    known = SaggingBound(bounds).least_in_doubles(least, most)
    return np.where(drops.made & np.isfinite(known), known, np.nan)


def _is_staircase(bounds: LotSide) -> bool:
    """Return whether all that is known between the tests follows from monotony."""
    return bounds.premise == "monotone" or len(bounds.dp_MPa) == 1


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


def margin_of_sagging(
    bound: SaggingBound, drops: PressureDrops, at_peak: np.ndarray, unit_V: Fraction
) -> ZeroCommandMargin | None:
    """Return what drives, counts of `unit_V`, leave to a bound that sags: by doubles, and exactly where they decide."""
    least, most = (values.astype(float) / drops.scale for values in (drops.least, drops.most))
    left_V = np.where(drops.made, bound.least_in_doubles(least, most), np.inf) - float(unit_V) * at_peak
    if not np.isfinite(left_V).any():
        return None
    near = np.flatnonzero((left_V <= left_V.min() + CLOSE_V) | (np.abs(left_V) <= CLOSE_V))
    exact = []
    for row in near:
        ends = Fraction(int(drops.least[row]), drops.scale), Fraction(int(drops.most[row]), drops.scale)
        exact.append((bound.least(*ends) - unit_V * int(at_peak[row]), int(row)))
    margin, place = min(exact)
    exceeded = int(np.sum(left_V < -CLOSE_V)) + sum(value < 0 for value, at in exact if abs(left_V[at]) <= CLOSE_V)
    middle = Fraction(int(drops.least[place]) + int(drops.most[place]), 2 * drops.scale)
    return ZeroCommandMargin(margin_V=margin, dp_MPa=round(float(middle), 4), exceeded=exceeded)


def _margin(
    staircase: Staircase, drops: PressureDrops, at_peak: np.ndarray, unit_V: Fraction
) -> ZeroCommandMargin | None:
    """Return what drives, counts of `unit_V`, leave to a staircase."""
    steps, exceeded = drops.steps_of(staircase), 0
    least: list[tuple[Fraction, int]] = []
    for place, bound in enumerate(staircase.bounds_V):
        drive = np.where(steps == place, at_peak, -1)
        row = int(drive.argmax())
        if drive[row] >= 0:
            least.append((bound - unit_V * int(drive[row]), row))
            exceeded += int(((steps == place) & (at_peak > floor(bound / unit_V))).sum())
    if not least:
        return None
    margin, row = min(least)
    middle = Fraction(int(drops.least[row]) + int(drops.most[row]), 2 * drops.scale)
    return ZeroCommandMargin(margin_V=margin, dp_MPa=round(float(middle), 4), exceeded=exceeded)
