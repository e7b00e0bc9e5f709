"""Benchmarks of `dzdesign identify`, each number beside its limit: ``run.py [--quick] [--only NAME]``.

The threshold that is measured is the product's knee: the straight part of Q/sqrt(dP), extrapolated to zero. Every valve
of parts 1-4 opens sharply into a straight line, so that knee, onset and u_min are one and the same.
Exit status 1 if a limit is missed.
"""

import argparse
import os
import sys
from pathlib import Path
from time import perf_counter

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "POLARS_MAX_THREADS"):
    os.environ.setdefault(_threads, "1")  # before NumPy is imported: ratios of one core
sys.path.insert(0, str(Path(__file__).parents[1]))  # for the scoreboard that all benchmarks share

from accuracy import print_accuracy  # noqa: E402
from coverage import print_coverage, print_over_compensation, print_residual  # noqa: E402
from measured import print_measured  # noqa: E402
from random_valves import print_random_valves  # noqa: E402
from reading import print_reading  # noqa: E402
from scoreboard import print_rows  # noqa: E402
from timing import print_timing  # noqa: E402

PARTS = {
    "accuracy": (print_accuracy, 101),
    "coverage": (print_coverage, 202),
    "over-compensation": (print_over_compensation, 203),
    "residual": (print_residual, 303),
    "random": (print_random_valves, 404),
    "measured": (print_measured, 0),
    "timing": (print_timing, 0),
    "reading": (print_reading, 707),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the parts asked for and print what missed its limit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few replicates: minutes, and wide intervals")
    parser.add_argument("--only", choices=PARTS, action="append", help="one part; may be given again")
    chosen = parser.parse_args(arguments)
    start = perf_counter()
    rows = []
    for name in chosen.only or PARTS:
        part, seed = PARTS[name]
        rows += part(quick=chosen.quick, seed=seed)
        sys.stdout.flush()
    missed = [row for row in rows if row.verdict == "MISSES"]
    if missed:
        print_rows(f"Missed: {len(missed)} of {sum(row.limit is not None for row in rows)} limits", missed)
    print(f"{perf_counter() - start:.0f} s")
    return 1 if missed else 0


if __name__ == "__main__":
    raise SystemExit(main())
