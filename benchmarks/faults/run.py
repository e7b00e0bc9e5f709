"""Benchmark of faults of the machine: power cuts and kills; ``run.py [--quick] [--only PART]``.

Exit status 1 if a limit is missed. Power cuts need root and loop devices.
"""

import os
import random
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))  # for the scoreboard that all benchmarks share

from jobs import power_cut_jobs
from power_cut import run_job
from scoreboard import Row, print_rows, run_parts, say

CUTS = 20


def print_power_cuts(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows: what power cuts left of the artefacts of each command."""
    cuts, rng, rows = 5 if quick else CUTS, random.Random(seed), []
    with TemporaryDirectory() as name:
        for job in power_cut_jobs(Path(name)):
            say(f"{cuts} power cuts of {job.name}")
            (folder := Path(name) / "disk").mkdir(exist_ok=True)
            found = run_job(job, folder, cuts, rng)
            print(f"{job.name}: {dict(Counter((cut.during, cut.left) for cut in found))}")
            broken = sum(cut.left.startswith("BROKEN") for cut in found)
            of = f"of {cuts}, seed {seed}"
            rows.append(Row(what=f"{job.name}: artefacts broken by a power cut", value=broken, limit=0, note=of))
            stuck = sum(not cut.made_again for cut in found)
            rows.append(Row(what=f"{job.name}: not made again afterwards", value=stuck, limit=0, note=of))
    print_rows("Power cuts", rows)
    return rows


PARTS = {"power-cuts": (print_power_cuts, 27)}

if __name__ == "__main__":
    raise SystemExit(run_parts(__doc__.splitlines()[0], PARTS, "a quarter of each", None))
