"""The table of docs/howto/plan-series.md: more pressure drops and more ramps buy millivolts, and no bound is missed."""

import numpy as np
from series_bench import SeriesBench
from series_gain import one_valve


def test_pressure_drops_and_ramps_buy_millivolts():
    series = {"few": (2, 3), "more pressures": (5, 3), "more ramps": (5, 6)}
    found = {
        name: [one_valve(SeriesBench(scatter=0.01), *each, 20, np.random.default_rng(number)) for number in range(3)]
        for name, each in series.items()
    }
    few, pressures, ramps = (np.mean([loss for loss, _ in each]) for each in found.values())
    assert few > pressures > ramps > 0
    assert not any(below for each in found.values() for _, below in each)
