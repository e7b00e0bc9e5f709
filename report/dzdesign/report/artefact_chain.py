"""Which files a report is of: found by the SHA-256 that the chain states, never by a name alone.

From the evidence back to the recordings each artefact states the hash of what it was made from. A file of the right
name whose hash is another is named in the report, and not used.
"""

from collections.abc import Mapping
from typing import Any

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import THIS_TOOL, Artefact, to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.design.redesign_check import prove_derived
from dzdesign.report.artefact_folder import VERIFICATION_NAME, is_document, is_of, listed_files
from dzdesign.report.chain import KINDS, Chain, Place


def chain_of(
    files: Mapping[str, bytes],
    *,
    asked: tuple[str, ...] = ("",),
    sealed: bool = True,
    known: Mapping[str, Compensator] | None = None,
) -> Chain:
    """Follow the chain from the evidence back to the valve, as far as the files go.

    Of two files of a kind the first one counts, and what is `known` by its hash was read and proved before. `asked` is
    how the names of the files begin that the report is asked for: what else lies there and belongs to another chain is
    a stranger's, named and no fault. Evidence that `verify`
    has made this moment is not `sealed`: no manifest states its hash yet, and its own verdict stands whatever else lies
    there.
    """
    return _Search(files, asked, sealed, known or {}).chain()


class _Search:
    """Follows hashes over the files of a folder."""

    def __init__(
        self, files: Mapping[str, bytes], asked: tuple[str, ...], sealed: bool, known: Mapping[str, Compensator]
    ) -> None:
        self.files, self.asked, self.sealed, self.known = files, asked, sealed, known
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
        self._link("firmware", "evidence", "the evidence is of")
        if "firmware" in self.found:
            self._firmware_files(self.found["firmware"], self.places["firmware"].name.removesuffix(MANIFEST_NAME))
        self._link("compensator", "firmware", "the firmware was made from")
        if "compensator" in self.found:
            self._valve(self.found["compensator"])
        else:
            self._link("valve", "compensator", "the compensator was made from")
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

    def _link(self, role: str, parent: str, which: str) -> None:
        """Take what an artefact was made from; of a chain that begins with it, the first of its kind."""
        stated = self._origin(parent)
        if stated is None and self.found:
            self._miss(role, hint=f"which one is known from the {parent} alone")
        elif name := self._of_hash(stated) if stated else self._first(role):
            self._take(role, name)
        else:
            self._miss(role, stated)
            self._name_other(role, stated, which)

    def _firmware_files(self, firmware: FirmwareManifest, place: str) -> None:
        """Name the files of the firmware that are not those generated, or not those verified.

        A board file is its user's to change, but evidence is of the one that was there when it was made.
        """
        evidence = self.found.get("evidence")
        verified = evidence.differing_files if evidence else {}
        if evidence and evidence.target != firmware.target:
            self.faults.append(f"the evidence is for {evidence.target}, the firmware it names for {firmware.target}")
        for leaf, stated in firmware.files.items():
            digest = self.hashes.get(place + leaf)
            if leaf not in firmware.board and digest is None:
                self.faults.append(f"{place}{leaf} is gone; the firmware's manifest lists it")
            elif leaf not in firmware.board and digest != stated:
                self.faults.append(
                    f"{place}{leaf} was changed since it was generated: its SHA-256 is {digest}, the manifest says "
                    f"{stated}. What is reported here is of the firmware as generated"
                )
            elif evidence and digest != verified.get(leaf, stated):
                self._unlike_verified(place + leaf, verified.get(leaf, stated))
            elif digest != stated and not evidence:
                self.missing.append(f"{place}{leaf}: yours, and no longer as generated: nothing here is about it")
        if evidence is None:
            return
        names = {name.removeprefix(place) for name in self.files if name.startswith(place)}
        added = {name for name in names if not is_document(name)} - firmware.files.keys()
        for leaf in sorted(added | verified.keys() - firmware.files.keys()):
            if self.hashes.get(place + leaf) != verified.get(leaf):
                self._unlike_verified(place + leaf, verified.get(leaf))

    def _unlike_verified(self, name: str, verified: str | None) -> None:
        """Name a file of the firmware that another one, or none, was when the evidence was made."""
        digest = self.hashes.get(name)
        if verified is None:
            found = f"{name} was added since `dzdesign verify`"
        elif digest is None:
            found = f"{name} is gone since `dzdesign verify`"
        else:
            found = f"{name} was changed since `dzdesign verify` (SHA-256 {digest}, verified was {verified})"
        self.faults.append(f"this folder is not what was verified: {found}; run `dzdesign verify` on it again")

    def _valve(self, compensator: Compensator) -> None:
        """Take the valve's file; where it is not here, the valve that the compensator holds."""
        held, place = compensator.valve, self.places["compensator"]
        stated, named = compensator.made_from[0].sha256, compensator.made_from[0].source
        name = self._of_hash(stated)
        if name is None:
            self._name_other("valve", stated, "the compensator was made from", named)
            self.found["valve"] = held
            self.places["valve"] = Place(f"{place.name}, its key “valve”", sha256_of(to_json_bytes(held)))
            return
        self._take("valve", name)
        if self.hashes.get(named) != stated and self._other("valve", named) == named:
            self.missing.append(f"{named} is another valve by now; the compensator was made from {name}: used")
        if self.found.get("valve", held) != held:
            self.faults.append(f"{place.name} holds another valve than {name}, whose SHA-256 it states: it was edited")

    def _assessment_fits(self) -> None:
        """Leave out an assessment whose recordings BEFORE are not the valve's."""
        known, compared = (
            {each.sha256 for each in self.found[role].made_from} if role in self.found else set()
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
        if role == "firmware":
            return str(self.found[role].origin.compensator_json)
        made_from = self.found[role].made_from
        if not made_from:
            place = self.places[role].name
            raise InputError(f"'{place}': 'made_from' is empty, expected what it was made from; make it again")
        return str(made_from[0].sha256)

    def _of_hash(self, stated: str) -> str | None:
        """Return the file of a hash: of copies of a manifest that in the folder asked for, then where all fits."""

        def preferred(name: str) -> tuple[bool, int]:
            place, files = name.removesuffix(MANIFEST_NAME), listed_files(self.files[name])
            wrong = sum(self.hashes.get(place + leaf) != digest for leaf, digest in files.items())
            return bool(files) and not name.startswith(self.asked), wrong

        return min((name for name, digest in self.hashes.items() if digest == stated), key=preferred, default=None)

    def _first(self, role: str) -> str | None:
        """Return the first file of a kind, in the folder asked for before the others.

        A manifest, which has the schema of what it lists, is of firmware only.
        """
        found = [
            name
            for name, content in self.files.items()
            if is_of(content, KINDS[role].schema) and (role == "firmware" or name.rpartition("/")[2] != MANIFEST_NAME)
        ]
        return min(found, key=lambda name: not name.startswith(self.asked), default=None)

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
            artefact: Artefact | None = self.known.get(self.hashes[name])
            if artefact is None:
                artefact = read_artefact(self.files[name], KINDS[role].type, name)
                if isinstance(artefact, Compensator) and artefact.tool == THIS_TOOL:
                    prove_derived(artefact)  # another version may have chosen other tables
        except InputError as error:
            # What the evidence rests on must not go missing without a word: its verdict would stand.
            lines = self.faults if role == "compensator" and self.found else self.unreadable
            lines.append(f"{KINDS[role].label}: {error}")
            return
        self.found[role] = artefact
        self.places[role] = Place(name, self.hashes[name])
