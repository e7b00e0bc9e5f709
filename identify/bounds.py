"""From thresholds with errors to what can be certified: trend, simultaneous lower bounds, staircase."""

import numpy as np

#: Change of the threshold over the tested range, as a share of u_max, below which the trend counts as flat.
FLAT_CHANGE = 1e-3
#: Standard errors that a change must exceed to count as a trend.
TREND_SIGNIFICANCE = 3.0
#: Standard errors by which a knee must depart from the trend to contradict it.
DEPARTURE_SIGNIFICANCE = 5.0
#: Blocks of residuals behind a standard error, less the line's two parameters.
DEGREES_OF_FREEDOM = 14


def find_trend(dp: np.ndarray, threshold: np.ndarray, se: np.ndarray, u_max: float) -> tuple[str, float, float]:
    """Tell in which direction the threshold runs with the pressure drop.

    Parameters
    ----------
    dp : (T,) array
        Nominal pressure drops, rising.
    threshold, se : (T,) array
        Thresholds and standard errors, V.
    u_max : float
        Full command, V.

    Returns
    -------
    tuple
        ``"decreasing"``, ``"increasing"`` or ``"flat"``; the change over the tested range in V (weighted straight
        line); its standard error.
    """
    if dp.size < 2:
        return "flat", 0.0, float("nan")
    weight = 1 / np.maximum(se, 1e-5 * u_max) ** 2
    centre = np.average(dp, weights=weight)
    spread = np.sum(weight * (dp - centre) ** 2)
    slope = np.sum(weight * (dp - centre) * threshold) / spread
    change, change_se = slope * np.ptp(dp), np.ptp(dp) / np.sqrt(spread)
    if abs(change) < max(FLAT_CHANGE * u_max, TREND_SIGNIFICANCE * change_se):
        return "flat", float(change), float(change_se)
    return ("decreasing" if change < 0 else "increasing"), float(change), float(change_se)


def excess_departure(departure: np.ndarray, se: np.ndarray, u_max: float) -> np.ndarray:
    """Return by how much each knee departs from one direction with the pressure drop, V; zero within its errors.

    Parameters
    ----------
    departure, se : (T,) array
        Distance of each knee from the fit under the trend, and its standard error, V.
    u_max : float
        Full command, V; a departure below `FLAT_CHANGE` of it is the budget of systematic errors.
    """
    real = departure > np.maximum(DEPARTURE_SIGNIFICANCE * se, FLAT_CHANGE * u_max)
    return np.where(real, departure, 0.0)


def lower_bounds(threshold: np.ndarray, se: np.ndarray, confidence: float, budget: np.ndarray) -> np.ndarray:
    """Return lower bounds that hold for all tests at once with the given confidence (Bonferroni, Student).

    Parameters
    ----------
    threshold, se : (T,) array
        Thresholds and standard errors, V.
    confidence : float
        Of all bounds together, for example 0.99.
    budget : (T,) array
        Systematic error to allow for beside the noise, V (the meter's zero).
    """
    from scipy.special import stdtrit

    quantile = stdtrit(DEGREES_OF_FREEDOM, 1 - (1 - confidence) / threshold.size)
    return threshold - quantile * se - budget


def staircase(bound: np.ndarray, trend: str) -> tuple[np.ndarray, np.ndarray]:
    """Turn bounds at the tests into bounds on the whole interval, by monotonicity alone.

    A threshold that falls with the pressure drop is, anywhere between two tests, at least the upper test's bound; one
    that rises, at least the lower test's. Chords between the bounds would not be safe: a convex threshold lies below
    its chords.

    Parameters
    ----------
    bound : (T,) array
        Lower bounds at the tests, in the order of rising pressure drop.
    trend : {"decreasing", "increasing", "flat"}
        "flat" assumes no direction: the lowest bound holds everywhere.

    Returns
    -------
    tuple
        steps : (T - 1,) array, bound on each closed interval between neighbouring tests; ceiling : (T,) array, the
        largest offset at each test such that straight chords stay under the steps on both sides.
    """
    if trend == "decreasing":
        tightened = np.maximum.accumulate(bound[::-1])[::-1]
        steps = tightened[1:]
    elif trend == "increasing":
        tightened = np.maximum.accumulate(bound)
        steps = tightened[:-1]
    else:
        tightened = np.full_like(bound, bound.min())
        steps = tightened[1:]
    ceiling = tightened.copy()
    ceiling[:-1] = np.minimum(ceiling[:-1], steps)
    ceiling[1:] = np.minimum(ceiling[1:], steps)
    return steps, ceiling
