"""The folder of a batch: one folder a valve, written whole; what is there and still valid is not made again."""

import json
import re
import shutil
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from dzdesign.batch.calibration import DOES_NOT_HOLD, FAILED, FIRMWARE, OK, Outcome
from dzdesign.core.artefact_files import (
    MANIFEST_NAME,
    TOOL,
    parse_document,
    sha256_of,
    to_json,
    write_file,
    write_folder,
)
from dzdesign.core.errors import InputError

SCHEMA = "dzdesign.batch/1"
VALVE_SCHEMA = "dzdesign.batch-valve/1"
SUMMARY = "batch.json"
#: What to do about a file that is not as it was written.
AGAIN = "run the batch again, which takes up what is done"


class Results:
    """The folder that a batch is written into.

    Parameters
    ----------
    folder : Path
        New, empty, or of an earlier run, which is then taken up.

    Raises
    ------
    InputError
        If it holds anything else, or can't be written.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        if folder.is_symlink() and not folder.exists():
            raise InputError(f"'{folder}' is a link to '{folder.readlink()}', which is gone; choose another with -o")
        try:
            if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
                self._check_is_ours()
            (folder / "valves").mkdir(parents=True, exist_ok=True)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"'{folder}' can't be written into: {reason}; choose another folder with -o") from error

    def _check_is_ours(self) -> None:
        try:
            parse_document((self.folder / SUMMARY).read_bytes(), SUMMARY, (SCHEMA,))
        except (OSError, InputError) as error:
            raise InputError(
                f"'{self.folder}' is not empty and no folder of a batch, so it is left alone; choose another with -o"
            ) from error

    def begin(self, names: Collection[str]) -> None:
        """Mark the folder as a batch's, and take away what a killed run left half-written of these valves."""
        self.write_summary({"complete": False, "names": list(names)})
        left = re.compile(r"\.(.+)\.[a-z0-9_]{8}")
        for path in (self.folder / "valves").iterdir():
            found = left.fullmatch(path.name)
            if found and found[1] in names and path.is_dir():
                shutil.rmtree(path, ignore_errors=True)

    def write_summary(self, document: dict[str, Any]) -> None:
        """Write batch.json."""
        write_file(self.folder / SUMMARY, to_json({"schema": SCHEMA, "tool": TOOL, **document}), SCHEMA)

    def of(self, name: str) -> Path:
        """Return a valve's folder."""
        return self.folder / "valves" / name

    def write(self, outcome: Outcome) -> None:
        """Write a valve's folder, whole or not at all, in place of what an earlier run made of it."""
        files: dict[str, bytes] = dict(outcome.files)
        if outcome.reason:
            files["reason.txt"] = f"{outcome.reason}\n".encode()
        manifest = {
            "schema": VALVE_SCHEMA,
            "tool": dict(outcome.tool),
            "name": outcome.name,
            "status": outcome.status,
            "reason": outcome.reason,
            "inputs_sha256": outcome.digest,
            "board": _board_of(files),
        }
        write_folder(self.of(outcome.name), files, manifest)

    def manifest(self, name: str) -> dict[str, Any]:
        """Return what a valve's folder says of itself.

        Raises
        ------
        InputError
            If it is not there or is no such folder.
        """
        path = self.of(name) / MANIFEST_NAME
        try:
            document = parse_document(path.read_bytes(), str(path), (VALVE_SCHEMA,))
        except OSError as error:
            raise InputError(f"'{path}' can't be read: {error.strerror}; run the batch again") from error
        if document.get("status") not in (OK, FAILED, DOES_NOT_HOLD) or not isinstance(document.get("files"), dict):
            raise InputError(f"'{path}' is no manifest of a valve; take its folder away and run the batch again")
        return document

    def is_done(self, name: str, digest: str) -> bool:
        """Tell whether a valve's folder was made from these inputs and holds every file as it was written."""
        try:
            manifest = self.manifest(name)
            if manifest.get("inputs_sha256") != digest:
                return False
            board = manifest.get("board") or ()  # of which a person's version is as good
            return all(
                sha256_of((self.of(name) / file).read_bytes()) == sha256 or file in board
                for file, sha256 in manifest["files"].items()
            )
        except (InputError, OSError):
            return False


def _board_of(files: Mapping[str, bytes]) -> list[str]:
    """Return which files of a valve's folder are its user's to fill in: those of its firmware."""
    manifest = files.get(f"{FIRMWARE}/{MANIFEST_NAME}")
    return [f"{FIRMWARE}/{name}" for name in json.loads(manifest)["board"]] if manifest else []
