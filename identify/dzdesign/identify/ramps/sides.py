"""The two sides of a bipolar valve: the negative one, mirrored, is a positive one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dzdesign.identify.reading.metering_edge import OF_EITHER_SIGN
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.recorded_drop import DropSign

#: A recording shows a side if its command goes that far into it, over u_max.
SMALLEST_SWEEP = 0.1
#: Commands within this share of u_max are at rest: they belong to both sides.
AT_REST = 0.01


def tests_of_side(tests: Sequence[RampTest], sign: int, u_max: float) -> list[RampTest]:
    """Return the recordings that show one side (1: positive commands, -1: negative ones), mirrored to positive."""
    found = []
    for test in tests:
        smooth = test.smooth
        both = [smooth.size > 0 and (side * smooth).max() >= SMALLEST_SWEEP * u_max for side in (1, -1)]
        # What shows neither side is refused with the positive one.
        if both[0 if sign > 0 else 1] or (sign > 0 and not any(both)):
            if all(both):  # the other side's flow and, in some recordings, pressure drop have the other sign
                of_side = sign * test.u >= -AT_REST * u_max
                back = np.flatnonzero(of_side[1:] & ~of_side[:-1]) + 1
                test = replace(test.part(of_side), crossed=tuple(test.time[back].tolist()))
            found.append(_mirrored(test, u_max) if sign < 0 else test)
    return found


def flow_is_negative(test: RampTest) -> bool:
    """Tell whether the flow of a recording is negative where its command is at its most negative."""
    return bool(np.median(test.q[_most_negative(test)]) < 0)


def _most_negative(test: RampTest) -> np.ndarray:
    rows: np.ndarray = test.u <= 0.8 * test.u.min()
    return rows


def _mirrored(test: RampTest, u_max: float) -> RampTest:
    """Return a recording with its command reversed; flow and pressure drop too, where they change sign with it.

    The pressure drop of two ports of an edge has no sign to change: below zero, it is refused.
    """
    q, q_range = test.q, test.q_range
    if flow_is_negative(test):
        q, q_range = -q, (-q_range[1], -q_range[0]) if q_range else None
    dp, dp_from = test.dp, test.dp_from[::-1]
    sign: DropSign = 1
    below_zero = dp is not None and np.median(dp[_most_negative(test)]) < 0
    if dp is not None and below_zero and all(each.quantities in OF_EITHER_SIGN for each in dp_from[0]):
        at_rest = np.abs(test.u) <= AT_REST * u_max  # there it may still have the other side's sign
        dp, sign = np.where(at_rest, np.abs(dp), -dp), -1
    unseen = (-test.unseen[1], -test.unseen[0])
    return replace(test, u=-test.u, q=q, dp=dp, dp_from=dp_from, dp_sign=sign, q_range=q_range, unseen=unseen)
