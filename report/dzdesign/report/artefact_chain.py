"""Which files a report is of: found by the SHA-256 that the chain states, never by a name alone.

From the evidence back to the recordings each artefact states the hash of what it was made from. A file of the right
name whose hash is another is said in the report, and not used.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from dzdesign.core.artefact_files import MANIFEST_NAME, TOOL, parse_document, sha256_of, to_json
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.documents import written_by
from dzdesign.core.errors import InputError
from dzdesign.core.shape import check_shape
from dzdesign.design.compensator_file import SCHEMA as COMPENSATOR_SCHEMA
from dzdesign.design.compensator_file import compensator_from_document
from dzdesign.design.redesign_check import prove_derived
from dzdesign.identify.valve.model import SCHEMA as VALVE_SCHEMA
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefact_folder import (
    EVIDENCE_SCHEMA,
    FIRMWARE_SCHEMA,
    VERIFICATION_NAME,
    is_of,
    listing,
)
from dzdesign.report.shapes import ASSESSMENT, FIRMWARE, LATER, REPRODUCTION
from dzdesign.verify.evidence import Evidence

ASSESSMENT_SCHEMA, REPRODUCTION_SCHEMA = "dzdesign.assessment/1", "dzdesign.reproduction/1"
#: Kinds of artefact, from the evidence back to the recordings.
ROLES = {
    "verification": "evidence",
    "firmware": "firmware",
    "compensator": "compensator",
    "valve": "valve",
    "assessment": "assessment of recordings",
    "reproduction": "the paper's numbers",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Artefact:
    """A file of the chain.

    Attributes
    ----------
    role : str
        A key of `ROLES`.
    name : str
        Where it was found, below the folder that the report is of.
    sha256 : str
        Of its content.
    document : dict
        Its content, checked.
    """

    role: str
    name: str
    sha256: str
    document: dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chain:
    """What a report is of.

    Attributes
    ----------
    artefacts : mapping of str to Artefact
        By role; a role that was not found is missing.
    curves : mapping of str to str
        CSV files of the evidence whose hashes fit, by name.
    faults : tuple of str
        What does not fit: a file that was changed, or belongs to another chain. None of it is used.
    missing : tuple of str
        What is not there, and which command makes it.
    """

    artefacts: Mapping[str, Artefact]
    curves: Mapping[str, str] = field(default_factory=dict)
    faults: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()

    def document(self, role: str) -> dict[str, Any] | None:
        """Return the content of an artefact, or None if it is missing."""
        found = self.artefacts.get(role)
        return None if found is None else found.document

    def evidence(self) -> Evidence:
        """Return the evidence; only where there is a document of it."""
        one = self.artefacts["verification"]
        return read_artefact(to_json(one.document).encode(), Evidence, one.name)


def chain_of(shelf: Mapping[str, bytes], *, own: tuple[str, ...] = ("",), sealed: bool = True) -> Chain:
    """Follow the chain from the evidence back to the valve, as far as the files go.

    Parameters
    ----------
    shelf : mapping of str to bytes
        Files by name, such as `report_shelf.shelf_of` returns; of two of a kind the first one counts.
    own : tuple of str
        How the names of the files begin that the report is asked for. What else lies there and belongs to another chain
        is a stranger's: said, and no fault.
    sealed : bool
        False of evidence that `verify` has made this moment: no manifest states its hash yet, and what is wrong with
        the files it has found itself, so that its own verdict stands.

    Raises
    ------
    InputError
        If there are two pieces of evidence, or an artefact that fits is none: a key is missing.
    """
    return _Search(shelf, own, sealed).chain()


class _Search:
    """Follows hashes over a shelf."""

    def __init__(self, shelf: Mapping[str, bytes], own: tuple[str, ...], sealed: bool) -> None:
        self.shelf, self.own, self.sealed = shelf, own, sealed
        self.hashes = {name: sha256_of(content) for name, content in shelf.items()}
        self.faults: list[str] = []
        self.missing: list[str] = []
        self.unreadable: list[str] = []
        self.found: dict[str, Artefact] = {}

    def chain(self) -> Chain:
        curves: dict[str, str] = {}
        evidence = self._evidence()
        if evidence:
            curves = self._curves(evidence)
            self._take("verification", evidence)
        self._firmware()
        self._compensator()
        self._valve()
        for role, schema in (("assessment", ASSESSMENT_SCHEMA), ("reproduction", REPRODUCTION_SCHEMA)):
            name = self._first(schema)
            if name:
                self._take(role, name)
        if "assessment" in self.found:
            self._assessment_fits()
        if self.unreadable and not self.found:
            raise InputError("; ".join(self.unreadable))
        self.missing += self.unreadable
        if not self.sealed:
            self.missing += self.faults
            self.faults = []
        return Chain(artefacts=self.found, curves=curves, faults=tuple(self.faults), missing=tuple(self.missing))

    # one artefact after the other -------------------------------------------------------------------------------

    def _evidence(self) -> str | None:
        """Return the name of verification.json, if it is what `verify` wrote."""
        names = [name for name in self.shelf if name.rpartition("/")[2] == VERIFICATION_NAME]
        if len(names) > 1:
            raise InputError(f"there is more than one piece of evidence, {', '.join(names)}; name the folder of one")
        if not names:
            self._miss("verification")
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
        for name, content in self.shelf.items():
            if not (name.startswith(place) and name.endswith(".csv") and "/" not in name[len(place) :]):
                continue
            stated = self._stated(name)
            if stated is None or stated == self.hashes[name]:
                curves[name[len(place) :]] = content.decode("utf-8", errors="replace")
            else:
                self.faults.append(f"{name} was changed since `dzdesign verify` wrote it: not drawn")
        return curves

    def _firmware(self) -> None:
        evidence = self.found.get("verification")
        stated = _origin(evidence) if evidence else None
        name = self._firmware_by_hash(stated) if stated else self._first(FIRMWARE_SCHEMA)
        if name:
            self._take("firmware", name)
            if "firmware" in self.found:
                self._firmware_files(name.removesuffix(MANIFEST_NAME))
            return
        self._miss("firmware", stated)
        self._say_other(stated, FIRMWARE_SCHEMA, "the evidence is of")

    def _firmware_files(self, place: str) -> None:
        """Say which files of the firmware are not those that were generated; a board file is its user's to change."""
        firmware = self.found["firmware"].document
        for leaf, stated in firmware["files"].items():
            digest = self.hashes.get(place + leaf)
            if leaf in firmware.get("board", ()):
                if digest != stated:
                    self.missing.append(f"{place}{leaf}: yours, and no longer as generated: nothing here is about it")
            elif digest is None:
                self.faults.append(f"{place}{leaf} is gone; the firmware's manifest lists it")
            elif digest != stated:
                self.faults.append(
                    f"{place}{leaf} was changed since it was generated: its SHA-256 is {digest}, the manifest says "
                    f"{stated}. What is reported here is of the firmware as generated"
                )

    def _compensator(self) -> None:
        firmware = self.found.get("firmware")
        stated = firmware.document["origin"]["compensator_json"] if firmware else None
        if "verification" in self.found and firmware is None:
            self._miss("compensator", hint="which one is known from the firmware alone")
            return
        name = self._by_hash(stated) if stated else self._first(COMPENSATOR_SCHEMA)
        if name:
            self._take("compensator", name)
            return
        self._miss("compensator", stated)
        self._say_other(stated, COMPENSATOR_SCHEMA, "the firmware was made from")

    def _valve(self) -> None:
        compensator = self.found.get("compensator")
        if compensator is None:
            if "firmware" in self.found or "verification" in self.found:
                self._miss("valve", hint="which one is known from the compensator alone")
                return
            name = self._first(VALVE_SCHEMA)
            if name:
                self._take("valve", name)
            else:
                self._miss("valve")
            return
        stated = _origin(compensator)
        name = self._by_hash(stated)
        named = compensator.document["made_from"][0]["source"]
        if name:
            self._take("valve", name)
            if named != name and self._other(VALVE_SCHEMA, named) == named:
                self.missing.append(f"{named} is another valve by now; the compensator was made from {name}: used")
            if "valve" in self.found and self.found["valve"].document != compensator.document["valve"]:
                self.faults.append(
                    f"{compensator.name} holds another valve than {name}, whose SHA-256 it states: it was edited"
                )
            return
        content = to_json(compensator.document["valve"]).encode()
        self._say_other(stated, VALVE_SCHEMA, "the compensator was made from", named)
        self.found["valve"] = Artefact(
            role="valve",
            name=f"{compensator.name}, its key “valve”",
            sha256=stated if sha256_of(content) == stated else sha256_of(content),
            document=compensator.document["valve"],
        )

    def _assessment_fits(self) -> None:
        """Say of an assessment whose recordings BEFORE are not the valve's."""
        valve = self.found.get("valve")
        known = {each["sha256"] for each in valve.document["made_from"]} if valve else set()
        made_from = {each["sha256"] for each in self.found["assessment"].document["made_from"]}
        if known and not known & made_from:
            one = self.found.pop("assessment")
            self.missing.append(
                f"assessment of recordings of this valve: {one.name} compares others, so it is not shown"
            )

    # small steps --------------------------------------------------------------------------------------------------

    def _stated(self, name: str) -> str | None:
        """Return the hash that the manifest beside a file states."""
        place, slash, leaf = name.rpartition("/")
        return listing(self.shelf.get(place + slash + MANIFEST_NAME)).get(leaf)

    def _by_hash(self, stated: str | None) -> str | None:
        return next((name for name, digest in self.hashes.items() if digest == stated), None)

    def _firmware_by_hash(self, stated: str) -> str | None:
        """Return the manifest of a hash: of copies that in the folder asked for, then that beside which all fits."""

        def preferred(name: str) -> tuple[bool, int]:
            place = name.removesuffix(MANIFEST_NAME)
            files = listing(self.shelf[name])
            return not name.startswith(self.own), sum(self.hashes.get(place + leaf) != files[leaf] for leaf in files)

        found = [name for name, digest in self.hashes.items() if digest == stated]
        return min(found, key=preferred, default=None)

    def _first(self, schema: str) -> str | None:
        """Return the first file of a schema; a manifest has that of what it lists, and is one of a firmware only."""
        return next(
            (
                name
                for name, content in self.shelf.items()
                if is_of(content, schema) and (schema == FIRMWARE_SCHEMA or name.rpartition("/")[2] != MANIFEST_NAME)
            ),
            None,
        )

    def _other(self, schema: str, named: str) -> str | None:
        """Return a file of a schema that is not the one: that of its name, which was replaced, before a stranger."""
        if is_of(self.shelf.get(named, b""), schema):
            return named
        return self._first(schema)

    def _say_other(self, stated: str | None, schema: str, which: str, named: str = "") -> None:
        other = self._other(schema, named)
        if not stated or not other:
            return
        said = f"{other} has the SHA-256 {self.hashes[other]}, but {which} one of {stated}: not used"
        if other.startswith(self.own):
            self.faults.append(said)
        else:
            self.missing.append(f"{said}, as it lies beside these files and is not one of them")

    def _miss(self, role: str, stated: str | None = None, hint: str = "") -> None:
        by = f" of SHA-256 {stated}" if stated else f" ({hint})" if hint else ""
        self.missing.append(f"{ROLES[role]}{by}: made by `{written_by(SCHEMAS[role][0])}`")

    def _take(self, role: str, name: str) -> None:
        """Keep an artefact; one that can't be read is missing, and the rest is reported without it."""
        try:
            document = _checked(role, self.shelf[name], name)
        except InputError as error:
            # What the evidence rests on must not go missing without a word: its verdict would stand.
            (self.faults if role == "compensator" and self.found else self.unreadable).append(f"{ROLES[role]}: {error}")
            return
        self.found[role] = Artefact(role=role, name=name, sha256=self.hashes[name], document=document)


