"""The course of the flow over the command, smoothed: where it crosses a level, and what it is at full command."""

from collections.abc import Sequence

import numpy as np

from dzdesign.identify.ramps.branches import Branch, bin_index, median

#: Share of the command's range, from the top, over which the largest flow is read.
TOP = 0.05
#: Points off that line by more than so many robust standard deviations, and this share of the flow, are left out.
TOP_GATE, SMALLEST_MISS = 6.0, 0.05
#: A step between two points of a profile is a hole, rows that are missing, beyond so many usual steps, and this share
#: of u_max.
USUAL_STEPS, SMALLEST_HOLE = 4.0, 2e-3
#: Steps as wide as holes, of half of the range together, are those of levels if there are so many.
FEWEST_LEVELS = 8
#: A profile of fewer points has one a level, as a staircase test gives.
FEWEST_OF_RAMP = 200


def smooth_profile(u: np.ndarray, y: np.ndarray, u_max: float) -> tuple[np.ndarray, np.ndarray]:
    """Return command and flow averaged over bins of u and freed of single spikes (medians of five bins)."""
    index, n = bin_index(u, u_max)
    u_mean = np.bincount(index, weights=u) / n
    y_mean = np.bincount(index, weights=y) / n
    if n.size < FEWEST_OF_RAMP:  # nothing to smooth over
        return u_mean, y_mean
    padded = np.pad(y_mean, 2, mode="edge")
    return u_mean, np.partition(np.lib.stride_tricks.sliding_window_view(padded, 5), 2, axis=1)[:, 2]


def crossing(u: np.ndarray, y: np.ndarray, level: float) -> float:
    """Return the command that best parts the profile below `level` from that above it (linear between its points).

    Fewest points are on the wrong side of it, so a few drop-outs far above it do not move it.
    """
    # Of points on the wrong side, each above `level` before the command counts one up, each below it one down.
    wrong = np.cumsum(np.where(y < level, -1, 1))
    last = u.size - 1 - int(np.argmin(wrong[::-1]))
    if wrong[last] > 0:
        return float(u[0])
    if last + 1 == u.size:
        return float(u[-1])
    share = (level - y[last]) / (y[last + 1] - y[last])
    return float(u[last] + share * (u[last + 1] - u[last]))


def hole_within(u: np.ndarray, low: float, high: float, u_max: float) -> tuple[float, float] | None:
    """Return the widest stretch without samples that shares a command with [low, high], or None; V.

    The commands of a profile rise. Where all steps are wide, as of a staircase, none is a hole: not even if the levels
    of its ramps, brought together, lie side by side.
    """
    steps = np.diff(u)
    if not steps.size:
        return None
    coarse = steps[steps > SMALLEST_HOLE * u_max]
    levels = coarse.size >= FEWEST_LEVELS and coarse.sum() > 0.5 * np.ptp(u)
    wide = steps > max(USUAL_STEPS * median(coarse if levels else steps), SMALLEST_HOLE * u_max)
    here = np.flatnonzero(wide & (u[:-1] <= high) & (u[1:] >= low))
    if not here.size:
        return None
    at = here[np.argmax(steps[here])]
    return float(u[at]), float(u[at + 1])


def largest_flow(branches: Sequence[Branch | None], u_max: float) -> float:
    """Return the largest flow of a test as recorded, m³/s; see `largest_at_top`."""
    return largest_at_top([smooth_profile(branch.u, branch.q, u_max) for branch in branches if branch])


def largest_at_top(profiles: Sequence[tuple[np.ndarray, np.ndarray]]) -> float:
    """Return the largest flow of profiles, the rising branch's first, m³/s: that of those that `read_at_top`."""
    return max(flow_at_top(*profile) for profile in profiles[: read_at_top(profiles[0][0].size)])


def read_at_top(points: int) -> int | None:
    """Return how many branches, the rising one first, tell the largest flow; None: each. `points` are the first's.

    A falling ramp begins with a stretch as flat as the hysteresis is wide: a line through its top reads more than
    flowed. A staircase has none, but its rising branch ends in a step that the meter may still follow.
    """
    return 1 if points >= FEWEST_OF_RAMP else None


def flow_at_top(u_profile: np.ndarray, y_profile: np.ndarray) -> float:
    """Return the flow at the largest command: the line through the top `TOP` of its range, read at the end.

    Points that lie off the others' line are left out: a run of drop-outs is as long as a bin or two.
    """
    top = u_profile >= u_profile[-1] - TOP * np.ptp(u_profile)
    u, y = u_profile[top], y_profile[top]
    if u.size < 5:
        return median(y)
    # First a line that a quarter of the points can't move, by the medians of the slopes over half of the range.
    half = u.size // 2
    rough = median((y[half:] - y[: u.size - half]) / (u[half:] - u[: u.size - half]))
    miss = y - rough * u
    miss = np.abs(miss - median(miss))
    kept = miss <= max(TOP_GATE * 1.4826 * median(miss), SMALLEST_MISS * median(y))
    u, y = u[kept], y[kept]
    u_mean, y_mean = u.mean(), y.mean()
    slope = np.sum((u - u_mean) * (y - y_mean)) / np.sum((u - u_mean) ** 2)
    return float(y_mean + slope * (u_profile[-1] - u_mean))
