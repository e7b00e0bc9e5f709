"""`Assessment`: what recordings without and with the compensator show, the artefact assessment.json."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from msgspec import UNSET, Meta, UnsetType

from dzdesign.assess.options import Set, Side
from dzdesign.assess.quantities import Change, LimitResult, Quantity, Reading
from dzdesign.core.artefact_types import Artefact, RuleError, SourceFile, quantity
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.ramp_result import RampConditions

TERMS = (
    "terms as in tests of hydraulic valves (ISO 10770-1); the formulas are dzdesign's own, and no conformity with a "
    "standard is claimed"
)

Share = Annotated[float, Meta(ge=0, le=1)]
Flow = Annotated[float, Meta(ge=0, le=1e9, extra_json_schema={"unit": "L/min"})]
PressureDrop = Annotated[float, Meta(ge=0, le=1e6, extra_json_schema={"unit": "MPa"})]
Voltage = Annotated[float, Meta(gt=0, le=1e9, extra_json_schema={"unit": "V"})]
#: Largest command in percent of full command, and largest flow, that a file may state.
LARGEST_PERCENT, LARGEST_FLOW = 1e4, 1e6

Percents = tuple[Annotated[float, Meta(ge=-LARGEST_PERCENT, le=LARGEST_PERCENT)], ...]
Flows = tuple[Annotated[float, Meta(ge=-LARGEST_FLOW, le=LARGEST_FLOW)], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredBranch:
    """One branch: flow over command, linear between the points, and a few of its samples.

    On the negative side commands and flows count from zero down, as in valve.json.
    """

    command_percent: Annotated[Percents, quantity("%")]
    """Commands of the points in ascending order, as a percentage of full command."""
    q_L_min: Annotated[Flows, quantity("L/min")]
    """Flow at each point, scaled to the pressure drop at zero flow."""
    sample_command_percent: Annotated[Percents, quantity("%")]
    """Commands of single samples. The branch is divided into equal steps; the sample nearest to each step is kept."""
    sample_q_L_min: Annotated[Flows, quantity("L/min")]
    """Flow of each single sample, scaled to the same pressure drop."""

    def __post_init__(self) -> None:
        for commands, flows in (
            (self.command_percent, self.q_L_min), (self.sample_command_percent, self.sample_q_L_min)
        ):  # fmt: skip
            if len(commands) != len(flows):
                raise RuleError(f"{len(commands)} commands stand beside {len(flows)} flows, expected one each")
        if not all(left < right for left, right in pairwise(self.command_percent)):
            raise RuleError("the commands of a measured curve must rise")


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredCurve:
    """The curve of one set at one pressure drop; a branch that was not recorded is null."""

    rising: Annotated[MeasuredBranch | None, Meta(description="Opening branch.")]
    falling: Annotated[MeasuredBranch | None, Meta(description="Closing branch.")]
    conditions: Annotated[RampConditions, Meta(description="Conditions under which the ramps were recorded.")]

    @property
    def branches(self) -> tuple[MeasuredBranch, ...]:
        """The branches that were recorded, the rising one first."""
        return tuple(branch for branch in (self.rising, self.falling) if branch)


@dataclass(frozen=True, slots=True, kw_only=True)
class Recording(SourceFile):
    """A recording and its set."""

    set: Set
    """Whether the recording was taken without the compensator (before) or with it (after)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Options of the comparison."""

    u_max_V: Voltage
    """Full command of the recordings without the compensator."""
    after_u_max_V: Voltage
    """Full command of the recordings with the compensator."""
    knee_window: Annotated[tuple[Share, Share], quantity("1")]
    """Range in which the characteristic was taken as straight, as shares of the largest flow."""
    linearity_window: Annotated[tuple[Share, Share], quantity("1")]
    """Range in which linearity was assessed, as shares of full command."""
    reading_flow_L_min: Flow | None
    """Reading flow of --reading-flow, if given as a flow."""
    reading_share: Annotated[Share | None, Meta(extra_json_schema={"unit": "1"})]
    """Reading flow of --reading-flow, if given as a share of the largest flow."""
    same_pressure_within: Annotated[Share, quantity("1")]
    """Largest relative difference of two pressure drops that are compared with each other."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeterTaken:
    """Properties of the flow meter as assumed."""

    floor_L_min: Annotated[Flow, Meta(description="Flow below which the meter reads zero.")]
    lag_s: Annotated[float, quantity("s", "Lag of the meter; below zero if the command comes late.", ge=-1e6, le=1e6)]
    lag_is: Annotated[
        Literal["declared", "identified", "unknown"],
        Meta(description="Whether the lag was declared, identified or unknown."),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class RampSet:
    """The ramps of one set at one pressure drop."""

    source: Annotated[str, Meta(description="Names of the recordings.")]
    ramps: Annotated[tuple[str, ...], Meta(description="Recording and number of each ramp.", min_length=1)]
    dp_MPa: Annotated[PressureDrop | None, Meta(description="Pressure drop at zero flow.")]
    curve: Annotated[
        MeasuredCurve | UnsetType,
        Meta(description="Flow over command, reduced to few points. Omitted if it was not kept."),
    ] = UNSET


@dataclass(frozen=True, slots=True, kw_only=True)
class BeforeAfter:
    """One quantity without and with the compensator."""

    before: Annotated[Reading | None, Meta(description="Reading without the compensator; null if not recorded.")]
    after: Annotated[Reading | None, Meta(description="Reading with the compensator; null if not recorded.")]
    change: Annotated[
        Change | None, Meta(description="Value with the compensator minus the value without it, if both exist.")
    ]

    def of_set(self, name: Set) -> Reading | None:
        """Return the reading of a set."""
        return self.before if name == "before" else self.after


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureAssessment:
    """One side at one pressure drop, without and with the compensator."""

    side: Side
    """Side of the valve."""
    dp_MPa: PressureDrop | None
    """Pressure drop of the recordings without the compensator, or with it if only those exist."""
    reading_flow_L_min: Flow
    """Reading flow: the flow at which the dead zones are read."""
    rated_flow_L_min: Flow
    """Largest flow without the compensator, scaled to this pressure drop."""
    before: RampSet | None
    """Ramps without the compensator; null if there are none at this pressure drop."""
    after: RampSet | None
    """Ramps with the compensator; null if there are none at this pressure drop."""
    quantities: Mapping[str, BeforeAfter]
    """Readings of each quantity, by the quantity's key."""

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
    """Ramps recorded without and with the compensator, compared, as `dzdesign assess` writes them."""

    FILE_NAME: ClassVar[str] = "assessment.json"
    schema: Annotated[Literal["dzdesign.assessment/1"], Meta(description="Name and version of this schema.")] = (
        "dzdesign.assessment/1"
    )
    made_from: Annotated[tuple[Recording, ...], Meta(description="Recordings that were compared.")]
    holds: Annotated[
        bool, Meta(description="Whether every limit holds. A limit that could not be checked does not hold.")
    ] = field(init=False)
    options: Annotated[Request, Meta(description="Options of the comparison.")]
    meter: Annotated[MeterTaken, Meta(description="Properties of the flow meter as assumed.")]
    terms: Annotated[str, Meta(description="Source of the terms and formulas.")] = TERMS
    quantities: Annotated[
        Mapping[str, Quantity], Meta(description="Name, unit and formula of each quantity, by its key.")
    ]
    pressures: Annotated[
        tuple[PressureAssessment, ...], Meta(description="Results by side, in ascending order of pressure drop.")
    ]
    limits: Annotated[tuple[LimitResult, ...], Meta(description="Result of every requested limit.")]
    notes: Annotated[tuple[Warning_, ...], Meta(description="Remarks that are needed to interpret the results.")]
    recorded_units: Annotated[
        RecordedUnits, Meta(description="Units of the recordings, in which the results are displayed.")
    ] = AS_COMPUTED

    def __post_init__(self) -> None:
        object.__setattr__(self, "holds", all(result.holds for result in self.limits))
