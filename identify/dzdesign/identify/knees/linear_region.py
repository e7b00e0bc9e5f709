"""The linear region of the characteristic: how far it reaches, the line through it, and what it tells of the noise.

On a straight characteristic more samples make the line's zero up to three times sharper; on a bent one they would move
it. One valve has made all branches and one meter has read them, so how far the straight part reaches is asked of all of
them together: a bend too slight to be seen in one branch stands out of twelve, and what noise does to one branch alone
does not count.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import Shown
from dzdesign.identify.knees.gated_line import GatedLine, PreparedBranch
from dzdesign.identify.knees.line_fitting import fit_knee
from dzdesign.identify.knees.noise import correlation_upper_limit, robust_sigma, shared_correlation
from dzdesign.identify.ramps.branches import Branch

#: Flow below this share of the largest is no useful flow, however fine the meter.
USEFUL_FLOW = 0.005
#: Standard deviations of a shut reading above which a single reading is flow.
NOISE_LEVEL = 3.0
#: Share of the readings while the valve is shut that are the lowest one, from which the noise is cut off there;
#: shares of the readings below the middle of a normal law, and below one standard deviation more.
CUT_OFF, ONE_SIGMA = 0.25, (0.5, 0.841)
#: The window may reach down to this multiple of the first flow that counts: nearer to a floor readings are cut off.
ABOVE_LEVEL = 1.5
#: Upper ends to which the window is widened while the characteristic goes on straight, over the largest flow. Not 1:
#: where the ramp turns, the meter lags behind in a curve.
WIDER = (0.65, 0.8, 0.9, 0.98)
#: Standard errors by which the zeros of wider windows' lines may together depart from narrower ones', and one alone.
STRAIGHT, ALONE = 2.5, 3.5
#: Share of u_max beyond which no departure is put down to noise: slow noise and a slight bend look alike.
LARGEST_SHIFT = 3e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class StraightParts:
    """The straight parts of all branches of a valve."""

    #: One per branch, as wide as the characteristic goes on straight, and those in the window that was asked for.
    lines: tuple[GatedLine, ...]
    narrow: tuple[GatedLine, ...]
    #: Per branch, m³/s: the flow that is no use or below the meter's floor, the one from which a single reading is
    #: flow, and the noise of a reading while the valve is shut.
    least: tuple[float, ...]
    levels: tuple[float, ...]
    noises: tuple[float, ...]
    #: Of the noise of neighbouring samples, by all branches together: at most, to one standard error.
    correlation: float


def find_straight_parts(
    reads: Sequence[PreparedBranch], *, u_max: float, window: tuple[float, float], noise_level: float | None = None
) -> StraightParts:
    """Find the straight part of each branch of all ramp tests, and what all of them tell of the noise.

    `window` holds the shares of the largest flow between which the characteristic is taken as straight at first; a
    `noise_level` that is declared (m³/s) stands in the place of the flow that is no use.

    Raises
    ------
    InputError
        If a window holds too few samples for a line, or the flow does not rise in it.
    """
    narrow = [fit_knee(read, window) for read in reads]
    for read, line in zip(reads, narrow, strict=True):
        if not line.slope > 0:
            raise InputError(
                f"'{read.source}': between {window[0]:.0%} and {window[1]:.0%} of the largest flow, "
                f"{Shown(read.y_max * 6e4):.3g L/min}, the flow does not rise with the command; look for spikes in "
                "the column of Q, leave their cells blank, or choose another --knee-window"
            )
    correlation, blocks = _shared_noise(narrow)
    narrow = [line.with_shared_noise(correlation, blocks) for line in narrow]
    noises = [_quiet_noise(read.branch, read.y, line.knee) for read, line in zip(reads, narrow, strict=True)]
    least = [max(read.floor, USEFUL_FLOW * read.y_max if noise_level is None else noise_level) for read in reads]
    levels = [max(flow, NOISE_LEVEL * noise) for flow, noise in zip(least, noises, strict=True)]
    lowest = [ABOVE_LEVEL * level / read.y_max for read, level in zip(reads, levels, strict=True)]
    lines = _widest_straight(reads, narrow, lowest, correlation, blocks, LARGEST_SHIFT * u_max)
    # The wider windows know the noise better. Errors that are believed must bear that it is not known exactly.
    correlation, blocks = _shared_noise(lines)
    correlation = correlation_upper_limit(correlation, [line.roughness for line in lines])
    return StraightParts(
        lines=tuple(line.with_shared_noise(correlation, blocks) for line in lines),
        narrow=tuple(narrow),
        least=tuple(least),
        levels=tuple(levels),
        noises=tuple(noises),
        correlation=correlation,
    )


def _shared_noise(lines: Sequence[GatedLine]) -> tuple[float, float]:
    """Return the correlation of neighbouring samples and the mean inflation by blocks, by all branches together."""
    correlation = shared_correlation([line.roughness for line in lines])
    # A branch that stands out has a bend in it; the middle half is of the noise.
    inflations = np.sort([line.block_inflation for line in lines])
    return correlation, float(inflations[inflations.size // 4 : inflations.size - inflations.size // 4].mean())


def _quiet_noise(branch: Branch, y: np.ndarray, knee: float) -> float:
    """Return the robust standard deviation of a reading while the valve is shut (u below half the knee), m³/s."""
    shut = y[branch.u < 0.5 * knee]
    if shut.size < 5:
        return 0.0
    if np.mean(shut == shut.min()) < CUT_OFF:
        return robust_sigma(shut)
    # A meter that shows nothing below zero cuts off the lower half of its noise.
    middle, upper = np.quantile(shut, ONE_SIGMA)
    return float(upper - middle)


def _widest_straight(
    reads: Sequence[PreparedBranch],
    narrow: Sequence[GatedLine],
    lowest: Sequence[float],
    correlation: float,
    blocks: float,
    largest_shift: float,
) -> list[GatedLine]:
    """Widen the windows of all branches, upwards and then down, as far as the characteristic goes on straight.

    `narrow` are the lines in the narrow window, their errors as `with_shared_noise` gives them for `correlation` and
    `blocks`; `lowest` the shares of the largest flow to which each window may reach down. A branch whose zero departs
    by more than `largest_shift` (V) stops, whatever its errors.
    """
    accepted = [[line] for line in narrow]
    open_ = set(range(len(reads)))
    ends = [[(line.window[0], high) for line in narrow] for high in WIDER if high > narrow[0].window[1]]
    for windows in [*ends, None]:
        if windows is None:  # down, from wherever the upper end has come to
            open_ = {index for index, line in enumerate(narrow) if lowest[index] < line.window[0]}
            windows = [(low, lines[-1].window[1]) for low, lines in zip(lowest, accepted, strict=True)]
        wider = {
            index: fit_knee(reads[index], windows[index]).with_shared_noise(correlation, blocks) for index in open_
        }
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
    loudest = max(narrow.sigma**2 * narrow.variance_inflation, wide.sigma**2 * wide.variance_inflation)
    difference = narrow.lever / narrow.slope**2 - wide.lever / wide.slope**2
    return max(math.sqrt(loudest * max(difference, 0.0)), 0.1 * narrow.knee_se)
