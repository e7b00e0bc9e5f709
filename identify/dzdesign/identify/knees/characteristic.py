"""What the branches show of the valve's characteristic: plateau, knee, first flow seen, noise."""

import math
from collections.abc import Sequence

import numpy as np

from dzdesign.identify.knees.gated_line import (
    GATE,
    BranchShape,
    DeadZone,
    GatedLine,
    PreparedBranch,
    Tail,
    straight_line,
)
from dzdesign.identify.knees.line_fitting import inflation_by_blocks
from dzdesign.identify.knees.linear_region import StraightParts, find_straight_parts
from dzdesign.identify.knees.noise import measure_roughness, robust_sigma, variance_inflation
from dzdesign.identify.knees.profile import crossing, hole_within
from dzdesign.identify.knees.spool_ripple import spool_ripples
from dzdesign.identify.ramps.branches import median

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
#: Stretches of command over which readings are averaged, over u_max, and by how much of itself each is moved on: the
#: longest sees the smallest flows, the shorter ones the steeper edges. One of them says the noise level.
STRETCHES, STEP, OF_THE_LEVEL = (0.03, 0.015, 0.0075), 0.25, 0.015
#: Standard errors of such an average that the noise level has, and share of the noise level from which an average is
#: flow: noise feigns flow in one stretch of 6000, and a flow of the noise level is missed in one of 120.
RESOLVED, SEEN = 6.0, 0.6
#: Commands that tell what the meter reads while the valve is shut: from this share of u_max to this of the knee.
SHUT_FROM, SHUT_TO = 0.01, 0.4
#: Fewest readings of an average, and standard errors of the knee, and shifts by the meter's lag, that the uppermost
#: stretch keeps off it.
FEWEST, OFF_THE_KNEE = 10, 2.0


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
        slope, zero = straight_line(u[kept], y[kept])
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
    slope, zero = straight_line(u, y)
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
        slope, zero = straight_line(u_all, y_all)
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
        tail_slope, onset = straight_line(u_tail, y_tail)
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


def look_into_dead_zone(
    read: PreparedBranch,
    line: GatedLine,
    *,
    least: float,
    level: float,
    noise: float,
    correlation: float,
    shift: float,
    u_max: float,
) -> DeadZone:
    """Average the readings below the knee.

    Parameters
    ----------
    read, line : PreparedBranch, GatedLine
        The branch and its straight part.
    least : float
        Flow that counts as no flow whatever the noise (the meter's floor, no useful flow), m³/s.
    level : float
        Flow from which a single reading is flow, m³/s: the noise level where averages tell nothing.
    noise : float
        Standard deviation of a reading while the valve is shut, m³/s.
    correlation : float
        Of the noise of neighbouring samples.
    shift : float
        What the meter's lag shifts the flow by at most, V: so near to the knee a filter rounds any edge.
    u_max : float
        Full command, V.
    """
    u, y = read.branch.u, read.y
    order = np.argsort(u, kind="stable")
    u, y = u[order], y[order]
    shut = y[slice(*np.searchsorted(u, [SHUT_FROM * u_max, SHUT_TO * line.knee]))]
    top = line.knee - OFF_THE_KNEE * (line.knee_se + shift)
    highest = _stretch(u, top, OF_THE_LEVEL * u_max)
    if min(shut.size, np.ptp(highest)) < FEWEST:
        return DeadZone(level, 0.0)
    ramps = max(len(read.branch.counts), 1)

    def error(rows: tuple[int, int]) -> float:
        # Of two means, each of so many stretches of time that are independent of one another.
        sizes = (shut.size, rows[1] - rows[0])
        return noise * math.sqrt(sum(_long_run(size / ramps, correlation) / size for size in sizes))

    base, depth = _mean(shut, noise), 0.0
    for share in STRETCHES:
        stretch, end = share * u_max, top
        while np.ptp(rows := _stretch(u, end, stretch)) >= FEWEST:
            if _mean(y[slice(*rows)], noise) - base <= SEEN * max(least, RESOLVED * error(rows)):
                break
            end -= STEP * stretch
            # Flow that ends softly is less in the middle of a stretch than on average over it.
            depth = max(depth, line.knee - (end - stretch / 2))
    return DeadZone(max(least, RESOLVED * error(highest)), depth)


def _stretch(u: np.ndarray, end: float, width: float) -> tuple[int, int]:
    """Return from which reading to which the commands, which rise, lie in a stretch that ends at a command."""
    first, last = np.searchsorted(u, [end - width, end])
    return int(first), int(last)


def _long_run(count: float, correlation: float) -> float:
    """Return the variance of the mean of so many readings in a row over what independent ones would leave."""
    return min((1 + correlation) / (1 - correlation), max(count, 1.0))


def _mean(values: np.ndarray, noise: float) -> float:
    """Return the mean of readings, outliers left out."""
    middle = median(values)
    kept = np.abs(values - middle) <= GATE * max(noise, robust_sigma(values))
    return float(values[kept].mean())
