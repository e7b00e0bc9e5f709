"""`dzdesign batch` with one job, timed valve by valve: ``timed_batch.py TIMES.json ARGUMENT...`` of the command.

Time is that of the processor, with all that the process calls. After the check of a valve's block, of one valve in
`BARE_EVERY`, the core is run bare on the same inputs: both then meet the same machine, whatever else it does.
"""

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path

from dzdesign.command_line.cli import main
from dzdesign.design.firmware_manifest import BLOCK_FILE
from dzdesign.stages import identify as stage
from dzdesign.verify.exhaustive.block_check import BlockFirmware
from dzdesign.verify.toolchain.bound_block import bound_files
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from dzdesign.verify.toolchain.machines import HOST

BARE = Path(__file__).parents[1] / "verify" / "bare_batch.c"
BARE_EVERY = 4
FOUND: dict[str, list[float]] = {"identify": [], "check": [], "bare": [], "build bare": []}


def processor_s() -> float:
    """Return time of the processor so far, of this process and of those that it called."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def timed(name: str, work: Callable) -> Callable:
    """Return the work, which then notes what it takes."""

    def noted(*given, **named):
        begin = processor_s()
        try:
            return work(*given, **named)
        finally:
            FOUND[name].append(processor_s() - begin)

    return noted


def bare_batch(firmware: Path, block: bytes) -> Path:
    """Return the program that calls the core at every pair of codes; the core takes as long with any block."""
    (firmware / BLOCK_FILE).write_bytes(block)
    core = CompiledCore(firmware)
    files = {**core.sources, **{name: text.encode() for name, text in bound_files(firmware).items()}}
    files["bare_batch.c"] = BARE.read_bytes()
    flags = (*HOST.check_flags, "-DDZ_BLOCK_FORM")
    objects = [HOST.compile(name, files, flags, "the bare batch") for name in ("bare_batch.c", "dz_bound.c")]
    return HOST.link([core.compiled(), *objects], "the bare batch")


class TimedFirmware(BlockFirmware):
    """The core that the batch checks blocks with."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.folder, self.bare = folder, None

    def check(self, block, compensator, source):
        """Check a block, and run the core bare."""
        found = timed("check", super().check)(block, compensator, source)
        if self.bare is None:
            self.bare = timed("build bare", bare_batch)(self.folder, block)
        if len(FOUND["check"]) % BARE_EVERY == 1:
            timed("bare", HOST.run)(self.bare, [str(compensator.signals.code_max)], "the bare batch")
        return found


def run(into: Path, arguments: list[str]) -> int:
    """Run the batch, and write what its parts took, s."""
    import dzdesign.verify.exhaustive.block_check as block_check

    block_check.BlockFirmware = TimedFirmware
    stage.identify = timed("identify", stage.identify)
    status = main(arguments)
    into.write_text(json.dumps({**FOUND, "whole": [processor_s()]}))
    return status


if __name__ == "__main__":
    raise SystemExit(run(Path(sys.argv[1]), sys.argv[2:]))
