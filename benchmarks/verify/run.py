"""Benchmarks of `dzdesign verify`, each number beside its limit: ``run.py [--quick] [--only NAME]``.

Exit status 1 if a limit is missed.
"""

import os
import sys
from pathlib import Path

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "POLARS_MAX_THREADS"):
    os.environ.setdefault(_threads, "1")  # before NumPy is imported: ratios of one core
sys.path.insert(0, str(Path(__file__).parents[1]))  # for the scoreboard that all benchmarks share
sys.path.insert(0, str(Path(__file__).parents[2]))  # for what tests support

from above_tests import print_above  # noqa: E402
from all_inputs import print_inputs  # noqa: E402
from calibration_blocks import print_blocks  # noqa: E402
from current_loop import print_current_loop  # noqa: E402
from current_valve import print_current_valve  # noqa: E402
from hunting import print_hunting  # noqa: E402
from hysteresis import print_hysteresis  # noqa: E402
from mutants import print_mutants  # noqa: E402
from native_plant import print_native_plant  # noqa: E402
from scoreboard import run_parts  # noqa: E402
from stand_in_flow import print_stand_in  # noqa: E402
from verify_time import print_verify_time  # noqa: E402

PARTS = {
    "inputs": (print_inputs, 101),
    "native-plant": (print_native_plant, 1),
    "verify-time": (print_verify_time, 0),
    "stand-in": (print_stand_in, 0),
    "hysteresis": (print_hysteresis, 404),
    "mutants": (print_mutants, 202),
    "current": (print_current_loop, 0),
    "current-valve": (print_current_valve, 0),
    "above": (print_above, 0),
    "blocks": (print_blocks, 24),
    "hunting": (print_hunting, 505),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the parts asked for and print what missed its limit."""
    return run_parts(__doc__.splitlines()[0], PARTS, "few rounds and mutants", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
