"""Atomic artefact writes that never overwrite files dzdesign did not create.

A folder is known as made by dzdesign by its manifest, which has the hash of every file: what the user changed is seen.
"""

import contextlib
import errno
import logging
import os
import shutil
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING, Any

from dzdesign.core.documents import MOST_DOCUMENT, family_of, json_object, reason_of, sha256_of, sha256_of_file, to_json
from dzdesign.core.errors import InputError
from dzdesign.core.placing import beside, bring_back, is_scratch, make_folder, put_in_place, remove_abandoned
from dzdesign.core.version import __version__

if TYPE_CHECKING:
    from dzdesign.core.artefact_types import Artefact

TOOL = {"name": "dzdesign", "version": __version__}
#: File by which a folder is known as made by dzdesign, so that it may be made again.
MANIFEST_NAME = "manifest.json"

logger = logging.getLogger(__name__)

#: The files and folders that this process has written last, but for what goes with it.
written: deque[Path] = deque(maxlen=5)


@contextlib.contextmanager
def _refusing(what: str, option: str) -> Iterator[None]:
    """Say in one sentence why a place can't be written: a missing right, a full disk, a name that can't be one.

    `option` is the one by which the place was named, for the message; so it is in the other functions of this file.
    """
    try:
        yield
    except (OSError, ValueError) as error:
        raise InputError(f"{what} can't be written: {reason_of(error)}; choose another place with {option}") from error


