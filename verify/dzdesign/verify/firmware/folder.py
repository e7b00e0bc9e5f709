"""A firmware folder as it is given: its manifest, and that nothing in it leads elsewhere."""

import os
from functools import lru_cache
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, check_inside, read_bytes
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError
from dzdesign.core.input_files import MOST_RECORDING, reason_of
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest


def read_firmware_manifest(folder: Path) -> FirmwareManifest:
    """Return the manifest of a firmware folder.

    What is read, compiled and run afterwards are the files that it names, and C: each must be a file in this folder.
    """
    path = folder / MANIFEST_NAME
    if folder.is_file() or (folder.is_dir() and not path.exists()):
        found = "is a file" if folder.is_file() else f"has no {MANIFEST_NAME}"
        raise InputError(f"'{folder}' {found}, expected the firmware folder that `dzdesign codegen` writes; name that")
    manifest = read_artefact(read_bytes(path, "firmware manifest"), FirmwareManifest, str(path))
    check_inside(folder, [*manifest.files, *manifest.core], f"'{path}'")
    check_firmware_inside(folder)
    return manifest


def _check_readable(folder: Path) -> None:
    def refuse(error: OSError) -> None:
        if isinstance(error, FileNotFoundError):
            return  # said by what reads a file of it
        raise InputError(f"'{error.filename}' can't be read: {reason_of(error)}; change who may read it") from error

    for place, _, names in os.walk(folder, onerror=refuse):
        for name in names:
            path = os.path.join(place, name)
            if any("\ud800" <= letter <= "\udfff" for letter in name):
                raise InputError(f"'{quotable(path)}' has a name that is no text in UTF-8; rename it, or take it away")
            if os.path.exists(path) and not os.access(path, os.R_OK):
                raise InputError(f"'{path}' can't be read: no permission; change who may read it")
            if os.path.isfile(path) and os.path.getsize(path) > MOST_RECORDING:  # each is hashed
                raise InputError(f"'{path}' is larger than {MOST_RECORDING >> 20} MiB; take it out of the firmware")


def quotable(path: str) -> str:
    """Return a name with a mark for each byte that is no text."""
    return path.encode(errors="replace").decode()


def read_compensator(folder: Path) -> Compensator:
    """Return the compensator of a firmware folder."""
    path = folder / "compensator.json"
    return _compensator(read_bytes(path, "compensator of the firmware"), str(path))


@lru_cache(maxsize=1)
def _compensator(content: bytes, source: str) -> Compensator:
    """Read a compensator once for all checks of a firmware; nothing changes one."""
    return read_artefact(content, Compensator, source)


def check_firmware_inside(folder: Path) -> None:
    """Refuse a firmware folder whose C is not in it, or with a link: a build follows it, and no check looks behind.

    Refused is too what can't be read, here and now, and a name that no text can hold: nothing could be said of it.
    """
    _check_readable(folder)
    found = [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*.[ch]"))]
    check_inside(folder, ["compensator.json", *found], f"'{folder}'")
    home = os.path.realpath(folder)
    for path in sorted(folder.rglob("*")):
        if os.path.realpath(path) != os.path.join(home, path.relative_to(folder)):  # also a junction of Windows
            raise InputError(f"'{path}' is a link, expected files and folders; replace it by what it points to")
