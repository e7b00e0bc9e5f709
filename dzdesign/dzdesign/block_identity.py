"""Identity of a calibration block by serial number and hash, since the numbers of the law do not name the valve.

A block says its serial number and the hash of its compensator.json. That holds the entry `serial` of the test record;
the folder of a batch's valve says the hash of the block that belongs there.
"""

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError, and_more, quoted

if TYPE_CHECKING:
    from dzdesign.codegen.calibration.layout import CalibrationBlock
    from dzdesign.design.compensator import Compensator

#: Files that a sentence names.
NAMED = 5


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
            and_more([str(path) for path in paths], NAMED),
            f"these blocks {' and '.join(what)}: each valve must have its own; load none of "
            "them before it is clear whose they are",
        )
        for paths, what in found.items()
    ]
