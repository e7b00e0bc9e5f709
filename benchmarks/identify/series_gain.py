"""8c. What a test series buys: distance of the certified offset below the true threshold, by pressures and ramps."""

import numpy as np
from scoreboard import Row, print_rows, say
from series_bench import SeriesBench

from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions

#: Pressure drops of the series, spread evenly, MPa; the time between two ramps, s.
LOWEST, HIGHEST, PAUSE = 1.0, 5.0, 20.0
#: Pressure drops, ramps at each, and time of a ramp in one direction, s. A single round has its scatter declared.
SERIES = (
    (2, 3, 20), (3, 1, 20), (3, 3, 20), (3, 6, 20), (3, 3, 100), (5, 1, 20), (5, 2, 20), (5, 3, 20), (5, 6, 20),
    (5, 3, 100), (9, 1, 20), (9, 2, 20), (9, 3, 20),
)  # fmt: skip
#: Valves that scatter from ramp to ramp by so much, V.
SCATTERS = {"0.25 %": 0.025, "0.05 %": 0.005}
#: Largest share of series whose next closing at a test lies below the offset, %; bounds hold with 99 % confidence.
LIMIT = 3.0


def print_series_gain(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 8c; those of docs/howto/plan-series.md are of 100 valves."""
    count = 10 if quick else 100
    rows = []
    for number, ((name, scatter), series) in enumerate((each, one) for each in SCATTERS.items() for one in SERIES):
        pressures, rounds, ramp_s = series
        bench = SeriesBench(scatter=scatter)
        rng = np.random.default_rng([seed, number])
        say(f"series: {pressures} x {rounds} ramps of {ramp_s} s")
        found = [one_valve(bench, pressures, rounds, ramp_s, rng) for _ in range(count)]
        loss, opened = 1e3 * np.array([loss for loss, _ in found]), 100 * np.mean([below for _, below in found])
        what = f"scatter {name}, {pressures} x {rounds} ramps of {ramp_s} s"
        minutes = (pressures * rounds + 1) * (2 * ramp_s + PAUSE) / 60
        note = f"{minutes:.0f} min; nine of ten below {np.quantile(loss, 0.9):.0f} mV"
        rows.append(Row(what=what, value=float(loss.mean()), unit="mV", note=note))
        rows.append(Row(what=f"{what}: next closing below", value=float(opened), limit=LIMIT, unit="%"))
    print_rows(f"8c. Mean distance of the offset below the threshold, {count} valves (seed {seed})", rows)
    return rows


def one_valve(
    bench: SeriesBench, pressures: int, rounds: int, ramp_s: float, rng: np.random.Generator
) -> tuple[float, bool]:
    """Return of one recorded valve the mean distance, V, and whether a next closing at a test is below the offset.

    Each round runs through the pressure drops in a random order, and the first one is repeated at the end: that tells a
    drift from the effect of the pressure drop.
    """
    dp_MPa = np.linspace(LOWEST, HIGHEST, pressures)
    order = np.concatenate([rng.permutation(dp_MPa) for _ in range(rounds)])
    options = IdentifyOptions(meter_lag=bench.lag, repeatability=bench.scatter / 10 if rounds == 1 else None)
    valve = identify(bench.record([*order, order[0]], ramp_s, PAUSE, rng), options)
    curve = valve.positive.curve
    closing = bench.threshold(dp_MPa) + bench.scatter * rng.standard_normal(pressures)
    below = closing < np.interp(dp_MPa, curve.offset_dp_MPa, curve.offset_V)
    return bench.distance(valve), bool(below.any())
