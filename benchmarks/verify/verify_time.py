"""What the comparison with CasADi's CVODES adds to `verify` on the example: its time over that without it.

Each run is a process of its own, in turn with and without. Time of the processor counts, of all its threads and of the
compilers that it calls: what else the machine does is not in it. ``verify_time.py ARGUMENT...`` is such a run.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

from scoreboard import Row, environment, print_rows, say

WITHOUT = "--without-the-comparison"
GOAL, RUNS, FEW = 2.0, 5, 1
PLANT = Path(__file__).parents[2] / "examples" / "paper_valve" / "plant.toml"
PLANTS = {"recorded flow": [], "plant of equations": ["--plant", str(PLANT)]}


def print_verify_time(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows; nothing is drawn."""
    from firmware import example_firmware

    del seed
    rows = []
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
        example_firmware(Path(folder) / "firmware")
        for name, given in PLANTS.items():
            say(f"time of verify: {name}")
            call = ["verify", str(Path(folder) / "firmware"), "--output", str(Path(folder) / "evidence"), *given]
            taken = [(_taken(call), _taken([*call, WITHOUT])) for _ in range(FEW if quick else RUNS)]
            with_it, without = ([min(times) for times in zip(*runs, strict=True)] for runs in zip(*taken, strict=True))
            note = f"{with_it[0]:.1f} s over {without[0]:.1f} s, least of {len(taken)}; "
            note += f"by the clock {with_it[1]:.1f} s over {without[1]:.1f} s"
            what = f"{name}: time of the processor over that without it"
            rows.append(Row(what=what, value=with_it[0] / without[0], limit=GOAL, note=note))
    print_rows("What the comparison with CasADi's CVODES adds to verify", rows)
    return rows


def _taken(arguments: list[str]) -> tuple[float, float]:
    """Return time of the processor, of a run and all that it called, and by the clock, s."""
    begin = perf_counter()
    run = subprocess.Popen([sys.executable, __file__, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                           env=environment())  # fmt: skip
    _, status, used = os.wait4(run.pid, 0)
    run.returncode = os.waitstatus_to_exitcode(status)
    if run.returncode not in (0, 1):  # 1: the valve.json is not beside this firmware
        raise RuntimeError(f"verify ended with {run.returncode}")
    return used.ru_utime + used.ru_stime, perf_counter() - begin


def main(arguments: list[str]) -> int:
    """Verify as the command line does, without the comparison where that is asked for; it then counts as held."""
    from dzdesign.command_line.cli import main as command_line
    from dzdesign.verify import verification
    from dzdesign.verify.requirements import NATIVE_PLANT

    if WITHOUT in arguments:
        verification.compare_with_cvodes = lambda *_: NATIVE_PLANT.check(holds=True, text="left out")
    return command_line([each for each in arguments if each != WITHOUT])


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
