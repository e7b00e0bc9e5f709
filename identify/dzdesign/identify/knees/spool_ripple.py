"""Stick and slip: how far the spool stands off its mean course, as the flow of a slow ramp shows it.

Without dither a spool waits until the command is a breakaway ahead of it, and then jumps. On a ramp it moves in steps,
to both sides of its mean course alike, and so it stops: a line through the ramp tells the mean, and half of all stops
lie below it. The steps are a ripple of the flow, slower than the meter's noise, which the dead zone shows by itself:
there the spool moves as well, and no flow follows.
"""

import math

import numpy as np

from dzdesign.identify.knees.gated_line import GatedLine, PreparedBranch

#: Flows are averaged over this share of u_max, and compared with their mean over so many of these averages: wider than
#: the steps of a spool, narrower than a bend of the characteristic.
AVERAGED, LOCAL = 2e-3, 31
#: Fewest samples of a ramp, and of averages, that tell a ripple.
FEWEST_SAMPLES, FEWEST_AVERAGES = 200, 40
#: Shares of u_max that the dead zone's part stays away from rest and from the knee.
FROM_REST, FROM_KNEE = 0.05, 0.03
#: A ripple is real where its variance is so many times the noise's, and its height above this share of u_max.
RIPPLE_RATIO, SMALLEST_RIPPLE = 4.0, 1e-3


def spool_ripple(read: PreparedBranch, line: GatedLine, u_max: float) -> float:
    """Return the standard deviation of the spool about its mean course, as a command, V; 0 where the noise explains it.

    It is 0 as well where the dead zone shows no noise to compare with, as of a meter that reads zero there.
    """
    u, seen = read.branch.u, line.kept & ~line.censored
    still = (u > FROM_REST * u_max) & (u < line.knee - FROM_KNEE * u_max)
    residual = read.y - line.slope * (u - line.knee)
    ripples = []
    for part in read.branch.ramps:
        of_line, of_rest = (
            _slow_and_quick(u[part][rows[part]], flow[part][rows[part]], u_max)
            for rows, flow in ((seen, residual), (still, read.y))
        )
        if of_line is None or of_rest is None or of_rest[1] <= 0:
            continue
        # Noise that grows with the flow does so at all speeds alike.
        noise = of_rest[0] * of_line[1] / of_rest[1]
        ripples.append(of_line[0] - noise if of_line[0] > RIPPLE_RATIO * noise else 0.0)
    ripple = math.sqrt(float(np.mean(ripples))) / line.slope if ripples else 0.0
    return ripple if ripple > SMALLEST_RIPPLE * u_max else 0.0


def _slow_and_quick(u: np.ndarray, y: np.ndarray, u_max: float) -> tuple[float, float] | None:
    """Return the variance of averages about their local mean, and that of samples from their steps; None of too few."""
    if u.size < FEWEST_SAMPLES:
        return None
    index = np.floor((u - u.min()) / (AVERAGED * u_max)).astype(int)
    count = np.bincount(index)
    averages = np.bincount(index, weights=y)[count > 0] / count[count > 0]
    if averages.size < FEWEST_AVERAGES:
        return None
    local = np.convolve(averages, np.full(LOCAL, 1 / LOCAL), "valid")
    middle = averages[LOCAL // 2 : LOCAL // 2 + local.size]
    return float(np.mean((middle - local) ** 2)), float(np.mean(np.diff(y) ** 2)) / 2
