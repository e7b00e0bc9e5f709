"""A recorded branch as few points: straight lines through its averaged flow, halved where they depart from it."""

import math
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.identify.constants import L_MIN, MPA, SMALLEST_DP
from dzdesign.identify.knees.described_tests import DescribedTest
from dzdesign.identify.knees.gated_line import BranchShape
from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.knees.profile import smooth_profile
from dzdesign.identify.ramps.branches import Branch, median
from dzdesign.identify.valve.recorded_curve import (
    MOST_POINTS,
    MOST_SAMPLES,
    SAG_STEPS,
    RecordedBranch,
    RecordedCurve,
    RecordedSamples,
)

#: A line between two points is halved where the flow, averaged over so many bins (0.5 % of full command), departs from
#: it by more than this share of the test's largest flow, and by more than its own noise explains, standard errors.
AVERAGED, TOLERANCE, NOISE_ERRORS = 5, 2.5e-3, 4.0
#: Up to this multiple of a flow that is allowed at zero command the share is of that flow, if it is less.
ABOUT_ZERO, OF_ZERO_FLOW = 2.0, 0.1
#: Readings within this share of a step of the flow tell the pressure drop there.
NEAR_STEP = 0.1
#: Share by which a pressure drop is another than the flow's usual one: more than straight lines between the steps miss
#: of a supply whose pump reaches its limit.
OFF_THE_USUAL = 0.15
#: Digits of a point, of the largest command and flow, and decimals of any number of the file.
DIGITS, DECIMALS = 5, 7


def recorded_curve(
    item: DescribedTest, leak: float, noise_level: float, u_max: float, at_zero: float | None = None
) -> RecordedCurve:
    """Return the characteristic that the ramps of a test show; leak and noise level in m³/s.

    Where a flow (m³/s) is allowed at zero command, the points stand closer about it, as the loop is judged by it.
    """
    supply = _Supply.of([shape.prepared.branch for shape in item.branches], leak, item.q_max + leak)
    profiles = [_profile(shape, supply, leak, u_max) if shape else None for shape in item.shapes]
    tolerance = TOLERANCE * max(float(profile[1].max()) for profile in profiles if profile)
    rising, falling = (
        None
        if shape is None or profile is None
        else replace(
            _thinned(*profile, leak=leak, level=noise_level, tolerance=tolerance, at_zero=at_zero or 0.0),
            samples=_samples(shape.prepared.branch, leak),
        )
        for shape, profile in zip(item.shapes, profiles, strict=True)
    )
    curve = RecordedCurve(rising=rising, falling=falling, dp_at_flow_MPa=None)
    if supply is None:
        return curve
    dp = supply.at(np.linspace(0, curve.q_max_L_min * L_MIN, SAG_STEPS + 1)) / MPA
    nodes = tuple(round(value, decimals_of(dp.max())) for value in dp.tolist())
    return RecordedCurve(rising=rising, falling=falling, dp_at_flow_MPa=nodes)


@dataclass(frozen=True, slots=True)
class _Supply:
    """How the bench's pressure drop sags over the flow: m³/s and Pa, linear between."""

    q: np.ndarray
    dp: np.ndarray

    @classmethod
    def of(cls, branches: list[Branch], leak: float, q_max: float) -> "_Supply | None":
        """Return the medians of the pressure drop about equal steps of the flow; None where it is not known."""
        known = [branch.dp for branch in branches if branch.dp is not None]
        if len(known) < len(branches):
            return None
        dp, steps = np.concatenate(known), np.concatenate([branch.q + leak for branch in branches]) / q_max * SAG_STEPS
        about = {step: dp[np.abs(steps - step) < NEAR_STEP] for step in range(SAG_STEPS + 1)}
        found = {step: median(near) for step, near in about.items() if near.size}
        return cls(np.array(list(found)) * q_max / SAG_STEPS, np.array(list(found.values())))

    def at(self, q: np.ndarray) -> np.ndarray:
        """Return the pressure drop at flows."""
        sagged: np.ndarray = np.maximum(np.interp(q, self.q, self.dp), SMALLEST_DP)
        return sagged

    def brought_to(self, q: np.ndarray, dp: np.ndarray) -> np.ndarray | None:
        """Return flows as they would be had the supply sagged as usual, where it was on its way up, or gone.

        None where it always was as usual.
        """
        usual = self.at(q)
        off = np.abs(dp - usual) > OFF_THE_USUAL * usual
        if not off.any():
            return None
        # Eq. (1), as at_nominal_pressure has it: below a tenth of the pressure the ratio would only carry noise.
        return np.where(off, q * np.sqrt(usual / np.maximum(dp, 0.1 * usual)), q)


