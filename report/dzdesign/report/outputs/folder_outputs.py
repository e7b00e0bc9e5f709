"""Every output in a folder and in the folders in it that was made of one compensator.json, known by its hash."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.artefact_types import schema_of
from dzdesign.core.documents import family_of
from dzdesign.core.errors import InputError
from dzdesign.core.folder_contents import manifest_of
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.design.output_manifest import OutputManifest, setting_words
from dzdesign.report.artefact_folder import MOST, artefact_root
from dzdesign.report.outputs.evidence_found import FoundEvidence, evidence_in
from dzdesign.report.outputs.files_alone import FILES_ALONE
from dzdesign.report.outputs.made_output import MadeOutput, MadeOutputs
from dzdesign.verify.firmware.folder import read_firmware_manifest
from dzdesign.verify.firmware.reproduced import change_since
from dzdesign.verify.outputs.folder import read_output_manifest

#: A file alone is not larger.
LARGEST_ALONE = 1 << 20
#: Families of the manifests of outputs.
FIRMWARE, OUTPUT = family_of(schema_of(FirmwareManifest)), family_of(schema_of(OutputManifest))


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadOutput:
    """An output that was read, and the hashes that decide whose it is and which evidence is of it."""

    output: MadeOutput
    compensator_json: str
    #: Empty of a file that nothing verifies.
    verified_as: str


def outputs_of_folder(folder: Path, compensator_json: str) -> MadeOutputs:
    """Return the outputs in a folder, of one stage those around it, that were made of this compensator.json.

    An output of another compensator, one that can't be read, and evidence that is not used are sentences.
    """
    root = artefact_root(folder)
    places = [root, *sorted(each for each in root.iterdir() if each.is_dir() and not each.name.startswith("."))[:MOST]]
    evidence, others = evidence_in(places, root)
    listed: list[MadeOutput] = []
    for place in places:
        try:
            found = list(_in_place(place, root))
        except (InputError, OSError) as error:
            others.append(f"'{place.relative_to(root).as_posix()}' is not listed: {error}")
            continue
        for each in found:
            if each.compensator_json == compensator_json:
                listed.append(_with_evidence(each.output, evidence.get(each.verified_as)))
            else:
                others.append(
                    f"{each.output.place} ({each.output.kind}) was made from another compensator.json, of SHA-256 "
                    f"{each.compensator_json}: not listed"
                )
    return MadeOutputs(listed=tuple(listed), others=tuple(others))


def _with_evidence(output: MadeOutput, evidence: FoundEvidence | None) -> MadeOutput:
    if evidence is None:
        return output
    return replace(
        output, holds=evidence.holds, inputs=evidence.inputs, evidence=evidence.place, fault=evidence.fault
    )


def _in_place(place: Path, root: Path) -> Iterator[ReadOutput]:
    """Yield the output that a folder is, or the files alone in it."""
    manifest = manifest_of(place)
    family = family_of(manifest["schema"]) if manifest else ""
    if family == FIRMWARE:
        yield _firmware(place, root)
    elif family == OUTPUT:
        yield _output(place, root)
    else:
        yield from _files_alone(place, root)


def _firmware(place: Path, root: Path) -> ReadOutput:
    manifest, digest = read_firmware_manifest(place), _digest(place)
    form = "numbers in a calibration block" if manifest.calibration == "block" else "numbers fixed in the core"
    return ReadOutput(
        output=MadeOutput(
            kind="C firmware",
            settings=f"{manifest.target}, {form}",
            place=_name(place, root),
            sha256=digest,
            changed=change_since(place, manifest),
        ),
        compensator_json=manifest.origin.compensator_json,
        verified_as=digest,
    )


def _output(place: Path, root: Path) -> ReadOutput:
    manifest, digest = read_output_manifest(place), _digest(place)
    return ReadOutput(
        output=MadeOutput(
            kind=manifest.target,
            settings=", ".join(setting_words(manifest.settings)),
            place=_name(place, root),
            sha256=digest,
            changed=change_since(place, manifest),
        ),
        compensator_json=manifest.origin.compensator_json,
        verified_as=digest,
    )


def _digest(place: Path) -> str:
    return sha256_of((place / MANIFEST_NAME).read_bytes())


def _name(place: Path, root: Path) -> str:
    return f"{place.relative_to(root).as_posix()}/"


def _files_alone(place: Path, root: Path) -> Iterator[ReadOutput]:
    paths = [path for path in sorted(place.iterdir()) if path.is_file() and path.stat().st_size <= LARGEST_ALONE]
    for path in paths[:MOST]:
        for kind in FILES_ALONE:
            found = kind.read(path) if path.suffix.lower() in kind.suffixes else None
            if found is not None:
                output = MadeOutput(
                    kind=kind.label,
                    settings=found.settings,
                    place=path.relative_to(root).as_posix(),
                    sha256=sha256_of(path.read_bytes()),
                )
                yield ReadOutput(
                    output=output, compensator_json=found.compensator_json, verified_as=found.verified_as
                )
                break
