"""Artefact files: read, write whole or not at all, hash, check the schema."""

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dzdesign import __version__
from dzdesign.core.errors import InputError

#: File by which a folder is known as made by dzdesign, so that it may be made anew.
MANIFEST_NAME = "manifest.json"
TOOL = {"name": "dzdesign", "version": __version__}


def sha256_of(content: bytes) -> str:
    """Return the SHA-256 of `content` in hex."""
    return hashlib.sha256(content).hexdigest()


def read_bytes(path: Path, what: str) -> bytes:
    """Read a whole file, or say in one sentence why it can't be read."""
    try:
        return Path(path).read_bytes()
    except FileNotFoundError as error:
        raise InputError(f"{what} '{path}' does not exist") from error
    except IsADirectoryError as error:
        raise InputError(f"{what} '{path}' is a folder, expected a file") from error
    except OSError as error:
        raise InputError(f"{what} '{path}' can't be read: {error.strerror}") from error


def to_json(document: Mapping[str, Any]) -> str:
    """Return the document as JSON text; a NaN or an infinity is an error, never written."""
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def parse_document(content: bytes, source: str, schemas: tuple[str, ...]) -> dict[str, Any]:
    """Read a JSON artefact and check that its schema is one of `schemas`.

    Raises
    ------
    InputError
        If it is no JSON object or has another schema.
    """
    expected = " or ".join(schemas)
    try:
        document = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise InputError(f"'{source}' is not JSON ({error}); expected an artefact of schema {expected}") from error
    found = document.get("schema") if isinstance(document, dict) else None
    if found not in schemas:
        raise InputError(f"'{source}' has the schema {found!r}, expected {expected}")
    return document


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file whole or not at all: a temporary file beside it, then one rename."""
    path = Path(path)
    data = content.encode() if isinstance(content, str) else content
    temporary = None
    try:
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as handle:
            temporary = handle.name
            handle.write(data)
            handle.flush()
            os.fsync(handle.fileno())
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except OSError as error:
        if temporary:
            Path(temporary).unlink(missing_ok=True)
        raise InputError(f"'{path}' can't be written: {error.strerror}; choose another place with -o") from error


def _manifest_of(folder: Path) -> dict[str, Any] | None:
    """Return the manifest that dzdesign left in `folder`, or None."""
    try:
        document = json.loads((folder / MANIFEST_NAME).read_bytes())
    except (OSError, ValueError):
        return None
    ours = isinstance(document, dict) and str(document.get("schema", "")).startswith("dzdesign.")
    return document if ours and isinstance(document.get("files"), dict) else None


def check_folder_may_be_written(folder: Path) -> None:
    """Refuse a folder whose contents dzdesign did not make, or in which somebody changed a generated file."""
    folder = Path(folder)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"'{folder}' is a file, expected a folder to write into; choose another name with -o")
    if not folder.is_dir() or not any(folder.iterdir()):
        return
    manifest = _manifest_of(folder)
    if manifest is None:
        raise InputError(
            f"'{folder}' is not empty and was not made by dzdesign, so it is left alone; choose a new folder with -o"
        )
    for name, digest in manifest["files"].items():
        path = folder / name
        if path.is_file() and sha256_of(path.read_bytes()) != digest:
            raise InputError(
                f"'{path}' was changed since dzdesign wrote it and would be lost; "
                "move it away or choose a new folder with -o"
            )


def _carry_over(folder: Path, staging: Path, generated: set[str]) -> None:
    """Move what a person added to an earlier output (build products, notes) into the new one."""
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and name not in generated and name != MANIFEST_NAME:
            target = staging / name
            if target.exists():
                raise InputError(f"'{path}' is not dzdesign's and stands where a new file goes; move it away")
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, target)


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
    folder = Path(folder).absolute()
    check_folder_may_be_written(folder)
    staging = None
    try:
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
            retired = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}.old."))
            os.replace(folder, retired / "old")
            os.replace(staging, folder)
            shutil.rmtree(retired)
        else:
            os.replace(staging, folder)
    except OSError as error:
        raise InputError(
            f"the folder '{folder}' can't be written: {error.strerror}; choose another place with -o"
        ) from error
    finally:
        if staging:
            shutil.rmtree(staging, ignore_errors=True)
