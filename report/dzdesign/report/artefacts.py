"""What a report is of: the artefacts of one folder, from the evidence back to the valve, and the outputs beside them.

Each lies where its command writes it, and states the hash of what it was made from. A file whose hash is another was
changed since, or is of something else: no report is made of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar

from dzdesign.assess.assessment import Assessment
from dzdesign.core.artefact_files import MANIFEST_NAME, board_of, digest_of, manifest_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import Artefact, schema_of, to_json_bytes
from dzdesign.core.display import verdict_words
from dzdesign.core.documents import family_of, read_bytes, sha256_of, written_by
from dzdesign.core.errors import InputError, and_more
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest, OutputManifest, setting_words
from dzdesign.design.side_law import SideLaw
from dzdesign.identify.valve.model import SIDES, ValveModel
from dzdesign.verify.closed_loop.ramps import Curves, read_curves
from dzdesign.verify.evidence import Evidence, OutputEvidence
from dzdesign.verify.folder import added_files, read_compensator
from dzdesign.verify.requirements import REPRODUCED

#: Role of an artefact -> what it is called, and its type, from the evidence back to the recordings.
ROLES: Mapping[str, tuple[str, type[Artefact]]] = {
    "evidence": ("evidence", Evidence),
    "firmware": ("firmware", FirmwareManifest),
    "compensator": ("compensator", Compensator),
    "valve": ("valve", ValveModel),
    "assessment": ("assessment of recordings", Assessment),
}
#: Manifests of what was made of a compensator, and evidence of it: folders of one stage, whose neighbours belong to it.
MADE: tuple[type[FirmwareManifest | OutputManifest], ...] = (FirmwareManifest, OutputManifest)
OF_MADE: tuple[type[Evidence | OutputEvidence], ...] = (Evidence, OutputEvidence)
#: Folders beside a valve's artefacts, as the commands call them.
EVIDENCE, FIRMWARE = "evidence", "firmware"
WROTE = "`dzdesign verify` wrote another one"
#: Verdicts, from the one that counts before all others.
COUNTS_FIRST = (False, None, True)
#: Files that a sentence names.
NAMED = 5
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
    place = next((each for each in (folder, root / EVIDENCE) if (each / Evidence.FILE_NAME).is_file()), None)
    chain = _read_evidence(root, place) if place else Chain(root=root)
    if firmware and not _is_of(manifest_of(firmware), FirmwareManifest):
        raise InputError(f"--firmware '{firmware}' is not a firmware folder, which `dzdesign codegen` writes")
    if chain.evidence:
        firmware = firmware or root / Path(chain.evidence.made_from[0].source).parent.name
    chain = _followed(chain, root, firmware or (folder if folder != root else root / FIRMWARE), (root, folder))
    if not chain.places:
        raise InputError(
            f"'{folder}' has no artefact of dzdesign, expected verification.json, firmware, compensator.json or "
            "valve.json; give the folder that `dzdesign demo`, `verify` or `design` wrote"
        )
    return chain


def chain_of_evidence(evidence: Evidence, curves: Mapping[str, Curves], output: Path, firmware: Path) -> Chain:
    """Return the chain of evidence that is made this moment, to be written into `output`, and of its firmware."""
    root, name = firmware.resolve().parent, f"{output.resolve().name}/{evidence.FILE_NAME}"
    places = {"evidence": Place(name, sha256_of(to_json_bytes(evidence)))}
    return _followed(Chain(root=root, evidence=evidence, places=places, curves=curves), root, firmware, (root,))


def root_of(folder: Path) -> Path:
    """Return the folder that holds all of a valve's artefacts: that around an evidence, firmware or output folder."""
    manifest = manifest_of(folder)
    return folder.parent if _is_of(manifest, *MADE, *OF_MADE) else folder


def _read_evidence(root: Path, folder: Path) -> Chain:
    """Read what `verify` wrote: the artefact and its curves, each as the manifest beside them states it."""
    manifest, path, curves = manifest_of(folder), folder / Evidence.FILE_NAME, {}
    stated = manifest["files"] if manifest else {}
    if path.name not in stated:
        raise InputError(f"'{folder / MANIFEST_NAME}' does not state its files; run `dzdesign verify` again")
    for table in (folder / name for name in stated if name.endswith(".csv")):
        _check(table, stated[table.name], WROTE)
        try:
            curves[table.name] = read_curves(table.read_text(encoding="utf-8"))
        except ValueError as error:
            raise InputError(f"'{table}' is no table of numbers ({error}); run `dzdesign verify` again") from error
    places = {"evidence": Place(_name(path, root), _check(path, stated[path.name], WROTE))}
    evidence = read_artefact(read_bytes(path, "evidence"), Evidence, str(path))
    return Chain(root=root, evidence=evidence, places=places, curves=curves)


