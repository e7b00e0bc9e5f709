"""Dates of recordings that can't all be right: a clock set back or reset, an order that contradicts them."""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from dzdesign.identify.data_quality.catalogue import Finding, warn
from dzdesign.identify.ramps.pooling import SAME_PRESSURE
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.series_order import began, ended, on_one_clock, order_is_stated, runs_back

#: A pause within a series of ramps is shorter than this, s: half a year.
LONGEST_PAUSE = 183 * 86_400.0
#: Fewest recordings whose numbers tell an order.
NUMBERED = 3


def about_order(tests: Sequence[RampTest]) -> Iterator[Finding]:
    """Yield what contradicts the order in which the recordings count, or the dates that it rests on."""
    if order_is_stated(tests):
        found, case = runs_back(sorted(tests, key=lambda test: test.started or 0.0)), "order"
    elif on_one_clock(tests):
        in_time = sorted(tests, key=began)
        found, case = runs_back(in_time), "overlap"
        if found is None:
            found, case = _long_pause(in_time), "pause"
        if found is None:
            found, case = _numbered_on(tests), "set-back"
    else:
        zones = {test.stamp.has_zone: test for test in tests if test.stamp}
        both_zones = len(zones) > 1 and all(test.stamp for test in tests)
        found, case = ((zones[True], zones[False]) if both_zones else None), "zones"
    if found is not None:
        one, other = found
        apart = began(other) - ended(one)
        yield warn(
            "time-stamps", None, case, one=one.source, other=other.source, overlap_s=-apart, hours=-apart / 3600,
            days=apart / 86_400,
        )  # fmt: skip


def _long_pause(in_time: Sequence[RampTest]) -> tuple[RampTest, RampTest] | None:
    """Return two recordings that follow each other after longer than any series pauses: a clock lost its date."""
    return next(((one, other) for one, other in pairwise(in_time) if began(other) - ended(one) > LONGEST_PAUSE), None)


def _numbered_on(tests: Sequence[RampTest]) -> tuple[RampTest, RampTest] | None:
    """Return a recording and the one that is numbered next, before which the clock was set back.

    That is so where the dates run with the numbers but for one step back to before the first of them.
    """
    for numbered in _by_running_number(tests):
        times = [began(test) for test in numbered]
        back = np.flatnonzero(np.diff(times) < 0)
        if back.size == 1 and times[-1] < times[0] and not _runs_with_pressure(numbered):
            return numbered[back[0]], numbered[back[0] + 1]
    return None


def _by_running_number(tests: Sequence[RampTest]) -> Iterator[list[RampTest]]:
    """Yield the recordings in the order of each number in their names that runs on without a gap."""
    if len(tests) < NUMBERED or len({re.sub(r"\d+", "#", test.source) for test in tests}) > 1:
        return
    for numbers in zip(*(re.findall(r"\d+", test.source) for test in tests), strict=True):
        places = [int(number[-9:]) for number in numbers]
        if sorted(places) == list(range(min(places), min(places) + len(tests))):
            yield [test for _, test in sorted(zip(places, tests, strict=True), key=lambda item: item[0])]


def _runs_with_pressure(numbered: Sequence[RampTest]) -> bool:
    """Tell whether recordings are numbered in the order of their pressure drops, which tells nothing of time."""
    if any(test.dp is None for test in numbered):
        return True
    steps = np.diff([float(np.median(test.dp)) for test in numbered if test.dp is not None])
    same = SAME_PRESSURE * float(np.abs(steps).sum())
    return bool(np.all(steps >= -same) or np.all(steps <= same))
