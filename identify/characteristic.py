"""What one branch shows of the valve's characteristic: plateau, knee, first flow seen, noise."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.branches import BIN_WIDTH, Bins, Branch, bin_branch
from dzdesign.identify.noise import Roughness, colour_factor, measure_roughness

#: Share of the command's range, from the top, over which the largest flow is read.
TOP = 0.05
#: A sample further than this many robust standard deviations from the line is an outlier.
GATE = 6.0
#: Noise below this share of the largest flow is not believed: no meter is that fine.
FINEST_NOISE = 1e-5
#: Blocks into which the residuals in time order are cut, to see how coloured the noise is.
BLOCKS = 16
#: Flow below this share of the largest is no useful flow, however fine the meter.
USEFUL_FLOW = 0.005
#: Standard deviations of a shut reading above which a single reading is flow.
NOISE_LEVEL = 3.0
#: The tail runs from the first flow seen to this multiple of it.
TAIL = 3.0
#: Fewest samples in the tail for a line.
TAIL_SAMPLES = 12
#: Fewest levels of the command in the tail for a line: the steps of a staircase may put all of it at one.
TAIL_LEVELS = 3
#: Upper ends to which the window is widened while the characteristic goes on straight, over the largest flow.
WIDER = (0.65, 0.8, 0.9, 1.0)
#: The window may reach down to this multiple of the first flow that counts: nearer to a floor readings are cut off.
ABOVE_LEVEL = 1.5
#: Standard errors by which the zero of a wider window's line may depart from a narrower one's.
STRAIGHT = 2.5
#: Share of u_max beyond which no departure is put down to noise: slow noise and a slight bend look alike.
LARGEST_SHIFT = 2e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class BranchShape:
    """One branch of one ramp test, described.

    Attributes
    ----------
    rising : bool
        Direction of the command.
    bins : Bins
        Sufficient statistics of the knee window, outliers left out (V, m³/s at the nominal pressure drop).
    y_max : float
        Largest flow at the nominal pressure drop, m³/s.
    slope, knee : float
        Start values: the straight line over the knee window, m³/(s V), and its zero, V.
    sigma : float
        Robust standard deviation of one sample about the line, m³/s.
    colour : float
        Long-run variance over variance of one sample (1 for white noise, more for coloured noise or a bent line).
    window : tuple of float
        Flows between which the characteristic was found straight, over the largest flow.
    roughness : Roughness
        Of the residuals in the window, which tells how slow the noise is.
    level : float
        Flow that counts as flow, m³/s: the meter's floor, its noise or `USEFUL_FLOW`, whichever is largest.
    onset, onset_se, onset_slope : float
        Zero of the straight line through the tail, V, its standard error, and the line's slope, m³/(s V).
    saturates : bool
        True if the flow at full command lies clearly below the straight line.
    outliers : int
        Samples gated out of the window.
    """

    rising: bool
    bins: Bins
    y_max: float
    slope: float
    knee: float
    sigma: float
    colour: float
    window: tuple[float, float]
    roughness: Roughness
    level: float
    onset: float
    onset_se: float
    onset_slope: float
    saturates: bool
    outliers: int


def smooth_profile(u: np.ndarray, y: np.ndarray, u_max: float) -> tuple[np.ndarray, np.ndarray]:
    """Return command and flow averaged over bins of u and freed of single spikes (medians of five bins)."""
    used, index = np.unique(np.floor(u / (BIN_WIDTH * u_max)).astype(int), return_inverse=True)
    n = np.bincount(index, minlength=used.size)
    u_mean = np.bincount(index, weights=u) / n
    y_mean = np.bincount(index, weights=y) / n
    if used.size < 200:  # one level a step, as a staircase test gives: nothing to smooth over
        return u_mean, y_mean
    padded = np.pad(y_mean, 2, mode="edge")
    return u_mean, np.median(np.lib.stride_tricks.sliding_window_view(padded, 5), axis=1)


def crossing(u: np.ndarray, y: np.ndarray, level: float) -> float:
    """Return the command above which the profile stays at or above `level` (linear between its points)."""
    below = np.flatnonzero(y < level)
    if below.size == 0:
        return float(u[0])
    last = int(below[-1])
    if last + 1 == u.size:
        return float(u[-1])
    share = (level - y[last]) / (y[last + 1] - y[last])
    return float(u[last] + share * (u[last + 1] - u[last]))


def flow_at_top(u_profile: np.ndarray, y_profile: np.ndarray) -> float:
    """Return the flow at the largest command: the line through the top `TOP` of its range, read at the end."""
    top = u_profile >= u_profile[-1] - TOP * np.ptp(u_profile)
    u, y = u_profile[top], y_profile[top]
    if u.size < 5:
        return float(np.median(y))
    slope = np.sum((u - u.mean()) * (y - y.mean())) / np.sum((u - u.mean()) ** 2)
    return float(y.mean() + slope * (u_profile[-1] - u.mean()))


def find_meter_floor(u: np.ndarray, q: np.ndarray, u_max: float) -> float:
    """Return the flow at which the meter wakes up, m³/s, or 0 if it shows no floor.

    A meter with a floor reads (about) zero, then jumps: between its noise and its floor there are next to no
    readings, although the ramp sweeps those flows at the same pace as the flows above.
    """
    u_profile, q_profile = smooth_profile(u, q, u_max)
    q_max = flow_at_top(u_profile, q_profile)
    start, half = (crossing(u_profile, q_profile, share * q_max) for share in (0.12, 0.5))
    straight = int(np.sum((u >= start) & (u <= half)))
    density = straight / (0.38 * q_max)  # readings per unit of flow where the valve is known to open smoothly
    shut = q[u < 0.5 * start]
    if shut.size < 5 or straight < 100 or u_profile.size < 200:  # a staircase skips flows, whatever the meter
        return 0.0
    noise = 1.4826 * float(np.median(np.abs(shut - np.median(shut))))
    lowest = max(3 * noise, 1e-3 * q_max)
    # Near the opening only: far below it, thousands of shut readings would put some of their noise into the gap.
    # It reaches down to where the profile leaves the noise, or a soft edge's small flows would be cut off and missed.
    near = u > min(start - 0.5 * (half - start), crossing(u_profile, q_profile, lowest))
    readings = np.sort(q[near & (q > lowest) & (q < 0.5 * q_max)])
    expected = density * (readings - lowest)
    gap = np.flatnonzero((np.arange(readings.size) < 0.1 * expected) & (expected > 20))
    return float(readings[gap[-1]]) if gap.size else 0.0


def _line(u: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return slope and zero of the least-squares line."""
    centre = u.mean()
    slope = float(np.sum((u - centre) * (y - y.mean())) / np.sum((u - centre) ** 2))
    return slope, float(centre - y.mean() / slope)


