"""Benchmarks of `dzdesign identify`, each number beside its limit: ``run.py [--quick] [--only NAME]``.

The threshold that is measured is the product's knee: the straight part of Q/sqrt(dP), extrapolated to zero. Every valve
of parts 1-4 opens sharply into a straight line, so that knee, onset and u_min are one and the same.
Exit status 1 if a limit is missed.
"""

import os
import sys
from pathlib import Path

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "POLARS_MAX_THREADS"):
    os.environ.setdefault(_threads, "1")  # before NumPy is imported: ratios of one core
# For the recordings as loggers write them, and for the scoreboard that all benchmarks share.
sys.path[:0] = [str(Path(__file__).parent / "recordings"), str(Path(__file__).parents[1])]

from accuracy import print_accuracy  # noqa: E402
from bound_coverage import print_coverage, print_over_compensation, print_residual  # noqa: E402
from corpus import print_corpus  # noqa: E402
from corpus_units import print_corpus_of_units  # noqa: E402
from measured import print_measured  # noqa: E402
from meters import print_meters  # noqa: E402
from ramp_families import print_ramp_families  # noqa: E402
from ramp_series import print_ramp_series  # noqa: E402
from random_valves import print_random_valves  # noqa: E402
from reading import print_reading  # noqa: E402
from scoreboard import run_parts  # noqa: E402
from series_gain import print_series_gain  # noqa: E402
from soft_edges import print_soft_edges  # noqa: E402
from stops import print_stops  # noqa: E402
from timing import print_timing  # noqa: E402
from worn_valves import print_worn_valves  # noqa: E402

PARTS = {
    "accuracy": (print_accuracy, 101),
    "coverage": (print_coverage, 202),
    "over-compensation": (print_over_compensation, 203),
    "residual": (print_residual, 303),
    "ramp-families": (print_ramp_families, 848),
    "ramp-series": (print_ramp_series, 818),
    "series-gain": (print_series_gain, 828),
    "stops": (print_stops, 909),
    "meters": (print_meters, 1010),
    "corpus": (print_corpus, 909),
    "corpus-units": (print_corpus_of_units, 0),
    "soft-edges": (print_soft_edges, 1313),
    "worn-valves": (print_worn_valves, 1616),
    "random": (print_random_valves, 404),
    "measured": (print_measured, 0),
    "timing": (print_timing, 0),
    "reading": (print_reading, 707),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the parts asked for and print what missed its limit."""
    return run_parts(__doc__.splitlines()[0], PARTS, "few replicates: minutes, and wide intervals", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
