"""Faults seeded in the C of the loading, each of which the exchanges must find, and how they are tried."""

import multiprocessing
import random
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tests.support.loading.bench import SLOTS, Drive, session
from tests.support.loading.exchanges import KINDS, Bench, load
from tests.support.loading.files import blocks, drive_files, new_bench
from tests.support.loading.request_checks import CHECKS


class Fault(NamedTuple):
    """A piece of a generated file, and what stands there instead."""

    file: str
    old: str
    new: str


FAULTS = (
    Fault("dz_load.c", "else if (wrong != 0u)", "else if (wrong == 0xFFFFu)"),
    Fault("dz_load.c", "load->used = load->slot;", ""),
    Fault("dz_load.c", "load->words = (uint16_t)(load->words + load->count);", "load->words = load->count;"),
    Fault("dz_load.c", "else if (is_repeated(load) != 0u)", "else if (is_repeated(load) > 1u)"),
    Fault("dz_load.c", "!= COMMIT_OCTETS)", "> 0xFFu)"),
    Fault("dz_slots.c", "&& (dz_calibration_check(&dz_store_slot(slot)->block) == 0u)", ""),
)  # fmt: skip


def is_found(fault: Fault, folder: Path, exchanges: int = 25) -> bool:
    """Tell whether the exchanges find a fault; a drive that crashes is found too."""
    text = drive_files()[fault.file]
    if text.count(fault.old) != 1:
        raise ValueError(f"{fault.file} has '{fault.old}' {text.count(fault.old)} times")
    faulty = {fault.file: text.replace(fault.old, fault.new)}
    bench = new_bench(folder, faulty, "-Wno-error", "-w", "-fsanitize=undefined", "-fsanitize-undefined-trap-on-error")
    trial = multiprocessing.get_context("fork").Process(target=_try, args=(bench, exchanges))
    trial.start()
    trial.join(120)
    if trial.is_alive():
        trial.kill()
        trial.join()
    return trial.exitcode != 0


def violations(bench: Bench, exchanges: int, seed: int = 3) -> int:
    """Return how often the drive did what it must not, in so many exchanges of each kind, and beside."""
    rng = random.Random(seed)
    for _ in range(exchanges):
        for kind in KINDS:
            bench.exchange(kind, rng)
    found = bench.violations
    found += sum(end.endswith("wrongly") for _, end in bench.ends)
    return found + _marks(bench) + _goes_round(bench) + sum(not _holds(check, bench) for check in CHECKS)


def _try(bench: Bench, exchanges: int) -> None:
    raise SystemExit(1 if violations(bench, exchanges) else 0)


def _holds(check: Callable[[Drive], None], bench: Bench) -> bool:
    try:
        check(bench.drive)
    except (AssertionError, ValueError):  # the latter: no reply, or two
        return False
    return True


def _marks(bench: Bench) -> int:
    """Cut marks, a block without a mark, and a marked one that went bad."""
    drive, (old, new) = bench.drive, blocks()[1:3]
    bad = bytearray(old)
    bad[700] ^= 4
    found = 0
    for slots, wanted in (
        ((old + b"\x01\xfe", new + b"\x02\xff"), old),
        ((old + b"\x01\xfe", new + b"\x03\xfd"), old),
        ((old + b"\xff\xff", new + b"\xff\xff"), blocks()[0]),
        ((bytes(bad) + b"\x05\xfa", b"\xff" * drive.slot_octets), None),
        ((bytes(bad) + b"\x05\xfa", new + b"\x04\xfb"), new),
    ):
        drive.erase()
        for slot in range(SLOTS):
            drive.write_slot(slot, slots[slot])
        found += drive.power_on() != wanted
    return found


def _goes_round(bench: Bench) -> int:
    """Three hundred loads: the count of the marks goes round."""
    drive, found = bench.drive, 0
    drive.erase()
    drive.power_on()
    for number in range(300):
        block = blocks()[number % 2]
        found += load(session(drive), block) != "done" or drive.power_on() != block
    return found
