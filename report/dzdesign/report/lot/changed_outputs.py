"""Whether a valve's firmware and outputs are still what their manifests say: a lot's table has no other hashes."""

from pathlib import Path

from dzdesign.core.artefact_types import schema_of
from dzdesign.core.documents import family_of
from dzdesign.core.errors import InputError
from dzdesign.core.folder_contents import manifest_of
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify.firmware.folder import read_firmware_manifest
from dzdesign.verify.firmware.reproduced import change_since
from dzdesign.verify.outputs.folder import read_output_manifest


def change_in(folder: Path) -> str:
    """Return what was changed, added or taken away in the folder of a firmware or an output since it was generated.

    Empty where nothing was, but for what is the user's to fill in.
    """
    manifest = manifest_of(folder)
    try:
        if manifest and family_of(manifest["schema"]) == family_of(schema_of(FirmwareManifest)):
            return change_since(folder, read_firmware_manifest(folder))
        return change_since(folder, read_output_manifest(folder))
    except (InputError, OSError) as error:
        return str(error)
