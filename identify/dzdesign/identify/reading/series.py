"""The recordings of a series: in which order they were taken, which is a copy of another, what their names state.

A bench records one ramp after the other, so the times of two recordings do not overlap: by the dates that they state,
or as the engineer says, on one clock for all.

A copy may be saved again, rounded, in other units, decimated or cut. Rows are compared, not times: where flow passes,
a copy's commands and flows are in the other recording too, rounded to the coarser steps of both, at the same pressure
drop. In a true repeat the valve opens elsewhere. If it did so by `LEAST_SHIFT` of full command only, the flow gain and
the step of the flow tell how many rows would differ; where these are too few, as in a table of ten coarse readings,
nothing is said. A copy whose samples are others, such as means of ten, is not found.

A name may state the pressure drop: ``ramp_4MPa.csv``, ``V7_dP2.csv``; or may seem to: ``ramp_2_5MPa.csv``.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dzdesign.core.units import parse_quantity
from dzdesign.identify.constants import LARGEST_DP, SMALLEST_DP
from dzdesign.identify.reading.ramp_test import RampTest

#: By so much two recordings may seem to overlap whose stamps are of whole seconds, s.
ROUNDING = 2.0
#: Flow passes above this share of the largest one. A copy has so many rows there, over this share of the commands.
LARGE_FLOW, FEWEST, SAME_RANGE = 0.05, 20, 0.25
#: Rows that are looked for first, and how many of them may be missed.
FIRST_LOOK, MOST_MISSED = 16, 3
#: Share of the rows that a copy may have changed, such as a spike that was taken out.
SPOILT = 1e-3
#: Shift of the thresholds, over the largest command, that two repeats of a valve show at least; rows that then differ.
LEAST_SHIFT, LEAST_DIFFERING = 1e-4, 8
#: Differences below this share of a step, or of the largest number, are none; two pressure drops differ by more.
SAME_STEP, ROUNDING, LEVEL = 1e-3, 1e-7, 0.01


def in_stated_order(tests: Sequence[RampTest]) -> list[RampTest]:
    """Return recordings, given in the order of taking, with the times at which they began.

    These are the dates that they state, where all do and say the same order; else one begins where the last one ends.
    """
    if on_one_clock(tests) and not runs_back(tests):
        return list(tests)
    found, begins = [], 0.0
    for test in tests:
        found.append(replace(test, started=begins - float(test.time[0])))
        begins += float(np.ptp(test.time))
    return found


def with_clock_of_series(tests: Sequence[RampTest]) -> list[RampTest]:
    """Return recordings whose times of beginning can be compared: none where some dates have a zone and others not.

    One recording alone has its own clock.
    """
    if len(tests) == 1:
        return [tests[0] if tests[0].started is not None else replace(tests[0], started=0.0)]
    comparable = order_is_stated(tests) or on_one_clock(tests)
    return [test if comparable or test.stamp is None else replace(test, started=None) for test in tests]


def order_is_stated(tests: Sequence[RampTest]) -> bool:
    """Tell whether the order is the engineer's, and not that of the recordings' dates."""
    return any(test.started != (test.stamp.seconds if test.stamp else None) for test in tests)


def on_one_clock(tests: Sequence[RampTest]) -> bool:
    """Tell whether all recordings state a date, and all or none of them its time zone."""
    zones = {None if test.stamp is None else test.stamp.has_zone for test in tests}
    return len(zones) == 1 and None not in zones


def runs_back(tests: Sequence[RampTest]) -> tuple[RampTest, RampTest] | None:
    """Return two recordings, one and the next, of which the next began before that ended, by dates on one clock.

    None where there are no such, or no date.
    """
    return next(((one, other) for one, other in pairwise(tests) if began(other) < ended(one) - ROUNDING), None)


def began(test: RampTest) -> float:
    """Return when a recording began by the date that it states, s; NaN if it states none."""
    return np.nan if test.stamp is None else test.stamp.seconds + float(test.time[0])


def ended(test: RampTest) -> float:
    """Return when it ended, s."""
    return began(test) + float(np.ptp(test.time))


# copies
#: A number, and one that may be its whole part: names of files often can't hold a point.
_NUMBER = r"(?:(?<!\d)(\d{1,9})([_p-]))?(?<![\d.])(\d{1,9}(?:[.,]\d{1,9})?)"
#: A pressure in the name of a file.
WITH_UNIT = re.compile(rf"{_NUMBER}[\s_]*(MPa|bar|kPa|psi)(?![A-Za-z])", re.IGNORECASE)
UNITS = {"mpa": "MPa", "bar": "bar", "kpa": "kPa", "psi": "psi"}
#: Pressures that differ by no more than this factor are one: nominal here, measured there.
SAME = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Copy:
    """Two recordings, by number, the later one a copy of the earlier one or of a part of it, or the reverse."""

    one: int
    other: int
    #: Rows that were compared, and those of them that agree.
    compared: int
    agree: int


def find_copy(tests: Sequence[RampTest]) -> Copy | None:
    """Return the first recording that is a copy of an earlier one, or of a part of it; None where none is."""
    steps = [np.array([_step(test.u), _step(test.q)]) for test in tests]
    for other, late in enumerate(tests):
        for one, early in enumerate(tests[:other]):
            part, whole = sorted((early, late), key=lambda test: test.u.size)
            size = np.abs(part.q)
            rows = np.stack([part.u, part.q])[:, size > LARGE_FLOW * size.max(initial=0.0)]
            recorded = [test.dp for test in (part, whole) if test.dp is not None and not test.dp_is_declared]
            levels = [float(np.median(dp)) for dp in recorded]
            alike = not levels or (len(levels) == 2 and abs(levels[0] - levels[1]) <= LEVEL * abs(levels[1]))
            if rows.shape[1] >= FEWEST and alike:
                agree = _agreeing(rows, whole, np.maximum(steps[one], steps[other]))
                if agree:
                    return Copy(one=one, other=other, compared=rows.shape[1], agree=agree)
    return None


def _agreeing(rows: np.ndarray, whole: RampTest, steps: np.ndarray) -> int:
    """Return how many rows (2, N) of command and flow, rounded to steps, are in a recording; 0 if it has no copy."""
    look = rows[:, np.linspace(0, rows.shape[1] - 1, FIRST_LOOK).astype(int)].T
    near = (np.any((np.abs(whole.u - u) <= steps[0]) & (np.abs(whole.q - q) <= steps[1])) for u, q in look)
    if FIRST_LOOK - sum(near) > MOST_MISSED:
        return 0
    ours, its = _keys(rows, steps), _keys(np.stack([whole.u, whole.q]), steps)
    agree = int(np.count_nonzero(np.isin(ours, its).any(axis=0)))
    u, q = np.abs(rows)
    # So many rows would differ, each by itself, if the thresholds were shifted by the least that repeats show.
    by_shift = float(np.ptp(q) / np.ptp(u)) * LEAST_SHIFT * float(u.max()) if np.ptp(u) else 0.0
    differing = u.size * min(by_shift / steps[1], 1.0)
    is_copy = agree >= (1 - SPOILT) * u.size - 1 and np.ptp(u) > SAME_RANGE * u.max() and differing > LEAST_DIFFERING
    return agree if is_copy else 0


def _keys(rows: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return rows of command and flow, rounded to steps, as one number each (4, N).

    What lies midway between two steps may have been rounded to either.
    """
    below, above = (np.round(rows / steps[:, None] + side).astype(np.int64) for side in (-SAME_STEP, SAME_STEP))
    return np.stack([u + (q << 32) for u in (below[0], above[0]) for q in (below[1], above[1])])