def _origin(artefact: Artefact) -> str:
    """Return the hash of what an artefact was made from."""
    made_from = artefact.document["made_from"]
    if not made_from:
        raise InputError(f"'{artefact.name}': 'made_from' is empty, expected what it was made from; make it again")
    return made_from[0]["sha256"]


#: Schema and shape of each kind.
SCHEMAS = {
    "verification": (EVIDENCE_SCHEMA, {}),
    "firmware": (FIRMWARE_SCHEMA, FIRMWARE),
    "compensator": (COMPENSATOR_SCHEMA, {}),
    "valve": (VALVE_SCHEMA, {}),
    "assessment": (ASSESSMENT_SCHEMA, ASSESSMENT),
    "reproduction": (REPRODUCTION_SCHEMA, REPRODUCTION),
}


def _checked(role: str, content: bytes, name: str) -> dict[str, Any]:
    """Return an artefact's content, with every key that the report reads."""
    schema, shape = SCHEMAS[role]
    document = parse_document(content, name, (schema,))
    check_shape(document, shape, name, "make it again")
    for key, later in LATER.get(role, {}).items():
        if key in document:
            check_shape(document, later, name, "make it again")
    if role == "compensator":
        compensator = compensator_from_document(content, name)
        if document.get("tool") == TOOL:  # another version may have chosen other tables
            prove_derived(compensator)
    if role == "verification":
        read_artefact(content, Evidence, name)
    if role == "valve":
        read_artefact(content, ValveModel, name)
    return document
