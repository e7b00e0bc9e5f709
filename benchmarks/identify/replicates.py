"""Monte Carlo through the product: what each replicate gives, beside the truth."""

import multiprocessing
import os
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from bench_model import L_MIN, U_MAX_V, Bench, readings
from scoreboard import say

from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import ValveModel

#: Points of the pressure drop at which the offset is held against the truth.
GRID = 451
#: Replicates that a process takes at a time.
CHUNK = 10
#: Bench, seed, options and estimator of the replicates in work: a process that is forked off has them.
_work: dict = {}


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcomes:
    """Of R replicates and T tests; refused replicates are left out and counted.

    Attributes
    ----------
    middle, closing, closing_se : (R, T) array
        Errors of the middle of both knees, of the closing knee (V), and the closing knee's claimed standard error.
    middle_found : (R, T) array
        The middle of both knees itself, V.
    bound_excess : (R,) array
        Largest lower bound less true closing threshold over the tests, V; above 0 the simultaneous bound failed.
    offset_excess : (R,) array
        Largest offset less true closing threshold over the interval, V; above 0 the valve is open at zero command.
    residual, residual_volts : (R,) array
        Largest residual dead zone over the interval beyond the hysteresis: share of the command range, and distance
        between offset and closing threshold over u_max.
    beta_last, law_beta_last : (R,) array
        Identified beta, Eq. (5), of the closing threshold at the largest pressure drop, and the certified offset's.
    beta_last_se : (R,) array
        Claimed standard error of the former.
    trends : dict
        Trend -> replicates.
    refusals : tuple of str
        Messages.
    """

    middle: np.ndarray
    closing: np.ndarray
    closing_se: np.ndarray
    middle_found: np.ndarray
    bound_excess: np.ndarray
    offset_excess: np.ndarray
    residual: np.ndarray
    residual_volts: np.ndarray
    beta_last: np.ndarray
    law_beta_last: np.ndarray
    beta_last_se: np.ndarray
    trends: dict[str, int]
    refusals: tuple[str, ...]


def options_for(bench: Bench, **changes: object) -> IdentifyOptions:
    """Return what an engineer declares: the meter's floor and lag, both exact, and a valve that repeats exactly.

    The limits are those of the weakest premise; `curve_premises` has the others.
    """
    known = {"meter_floor": bench.floor_L_min * L_MIN, "meter_lag": bench.lag_s}
    known |= {"meter_lag_tolerance": 0.0, "repeatability": 0.0, "curve": "monotone"}
    return IdentifyOptions(**(known | changes))


def run_replicates(bench: Bench, count: int, seed: int, options: IdentifyOptions, estimator=identify) -> Outcomes:
    """Identify `count` replicates and hold each against the truth.

    Parameters
    ----------
    bench : Bench
        What is measured.
    count, seed : int
        Replicates, and the seed of their noise.
    options : IdentifyOptions
        Choices of the engineer.
    estimator : callable
        Ramp tests and options to a `ValveModel`; the product's unless a test seeds a wrong one.
    """
    _work.update(bench=bench, seed=seed, options=options, estimator=estimator)  # what the processes inherit
    rows: list[dict] = []
    trends: dict[str, int] = {}
    refusals: list[str] = []
    chunks = [(first, min(CHUNK, count - first)) for first in range(0, count, CHUNK)]
    for done, (found, refused) in enumerate(_in_parallel(chunks), start=1):
        if done * CHUNK % 500 == 0:
            say(f"  {done * CHUNK} of {count}")
        refusals += refused
        for row in found:
            trend = row.pop("trend")
            trends[trend] = trends.get(trend, 0) + 1
            rows.append(row)
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return Outcomes(**columns, trends=trends, refusals=tuple(refusals))


def _in_parallel(chunks: list[tuple[int, int]]) -> Iterator[tuple[list[dict], list[str]]]:
    """Yield what each chunk of replicates gives, in order, from as many processes as there are processors."""
    jobs = min(os.cpu_count() or 1, len(chunks))
    if jobs < 2 or "fork" not in multiprocessing.get_all_start_methods():
        yield from map(_replicates, chunks)
        return
    with multiprocessing.get_context("fork").Pool(jobs) as pool:
        yield from pool.imap(_replicates, chunks)


def _replicates(chunk: tuple[int, int]) -> tuple[list[dict], list[str]]:
    """Identify some replicates of the work at hand: what each gives beside the truth, and the refusals."""
    first, count = chunk
    bench, options, estimator = _work["bench"], _work["options"], _work["estimator"]
    dp = np.array(bench.pressures_MPa)
    rows, refusals = [], []
    for tests in readings(bench, count, _work["seed"], first):
        try:
            valve = estimator(tests, options)
        except InputError as error:
            refusals.append(str(error))
            continue
        rows.append(_held_against_truth(valve, bench, dp) | {"trend": valve.positive.trend})
    return rows, refusals


def _held_against_truth(valve: ValveModel, bench: Bench, dp: np.ndarray) -> dict:
    side = valve.positive
    opening = np.array([test.u_knee_rising_V for test in side.tests])
    closing = np.array([test.u_knee_falling_V for test in side.tests])
    grid = np.linspace(dp[0], dp[-1], GRID)
    beta = np.interp(grid, side.beta.dp_MPa, side.beta.beta)
    offset, true_closing = np.interp(grid, side.curve.offset_dp_MPa, side.curve.offset_V), bench.closing_V(grid)
    gain = beta * (side.k_x_max_over_u_max - 1) + 1  # Eq. (18)
    short = (true_closing - offset) / U_MAX_V
    middle = (opening + closing) / 2
    return {
        "middle": middle - bench.threshold_V(dp),
        "middle_found": middle,
        "closing": closing - bench.closing_V(dp),
        "closing_se": np.array([test.u_knee_se_V for test in side.tests]),
        "bound_excess": max(test.u_guard_lower_V - bench.closing_V(test.dp_MPa) for test in side.tests),
        "offset_excess": float((offset - true_closing).max()),
        "residual": float((short / gain).max()),
        "residual_volts": float(short.max()),
        "beta_last": side.beta.beta[-1],
        "law_beta_last": offset[-1] / np.interp(side.reference.dp_MPa, grid, offset),
        "beta_last_se": side.beta.beta_se[-1],
    }
