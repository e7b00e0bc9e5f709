"""What the zero-command drive leaves to the threshold's lower bound, at every difference of pressure codes.

The bound is argued from the ramp tests anew: by monotonicity a threshold that falls with dP is at least the bound of
any test at a higher dP, one that rises at least that of any test at a lower dP, and of a flat one only the lowest bound
is known. A code stands for all pressures that may have made it; a dither's peak counts as drive.
"""

from bisect import bisect_left, bisect_right
from fractions import Fraction
from itertools import accumulate
from math import lcm

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import Differences


def zero_command_margins(
    compensator: Compensator, exact: ExactLaw, found: Differences, at_zero: np.ndarray
) -> tuple[int, Fraction]:
    """Return how many differences of the tested interval are driven above the bound, and the smallest margin in V.

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
    """
    largest: dict[Fraction, int] = {}  # the largest drive for which each bound is what is known
    counts: dict[Fraction, list[int]] = {}
    for bound, compare in zip(bounds_at(compensator, exact, found), at_zero.tolist(), strict=True):
        if bound is not None:
            largest[bound] = max(largest.get(bound, 0), compare)
            counts.setdefault(bound, []).append(compare)
    u_max, peak = compensator.u_max_V, compensator.drive_functions.dither_counts
    margins = {bound: bound - u_max * (compare + peak) / exact.compare_max for bound, compare in largest.items()}
    above = 0
    for bound in (bound for bound, margin in margins.items() if margin < 0):
        limit = bound * exact.compare_max / u_max - peak
        above += sum(compare > limit for compare in counts[bound])
    return above, min(margins.values())


def bounds_at(compensator: Compensator, exact: ExactLaw, found: Differences) -> list[Fraction | None]:
    """Return the threshold's lower bound in V at every difference; None where none is known, or no codes make it.

    Parameters
    ----------
    compensator : Compensator
        Which the core was made from.
    exact : ExactLaw
        The side's law.
    found : Differences
        All differences.
    """
    side = compensator.valve.sides[exact.side]
    guard = compensator.side(1 if exact.side == "positive" else -1).certificate.guard
    bounds = bounds_of(side, guard)
    tests = sorted(
        (Fraction(repr(test.dp_MPa)), Fraction(repr(bound))) for test, bound in zip(side.tests, bounds, strict=True)
    )
    pressures, values = [dp for dp, _ in tests], [bound for _, bound in tests]
    best = best_bounds(side.trend, values)
    scale, lowest, highest = pressure_drops(exact, found, [dp.denominator for dp in pressures])
    ends = [int(dp * scale) for dp in pressures]
    known: list[Fraction | None] = []
    for low, high, made in zip(lowest, highest, found.made.tolist(), strict=True):
        if not made or high < ends[0] or low > ends[-1]:
            known.append(None)
        elif side.trend == "decreasing":
            known.append(best[bisect_left(ends, min(high, ends[-1]))])
        else:
            known.append(best[bisect_right(ends, max(low, ends[0])) - 1])
    return known


def best_bounds(trend: str | None, values: list[Fraction]) -> list[Fraction]:
    """Return what is known at each test of the threshold's lower bound, by its monotony.

    Parameters
    ----------
    trend : str or None
        Of the threshold over the pressure drop.
    values : list of Fraction
        Bounds of the tests, in the order of rising pressure drop.
    """
    if trend == "decreasing":
        return list(accumulate(values[::-1], max))[::-1]  # of a test and all above it
    if trend == "increasing":
        return list(accumulate(values, max))  # of a test and all below it
    return [min(values)] * len(values)


def bounds_of(side: SideModel, guard: str) -> tuple[float, ...]:
    """Return the lower bounds of the threshold that the compensator was certified for, V.

    Raises
    ------
    InputError
        If its valve has none.
    """
    if guard not in side.guards:
        raise InputError(
            f"the certificate guards the {guard} threshold, of which its valve has no bounds; make the compensator "
            "again with `dzdesign design`"
        )
    return side.guards[guard].u_lower_V


def pressure_drops(exact: ExactLaw, found: Differences, denominators: list[int]) -> tuple[int, list[int], list[int]]:
    """Return the least and the largest pressure drop that may have made each difference, over all its pairs.

    Parameters
    ----------
    exact : ExactLaw
        Its sensors and what their codes stand for.
    found : Differences
        All differences.
    denominators : list of int
        What the scale must be a multiple of.

    Returns
    -------
    scale, least, largest
        Integers, over `scale` in MPa.
    """
    a_MPa, b_MPa = (s.span_MPa / (s.full_code - s.zero_code) for s in (exact.a, exact.b))
    (a_least, a_most), (b_least, b_most) = (s.error_MPa for s in (exact.a, exact.b))
    ends = sorted(exact.turn * error for error in (a_least - b_most, a_most - b_least))
    scale = lcm(a_MPa.denominator, b_MPa.denominator, *(end.denominator for end in ends), *denominators)
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
    return scale, least.tolist(), most.tolist()


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
