"""How often a certified offset lies above the true closing threshold, by premise, through raw recordings.

    python -m benchmarks.identify.premises_recorded [recordings of each kind]

As `premises.py`, but with what a logger would write: ramps of a valve with that threshold on a meter with a floor, a
lag that is declared, and noise from white to AR 0.99. Failures of the closing and of the opening guard are counted
apart.
"""

import sys
from collections.abc import Iterator

import numpy as np

from benchmarks.identify.bench_model import Bench, readings
from benchmarks.identify.premises import GRID, PRESSURES, SHAPES, draw_truth
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions

#: Error of a knee about which the bends are drawn, V.
KNEE_ERROR = 0.002
CORRELATIONS = (0.0, 0.9, 0.99)
#: Premises by number of tests: the default of six, and with two a line where the threshold is one.
KINDS = ((6, None, SHAPES), (6, "line", ("line",)), (2, "line", ("line",)), (2, "smooth", ("convex", "kink")))


def check(tests: int, curve: str | None, shape: str, number: int) -> tuple[int, int, str]:
    """Return whether the closing and the opening offset exceed their threshold anywhere, and the premise taken."""
    dp = np.array(PRESSURES[tests])
    rng = np.random.default_rng([21, tests, SHAPES.index(shape), number])
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


def table(count: int) -> Iterator[str]:
    """Yield a line for each kind."""
    for tests, curve, shapes in KINDS:
        for shape in shapes:
            rows = [check(tests, curve, shape, number) for number in range(count)]
            taken = {name: sum(row[2] == name for row in rows) for name in {row[2] for row in rows}}
            yield (
                f"{tests} tests, --curve {curve or 'default':8} {shape:8} above the closing threshold "
                f"{sum(row[0] for row in rows)} of {count}, the opening one {sum(row[1] for row in rows)}; "
                f"taken {taken}"
            )


if __name__ == "__main__":
    for line in table(int(sys.argv[1]) if len(sys.argv) > 1 else 100):
        print(line, flush=True)
