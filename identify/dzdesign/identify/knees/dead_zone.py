"""What averages over the dead zone resolve, and whether something flows below the knee that no single reading shows.

A single reading of a loud meter is flow only from three standard deviations on, and what flows less hides. The mean of
the readings over a stretch of the dead zone has a far smaller error, and what it resolves is the noise level: a flow
that large below the knee is seen, so that the law's offset stays below it, or is lowered to where it is gone.
"""

import math
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.knees.gated_line import GATE, GatedLine, PreparedBranch
from dzdesign.identify.knees.noise import robust_sigma
from dzdesign.identify.ramps.medians import median

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


@dataclass(frozen=True, slots=True)
class DeadZone:
    """Dead zone of one branch: the noise level, m³/s, and how far below the knee averages still show flow, V."""

    noise_level: float
    depth: float


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