def _followed(chain: Chain, root: Path, folder: Path, beside: tuple[Path, ...]) -> Chain:
    """Return a chain with the firmware in a folder, what it was made from, and the other artefacts `beside` it."""
    evidence, places, missing = chain.evidence, dict(chain.places), []

    def read(kind: type[Kind], role: str, path: Path, stated: str | None = None, otherwise: str = "") -> Kind:
        places[role] = Place(_name(path, root), _check(path, stated, otherwise))
        return read_artefact(read_bytes(path, ROLES[role][0]), kind, str(path))

    firmware, compensator, valve, assessment, stated = None, None, None, None, None
    if _is_of(manifest_of(folder), FirmwareManifest):
        verified = evidence.made_from[0].sha256 if evidence else None
        of = "the evidence is of another one"
        firmware = read(FirmwareManifest, "firmware", folder / MANIFEST_NAME, verified, of)
        _refuse_changes(folder, firmware, evidence)
        beside, stated = (folder, *beside), firmware.origin.compensator_json
    valve_json = _first(ValveModel, beside)
    if path := _first(Compensator, beside):
        compensator = read_compensator(path.parent)  # as `verify` has read it
        held, valve = _name(path, root), compensator.valve
        places["compensator"] = Place(held, _check(path, stated, "the firmware was made from another one"))
        places["valve"] = Place(f"{held}, its key “valve”", sha256_of(to_json_bytes(valve)))
        if valve_json and (digest := digest_of(valve_json)) == compensator.valve_json_sha256:
            places["valve"] = Place(_name(valve_json, root), digest)
        elif valve_json:
            which = f"the one that {held} was made from stands in it"
            missing.append(f"{_name(valve_json, root)} is another valve by now, of SHA-256 {digest}; {which}")
    elif valve_json:
        valve = read(ValveModel, "valve", valve_json)
    if path := _first(Assessment, beside):
        assessment = read(Assessment, "assessment", path)
        if valve and not {each.sha256 for each in valve.made_from} & {each.sha256 for each in assessment.made_from}:
            name, assessment = places.pop("assessment").name, None
            missing.append(f"assessment of recordings of this valve: {name} compares others, so it is not shown")
    found = {"evidence": evidence, "firmware": firmware, "compensator": compensator, "valve": valve}
    absent = [ROLES[role] for role, artefact in found.items() if artefact is None]
    missing += [f"{label}: made by `{written_by(schema_of(kind))}`" for label, kind in absent]
    return replace(
        chain, firmware=firmware, compensator=compensator, valve=valve, assessment=assessment, places=places,
        missing=tuple(missing),
    )  # fmt: skip


def _name(path: Path, root: Path) -> str:
    place = path.resolve()
    return place.name if place.parent == root else f"{place.parent.name}/{place.name}"


def _is_of(manifest: Mapping[str, Any] | None, *kinds: type[Artefact]) -> bool:
    return manifest is not None and family_of(manifest["schema"]) in {family_of(schema_of(kind)) for kind in kinds}


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
    if evidence and any(check.id == REPRODUCED.id and check.holds is False for check in evidence.checks):
        changed = [name for name in changed if name in there]  # the evidence says so of one that was missing already
    if changed:
        how = "added" if changed[0] not in known else "changed" if changed[0] in there else "taken away"
        since = "`dzdesign verify`: run it on the folder again" if evidence else "`dzdesign codegen`: run it again"
        raise InputError(f"'{folder / changed[0]}' was {how} since {since}")


def laws_of(compensator: Compensator | None) -> dict[str, SideLaw]:
    """Return the law of each side that has one."""
    return {name: law for name in SIDES if compensator and (law := getattr(compensator, name))}


# --- other outputs of the same compensator ------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeOutput:
    """One output of the compensator that a report is of.

    `kind` is "C firmware", or the target of another output; `settings` what was chosen of it, in words; `place` its
    folder, below that of the report; `sha256` that of its manifest.json. `changed` says what differs from that: the
    files are no longer those that were generated. `evidence` is where evidence about these bytes stands, empty without
    one; `holds` what it says, None where something was not checked; `inputs` how many were compared with the exact law;
    `fault` which requirement does not hold, or was not checked.
    """

    kind: str
    settings: str
    place: str
    sha256: str
    holds: bool | None = None
    inputs: int = 0
    evidence: str = ""
    fault: str = ""
    changed: str = ""

    @property
    def verdict(self) -> str:
        """In words, as the terminal prints it."""
        if self.changed:
            return "CHANGED"
        return verdict_words(self.holds) if self.evidence or self.holds is not None else "NOT VERIFIED"

    @property
    def is_wrong(self) -> bool:
        """Whether nobody should use it: it was changed, or its evidence says that it does not hold."""
        return bool(self.changed) or self.holds is False


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeOutputs:
    """The outputs of one compensator in a folder; `others` are sentences on those that were not listed."""

    listed: tuple[MadeOutput, ...] = ()
    others: tuple[str, ...] = ()


