"""Atomic artefact writes that never overwrite files dzdesign did not create."""

import contextlib
import logging
import os
import shutil
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dzdesign.core.documents import family_of, parse_document, sha256_of, sha256_of_file, sha256_of_octets, to_json
from dzdesign.core.errors import InputError
from dzdesign.core.folder_contents import (
    MANIFEST_NAME,
    board_of,
    carry_over,
    check_folder_is_ours,
    check_inside,
    keep_filled_in,
    manifest_of,
)
from dzdesign.core.input_files import json_object, open_bytes, read_bytes, reason_of
from dzdesign.core.placing import (
    beside,
    bring_back,
    make_folder,
    put_in_place,
    remove_abandoned,
    sync_file,
    sync_folder,
    sync_tree,
)
from dzdesign.core.scratch import is_scratch
from dzdesign.core.version import __version__

if TYPE_CHECKING:
    from dzdesign.core.artefact_types import Artefact

__all__ = [
    "MANIFEST_NAME", "TOOL", "check_file_may_be_written", "check_folder_may_be_written", "check_inside",
    "check_place_of_files", "note_written", "open_bytes", "parse_document", "read_bytes", "sha256_of", "sha256_of_file",
    "sha256_of_octets", "to_json", "write_file", "write_files", "write_folder",
]  # fmt: skip

TOOL = {"name": "dzdesign", "version": __version__}

logger = logging.getLogger(__name__)

#: The files and folders that this process has written last, but for what goes with it.
written: deque[Path] = deque(maxlen=5)


def check_place_of_files(folder: Path, option: str) -> None:
    """Refuse a folder in which files can't be made, before the work whose results they are; it may still be missing.

    `option` is the one by which the folder was named, for the message; so it is in the other functions of this file.
    """
    folder = Path(folder)
    try:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            os.lstat(folder)  # a name that can't be one, or too long
        nearest = next(one for one in (folder, *folder.absolute().parents) if os.path.lexists(one))
        reason = None if nearest.is_dir() else "is not a folder"
        if reason is None and not os.access(nearest, os.W_OK | os.X_OK):
            reason = "is a folder that can't be written into"
    except (OSError, ValueError) as error:
        raise InputError(f"'{folder}' can't be written into: {reason_of(error)}; choose another {option}") from error
    if reason:
        raise InputError(f"'{nearest}' {reason}, expected a folder for files; choose another {option}")


def write_files(folder: Path, files: Mapping[str, bytes], option: str) -> None:
    """Add files to a folder, which is created if missing. Each is written atomically and may replace a file."""
    check_place_of_files(folder, option)
    try:
        make_folder(Path(folder))
    except OSError as error:
        raise InputError(f"'{folder}' can't be made: {reason_of(error)}; choose another {option}") from error
    for name, content in files.items():
        write_file(Path(folder) / name, content, option=option)


def check_file_may_be_written(path: Path, schema: str | None = None, option: str = "-o") -> None:
    """Refuse to overwrite anything but a regular file or, if the schema is given, an earlier artefact of the same kind.

    `identify -o *.csv` names a measurement as its output; a measurement is not available again.
    """
    path = Path(path)
    with _refusing(f"'{path}'", option):
        if path.is_dir():
            raise InputError(
                f"'{path}' is a folder, expected the name of a file to write; choose another with {option}"
            )
        if not path.exists():
            if not path.absolute().parent.is_dir():
                raise InputError(
                    f"'{path}' can't be written: its folder does not exist; make it, or choose another {option}"
                )
            return
        if not path.is_file():
            raise InputError(
                f"'{path}' is a device or a pipe, expected a file to write; choose another name with {option}"
            )
        if schema is None or path.stat().st_size == 0:
            return
        document = json_object(path)
    if document is None or family_of(document.get("schema")) != family_of(schema):
        raise InputError(
            f"'{path}' exists and is not a {schema} file of dzdesign, so it is not overwritten; choose another name "
            f"with {option}"
        )


def write_file(path: Path, content: str | bytes, schema: str | None = None, option: str = "-o") -> None:
    """Write a file atomically: a temporary file beside it, then a rename. Its folder must exist.

    With the `schema` of a JSON artefact, an existing file of another kind is left alone.
    """
    data = content.encode(errors="replace") if isinstance(content, str) else content
    check_file_may_be_written(path, schema, option)
    with _refusing(f"'{path}'", option):
        # A link to an artefact stays, and its artefact is replaced; a link to anything else gives way.
        place = Path(os.path.realpath(path)) if schema else Path(path)
        remove_abandoned(place.parent)
        _replace_file(place, data)
    note_written(path)
    logger.debug("wrote '%s', %d bytes", path, len(data))


