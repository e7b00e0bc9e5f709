"""Which files a report is of: found by the SHA-256 that the chain states, never by a name alone.

From the evidence back to the recordings each artefact states the hash of what it was made from. A file of the right
name whose hash is another is named in the report, and not used.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from dzdesign.assess.assessment import Assessment
from dzdesign.core.artefact_files import MANIFEST_NAME, TOOL, parse_document, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import Artefact, SourceFile, schema_of, to_json_bytes
from dzdesign.core.documents import written_by
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import SCHEMA as COMPENSATOR_SCHEMA
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.design.redesign_check import prove_derived
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefact_folder import VERIFICATION_NAME, is_of, listed_files
from dzdesign.report.reproduction import Reproduction
from dzdesign.verify.evidence import Evidence


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """A kind of artefact: what it is called, its schema, and how a file of it is read."""

    label: str
    schema: str
    read: Callable[[bytes, str], Any]

    @property
    def command(self) -> str | None:
        """The command that makes it; None of what no chain lacks."""
        return written_by(self.schema)


def _typed(label: str, kind: type[Artefact]) -> Kind:
    def read(content: bytes, name: str) -> Artefact:
        return read_artefact(content, kind, name)

    return Kind(label=label, schema=schema_of(kind), read=read)


def _read_compensator(content: bytes, name: str) -> Compensator:
    compensator = read_artefact(content, Compensator, name)
    if parse_document(content, name, (COMPENSATOR_SCHEMA,))["tool"] == TOOL:  # another may have chosen other tables
        prove_derived(compensator)
    return compensator


#: Role in a chain -> kind, from the evidence back to the recordings.
KINDS = {
    "evidence": _typed("evidence", Evidence),
    "firmware": _typed("firmware", FirmwareManifest),
    "compensator": Kind(label="compensator", schema=COMPENSATOR_SCHEMA, read=_read_compensator),
    "valve": _typed("valve", ValveModel),
    "assessment": _typed("assessment of recordings", Assessment),
    "reproduction": _typed("the paper's numbers", Reproduction),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where an artefact was found: name below the folder of the report, hash, what made it and of what."""

    name: str
    sha256: str
    made_by: str
    made_from: tuple[SourceFile, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """What a report is of; an artefact that was not found is None.

    Attributes
    ----------
    evidence : Evidence or None
    firmware : FirmwareManifest or None
    compensator : Compensator or None
    valve : ValveModel or None
    assessment : Assessment or None
    reproduction : Reproduction or None
    places : mapping of str to Place
        Where each was found, by these names.
    curves : mapping of str to str
        CSV files of the evidence whose hashes fit, by name.
    faults : tuple of str
        What does not fit: a file that was changed, or belongs to another chain. None of it is used.
    missing : tuple of str
        What is not there, and which command makes it.
    """

    evidence: Evidence | None = None
    firmware: FirmwareManifest | None = None
    compensator: Compensator | None = None
    valve: ValveModel | None = None
    assessment: Assessment | None = None
    reproduction: Reproduction | None = None
    places: Mapping[str, Place] = field(default_factory=dict)
    curves: Mapping[str, str] = field(default_factory=dict)
    faults: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()


def chain_of(files: Mapping[str, bytes], *, asked: tuple[str, ...] = ("",), sealed: bool = True) -> Chain:
    """Follow the chain from the evidence back to the valve, as far as the files go.

    Parameters
    ----------
    files : mapping of str to bytes
        By name, such as `read_artefact_folder` returns; of two of a kind the first one counts.
    asked : tuple of str
        How the names of the files begin that the report is asked for. What else lies there and belongs to another chain
        is a stranger's: named, and no fault.
    sealed : bool
        False of evidence that `verify` has made this moment: no manifest states its hash yet, and what is wrong with
        the files it has found itself, so that its own verdict stands.

    Raises
    ------
    InputError
        If there are two pieces of evidence, or no artefact can be read.
    """
    return _Search(files, asked, sealed).chain()


class _Search:
    """Follows hashes over the files of a folder."""

    def __init__(self, files: Mapping[str, bytes], asked: tuple[str, ...], sealed: bool) -> None:
        self.files, self.asked, self.sealed = files, asked, sealed
        self.hashes = {name: sha256_of(content) for name, content in files.items()}
        self.faults: list[str] = []
        self.missing: list[str] = []
        self.unreadable: list[str] = []
        self.found: dict[str, Any] = {}
        self.places: dict[str, Place] = {}

    def chain(self) -> Chain:
        curves: dict[str, str] = {}
        if evidence := self._evidence():
            curves = self._curves(evidence)
            self._take("evidence", evidence)
        self._firmware()
        self._compensator()
        self._valve()
        for role in ("assessment", "reproduction"):
            if name := self._first(role):
                self._take(role, name)
        self._assessment_fits()
        if self.unreadable and not self.found:
            raise InputError("; ".join(self.unreadable))
        self.missing += self.unreadable
        if not self.sealed:
            self.missing += self.faults
            self.faults = []
        return Chain(
            **self.found,
            places=self.places,
            curves=curves,
            faults=tuple(self.faults),
            missing=tuple(self.missing),
        )

    # one artefact after the other -------------------------------------------------------------------------------

    def _evidence(self) -> str | None:
        """Return the name of verification.json, if it is what `verify` wrote."""
        names = [name for name in self.files if name.rpartition("/")[2] == VERIFICATION_NAME]
        if len(names) > 1:
            raise InputError(f"there is more than one piece of evidence, {', '.join(names)}; name the folder of one")
        if not names:
            self._miss("evidence")
            return None
        name = names[0]
        stated = self._stated(name)
        if stated is None and self.sealed:
            self.missing.append(
                f"{MANIFEST_NAME} that `dzdesign verify` wrote beside {name}: nothing tells whether that is as written"
            )
        if stated is not None and stated != self.hashes[name]:
            self.faults.append(
                f"{name} was changed since `dzdesign verify` wrote it (SHA-256 {self.hashes[name]}, the folder's "
                f"manifest says {stated}): not used"
            )
            return None
        return name

    def _curves(self, evidence: str) -> dict[str, str]:
        place = evidence.removesuffix(VERIFICATION_NAME)
        curves = {}
        for name, content in self.files.items():
            leaf = name.removeprefix(place)
            if not (name.startswith(place) and leaf.endswith(".csv") and "/" not in leaf):
                continue
            if self._stated(name) in (None, self.hashes[name]):
                curves[leaf] = content.decode("utf-8", errors="replace")
            else:
                self.faults.append(f"{name} was changed since `dzdesign verify` wrote it: not drawn")
        return curves

    def _firmware(self) -> None:
        stated = self._origin("evidence")
        if name := self._firmware_of_hash(stated) if stated else self._first("firmware"):
            self._take("firmware", name)
            if "firmware" in self.found:
                self._firmware_files(self.found["firmware"], name.removesuffix(MANIFEST_NAME))
            return
        self._miss("firmware", stated)
        self._name_other("firmware", stated, "the evidence is of")

    def _firmware_files(self, firmware: FirmwareManifest, place: str) -> None:
        """Name the files of the firmware that are not those generated; a board file is its user's to change."""
        for leaf, stated in firmware.files.items():
            digest = self.hashes.get(place + leaf)
            if digest == stated:
                continue
            if leaf in firmware.board:
                self.missing.append(f"{place}{leaf}: yours, and no longer as generated: nothing here is about it")
            elif digest is None:
                self.faults.append(f"{place}{leaf} is gone; the firmware's manifest lists it")
            else:
                self.faults.append(
                    f"{place}{leaf} was changed since it was generated: its SHA-256 is {digest}, the manifest says "
                    f"{stated}. What is reported here is of the firmware as generated"
                )

    def _compensator(self) -> None:
        firmware: FirmwareManifest | None = self.found.get("firmware")
        if "evidence" in self.found and firmware is None:
            self._miss("compensator", hint="which one is known from the firmware alone")
            return
        stated = firmware.origin.compensator_json if firmware else None
        if name := self._of_hash(stated) if stated else self._first("compensator"):
            self._take("compensator", name)
            return
        self._miss("compensator", stated)
        self._name_other("compensator", stated, "the firmware was made from")

    def _valve(self) -> None:
        stated = self._origin("compensator")
        if stated is None:
            name = None if {"firmware", "evidence"} & self.found.keys() else self._first("valve")
            if name:
                self._take("valve", name)
            elif {"firmware", "evidence"} & self.found.keys():
                self._miss("valve", hint="which one is known from the compensator alone")
            else:
                self._miss("valve")
            return
        held, place = self.found["compensator"].valve, self.places["compensator"]
        named = place.made_from[0].source
        name = self._of_hash(stated)
        if name is None:
            self._name_other("valve", stated, "the compensator was made from", named)
            self.found["valve"] = held
            self.places["valve"] = _place(f"{place.name}, its key “valve”", sha256_of(to_json_bytes(held)), held)
            return
        self._take("valve", name)
        if named != name and self._other("valve", named) == named:
            self.missing.append(f"{named} is another valve by now; the compensator was made from {name}: used")
        if self.found.get("valve", held) != held:
            self.faults.append(f"{place.name} holds another valve than {name}, whose SHA-256 it states: it was edited")

    def _assessment_fits(self) -> None:
        """Leave out an assessment whose recordings BEFORE are not the valve's."""
        known, compared = (
            {each.sha256 for each in self.places[role].made_from} if role in self.places else set()
            for role in ("valve", "assessment")
        )
        if "assessment" in self.found and known and not known & compared:
            del self.found["assessment"]
            name = self.places.pop("assessment").name
            self.missing.append(f"assessment of recordings of this valve: {name} compares others, so it is not shown")

    # small steps --------------------------------------------------------------------------------------------------

    def _stated(self, name: str) -> str | None:
        """Return the hash that the manifest beside a file states."""
        place, slash, leaf = name.rpartition("/")
        return listed_files(self.files.get(place + slash + MANIFEST_NAME)).get(leaf)

    def _origin(self, role: str) -> str | None:
        """Return the hash of what an artefact was made from; None of one that was not found."""
        if role not in self.found:
            return None
        place = self.places[role]
        if not place.made_from:
            raise InputError(f"'{place.name}': 'made_from' is empty, expected what it was made from; make it again")
        return place.made_from[0].sha256

    def _of_hash(self, stated: str) -> str | None:
        return next((name for name, digest in self.hashes.items() if digest == stated), None)

    def _firmware_of_hash(self, stated: str) -> str | None:
        """Return the manifest of a hash: of copies that in the folder asked for, then that beside which all fits."""

        def preferred(name: str) -> tuple[bool, int]:
            place, files = name.removesuffix(MANIFEST_NAME), listed_files(self.files[name])
            return not name.startswith(self.asked), sum(self.hashes.get(place + leaf) != files[leaf] for leaf in files)

        return min((name for name, digest in self.hashes.items() if digest == stated), key=preferred, default=None)

    def _first(self, role: str) -> str | None:
        """Return the first file of a kind; a manifest, which has the schema of what it lists, is of firmware only."""
        for name, content in self.files.items():
            is_manifest = name.rpartition("/")[2] == MANIFEST_NAME
            if is_of(content, KINDS[role].schema) and (role == "firmware" or not is_manifest):
                return name
        return None

    def _other(self, role: str, named: str) -> str | None:
        """Return a file of a kind that is not the one: that of its name, which was replaced, before a stranger."""
        return named if is_of(self.files.get(named, b""), KINDS[role].schema) else self._first(role)

    def _name_other(self, role: str, stated: str | None, which: str, named: str = "") -> None:
        other = self._other(role, named)
        if not stated or not other:
            return
        sentence = f"{other} has the SHA-256 {self.hashes[other]}, but {which} one of {stated}: not used"
        if other.startswith(self.asked):
            self.faults.append(sentence)
        else:
            self.missing.append(f"{sentence}, as it lies beside these files and is not one of them")

    def _miss(self, role: str, stated: str | None = None, hint: str = "") -> None:
        by = f" of SHA-256 {stated}" if stated else f" ({hint})" if hint else ""
        self.missing.append(f"{KINDS[role].label}{by}: made by `{KINDS[role].command}`")

    def _take(self, role: str, name: str) -> None:
        """Keep an artefact; one that can't be read is missing, and the rest is reported without it."""
        try:
            self.found[role] = KINDS[role].read(self.files[name], name)
        except InputError as error:
            # What the evidence rests on must not go missing without a word: its verdict would stand.
            told = self.faults if role == "compensator" and self.found else self.unreadable
            told.append(f"{KINDS[role].label}: {error}")
            return
        self.places[role] = _place(name, self.hashes[name], self.found[role])


def _place(name: str, sha256: str, artefact: Artefact) -> Place:
    tool = artefact.tool
    return Place(name=name, sha256=sha256, made_by=f"{tool.name} {tool.version}", made_from=artefact.made_from)