def _step(channel: np.ndarray) -> float:
    """Return the largest step of which all numbers of a channel are multiples from the least on (Euclid).

    Numbers without a step have one that is rounding; those of a level channel have the largest itself.
    """
    largest = float(np.abs(channel).max(initial=0.0))
    gaps = np.diff(np.unique(channel))
    gaps = gaps[gaps > ROUNDING * largest]
    step = 0.0
    while gaps.size:
        step = float(gaps.min())
        rest = np.abs(gaps - step * np.round(gaps / step))
        gaps = rest[rest > max(SAME_STEP * step, ROUNDING * largest)]
    span = float(np.ptp(channel))
    return span / round(span / step) if step else largest or 1.0  # written with few digits, single steps differ


# pressures in names


def pressures_in_name(name: str) -> tuple[str, ...]:
    """Return the pressures as which a file's name can be read: none, one, or the decimal one and the other.

    ``2p5`` is a decimal number; ``2_5MPa`` may be 2.5 MPa, or 5 MPa after a number of its own, so may ``0_5MPa`` (valve
    0, run 0), and ``2.000 bar`` may be two thousand. What is not a valve's pressure drop is none of the readings.

    Examples
    --------
    >>> pressures_in_name("ramp_4MPa_2.csv"), pressures_in_name("ramp_0p5MPa.csv"), pressures_in_name("ramp_2_5MPa.csv")
    (('4 MPa',), ('0.5 MPa',), ('2.5 MPa', '5 MPa'))
    """
    found = {
        _with_unit(_readings(before, mark, number), UNITS[unit.lower()])
        for before, mark, number, unit in WITH_UNIT.findall(name)
    }
    return found.pop() if len(found) == 1 else ()


def _readings(before: str, mark: str, number: str) -> tuple[str, ...]:
    """Return the decimal number, and the other reading if there is one: of digits with a mark between the latter."""
    whole, _, fraction = number.replace(",", ".").partition(".")
    if fraction:
        thousands = len(fraction) == 3 and len(whole) <= 3 and int(whole) > 0
        return (f"{whole}.{fraction}", *((whole + fraction,) if thousands else ()))
    if not before:
        return (number,)
    decimal = f"{before}.{number}"
    return (decimal,) if mark in "pP" else (decimal, number)


def _with_unit(readings: tuple[str, ...], unit: str) -> tuple[str, ...]:
    """Return readings with their unit, without those that no valve's pressure drop can be."""
    texts = [f"{reading} {unit}" for reading in readings]
    possible = [text for text in texts if SMALLEST_DP <= _in_Pa(text) <= LARGEST_DP] or texts
    return tuple(possible)


def _in_Pa(text: str) -> float:
    return parse_quantity(text, "pressure", "a file's name")


def contradicts(name: str, dp: float) -> str:
    """Return what a file's name states if the measured pressure, in Pa, is plainly another in any reading; or nothing.

    Examples
    --------
    >>> contradicts("ramp_5MPa.csv", 1e6), contradicts("ramp_5MPa.csv", 4.8e6), contradicts("ramp_2_5MPa.csv", 4.8e6)
    ('5 MPa', '', '')
    """
    stated = pressures_in_name(name)
    agrees = any(_in_Pa(text) / SAME < dp < _in_Pa(text) * SAME for text in stated)
    return "" if agrees else " or ".join(stated)
