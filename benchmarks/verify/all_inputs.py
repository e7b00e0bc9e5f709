"""The check of every input against a bare batch of the core and against ctypes with Fraction, and on simulators."""

import ctypes
import random
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

from firmware import example_firmware
from scoreboard import Row, print_rows, say

from dzdesign.design.compensator import Compensator
from dzdesign.verify.exhaustive.all_inputs import check_all_inputs
from dzdesign.verify.exhaustive.machine_code import check_on_machine
from dzdesign.verify.toolchain.compiled_core import CompiledCore
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4, HOST
from tests.support.c_library import load_library

ROUNDS, QUICK_ROUNDS, SIMULATED_ROUNDS = 25, 3, 5
#: Inputs of the comparison with ctypes and Fraction, of which the whole is extrapolated.
STATED_PART = 20_000
TIMES_BARE, TIMES_SLOWER, TIMES_HOST = 2.0, 2000.0, 8.0


def print_inputs(quick: bool = False, seed: int = 0) -> list[Row]:
    """Measure, print and return the rows."""
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
        firmware = Path(folder) / "fw"
        compensator = example_firmware(firmware)
        rows = _rows(firmware, compensator, QUICK_ROUNDS if quick else ROUNDS, seed)
    print_rows("Every input of the compiled core", rows)
    return rows


def _rows(firmware: Path, compensator: Compensator, rounds: int, seed: int) -> list[Row]:
    last = compensator.signals.code_max
    bare = _bare_batch(firmware)
    result = check_all_inputs(firmware)  # compiled from here on
    say("bare batch and check, in turn ...")
    runs = [(_seconds(lambda: bare(last)), _seconds(lambda: check_all_inputs(firmware))) for _ in range(rounds)]
    bare_s, check_s = (min(column) for column in zip(*runs, strict=True))
    # A round's two stand side by side, so that what else the machine does meets both.
    ratios = sorted(check / batch for batch, check in runs)
    note = f"smallest of {rounds}, not compiling; {result.inputs} inputs, {result.calls} calls of the core in the check"
    say("ctypes and Fraction ...")
    one_s = _seconds(lambda: _by_fractions(firmware, compensator, STATED_PART, seed)) / STATED_PART
    slower = one_s * result.inputs / check_s
    rows = [
        Row(what="bare batch: drive and law at every input, nothing else", value=bare_s, unit="s", note=note),
        Row(what="check of every input, all properties", value=check_s, unit="s", note=note),
        Row(
            what="check over bare batch, median of the rounds",
            value=ratios[rounds // 2],
            limit=TIMES_BARE,
            note=f"{ratios[0]:.2f} to {ratios[-1]:.2f}",
        ),
        Row(what="inputs that are wrong in any property", value=float(not result.holds), limit=0),
        Row(
            what="check over ctypes with Fraction, times 2000",
            value=TIMES_SLOWER / slower,
            limit=1,
            note=f"{slower:.0f} times faster: {1e6 * one_s:.1f} us an input there, from {STATED_PART} random inputs",
        ),
    ]
    return rows + _simulated(firmware)


def _simulated(firmware: Path) -> list[Row]:
    rows, host = [], check_all_inputs(firmware)
    for machine, limit in ((CORTEX_M4, TIMES_HOST), (AVR, None)):
        if missing := machine.missing():
            rows.append(Row(what=f"{machine.name}", value=float("nan"), limit=limit, note=f"not run: {missing}"))
            continue
        say(f"{machine.name} ...")
        done = check_on_machine(firmware, machine, host)
        runs = [
            tuple(
                map(
                    _seconds,
                    (lambda on=machine: check_on_machine(firmware, on, host), lambda: check_all_inputs(firmware)),
                )
            )
            for _ in range(SIMULATED_ROUNDS)
        ]
        ratios = sorted(there / here for there, here in runs)
        rows.append(
            Row(
                what=f"{machine.name} in {machine.runner[0]} over the host's check",
                value=ratios[SIMULATED_ROUNDS // 2],
                limit=limit,
                note=f"median, {ratios[0]:.2f} to {ratios[-1]:.2f}; {done.found.inputs} inputs",
            )
        )
        rows.append(
            Row(
                what=f"{machine.name}: 1 if there are faults or its hash is not the host's",
                value=float(not done.holds),
                limit=0,
                note=done.found.outputs_hash,
            )
        )
    return rows


def _bare_batch(firmware: Path) -> Callable[[int], object]:
    core = CompiledCore(firmware)
    source = {name: text for name, text in core.sources.items() if name.endswith(".h")}
    source["bare_batch.c"] = (Path(__file__).parent / "bare_batch.c").read_bytes()
    objects = [core.compiled(name=name) for name in core.units]
    objects.append(HOST.compile("bare_batch.c", source, HOST.check_flags, "the bare batch"))
    program = HOST.link(objects, "the bare batch")
    return lambda last: HOST.run(program, [str(last)], "the bare batch")


def _by_fractions(firmware: Path, compensator: Compensator, count: int, seed: int) -> None:
    """Compare `count` random inputs one by one, as one would in plain Python."""
    names = ("dz_comp.c", "dz_comp.h", "dz_calibration.h", "dz_valve.h")
    dz_comp = load_library({name: (firmware / "core" / name).read_text() for name in names}, "the core").dz_comp
    dz_comp.argtypes, dz_comp.restype = [ctypes.c_uint16] * 3, ctypes.c_uint16
    draw, signals = random.Random(seed), compensator.signals
    read = [each.valid_codes for each in (signals.command, signals.pressure_a, signals.pressure_b)]
    for _ in range(count):
        command, p_a, p_b = (draw.randint(*ends) for ends in read)
        if dz_comp(command, p_a, p_b) != compensator.compare(command, p_a - p_b):
            raise RuntimeError(f"the core is wrong at {(command, p_a, p_b)}")


def _seconds(work: Callable[[], object]) -> float:
    start = perf_counter()
    work()
    return perf_counter() - start
