"""`verify --blocks`: a firmware in block form with the calibration blocks of other valves, each on every input.

This is here and not in verify, which shares no code with what it checks: that a block is the one that follows from its
compensator.json is asked of the generator itself. Every input tries dz_comp() alone; the drive around it takes its
numbers from the same block, and is tried once for each of their settings. Whose a block is says its serial number and
the hash of its compensator.json, which the folder of a batch's valve states too: the numbers of the law do not.
"""

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import SourceFile
from dzdesign.core.documents import read_bytes, sha256_of
from dzdesign.core.errors import InputError, RequirementError, and_more, quoted
from dzdesign.core.placing import scratch_folder
from dzdesign.stages.design import refuse_underived

if TYPE_CHECKING:
    from dzdesign.codegen.calibration.layout import CalibrationBlock
    from dzdesign.design.compensator import Compensator
    from dzdesign.verify.exhaustive.block_check import BlockFirmware
    from dzdesign.verify.requirements import Check

#: Entries of a block that do not follow from a compensator.
OF_NO_COMPENSATOR = ("serial", "record", "crc32")


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenBlock:
    """A calibration block, read, and the compensator that it names."""

    path: Path
    octets: bytes
    compensator_json: Path


def given_blocks(folder: Path, files: Iterable[Path]) -> list[GivenBlock]:
    """Read the blocks that a firmware is to be tried with, each once.

    A firmware with the numbers of its valve in it, a file that is no block, and one without its compensator beside it
    are an `InputError`.
    """
    from dzdesign.verify.folder import read_firmware_manifest

    wanted = list(dict.fromkeys(files))
    if wanted and read_firmware_manifest(folder).calibration != "block":
        raise InputError(
            f"--blocks is for a firmware in block form, and '{folder}' has its valve's numbers in the C code; make one "
            "with `dzdesign codegen --calibration block`, or leave --blocks out"
        )
    beside: dict[Path, Mapping[str, Path]] = {}
    return [_given_block(path, beside) for path in wanted]


def blocks_checked(folder: Path, given: Iterable[GivenBlock], code: Path | None = None) -> "list[Check]":
    """Try each block with the firmware in `folder` on every input, and return a requirement for each.

    What is compiled and run is taken from `code`, by default the folder itself.
    """
    from dzdesign.codegen.calibration.packing import unpack
    from dzdesign.verify.exhaustive.block_check import BlockFirmware
    from dzdesign.verify.folder import read_firmware_manifest
    from dzdesign.verify.requirements import CALIBRATION_BLOCK

    firmware, target, blocks = BlockFirmware(code or folder), read_firmware_manifest(folder).target, list(given)
    checks = [_checked(firmware, target, each) for each in blocks]
    read = [(each.path, unpack(each.octets, f"'{each.path}'")) for each in blocks]
    right = [
        (path, block, _compensator(each)[0])
        for check, each, (path, block) in zip(checks, blocks, read, strict=True)
        if check.holds
    ]
    return [
        *checks,
        *drives_checked(code or folder, right),
        *(CALIBRATION_BLOCK.check(holds=False, name=f"{CALIBRATION_BLOCK.title}: {name}", text=fault)
          for name, fault in repeated(read)),
    ]  # fmt: skip


def _checked(firmware: "BlockFirmware", target: str, given: GivenBlock) -> "Check":
    from dzdesign.codegen.calibration.packing import text_of, unpack
    from dzdesign.verify.requirements import CALIBRATION_BLOCK

    path, octets, (compensator, digest) = given.path, given.octets, _compensator(given)
    name, source = f"{CALIBRATION_BLOCK.title}: {path}", SourceFile(source=given.compensator_json.name, sha256=digest)
    try:
        found = firmware.check(octets, compensator, source)
    except RequirementError as error:
        return CALIBRATION_BLOCK.check(holds=False, name=name, text=str(error))
    check = found.requirement(str(path), compensator)
    faults = [] if check.holds else [check.text]
    try:
        refuse_underived(compensator, f"'{given.compensator_json.name}'", of_file=True)
    except InputError as error:
        faults.append(str(error))
    block = unpack(octets, f"'{path}'")
    serial = text_of(block.serial)
    faults += filter(None, (
        other_numbers(block, compensator, digest),
        _other_target(target, compensator),
        of_another_valve(serial, compensator),
        beside_another(path, octets),
    ))  # fmt: skip
    whose = f"serial number {quoted(serial) if serial else 'none'}, CRC-32 {block.crc32:08x}: "
    return CALIBRATION_BLOCK.check(holds=not faults, name=check.name, text=whose + ("; ".join(faults) or check.text))


