"""What each premise about the curve between the tests makes of the guarded thresholds: bounds that hold at once.

`monotone` takes the bounds at the tests as they are, and so does `smooth`, which adds how far the threshold may sag
below the chords of the bounds: its second divided differences. `line` fits a straight line through all tests; its bound
at a test is sharper than the test's own, for all tests tell of the line. A premise comes with its own test.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM, FINEST_ERROR
from dzdesign.identify.knees.between_ramps import BetweenRamps
from dzdesign.identify.valve.estimated_curvature import estimated_curvature, second_differences
from dzdesign.identify.valve.staircase import Direction

#: Share of the error probability that the bounds at the tests leave to the premise: for a curvature that is estimated,
#: and for degrees of freedom that are effective ones.
SHARE_OF_PREMISE = 0.25
#: The same of a line, whose weights come from errors that are estimated too.
SHARE_OF_LINE = 0.5
#: From so many degrees of freedom on, Student's law is the normal one.
LARGEST_DEGREES = 1e6
#: Points at which the path of a line's error is followed over the interval.
PATH_POINTS = 101


@dataclass(frozen=True, slots=True, kw_only=True)
class Curvature:
    """Second divided differences of the threshold at the tests, V/MPa², and the class that they lead to."""

    #: 2 f[a, b, c] at each inner test, and their standard errors (T - 2,).
    at_tests: np.ndarray
    se: np.ndarray
    #: M between neighbouring tests (T - 1,).
    allowed: np.ndarray
    declared: bool
    #: Probability, if M were true, of second differences this large; None where M was estimated from them.
    p_value: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A straight line through the thresholds, and its simultaneous lower bounds at the tests, V (T,)."""

    value: np.ndarray
    bound: np.ndarray
    #: Of its lack of fit (F); None from two tests, which any line fits.
    p_value: float | None
    #: Standard errors between line and bound.
    critical: float


def find_curvature(
    dp_MPa: np.ndarray, threshold: np.ndarray, covariance: np.ndarray, degrees: float, declared: float | None
) -> Curvature:
    """Find which curvature M the premise `smooth` is to allow, in the class 2 f[a, x, b] <= M between tests.

    Only a threshold that bends upwards lies below its chords. Where M is estimated, its error needs no allowance: what
    M lacks by it is small beside the distance of the bounds from the thresholds, which the same errors set
    (benchmarks/identify/curve_premises.py).

    Parameters
    ----------
    dp_MPa, threshold : (T,) array
        Of at least `FEWEST_FOR_CURVATURE` tests, unless M is declared; V.
    covariance : (T, T) array
        Of the thresholds, V², with so many `degrees` of freedom.
    declared : float or None
        M, V/MPa².
    """
    from scipy.special import stdtr

    weights = second_differences(dp_MPa)
    found = weights @ threshold
    se = np.sqrt(np.diag(weights @ covariance @ weights.T))
    p_value = None
    if declared is not None:
        allowed = np.full(dp_MPa.size - 1, declared)
        if found.size:
            beyond = float(np.max((found - declared) / np.maximum(se, np.finfo(float).tiny)))
            p_value = min(1.0, float(found.size * stdtr(degrees, -beyond)))
    else:
        allowed = estimated_curvature(found)
    return Curvature(at_tests=found, se=se, allowed=allowed, declared=declared is not None, p_value=p_value)


def confidence_at_tests(confidence: float, share: float = SHARE_OF_PREMISE) -> float:
    """Return the confidence of the bounds at the tests with which the whole curve has the given one."""
    return 1 - (1 - share) * (1 - confidence)


def one_way_p(
    threshold: np.ndarray, covariance: np.ndarray, degrees: float, direction: Direction
) -> float | None:
    """Return the probability of steps against the direction as large as the largest, if the threshold ran that way.

    Of all pairs of tests, with Bonferroni; None without a direction, and from two tests, which gave it.
    """
    from scipy.special import stdtr

    first, last = np.triu_indices(threshold.size, 1)
    if direction == "flat" or threshold.size < 3:
        return None
    step = (threshold[last] - threshold[first]) * (1 if direction == "decreasing" else -1)
    variance = np.diag(covariance)
    error = np.sqrt(variance[first] + variance[last] - 2 * covariance[first, last])
    largest = float(np.max(step / np.maximum(error, np.finfo(float).tiny)))
    return min(1.0, float(first.size * stdtr(min(degrees, LARGEST_DEGREES), -largest)))


