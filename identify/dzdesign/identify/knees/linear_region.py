"""The straight part of the characteristic: a line through it that outliers do not move, and how far it reaches.

On a straight characteristic more samples make the line's zero up to three times sharper; on a bent one they would move
it. One valve has made all branches and one meter has read them, so how far the straight part reaches is asked of all of
them together: a bend too slight to be seen in one branch stands out of twelve, and what noise does to one branch alone
does not count.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.knees.noise import Roughness, colour_factor, measure_roughness, median
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
#: A branch's own colour counts if it is so many times the mean of all: 99.9 % of those of one noise are below it.
STANDS_OUT = 2.6
#: Upper ends to which the window is widened while the characteristic goes on straight, over the largest flow. Not 1:
#: where the ramp turns, the meter lags behind in a curve.
WIDER = (0.65, 0.8, 0.9, 0.98)
#: Standard errors by which the zeros of wider windows' lines may together depart from narrower ones', and one alone.
STRAIGHT, ALONE = 2.5, 3.5
#: Share of u_max beyond which no departure is put down to noise: slow noise and a slight bend look alike.
LARGEST_SHIFT = 3e-3
#: A table's flow that leaves less than `SHUT` of the largest, for more than `JUMPED`, between two levels of the
#: command jumps if it rises so many times faster there than over the next two levels.
SHUT, JUMPED, JUMP = 0.05, 0.15, 3.0


def fit_line(u: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return slope and zero of the least-squares line; a level one has no zero: the middle of its samples."""
    centre, height = float(u.mean()), float(y.mean())
    du = u - centre
    slope = float(du @ (y - height) / (du @ du))
    return slope, centre - height / slope if slope else centre


def colour_of_blocks(residual: np.ndarray, sigma: float) -> float:
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
class ReadBranch:
    """A branch with its flow at the nominal pressure drop (m³/s), ready for lines to be laid through it.

    `profile` is the smoothed course of the flow, `y_max` its value at the largest command, `floor` the meter's.
    """

    branch: Branch
    y: np.ndarray
    profile: tuple[np.ndarray, np.ndarray]
    y_max: float
    floor: float
    source: str


def read_branch(branch: Branch, y: np.ndarray, *, u_max: float, floor: float, source: str) -> ReadBranch:
    """Return a branch ready for lines to be laid through it; `floor` in m³/s, `source` for messages."""
    profile = smooth_profile(branch.u, y, u_max)
    return ReadBranch(branch=branch, y=y, profile=profile, y_max=flow_at_top(*profile), floor=floor, source=source)


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
    block_colour, colour : float
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
    block_colour: float
    colour: float
    inside: np.ndarray
    kept: np.ndarray
    censored: np.ndarray
    roughness: Roughness
    outliers: int
    dropped: float

    @property
    def knee_se(self) -> float:
        """Standard error of the zero, V."""
        return self.sigma * math.sqrt(self.lever * self.colour) / self.slope

    def coloured(self, correlation: float, blocks: float) -> "GatedLine":
        """Return the same line with errors for the noise that all branches share.

        Parameters
        ----------
        correlation : float
            Between neighbouring samples.
        blocks : float
            Mean of all branches' `block_colour`. A branch's own, from few blocks, counts where it stands out of that:
            then it has more than noise in it.
        """
        known = colour_factor(correlation, self.roughness, self.sigma)
        own = self.block_colour if self.block_colour > STANDS_OUT * blocks else 1.0
        return replace(self, colour=max(own, blocks, known))


def lay_line(read: ReadBranch, window: tuple[float, float]) -> GatedLine:
    """Lay a line through the samples between two shares of the largest flow.

    Parameters
    ----------
    read : ReadBranch
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
    block_colour = colour_of_blocks(residual, sigma)
    return GatedLine(
        window=window,
        slope=slope,
        knee=knee,
        lever=1 / u_seen.size + (u_seen.mean() - knee) ** 2 / np.sum((u_seen - u_seen.mean()) ** 2),
        sigma=sigma,
        block_colour=block_colour,
        colour=block_colour,
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
    own = (1 - slow) / (1 + slow)  # share of a sample in what is news, of noise that forgets exponentially
    length = ends - starts
    last = np.cumsum(log_ndtr(-above[censored]))[np.cumsum(length) - 1]
    chance = np.diff(last, prepend=0.0) * (own + (1 - own) / length)
    lost[censored] = np.repeat(chance < UNLIKELY, length)
    return lost


def _share_of_drop_outs(censored: np.ndarray, plain: np.ndarray) -> float:
    return float(censored[plain].mean()) if plain.any() else 0.0


def _among(inside: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return which samples of all are chosen, from which of those inside the window are."""
    among = np.zeros(inside.size, dtype=bool)
    among[inside] = chosen
    return among


