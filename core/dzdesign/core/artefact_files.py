"""Artefact files: written whole or not at all, and never over what is somebody's own."""

import contextlib
import json
import logging
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import TYPE_CHECKING, Any

from dzdesign.core.documents import parse_document, sha256_of, sha256_of_file, to_json
from dzdesign.core.errors import InputError
from dzdesign.core.folder_swap import alone_in, beside, bring_back, put_in_place
from dzdesign.core.input_files import MOST_DOCUMENT, open_bytes, read_bytes
from dzdesign.core.version import __version__

if TYPE_CHECKING:
    from dzdesign.core.artefact_types import Artefact

__all__ = [
    "MANIFEST_NAME", "TOOL", "check_file_may_be_written", "check_folder_may_be_written", "check_inside",
    "check_place_of_files", "open_bytes", "parse_document", "read_bytes", "sha256_of", "sha256_of_file", "to_json",
    "write_file", "write_files", "write_folder",
]  # fmt: skip

#: File by which a folder is known as made by dzdesign, so that it may be made anew.
MANIFEST_NAME = "manifest.json"
TOOL = {"name": "dzdesign", "version": __version__}


logger = logging.getLogger(__name__)


def _family(schema: object) -> str:
    """Return a schema's name without its version: ``dzdesign.valve`` of ``dzdesign.valve/1``."""
    return str(schema).partition("/")[0]


def check_place_of_files(folder: Path, option: str) -> None:
    """Refuse a folder in which files can't be made, before the work whose results they are.

    Parameters
    ----------
    folder : Path
        Where files are to be added to whatever is there; it may still be missing.
    option : str
        By which the folder was named, for the message.
    """
    folder = Path(folder)
    try:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            os.lstat(folder)  # a name that can't be one, or too long
        nearest = next(one for one in (folder, *folder.absolute().parents) if os.path.lexists(one))
        reason = None if nearest.is_dir() else "is no folder"
        if reason is None and not os.access(nearest, os.W_OK | os.X_OK):
            reason = "is a folder that can't be written into"
    except (OSError, ValueError) as error:
        raise InputError(f"'{folder}' can't be written into: {_reason(error)}; choose another {option}") from error
    if reason:
        raise InputError(f"'{nearest}' {reason}, expected a folder for files; choose another {option}")


def write_files(folder: Path, files: Mapping[str, bytes], option: str) -> None:
    """Add files to a folder, which is made if missing; each is written whole or not at all, over one of its name.

    Parameters
    ----------
    folder : Path
        Where they go.
    files : mapping
        Name to content.
    option : str
        By which the folder was named, for the message.
    """
    check_place_of_files(folder, option)
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"'{folder}' can't be made: {_reason(error)}; choose another {option}") from error
    for name, content in files.items():
        write_file(Path(folder) / name, content, option=option)


def check_file_may_be_written(path: Path, schema: str | None = None, option: str = "-o") -> None:
    """Refuse to write over what is no regular file or, where the schema is given, no earlier artefact of its kind.

    `identify -o *.csv` names a measurement as its output; a measurement is not to be had again. `option` is the one by
    which the place was named, for the message.
    """
    path = Path(path)
    try:
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
        document = _json_object(path)
    except (OSError, ValueError) as error:
        raise InputError(f"'{path}' can't be written: {_reason(error)}; choose another place with {option}") from error
    if document is None or _family(document.get("schema")) != _family(schema):
        raise InputError(
            f"'{path}' exists and is no {schema} of dzdesign, so it is left alone; choose another name with {option}"
        )


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)


