"""Whether a firmware in block form accepts the calibration block in its folder, and refuses it damaged.

Its own C decides: `dz_calibration_check()` of core/, and the block that its target's dz_block.c links.
"""

from pathlib import Path

from dzdesign.core.artefact_files import read_bytes, sha256_of
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.firmware_manifest import BLOCK_FILE, FirmwareManifest
from dzdesign.verify.requirements import OWN_BLOCK, Check
from dzdesign.verify.toolchain.bound_block import ACCEPTANCE, BLOCK_HEADER, block_of
from dzdesign.verify.toolchain.machines import HOST, PROGRAMS, discard, stored

PROGRAM = "own_block.c"
#: Files of a target with the block as C, which are compiled here too.
BLOCK_SOURCE, LINKED_HEADER = "dz_block.c", "dz_block.h"


def own_block_accepted(folder: Path, manifest: FirmwareManifest) -> tuple[Check, ...]:
    """Tell whether calibration.bin and dz_block.c are one block, of this compensator, that the firmware accepts.

    Nothing of a firmware with the numbers of its valve in it.
    """
    if manifest.calibration != "block":
        return ()
    try:
        text, fault = _tried(folder, manifest)
    except (InputError, RequirementError) as error:  # its files are there or not: that is what is asked
        text, fault = "", str(error)
    return (OWN_BLOCK.check(holds=not fault, text=fault or text),)


def _tried(folder: Path, manifest: FirmwareManifest) -> tuple[str, str]:
    """Return what was found, and the first fault in words or an empty text."""
    block = block_of(folder)
    if block is None:
        return "", f"core/ has no {ACCEPTANCE}, which every core in block form has"
    sizes, found, damaged, digest = _numbers(folder, manifest, block)
    (size, _), (refused, linked_refused, differ) = sizes, found
    if len(block) != size:
        return "", f"{BLOCK_FILE} has {len(block)} octets, this firmware's block has {size}"
    tried, accepted, header_tried, header_accepted, crc_follows = damaged
    for is_fault, text in (
        (refused, f"dz_calibration_check() of this firmware refuses {BLOCK_FILE} (0x{refused:04X})"),
        (differ, f"{differ} octets of {BLOCK_SOURCE} are not those of {BLOCK_FILE}"),
        (linked_refused, f"dz_calibration_check() of this firmware refuses {BLOCK_SOURCE} (0x{linked_refused:04X})"),
        (not crc_follows, f"the CRC-32 in {BLOCK_FILE} is not that of its octets"),
        (accepted, f"dz_calibration_check() accepts {accepted} of {tried} blocks with one bit changed"),
        (header_accepted, f"dz_calibration_check() accepts {header_accepted} of {header_tried} changed headers"),
        (bytes(digest).hex() != _digest(folder), f"{BLOCK_FILE} is the block of another compensator.json"),
    ):
        if is_fault:
            return "", f"{text}; make the firmware again with `dzdesign codegen --calibration block`"
    text = f"{BLOCK_FILE} and {BLOCK_SOURCE} are one block of {size} octets, of this compensator.json, and accepted; "
    return f"{text}refused: {tried} blocks with one bit changed, {header_tried} changed headers with a right CRC", ""


def _digest(folder: Path) -> str:
    return sha256_of(read_bytes(folder / "compensator.json", "compensator of the firmware"))


def _numbers(folder: Path, manifest: FirmwareManifest, block: bytes) -> list[list[int]]:
    """Return the lines of numbers that programs/own_block.c prints; each file of the firmware is compiled alone."""
    linked = [folder / name for name in manifest.files if name.endswith(f"/{BLOCK_SOURCE}")]
    if len(linked) != 1:
        raise RequirementError(f"the manifest names {len(linked)} files {BLOCK_SOURCE}, expected one")
    paths = {
        ACCEPTANCE: folder / "core" / ACCEPTANCE, BLOCK_HEADER: folder / "core" / BLOCK_HEADER,
        BLOCK_SOURCE: linked[0], LINKED_HEADER: linked[0].with_name(LINKED_HEADER), PROGRAM: PROGRAMS / PROGRAM,
    }  # fmt: skip
    texts = {name: read_bytes(path, "file of a firmware in block form") for name, path in paths.items()}
    headers = {name: texts[name] for name in (BLOCK_HEADER, LINKED_HEADER)}
    objects = [
        HOST.compile(name, {name: texts[name], **headers}, HOST.core_flags, f"the block's {name}")
        for name in (ACCEPTANCE, BLOCK_SOURCE, PROGRAM)
    ]
    program = HOST.link(objects, "the check of the block")
    try:
        printed = HOST.run(program, [str(stored(block))], "dz_calibration_check()")
    finally:
        discard(block)
    if [len(line) for line in printed] != [2, 3, 5, 32]:
        raise RequirementError(f"the check of the block printed {len(printed)} lines of numbers, expected 4")
    return printed
