"""Benchmark of `dzdesign batch`: a lot of 1000 valves, 10 of them broken; ``run.py [--quick] [--only blocks]``.

``--valves N`` takes another number of valves.

Exit status 1 if a limit is missed.
"""

import argparse
import csv
import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "POLARS_MAX_THREADS"):
    os.environ.setdefault(_threads, "1")
sys.path[:0] = [str(Path(__file__).parents[1]), str(Path(__file__).parents[1] / "identify")]

from many_blocks import print_blocks  # noqa: E402
from many_valves import write_lot  # noqa: E402
from scoreboard import Row, print_rows, run_parts, say  # noqa: E402

BROKEN = 10
#: Valves of which the jobs are compared.
COMPARED = 100
COMMAND = "import sys; from dzdesign.command_line.cli import main; sys.exit(main(sys.argv[1:]))"


def timed_batch(lot: Path, output: Path, jobs: int) -> tuple[float, list[dict[str, str]]]:
    """Run the command in a process of its own; return its seconds and the rows of the table."""
    arguments = ["batch", str(lot), "-o", str(output), "--jobs", str(jobs), "--meter-lag", "0.1 s"]
    start = perf_counter()
    done = subprocess.run([sys.executable, "-c", COMMAND, *arguments], stdout=subprocess.PIPE, text=True, check=False)
    seconds = perf_counter() - start
    if done.returncode not in (0, 1):
        raise RuntimeError(f"batch ended with {done.returncode}")
    with open(output / "valves.csv", encoding="utf-8", newline="") as table:
        return seconds, list(csv.DictReader(table))


def print_lot(*, quick: bool, seed: int, valves: int | None = None) -> list[Row]:
    """Print and return the rows: what became of each valve, and what it took."""
    count = valves or (60 if quick else 1000)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        say(f"writing the ramp tests of {count} valves")
        broken = write_lot(folder / "lot", count, BROKEN, seed)
        say("calibrating them, two jobs")
        first, table = timed_batch(folder / "lot", folder / "out", 2)
        say("once more: all is done")
        again, same = timed_batch(folder / "lot", folder / "out", 2)
        compared = min(count, COMPARED)
        for path in sorted((folder / "lot").iterdir())[:compared]:
            shutil.copytree(path, folder / "part" / path.name)
        say(f"the first {compared} with one job and with two")
        seconds = {jobs: timed_batch(folder / "part", folder / f"out{jobs}", jobs)[0] for jobs in (1, 2)}
    calibrated = {row["name"] for row in table if row["status"] == "ok"}
    reasons = {row["name"]: row["reason"] for row in table if row["status"] != "ok"}
    for name, kind in broken.items():
        print(f"{name}, {kind}: {reasons.get(name, 'CALIBRATED')}")
    other = sum(one != two for one, two in zip(table, same, strict=True))
    rows = [
        Row(what="good valves without a result", value=count - BROKEN - len(calibrated - set(broken)), limit=0),
        Row(
            what="broken valves without a reason of their own",
            value=BROKEN - len({reasons[name] for name in broken if reasons.get(name)}),
            limit=0,
            note=f"of {BROKEN}, each broken in another way",
        ),
        Row(what="rows that another run has otherwise", value=other, limit=0),
        Row(what="time a valve, two jobs", value=first / count, unit="s"),
        Row(what="two jobs over one", value=seconds[2] / seconds[1], limit=0.75, note=f"time of {compared} valves"),
        Row(what="a run with nothing to do over the first", value=again / first, limit=0.15, note=f"{again:.1f} s"),
    ]
    print_rows(f"{count} valves, {BROKEN} of them broken", rows)
    return rows


PARTS = {"lot": print_lot, "blocks": print_blocks}


def main(arguments: list[str] | None = None) -> int:
    """Run the benchmark and print what missed its limit."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--valves", type=int)
    chosen, others = parser.parse_known_args(arguments)
    parts = {name: (partial(part, valves=chosen.valves), 7) for name, part in PARTS.items()}
    return run_parts(__doc__.splitlines()[0], parts, "60 valves, 6 with blocks", others)


if __name__ == "__main__":
    raise SystemExit(main())