def _chord(read: ReadBranch, window: tuple[float, float]) -> GatedLine | None:
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
        block_colour=1.0,
        colour=1.0,
        inside=kept,
        kept=kept,
        censored=censored,
        roughness=Roughness(0, 0.0, 0.0),
        outliers=0,
        dropped=0.0,
    )


def _refuse_a_jump_between_levels(read: ReadBranch) -> None:
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


def widest_straight(
    reads: Sequence[ReadBranch],
    narrow: Sequence[GatedLine],
    lowest: Sequence[float],
    correlation: float,
    blocks: float,
    largest_shift: float,
) -> list[GatedLine]:
    """Widen the windows of all branches, upwards and then down, as far as the characteristic goes on straight.

    Parameters
    ----------
    reads, narrow : sequence
        All branches of a valve, and the line through each in the narrow window, its errors as `coloured` gives them.
    lowest : sequence of float
        Share of the largest flow to which each branch's window may reach down.
    correlation, blocks : float
        What all branches share of the noise: see `GatedLine.coloured`.
    largest_shift : float
        Departure of a zero beyond which a branch stops, whatever its errors, V.
    """
    accepted = [[line] for line in narrow]
    open_ = set(range(len(reads)))
    ends = [[(line.window[0], high) for line in narrow] for high in WIDER if high > narrow[0].window[1]]
    for windows in [*ends, None]:
        if windows is None:  # down, from wherever the upper end has come to
            open_ = {index for index, line in enumerate(narrow) if lowest[index] < line.window[0]}
            windows = [(low, lines[-1].window[1]) for low, lines in zip(lowest, accepted, strict=True)]
        wider = {index: lay_line(reads[index], windows[index]).coloured(correlation, blocks) for index in open_}
        open_ = _going_on(accepted, wider, largest_shift)
        for index in open_:
            accepted[index].append(wider[index])
    return [lines[-1] for lines in accepted]


def _going_on(accepted: Sequence[Sequence[GatedLine]], wider: dict[int, GatedLine], largest_shift: float) -> set[int]:
    """Return the branches in which a wider window's line has its zero where every narrower one has it.

    A branch stops by itself where its zero departs too far; all stop where together their zeros depart one way.
    """
    going_on = set()
    departures: dict[int, list[tuple[float, float]]] = {}
    for index, line in wider.items():
        pairs = [(line.knee - other.knee, _error_of_difference(other, line)) for other in accepted[index]]
        if all(abs(shift) <= min(ALONE * error, largest_shift) for shift, error in pairs):
            going_on.add(index)
            departures[index] = pairs
    for age in range(max(map(len, departures.values()), default=0)):
        pairs = [pairs[age] for pairs in departures.values() if age < len(pairs)]
        weight = np.array([error**-2 for _, error in pairs])
        common = float(np.dot(weight, [shift for shift, _ in pairs]) / weight.sum())
        if abs(common) > STRAIGHT / math.sqrt(weight.sum()):
            return set()
    return going_on


def _error_of_difference(narrow: GatedLine, wide: GatedLine) -> float:
    """Return the standard error of the difference of two zeros, V: for nested samples, variances subtract.

    Both are of one noise; which of the two says it better is not known, so the louder is taken.
    """
    loudest = max(narrow.sigma**2 * narrow.colour, wide.sigma**2 * wide.colour)
    difference = narrow.lever / narrow.slope**2 - wide.lever / wide.slope**2
    return max(math.sqrt(loudest * max(difference, 0.0)), 0.1 * narrow.knee_se)
