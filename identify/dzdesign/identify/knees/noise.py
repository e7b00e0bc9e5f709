"""How slow the meter's noise is, and by how much that widens the errors of a straight line.

Noise that forgets exponentially (a meter's filter makes it so) has a correlation r of neighbouring samples. It is
measured about a parabola, or a bent characteristic would pass for slow noise. The parabola takes some of the slow noise
along, so the residuals look both smaller and quicker than the noise is; what they would be on average is computed here,
and turned round.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from dzdesign.identify.ramps.branches import median

#: Parameters of a parabola.
TERMS = 3
#: Points on which the share of the noise that a parabola takes along is computed; a longer recording is scaled to them.
POINTS = 400
#: Lengths of the noise's memory that a recording must hold for its ends not to matter.
SHORT_MEMORY = 100.0
#: Noise is followed up to a memory of the longest recording over this: slower, it can't be told from a bend.
LONGEST_MEMORY = 2.0


def robust_sigma(values: np.ndarray) -> float:
    """Return the standard deviation of the middle half: the median of departures from the median, for a normal law."""
    return 1.4826 * median(np.abs(values - median(values)))


@dataclass(frozen=True, slots=True)
class Roughness:
    """Of residuals about a parabola: their number, and the sums of squares of their steps and of themselves."""

    n: int
    steps: float
    squares: float


def measure_roughness(u: np.ndarray, residual: np.ndarray) -> Roughness:
    """Return the roughness of residuals about any line, in the order of time, about the parabola through them."""
    if u.size > TERMS:
        x = (u - u.mean()) / max(np.ptp(u), 1e-300)
        powers = np.array([np.ones_like(x), x, x * x])
        # Normal equations: with |x| <= 1 they lose no digit that counts, at a tenth of the decomposition's time.
        residual = residual - np.linalg.lstsq(powers @ powers.T, powers @ residual, rcond=None)[0] @ powers
    steps = np.diff(residual)
    return Roughness(residual.size, float(steps @ steps), float(residual @ residual))


def shared_correlation(roughness: Sequence[Roughness]) -> float:
    """Return the correlation of neighbouring samples by the residuals of all branches: one meter, one kind of noise.

    It is zero for white noise, and just below 1 where the noise is slower than the recordings can show.
    """
    from scipy.optimize import brentq

    measured = [item for item in roughness if item.n > 2 * TERMS and item.steps > 0]
    if not measured:
        return 0.0

    def excess(rate: float) -> float:
        # E[steps] = 2 (1 - r) (n - 1) s^2, which hardly scatters, and E[squares] = (n - taken) s^2.
        return sum(
            item.n
            * (item.squares / item.steps - (item.n - taken_by_parabola(1 - rate, item.n)) / (2 * rate * (item.n - 1)))
            for item in measured
        )

    if excess(1.0) <= 0:
        return 0.0
    slowest = LONGEST_MEMORY / max(item.n for item in measured)
    if excess(slowest) >= 0:
        return 1 - slowest
    return 1 - math.exp(brentq(lambda log_rate: excess(math.exp(log_rate)), math.log(slowest), 0.0, xtol=1e-15))


def correlation_upper_limit(correlation: float, roughness: Sequence[Roughness]) -> float:
    """Return the correlation one standard error above the one that `shared_correlation` found.

    Of n samples, n (1 - r) / (1 + r) stretches are independent, and so many squares tell 1 - r, to sqrt(2 / stretches)
    of itself. Slow noise in one or two short recordings leaves a dozen: noise may be half as quick as it looks there,
    and a line's error that does not know of it is believed where it must not be.
    """
    longest = max((item.n for item in roughness), default=0)
    stretches = sum(item.n for item in roughness) * (1 - correlation) / (1 + correlation)
    if stretches <= 0:
        return correlation
    slower = (1 - correlation) * float(np.exp(-np.sqrt(2 / stretches)))
    return max(correlation, 1 - max(slower, LONGEST_MEMORY / longest))


def variance_inflation(correlation: float, roughness: Roughness, sigma: float) -> float:
    """Return the variance of a line's parameters over what white noise of the residuals' size `sigma` would give."""
    n = roughness.n
    if n < 3 or sigma <= 0:
        return 1.0
    long_run = min((1 + correlation) / (1 - correlation), n / 2)
    # The steps tell the noise's variance far better than the few independent stretches that slow noise leaves.
    variance = roughness.steps / (2 * (1 - correlation) * (n - 1))
    return long_run * variance / sigma**2


def taken_by_parabola(correlation: float, n: int) -> float:
    """Return how many samples' worth of noise a parabola takes along: 3 of white noise, nearly n of slow."""
    if (1 - correlation) * n > SHORT_MEMORY:  # each parameter takes one sample's worth of the long-run variance
        return TERMS * (1 + correlation) / (1 - correlation)
    if correlation <= 0:
        return float(min(TERMS, n))
    points = min(n, POINTS)
    rate = -float(np.log(correlation)) * n / points
    products = _products_of_parabolas(points)
    return float(2 * products @ np.exp(-rate * np.arange(points)) - products[0]) * n / points


@lru_cache(maxsize=4096)
def _products_of_parabolas(points: int) -> np.ndarray:
    """Return what noise is weighted with by its correlation over so many points from 0 on, in what parabolas take."""
    orthonormal = np.linalg.qr(np.vander(np.linspace(-1, 1, points), TERMS))[0]
    found: np.ndarray = np.sum([np.correlate(column, column, "full") for column in orthonormal.T], axis=0)
    return found[points - 1 :]