def check_place_of_files(folder: Path, option: str) -> None:
    """Refuse a folder in which files can't be made, before the work whose results they are; it may still be missing."""
    with _refusing(f"'{folder}'", option):
        if not os.access(_nearest_folder(Path(folder), option), os.W_OK | os.X_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


def _nearest_folder(folder: Path, option: str) -> Path:
    """Return a folder, or the one above it that is there; refuse what is a file, or a name that can't be one."""
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        os.lstat(folder)
    nearest = next(one for one in (folder, *folder.absolute().parents) if os.path.lexists(one))
    if not nearest.is_dir():
        kind = "a file" if nearest.exists() else "a link to nothing"
        raise InputError(f"'{nearest}' is {kind}, expected a folder to write into; choose another name with {option}")
    return nearest


def write_files(folder: Path, files: Mapping[str, bytes], option: str) -> None:
    """Add files to a folder, which is created if missing. Each is written atomically and may replace a file."""
    check_place_of_files(folder, option)
    with _refusing(f"'{folder}'", option):
        make_folder(Path(folder))
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
        if not path.exists() and not path.absolute().parent.is_dir():
            raise InputError(
                f"'{path}' can't be written: its folder does not exist; make it, or choose another {option}"
            )
        if path.exists() and not path.is_file():
            raise InputError(
                f"'{path}' is a device or a pipe, expected a file to write; choose another name with {option}"
            )
        if schema is None or not path.exists() or path.stat().st_size == 0:
            return
        if family_of((json_object(path) or {}).get("schema")) != family_of(schema):
            raise InputError(
                f"'{path}' exists and is not a {schema} file of dzdesign, so it is not overwritten; choose another "
                f"name with {option}"
            )


def write_file(path: Path, content: str | bytes, schema: str | None = None, option: str = "-o") -> None:
    """Write a file atomically: a temporary file beside it, then a rename. Its folder must exist.

    With the `schema` of a JSON artefact, an existing file of another kind is left alone.
    """
    check_file_may_be_written(path, schema, option)
    with _refusing(f"'{path}'", option):
        # A link to an artefact stays, and its artefact is replaced; a link to anything else gives way.
        place = Path(os.path.realpath(path)) if schema else Path(path)
        remove_abandoned(place.parent)
        _replace_file(place, content.encode(errors="replace") if isinstance(content, str) else content)
    note_written(path)


def note_written(path: Path) -> None:
    """Note what was written, for the last word of a command that can't end well."""
    logger.debug("wrote '%s'", path)
    if path not in written and not is_scratch(path):
        written.append(path)


def _replace_file(path: Path, data: bytes) -> None:
    temporary = beside(path)
    try:
        with open(temporary, "xb") as handle:
            handle.write(data)
        put_in_place(temporary, path)
    finally:  # an interrupt, too, leaves no half-written file behind
        with contextlib.suppress(OSError, ValueError):
            temporary.unlink(missing_ok=True)


def manifest_of(folder: Path) -> dict[str, Any] | None:
    """Return the manifest that dzdesign left in `folder`, or None."""
    document = json_object(folder / MANIFEST_NAME)
    if document is None or not str(document.get("schema", "")).startswith("dzdesign."):
        return None
    if not isinstance(document.get("files"), dict):
        return None
    # One that names what lies elsewhere is none of ours: nothing there is looked at, let alone replaced.
    return document if all(_is_name_inside(name) for name in document["files"]) else None


def board_of(manifest: Mapping[str, Any]) -> set[str]:
    """Return the files that are their user's to fill in."""
    board = manifest.get("board")
    return {name for name in board if isinstance(name, str)} if isinstance(board, list | tuple) else set()


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file of any size."""
    with open(path, "rb") as file:
        return sha256_of_file(file)


def _is_name_inside(name: str) -> bool:
    """Tell whether a relative path stays in its folder, on any system: no root, drive or way up."""
    posix, windows = PurePosixPath(name), PureWindowsPath(name)
    parts = {*posix.parts, *windows.parts}
    return bool(parts) and not (windows.anchor or posix.is_absolute() or ".." in parts or "\0" in name)


def check_inside(folder: Path, names: Iterable[str], source: str) -> None:
    """Refuse names of files that lie outside their folder, also by way of a link, and what is no file of dzdesign's.

    They are as a manifest gives them, `source` is who names them; one that is missing is no concern here.
    """
    home = os.path.realpath(folder)
    for name in names:
        path = Path(folder) / name
        if not _is_name_inside(name):
            raise InputError(f"{source} names '{name[:80]}', which is not a file inside the folder; make it again")
        found = os.path.realpath(path)
        if os.path.commonpath([home, found]) != home:
            raise InputError(f"'{path}' is a link to a place outside of '{folder}'; put the file itself there")
        if os.path.lexists(path) and not os.path.isfile(path):
            raise InputError(f"'{path}', which {source} names, is not a file; make the folder again")
        if os.path.isfile(path) and os.path.getsize(path) > MOST_DOCUMENT:  # whoever looks at it reads it whole
            raise InputError(
                f"'{path}' is larger than {MOST_DOCUMENT >> 20} MiB, which no file of dzdesign is; make the folder "
                "again"
            )


def check_folder_may_be_written(folder: Path, schema: str | None = None) -> None:
    """Refuse a folder whose contents dzdesign did not make, or in which somebody changed a generated file.

    With the `schema` of the manifest to be written, a folder of another kind is refused too: the firmware, named again
    for its evidence.
    """
    with _refusing(f"the folder '{folder}'", "-o"):
        _filled_in(Path(folder), schema)


def _filled_in(folder: Path, schema: str | None, board: set[str] | None = None) -> dict[str, str]:
    """Return the files of an earlier output that their user filled in, with their hashes as they were generated.

    Refused are a folder that dzdesign did not make, that holds another kind of artefact, or a file that would be lost:
    one that was changed and is not its user's to fill in, by the new manifest's `board` or else the old one's. A link
    is a person's, wherever to.
    """
    _nearest_folder(folder, "-o")
    if not folder.is_dir() or not any(folder.iterdir()):
        return {}
    manifest = manifest_of(folder)
    if manifest is None:
        raise InputError(
            f"'{folder}' is not empty and was not made by dzdesign, so it is left alone; choose a new folder with -o"
        )
    if schema is not None and family_of(manifest["schema"]) != family_of(schema):
        raise InputError(
            f"'{folder}' holds {manifest['schema']}, which {schema} would replace; choose a new folder with -o"
        )
    changed = {}
    for name, digest in sorted(manifest["files"].items()):
        path = folder / name
        if path.is_symlink() or (path.is_file() and digest_of(path) != digest):
            changed[name] = digest
    for name in sorted(changed.keys() - (board_of(manifest) if board is None else board)):
        raise InputError(
            f"'{folder / name}' was changed since dzdesign wrote it and would be lost; "
            "move it away or choose a new folder with -o"
        )
    return changed


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
    with _refusing(f"the folder '{folder}'", "-o"):
        place = Path(os.path.realpath(folder))  # a link stays, its target is replaced
        _nearest_folder(place, "-o")
        make_folder(place.parent)
        remove_abandoned(place.parent)
        bring_back(place)
        check()
        changed = _filled_in(place, document.get("schema"), board_of(document))
        _replace_folder(place, contents, changed)
    note_written(Path(folder))
    return {name: digest != listing[name] for name, digest in changed.items()}


def _replace_folder(folder: Path, contents: Mapping[str, bytes], filled_in: Iterable[str]) -> None:
    """Write the files beside a folder and put them in its place, with what a person filled in or added there."""
    staging = beside(folder)
    try:
        for name, data in contents.items():
            target = staging / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        if old := manifest_of(folder):
            for name in filled_in:
                (staging / name).unlink()
            _carry_over(folder, staging, {MANIFEST_NAME, *old["files"]}.difference(filled_in))
        put_in_place(staging, folder)
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def _carry_over(folder: Path, staging: Path, generated: set[str]) -> None:
    """Copy what a person added to an earlier output (build products, notes, links) or filled in into the new one."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if name in generated:
            continue
        target = staging / name
        if path.is_dir() and not path.is_symlink():
            if not any(path.iterdir()):  # an empty one may matter: git's refs/heads
                target.mkdir(parents=True, exist_ok=True)
            continue
        if os.path.lexists(target):
            raise InputError(f"'{path}' is not dzdesign's and stands where a new file goes; move it away")
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, target, follow_symlinks=False)
