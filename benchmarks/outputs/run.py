"""Benchmarks of outputs that are no C firmware, each number beside its limit: ``run.py [--quick] [--only NAME]``.

Exit status 1 if a limit is missed.
"""

import os
import sys
from pathlib import Path

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "POLARS_MAX_THREADS"):
    os.environ.setdefault(_threads, "1")
sys.path.insert(0, str(Path(__file__).parents[1]))  # for the scoreboard that all benchmarks share
sys.path.insert(0, str(Path(__file__).parents[2]))  # for what tests support

from block_readers import print_block_readers  # noqa: E402
from fmus import print_fmus  # noqa: E402
from scoreboard import run_parts  # noqa: E402

PARTS = {
    "fmus": (print_fmus, 0),
    "block-readers": (print_block_readers, 0),
}


def main(arguments: list[str] | None = None) -> int:
    """Run the parts asked for and print what missed its limit."""
    return run_parts(__doc__.splitlines()[0], PARTS, "blocks of one compensator; FMUs not compiled again", arguments)


if __name__ == "__main__":
    raise SystemExit(main())
