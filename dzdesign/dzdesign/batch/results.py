"""The folder of a lot: one folder per valve, written whole; what is there and still valid is not made again."""

import json
from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

from dzdesign.batch.calibration import Outcome
from dzdesign.batch.valve_folders import ValveFolder, read_valve_folder
from dzdesign.core.artefact_files import MANIFEST_NAME, write_file, write_folder
from dzdesign.core.artefact_types import THIS_TOOL, to_json_bytes
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.placing import make_folder
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.lot.folder import is_lot
from dzdesign.report.lot.summary import FAILED, FIRMWARE, SUMMARY_NAME, VALVES, LotSummary, UnfinishedLot, ValveManifest
from dzdesign.report.lot.table import read_manifest


class Results:
    """The folder that a batch is written into: new, empty, or of an earlier run, which is then taken up; no other."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        if folder.is_symlink() and not folder.exists():
            raise InputError(f"'{folder}' is a link to '{folder.readlink()}', which is gone; choose another with -o")
        try:
            if folder.exists() and (not folder.is_dir() or any(folder.iterdir())) and not is_lot(folder):
                raise InputError(
                    f"'{folder}' is not empty and no folder of a batch, so it is left alone; choose another with -o"
                )
            make_folder(folder / VALVES)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"'{folder}' can't be written into: {reason}; choose another folder with -o") from error

    def begin(self, names: Collection[str]) -> None:
        """Mark the folder as a lot's."""
        self.write_summary(UnfinishedLot(tool=THIS_TOOL, made_from=(), names=tuple(names)))

    def write_summary(self, summary: LotSummary | UnfinishedLot) -> None:
        """Write batch.json, of a lot that has come to its end or not."""
        write_file(self.folder / SUMMARY_NAME, to_json_bytes(summary))

    def of(self, name: str) -> Path:
        """Return a valve's folder."""
        return self.folder / VALVES / name

    def write(self, outcome: Outcome) -> None:
        """Write a valve's folder, whole or not at all, in place of what an earlier run made of it."""
        files = dict(outcome.files)
        if outcome.manifest.reason:
            files["reason.txt"] = f"{outcome.manifest.reason}\n".encode()
        firmware = files.get(f"{FIRMWARE}/{MANIFEST_NAME}")  # its board files are the user's to fill in
        board = tuple(f"{FIRMWARE}/{name}" for name in json.loads(firmware)["board"]) if firmware else ()
        write_folder(self.of(outcome.name), files, replace(outcome.manifest, board=board))

    def refuse(self, name: str, reason: str) -> None:
        """Turn a calibrated valve into a failed one, without its block and what was found of it.

        The next run tries it again.
        """
        folder = self.of(name)
        manifest = replace(read_manifest(folder), status=FAILED, reason=reason, inputs_sha256=None, outputs=())
        kept = [file for file in manifest.files if file in (ValveModel.FILE_NAME, Compensator.FILE_NAME)]
        self.write(Outcome(manifest=manifest, files={file: (folder / file).read_bytes() for file in kept}))

    def read(self, name: str, unwritten: Mapping[str, str]) -> ValveFolder:
        """Read a valve's folder; one that could not be written has failed, whatever an earlier run left there."""
        if name not in unwritten:
            return read_valve_folder(self.of(name))
        return ValveFolder(
            manifest=ValveManifest(
                tool=THIS_TOOL, made_from=(), name=name, status=FAILED, reason=unwritten[name], files={}
            )
        )

    def is_done(self, name: str, digest: str) -> bool:
        """Tell whether a valve's folder was made from these inputs and holds every file as it was written."""
        folder = self.of(name)
        try:
            manifest = read_manifest(folder)
            return manifest.inputs_sha256 == digest and all(
                # A person's version of a board file is as good.
                sha256_of((folder / file).read_bytes()) == sha256 or file in manifest.board
                for file, sha256 in manifest.files.items()
            )
        except (InputError, OSError):
            return False