def note_written(path: Path) -> None:
    """Note what was written, for the last word of a command that can't end well."""
    if path not in written and not is_scratch(path):
        written.append(path)


def _replace_file(path: Path, data: bytes) -> None:
    temporary = beside(path)
    try:
        with open(temporary, "xb") as handle:
            handle.write(data)
        if durable := not is_scratch(path):
            sync_file(temporary)
        os.replace(temporary, path)
        if durable:
            sync_folder(path.parent)
    finally:  # an interrupt, too, leaves no half-written file behind
        with contextlib.suppress(OSError, ValueError):
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def _refusing(what: str, option: str) -> Iterator[None]:
    """Say in one sentence why a place can't be written: a missing right, a full disk, a name that can't be one."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise InputError(f"{what} can't be written: {reason_of(error)}; choose another place with {option}") from error


def check_folder_may_be_written(folder: Path, schema: str | None = None) -> None:
    """Refuse a folder whose contents dzdesign did not make, or in which somebody changed a generated file.

    With the `schema` of the manifest to be written, a folder of another kind is refused too: the firmware, named again
    for its evidence.
    """
    folder = Path(folder)
    with _refusing(f"the folder '{folder}'", "-o"):
        _check_folder(folder, schema)


def _check_folder(folder: Path, schema: str | None) -> None:
    ancestry = (folder, *folder.absolute().parents)
    nearest = next((one for one in ancestry if one.exists()), folder)
    if nearest.exists() and not nearest.is_dir():
        raise InputError(f"'{nearest}' is a file, expected a folder to write into; choose another name with -o")
    if folder.is_dir() and any(folder.iterdir()):
        check_folder_is_ours(folder, schema)


def write_folder(
    folder: Path,
    files: Mapping[str, str | bytes],
    manifest: "Artefact | Mapping[str, Any]",
    check: Callable[[], None] = lambda: None,
) -> Mapping[str, bool]:
    """Write a folder whole or not at all; one that dzdesign made before is replaced, any other is left alone.

    The manifest is written with the SHA-256 of every file added under ``files``: by it the folder is known again, and
    a file that somebody changed is not overwritten. Those under ``board`` are their user's to fill in: where one was
    changed in the earlier folder, it stays as it is there.

    Parameters
    ----------
    folder : Path
        Where the files go; its parents are made.
    files : mapping
        Relative POSIX path to content.
    manifest : Artefact or mapping
        Written as `MANIFEST_NAME`.
    check : callable
        Refuses what lies in the folder, just before it is replaced.

    Returns
    -------
    mapping of str to bool
        The files that were kept, and whether dzdesign would write another text now than it did then.
    """
    contents = {name: text.encode(errors="replace") if isinstance(text, str) else text for name, text in files.items()}
    listing = {name: sha256_of(data) for name, data in contents.items()}
    if isinstance(manifest, Mapping):
        document = manifest
    else:
        from dzdesign.core.artefact_types import as_document  # here: msgspec costs a start that writes nothing

        document = as_document(manifest)
    contents[MANIFEST_NAME] = to_json({**document, "files": listing}).encode(errors="replace")
    named = folder = Path(folder)
    with _refusing(f"the folder '{folder}'", "-o"):
        folder = Path(os.path.realpath(folder))  # a link stays, its target is replaced
        if not folder.parent.is_dir():
            _check_folder(folder, document.get("schema"))
        make_folder(folder.parent)
        remove_abandoned(folder.parent)
        bring_back(folder)
        check()
        _check_folder(folder, document.get("schema"))
        kept = _replace_folder(folder, contents, listing, board_of(document))
    note_written(named)
    logger.debug("wrote '%s', %d files", folder, len(contents))
    return kept


def _replace_folder(
    folder: Path, contents: Mapping[str, bytes], listing: Mapping[str, str], board: set[str]
) -> dict[str, bool]:
    """Write the files beside a folder and put them in its place, with what a person filled in or added there."""
    staging = beside(folder)
    try:
        _write_staging(staging, contents)
        kept = {}
        if folder.is_dir():
            old = manifest_of(folder)
            kept = keep_filled_in(folder, staging, old, listing, board) if old else {}
            carry_over(folder, staging, set(old["files"]) if old else set(contents))
        if durable := not is_scratch(folder):
            sync_tree(staging)
        if folder.is_dir():
            put_in_place(staging, folder)
        else:
            os.replace(staging, folder)
            if durable:
                sync_folder(folder.parent)
        return kept
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _write_staging(staging: Path, contents: Mapping[str, bytes]) -> None:
    """Write the files of a folder that nobody knows yet."""
    staging.mkdir()
    for name, data in contents.items():
        target = staging / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
