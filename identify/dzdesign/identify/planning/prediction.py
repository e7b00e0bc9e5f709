"""What a series will certify: its knees drawn at random, and bounded as identification bounds them."""

from dataclasses import dataclass

import numpy as np

from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM, excess_departure, find_trend, lower_bounds
from dzdesign.identify.knees.between_ramps import BetweenRamps, RampKnees, pool_scatter
from dzdesign.identify.planning.premises import Bench, ExpectedValve
from dzdesign.identify.planning.series import Series
from dzdesign.identify.valve.staircase import Direction, staircase

#: Pressure drops over which the distance below the threshold is averaged.
GRID = 101


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """What a series certifies, over all that chance may make of it; V. A loss is a distance below the threshold."""

    #: Standard error that the noise gives the knee of one ramp at each pressure drop (T,).
    knee_se: np.ndarray
    #: Distance of the certified offset below the threshold, averaged over the pressure drops: its mean, and what nine
    #: series of ten stay below.
    loss: float
    loss_of_nine: float
    #: What of the mean is due to scatter from ramp to ramp, noise, the lag's tolerance, the meter's zero, and the steps
    #: between the tests.
    of_scatter: float
    of_noise: float
    of_lag: float
    of_zero: float
    of_staircase: float
    #: Share of the series that find the expected direction of the threshold.
    trend_found: float


def predict(series: Series, valve: ExpectedValve, bench: Bench, *, draws: int, seed: int) -> Prediction:
    """Predict what a series certifies.

    The knees of the ramps are drawn with their scatter and noise and go through identification's own model of the
    ramps, trend, bounds and staircase. The valve neither drifts nor has a soft edge.

    Parameters
    ----------
    series : Series
        What is recorded.
    valve, bench : ExpectedValve, Bench
        The premises. Of a single round the valve's scatter is declared, of several it is measured.
    draws : int
        How often the series is drawn.
    seed : int
        Of the random numbers.
    """
    rng = np.random.default_rng([seed, draws])
    test, truth = series.order, valve.threshold_at(series.dp)
    number = np.array([int(np.sum(test[:at] == one)) for at, one in enumerate(test)])
    ramp_se = bench.knee_errors(valve, series.dp, series.ramp_time)
    spread = np.hypot(valve.scatter, ramp_se)[test]
    lag = bench.lag.shift_at(np.full(series.dp.size, bench.u_max / series.ramp_time), rising=False)
    zero = bench.meter_zero / valve.slope_at(series.dp)
    grid = np.linspace(series.dp[0], series.dp[-1], GRID)
    on_grid = valve.threshold_at(grid)
    expected = _direction(truth, bench)
    losses, directions = np.empty(draws), []
    for draw in range(draws):
        knee = truth[test] + spread * rng.standard_normal(test.size)
        known = RampKnees(test=test, number=number, knee=knee, noise=ramp_se[test] ** 2, when=series.when)
        declared = valve.scatter if series.rounds == 1 else None
        offset, direction = _certified(series, known, ramp_se, declared, bench, lag + zero)
        losses[draw] = float(np.mean(on_grid - np.interp(grid, series.dp, offset)))
        directions.append(direction)
    loss, of_known = float(losses.mean()), staircase(truth, expected)[1]
    of_staircase = float(np.mean(on_grid - np.interp(grid, series.dp, of_known)))
    of_lag, of_zero = float(lag.mean()), float(zero.mean())
    noise, share = float(np.mean(ramp_se**2)), 1 / series.rounds
    # Scatter moves what was found and the next closing. So does noise where repeats measure the two as one, which the
    # bounds take for scatter; beside a declared scatter it moves only what was found.
    scattered, noisy = valve.scatter**2 * (1 + share), noise * (share if series.rounds == 1 else 1 + share)
    of_bound, of_scatter = loss - of_staircase - of_lag - of_zero, scattered / (scattered + noisy)
    return Prediction(
        knee_se=ramp_se,
        loss=loss,
        loss_of_nine=float(np.quantile(losses, 0.9)),
        of_scatter=of_bound * of_scatter,
        of_noise=of_bound * (1 - of_scatter),
        of_lag=of_lag,
        of_zero=of_zero,
        of_staircase=of_staircase,
        trend_found=sum(direction == expected for direction in directions) / draws,
    )


def _direction(threshold: np.ndarray, bench: Bench) -> Direction:
    """Return how a threshold that is known runs with the pressure drop."""
    change = float(threshold[-1] - threshold[0])
    if abs(change) < bench.flat_below * bench.u_max:
        return "flat"
    return "decreasing" if change < 0 else "increasing"


def _certified(
    series: Series,
    known: RampKnees,
    ramp_se: np.ndarray,
    declared: float | None,
    bench: Bench,
    budget: np.ndarray,
) -> tuple[np.ndarray, Direction]:
    """Return the offset that the ramps' knees certify at each pressure drop, V (T,), and the direction found."""
    counts = np.bincount(known.test)
    # On the premise that the valve scatters alike: a test that refuses that by chance is answered by more ramps.
    between = pool_scatter(known, counts.tolist(), declared=declared, u_max=bench.u_max)
    mean, mean_se = _brought_together(known, between, counts), ramp_se / np.sqrt(counts)
    covariance = between.covariance_of_mean(mean_se)
    degrees = float(between.degrees_of_freedom(mean_se, DEGREES_OF_FREEDOM).min())
    flat_below = bench.flat_below * bench.u_max
    direction = find_trend(series.dp, mean, covariance, degrees, bench.u_max, flat_below).direction
    ordered = _ordered(mean, mean_se, direction)
    apart = np.abs(mean - mean.mean()) if direction == "flat" else np.abs(mean - ordered)
    departure = excess_departure(apart, np.sqrt(np.diag(covariance)), flat_below).max() if mean.size > 1 else 0.0
    bound = lower_bounds(ordered, mean_se, between, bench.confidence, budget + departure)
    return staircase(bound, direction)[1], direction


def _brought_together(known: RampKnees, between: BetweenRamps, counts: np.ndarray) -> np.ndarray:
    """Return the mean knee of each pressure drop in the middle of the series, V (T,)."""
    clock = (known.when - known.when.min()) / max(float(np.ptp(known.when)), np.finfo(float).tiny) - 0.5
    middle = known.knee - (between.drift.change * clock if between.drift else 0.0)
    mean: np.ndarray = np.bincount(known.test, weights=middle) / counts
    return mean


def _ordered(mean: np.ndarray, mean_se: np.ndarray, direction: Direction) -> np.ndarray:
    """Return the knees that run the way of the trend and lie nearest: what the constrained fit does to straight lines.

    The constrained fit takes 40 ms and a prediction some thousand of them; for lines that are independent it is an
    isotonic regression, to second order of its likelihood.
    """
    if direction == "flat" or mean.size < 2:
        return mean
    from scipy.optimize import isotonic_regression

    ordered: np.ndarray = isotonic_regression(mean, weights=mean_se**-2, increasing=direction == "increasing").x
    return ordered
