"""15. The certified offset under a premise, through raw recordings: how often it lies above the true threshold.

As part 14, but with what a logger would write: ramps of a valve with that threshold on a meter with a floor, a lag that
is declared, and noise from white to AR 0.99. The closing and the opening guard are counted apart.
"""

import numpy as np
from bench_model import Bench, readings
from curve_premises import GRID, PRESSURES, SHAPES, draw_truth, most
from scoreboard import Row, print_rows, say

from dzdesign.identify.constants import PREMISES
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions

#: Error of a knee about which the bends are drawn, V.
KNEE_ERROR = 0.002
CORRELATIONS = (0.0, 0.9, 0.99)
#: Premises by number of tests: the default of six, and with two a line where the threshold is one.
KINDS = ((6, None, SHAPES), (6, "line", ("line",)), (2, "line", ("line",)), (2, "smooth", ("convex", "kink")))


def check(tests: int, curve: str | None, shape: str, number: int, seed: int) -> tuple[int, int, str]:
    """Return whether the closing and the opening offset exceed their threshold anywhere, and the premise taken."""
    dp = np.array(PRESSURES[tests])
    rng = np.random.default_rng([seed, tests, SHAPES.index(shape), number])
    truth = draw_truth(shape, dp, KNEE_ERROR, rng)
    bench = Bench(
        threshold_V=truth.at, ar=CORRELATIONS[number % len(CORRELATIONS)], noise_L_min=0.08, rate_Hz=25.0,
        pressures_MPa=tuple(dp.tolist()),
    )  # fmt: skip
    recordings = next(readings(bench, 1, seed=1000 * tests + number))
    known = 1.0001 * truth.curvature(dp) / 1e12 if curve == "smooth" else None
    options = IdentifyOptions(
        meter_lag=0.1, meter_lag_tolerance=0.0, repeatability=0.0, curve=curve, curvature=known
    )
    side = identify(recordings, options).positive
    grid, found = np.linspace(*side.valid_dp_MPa, GRID), []
    for guard, threshold in (("closing", bench.closing_V), ("opening", bench.opening_V)):
        each = side.certified[guard]
        found.append(int(np.any(np.interp(grid, each.offset_dp_MPa, each.offset_V) > threshold(grid))))
    return found[0], found[1], side.curve.premise


def print_recorded_premises(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 15."""
    count, rows = 4 if quick else 100, []
    for tests, curve, shapes in KINDS:
        for shape in shapes:
            say(f"premises, recorded: {tests} tests, {curve or 'default'}, {shape}")
            found = [check(tests, curve, shape, number, seed) for number in range(count)]
            taken = ", ".join(f"{name} {sum(each[2] == name for each in found)}" for name in PREMISES)
            for at, guard in enumerate(("closing", "opening")):
                what = f"{tests} tests, {curve or 'default'}, {shape}: above the {guard} threshold"
                above = sum(each[at] for each in found)
                rows.append(Row(what=what, value=above, limit=most(count), note=f"of {count}; taken: {taken}"))
    print_rows(f"15. Certified offset above the true threshold, by premise, through recordings (seed {seed})", rows)
    return rows
