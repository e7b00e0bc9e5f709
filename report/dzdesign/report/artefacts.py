"""What a report is of: the artefacts of one folder, from the evidence back to the valve.

Each lies where its command writes it, and states the hash of what it was made from. A file whose hash is another was
changed since, or is of something else: no report is made of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from dzdesign.assess.assessment import Assessment
from dzdesign.core.artefact_files import MANIFEST_NAME, read_bytes, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import Artefact, schema_of, to_json_bytes
from dzdesign.core.documents import family_of, written_by
from dzdesign.core.errors import InputError
from dzdesign.core.folder_contents import digest_of, manifest_of
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest
from dzdesign.design.side_law import SideLaw
from dzdesign.identify.valve.model import SIDES, ValveModel, Warning_
from dzdesign.verify.closed_loop.ramps import Curves, read_curves
from dzdesign.verify.evidence import Evidence, OutputEvidence
from dzdesign.verify.folder import added_files, read_compensator

#: Role of an artefact -> what it is called, and its type, from the evidence back to the recordings.
ROLES: Mapping[str, tuple[str, type[Artefact]]] = {
    "evidence": ("evidence", Evidence),
    "firmware": ("firmware", FirmwareManifest),
    "compensator": ("compensator", Compensator),
    "valve": ("valve", ValveModel),
    "assessment": ("assessment of recordings", Assessment),
}
#: Manifests of the folders of one stage, whose neighbours belong to it; a valve's folder of a batch has another.
STAGES = {family_of(schema_of(kind)) for kind in (Evidence, OutputEvidence, FirmwareManifest, OutputManifest)}
#: Folders beside a valve's artefacts, as the commands call them.
EVIDENCE, FIRMWARE = "evidence", "firmware"
WROTE = "`dzdesign verify` wrote another one"
#: Of a valve, what a design for commands of both signs has made untrue: that one side is left out.
OF_ONE_SIGN = "two-sides"
Kind = TypeVar("Kind", bound=Artefact)


@dataclass(frozen=True, slots=True)
class Place:
    """Where an artefact was found: name below the folder of the report, and hash."""

    name: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """What a report is of; an artefact that was not found is None.

    A firmware has its compensator, and that its valve. `root` is the folder around them, `places` where each was found,
    by its role; `curves` are the numbers of the evidence by the files' names. `missing` names what is not there, and
    which command makes it.
    """

    root: Path | None = None
    evidence: Evidence | None = None
    firmware: FirmwareManifest | None = None
    compensator: Compensator | None = None
    valve: ValveModel | None = None
    assessment: Assessment | None = None
    places: Mapping[str, Place] = field(default_factory=dict)
    curves: Mapping[str, Curves] = field(default_factory=dict)
    missing: tuple[str, ...] = ()

    @property
    def recorded_units(self) -> RecordedUnits:
        """The units of the valve's recordings; without a valve V, MPa and L/min."""
        return self.valve.recorded_units if self.valve else AS_COMPUTED


def read_chain(folder: Path, firmware: Path | None = None) -> Chain:
    """Read the artefacts of a folder: of evidence, or with evidence, firmware, compensator.json or valve.json in it.

    `firmware` is the folder that the evidence is of; by default the one of the name that the evidence states, beside
    it. What was changed since it was written, or is of something else, is an `InputError`.
    """
    if not folder.is_dir():
        raise InputError(f"'{folder}' is not a folder, expected one with artefacts of dzdesign; check the name")
    folder = folder.resolve()
    root = root_of(folder)
    place = folder if (folder / Evidence.FILE_NAME).is_file() else root / EVIDENCE
    reading = _Reading(root)
    evidence = reading.evidence(place) if (place / Evidence.FILE_NAME).is_file() else None
    if firmware and not _is_firmware(firmware):
        raise InputError(f"--firmware '{firmware}' is not a firmware folder, which `dzdesign codegen` writes")
    if evidence:
        firmware = firmware or root / Path(evidence.made_from[0].source).parent.name
    else:
        firmware = firmware or (folder if folder != root else root / FIRMWARE)
    chain = reading.follow(evidence, firmware, (root, folder))
    if not chain.places:
        raise InputError(
            f"'{folder}' has no artefact of dzdesign, expected verification.json, firmware, compensator.json or "
            "valve.json; give the folder that `dzdesign demo`, `verify` or `design` wrote"
        )
    return chain