def bound_line(
    dp_MPa: np.ndarray,
    threshold: np.ndarray,
    noise_se: np.ndarray,
    budget: np.ndarray,
    between: BetweenRamps,
    *,
    confidence: float,
    u_max: float,
) -> Line:
    """Bound the next closing (or opening) under a straight threshold, of a valve in any state of the series.

    The bounds at the tests hold at once with the given confidence, and with them their chords; `SHARE_OF_LINE` of the
    error probability is kept for what the bounds do not count. Of two critical values,
    both known before a threshold is, the smaller is taken: Bonferroni's over the tests, and the tube formula's for the
    whole interval. Systematic errors of the tests, the `budget` (V), reach the line by its weights.
    """
    rounding = (FINEST_ERROR * u_max) ** 2 * np.eye(dp_MPa.size)
    confidence = confidence_at_tests(confidence, SHARE_OF_LINE)
    covariance = between.covariance_of_mean(noise_se) + rounding
    weights_of = line_weights(dp_MPa, covariance)
    at_tests, along = weights_of(dp_MPa), weights_of(np.linspace(dp_MPa[0], dp_MPa[-1], PATH_POINTS))
    value = at_tests @ threshold
    drift, uneven = (between.drift.change, between.drift.uneven) if between.drift else (0.0, 0.0)
    bounds, largest = [], 0.0
    for state in (None, -0.5, 0.5):
        # What the repeats scatter by may be less than their noise by chance: the noise alone counts too.
        error, path = (between.covariance_of_next(noise_se, weights, state) for weights in (at_tests, along))
        degrees = between.degrees_of_next(noise_se, along, DEGREES_OF_FREEDOM, state)
        critical = critical_value(path, degrees, confidence, dp_MPa.size)
        shift = 0.0 if state is None else drift * state - uneven
        bounds.append(value + shift - critical * np.sqrt(np.diag(error)))
        largest = max(largest, critical)
    pooled = between.degrees_of_next(noise_se, np.eye(dp_MPa.size), DEGREES_OF_FREEDOM, 0.0) * dp_MPa.size
    return Line(
        value=value,
        bound=np.min(bounds, axis=0) - np.abs(at_tests) @ budget,
        p_value=_lack_of_fit(threshold - value, covariance, between.degrees if between.measured else pooled),
        critical=largest,
    )


def critical_value(path: np.ndarray, degrees: float, confidence: float, tests: int) -> float:
    """Return how many standard errors a bound must keep that holds for all tests at once, or along the whole path.

    `path` (N, N) is the covariance of the error along the interval. Normalised, the error is a unit vector that turns
    by an angle phi from end to end, and P(sup > c) <= phi/2pi P(2 F(2, nu) > c²) + P(t(nu) > c): the tube formula, an
    upper bound for any path (Naiman 1986).
    """
    from scipy.special import stdtrit

    tail, degrees = 1 - confidence, min(degrees, LARGEST_DEGREES)
    return min(float(stdtrit(degrees, 1 - tail / tests)), of_whole_path(path, degrees, tail))


def of_whole_path(path: np.ndarray, degrees: float, tail: float) -> float:
    """Return how many standard errors are exceeded anywhere on a path with at most the probability `tail`."""
    from scipy.optimize import brentq
    from scipy.special import stdtr, stdtrit

    degrees, scale = min(degrees, LARGEST_DEGREES), np.sqrt(np.diag(path))
    if not np.all(scale > 0):  # nothing is uncertain somewhere: what is left turns by no known angle
        return float(stdtrit(degrees, 1 - tail / scale.size))
    along = np.clip(np.diagonal(path, 1) / (scale[1:] * scale[:-1]), -1, 1)
    angle = float(np.sum(np.arccos(along)))

    def excess(c: float) -> float:
        of_angle = (1 + c**2 / degrees) ** (-degrees / 2) if degrees < LARGEST_DEGREES else math.exp(-(c**2) / 2)
        return angle / (2 * math.pi) * of_angle + float(stdtr(degrees, -c)) - tail

    largest = float(stdtrit(degrees, 1 - tail / 4))
    while excess(largest) > 0:
        largest *= 2
    return float(brentq(excess, 0.0, largest))


def line_weights(dp_MPa: np.ndarray, covariance: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Return what gives the weights (N, T) of the tests in the line at N pressure drops: generalised least squares."""
    tested = np.column_stack([np.ones_like(dp_MPa), dp_MPa])
    inverse = np.linalg.inv(covariance)
    to_line = np.linalg.solve(tested.T @ inverse @ tested, tested.T @ inverse)

    def weights(at_MPa: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.column_stack([np.ones_like(at_MPa), at_MPa]) @ to_line
        return found

    return weights


def _lack_of_fit(residual: np.ndarray, covariance: np.ndarray, degrees: float) -> float | None:
    """Return the probability of residuals this large if the threshold were straight (F); None from two tests."""
    from scipy.special import chdtrc, fdtrc

    free = residual.size - 2
    if free < 1:
        return None
    squares = float(residual @ np.linalg.solve(covariance, residual))
    if degrees >= LARGEST_DEGREES:
        return float(chdtrc(free, squares))
    return float(fdtrc(free, degrees, squares / free))
