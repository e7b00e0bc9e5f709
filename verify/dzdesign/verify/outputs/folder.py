"""The folder of an output as it is given: its manifest, and whether its files are those that were generated."""

from collections.abc import Iterator
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, check_inside, read_bytes, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import SourceFile, schema_of
from dzdesign.core.documents import family_of
from dzdesign.core.errors import and_more
from dzdesign.core.folder_contents import digest_of, manifest_of
from dzdesign.design.compensator import Compensator
from dzdesign.design.output_manifest import OutputManifest
from dzdesign.verify.firmware.folder import check_firmware_inside
from dzdesign.verify.requirements import FILES, OUTPUT_MANIFEST, Check

#: Files that a sentence names.
MOST_NAMED = 5


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


def files_unchanged(folder: Path, manifest: OutputManifest) -> Check:
    """Tell which files are not those that were generated: changed, missing or added."""
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()} - {MANIFEST_NAME}
    if added := sorted(there - manifest.files.keys()):
        text = f"the manifest does not name {and_more(added, MOST_NAMED)}; keep files of your own outside"
        return FILES.check(holds=False, text=text)
    changed = [
        name
        for name, digest in manifest.files.items()
        if name not in there or digest_of(folder / name) != digest
    ]
    if changed:
        return FILES.check(holds=False, text=f"changed or missing: {and_more(changed, MOST_NAMED)}")
    return FILES.check(holds=True, text=f"{len(manifest.files)} files compared")


def manifest_follows(folder: Path, manifest: OutputManifest, compensator: Compensator) -> Check:
    """Tell whether the manifest states what the output was made from."""
    faults = list(_faults_of_origin(folder, manifest, compensator))
    if faults:
        text = f"{and_more(faults, 1)}; make the output again with `dzdesign codegen`"
        return OUTPUT_MANIFEST.check(holds=False, text=text)
    settings = manifest.settings_in_words
    return OUTPUT_MANIFEST.check(holds=True, text=f"law, target{settings} and hashes agree with the manifest")


def _faults_of_origin(folder: Path, manifest: OutputManifest, compensator: Compensator) -> Iterator[str]:
    digest = sha256_of((folder / Compensator.FILE_NAME).read_bytes())
    if manifest.law != compensator.law:
        yield f"the manifest's law is {manifest.law}, the compensator's {compensator.law}"
    if Compensator.FILE_NAME not in manifest.files:
        yield f"the manifest does not name {Compensator.FILE_NAME}"
    for key, stated, value in (
        ("made_from", manifest.made_from, (SourceFile(source=Compensator.FILE_NAME, sha256=digest),)),
        ("origin.compensator_json", manifest.origin.compensator_json, digest),
        ("origin.valve_json", manifest.origin.valve_json, compensator.valve_json_sha256),
        ("origin.ramp_tests", manifest.origin.ramp_tests, compensator.valve.made_from),
    ):
        if stated != value:
            yield f"the manifest's {key} is not that of {Compensator.FILE_NAME}"