def outputs_in(root: Path, compensator_json: str) -> MadeOutputs:
    """Return the outputs in the folders of a valve that were made of this compensator.json, with their evidence.

    What can't be read, and what is of another compensator, is a sentence.
    """
    listed: list[MadeOutput] = []
    others: list[str] = []
    folders = sorted(each for each in root.iterdir() if each.is_dir() and not each.name.startswith("."))
    for folder in folders:
        path, header = folder / MANIFEST_NAME, manifest_of(folder)
        if not _is_of(header, *MADE):
            continue
        try:
            manifest = read_artefact(read_bytes(path, "manifest"), MADE, f"{folder.name}/{path.name}")
            output = _with_evidence(_output(folder, manifest), folders)
        except InputError as error:
            others.append(f"'{folder.name}' is not listed: {error}")
            continue
        if manifest.origin.compensator_json == compensator_json:
            listed.append(output)
        else:
            what = f"{output.place} ({output.kind}) was made from another compensator.json"
            others.append(f"{what}, of SHA-256 {manifest.origin.compensator_json}: not listed")
    return MadeOutputs(listed=tuple(listed), others=tuple(others))


def _output(folder: Path, manifest: FirmwareManifest | OutputManifest) -> MadeOutput:
    if isinstance(manifest, FirmwareManifest):
        form = "numbers in a calibration block" if manifest.calibration == "block" else "numbers fixed in the core"
        kind, settings = "C firmware", f"{manifest.target}, {form}"
    else:
        kind, settings = manifest.target, ", ".join(setting_words(manifest.settings))
    digest, changed = digest_of(folder / MANIFEST_NAME), change_in(folder)
    return MadeOutput(kind=kind, settings=settings, place=f"{folder.name}/", sha256=digest, changed=changed)


def change_in(folder: Path) -> str:
    """Return what is not as `codegen` wrote it in the folder of a firmware or another output; empty if nothing is.

    What is the user's to fill in is left out.
    """
    manifest = manifest_of(folder)
    if manifest is None:
        return f"{MANIFEST_NAME} is missing"
    files, board = manifest["files"], board_of(manifest)
    if _is_of(manifest, OutputManifest):
        there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
        if added := sorted(there - files.keys() - {MANIFEST_NAME}):
            return f"the manifest does not name {and_more(added, NAMED)}; keep files of your own outside"
    changed = [name for name, digest in files.items() if name not in board and not _is(folder / name, digest)]
    return f"changed or missing: {and_more(changed, NAMED)}" if changed else ""


def _is(path: Path, digest: str) -> bool:
    return path.is_file() and digest_of(path) == digest


def _with_evidence(output: MadeOutput, places: Sequence[Path]) -> MadeOutput:
    """Return an output with what evidence of its manifest says; of two pieces of evidence what is worse counts."""
    said: list[MadeOutput] = []
    for path in (place / kind.FILE_NAME for place in places for kind in OF_MADE):
        if not path.is_file() or output.sha256.encode() not in path.read_bytes():  # as evidence states what it is of
            continue
        name, manifest = f"{path.parent.name}/{path.name}", manifest_of(path.parent)
        if manifest and not _is(path, manifest["files"].get(path.name, "")):
            raise InputError(f"'{name}' was changed since `dzdesign verify` wrote it; run that again")
        evidence: Evidence | OutputEvidence = read_artefact(read_bytes(path, "evidence"), OF_MADE, name)
        checks = evidence.all_checks if isinstance(evidence, Evidence) else evidence.checks
        worst = min(checks, key=lambda check: COUNTS_FIRST.index(check.holds))
        inputs = sum(each.inputs for each in evidence.inputs)
        fault = "" if worst.holds else f"{worst.name}: {worst.text}"
        said.append(replace(output, holds=worst.holds, inputs=inputs, evidence=name, fault=fault))
    return min(said, key=lambda one: COUNTS_FIRST.index(one.holds), default=output)
