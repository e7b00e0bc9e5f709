"""`batch --calibration block` on a lot: one firmware, a block a valve, and what identification, design and check take.

Time is that of the processor, with all that the batch calls, as `timed_batch` finds it of every valve.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from many_valves import write_lot
from scoreboard import Row, print_rows, say
from timed_batch import BARE_EVERY

PROGRAM = Path(__file__).parent / "timed_batch.py"
COUNT, FEW, LAG = 1000, 6, "0.1 s"
MOST_BEYOND_s, TIMES_BARE = 0.05, 1.8


def print_blocks(*, quick: bool, seed: int, valves: int | None = None) -> list[Row]:
    """Print and return the rows."""
    count = valves or (FEW if quick else COUNT)
    with TemporaryDirectory() as temporary:
        lot, output = Path(temporary) / "lot", Path(temporary) / "out"
        say(f"writing the ramp tests of {count} valves")
        write_lot(lot, count, 0, seed)
        say("a batch of them, one job, each block on every input, and the core bare")
        rows = _rows(lot, output, Path(temporary) / "times.json", count)
    print_rows(f"{count} valves with one firmware", rows)
    return rows


def _rows(lot: Path, output: Path, times: Path, count: int) -> list[Row]:
    arguments = ["batch", str(lot), "-o", str(output), "--jobs", "1", "--meter-lag", LAG, "--calibration", "block"]
    clock = perf_counter()
    command = [sys.executable, str(PROGRAM), str(times), *arguments]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True, env=os.environ)
    clock_s = (perf_counter() - clock) / count
    found = json.loads(times.read_bytes())
    taken = {name: sum(parts) for name, parts in found.items()}
    whole_s = (taken["whole"] - taken["bare"] - taken["build bare"]) / count
    identify_s, check_s, bare_s = (taken[name] / len(found[name]) for name in ("identify", "check", "bare"))
    valves = sorted((output / "valves").iterdir())
    without = [path.name for path in valves if not (path / "calibration.bin").is_file() or not _holds(path)]
    projects = [path for path in output.rglob("manifest.json") if (path.parent / "core").is_dir()]
    ratios = sorted(check / bare for check, bare in zip(found["check"][::BARE_EVERY], found["bare"], strict=True))
    return [
        Row(what="valves without a block that holds on every input", value=len(without) + count - len(valves), limit=0),
        Row(what="firmware projects beside the one", value=len(projects) - 1, limit=0),
        Row(what="whole batch a valve", value=whole_s, unit="s", note=f"by the clock, bare runs too, {clock_s:.2f} s"),
        Row(what="identification a valve", value=identify_s, unit="s"),
        Row(what="check of every input a valve", value=check_s, unit="s"),
        Row(what="beyond identification and that check, a valve", value=whole_s - identify_s - check_s, unit="s",
            limit=MOST_BEYOND_s, note="design, block, files, and a valve's share of start, lot setting, table, report"),
        Row(what="check of every input over the bare batch", value=check_s / bare_s, limit=TIMES_BARE,
            note=f"all checks; bare every {BARE_EVERY}th, {bare_s:.3f} s; middle of the ratios "
            f"{ratios[len(ratios) // 2]:.2f}"),
    ]  # fmt: skip


def _holds(valve: Path) -> bool:
    return json.loads((valve / "calibration_check.json").read_bytes())["holds"]
