"""What a report is of: the artefacts from the evidence back to the valve, as far as they were found."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from dzdesign.assess.assessment import Assessment
from dzdesign.core.artefact_types import Artefact, schema_of
from dzdesign.core.documents import written_by
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.reproduction import Reproduction
from dzdesign.verify.evidence import Evidence


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of artefact: what it is called, and its type."""

    label: str
    type: type[Artefact]

    @property
    def schema(self) -> str:
        """The schema that its files name."""
        return schema_of(self.type)

    @property
    def command(self) -> str | None:
        """The command that makes it; None of what no chain lacks."""
        return written_by(self.schema)


#: Role in a chain -> kind, from the evidence back to the recordings.
KINDS = {
    "evidence": Kind("evidence", Evidence),
    "firmware": Kind("firmware", FirmwareManifest),
    "compensator": Kind("compensator", Compensator),
    "valve": Kind("valve", ValveModel),
    "assessment": Kind("assessment of recordings", Assessment),
    "reproduction": Kind("the paper's numbers", Reproduction),
}


@dataclass(frozen=True, slots=True)
class Place:
    """Where an artefact was found: name below the folder of the report, and hash."""

    name: str
    sha256: str


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

    @property
    def recorded_units(self) -> RecordedUnits:
        """The units of the valve's recordings; without a valve V, MPa and L/min."""
        return self.valve.recorded_units if self.valve else AS_COMPUTED
