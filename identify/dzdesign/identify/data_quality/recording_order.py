"""Dates of recordings that can't all be right: a clock set back or reset, an order that contradicts them."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.series import began, ended, on_one_clock, order_is_stated, runs_back
from dzdesign.identify.valve.model import Warning_

#: A pause within a series of ramps is shorter than this, s: half a year.
LONGEST_PAUSE = 183 * 86_400.0


def about_order(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield what contradicts the order in which the recordings count, or the dates that it rests on."""
    if not on_one_clock(tests):
        return
    if order_is_stated(tests):
        found, case = runs_back(sorted(tests, key=lambda test: test.started or 0.0)), "order"
    else:
        in_time = sorted(tests, key=began)
        found, case = runs_back(in_time), "overlap"
        if found is None:
            found, case = _long_pause(in_time), "pause"
    if found is not None:
        one, other = found
        apart = began(other) - ended(one)
        yield warn(
            "time-stamps", None, case, one=one.source, other=other.source, overlap_s=-apart, days=apart / 86_400
        )


def _long_pause(in_time: Sequence[RampTest]) -> tuple[RampTest, RampTest] | None:
    """Return two recordings that follow each other after longer than any series pauses: a clock lost its date."""
    return next(((one, other) for one, other in pairwise(in_time) if began(other) - ended(one) > LONGEST_PAUSE), None)
