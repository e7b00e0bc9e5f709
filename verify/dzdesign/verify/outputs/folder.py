"""The folder of an output as it is given: its manifest, and that nothing in it leads elsewhere."""

from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, check_inside, read_bytes
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.documents import family_of
from dzdesign.core.folder_contents import manifest_of
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.verify.firmware.folder import check_firmware_inside


def holds_output(folder: Path) -> bool:
    """Tell whether a folder is that of an output, and not of a C firmware or of nothing of ours."""
    manifest = manifest_of(Path(folder))
    return manifest is not None and family_of(manifest["schema"]) == family_of(schema_of(OutputManifest))


def read_output_manifest(folder: Path) -> OutputManifest:
    """Return the manifest of an output's folder; every file that it names must be one in this folder."""
    path = folder / MANIFEST_NAME
    manifest = read_artefact(read_bytes(path, "manifest of the output"), OutputManifest, str(path))
    check_inside(folder, manifest.files, f"'{path}'")
    check_firmware_inside(folder)
    return manifest
