"""In which order recordings were taken: by the dates that they state, or as the engineer says; on one clock for all.

A bench records one ramp after the other, so the times of two recordings of a series do not overlap.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from dzdesign.identify.reading.ramp_test import RampTest

#: By so much two recordings may seem to overlap whose stamps are of whole seconds, s.
ROUNDING = 2.0


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