def chain_of_evidence(evidence: Evidence, curves: Mapping[str, Curves], output: Path, firmware: Path) -> Chain:
    """Return the chain of evidence that is made this moment, to be written into `output`, and of its firmware."""
    reading = _Reading(firmware.resolve().parent)
    reading.curves = dict(curves)
    name = f"{output.resolve().name}/{evidence.FILE_NAME}"
    reading.take("evidence", evidence, Place(name, sha256_of(to_json_bytes(evidence))))
    return reading.follow(evidence, firmware, (reading.root,))


def root_of(folder: Path) -> Path:
    """Return the folder that holds all of a valve's artefacts: that around an evidence, firmware or output folder."""
    manifest = manifest_of(folder)
    return folder.parent if manifest and family_of(manifest["schema"]) in STAGES else folder


class _Reading:
    """Follows the hashes from the evidence back to the valve."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.curves: dict[str, Curves] = {}
        self.found: dict[str, Any] = {}
        self.places: dict[str, Place] = {}
        self.missing: list[str] = []

    def evidence(self, place: Path) -> Evidence:
        """Read what `verify` wrote: the artefact and its curves, each as the manifest beside them states it."""
        manifest = manifest_of(place)
        stated = manifest["files"] if manifest else {}
        if Evidence.FILE_NAME not in stated:
            raise InputError(f"'{place / MANIFEST_NAME}' does not state its files; run `dzdesign verify` again")
        for path in (place / name for name in stated if name.endswith(".csv")):
            _check(path, stated[path.name], WROTE)
            try:
                self.curves[path.name] = read_curves(path.read_text(encoding="utf-8"))
            except ValueError as error:
                raise InputError(f"'{path}' is no table of numbers ({error}); run `dzdesign verify` again") from error
        evidence = self._read("evidence", Evidence, place / Evidence.FILE_NAME, stated[Evidence.FILE_NAME], WROTE)
        if not evidence.made_from:
            raise InputError(f"'{place / Evidence.FILE_NAME}': 'made_from' is empty; run `dzdesign verify` again")
        return evidence

    def follow(self, evidence: Evidence | None, folder: Path, beside: tuple[Path, ...]) -> Chain:
        """Read the firmware in a folder, what it was made from, and the other artefacts `beside` it."""
        stated, of = None, "the firmware was made from another one"
        if _is_firmware(folder):
            verified = evidence.made_from[0].sha256 if evidence else None
            path = folder / MANIFEST_NAME
            firmware = self._read("firmware", FirmwareManifest, path, verified, "the evidence is of another one")
            _refuse_changes(folder, firmware, evidence)
            beside, stated = (folder, *beside), firmware.origin.compensator_json
        valve_json = _first(ValveModel, beside)
        if compensator_json := _first(Compensator, beside):
            digest = _check(compensator_json, stated, of)
            compensator = read_compensator(compensator_json.parent)  # as `verify` has read it
            self.take("compensator", compensator, Place(self._name(compensator_json), digest))
            self._take_valve(compensator, valve_json)
        elif valve_json:
            self._read("valve", ValveModel, valve_json)
        if assessment_json := _first(Assessment, beside):
            self._read("assessment", Assessment, assessment_json)
            self._leave_strangers_out()
        absent = [ROLES[role] for role in ("evidence", "firmware", "compensator", "valve") if role not in self.found]
        missing = [*self.missing, *(f"{label}: made by `{written_by(schema_of(kind))}`" for label, kind in absent)]
        return Chain(root=self.root, **self.found, places=self.places, curves=self.curves, missing=tuple(missing))

    def _read(self, role: str, kind: type[Kind], path: Path, stated: str | None = None, otherwise: str = "") -> Kind:
        """Read an artefact, whose hash is the one that is stated."""
        digest = _check(path, stated, otherwise)
        artefact = read_artefact(read_bytes(path, ROLES[role][0]), kind, str(path))
        self.take(role, artefact, Place(self._name(path), digest))
        return artefact

    def take(self, role: str, artefact: Artefact, place: Place) -> None:
        """Keep an artefact of a role."""
        self.found[role], self.places[role] = artefact, place

    def _take_valve(self, compensator: Compensator, path: Path | None) -> None:
        """Take the valve's file; where that is another by now or not here, the valve that the compensator holds."""
        stated, held = compensator.valve_json_sha256, self.places["compensator"].name
        if path and digest_of(path) == stated:
            self.take("valve", compensator.valve, Place(self._name(path), stated))
            return
        if path:
            which = f"the one that {held} was made from stands in it"
            self.missing.append(f"{self._name(path)} is another valve by now, of SHA-256 {digest_of(path)}; {which}")
        digest = sha256_of(to_json_bytes(compensator.valve))
        self.take("valve", compensator.valve, Place(f"{held}, its key “valve”", digest))

    def _leave_strangers_out(self) -> None:
        """Leave out an assessment whose recordings BEFORE are not the valve's."""
        known, compared = (
            {each.sha256 for each in self.found[role].made_from} if role in self.found else set()
            for role in ("valve", "assessment")
        )
        if known and not known & compared:
            del self.found["assessment"]
            name = self.places.pop("assessment").name
            self.missing.append(f"assessment of recordings of this valve: {name} compares others, so it is not shown")

    def _name(self, path: Path) -> str:
        place = path.resolve()
        return place.name if place.parent == self.root else f"{place.parent.name}/{place.name}"


