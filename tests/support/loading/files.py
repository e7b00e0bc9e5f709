"""What the bench of the loading is built from: the generated files, and blocks of a design."""

import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

from dzdesign.codegen.banner import Banner
from dzdesign.codegen.calibration.block import block_of, built_for
from dzdesign.codegen.calibration.files import block_core_files
from dzdesign.codegen.calibration.layout import LENGTH_WORDS
from dzdesign.codegen.calibration.packing import pack
from dzdesign.codegen.f28335.target import TARGET
from dzdesign.codegen.project import target_files
from dzdesign.design.compensator import Compensator
from tests.support.core_texts import texts
from tests.support.golden_firmware import FULL, golden_compensator
from tests.support.loading.bench import Drive, build_drive
from tests.support.loading.exchanges import Bench

DIGEST = "1234567890abcdef" * 4
BLOCK_OCTETS = 2 * LENGTH_WORDS
COMPILER = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), "")
_OURS = ("dz_load", "dz_slots", "dz_store", "dz_frame")


@cache
def compensator() -> Compensator:
    """Return the one of the goldens with everything switched on."""
    return golden_compensator("f28335", FULL)


@cache
def drive_files() -> dict[str, str]:
    """Return the generated files of the loading, and of what it calls, by name."""
    target = target_files(compensator(), TARGET, Banner(digest=DIGEST), block_of(compensator(), DIGEST))
    files = {path.rpartition("/")[2]: text for path, text in target.items()}
    files = {name: text for name, text in files.items() if name.startswith(_OURS)}
    core = texts(block_core_files(built_for(compensator())))
    return files | {name: core[name] for name in ("dz_calibration.c", "dz_calibration.h")}


@cache
def blocks() -> tuple[bytes, ...]:
    """Return valid blocks of several valves."""
    return tuple(_block(number) for number in range(6))


@cache
def refused_blocks() -> tuple[bytes, ...]:
    """Return blocks whose CRC is right and that dz_calibration_check() refuses."""
    sound = block_of(compensator(), "5a" * 32, serial="refused")
    sides = (replace(sound.sides[0], span=0xFFFF), sound.sides[1])
    return (pack(replace(sound, sides=sides)), pack(replace(sound, shape=sound.shape ^ 1)))


def _block(number: int) -> bytes:
    return pack(block_of(compensator(), f"{number:02x}" * 32, serial=f"SN-{number}"))


def bench_of(library: Path) -> Bench:
    """Return a bench whose drive has a linked block, and no loaded one yet."""
    drive = Drive(library, BLOCK_OCTETS)
    drive.erase()
    drive.link(blocks()[0])
    drive.power_on()
    return Bench(drive, blocks(), blocks()[0])


def new_bench(folder: Path, files: dict[str, str] | None = None, *options: str) -> Bench:
    """Compile the bench in a folder, with these files in place of the generated ones."""
    return bench_of(build_drive(COMPILER, drive_files() | (files or {}), folder, *options))
