"""From thresholds with errors to what can be certified: trend and simultaneous lower bounds."""

import math
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import Direction
from dzdesign.identify.knees.between_ramps import BetweenRamps

#: Probability, of a flat valve, of a change as large as the one found: a trend is called only below this.
TREND_SIGNIFICANCE = 0.01
#: Blocks of residuals behind a standard error, less the line's two parameters.
DEGREES_OF_FREEDOM = 14
#: Errors below this share of u_max weigh alike: an exact table has none.
FINEST_ERROR = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """How the threshold runs with the pressure drop; from one test its numbers are NaN."""

    direction: Direction
    #: Over the tested range, by a weighted straight line, and the standard error, V.
    change: float
    change_se: float
    #: Probability of so large a change, either way, if the threshold were flat (Student).
    p_value: float


def find_trend(
    dp: np.ndarray, threshold: np.ndarray, covariance: np.ndarray, degrees: float, u_max: float, budget: float
) -> Trend:
    """Test in which direction the threshold (V) runs with the pressure drop, which rises.

    The thresholds' covariance (V²) has the given degrees of freedom. The budget is the change that systematic errors
    may make, V: a smaller one is flat, however significant.
    """
    from scipy.special import stdtr

    if dp.size < 2:
        return Trend(direction="flat", change=math.nan, change_se=math.nan, p_value=math.nan)
    # Generalised least squares: a drift's error is shared by all tests.
    line = np.column_stack([np.ones_like(dp), (dp - dp[0]) / np.ptp(dp)])
    weight = np.linalg.inv(covariance + (FINEST_ERROR * u_max) ** 2 * np.eye(dp.size))
    of_line = np.linalg.inv(line.T @ weight @ line)
    change = float((of_line @ line.T @ weight @ threshold)[1])
    change_se = math.sqrt(float(of_line[1, 1]))
    p_value = float(2 * stdtr(degrees, -abs(change) / change_se))
    flat = abs(change) < budget or p_value > TREND_SIGNIFICANCE
    direction: Direction = "flat" if flat else "decreasing" if change < 0 else "increasing"
    return Trend(direction=direction, change=change, change_se=change_se, p_value=p_value)


def lower_bounds(
    threshold: np.ndarray, noise_se: np.ndarray, between: BetweenRamps, confidence: float, budget: np.ndarray
) -> np.ndarray:
    """Return lower bounds (V) of the next closing (or opening) at each test, of a valve in any state of the series.

    They hold for all tests at once with the given confidence (Bonferroni, Student). The budget is the systematic error
    to allow for beside noise and scatter, V (the meter's zero).
    """
    from scipy.special import stdtrit

    tail = 1 - (1 - confidence) / threshold.size
    degrees = between.degrees_of_freedom(noise_se, DEGREES_OF_FREEDOM)
    # What the repeats scatter by may be less than their noise by chance: the noise alone counts too.
    bounds = [threshold - stdtrit(DEGREES_OF_FREEDOM, 1 - (1 - confidence) / threshold.size) * noise_se]
    drift, uneven = (between.drift.change, between.drift.uneven) if between.drift else (0.0, 0.0)
    for state in (-0.5, 0.5):
        error = np.sqrt(between.variance_of_next(noise_se, state))
        bounds.append(threshold + drift * state - stdtrit(degrees, tail) * error - uneven)
    lowest: np.ndarray = np.min(bounds, axis=0) - budget
    return lowest
