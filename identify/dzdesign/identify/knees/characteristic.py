"""What the branches show of the valve's characteristic: plateau, knee, first flow seen, noise."""

import math
from collections.abc import Sequence

import numpy as np

from dzdesign.identify.knees.branch_shape import BranchShape, Tail
from dzdesign.identify.knees.dead_zone import look_into_dead_zone
from dzdesign.identify.knees.gated_line import GATE, GatedLine, PreparedBranch, fit_line
from dzdesign.identify.knees.line_fitting import inflation_by_blocks
from dzdesign.identify.knees.linear_region import StraightParts, find_straight_parts
from dzdesign.identify.knees.noise import measure_roughness, robust_sigma, variance_inflation
from dzdesign.identify.knees.profile import crossing, hole_within
from dzdesign.identify.knees.spool_ripple import spool_ripples
from dzdesign.identify.ramps.medians import median

#: Standard deviations of a shut reading above which the mean of a bin is flow.
FIRST_SEEN = 5.0
#: The tail runs from the first flow seen to this multiple of it.
TAIL = 3.0
#: Fewest samples in the tail for a line.
TAIL_SAMPLES = 12
#: Fewest levels of the command in the tail for a line: the steps of a staircase may put all of it at one.
TAIL_LEVELS = 3
#: Rounds in which censored samples of the tail are filled in and its line laid: each leaves a third of the error.
TAIL_ROUNDS = 8


def describe_branches(
    reads: Sequence[PreparedBranch],
    *,
    u_max: float,
    window: tuple[float, float],
    noise_level: float | None = None,
    longest_lag: float = 0.0,
) -> list[BranchShape]:
    """Describe all branches of a valve: where the straight part lies, its line, its noise, and the tail below it.

    One meter has read them all, so they tell its noise together, and its lag, s, is at most `longest_lag`; `window`,
    `noise_level` and errors are those of `find_straight_parts`.
    """
    parts = find_straight_parts(reads, u_max=u_max, window=window, noise_level=noise_level)
    ripples = spool_ripples(reads, parts.lines, u_max)
    return [
        _describe(parts, index, read, ripple, longest_lag, u_max)
        for index, (read, ripple) in enumerate(zip(reads, ripples, strict=True))
    ]


def _describe(
    parts: StraightParts, index: int, read: PreparedBranch, ripple: float, longest_lag: float, u_max: float
) -> BranchShape:
    line, level, noise = parts.lines[index], parts.levels[index], parts.noises[index]
    branch = read.branch
    dead_zone = look_into_dead_zone(
        read,
        line,
        least=parts.least[index],
        level=level,
        noise=noise,
        correlation=parts.correlation,
        shift=longest_lag * branch.rate if math.isfinite(branch.rate) else 0.0,
        u_max=u_max,
    )
    tail = _find_tail(read, level, line, noise, parts.correlation, u_max)
    onset, onset_se = _find_onset(read, tail, level, noise)
    if dead_zone.depth > 0:  # averages show what no reading does
        onset = min(onset, line.knee - dead_zone.depth)
    return BranchShape(
        prepared=read,
        line=line,
        y_max=read.y_max,
        slope=line.slope,
        knee=line.knee,
        knee_of_window=parts.narrow[index].knee,
        sigma=line.sigma,
        variance_inflation=line.variance_inflation,
        outliers=line.outliers,
        noise=noise,
        level=level,
        dead_zone=dead_zone,
        tail=tail,
        onset=onset,
        onset_se=onset_se,
        ripple=ripple,
        saturates=read.y_max < 0.93 * line.slope * (branch.u.max() - line.knee),
    )


