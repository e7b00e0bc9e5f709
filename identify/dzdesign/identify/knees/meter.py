"""What the ramps tell of the flow meter: the flow at which it wakes up, and its lag.

Below its floor a meter reads nothing. On a staircase, where the command skips flows, readings between zero and the
floor are no sign: there a meter with a floor is quiet where it shows nothing, and at a level whose flow is near its
floor it shows that flow now and nothing then.

At a rate of r V/s a meter that lags by tau shows the rising knee r tau too high and the falling one r tau too low. On
one ramp rate that can't be told from hysteresis; a second rate moves the knees and leaves the hysteresis where it was.
A lag that is taken out wrongly moves both knees, and one of them to the unsafe side: taken too long it puts the closing
knee too high, too short the opening knee. So a lag comes with how much longer and shorter the true one may be. No meter
runs ahead of the flow, but a column of the command may come late, as one that a fieldbus reads back does: then ramps of
two rates show a lag below zero.
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import FULL_SWEEP
from dzdesign.identify.knees.gated_line import prepare_branch, straight_line
from dzdesign.identify.knees.line_fitting import fit_knee
from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.knees.profile import crossing, flow_at_top, hole_within, smooth_profile
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.branches import Branch
from dzdesign.identify.ramps.pooling import group_by_pressure
from dzdesign.identify.ramps.splitting import Ramp
from dzdesign.identify.reading.ramp_test import RampTest

#: Fewest samples of a ramp between 12 % and 50 % of its largest flow that tell how fast it sweeps the flows: by itself,
#: and beside others.
BY_ITSELF, FEWEST_STRAIGHT = 100, 20
#: A gap holds at most this share of the readings expected in it, and so many must be expected.
GAP_SHARE, EXPECTED = 0.1, 20
#: Readings of a level on average, and levels between the two flows, for any of this to be seen.
READINGS, LEVELS = 5, 3
#: Noise of a shut reading over that of a flowing one, below which the meter shuts its noise off.
QUIET = 0.3
#: Shares of a level's readings that are zeros: where both are there, the flow is near the floor.
FEW, MANY = 0.02, 0.98
#: Readings above zero of which the smallest is the floor, with this one left for a spike.
SPIKES = 2
#: Rates that differ by less than this factor are one.
TWO_RATES = 1.5
#: Standard errors that a lag must exceed to be believed.
LAG_SIGNIFICANCE = 3.0
#: A lag known no better than this, s, is not known.
USELESS = 0.1
#: Standard errors of a lag that was found, against which the bounds guard.
LAG_ERRORS = 3.0
#: Tolerance of a declared lag where none is stated: a share of it, and at least so many seconds.
LAG_TOLERANCE, LEAST_TOLERANCE = 0.2, 0.05
#: Longest lag, s, that the bounds allow for where nothing tells it.
LONGEST_UNKNOWN = 0.2


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


def floor_of_levels(u: np.ndarray, q: np.ndarray, shut: np.ndarray, ends: tuple[float, float]) -> float:
    """Return the smallest flow that the meter shows, m³/s, where levels tell that it has a floor; 0 elsewhere.

    Parameters
    ----------
    u, q : (N,) array
        Command, V, and flow, m³/s; several readings at each level of the command.
    shut : (M,) array
        Readings far below the first flow, m³/s.
    ends : tuple of float
        Commands between which the flow rises straight, V.
    """
    levels, index = np.unique(u, return_inverse=True)
    straight = (u >= ends[0]) & (u <= ends[1])
    if levels.size * READINGS > u.size or np.unique(index[straight]).size < LEVELS:
        return 0.0
    count = np.bincount(index)
    mean = np.bincount(index, weights=q) / count
    noise = robust_sigma((q - mean[index])[straight])
    shut_noise = robust_sigma(shut)
    if not shut_noise < QUIET * noise:
        return 0.0
    zero = np.abs(q - np.median(shut)) <= max(3 * shut_noise, 0.1 * noise)
    slope, knee = straight_line(u[straight & ~zero], q[straight & ~zero])
    zeros = np.bincount(index, weights=zero) / count
    mixed = (zeros > FEW) & (zeros < MANY)
    # A sharp edge passes this flow at a level that shows none at all.
    unseen = (zeros >= MANY) & (slope * (levels - knee) > 3 * noise)
    near = levels < ends[1]
    readings = np.sort(q[~zero & (u < ends[1])])
    if readings.size <= SPIKES or not np.any((mixed | unseen) & near):
        return 0.0
    return float(readings[SPIKES])


@dataclass(frozen=True, slots=True, kw_only=True)
class MeterLag:
    """Lag of the flow behind the command that was taken out, s, below zero of a command that comes late.

    `origin` says how it is known: "declared", "identified" (from ramps of two rates) or "unknown": then none is taken.
    """

    seconds: float
    origin: Literal["declared", "identified", "unknown"]
    #: By how much the true lag may be longer and shorter, s.
    longer: float
    shorter: float
    #: What ramps of two rates tell, and its standard error, s, where that contradicts the declared one.
    contradicted_by: tuple[float, float] | None = None
    #: What ramps of two rates show to be left of a declared lag, and its error, s; None where they tell nothing of it.
    left: tuple[float, float] | None = None

    @property
    def seen_by_rates(self) -> bool:
        """Whether ramps of two rates tell the lag well enough to check one that was declared."""
        return self.origin == "identified" or self.left is not None

    @property
    def longest(self) -> float:
        """The longest lag that the meter itself may have, s, by which it may round an edge."""
        return max(self.seconds + self.longer, 0.0)

    def shift_at(self, rates: np.ndarray, *, rising: bool) -> np.ndarray:
        """Return by how much knees, at ramps of such rates (V/s), may be too high, V; an unknown rate (NaN) tells 0."""
        shift: np.ndarray = np.nan_to_num(rates) * (self.longer if rising else self.shorter)
        return shift

    def shift_of_mean_at(self, rising: np.ndarray, falling: np.ndarray) -> np.ndarray:
        """Return by how much the mean of both branches' knees may be too high, V: of equal rates it is right."""
        faster = np.nan_to_num(rising) - np.nan_to_num(falling)
        shift: np.ndarray = np.where(faster > 0, self.longer * faster, -self.shorter * faster) / 2
        return shift


