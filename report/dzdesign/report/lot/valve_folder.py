"""The folder of one valve of a lot: its manifest as a type, and the calibrated valve read back from it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from msgspec import Meta

from dzdesign.core.artefact_files import MANIFEST_NAME, read_bytes, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import Artefact
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.report.lot.output_types import ValveOutput
from dzdesign.report.lot.summary import AGAIN, OK, Sha256, Status

#: Folder of a lot in which each valve has its own.
VALVES = "valves"
#: Folder of a valve's firmware, in the folder of its results.
FIRMWARE = "firmware"


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveManifest(Artefact):
    """Result of one valve of a lot."""

    FILE_NAME: ClassVar[str] = MANIFEST_NAME
    schema: Annotated[Literal["dzdesign.batch-valve/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.batch-valve/1"
    )
    name: Annotated[str, Meta(description="Name of the valve.")]
    status: Annotated[
        Status, Meta(description="Whether the valve is calibrated. does not hold: a requirement is not met.")
    ]
    reason: Annotated[str, Meta(description="Reason why it is not calibrated, in one sentence.")] = ""
    inputs_sha256: Annotated[
        Sha256 | None,
        Meta(description="SHA-256 of the recordings, options and version; null if the next run must try again."),
    ] = None
    board: Annotated[tuple[str, ...], Meta(description="Files of the firmware for the user to complete.")] = ()
    outputs: Annotated[
        tuple[ValveOutput, ...], Meta(description="Results of the other outputs; empty if there are none.")
    ] = ()
    files: Annotated[Mapping[str, Sha256], Meta(description="SHA-256 of each file in the same folder.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ValveFolder:
    """A valve of a lot, as its folder has it: its manifest and, where it was calibrated, valve and compensator."""

    manifest: ValveManifest
    compensator: Compensator | None = None

    @property
    def name(self) -> str:
        """Its name."""
        return self.manifest.name


def read_manifest(folder: Path) -> ValveManifest:
    """Return what a valve's folder says of itself."""
    path = folder / MANIFEST_NAME
    return read_artefact(read_bytes(path, "manifest of a valve"), ValveManifest, str(path), AGAIN)


def read_valve_folder(folder: Path) -> ValveFolder:
    """Read a valve's folder."""
    manifest = read_manifest(folder)
    if manifest.status != OK:
        return ValveFolder(manifest=manifest)
    path = folder / "compensator.json"
    content = read_bytes(path, "compensator of the lot")
    if sha256_of(content) != manifest.files.get(path.name):
        raise InputError(f"'{path}' was changed; take the valve's folder away and {AGAIN}")
    return ValveFolder(manifest=manifest, compensator=read_artefact(content, Compensator, str(path)))
