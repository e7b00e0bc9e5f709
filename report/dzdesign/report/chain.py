"""What a report is of: the artefacts from the evidence back to the valve, as far as they were found."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from dzdesign.assess.assessment import Assessment
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import THIS_TOOL, Artefact, SourceFile, schema_of
from dzdesign.core.documents import written_by
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.design.redesign_check import prove_derived
from dzdesign.identify.valve.model import ValveModel
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
    if compensator.tool == THIS_TOOL:  # another version may have chosen other tables
        prove_derived(compensator)
    return compensator


#: Role in a chain -> kind, from the evidence back to the recordings.
KINDS = {
    "evidence": _typed("evidence", Evidence),
    "firmware": _typed("firmware", FirmwareManifest),
    "compensator": Kind(label="compensator", schema=schema_of(Compensator), read=_read_compensator),
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

    `places` is where each was found, by these names; `curves` the CSV files of the evidence whose hashes fit. `faults`
    do not fit (changed, or of another chain) and are not used; `missing` names what is not there, and which command
    makes it.
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