def _compensator(given: GivenBlock) -> "tuple[Compensator, str]":
    """Return the compensator beside a block, and the SHA-256 of its file."""
    from dzdesign.design.compensator import Compensator

    content = read_bytes(given.compensator_json, "compensator file")
    return read_artefact(content, Compensator, str(given.compensator_json)), sha256_of(content)


def _other_target(target: str, compensator: "Compensator") -> str:
    """Say that a compensator's codes are other voltages or times at the firmware's target: no block tells that."""
    from dzdesign.codegen.project import target_named

    if compensator.target is None:
        return ""  # its law can't be derived again, which is said
    try:
        target_named(target).check_designed_for(compensator.target)
    except InputError as error:
        return str(error)
    return ""


def other_numbers(block: "CalibrationBlock", compensator: "Compensator", digest: str) -> str:
    """Say which numbers of a block are not those that follow from its compensator; an empty text of none."""
    from dzdesign.codegen.calibration.block import block_of

    numbers = [name for name in block.__dataclass_fields__ if name not in OF_NO_COMPENSATOR]
    follows = block_of(compensator, digest, serial="", record="")
    differ = [name for name in numbers if getattr(block, name) != getattr(follows, name)]
    if not differ:
        return ""
    return f"it names this compensator, but numbers differ from those that follow from it: {', '.join(differ)}"


def _given_block(path: Path, beside: dict[Path, Mapping[str, Path]]) -> GivenBlock:
    """Return a block, and the compensator beside it whose hash it names; `beside` keeps the hashes of a folder."""
    from dzdesign.codegen.calibration.packing import octets_of, read_block_file, unpack

    octets = read_block_file(path)[0]
    digest = octets_of(unpack(octets, f"'{path}'").compensator_sha256).hex()
    folder = path.absolute().parent
    if folder not in beside:
        beside[folder] = _hashes_in(folder)
    found = beside[folder].get(digest)
    if found is None:
        raise InputError(
            f"'{path}' names a compensator.json with the SHA-256 {digest}, and none of the .json files beside it is "
            "that; put its compensator.json into the same folder"
        )
    return GivenBlock(path=path, octets=octets, compensator_json=found)


def _hashes_in(folder: Path) -> Mapping[str, Path]:
    paths = sorted(path for path in folder.glob("*.json") if path.is_file())
    return {sha256_of(read_bytes(path, "file beside a block")): path for path in paths}


#: Entries of a block that say whose it is, how it is shown, and what every input tries.
OF_ONE_VALVE = (
    "compensator_sha256", "serial", "record", "u_max_uV", "sensors", "sides", "crc32",
)  # fmt: skip
#: Blocks that a sentence names.
NAMED = 3
#: A block, where it lies, and its compensator.
Tried = tuple[Path, "CalibrationBlock", "Compensator"]


def drives_checked(folder: Path, blocks: Iterable[Tried]) -> Iterator["Check"]:
    """Yield a requirement for each setting of the drive that blocks have and the block in `folder` has not.

    Ramps count as settings, not so the widths of a play, which differ from valve to valve: one of them is tried.
    """
    from dzdesign.codegen.calibration.packing import pack
    from dzdesign.design.firmware_manifest import BLOCK_FILE
    from dzdesign.verify.current.current_checks import current_checks
    from dzdesign.verify.exhaustive.drive_check import drive_follows
    from dzdesign.verify.requirements import CALIBRATION_BLOCK

    settings: dict[tuple[object, ...], list[Tried]] = {}
    for each in blocks:
        settings.setdefault(_settings(each[1]), []).append(each)
    for (path, block, compensator), *others in settings.values():
        with scratch_folder() as temporary:
            shutil.copytree(folder / "core", temporary / "core")
            (temporary / BLOCK_FILE).write_bytes(pack(block))
            found = [drive_follows(temporary, compensator)]
            found += current_checks(temporary, compensator, lambda _: None).checks
        faults = [f"{check.name}: {check.text}" for check in found if not check.holds]
        text = "; ".join(faults) or "; ".join(check.text for check in found)
        alike = and_more([str(other) for other, _, _ in others], NAMED)
        yield CALIBRATION_BLOCK.check(
            holds=not faults,
            name=f"the drive functions with the calibration block: {path}",
            text=f"{text}{f'; with the same settings: {alike}' if alike else ''}",
        )


