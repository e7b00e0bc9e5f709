"""What a report is of: the artefacts of one folder, from the evidence back to the valve.

Each lies where its command writes it. From the evidence back each states the hash of what it was made from: a file
whose hash is another was changed, or is of something else; it is named in the report, and not used.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from dzdesign.assess.assessment import Assessment
from dzdesign.core.artefact_files import MANIFEST_NAME, read_bytes, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import Artefact, schema_of, to_json_bytes
from dzdesign.core.documents import family_of, written_by
from dzdesign.core.errors import InputError
from dzdesign.core.folder_contents import digest_of, manifest_of
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.design.output_manifest import OutputManifest
from dzdesign.design.side_law import SideLaw
from dzdesign.identify.valve.model import SIDES, ValveModel, Warning_
from dzdesign.report.reproduction import Reproduction
from dzdesign.verify.closed_loop.evidence_curves import Curves, read_curves
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.firmware.unchanged_files import added_files
from dzdesign.verify.output_evidence import OutputEvidence

#: Role of an artefact -> what it is called, and its type, from the evidence back to the recordings.
ROLES: Mapping[str, tuple[str, type[Artefact]]] = {
    "evidence": ("evidence", Evidence),
    "firmware": ("firmware", FirmwareManifest),
    "compensator": ("compensator", Compensator),
    "valve": ("valve", ValveModel),
    "assessment": ("assessment of recordings", Assessment),
    "reproduction": ("the paper's numbers", Reproduction),
}
#: Manifests of the folders of one stage, whose neighbours belong to it; a valve's folder of a batch has another.
STAGES = {family_of(schema_of(kind)) for kind in (Evidence, OutputEvidence, FirmwareManifest, OutputManifest)}
#: Folders beside a valve's artefacts, as the commands call them.
EVIDENCE, FIRMWARE = "evidence", "firmware"
WROTE = "`dzdesign verify` wrote another one"
#: Of a valve, what a design for commands of both signs has made untrue: that one side is left out.
OF_ONE_SIGN = "two-sides"


@dataclass(frozen=True, slots=True)
class Place:
    """Where an artefact was found: name below the folder of the report, and hash."""

    name: str
    sha256: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """What a report is of; an artefact that was not found is None.

    `places` is where each was found, by its role; `curves` the numbers of the evidence by the files' names. `faults` do
    not fit (changed, or of another chain) and are not used; `missing` names what is not there, and which command makes
    it. `root` is the folder around all of them.
    """

    root: Path | None = None
    evidence: Evidence | None = None
    firmware: FirmwareManifest | None = None
    compensator: Compensator | None = None
    valve: ValveModel | None = None
    assessment: Assessment | None = None
    reproduction: Reproduction | None = None
    places: Mapping[str, Place] = field(default_factory=dict)
    curves: Mapping[str, Curves] = field(default_factory=dict)
    faults: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()

    @property
    def recorded_units(self) -> RecordedUnits:
        """The units of the valve's recordings; without a valve V, MPa and L/min."""
        return self.valve.recorded_units if self.valve else AS_COMPUTED


