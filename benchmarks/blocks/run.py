"""Benchmarks of the core in block form beside the one in fixed form: ``run.py [--quick] [--only NAME]``.

Exit status 1 if a limit is missed.
"""

import os
import sys
from pathlib import Path

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "POLARS_MAX_THREADS"):
    os.environ.setdefault(_threads, "1")
sys.path.insert(0, str(Path(__file__).parents[1]))  # for the scoreboard that all benchmarks share
sys.path.insert(0, str(Path(__file__).parents[2]))  # for what tests support

from block_designs import print_block_designs  # noqa: E402
from block_equality import print_block_equality  # noqa: E402
from block_sequences import print_block_sequences  # noqa: E402
from scoreboard import run_parts  # noqa: E402

PARTS = {
    "equality": (print_block_equality, 0),
    "sequences": (print_block_sequences, 24),
    "designs": (print_block_designs, 24),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the parts asked for and print what missed its limit."""
    return run_parts(__doc__.splitlines()[0], PARTS, "samples, and few designs", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