def write_file(path: Path, content: str | bytes, schema: str | None = None, option: str = "-o") -> None:
    """Write a file whole or not at all: a temporary file beside it, then one rename.

    Parameters
    ----------
    path : Path
        Where it goes; its folder must exist.
    content : str or bytes
        Text is written in UTF-8.
    schema : str, optional
        Of a JSON artefact: an existing file of another kind is left alone.
    option : str
        By which the place was named, for the message.

    Raises
    ------
    InputError
        If the place can't be written, or holds a file that would be lost.
    """
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    check_file_may_be_written(path, schema, option)
    temporary = beside(path)
    try:
        with open(temporary, "xb") as handle:
            handle.write(data)
            handle.flush()
            os.fsync(handle.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
        logger.debug("wrote '%s', %d bytes", path, len(data))
    except (OSError, ValueError) as error:
        raise InputError(f"'{path}' can't be written: {_reason(error)}; choose another place with {option}") from error
    finally:  # an interrupt, too, leaves no half-written file behind
        with contextlib.suppress(OSError, ValueError):
            temporary.unlink(missing_ok=True)


def _json_object(path: Path) -> dict[str, Any] | None:
    """Return the JSON object that a file holds, or None if it holds anything else; a long measurement is not read."""
    try:
        if not path.is_file() or path.stat().st_size > MOST_DOCUMENT:
            return None
        document = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return document if isinstance(document, dict) else None


def _manifest_of(folder: Path) -> dict[str, Any] | None:
    """Return the manifest that dzdesign left in `folder`, or None."""
    document = _json_object(folder / MANIFEST_NAME)
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
    """Refuse names of files that lie outside their folder, also by way of a link, and what is no regular file.

    Parameters
    ----------
    folder : Path
        Which they are relative to.
    names : iterable of str
        As a manifest gives them; one that is missing is no concern here.
    source : str
        Who names them, for the message.

    Raises
    ------
    InputError
        Naming the first of them.
    """
    home = os.path.realpath(folder)
    for name in names:
        if not _is_name_inside(name):
            raise InputError(f"{source} names '{name[:80]}', which is no file inside of the folder; make it again")
        path = Path(folder) / name
        try:
            found = os.path.realpath(path, strict=True)
        except FileNotFoundError:
            continue
        except OSError as error:
            raise InputError(f"'{path}', which {source} names, can't be read: {_reason(error)}") from error
        if os.path.commonpath([home, found]) != home:
            raise InputError(f"'{path}' is a link to a place outside of '{folder}'; put the file itself there")
        if not os.path.isfile(found):
            raise InputError(f"'{path}', which {source} names, is no file; make the folder again")


def check_folder_may_be_written(folder: Path, schema: str | None = None) -> None:
    """Refuse a folder whose contents dzdesign did not make, or in which somebody changed a generated file.

    Parameters
    ----------
    folder : Path
        Where an output is to go.
    schema : str, optional
        Of the manifest to be written; a folder of another kind (the firmware, named again for its evidence) is refused.
    """
    folder = Path(folder)
    try:
        if folder.absolute().parent.is_dir():
            with alone_in(folder.absolute().parent):  # another process may be exchanging it
                return _check_folder(folder, schema)
        _check_folder(folder, schema)
    except (OSError, ValueError) as error:
        raise InputError(f"the folder '{folder}' can't be written: {_reason(error)}; choose another with -o") from error


def _check_folder(folder: Path, schema: str | None) -> None:
    try:
        ancestry = (folder, *folder.absolute().parents)
        nearest = next((one for one in ancestry if one.exists()), folder)
        if nearest.exists() and not nearest.is_dir():
            raise InputError(f"'{nearest}' is a file, expected a folder to write into; choose another name with -o")
        if folder.is_dir() and any(folder.iterdir()):
            _check_folder_is_ours(folder, schema)
    except (OSError, ValueError) as error:
        raise InputError(f"the folder '{folder}' can't be written: {_reason(error)}; choose another with -o") from error


def _check_folder_is_ours(folder: Path, schema: str | None) -> None:
    manifest = _manifest_of(folder)
    if manifest is None:
        raise InputError(
            f"'{folder}' is not empty and was not made by dzdesign, so it is left alone; choose a new folder with -o"
        )
    if schema is not None and _family(manifest["schema"]) != _family(schema):
        raise InputError(
            f"'{folder}' holds {manifest['schema']}, which {schema} would replace; choose a new folder with -o"
        )
    _refuse_to_lose(folder, set(_changed_in(folder, manifest)) - _board_of(manifest))


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
        if path.is_symlink() or (path.is_file() and _digest(path) != digest):
            yield name


def _board_of(manifest: Mapping[str, Any]) -> set[str]:
    """Return the files that are their user's to fill in."""
    board = manifest.get("board")
    return {name for name in board if isinstance(name, str)} if isinstance(board, list | tuple) else set()


def _digest(path: Path) -> str:
    with open(path, "rb") as file:
        return sha256_of_file(file)


def _carry_over(folder: Path, staging: Path, generated: set[str]) -> None:
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


def _keep(
    folder: Path, staging: Path, old: Mapping[str, Any], listing: Mapping[str, str], board: set[str]
) -> dict[str, bool]:
    """Copy what a person filled in into the new output; return its names, and whether the generated text is another."""
    changed = set(_changed_in(folder, old))
    _refuse_to_lose(folder, changed - board)
    for name in changed:
        (staging / name).unlink()
        shutil.copy2(folder / name, staging / name, follow_symlinks=False)
    return {name: old["files"][name] != listing[name] for name in sorted(changed)}


def write_folder(
    folder: Path, files: Mapping[str, str | bytes], manifest: "Artefact | Mapping[str, Any]"
) -> Mapping[str, bool]:
    """Write a folder whole or not at all; one that dzdesign made before is replaced, any other is left alone.

    Parameters
    ----------
    folder : Path
        Where the files go; its parents are made.
    files : mapping
        Relative POSIX path to content.
    manifest : Artefact or mapping
        Written as `MANIFEST_NAME`, with the SHA-256 of every file added under ``files``: by it the folder is known
        again, and a file that somebody changed is not overwritten. Those under ``board`` are their user's to fill in:
        where one was changed in the earlier folder, it stays as it is there.

    Returns
    -------
    mapping of str to bool
        The files that were kept, and whether dzdesign would write another text now than it did then.

    Raises
    ------
    InputError
        If the place can't be written, or holds files that would be lost.
    """
    contents = {name: text.encode() if isinstance(text, str) else text for name, text in files.items()}
    listing = {name: sha256_of(data) for name, data in contents.items()}
    if isinstance(manifest, Mapping):
        document = manifest
    else:
        from dzdesign.core.artefact_types import as_document  # here: msgspec costs a start that writes nothing

        document = as_document(manifest)
    contents[MANIFEST_NAME] = to_json({**document, "files": listing}).encode()
    folder = Path(folder)
    staging: Path | None = None
    kept: dict[str, bool] = {}
    try:
        folder = Path(os.path.realpath(folder))  # a link stays, its target is replaced
        if not folder.parent.is_dir():
            _check_folder(folder, document.get("schema"))
        folder.parent.mkdir(parents=True, exist_ok=True)
        with alone_in(folder.parent):
            bring_back(folder)
            _check_folder(folder, document.get("schema"))
            staging = beside(folder)
            _write_staging(staging, contents)
            if folder.is_dir():
                old = _manifest_of(folder)
                kept = _keep(folder, staging, old, listing, _board_of(document)) if old else {}
                _carry_over(folder, staging, set(old["files"]) if old else set())
                put_in_place(staging, folder)
            else:
                os.replace(staging, folder)
        logger.debug("wrote '%s', %d files", folder, len(contents))
    except (OSError, ValueError) as error:
        raise InputError(
            f"the folder '{folder}' can't be written: {_reason(error)}; choose another place with -o"
        ) from error
    finally:
        if staging:
            shutil.rmtree(staging, ignore_errors=True)
    return kept


def _write_staging(staging: Path, contents: Mapping[str, bytes]) -> None:
    """Write the files of a folder that nobody knows yet."""
    staging.mkdir(mode=0o755)
    os.chmod(staging, 0o755)  # whatever the umask
    for name, data in contents.items():
        target = staging / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