def _settings(block: "CalibrationBlock") -> tuple[object, ...]:
    """Return what the drive around the law follows, but for the widths of a play."""
    shared = [getattr(block, each.name) for each in fields(block) if each.name not in (*OF_ONE_VALVE, "current")]
    sensors = [(sensor.zero, sensor.low, sensor.high) for sensor in block.sensors]
    sides = [
        (side.balance, side.weight, side.ramp_up, side.ramp_down, side.span, any(side.play)) for side in block.sides
    ]
    return (*shared, *sensors, *sides, astuple(block.current))


#: Files that a sentence names.
MOST_NAMED = 5


def of_another_valve(serial: str, compensator: "Compensator") -> str:
    """Say that a block's serial number is not the one of the test record; an empty text where nothing contradicts it.

    A block without one says nothing; nor does a recorded one for which a block has no room, so that it was shortened.
    """
    from dzdesign.codegen.calibration.block import entry_of_record
    from dzdesign.codegen.calibration.layout import SERIAL_WORDS

    recorded = entry_of_record(compensator, "serial")
    if not serial or not recorded or serial == recorded or len(recorded.encode()) > 2 * SERIAL_WORDS:
        return ""
    return (
        f"the serial number is {quoted(serial)}, but the valve whose recordings compensator.json was made from has "
        f"{quoted(recorded)} by its test record"
    )


def beside_another(path: Path, octets: bytes) -> str:
    """Say that a block is not the one that a batch wrote into the valve's folder where it lies now.

    That block may be there as another file, so its own octets are compared, whatever the format; nothing is said where
    the folder is none of a batch.
    """
    from dzdesign.design.firmware_manifest import BLOCK_FILE
    from dzdesign.report.lot.table import read_manifest

    folder = path.absolute().parent
    if not (folder / MANIFEST_NAME).is_file():
        return ""
    try:
        manifest = read_manifest(folder)
    except InputError:  # of a firmware, or of something else
        return ""
    written = manifest.files.get(BLOCK_FILE)
    if written in (None, sha256_of(octets)):
        return ""
    return (
        f"the folder is that of valve {quoted(manifest.name)}, for which `dzdesign batch` wrote another block (SHA-256 "
        f"{written}); run the batch again"
    )


def repeated(blocks: Iterable[tuple[Path, "CalibrationBlock"]]) -> list[tuple[str, str]]:
    """Return names and fault of blocks that lie in several folders and yet are of one valve.

    One valve has one serial number and one compensator.json; its block as .bin and .hex in its one folder is in order.
    """
    from dzdesign.codegen.calibration.packing import octets_of, text_of

    owners: dict[str, dict[str, Path]] = {}
    for path, block in blocks:
        folder = os.path.abspath(path.parent)
        digest = octets_of(block.compensator_sha256).hex()
        owners.setdefault(f"name the same compensator.json, SHA-256 {digest}", {}).setdefault(folder, path)
        if serial := text_of(block.serial):
            owners.setdefault(f"have the serial number {quoted(serial)}", {}).setdefault(folder, path)
    found: dict[tuple[Path, ...], list[str]] = {}
    for what, places in owners.items():
        if len(places) > 1:
            found.setdefault(tuple(places.values()), []).append(what)
    return [
        (
            and_more([str(path) for path in paths], MOST_NAMED),
            f"these blocks {' and '.join(what)}: each valve must have its own; load none of "
            "them before it is clear whose they are",
        )
        for paths, what in found.items()
    ]
