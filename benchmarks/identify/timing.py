"""6. What the fit of 120 000 samples costs, in fits of a straight line by numpy.polyfit to the same samples."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from time import perf_counter

import numpy as np
from bench_model import Bench, readings
from replicates import options_for
from scoreboard import Row, environment, print_rows

from dzdesign.identify.identification import identify

LIMIT = 30.0
SEED = 6
#: Fits, and straight lines, that are timed; one more of each goes before them.
ROUNDS = 5


def work(what: str, times: int) -> None:
    """Do one of the two fits some times: what `perf` counts."""
    bench = Bench()
    (tests,) = readings(bench, 1, SEED)
    u, q = (np.concatenate([getattr(test, name) for test in tests]) for name in ("u", "q"))
    options = options_for(bench)
    for _ in range(times):
        if what == "fit":
            identify(tests, options)
        else:
            np.polyfit(u, q, 1)


def print_timing(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 6."""
    bench = Bench()
    options = options_for(bench)
    # Every round has readings of its own, as in use: a fit must not live on what it kept of the one before.
    tests = list(readings(bench, ROUNDS + 1, SEED))
    samples = [[np.concatenate([getattr(test, name) for test in one]) for name in ("u", "q")] for one in tests]
    fits = _seconds(lambda one: identify(one, options), tests)
    lines = _seconds(lambda one: np.polyfit(*one, 1), samples)
    fit, line = min(fits[1:]), min(lines[1:])
    counts = _instructions()
    rows = [
        Row(what=f"time of the fit over polyfit's, best of {ROUNDS}, {samples[0][0].size} samples", value=fit / line,
            limit=LIMIT if counts is None else None, note=f"{1e3 * fit:.0f} ms and {1e3 * line:.1f} ms, parsing apart; "
            f"the first fit of a process {1e3 * fits[0]:.0f} ms"),
    ]  # fmt: skip
    if counts is None:
        rows.append(Row(what="instructions", value=float("nan"), note="perf is not here or may not count"))
    else:
        text = f"{counts[0] / 1e6:.0f} and {counts[1] / 1e6:.1f} million"
        ratio = counts[0] / counts[1]
        rows.append(Row(what="instructions of the fit over polyfit's", value=ratio, limit=LIMIT, note=text))
    print_rows("6. Cost of the fit", rows)
    return rows


def _seconds(work: Callable, rounds: list) -> list[float]:
    times = []
    for one in rounds:
        start = perf_counter()
        work(one)
        times.append(perf_counter() - start)
    return times


def _instructions() -> tuple[float, float] | None:
    """Return instructions of one fit and of one polyfit: those of six less those of one, over five."""
    if not shutil.which("perf"):
        return None
    counted = []
    for what in ("fit", "polyfit"):
        few, many = _count(what, 1), _count(what, 6)
        if few is None or many is None:
            return None
        counted.append((many - few) / 5)
    return counted[0], counted[1]


def _count(what: str, times: int) -> float | None:
    command = ["perf", "stat", "-x", ",", "-e", "instructions:u", sys.executable, __file__, what, str(times)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment(), check=False)
    for line in done.stderr.splitlines():
        if "instructions" in line and line.split(",")[0].isdigit():
            return float(line.split(",")[0])
    return None


if __name__ == "__main__":
    work(sys.argv[1], int(sys.argv[2]))
