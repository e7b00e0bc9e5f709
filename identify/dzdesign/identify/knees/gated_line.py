"""A straight line through the samples of a branch between two flows, which outliers and drop-outs do not move."""

import math
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.knees.noise import Roughness, measure_roughness, median, variance_inflation
from dzdesign.identify.knees.profile import crossing, flow_at_top, smooth_profile
from dzdesign.identify.ramps.branches import Branch

#: A sample further than this many robust standard deviations from the line is an outlier.
GATE = 6.0
#: Most rounds in which outliers are left out and the line is laid anew: each finds those that the ones before hid.
ROUNDS = 20
#: Logarithm of the probability below which a run of readings below the floor is not the noise's: about one run in ten
#: million, and a branch has a hundred.
UNLIKELY = -16.0
#: Fewest samples for a line through noise; with fewer it goes from level to level.
FEWEST = 5
#: Noise below this share of the largest flow is not believed: no meter is that fine.
FINEST_NOISE = 1e-5
#: Blocks into which the residuals in time order are cut, to see how coloured the noise is.
BLOCKS = 16
#: The inflation by one branch's blocks counts if it is so many times the mean of all: 99.9 % of those of one noise are
#: below it.
STANDS_OUT = 2.6
#: A table's flow that leaves less than `SHUT` of the largest, for more than `JUMPED`, between two levels of the
#: command jumps if it rises so many times faster there than over the next two levels.
SHUT, JUMPED, JUMP = 0.05, 0.15, 3.0