def read_chain(folder: Path, firmware: Path | None = None) -> Chain:
    """Read the artefacts of a folder: of evidence, or with evidence, firmware, compensator.json or valve.json in it.

    `firmware` is the folder that the evidence is of; by default the one of the name that the evidence states, beside
    it.
    """
    if not folder.is_dir():
        raise InputError(f"'{folder}' is not a folder, expected one with artefacts of dzdesign; check the name")
    folder = folder.resolve()
    reading = _Reading(root_of(folder))
    place = folder if (folder / Evidence.FILE_NAME).is_file() else reading.root / EVIDENCE
    evidence = reading.evidence(place)
    of_evidence = Path(evidence.made_from[0].source).parent.name if evidence and evidence.made_from else FIRMWARE
    of_folder = folder if folder not in (place, reading.root) else reading.root / of_evidence
    chain = reading.follow(evidence, firmware or of_folder, (reading.root, folder))
    if not chain.places:
        raise InputError(
            "; ".join(reading.unreadable)
            or f"'{folder}' has no artefact of dzdesign, expected verification.json, firmware, compensator.json or "
            "valve.json; give the folder that `dzdesign demo`, `verify` or `codegen` wrote"
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
        self.faults: list[str] = []
        self.missing: list[str] = []
        self.unreadable: list[str] = []

    def evidence(self, place: Path) -> Evidence | None:
        """Read what `verify` wrote: the artefact and its curves, each as the manifest beside them states it."""
        path = place / Evidence.FILE_NAME
        if not path.is_file():
            self.miss("evidence")
            return None
        stated = (manifest_of(place) or {"files": {}})["files"]
        if not stated:
            what = f"{MANIFEST_NAME} beside {place.name}/{Evidence.FILE_NAME}, which `dzdesign verify` writes"
            self.missing.append(f"{what}: nothing tells whether that is as written")
        for curves in sorted(place.glob("*.csv")):
            if self._is_of(curves, stated.get(curves.name), WROTE):
                try:
                    self.curves[curves.name] = read_curves(curves.read_text(encoding="utf-8"))
                except ValueError as error:
                    self.faults.append(f"'{curves.name}' is no table of numbers ({error}): not used")
        evidence: Evidence | None = self._link("evidence", path, stated.get(path.name), WROTE)
        return evidence

    def follow(self, evidence: Evidence | None, firmware_folder: Path, beside: tuple[Path, ...]) -> Chain:
        """Read what the evidence is of, what that was made from, and what `assess` and `reproduce` left `beside`."""
        manifest, path = manifest_of(firmware_folder), None
        if manifest and family_of(manifest["schema"]) == family_of(schema_of(FirmwareManifest)):
            path = firmware_folder / MANIFEST_NAME
        stated = evidence.made_from[0].sha256 if evidence and evidence.made_from else None
        firmware: FirmwareManifest | None = self._link("firmware", path, stated, "the evidence is of another one")
        if firmware:
            self.faults += changes_since(firmware_folder, firmware, evidence)
            beside = (firmware_folder, *beside)
        made_from, path = firmware.origin.compensator_json if firmware else None, _first(Compensator, beside)
        compensator = self._link("compensator", path, made_from, "the firmware was made from another one")
        if compensator:
            self._take_valve(compensator, _first(ValveModel, beside))
        else:
            self._link("valve", _first(ValveModel, beside), None)
        for role in ("assessment", "reproduction"):
            if path := _first(ROLES[role][1], beside):
                self._link(role, path, None)
        self._leave_strangers_out()
        missing = (*self.missing, *self.unreadable)
        return Chain(root=self.root, **self.found, places=self.places, curves=self.curves, faults=tuple(self.faults),
                     missing=missing)  # fmt: skip

    def _link(self, role: str, path: Path | None, stated: str | None, otherwise: str = "") -> Any:
        """Read an artefact, if its hash is the one that is stated; without one that can't be read the rest is reported.
        """
        if path is None or not self._is_of(path, stated, otherwise):
            return self.miss(role, stated)
        label, kind = ROLES[role]
        try:
            artefact = read_artefact(read_bytes(path, label), kind, self._name(path))
        except InputError as error:
            # What the evidence rests on must not go missing without a word: its verdict would stand.
            (self.faults if role == "compensator" and self.found else self.unreadable).append(f"{label}: {error}")
            return None
        return self.take(role, artefact, Place(self._name(path), digest_of(path)))

    def take(self, role: str, artefact: Artefact, place: Place) -> Artefact:
        """Keep an artefact of a role."""
        self.found[role], self.places[role] = artefact, place
        return artefact

    def miss(self, role: str, stated: str | None = None) -> None:
        """Say what is missing, and which command makes it."""
        label, kind = ROLES[role]
        of = f" of SHA-256 {stated}" if stated else ""
        self.missing.append(f"{label}{of}: made by `{written_by(schema_of(kind))}`")

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
        valve, assessment = self.found.get("valve"), self.found.get("assessment")
        if valve and assessment and not {each.sha256 for each in valve.made_from} & {
            each.sha256 for each in assessment.made_from
        }:
            del self.found["assessment"]
            name = self.places.pop("assessment").name
            self.missing.append(f"assessment of recordings of this valve: {name} compares others, so it is not shown")

    def _is_of(self, path: Path, stated: str | None, otherwise: str) -> bool:
        """Tell whether a file has the hash that is stated; of another one say so."""
        digest = digest_of(path)
        if stated not in (None, digest):
            self.faults.append(f"{self._name(path)} has the SHA-256 {digest}, but {otherwise}, of {stated}: not used")
        return stated in (None, digest)

    def _name(self, path: Path) -> str:
        place = path.resolve()
        return place.name if place.parent == self.root else f"{place.parent.name}/{place.name}"


def _first(kind: type[Artefact], places: tuple[Path, ...]) -> Path | None:
    return next((path for path in (place / kind.FILE_NAME for place in places) if path.is_file()), None)


def changes_since(folder: Path, firmware: FirmwareManifest, evidence: Evidence | None) -> list[str]:
    """Return a sentence on each file of a firmware that is another, or none, since it was verified, or generated.

    A board file is its user's to change; but evidence is of the one that was there when it was made.
    """
    known = {**firmware.files, **(evidence.differing_files if evidence else {})}
    names = [*firmware.files, *added_files(folder, firmware)]
    there = {name: digest_of(folder / name) for name in names if (folder / name).is_file()}
    changed = sorted(name for name in known.keys() | there.keys() if there.get(name) != known.get(name))
    if evidence is None:
        changed = [name for name in changed if name in firmware.files and name not in firmware.board]
    since = "`dzdesign verify`; run it on the folder again" if evidence else "`dzdesign codegen`"

    def how(name: str) -> str:
        return "was added" if name not in known else "was changed" if name in there else "is gone"

    return [f"{folder.name}/{name} {how(name)} since {since}" for name in changed]


def laws_of(compensator: Compensator | None) -> dict[str, SideLaw]:
    """Return the law of each side that has one."""
    return {name: law for name in SIDES if compensator and (law := getattr(compensator, name))}


def standing_warnings(valve: ValveModel | None, compensator: Compensator | None) -> tuple[Warning_, ...]:
    """Return the warnings of a valve without what its compensator, made for commands of both signs, has settled."""
    drives_both = len(laws_of(compensator)) == len(SIDES)
    return tuple(each for each in (valve.warnings if valve else ()) if not (drives_both and each.code == OF_ONE_SIGN))
