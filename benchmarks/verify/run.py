"""Benchmarks of `dzdesign verify`, each number beside its limit: ``run.py [--quick] [--only NAME]``.

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

from all_inputs import print_inputs  # noqa: E402
from mutants import print_mutants  # noqa: E402
from plant import print_plant  # noqa: E402
from scoreboard import print_rows  # noqa: E402

PARTS = {
    "inputs": (print_inputs, 101),
    "plant": (print_plant, 303),
    "mutants": (print_mutants, 202),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the parts asked for and print what missed its limit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few rounds and mutants")
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
