"""Recordings that show no threshold, refused with the reason: a shut valve, a flow that jumps, a wrong pressure."""

from collections.abc import Sequence

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import L_MIN, LARGEST_DP, MPA, SMALLEST_DP
from dzdesign.identify.knees.gated_line import PreparedBranch
from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.knees.profile import crossing, largest_flow
from dzdesign.identify.ramps.branches import Branch

#: A flow that rises with the command has readings between these shares of the largest where its mean is between them.
MIDDLE = (0.15, 0.45)
#: A meter's floor up to this share of the largest flow leaves a straight part to be seen.
LARGEST_FLOOR = 0.55
#: Fewest of the readings there, as a share, and width over u_max above which few readings are a coarse staircase's.
FEWEST_IN_THE_MIDDLE, WIDEST_JUMP = 0.25, 0.05
#: So far below the lowest command of a ramp, over u_max, a knee may lie: it is extrapolated, and a warning says so.
EXTRAPOLATED = 0.1


def refuse_a_wrong_pressure(source: str, dp: float | None) -> None:
    """Refuse a pressure drop (Pa; None if it is unknown) that is no valve's: a wrong unit, or swapped ports."""
    if dp is None:
        return
    if 0 < dp < SMALLEST_DP or dp > LARGEST_DP:
        raise InputError(
            f"'{source}': the pressure drop is {dp / MPA:.3g} MPa, expected {SMALLEST_DP / MPA:g} to "
            f"{LARGEST_DP / MPA:g} MPa; correct the unit in the header (mPa is a thousandth of a pascal)"
        )
    if dp <= 0:
        raise InputError(
            f"'{source}': the pressure drop is {dp / MPA:.3f} MPa, expected a positive one; "
            "swap pA and pB, or correct the sign of dP"
        )


def refuse_a_shut_valve(source: str, branches: Sequence[Branch | None], u_max: float) -> None:
    """Refuse a test whose flow at full command does not stand out of the meter's noise, or has the wrong sign."""
    for branch in filter(None, branches):
        bottom = branch.q[branch.u <= branch.u.min() + 0.05 * np.ptp(branch.u)]
        noise = robust_sigma(bottom)
        rise = largest_flow([branch], u_max) - float(np.median(bottom))
        least = max(6 * noise, 0.01 * L_MIN)
        if rise > least:
            continue
        if rise < -least:
            raise InputError(
                f"'{source}': the flow falls with the command, by {-rise / L_MIN:.3f} L/min from zero to "
                f"{branch.u.max():.2f} V, expected one that rises; reverse the sign of Q, or leave cells blank where "
                "the logger wrote a number for a missing sample"
            )
        raise InputError(
            f"'{source}': the valve never opens, as far as the meter shows: the flow at {branch.u.max():.2f} V is "
            f"{rise / L_MIN:.3f} L/min above that at zero, expected more than {least / L_MIN:.3f} (6 times the "
            f"meter's noise of {noise / L_MIN:.3f} L/min); check the solenoid, the supply and the column of Q, or "
            "average the readings"
        )


def refuse_a_jump(read: PreparedBranch, u_max: float) -> None:
    """Refuse a flow that jumps past its straight part: the line would be laid through the jump, volts too high.

    A meter whose floor lies above half of the largest flow makes such a jump wherever the flow happens to reach it, and
    so does a valve that only switches. The mean of readings on either side of a jump looks like a steep ramp; the
    readings themselves are on either side.
    """
    low, high = (crossing(*read.profile, share * read.y_max) for share in MIDDLE)
    inside = (read.branch.u >= low) & (read.branch.u <= high)
    # A floor inside the straight part is dealt with: what it hides is censored.
    if not inside.any() or high - low > WIDEST_JUMP * u_max or MIDDLE[0] < read.floor / read.y_max < LARGEST_FLOOR:
        return
    share = read.y[inside] / read.y_max
    if np.mean((share > MIDDLE[0]) & (share < MIDDLE[1])) >= FEWEST_IN_THE_MIDDLE:
        return
    raise InputError(
        f"'{read.source}': the flow jumps at {0.5 * (low + high):.2f} V: of {inside.sum()} readings there next to none "
        f"lies between {MIDDLE[0]:.0%} and {MIDDLE[1]:.0%} of the largest flow of {read.y_max / L_MIN:.3g} L/min, "
        "expected a straight rise; either the meter starts above that (take one of a smaller range, or leave out this "
        "pressure drop) or the valve only switches"
    )


def refuse_an_impossible_knee(branch: Branch, knee: float, source: str, u_max: float) -> None:
    """Refuse a knee (V) outside the command that a test's branch has swept, as a line through a bent part gives it."""
    lowest, highest = float(branch.u.min()), float(branch.u.max())
    if max(lowest - EXTRAPOLATED * u_max, 0.0) <= knee <= highest:
        return
    raise InputError(
        f"'{source}': the knee on {'opening' if branch.rising else 'closing'} comes out at {knee:.2f} V, expected it "
        f"within the command that was swept, {lowest:.2f} to {highest:.2f} V; look at the flow below it for a leak or "
        "a pump that came up late, and choose a --knee-window in which the flow is straight"
    )
