"""Outputs that are one file without a manifest: a calibration block, a file for an amplifier.

Such a file names the compensator.json that it was made from, by its SHA-256. A further kind is one entry more.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import InputError

#: How a text names the compensator that it was made from: compensator.json, and its hash on the same line or the next.
NAMED = re.compile(rb"compensator\.json[^\n]{0,200}\n?[^\n]{0,40}?\b([0-9a-f]{64})\b")
#: Bytes in which a text does so.
HEAD = 8192


@dataclass(frozen=True, slots=True, kw_only=True)
class FileAlone:
    """What one file says of itself."""

    #: SHA-256 of the compensator.json that it names.
    compensator_json: str
    settings: str = ""
    #: Hash that its evidence states; empty where nothing verifies such a file.
    verified_as: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class FileKind:
    """A kind of such file; `read` returns None of a file that is none."""

    label: str
    suffixes: tuple[str, ...]
    read: Callable[[Path], FileAlone | None]


def _block(path: Path) -> FileAlone | None:
    from dzdesign.codegen.calibration.block_files import octets_in_file
    from dzdesign.codegen.calibration.packing import octets_of, text_of, unpack

    try:
        octets = octets_in_file(path)
        block = unpack(octets, f"'{path}'")
    except InputError:
        return None
    serial = text_of(block.serial)
    return FileAlone(
        compensator_json=octets_of(block.compensator_sha256).hex(),
        settings=f"serial number {serial}" if serial else "no serial number",
        verified_as=sha256_of(octets),
    )


def _text(path: Path) -> FileAlone | None:
    with open(path, "rb") as file:
        named = NAMED.search(file.read(HEAD))
    return FileAlone(compensator_json=named[1].decode()) if named else None


#: The first kind that a file is of counts.
FILES_ALONE: tuple[FileKind, ...] = (
    FileKind(label="calibration block", suffixes=(".bin", ".hex", ".txt"), read=_block),
    FileKind(label="amplifier file", suffixes=(".txt", ".dcf", ".csv", ".st", ".xml", ".toml"), read=_text),
)
