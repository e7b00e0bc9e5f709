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

from jobs import fault_jobs
from kills import run_kills
from power_cut import run_job
from scoreboard import Row, print_rows, run_parts, say

CUTS, KILLS = 20, 200


def print_power_cuts(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows: what power cuts left of the artefacts of each command."""
    cuts, rng, rows = 5 if quick else CUTS, random.Random(seed), []
    with TemporaryDirectory() as name:
        for job in fault_jobs(Path(name)):
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


def print_kills(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows: what kills at random times left of the artefacts and processes of each command."""
    rng, found = random.Random(seed), []
    with TemporaryDirectory() as name:
        jobs = fault_jobs(Path(name))
        for job in jobs:
            kills = (KILLS // 10 if quick else KILLS) // len(jobs) + 1
            say(f"{kills} kills of {job.name}")
            mine = run_kills(job, Path(name) / "kills", kills, rng)
            print(f"{job.name}: {dict(Counter((kill.writing, kill.left) for kill in mine))}")
            found += mine
    for kill in found:
        if kill.left.startswith("BROKEN") or kill.processes_left or kill.folders_left or not kill.made_again:
            print(kill)
    of = f"of {len(found)}, seed {seed}, {sum(kill.writing for kill in found)} of them while something was written"
    rows = [
        Row(what="artefacts broken by a kill", value=sum(k.left.startswith("BROKEN") for k in found), limit=0, note=of),
        Row(what="processes left after 5 s", value=sum(k.processes_left for k in found), limit=0, note=of),
        Row(
            what="temporary files left after the next run",
            value=sum(len(k.folders_left) for k in found),
            limit=0,
            note=of,
        ),
        Row(what="not made again by the next run", value=sum(not k.made_again for k in found), limit=0, note=of),
    ]
    print_rows("Kills", rows)
    return rows


PARTS = {"kills": (print_kills, 28), "power-cuts": (print_power_cuts, 27)}

if __name__ == "__main__":
    raise SystemExit(run_parts(__doc__.splitlines()[0], PARTS, "a quarter of each", None))