def find_lag(ramps: Sequence[Ramp], options: IdentifyOptions) -> MeterLag:
    """Return the meter's lag, declared or found, from all ramps, which were put right for the declared one, if any."""
    found = _lag_of_two_rates(ramps, options)
    if options.meter_lag is not None:
        return _declared(options.meter_lag, options.meter_lag_tolerance, found)
    if found is None:
        return MeterLag(seconds=0.0, origin="unknown", longer=LONGEST_UNKNOWN, shorter=0.0)
    seconds, se = found
    # Below its error there may be none; the error counts in the bounds either way.
    taken = seconds if abs(seconds) > LAG_SIGNIFICANCE * se else 0.0
    return MeterLag(
        seconds=taken,
        origin="identified",
        longer=max(seconds - taken, 0.0) + LAG_ERRORS * se,
        # No meter runs ahead of the flow; a lag found below zero says that the command may come late.
        shorter=min(taken, LAG_ERRORS * se) if seconds >= 0 else taken - seconds + LAG_ERRORS * se,
    )


def _declared(seconds: float, stated: float | None, left: tuple[float, float] | None) -> MeterLag:
    """Return a declared lag with its tolerance; `left` is what two rates show to be left of it, and its error, s."""
    tolerance = max(LAG_TOLERANCE * seconds, LEAST_TOLERANCE) if stated is None else stated
    longer, shorter, contradicted_by = tolerance, min(tolerance, seconds), None  # no meter runs ahead of the flow
    if left is not None and abs(left[0]) > tolerance + LAG_ERRORS * left[1]:
        contradicted_by = (seconds + left[0], left[1])
        longer = max(longer, left[0] + LAG_ERRORS * left[1])
        by_rates = LAG_ERRORS * left[1] - left[0]
        shorter = max(shorter, by_rates if contradicted_by[0] < 0 else min(by_rates, seconds))
    return MeterLag(
        seconds=seconds,
        origin="declared",
        longer=longer,
        shorter=shorter,
        contradicted_by=contradicted_by,
        left=left,
    )


def _lag_of_two_rates(ramps: Sequence[Ramp], options: IdentifyOptions) -> tuple[float, float] | None:
    """Return the lag that ramps of two rates tell, and its standard error, s; None if they tell none."""
    paces: list[np.ndarray] = []
    knees: list[np.ndarray] = []
    weights: list[np.ndarray] = []
    scatter = (options.repeatability or 0.0) * options.u_max
    for group in group_by_pressure(ramps):
        for rising in (True, False):
            rates, of_group, errors = _knees(group, rising, options)
            if not _two_rates(rates):
                continue
            # Each group and direction has a knee of its own, so only departures from its mean tell the lag.
            weight = 1 / (errors**2 + scatter**2)
            paces.append((rates - np.average(rates, weights=weight)) * (1 if rising else -1))
            knees.append(of_group - np.average(of_group, weights=weight))
            weights.append(weight)
    if not paces:
        return None
    pace, knee, weight = np.concatenate(paces), np.concatenate(knees), np.concatenate(weights)
    total = float(np.sum(weight * pace**2))
    seconds = float(np.sum(weight * pace * knee)) / total
    # What the knees scatter by from ramp to ramp, beyond their noise, is in the lag too.
    degrees = pace.size - len(paces) - 1
    excess = float(np.sum(weight * (knee - seconds * pace) ** 2)) / degrees if degrees > 0 else 1.0
    se = math.sqrt(max(excess, 1.0) / total)
    return None if se > USELESS else (seconds, se)


def _knees(group: Sequence[Ramp], rising: bool, options: IdentifyOptions) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return rate (V/s), knee and its standard error (V) of each ramp's branch of one direction; without those that
    show no knee by themselves. None are looked for in branches of one rate."""
    found = []
    highest = max((branch.u.max() for ramp in group for branch in ramp.branches), default=0.0)
    whole = [
        (ramp, branch)
        for ramp in group
        for branch in ramp.branches
        if branch.rising is rising
        and math.isfinite(branch.rate)
        and branch.u.max() >= FULL_SWEEP * highest
        and np.ptp(branch.u) >= FULL_SWEEP * highest
    ]
    floor = known_floor([ramp.test for ramp in group], options) or 0.0
    for ramp, branch in whole if _two_rates([branch.rate for _, branch in whole]) else ():
        read = prepare_branch(branch, ramp.test, u_max=options.u_max, floor=floor)
        with suppress(InputError):
            line = fit_knee(read, options.knee_window)
            if line.slope > 0:
                found.append((branch.rate, line.knee, line.knee_se))
    columns = np.array(found).reshape(-1, 3)
    return columns[:, 0], columns[:, 1], columns[:, 2]


def _two_rates(rates: Sequence[float] | np.ndarray) -> bool:
    return len(rates) > 1 and max(rates) >= TWO_RATES * min(rates)