def _is_firmware(folder: Path) -> bool:
    manifest = manifest_of(folder)
    return manifest is not None and family_of(manifest["schema"]) == family_of(schema_of(FirmwareManifest))


def _check(path: Path, stated: str | None, otherwise: str) -> str:
    """Return the hash of a file, which must be the one that is stated."""
    digest = digest_of(path) if path.is_file() else "none, as it is missing"
    if stated not in (None, digest):
        raise InputError(
            f"'{path}' has the SHA-256 {digest}, but {otherwise}, of {stated}: the files do not belong together; give "
            "the folder as it was written"
        )
    return digest


def _first(kind: type[Artefact], places: tuple[Path, ...]) -> Path | None:
    return next((path for path in (place / kind.FILE_NAME for place in places) if path.is_file()), None)


def _refuse_changes(folder: Path, firmware: FirmwareManifest, evidence: Evidence | None) -> None:
    """Refuse a firmware with a file that is another, or none, since it was verified, or generated.

    A board file is its user's to change; but evidence is of the one that was there when it was made.
    """
    if evidence and evidence.target != firmware.target:
        raise InputError(f"the evidence is for {evidence.target}, '{folder}' for {firmware.target}; give its firmware")
    known = {**firmware.files, **(evidence.differing_files if evidence else {})}
    names = [*firmware.files, *added_files(folder, firmware.files)]
    there = {name: digest_of(folder / name) for name in names if (folder / name).is_file()}
    changed = sorted(name for name in known.keys() | there.keys() if there.get(name) != known.get(name))
    if evidence is None:
        changed = [name for name in changed if name in firmware.files and name not in firmware.board]
    if changed:
        how = "added" if changed[0] not in known else "changed" if changed[0] in there else "taken away"
        since = "`dzdesign verify`: run it on the folder again" if evidence else "`dzdesign codegen`: run it again"
        raise InputError(f"'{folder / changed[0]}' was {how} since {since}")


def laws_of(compensator: Compensator | None) -> dict[str, SideLaw]:
    """Return the law of each side that has one."""
    return {name: law for name in SIDES if compensator and (law := getattr(compensator, name))}


def standing_warnings(valve: ValveModel | None, compensator: Compensator | None) -> tuple[Warning_, ...]:
    """Return the warnings of a valve without what its compensator, made for commands of both signs, has settled."""
    drives_both = len(laws_of(compensator)) == len(SIDES)
    return tuple(each for each in (valve.warnings if valve else ()) if not (drives_both and each.code == OF_ONE_SIGN))
