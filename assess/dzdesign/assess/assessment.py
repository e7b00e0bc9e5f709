"""`Assessment`: what recordings without and with the compensator show, the artefact assessment.json."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from msgspec import UNSET, Meta, UnsetType

from dzdesign.assess.limits import LimitResult
from dzdesign.assess.measured_curves import MeasuredCurve
from dzdesign.assess.options import Set, Side
from dzdesign.assess.quantities import Change, Quantity, Reading
from dzdesign.core.artefact_types import Artefact, RuleError, SourceFile, quantity
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.identify.valve.model import Warning_

TERMS = (
    "terms as in tests of hydraulic valves (ISO 10770-1); the formulas are dzdesign's own, and no conformity with a "
    "standard is claimed"
)

Share = Annotated[float, Meta(ge=0, le=1)]
Flow = Annotated[float, Meta(ge=0, le=1e9, extra_json_schema={"unit": "L/min"})]
PressureDrop = Annotated[float, Meta(ge=0, le=1e6, extra_json_schema={"unit": "MPa"})]
Voltage = Annotated[float, Meta(gt=0, le=1e9, extra_json_schema={"unit": "V"})]


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording(SourceFile):
    """A recording, and its set."""

    set: Annotated[Set, Meta(description="Which set it belongs to: without the compensator, or with it.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What was asked for."""

    u_max_V: Annotated[Voltage, Meta(description="Full command BEFORE.")]
    after_u_max_V: Annotated[Voltage, Meta(description="Full command AFTER.")]
    knee_window: Annotated[
        tuple[Share, Share],
        quantity("1", "Shares of the largest flow between which the characteristic was taken as straight."),
    ]
    linearity_window: Annotated[
        tuple[Share, Share], quantity("1", "Shares of full command between which linearity was judged.")
    ]
    reading_flow_L_min: Annotated[Flow | None, Meta(description="--reading-flow as a flow.")]
    reading_share: Annotated[
        Share | None,
        Meta(description="--reading-flow as a share of the largest flow.", extra_json_schema={"unit": "1"}),
    ]
    same_pressure_within: Annotated[
        Share, quantity("1", "Pressure drops that differ by less, as a share, are compared.")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeterTaken:
    """What was taken of the flow meter."""

    floor_L_min: Annotated[Flow, Meta(description="Flow below which it reads zero.")]
    lag_s: Annotated[float, quantity("s", "Its lag.", ge=0, le=1e6)]
    lag_is: Annotated[Literal["declared", "identified", "unknown"], Meta(description="Where the lag is from.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class RampSet:
    """The ramps of one set at one pressure drop."""

    source: Annotated[str, Meta(description="Names of the files.")]
    ramps: Annotated[tuple[str, ...], Meta(description="File and number of each ramp.", min_length=1)]
    dp_MPa: Annotated[PressureDrop | None, Meta(description="Pressure drop at no flow.")]
    curve: Annotated[
        MeasuredCurve | UnsetType, Meta(description="Flow over command, thinned. Left out where nobody kept it.")
    ] = UNSET


@dataclass(frozen=True, slots=True, kw_only=True)
class BeforeAfter:
    """One quantity without and with the compensator."""

    before: Annotated[Reading | None, Meta(description="Without the compensator; null: not recorded.")]
    after: Annotated[Reading | None, Meta(description="With it; null: not recorded.")]
    change: Annotated[Change | None, Meta(description="AFTER less BEFORE, where both have a value.")]

    def of_set(self, name: Set) -> Reading | None:
        """Return the reading of a set."""
        return self.before if name == "before" else self.after


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureAssessment:
    """One side at one pressure drop, without and with the compensator."""

    side: Annotated[Side, Meta(description="Side of the valve.")]
    dp_MPa: Annotated[PressureDrop | None, Meta(description="Pressure drop: of BEFORE where there is one.")]
    reading_flow_L_min: Annotated[Flow, Meta(description="Reading flow: that at which the dead zones are read.")]
    rated_flow_L_min: Annotated[Flow, Meta(description="Largest flow BEFORE, brought to this pressure drop.")]
    before: Annotated[RampSet | None, Meta(description="Recordings without the compensator; null: none here.")]
    after: Annotated[RampSet | None, Meta(description="Recordings with it; null: none here.")]
    quantities: Annotated[Mapping[str, BeforeAfter], Meta(description="Key of a quantity -> its readings.")]

    def __post_init__(self) -> None:
        if self.before is None and self.after is None:
            raise RuleError("there is no recording, expected one without or with the compensator at least")

    def place(self, units: RecordedUnits) -> str:
        """Return side and pressure drop in words."""
        return f"{self.side} commands" + ("" if self.dp_MPa is None else f", {units.text(self.dp_MPa, '.2f MPa')}")

    def readings(self, name: Set) -> dict[str, Reading]:
        """Return what was read from the recordings of a set: key of a quantity -> reading."""
        found = {key: both.of_set(name) for key, both in self.quantities.items()}
        return {key: reading for key, reading in found.items() if reading is not None}


@dataclass(frozen=True, slots=True, kw_only=True)
class Assessment(Artefact):
    """Ramps recorded without and with the compensator, side by side, as `dzdesign assess` writes them."""

    FILE_NAME: ClassVar[str] = "assessment.json"
    schema: Annotated[Literal["dzdesign.assessment/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.assessment/1"
    )
    made_from: Annotated[tuple[Recording, ...], Meta(description="The recordings.")]
    holds: Annotated[bool, Meta(description="Whether every limit holds; one that could not be checked does not.")] = (
        field(init=False)
    )
    options: Annotated[Request, Meta(description="What was asked for.")]
    meter: Annotated[MeterTaken, Meta(description="What was taken of the flow meter.")]
    terms: Annotated[str, Meta(description="Whose terms and whose formulas these are.")] = TERMS
    quantities: Annotated[Mapping[str, Quantity], Meta(description="Key of a quantity -> name, unit and formula.")]
    pressures: Annotated[
        tuple[PressureAssessment, ...], Meta(description="Side by side, in the order of rising pressure drop.")
    ]
    limits: Annotated[tuple[LimitResult, ...], Meta(description="Every limit that was asked for.")]
    notes: Annotated[tuple[Warning_, ...], Meta(description="What must be known to read it.")]
    recorded_units: Annotated[
        RecordedUnits, Meta(description="Units of the recordings, in which a person sees what stands here.")
    ] = AS_COMPUTED

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(result.holds for result in self.limits))
