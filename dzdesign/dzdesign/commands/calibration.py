"""`dzdesign calibration`: the block of one valve as a file for a programmer, and what such a file says."""

import os
from dataclasses import KW_ONLY, asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any

from dzdesign.core.errors import InputError
from dzdesign.core.options import AnyPath, Option, flag_of
from dzdesign.stages.calibration import CalibrationArguments, ReadCalibrationArguments, calibration, read_calibration
from dzdesign.terminal.page import print_json, say_results

if TYPE_CHECKING:
    from dzdesign.stages.calibration import CalibrationImage, ReadCalibration

EXAMPLES = (
    "dzdesign calibration compensator.json -o valve.hex",
    "dzdesign calibration compensator.json -o valve.bin --serial 4711",
    "dzdesign calibration --read valve.hex",
    "dzdesign calibration --read valve.hex firmware      # compare it with this firmware's compensator",
)
#: Options that a block is written with.
OF_WRITING = ("output", "target", "address", "serial", "record")


@dataclass(frozen=True)
class Arguments(CalibrationArguments):
    """Arguments of the stage, and the file to read instead."""

    compensator: Annotated[AnyPath | None, Option("COMPENSATOR.json")] = None  # type: ignore[assignment]
    """The compensator.json that the block is made from. With --read, that file or a firmware folder to compare the
    block with."""
    _: KW_ONLY
    read: Annotated[AnyPath | None, Option("FILE")] = None
    """Calibration file to print in engineering units, with the compensator that it belongs to."""


def run(arguments: Arguments, json: bool) -> int:
    """Write a block, or print one; 1 if it does not belong to the compensator beside it."""
    if arguments.read is not None:
        return _read(arguments, json)
    if arguments.compensator is None or arguments.output is None:
        raise InputError("calibration needs a COMPENSATOR.json and -o FILE, or --read FILE; see --help")
    from dzdesign.codegen.calibration.packing import ELSEWHERE
    from dzdesign.codegen.project import target_named

    made = calibration(arguments)
    document = _document(made, os.fspath(arguments.output))
    if json:
        print_json(document)
        return 0
    at = f", at {document['address']} of {made.target}" if made.address is not None else ""
    say_results(f"Written: {document['file']}, {document['octets']} octets{at}")
    target = target_named(made.target)
    sector = target.block_place if target.sector else None
    if made.address is not None and sector and made.address != sector.address:
        say_results(f"NOT {sector.address:#x}, where {made.target}'s firmware has its block: {ELSEWHERE}")
    say_results(f"Serial number: {document['serial'] or 'none'}; record: {document['record'] or 'none'}")
    say_results(f"CRC-32 {document['crc32']}; SHA-256 of its compensator.json {document['compensator_sha256']}")
    return 0


def _read(arguments: Arguments, json: bool) -> int:
    from dzdesign.terminal.output_tables import print_calibration

    for name in OF_WRITING:
        if getattr(arguments, name) is not None:
            raise InputError(f"{flag_of(name)} is for writing a block, and --read only reads one; leave it out")
    found = read_calibration(ReadCalibrationArguments(arguments.read or "", arguments.compensator))
    if json:
        print_json(_read_document(found))
    else:
        print_calibration(found)
    return 1 if found.belongs is False else 0


def _document(made: "CalibrationImage", file: str) -> dict[str, Any]:
    """Return what was written."""
    from dzdesign.codegen.calibration.packing import OCTETS, octets_of, text_of

    block = made.block
    return {
        "file": file,
        "format": made.format,
        "target": made.target,
        "address": None if made.address is None else f"{made.address:#x}",
        "octets": OCTETS,
        "serial": text_of(block.serial),
        "record": text_of(block.record),
        "crc32": f"{block.crc32:08x}",
        "compensator_sha256": octets_of(block.compensator_sha256).hex(),
    }


def _read_document(found: "ReadCalibration") -> dict[str, Any]:
    return {
        "belongs": found.belongs,
        "difference": found.difference or None,
        "placed": found.placed or None,
        **asdict(found.reading),
    }
