"""The flow at which a meter wakes up, as ramps show it: below it the meter reads nothing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.knees.level_floor import floor_of_levels
from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.knees.profile import crossing, flow_at_top, hole_within, smooth_profile
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.branches import Branch
from dzdesign.identify.reading.ramp_test import RampTest

#: Fewest samples of a ramp between 12 % and 50 % of its largest flow that tell how fast it sweeps the flows: by itself,
#: and beside others.
BY_ITSELF, FEWEST_STRAIGHT = 100, 20
#: A gap holds at most this share of the readings expected in it, and so many must be expected.
GAP_SHARE, EXPECTED = 0.1, 20


@dataclass(frozen=True, slots=True)
class _NearOpening:
    """What a branch shows of small flows, near its opening; flows in m³/s."""

    #: Readings above `lowest`, in rising order, and how many there would be per unit of flow without a floor.
    readings: np.ndarray
    density: float
    #: Samples that tell that.
    straight: int
    #: Flow that noise does not feign.
    lowest: float
    profile: tuple[np.ndarray, np.ndarray]


def known_floor(tests: Sequence[RampTest], options: IdentifyOptions) -> float | None:
    """Return the floor, m³/s, that is declared, or below which a meter was cut off; None if nobody knows one."""
    clipped = max((test.clipped_below for test in tests), default=0.0)
    return max(options.meter_floor or 0.0, clipped) if clipped else options.meter_floor


def find_meter_floor(branches: Sequence[Branch], u_max: float) -> float:
    """Return the flow at which the meter wakes up, m³/s, or 0 if no branch tells one: the largest that any shows.

    A meter with a floor reads (about) zero, then jumps: between its noise and its floor there are next to no
    readings, although the ramp sweeps those flows at the same pace as the flows above. Short ramps sweep them in few
    samples, so where no branch shows a floor by itself, all are asked together: one meter has read them. Where rows
    are missing the ramp did not sweep them, and the flows that nobody recorded look like a floor.
    """
    near = [_near_opening(branch.u, branch.q, u_max) for branch in branches]
    ramps = [part for part in near if isinstance(part, _NearOpening)]
    floors = [part for part in near if isinstance(part, float)]
    floors += [_gap([part], u_max) for part in ramps if part.straight >= BY_ITSELF]
    return max(floors, default=0.0) or _gap(ramps, u_max)


def _near_opening(u: np.ndarray, q: np.ndarray, u_max: float) -> _NearOpening | float:
    """Return what a ramp shows of small flows; of a staircase, or of too few readings, the meter's floor itself."""
    u_profile, q_profile = smooth_profile(u, q, u_max)
    q_max = flow_at_top(u_profile, q_profile)
    start, half = (crossing(u_profile, q_profile, share * q_max) for share in (0.12, 0.5))
    straight = int(np.sum((u >= start) & (u <= half)))
    shut = q[u < 0.5 * start]
    if shut.size >= 5 and u_profile.size < 200:  # a staircase skips flows, whatever the meter
        return floor_of_levels(u, q, shut, (start, half))
    if shut.size < 5 or straight < FEWEST_STRAIGHT:
        return 0.0
    lowest = max(3 * robust_sigma(shut), 1e-3 * q_max)
    # Near the opening only: far below it, thousands of shut readings would put some of their noise into the gap.
    # It reaches down to where the profile leaves the noise, or a soft edge's small flows would be cut off and missed.
    near = u > min(start - 0.5 * (half - start), crossing(u_profile, q_profile, lowest))
    return _NearOpening(
        readings=np.sort(q[near & (q > lowest) & (q < 0.5 * q_max)]),
        straight=straight,
        density=straight / (0.38 * q_max),  # per unit of flow where the valve is known to open smoothly
        lowest=lowest,
        profile=(u_profile, q_profile),
    )


def _gap(parts: Sequence[_NearOpening], u_max: float) -> float:
    """Return up to which flow next to no readings lie above the noise, m³/s; 0 if that is none, or rows are missing."""
    lowest = max((part.lowest for part in parts), default=0.0)
    readings = np.sort(np.concatenate([part.readings for part in parts] or [np.empty(0)]))
    readings = readings[readings > lowest]
    expected = sum(part.density for part in parts) * (readings - lowest)
    gap = np.flatnonzero((np.arange(readings.size) < GAP_SHARE * expected) & (expected > EXPECTED))
    floor = float(readings[gap[-1]]) if gap.size else 0.0
    for part in parts if floor else ():
        low, high = (crossing(*part.profile, flow) for flow in (lowest, floor))
        if hole_within(part.profile[0], low, high, u_max):
            return 0.0
    return floor