def fit_line(u: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return slope and zero of the least-squares line; a level one has no zero: the middle of its samples."""
    centre, height = float(u.mean()), float(y.mean())
    du = u - centre
    slope = float(du @ (y - height) / (du @ du))
    return slope, centre - height / slope if slope else centre


def inflation_by_blocks(residual: np.ndarray, sigma: float) -> float:
    """Return the long-run variance factor from the means of `BLOCKS` blocks in time order."""
    count = min(BLOCKS, residual.size // 2)
    if count < 4:
        return 1.0
    base, longer = divmod(residual.size, count)
    starts = np.arange(count) * base + np.minimum(np.arange(count), longer)
    sizes = np.diff(starts, append=residual.size)
    spread = float(np.sum(np.add.reduceat(residual, starts) ** 2 / sizes)) / (count - 2)
    return max(1.0, spread / sigma**2)


def _refuse_no_line(u: np.ndarray, window: tuple[float, float], floor: float, source: str) -> None:
    """Refuse samples that hold no straight line: too few above the meter's floor, or all at one command."""
    if u.size < FEWEST or np.ptp(u) == 0:
        raise InputError(
            f"'{source}': {u.size} samples at {np.unique(u).size} levels of the command lie between {window[0]:.0%} "
            f"and {window[1]:.0%} of the largest flow and above half the meter's floor of {floor * 6e4:.3g} L/min, "
            "expected at least 5 at 2 levels; record a slower ramp or more levels, or correct --meter-floor"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PreparedBranch:
    """A branch, ready for lines to be laid through it.

    Attributes
    ----------
    branch : Branch
        Its samples.
    y : (N,) array
        Their flow at the nominal pressure drop, m³/s.
    profile : tuple of (P,) array
        Smoothed course of that flow: command (V), flow (m³/s).
    y_max, floor : float
        Flow at the largest command, and the meter's floor, m³/s.
    source : str
        For messages.
    """

    branch: Branch
    y: np.ndarray
    profile: tuple[np.ndarray, np.ndarray]
    y_max: float
    floor: float
    source: str


def prepare_branch(branch: Branch, y: np.ndarray, *, u_max: float, floor: float, source: str) -> PreparedBranch:
    """Return a branch ready for lines to be laid through it; `floor` in m³/s, `source` for messages."""
    profile = smooth_profile(branch.u, y, u_max)
    return PreparedBranch(branch=branch, y=y, profile=profile, y_max=flow_at_top(*profile), floor=floor, source=source)


@dataclass(frozen=True, slots=True, kw_only=True)
class GatedLine:
    """Straight line through the samples between two flows, outliers left out.

    Attributes
    ----------
    window : tuple of float
        The two flows over the largest.
    slope, knee : float
        Of the line, m³/(s V), and its zero, V.
    lever : float
        Variance of the line's value at its zero, for independent samples of unit variance.
    sigma : float
        Standard deviation of one sample about the line, m³/s.
    block_inflation, variance_inflation : float
        Long-run variance over variance of one sample: as the residuals show it, and with what is known of the noise.
    inside, kept, censored : (N,) bool array
        Samples of the branch between the two flows, those of them that the line rests on, and those of them that read
        below the meter's floor.
    roughness : Roughness
        Of the residuals.
    outliers : int
        Samples gated out.
    dropped : float
        Share of the samples that read below the floor where no flow below it is credible: drop-outs.
    """

    window: tuple[float, float]
    slope: float
    knee: float
    lever: float
    sigma: float
    block_inflation: float
    variance_inflation: float
    inside: np.ndarray
    kept: np.ndarray
    censored: np.ndarray
    roughness: Roughness
    outliers: int
    dropped: float

    @property
    def knee_se(self) -> float:
        """Standard error of the zero, V."""
        return self.sigma * math.sqrt(self.lever * self.variance_inflation) / self.slope

    def with_shared_noise(self, correlation: float, blocks: float) -> "GatedLine":
        """Return the same line with errors for the noise that all branches share.

        Parameters
        ----------
        correlation : float
            Between neighbouring samples.
        blocks : float
            Mean of all branches' `block_inflation`. That of one branch, from few blocks, counts where it stands out of
            the mean: then it has more than noise in it.
        """
        known = variance_inflation(correlation, self.roughness, self.sigma)
        of_this = self.block_inflation if self.block_inflation > STANDS_OUT * blocks else 1.0
        return replace(self, variance_inflation=max(of_this, blocks, known))


def lay_line(read: PreparedBranch, window: tuple[float, float]) -> GatedLine:
    """Lay a line through the samples between two shares of the largest flow.

    Parameters
    ----------
    read : PreparedBranch
    window : tuple of float
        Shares of the largest flow.

    Raises
    ------
    InputError
        Where there are too few samples for a line.
    """
    branch, y, floor = read.branch, read.y, read.floor
    u_low, u_high = (crossing(*read.profile, share * read.y_max) for share in window)
    inside = (branch.u >= u_low) & (branch.u <= u_high)
    if inside.sum() < FEWEST and u_high > u_low:
        chord = _chord(read, window)
        if chord is not None:
            return chord
    if inside.sum() < FEWEST or not u_high > u_low:
        raise InputError(
            f"'{read.source}': only {inside.sum()} samples lie between {window[0]:.0%} and {window[1]:.0%} of the "
            "largest flow, expected at least 5; record a slower ramp or more levels"
        )
    u, y, censored = branch.u[inside], y[inside], branch.q[inside] < 0.5 * floor
    seen = ~censored
    _refuse_no_line(u[seen], window, floor, read.source)
    slope, knee = fit_line(u[seen], y[seen])
    finest = FINEST_NOISE * read.y_max
    kept = np.ones(u.size, dtype=bool)
    for _ in range(ROUNDS):
        line, before = slope * (u - knee), kept
        miss = np.abs(y - line)
        sigma = max(1.4826 * median(miss[~censored]), finest)
        # A zero reading is a censored sample only where flow below the floor is credible.
        kept = np.where(censored, line < floor + GATE * sigma, miss < GATE * sigma)
        if np.array_equal(kept, before):  # the same samples, so the same line
            break
        seen = kept & ~censored
        _refuse_no_line(u[seen], window, floor, read.source)
        slope, knee = fit_line(u[seen], y[seen])
    u_seen = u[seen]
    residual = y[seen] - slope * (u_seen - knee)
    sigma = max(float(np.sqrt(np.sum(residual**2) / max(u_seen.size - 2, 1))), finest)
    kept &= ~_runs_of_drop_outs(censored, (slope * (u - knee) - floor) / sigma, residual)
    by_blocks = inflation_by_blocks(residual, sigma)
    return GatedLine(
        window=window,
        slope=slope,
        knee=knee,
        lever=1 / u_seen.size + (u_seen.mean() - knee) ** 2 / np.sum((u_seen - u_seen.mean()) ** 2),
        sigma=sigma,
        block_inflation=by_blocks,
        variance_inflation=by_blocks,
        inside=inside,
        kept=_among(inside, kept),
        censored=_among(inside, censored),
        roughness=measure_roughness(u_seen, residual),
        outliers=int((~kept).sum()),
        dropped=_share_of_drop_outs(censored, slope * (u - knee) >= floor + GATE * sigma),
    )


def _runs_of_drop_outs(censored: np.ndarray, above: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Return which censored samples belong to a run that noise does not explain: a logger that was busy, a wire.

    A meter with a floor reads nothing where the flow is a little above it, now and then, but not for long. Taken for
    little flow, half a second of lost readings just above the knee lifts it, and the bounds with it.

    Parameters
    ----------
    censored : (N,) bool array
        Samples in the order of time that read below the floor.
    above : (N,) array
        How far the line is above the floor at each, in standard deviations.
    residual : (M,) array
        Of the other samples, which tell how slow the noise is: slow noise explains longer runs.
    """
    edges = np.flatnonzero(np.diff(censored.astype(np.int8), prepend=0, append=0))
    starts, ends = edges[::2], edges[1::2]
    lost = np.zeros(censored.size, dtype=bool)
    if not starts.size or not np.any(above[censored] > 0):
        return lost
    from scipy.special import log_ndtr

    slow = float(np.clip(residual[1:] @ residual[:-1] / max(residual @ residual, 1e-300), 0.0, 1.0))
    news = (1 - slow) / (1 + slow)  # share of a sample that is new, of noise that forgets exponentially
    length = ends - starts
    last = np.cumsum(log_ndtr(-above[censored]))[np.cumsum(length) - 1]
    chance = np.diff(last, prepend=0.0) * (news + (1 - news) / length)
    lost[censored] = np.repeat(chance < UNLIKELY, length)
    return lost


def _share_of_drop_outs(censored: np.ndarray, plain: np.ndarray) -> float:
    return float(censored[plain].mean()) if plain.any() else 0.0


def _among(inside: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return which samples of all are chosen, from which of those inside the window are."""
    among = np.zeros(inside.size, dtype=bool)
    among[inside] = chosen
    return among


def _chord(read: PreparedBranch, window: tuple[float, float]) -> GatedLine | None:
    """Return the line from the last level below a window to the first above it: all that a table of few levels tells.

    The zero is known to one level of the command, and its error is said to be that.
    """
    _refuse_a_jump_between_levels(read)
    u, y = read.profile
    order = np.argsort(u)
    u, y = u[order], y[order]
    above = int(np.searchsorted(u, crossing(u, y, window[0] * read.y_max)))
    beyond = int(np.searchsorted(u, crossing(u, y, window[1] * read.y_max)))
    if not 0 < above <= beyond < u.size:
        return None
    levels = slice(above - 1, beyond + 1)
    slope, knee = fit_line(u[levels], y[levels])
    step = float(np.diff(u[levels]).max())
    if slope <= 0 or not u[above - 1] - step <= knee <= u[beyond]:
        return None
    kept = (read.branch.u >= u[above - 1]) & (read.branch.u <= u[beyond])
    censored = kept & (read.branch.q < 0.5 * read.floor)
    seen = kept & ~censored
    u_seen = read.branch.u[seen]
    if u_seen.size < 2 or np.ptp(u_seen) == 0:
        return None
    lever = 1 / u_seen.size + (u_seen.mean() - knee) ** 2 / np.sum((u_seen - u_seen.mean()) ** 2)
    return GatedLine(
        window=window,
        slope=slope,
        knee=knee,
        lever=lever,
        sigma=slope * step / math.sqrt(lever),
        block_inflation=1.0,
        variance_inflation=1.0,
        inside=kept,
        kept=kept,
        censored=censored,
        roughness=Roughness(0, 0.0, 0.0),
        outliers=0,
        dropped=0.0,
    )


def _refuse_a_jump_between_levels(read: PreparedBranch) -> None:
    """Refuse a table whose flow jumps from one level of the command to the next.

    A valve that opens into a straight part rises from its last shut level by less than one level's worth; what rises
    by several comes from a meter that wakes up late, and the line down to the shut level would end volts too high.
    """
    u, share = read.profile[0], read.profile[1] / read.y_max
    opened = int(np.argmax(share > SHUT))
    if opened == 0 or opened + 2 >= u.size or share[opened] < JUMPED:
        return
    before = (share[opened] - share[opened - 1]) / (u[opened] - u[opened - 1])
    after = (share[opened + 2] - share[opened]) / (u[opened + 2] - u[opened])
    if before <= JUMP * max(after, 0.0):
        return
    raise InputError(
        f"'{read.source}': the flow jumps between {u[opened - 1]:.2f} and {u[opened]:.2f} V, from "
        f"{max(share[opened - 1], 0.0):.0%} to {share[opened]:.0%} of the largest flow of {read.y_max * 6e4:.3g} "
        f"L/min, {before / after if after > 0 else np.inf:.3g} times as steep as above it, expected a straight rise; "
        "record levels in between, or, if the meter shows nothing below some flow, take one of a smaller range"
    )