def _without_outliers(u: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples within `GATE` robust standard deviations of their line, in three rounds."""
    kept = np.ones(u.size, dtype=bool)
    for _ in range(3):
        slope, zero = fit_line(u[kept], y[kept])
        residual = y - slope * (u - zero)
        sigma = robust_sigma(residual)
        inside = np.abs(residual - median(residual)) <= GATE * sigma
        if inside.sum() < TAIL_SAMPLES or np.ptp(u[inside]) == 0:
            break
        kept = inside
    return u[kept], y[kept]


def _with_censored(
    u: np.ndarray, y: np.ndarray, u_cut: np.ndarray, floor: float, sigma: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples of a tail and, for those that read below the floor, what they would have read on average.

    Left out, they would lift the line's lower end, where only the noise's upper half is seen, and every sharp edge
    would look a little soft. Expectation and maximisation take turns (a Tobit line); where flow below the floor is not
    credible, a zero is a drop-out.
    """
    slope, zero = fit_line(u, y)
    if not u_cut.size or not slope > 0:
        return u, y
    from scipy.special import erfcx

    for _ in range(TAIL_ROUNDS):
        line = slope * (u_cut - zero)
        credible = line < floor + GATE * sigma
        below = (line[credible] - floor) / (math.sqrt(2) * sigma)
        # The mean of a normal law cut off above: mu - sigma phi/Phi, by the scaled error function exact far below too.
        filled = line[credible] - sigma * math.sqrt(2 / math.pi) / erfcx(below)
        u_all, y_all = np.concatenate([u, u_cut[credible]]), np.concatenate([y, filled])
        slope, zero = fit_line(u_all, y_all)
        if not slope > 0:
            return u, y
    return u_all, y_all


def _find_onset(read: PreparedBranch, tail: Tail, level: float, noise: float) -> tuple[float, float]:
    """Return where flow starts and the standard error, V: the first flow seen, or the tail's zero if that is lower.

    Of a noisy meter the first flow seen comes late, and the tail tells more; a quiet one shows flows far too small to
    count, below the tail. Of a meter whose noise is not seen, as in a table, nothing less than what counts is flow.
    """
    least = max(read.floor, FIRST_SEEN * noise) if noise > 0 else level
    u, y = read.profile
    first = crossing(u, y, least)
    if first >= tail.zero:
        return tail.zero, tail.zero_se
    at = int(np.clip(np.searchsorted(u, first), 1, u.size - 1))
    return first, float(u[at] - u[at - 1])


def _find_tail(
    read: PreparedBranch, level: float, line: GatedLine, noise: float, correlation: float, u_max: float
) -> Tail:
    """Extrapolate the first flow seen to zero: the valve opens (or closes) no later than this, as far as can be seen.

    A soft edge passes flow below the knee. What the meter sees of it is the tail from `level` to `TAIL` times it; the
    line through the tail crosses zero at or below the knee's. What happens below `level` stays hidden.
    """
    u, profile = read.branch.u, read.profile
    first, last = crossing(*profile, level), crossing(*profile, TAIL * level)
    hole = hole_within(profile[0], first, first, u_max)
    if hole:
        # What lies above the missing rows may be straight, and its zero far above a soft edge that nobody recorded: the
        # valve opens no sooner than at their lower end.
        return Tail(hole[0], float(np.median(np.diff(profile[0]))), level / (hole[1] - hole[0]), hole)
    tail = (u >= first) & (u <= last)
    seen = tail & (read.branch.q >= 0.5 * read.floor)
    if seen.sum() >= TAIL_SAMPLES and np.unique(u[seen]).size >= TAIL_LEVELS:
        u_tail, y_tail = _without_outliers(u[seen], read.y[seen])
        u_tail, y_tail = _with_censored(u_tail, y_tail, u[tail & ~seen], read.floor, line.sigma)
        tail_slope, onset = fit_line(u_tail, y_tail)
        if tail_slope > 0.1 * line.slope:  # else a notch or a leak: no line, so the chord below
            residual = y_tail - tail_slope * (u_tail - onset)
            sigma = math.sqrt(np.sum(residual**2) / (u_tail.size - 2))
            sigma = sigma if seen.sum() == tail.sum() else max(sigma, line.sigma)  # what was filled in does not scatter
            roughness = measure_roughness(u_tail, residual)
            by_blocks = inflation_by_blocks(residual, max(sigma, 1e-12))
            inflation = max(by_blocks, variance_inflation(correlation, roughness, sigma))
            spread = np.sum((u_tail - u_tail.mean()) ** 2)
            lever = 1 / u_tail.size + (u_tail.mean() - onset) ** 2 / spread
            return Tail(onset, sigma * math.sqrt(lever * inflation) / tail_slope, tail_slope)
    # Too few samples for a line, as in a staircase test: the chord, its ends known to one level of the command.
    at = int(np.clip(np.searchsorted(profile[0], first), 1, profile[0].size - 1))
    gap = float(profile[0][at] - profile[0][at - 1])
    width = max(last - first, gap)
    chord = (TAIL - 1) * level / width
    error = gap + noise / chord
    # At the level before, less flows than counts, so the zero is not below it.
    return Tail(max(first - level / chord, float(profile[0][at - 1])), error, chord)
