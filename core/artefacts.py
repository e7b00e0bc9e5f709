"""Artefact files: read, write whole or not at all, hash, check the schema."""

import contextlib
import hashlib
import io
import json
import logging
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, BinaryIO

from dzdesign import __version__
from dzdesign.core.errors import InputError, neighbour

#: File by which a folder is known as made by dzdesign, so that it may be made anew.
MANIFEST_NAME = "manifest.json"
TOOL = {"name": "dzdesign", "version": __version__}


logger = logging.getLogger(__name__)


def sha256_of(content: bytes) -> str:
    """Return the SHA-256 of `content` in hex."""
    return hashlib.sha256(content).hexdigest()


def sha256_of_file(file: BinaryIO) -> str:
    """Return the SHA-256 of a whole file in hex, read piece by piece; the file is at its beginning again then."""
    file.seek(0)
    digest = hashlib.file_digest(file, "sha256").hexdigest()
    file.seek(0)
    return digest


def read_bytes(path: Path, what: str) -> bytes:
    """Read a whole file, or say in one sentence why it can't be read."""
    with _refusing(path, what):
        content = Path(path).read_bytes()
    logger.debug("read %s '%s', %d bytes", what, path, len(content))
    return content


@contextlib.contextmanager
def open_bytes(path: Path, what: str) -> Iterator[BinaryIO]:
    """Open a file that may be larger than memory; or say in one sentence why it can't be read.

    What is no regular file, such as a pipe, can be read only once, and is held in memory.
    """
    with _refusing(path, what):
        file = open(path, "rb") if os.path.isfile(path) else io.BytesIO(Path(path).read_bytes())  # noqa: SIM115
    with file:
        logger.debug("reading %s '%s'", what, path)
        try:
            yield file
        except OSError as error:  # a disk that fails, a share that is gone
            raise InputError(f"{what} '{path}' can't be read: {error.strerror or error}") from error


@contextlib.contextmanager
def _refusing(path: Path, what: str) -> Iterator[None]:
    try:
        yield
    except (FileNotFoundError, NotADirectoryError) as error:
        raise InputError(f"{what} '{path}' does not exist{neighbour(path)}; check the name and the folder") from error
    except OSError as error:
        if os.path.isdir(path):  # Windows calls reading a folder a lack of permission
            raise InputError(f"{what} '{path}' is a folder, expected a file") from error
        raise InputError(f"{what} '{path}' can't be read: {error.strerror}") from error
    except ValueError as error:  # a name with a NUL, from a TOML file
        raise InputError(f"{what} '{path}' can't be a file's name ({error})") from error


def to_json(document: Mapping[str, Any]) -> str:
    """Return the document as JSON text; a NaN or an infinity is an error, never written."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _no_number(word: str) -> float:
    raise ValueError(f"{word} is not a number of JSON")


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        seen: set[str] = set()
        twice = next(key for key, _ in pairs if key in seen or seen.add(key))
        raise ValueError(f"the key {twice[:40]!r} is there twice")
    return found


def parse_document(content: bytes, source: str, schemas: tuple[str, ...]) -> dict[str, Any]:
    """Read a JSON artefact and check that its schema is one of `schemas`.

    Raises
    ------
    InputError
        If it is no JSON object in UTF-8, holds what can't be written again (NaN, half a character) or a key twice, or
        has another schema.
    """
    expected = " or ".join(schemas)
    try:
        # JSON in UTF-16, or after a byte order mark, would be read here and stumbled over later.
        document = json.loads(content.decode("utf-8"), parse_constant=_no_number, object_pairs_hook=_unique_keys)
        to_json(document).encode()
    except (ValueError, RecursionError) as error:
        raise InputError(f"'{source}' is not JSON ({error}); expected an artefact of schema {expected}") from error
    found = document.get("schema") if isinstance(document, dict) else None
    if found not in schemas:
        raise InputError(f"'{source}' has the schema {str(found)[:40]!r}, expected {expected}; give another file")
    return document


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
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as handle:
            temporary = handle.name
            handle.write(data)
            handle.flush()
            os.fsync(handle.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
        logger.debug("wrote '%s', %d bytes", path, len(data))
        temporary = None
    except (OSError, ValueError) as error:
        raise InputError(f"'{path}' can't be written: {_reason(error)}; choose another place with {option}") from error
    finally:  # an interrupt, too, leaves no half-written file behind
        if temporary:
            Path(temporary).unlink(missing_ok=True)


def _json_object(path: Path) -> dict[str, Any] | None:
    """Return the JSON object that a file holds, or None if it holds anything else."""
    try:
        document = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    return document if isinstance(document, dict) else None


def _manifest_of(folder: Path) -> dict[str, Any] | None:
    """Return the manifest that dzdesign left in `folder`, or None."""
    document = _json_object(folder / MANIFEST_NAME)
    ours = document is not None and str(document.get("schema", "")).startswith("dzdesign.")
    return document if ours and isinstance(document.get("files"), dict) else None


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
    for name, digest in manifest["files"].items():
        path = folder / name
        if path.is_file() and sha256_of(path.read_bytes()) != digest:
            raise InputError(
                f"'{path}' was changed since dzdesign wrote it and would be lost; "
                "move it away or choose a new folder with -o"
            )


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


def write_folder(folder: Path, files: Mapping[str, str | bytes], manifest: Mapping[str, Any]) -> None:
    """Write a folder whole or not at all; one that dzdesign made before is replaced, any other is left alone.

    Parameters
    ----------
    folder : Path
        Where the files go; its parents are made.
    files : mapping
        Relative POSIX path to content.
    manifest : mapping
        Written as `MANIFEST_NAME`, with the SHA-256 of every file added under ``files``: by it the folder is known
        again, and a file that somebody changed is not overwritten.

    Raises
    ------
    InputError
        If the place can't be written, or holds files that would be lost.
    """
    contents = {name: text.encode() if isinstance(text, str) else text for name, text in files.items()}
    listing = {name: sha256_of(data) for name, data in contents.items()}
    contents[MANIFEST_NAME] = to_json({**manifest, "files": listing}).encode()
    folder = Path(folder)
    check_folder_may_be_written(folder, manifest.get("schema"))
    staging = None
    try:
        folder = Path(os.path.realpath(folder))  # a link stays, its target is replaced
        folder.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
        os.chmod(staging, 0o755)
        for name, data in contents.items():
            target = staging / name
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        if folder.is_dir():
            old = _manifest_of(folder)
            _carry_over(folder, staging, set(old["files"]) if old else set())
            _exchange(folder, staging)
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


def _exchange(folder: Path, staging: Path) -> None:
    """Put `staging` in the place of `folder`; if that fails half-way the old one comes back."""
    retired = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}.old."))
    old = retired / "old"
    try:
        os.replace(folder, old)
        os.replace(staging, folder)
    except BaseException:
        if old.exists() and not folder.exists():
            os.replace(old, folder)
        with contextlib.suppress(OSError):  # not empty if the old one could not come back: then it stays there
            retired.rmdir()
        raise
    shutil.rmtree(retired, ignore_errors=True)
