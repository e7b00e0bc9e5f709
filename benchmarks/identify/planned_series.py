"""8c. Series recorded as `dzdesign plan` has them: is the distance below the threshold the one that was predicted?"""

from collections.abc import Iterator

import numpy as np
from planned_bench import L_MIN, MPA, PlannedBench
from scoreboard import Row, print_rows, say

from dzdesign.identify.identification import identify
from dzdesign.identify.knees.meter_lag import find_lag
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.planning.premises import Bench, straight_valve
from dzdesign.identify.planning.search import Plan, PlannedSeries, Request, plan_series

#: Largest difference of the mean distance of all valves from the predicted one, %.
LIMIT = 15.0
#: Case -> the valve and its bench, minutes, and which of the series of the plan.
CASES = {
    "10 min": (PlannedBench(), 10, "plan"),
    "10 min, no repeats": (PlannedBench(), 10, "no repeats"),
    "1 h": (PlannedBench(), 60, "plan"),
    "little scatter, twice the noise": (PlannedBench(scatter=0.005, noise=0.3), 15, "plan"),
    "much scatter": (PlannedBench(scatter=0.05), 20, "plan"),
    "a flat threshold": (PlannedBench(fall_per_MPa=0.0), 15, "plan"),
    "a rising threshold": (PlannedBench(fall_per_MPa=-0.05), 15, "plan"),
    "a threshold whose trend is found now and then": (PlannedBench(fall_per_MPa=0.015), 15, "plan"),
}


def print_planned_series(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 8c."""
    count = 30 if quick else 200
    rows = [
        row
        for number, (what, (bench, minutes, which)) in enumerate(CASES.items())
        for row in _rows(what, bench, minutes, which, count, np.random.default_rng([seed, number]))
    ]
    print_rows(
        f"8c. Mean distance of the offset below the threshold against the plan's, {count} valves (seed {seed})", rows
    )
    return rows


def plan_for(bench: PlannedBench, minutes: float) -> Plan:
    """Plan a series for a bench, all premises true of it."""
    low, high = bench.threshold(1.0), bench.threshold(5.0)
    valve = straight_valve(
        (1 * MPA, 5 * MPA), threshold=low, change=low - high, max_flow=bench.gain * (10 - low) * L_MIN, u_max=10.0,
        scatter=bench.scatter,
    )  # fmt: skip
    lag = find_lag([], IdentifyOptions(meter_lag=bench.lag))
    on_bench = Bench(u_max=10.0, noise=bench.noise * L_MIN, sample_rate=bench.rate_Hz, lag=lag, pause=20.0)
    wanted = Request(dp_range=(1 * MPA, 5 * MPA), budget=60 * minutes, ramp_times=(20.0, 200.0))
    return plan_series(valve, on_bench, wanted)


def distances(
    bench: PlannedBench, planned: PlannedSeries, count: int, rng: np.random.Generator
) -> Iterator[tuple[float, bool]]:
    """Yield of each of many valves the mean distance, V, and whether a next closing at a test lies below the offset."""
    series = planned.series
    declared = bench.scatter / 10 if series.rounds == 1 else None
    # `plan` predicts what the weakest premise certifies.
    options = IdentifyOptions(meter_lag=bench.lag, repeatability=declared, curve="monotone")
    order, dp_MPa = series.dp[series.order] / MPA, series.dp / MPA
    for _ in range(count):
        valve = identify(bench.record(order, series.ramp_time, series.pause, rng), options)
        closing = bench.threshold(dp_MPa) + bench.scatter * rng.standard_normal(dp_MPa.size)
        yield bench.distance(valve), bool(np.any(closing < valve.positive.curve.u_offset_V))


def _rows(
    what: str, bench: PlannedBench, minutes: float, which: str, count: int, rng: np.random.Generator
) -> Iterator[Row]:
    """Yield the rows of one case."""
    say(f"planned series: {what}, {count} valves")
    plan = plan_for(bench, minutes)
    planned = {"plan": plan.chosen, **plan.alternatives}[which]
    found = list(distances(bench, planned, count, rng))
    achieved, predicted = np.array([distance for distance, _ in found]), planned.prediction.loss
    series, error = planned.series, achieved.std() / np.sqrt(count)
    note = (
        f"{1e3 * achieved.mean():.1f} ± {1e3 * error:.1f} mV, predicted {1e3 * predicted:.1f} mV: "
        f"{series.dp.size} pressure drops, {series.order.size} ramps of {series.ramp_time:g} s; "
        f"{np.mean(achieved <= planned.prediction.loss_of_nine):.0%} below what nine of ten are"
    )
    off = 100 * abs(achieved.mean() / predicted - 1)
    yield Row(what=f"{what}: off the prediction", value=off, limit=LIMIT, unit="%", note=note)
    opened = 100 * float(np.mean([one for _, one in found]))
    yield Row(what=f"{what}: next closing below the offset", value=opened, unit="%")
