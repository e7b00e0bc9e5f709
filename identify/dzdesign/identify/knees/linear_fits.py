"""The straight parts of all branches of a valve together: their lines, and what they tell of the noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.knees.linear_region import LARGEST_SHIFT, GatedLine, ReadBranch, lay_line, widest_straight
from dzdesign.identify.knees.noise import one_error_slower, robust_sigma, shared_correlation
from dzdesign.identify.ramps.branches import Branch

#: Flow below this share of the largest is no useful flow, however fine the meter.
USEFUL_FLOW = 0.005
#: Standard deviations of a shut reading above which a single reading is flow.
NOISE_LEVEL = 3.0
#: The window may reach down to this multiple of the first flow that counts: nearer to a floor readings are cut off.
ABOVE_LEVEL = 1.5


@dataclass(frozen=True, slots=True, kw_only=True)
class StraightParts:
    """The straight parts of all branches of a valve.

    Attributes
    ----------
    lines : tuple of GatedLine
        One per branch, as wide as the characteristic goes on straight.
    levels, noises : tuple of float
        Per branch the flow that counts as flow, and the noise of a reading while the valve is shut, m³/s.
    correlation : float
        Of the noise of neighbouring samples, by all branches together: at most, to one standard error.
    """

    lines: tuple[GatedLine, ...]
    levels: tuple[float, ...]
    noises: tuple[float, ...]
    correlation: float


def find_straight_parts(reads: Sequence[ReadBranch], *, u_max: float, window: tuple[float, float]) -> StraightParts:
    """Find the straight part of each branch, and what all of them tell of the noise.

    Parameters
    ----------
    reads : sequence of ReadBranch
        All branches of all ramp tests.
    u_max : float
        Full command, V.
    window : tuple of float
        Shares of the largest flow between which the characteristic is taken as straight.

    Raises
    ------
    InputError
        If a window holds too few samples for a line, or the flow does not rise in it.
    """
    narrow = [lay_line(read, window) for read in reads]
    for read, line in zip(reads, narrow, strict=True):
        if not line.slope > 0:
            raise InputError(
                f"'{read.source}': between {window[0]:.0%} and {window[1]:.0%} of the largest flow, "
                f"{read.y_max * 6e4:.3g} L/min, the flow does not rise with the command; look for "
                "spikes in the column of Q, leave their cells blank, or choose another --knee-window"
            )
    correlation, blocks = _shared_noise(narrow)
    narrow = [line.coloured(correlation, blocks) for line in narrow]
    noises = [_quiet_noise(read.branch, read.y, line.knee) for read, line in zip(reads, narrow, strict=True)]
    levels = [
        max(read.floor, USEFUL_FLOW * read.y_max, NOISE_LEVEL * noise)
        for read, noise in zip(reads, noises, strict=True)
    ]
    lowest = [ABOVE_LEVEL * level / read.y_max for read, level in zip(reads, levels, strict=True)]
    lines = widest_straight(reads, narrow, lowest, correlation, blocks, LARGEST_SHIFT * u_max)
    # The wider windows know the noise better. Errors that are believed must bear that it is not known exactly.
    correlation, blocks = _shared_noise(lines)
    correlation = one_error_slower(correlation, [line.roughness for line in lines])
    return StraightParts(
        lines=tuple(line.coloured(correlation, blocks) for line in lines),
        levels=tuple(levels),
        noises=tuple(noises),
        correlation=correlation,
    )


def _shared_noise(lines: Sequence[GatedLine]) -> tuple[float, float]:
    """Return the correlation of neighbouring samples and the mean colour of blocks, by all branches together."""
    correlation = shared_correlation([line.roughness for line in lines])
    # A branch that stands out has a bend in it; the middle half is of the noise.
    colours = np.sort([line.block_colour for line in lines])
    return correlation, float(colours[colours.size // 4 : colours.size - colours.size // 4].mean())


def _quiet_noise(branch: Branch, y: np.ndarray, knee: float) -> float:
    """Return the robust standard deviation of a reading while the valve is shut (u below half the knee), m³/s."""
    shut = y[branch.u < 0.5 * knee]
    return robust_sigma(shut) if shut.size >= 5 else 0.0
