"""What the files around the core print where it takes a calibration block, and the files that hold this block."""

from collections.abc import Mapping
from dataclasses import replace

from dzdesign.codegen.calibration.built_for import built_for
from dzdesign.codegen.calibration.layout import LENGTH_WORDS, CalibrationBlock
from dzdesign.codegen.calibration.numbers import ValvePage
from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.core.constants import Values
from dzdesign.codegen.target import Target
from dzdesign.design.compensator import Compensator

FILES = ("dz_block.c", "dz_block.h")
LINKER_FILE = "dz_calibration.cmd"


def block_values(compensator: Compensator, block: CalibrationBlock | None, target: Target) -> Values:
    """Return what the templates print of the block; their `block` is the first argument of the core's calls."""
    current = compensator.current_drive
    values: Values = {
        "block": "&dz_block, " if block else "",
        "block_files": (*FILES, *([LINKER_FILE] if target.sector else [])) if block else (),
        "block_sources": FILES[:1] if block else (),
        "block_headers": FILES[1:] if block else (),
        "block_lines": _lines(compensator, block) if block else [],
        "command_zero": "dz_block.command_zero" if block else "DZ_DRIVE_COMMAND_ZERO",
        "offset_ticks": f"{1 << current.loop.offset_shift}u" if block and current else "DZ_CURRENT_OFFSET_TICKS",
        "sector": target.sector is not None,
    }
    if target.sector:
        sector = target.sector
        place = {"block_address": f"{sector.address:#x}", "block_words": LENGTH_WORDS}
        return {**values, **place, "region": sector.region, "region_page": sector.page, "region_file": sector.file}
    return values


def _lines(compensator: Compensator, block: CalibrationBlock) -> list[str]:
    """Return the block as C, with its CRC."""
    block = replace(block, crc32=unpack(pack(block)).crc32)
    return ValvePage(compensator=compensator, block=block, built=built_for(compensator)).lines()


def block_templates(target: Target, block: CalibrationBlock | None) -> Mapping[str, str]:
    """Return the files that hold the block in a target's folder, path to template."""
    if block is None:
        return {}
    names = (*FILES, *([LINKER_FILE] if target.sector else []))
    return {f"{target.folder}/{name}": f"{name}.jinja" for name in names}
