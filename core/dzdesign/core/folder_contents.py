"""Ownership of a folder by its manifest: which files dzdesign wrote, and which of them the user changed."""

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from dzdesign.core.documents import family_of, sha256_of_file
from dzdesign.core.errors import InputError
from dzdesign.core.input_files import MOST_DOCUMENT, json_object, reason_of

#: File by which a folder is known as made by dzdesign, so that it may be made again.
MANIFEST_NAME = "manifest.json"


def manifest_of(folder: Path) -> dict[str, Any] | None:
    """Return the manifest that dzdesign left in `folder`, or None."""
    document = json_object(folder / MANIFEST_NAME)
    if document is None or not str(document.get("schema", "")).startswith("dzdesign."):
        return None
    if not isinstance(document.get("files"), dict):
        return None
    # One that names what lies elsewhere is none of ours: nothing there is looked at, let alone replaced.
    return document if all(_is_name_inside(name) for name in document["files"]) else None


def _is_name_inside(name: str) -> bool:
    """Tell whether a relative path stays in its folder, on any system: no root, drive or way up."""
    posix, windows = PurePosixPath(name), PureWindowsPath(name)
    parts = {*posix.parts, *windows.parts}
    return bool(parts) and not (windows.anchor or posix.is_absolute() or ".." in parts or "\0" in name)


def check_inside(folder: Path, names: Iterable[str], source: str) -> None:
    """Refuse names of files that lie outside their folder, also by way of a link, and what is not a regular file.

    They are as a manifest gives them, `source` is who names them; one that is missing is no concern here. A file that
    is larger than any of dzdesign is refused too.
    """
    home = os.path.realpath(folder)
    for name in names:
        if not _is_name_inside(name):
            raise InputError(f"{source} names '{name[:80]}', which is not a file inside the folder; make it again")
        path = Path(folder) / name
        try:
            found = os.path.realpath(path, strict=True)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise InputError(f"'{path}', which {source} names, can't be read: {reason_of(error)}") from error
        if os.path.commonpath([home, found]) != home:
            raise InputError(f"'{path}' is a link to a place outside of '{folder}'; put the file itself there")
        if not os.path.isfile(found):
            raise InputError(f"'{path}', which {source} names, is not a file; make the folder again")
        if os.path.getsize(found) > MOST_DOCUMENT:  # whoever looks at it reads it whole
            raise InputError(
                f"'{path}' is larger than {MOST_DOCUMENT >> 20} MiB, which no file of dzdesign is; make the folder "
                "again"
            )


def check_folder_is_ours(folder: Path, schema: str | None) -> None:
    """Refuse a folder that dzdesign did not make, that holds another kind of artefact, or a file that would be lost."""
    manifest = manifest_of(folder)
    if manifest is None:
        raise InputError(
            f"'{folder}' is not empty and was not made by dzdesign, so it is left alone; choose a new folder with -o"
        )
    if schema is not None and family_of(manifest["schema"]) != family_of(schema):
        raise InputError(
            f"'{folder}' holds {manifest['schema']}, which {schema} would replace; choose a new folder with -o"
        )
    _refuse_to_lose(folder, set(_changed_in(folder, manifest)) - board_of(manifest))


def _refuse_to_lose(folder: Path, changed: set[str]) -> None:
    for name in sorted(changed):
        raise InputError(
            f"'{folder / name}' was changed since dzdesign wrote it and would be lost; "
            "move it away or choose a new folder with -o"
        )


def _changed_in(folder: Path, manifest: Mapping[str, Any]) -> Iterator[str]:
    """Yield the files of a folder that are there and not as dzdesign wrote them; a link is a person's, wherever to."""
    for name, digest in manifest["files"].items():
        path = folder / name
        if path.is_symlink() or (path.is_file() and digest_of(path) != digest):
            yield name


def board_of(manifest: Mapping[str, Any]) -> set[str]:
    """Return the files that are their user's to fill in."""
    board = manifest.get("board")
    return {name for name in board if isinstance(name, str)} if isinstance(board, list | tuple) else set()


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file of any size."""
    with open(path, "rb") as file:
        return sha256_of_file(file)


def carry_over(folder: Path, staging: Path, generated: set[str]) -> None:
    """Copy what a person added to an earlier output (build products, notes, links) into the new one."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if name in generated or name == MANIFEST_NAME:
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


def keep_filled_in(
    folder: Path, staging: Path, old: Mapping[str, Any], listing: Mapping[str, str], board: set[str]
) -> dict[str, bool]:
    """Copy what a person filled in into the new output; return its names, and whether the generated text is another."""
    changed = set(_changed_in(folder, old))
    _refuse_to_lose(folder, changed - board)
    for name in changed:
        (staging / name).unlink()
        shutil.copy2(folder / name, staging / name, follow_symlinks=False)
    return {name: old["files"][name] != listing[name] for name in sorted(changed)}
