"""One valve of a lot with one firmware: its calibration block, tried on every input with the core of that firmware.

The core depends on no valve, so a process compiles it for its first one alone.
"""

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_types import SourceFile, to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.design.firmware_manifest import BLOCK_FILE
from dzdesign.report.lot.summary import DOES_NOT_HOLD, OK, Status

if TYPE_CHECKING:
    from dzdesign.codegen.calibration.layout import BuiltFor
    from dzdesign.design.compensator import Compensator
    from dzdesign.verify.exhaustive.block_check import BlockFirmware

#: The same block for the programmer at the end of the line.
BLOCK_IMAGE = "calibration.hex"


def write_block(compensator: "Compensator", target: str, folder: Path) -> tuple[Status, str]:
    """Write the block of the compensator.json in `folder`, and what came of every input; return status and reason.

    A compensator that a block has no room for is an `InputError`.
    """
    from dzdesign.codegen.calibration.block import block_of, built_for
    from dzdesign.codegen.calibration.packing import image_of, pack
    from dzdesign.codegen.project import target_named

    name = "compensator.json"
    digest = sha256_of((folder / name).read_bytes())
    octets = pack(block_of(compensator, digest))
    (folder / BLOCK_FILE).write_bytes(octets)
    (folder / BLOCK_IMAGE).write_bytes(image_of(octets, "hex", target_named(target).block_place))
    found = _firmware(built_for(compensator)).check(octets, compensator, SourceFile(source=name, sha256=digest))
    (folder / found.FILE_NAME).write_bytes(to_json_bytes(found))
    if found.holds:
        return OK, ""
    check = found.requirement(BLOCK_FILE, compensator)
    return DOES_NOT_HOLD, f"{check.name}: {check.text}"


@cache
def _firmware(built: "BuiltFor") -> "BlockFirmware":
    """Return the core as `codegen` writes it, which stays compiled as long as this process lives."""
    from dzdesign.codegen.project import block_core
    from dzdesign.verify.exhaustive.block_check import BlockFirmware
    from dzdesign.verify.toolchain.host_compiler import build_folder

    texts = {name: text.encode() for name, text in block_core(built).items()}
    folder = build_folder() / f"core-{sha256_of(b''.join(texts.values()))[:32]}"
    for name, content in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return BlockFirmware(folder)