def _profile(
    shape: BranchShape, supply: _Supply | None, leak: float, u_max: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Return command and flow in bins of the command, and where flow begins: no later than the knee.

    Of a noisy meter the first flow that stands out comes after the knee, and the valve is no sharper for that.
    """
    branch = shape.prepared.branch
    u, q = shape.prepared.recorded
    q = q + leak
    if supply and branch.dp is not None:
        flow = supply.brought_to(branch.q + leak, branch.dp)
        if flow is not None:
            u, q = smooth_profile(branch.u, flow, u_max)
    return u, q, min(shape.onset, shape.knee)


def _thinned(
    u: np.ndarray, q: np.ndarray, onset: float, *, leak: float, level: float, tolerance: float, at_zero: float
) -> RecordedBranch:
    """Return the points of a branch whose flow q (m³/s) was averaged in bins of the command."""
    of_bins = np.full(q.size, tolerance)
    if at_zero > 0:
        of_bins[q < ABOUT_ZERO * at_zero] = min(OF_ZERO_FLOW * at_zero, tolerance)
    at, q_at = fewest_points(u, q, of_bins)
    u_seen = _first_seen(u[at], q_at, leak + level)
    lowest, seen = float(u[0]), u[at] > u_seen
    points = [(u_seen, leak + level), *zip(u[at][seen].tolist(), np.maximum(q_at[seen], 0.0).tolist(), strict=True)]
    if u_seen > lowest:
        # Flow beyond the leak is seen from the level on; below, it comes to none where no recorded flow contradicts it.
        points = [(lowest, leak), (min(max(onset, lowest), u_seen), leak), *points]
    else:
        points = list(zip(u[at].tolist(), np.maximum(q_at, 0.0).tolist(), strict=True))
    fine_V, fine_L_min = decimals_of(float(u[-1])), decimals_of(float(q_at.max()) / L_MIN)
    # Of two points at one command, as of an onset at the first flow seen, the later one stands for both.
    kept = {round(command, fine_V): round(flow / L_MIN, fine_L_min) for command, flow in points}
    commands, flows = np.array(list(kept)), np.array(list(kept.values()))
    misses = _averaged(np.where(u >= u_seen, q / L_MIN - np.interp(u, commands, flows), 0.0))
    return RecordedBranch(
        u_V=tuple(commands.tolist()),
        q_L_min=tuple(flows.tolist()),
        u_seen_V=round(u_seen, fine_V),
        error_L_min=round(float(np.abs(misses).max()), fine_L_min),
    )


def _samples(branch: Branch, leak: float) -> RecordedSamples:
    """Return a few samples of a branch, as recorded; the leak (m³/s) is in them."""
    kept = evenly_spaced(branch.u)
    u, q = branch.u[kept], (branch.q[kept] + leak) / L_MIN
    fine_V, fine_L_min = (decimals_of(float(np.abs(values).max())) for values in (u, q))
    return RecordedSamples(
        u_V=tuple(round(value, fine_V) for value in u.tolist()),
        q_L_min=tuple(round(value, fine_L_min) + 0.0 for value in q.tolist()),
    )


def evenly_spaced(u: np.ndarray, count: int = MOST_SAMPLES) -> np.ndarray:
    """Return which samples (N,) of a command stand nearest to equal steps over its range, rising; each once."""
    order = np.argsort(u, kind="stable")
    rising = u[order]
    steps = np.linspace(rising[0], rising[-1], min(count, u.size))
    after = np.clip(np.searchsorted(rising, steps), 1, max(u.size - 1, 1)) if u.size > 1 else np.zeros(1, dtype=int)
    nearest = after - (steps - rising[after - 1] < rising[np.minimum(after, u.size - 1)] - steps)
    chosen: np.ndarray = order[np.unique(np.clip(nearest, 0, u.size - 1))]
    return chosen


def decimals_of(largest: float) -> int:
    """Return the decimals that leave a quantity so many digits as a recording tells, and a few more."""
    return min(max(DIGITS - math.ceil(math.log10(largest)), 0), DECIMALS)


def fewest_points(u: np.ndarray, q: np.ndarray, tolerance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return at which bins the points stand, and the flow there: least squares, halved until the lines fit.

    `tolerance` is that of each bin.
    """
    # Of neighbouring bins on a straight line the second difference is noise alone, of six times its variance.
    noise = robust_sigma(np.diff(q, 2)) / math.sqrt(6) if q.size > 2 else 0.0
    allowed = np.maximum(tolerance, NOISE_ERRORS * noise / math.sqrt(AVERAGED))
    at = np.unique(np.linspace(0, u.size - 1, min(9, u.size)).round().astype(int))
    while True:
        flows = _least_squares(u, q, at)
        misses = np.abs(_averaged(q - np.interp(u, u[at], flows))) / allowed
        wide = np.diff(at) > 1
        worst = np.maximum.reduceat(misses, at[:-1])
        halved = np.flatnonzero(wide & (worst > 1))
        room = MOST_POINTS - at.size
        if not halved.size or room <= 0:
            return at, flows
        halved = halved[np.argsort(-worst[halved], kind="stable")[:room]]
        at = np.sort(np.concatenate([at, (at[halved] + at[halved + 1]) // 2]))


def _least_squares(u: np.ndarray, q: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the flows at the points whose straight lines come nearest to the flow of all bins."""
    starts, stretches = at[:-1], at.size - 1
    segment = np.repeat(np.arange(stretches), np.diff(np.append(starts, u.size)))
    left = u[starts]
    share = (u - left[segment]) / (u[at[1:]] - left)[segment]
    before = 1 - share
    # Each bin bears on the two points beside it: sums over the bins of a stretch.
    own, other, both = (np.add.reduceat(each, starts) for each in (before * before, share * share, share * before))
    normal = np.diag(np.append(own, 0.0) + np.append(0.0, other)) + np.diag(both, 1) + np.diag(both, -1)
    wanted = np.append(np.add.reduceat(before * q, starts), 0.0)
    wanted[1:] += np.add.reduceat(share * q, starts)
    return np.linalg.solve(normal, wanted)


def _averaged(values: np.ndarray) -> np.ndarray:
    """Return means over `AVERAGED` neighbouring bins, at the middle one; of fewer bins the mean of all."""
    if values.size < AVERAGED:
        return np.full(values.size, values.mean())
    inner = np.convolve(values, np.full(AVERAGED, 1 / AVERAGED), mode="valid")
    return np.pad(inner, AVERAGED // 2, mode="edge")


def _first_seen(u: np.ndarray, q: np.ndarray, level: float) -> float:
    """Return the command beyond which the flow stays at the level or above; the first where it always does."""
    below = np.flatnonzero(q < level)
    if not below.size:
        return float(u[0])
    last = int(below[-1])
    if last + 1 == u.size:
        return float(u[-1])
    return float(np.interp(level, q[last : last + 2], u[last : last + 2]))
