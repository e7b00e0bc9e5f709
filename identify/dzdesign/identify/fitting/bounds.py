"""From thresholds with errors to what can be certified: trend and simultaneous lower bounds."""

import math
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.valve.staircase import Direction

#: Probability, of a flat valve, of a change as large as the one found: a trend is called only below this.
TREND_SIGNIFICANCE = 0.01
#: Standard errors by which a knee must depart from the trend to contradict it.
DEPARTURE_SIGNIFICANCE = 5.0
#: Blocks of residuals behind a standard error, less the line's two parameters.
DEGREES_OF_FREEDOM = 14


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """How the threshold runs with the pressure drop; from one test its numbers are NaN."""

    direction: Direction
    #: Over the tested range, by a weighted straight line, and the standard error, V.
    change: float
    change_se: float
    #: Probability of so large a change, either way, if the threshold were flat (Student).
    p_value: float


def find_trend(dp: np.ndarray, threshold: np.ndarray, se: np.ndarray, u_max: float, budget: float) -> Trend:
    """Test in which direction the threshold (V) runs with the pressure drop, which rises.

    The budget is the change that systematic errors may make, V: a smaller one is flat, however significant.
    """
    from scipy.special import stdtr

    if dp.size < 2:
        return Trend(direction="flat", change=math.nan, change_se=math.nan, p_value=math.nan)
    weight = 1 / np.maximum(se, 1e-5 * u_max) ** 2
    centre = np.average(dp, weights=weight)
    spread = np.sum(weight * (dp - centre) ** 2)
    change = float(np.ptp(dp) * np.sum(weight * (dp - centre) * threshold) / spread)
    change_se = float(np.ptp(dp) / np.sqrt(spread))
    p_value = float(2 * stdtr(DEGREES_OF_FREEDOM, -abs(change) / change_se))
    flat = abs(change) < budget or p_value > TREND_SIGNIFICANCE
    direction: Direction = "flat" if flat else "decreasing" if change < 0 else "increasing"
    return Trend(direction=direction, change=change, change_se=change_se, p_value=p_value)


def excess_departure(departure: np.ndarray, se: np.ndarray, budget: float) -> np.ndarray:
    """Return the departures of the knees from the fit under the trend, V, zero where they lie within their errors.

    The budget is the departure that systematic errors may make, V.
    """
    real = departure > np.maximum(DEPARTURE_SIGNIFICANCE * se, budget)
    return np.where(real, departure, 0.0)


def lower_bounds(threshold: np.ndarray, se: np.ndarray, confidence: float, budget: np.ndarray) -> np.ndarray:
    """Return lower bounds (V) that hold for all tests at once with the given confidence (Bonferroni, Student).

    The budget is the systematic error to allow for beside the noise, V (the meter's zero).
    """
    from scipy.special import stdtrit

    quantile = stdtrit(DEGREES_OF_FREEDOM, 1 - (1 - confidence) / threshold.size)
    bounds: np.ndarray = threshold - quantile * se - budget
    return bounds
