"""`batch --calibration block` on a lot: one firmware, a block a valve, and what identification, design and check take.

Time is that of the processor, with all that a process calls: what else the machine does is not in it. The core is run
bare and checked in turn, valve by valve.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from many_valves import write_lot
from scoreboard import Row, print_rows, say

from dzdesign import api
from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import SourceFile, to_json_bytes
from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.block_check import BlockFirmware
from dzdesign.verify.toolchain.bound_block import bound_files
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from dzdesign.verify.toolchain.machines import HOST

COMMAND = "import sys; from dzdesign.command_line.cli import main; sys.exit(main(sys.argv[1:]))"
COUNT, FEW, LAG = 1000, 6, "0.1 s"
#: Valves whose parts are timed one by one.
TIMED = 25
MOST_BEYOND_s, TIMES_BARE = 0.05, 1.8


def processor_s() -> float:
    """Return time of the processor so far, of this process and of those that it called."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def taken(work: Callable[[], object]) -> float:
    """Return time of the processor, s."""
    begin = processor_s()
    work()
    return processor_s() - begin


def print_blocks(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows."""
    count = FEW if quick else COUNT
    with TemporaryDirectory() as temporary:
        lot, output = Path(temporary) / "lot", Path(temporary) / "out"
        say(f"writing the ramp tests of {count} valves, and a batch of them, one job")
        write_lot(lot, count, 0, seed)
        rows = _batch_rows(lot, output, count)
    print_rows(f"{count} valves with one firmware", rows)
    return rows


def _batch_rows(lot: Path, output: Path, count: int) -> list[Row]:
    arguments = ["batch", str(lot), "-o", str(output), "--jobs", "1", "--meter-lag", LAG, "--calibration", "block"]
    command = [sys.executable, "-c", COMMAND, *arguments]
    clock = perf_counter()
    whole_s = taken(lambda: subprocess.run(command, stdout=subprocess.DEVNULL, check=True)) / count
    clock_s = (perf_counter() - clock) / count
    valves = sorted((output / "valves").iterdir())
    without = [path.name for path in valves if not (path / "calibration.bin").is_file() or not _holds(path)]
    projects = [path for path in output.rglob("manifest.json") if (path.parent / "core").is_dir()]
    some = valves[:: max(len(valves) // TIMED, 1)]
    say(f"identification, design, check and bare batch of {len(some)}, in turn")
    identify_s, design_s, check_s, bare_s = _parts(lot, output / "lot" / "firmware", some)
    ratios = sorted(check / bare for check, bare in zip(check_s, bare_s, strict=True))
    beyond = whole_s - _mean(identify_s) - _mean(check_s)
    return [
        Row(what="valves without a block that holds on every input", value=len(without) + count - len(valves), limit=0),
        Row(what="firmware projects beside the one", value=len(projects) - 1, limit=0),
        Row(what="whole batch a valve", value=whole_s, unit="s", note=f"by the clock {clock_s:.2f} s"),
        Row(what="identification a valve", value=_mean(identify_s), unit="s"),
        Row(what="check of every input a valve", value=_mean(check_s), unit="s"),
        Row(what="beyond identification and that check, a valve", value=beyond, unit="s", limit=MOST_BEYOND_s,
            note="design, block, files, and a valve's share of lot setting, table and report"),
        Row(what="of that the design", value=_mean(design_s), unit="s"),
        Row(what="check of every input over the bare batch", value=sum(check_s) / sum(bare_s), limit=TIMES_BARE,
            note=f"{len(ratios)} valves, {ratios[0]:.2f} to {ratios[-1]:.2f}; bare {_mean(bare_s):.3f} s"),
    ]  # fmt: skip


def _parts(lot: Path, firmware: Path, valves: list[Path]) -> tuple[list[float], ...]:
    bare, checked, once = _bare_batch(firmware), BlockFirmware(firmware), True
    found: tuple[list[float], ...] = ([], [], [], [])
    for valve in valves:
        compensator = read_artefact((valve / "compensator.json").read_bytes(), Compensator, str(valve))
        if once:  # compiles, and imports
            _check(checked, valve)
            api.design(api.identify(str(lot / valve.name / "*.csv"), meter_lag=LAG))
            once = False
        models: list = []
        work = (
            lambda name=valve.name, into=models: into.append(api.identify(str(lot / name / "*.csv"), meter_lag=LAG)),
            lambda into=models: api.design(into[0]),
            lambda path=valve: _check(checked, path),
            lambda last=compensator.signals.code_max: HOST.run(bare, [str(last)], "the bare batch"),
        )
        for times, each in zip(found, work, strict=True):
            times.append(taken(each))
    return found


def _check(firmware: BlockFirmware, valve: Path) -> None:
    """Try a valve's block as the batch does, with its compensator read and what was found written."""
    content = (valve / "compensator.json").read_bytes()
    compensator = read_artefact(content, Compensator, str(valve))
    source = SourceFile(source="compensator.json", sha256=sha256_of(content))
    found = firmware.check((valve / "calibration.bin").read_bytes(), compensator, source)
    (valve.parent / "found.json").write_bytes(to_json_bytes(found))
    if not found.holds:
        raise RuntimeError(f"the block of {valve.name} does not hold")


def _holds(valve: Path) -> bool:
    return json.loads((valve / "calibration_check.json").read_bytes())["holds"]


def _bare_batch(firmware: Path) -> Path:
    """Return the program that calls the core at every pair of codes; the core takes as long with any block."""
    core = CompiledCore(firmware)
    source = (Path(__file__).parents[1] / "verify" / "bare_batch.c").read_bytes()
    files = {**core.sources, **{name: text.encode() for name, text in bound_files(firmware).items()}}
    files["bare_batch.c"] = source
    flags = (*HOST.check_flags, "-DDZ_BLOCK_FORM")
    objects = [HOST.compile(name, files, flags, "the bare batch") for name in ("bare_batch.c", "dz_bound.c")]
    return HOST.link([core.compiled(), *objects], "the bare batch")


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)
