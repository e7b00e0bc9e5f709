"""A firmware folder as it is given: its manifest, and that nothing in it leads elsewhere."""

from pathlib import Path
from typing import Any

from dzdesign.core.artefact_files import MANIFEST_NAME, check_inside, parse_document, read_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.shape import check_shape

FIRMWARE_SCHEMA = "dzdesign.firmware/1"


def read_firmware_manifest(folder: Path) -> tuple[bytes, dict[str, Any]]:
    """Return the manifest of a firmware folder, as bytes and as a document.

    What is read, compiled and run afterwards are the files that it names, and C: each must be a file in this folder,
    also where it is a link.

    Raises
    ------
    InputError
        If the folder is no firmware, or leads elsewhere.
    """
    path = folder / MANIFEST_NAME
    if folder.is_file() or (folder.is_dir() and not path.exists()):
        found = "is a file" if folder.is_file() else f"has no {MANIFEST_NAME}"
        raise InputError(f"'{folder}' {found}, expected the firmware folder that `dzdesign codegen` writes; name that")
    content = read_bytes(path, "firmware manifest")
    manifest = parse_document(content, str(path), (FIRMWARE_SCHEMA,))
    later = {key: kind for key, kind in {"target": str, "board": [str]}.items() if key in manifest}
    shape = {"files": dict, "core": [str], **later}
    check_shape(manifest, shape, str(path), "make it again with `dzdesign codegen`")
    check_inside(folder, [*manifest["files"], *manifest["core"]], f"'{path}'")
    check_firmware_inside(folder)
    return content, {"board": (), **manifest}


def check_firmware_inside(folder: Path) -> None:
    """Refuse a firmware folder whose C is not in it."""
    found = [path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*.[ch]"))]
    check_inside(folder, ["compensator.json", *found], f"'{folder}'")