def _without_outliers(u: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples within `GATE` robust standard deviations of their line, in three rounds."""
    kept = np.ones(u.size, dtype=bool)
    for _ in range(3):
        slope, zero = _line(u[kept], y[kept])
        residual = y - slope * (u - zero)
        sigma = 1.4826 * float(np.median(np.abs(residual - np.median(residual))))
        inside = np.abs(residual - np.median(residual)) <= GATE * sigma
        if inside.sum() < TAIL_SAMPLES or np.ptp(u[inside]) == 0:
            break
        kept = inside
    return u[kept], y[kept]


def _colour(residual: np.ndarray, sigma: float) -> float:
    """Return the long-run variance factor from the means of `BLOCKS` blocks in time order."""
    blocks = np.array_split(residual, min(BLOCKS, residual.size // 2))
    if len(blocks) < 4:
        return 1.0
    spread = sum(block.size * block.mean() ** 2 for block in blocks) / (len(blocks) - 2)
    return max(1.0, spread / sigma**2)


def _refuse_no_line(u: np.ndarray, window: tuple[float, float], floor: float, source: str) -> None:
    """Refuse samples that hold no straight line: too few above the meter's floor, or all at one command."""
    levels = np.unique(u).size
    if u.size < 5 or levels < 2:
        raise InputError(
            f"'{source}': {u.size} samples at {levels} levels of the command lie between {window[0]:.0%} and "
            f"{window[1]:.0%} of the largest flow and above half the meter's floor of {floor * 6e4:.3g} L/min, "
            "expected at least 5 at 2 levels; record a slower ramp or more levels, or correct --meter-floor"
        )


def describe_branch(
    branch: Branch,
    y: np.ndarray,
    *,
    u_max: float,
    floor: float,
    window: tuple[float, float],
    source: str,
    correlation: float = 0.0,
) -> BranchShape:
    """Describe one branch: where the straight part lies, its line, its noise, and the tail below it.

    Parameters
    ----------
    branch : Branch
        Samples, command in V.
    y : (N,) array
        Flow brought to the nominal pressure drop, m³/s.
    u_max : float
        Full command, V.
    floor : float
        Meter floor, m³/s.
    window : tuple of float
        Shares of the largest flow between which the characteristic is taken as straight.
    source : str
        File name for messages.
    correlation : float
        Of the noise in neighbouring samples.

    Raises
    ------
    InputError
        If the window holds too few samples for a line.
    """
    profile = smooth_profile(branch.u, y, u_max)
    y_max = flow_at_top(*profile)
    fit = partial(_gated_line, branch, y, profile, y_max=y_max, floor=floor, source=source, correlation=correlation)
    narrow = fit(window)
    noise = _quiet_noise(branch, y, narrow.knee)
    level = max(floor, USEFUL_FLOW * y_max, NOISE_LEVEL * noise)
    line = _widest_straight(fit, narrow, lowest=ABOVE_LEVEL * level / y_max, largest_shift=LARGEST_SHIFT * u_max)
    onset, onset_se, onset_slope = _tail_onset(branch.u, y, profile, level, line.slope, noise, correlation)
    return BranchShape(
        rising=branch.rising,
        bins=bin_branch(branch.u[line.kept], y[line.kept], line.censored[line.kept], u_max),
        y_max=y_max,
        slope=line.slope,
        knee=line.knee,
        sigma=line.sigma,
        colour=line.colour,
        window=line.window,
        roughness=line.roughness,
        level=level,
        onset=onset,
        onset_se=onset_se,
        onset_slope=onset_slope,
        saturates=y_max < 0.93 * line.slope * (branch.u.max() - line.knee),
        outliers=line.outliers,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _GatedLine:
    """Straight line through the samples between two flows, outliers left out; arrays are over the whole branch."""

    window: tuple[float, float]
    slope: float
    knee: float
    knee_se: float
    sigma: float
    colour: float
    kept: np.ndarray
    censored: np.ndarray
    roughness: Roughness
    outliers: int


def _gated_line(
    branch: Branch,
    y: np.ndarray,
    profile: tuple[np.ndarray, np.ndarray],
    window: tuple[float, float],
    *,
    y_max: float,
    floor: float,
    source: str,
    correlation: float,
) -> _GatedLine:
    """Fit a line to the samples between two shares of the largest flow; refuse where there is none."""
    u_low, u_high = (crossing(*profile, share * y_max) for share in window)
    inside = (branch.u >= u_low) & (branch.u <= u_high)
    if inside.sum() < 5 or not u_high > u_low:
        raise InputError(
            f"'{source}': only {inside.sum()} samples lie between {window[0]:.0%} and {window[1]:.0%} of the largest "
            "flow, expected at least 5; record a slower ramp or more levels"
        )
    censored = inside & (branch.q < 0.5 * floor)
    seen = inside & ~censored
    _refuse_no_line(branch.u[seen], window, floor, source)
    slope, knee = _line(branch.u[seen], y[seen])
    for _ in range(3):
        miss = y - slope * (branch.u - knee)
        sigma = max(1.4826 * float(np.median(np.abs(miss[inside & ~censored]))), FINEST_NOISE * y_max)
        # A zero reading is a censored sample only where flow below the floor is credible.
        credible = slope * (branch.u - knee) < floor + GATE * sigma
        kept = inside & np.where(censored, credible, np.abs(miss) < GATE * sigma)
        seen = kept & ~censored
        _refuse_no_line(branch.u[seen], window, floor, source)
        slope, knee = _line(branch.u[seen], y[seen])
    u_seen = branch.u[seen]
    residual = y[seen] - slope * (u_seen - knee)
    sigma = max(float(np.sqrt(np.sum(residual**2) / max(u_seen.size - 2, 1))), FINEST_NOISE * y_max)
    lever = 1 / u_seen.size + (u_seen.mean() - knee) ** 2 / np.sum((u_seen - u_seen.mean()) ** 2)
    roughness = measure_roughness(u_seen, residual)
    colour = max(_colour(residual, sigma), colour_factor(correlation, roughness, sigma))
    return _GatedLine(
        window=window,
        slope=slope,
        knee=knee,
        knee_se=sigma * math.sqrt(lever * colour) / slope,
        sigma=sigma,
        colour=colour,
        kept=kept,
        censored=censored,
        roughness=roughness,
        outliers=int((inside & ~kept).sum()),
    )


def _widest_straight(
    fit: Callable[[tuple[float, float]], _GatedLine], narrow: _GatedLine, *, lowest: float, largest_shift: float
) -> _GatedLine:
    """Widen the window, upwards and then down to `lowest`, as long as the line's zero stays where it was.

    On a straight characteristic more samples make the zero up to three times sharper; on a bent one they would move
    it. A wider window is taken while its zero departs from that of every narrower one by no more than `STRAIGHT`
    standard errors of the difference (for least squares on nested samples, the difference of their variances), and by
    no more than `largest_shift`.
    """
    accepted = [narrow]

    def agrees(wider: _GatedLine) -> bool:
        return all(
            abs(wider.knee - line.knee)
            <= min(
                STRAIGHT * max(math.sqrt(max(line.knee_se**2 - wider.knee_se**2, 0.0)), 0.1 * line.knee_se),
                largest_shift,
            )
            for line in accepted
        )

    for high in WIDER:
        if high > accepted[-1].window[1]:
            wider = fit((narrow.window[0], high))
            if not agrees(wider):
                break
            accepted.append(wider)
    if lowest < narrow.window[0]:
        wider = fit((lowest, accepted[-1].window[1]))
        if agrees(wider):
            accepted.append(wider)
    return accepted[-1]


def _quiet_noise(branch: Branch, y: np.ndarray, knee: float) -> float:
    """Return the robust standard deviation of a reading while the valve is shut (u below half the knee), m³/s."""
    shut = y[branch.u < 0.5 * knee]
    return 1.4826 * float(np.median(np.abs(shut - np.median(shut)))) if shut.size >= 5 else 0.0


def _tail_onset(
    u: np.ndarray,
    y: np.ndarray,
    profile: tuple[np.ndarray, np.ndarray],
    level: float,
    slope: float,
    noise: float,
    correlation: float,
) -> tuple[float, float, float]:
    """Extrapolate the first flow seen to zero: the valve opens (or closes) no later than this, as far as can be seen.

    A soft edge passes flow below the knee. What the meter sees of it is the tail from `level` to `TAIL` times it; the
    line through the tail crosses zero at or below the knee's. What happens below `level` stays hidden.

    Returns
    -------
    tuple of float
        The zero and its standard error, V; the tail's slope, m³/(s V).
    """
    first, last = crossing(*profile, level), crossing(*profile, TAIL * level)
    tail = (u >= first) & (u <= last) & (y > 0.5 * level)
    if tail.sum() >= TAIL_SAMPLES and np.unique(u[tail]).size >= TAIL_LEVELS:
        u_tail, y_tail = _without_outliers(u[tail], y[tail])
        tail_slope, onset = _line(u_tail, y_tail)
        if tail_slope > 0.1 * slope:  # else a notch or a leak: no line, so the chord below
            residual = y_tail - tail_slope * (u_tail - onset)
            sigma = math.sqrt(np.sum(residual**2) / (u_tail.size - 2))
            lever = 1 / u_tail.size + (u_tail.mean() - onset) ** 2 / np.sum((u_tail - u_tail.mean()) ** 2)
            roughness = measure_roughness(u_tail, residual)
            colour = max(_colour(residual, max(sigma, 1e-12)), colour_factor(correlation, roughness, sigma))
            return onset, sigma * math.sqrt(lever * colour) / tail_slope, tail_slope
    # Too few samples for a line, as in a staircase test: the chord, its ends known to one level of the command.
    at = int(np.clip(np.searchsorted(profile[0], first), 1, profile[0].size - 1))
    gap = float(profile[0][at] - profile[0][at - 1])
    width = max(last - first, gap)
    chord = (TAIL - 1) * level / width
    return first - level / chord, gap + noise / chord, chord
