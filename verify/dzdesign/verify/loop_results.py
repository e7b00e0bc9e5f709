"""Evidence of the closed loop: ramps and scenarios, as ``verification.json`` holds them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import Sha256, quantity
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.verify.closed_loop.plant import Plant


def about(description: str) -> Meta:
    """Return what an annotation says of a field."""
    return Meta(description=description)


Side = Annotated[Literal["positive", "negative"], about("Side of the valve.")]
PressureDrop = Annotated[float, quantity("MPa", "Pressure drop at no flow.", ge=0, le=1000)]
Count = Annotated[int, Meta(ge=0, le=2**60)]
Share = Annotated[float, Meta(ge=-1, le=1, extra_json_schema={"unit": "1"})]
Flow = Annotated[float, Meta(ge=-1e6, le=1e6, extra_json_schema={"unit": "L/min"})]


@dataclass(frozen=True, slots=True, kw_only=True)
class AtZero:
    """What passes at zero command in one run, with the compensator."""

    side: Side
    dp_MPa: PressureDrop
    unseen_below_L_min: Flow | None
    """Flow below which the recordings show none, so that the plant's flow is unknown; null for a given plant."""
    leak_L_min: Flow
    """Flow without drive at the end, which no compensator can stop."""
    allowed_at_zero_L_min: Flow | None
    """Flow at zero command, leak included, that --zero-flow allows; null if only the leak is allowed."""
    q_zero_L_min: Flow
    """Flow at zero command at the end, leak included. If a disturbance lasts and the whole scenario is assessed, it is
    the largest flow at zero command."""

    @property
    def q_beyond_L_min(self) -> float:
        """Flow at zero command beyond what is allowed there: the leak, or more where a flow was declared."""
        return self.q_zero_L_min - max(self.leak_L_min, self.allowed_at_zero_L_min or 0.0)

    def in_words(self, flow_L_min: float, units: RecordedUnits) -> str:
        """Return a flow to two decimals of a L/min, without its unit; what the recordings can't show is no 0.00."""
        unseen = self.unseen_below_L_min
        if unseen is not None and flow_L_min < unseen:
            return f"below {units.number(unseen, '.2f L/min')}"
        return units.number(flow_L_min, ".2f L/min")


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureResult(AtZero):
    """One tested pressure drop; dead zones as shares of full command, at the onset (0.1 % of the largest flow) and at
    the reading flow.
    """

    dead_zone_opening: Share
    """Dead zone on opening without the compensator."""
    dead_zone_closing: Share
    """Dead zone on closing without the compensator."""
    residual_opening: Share
    """Dead zone on opening with the compensator."""
    residual_closing: Share
    """Dead zone on closing with the compensator."""
    reading_flow_L_min: Flow
    """Reading flow: a stated flow at which dead zones are read in addition to the onset."""
    reading_opening_without: Share
    """Command at the reading flow on opening without the compensator."""
    reading_closing_without: Share
    """Command at the reading flow on closing without the compensator."""
    reading_opening: Share
    """Command at the reading flow on opening with the compensator."""
    reading_closing: Share
    """Command at the reading flow on closing with the compensator."""
    ideal_line: Share
    """Command at the reading flow on an ideal line from zero command to the largest flow."""
    q_zero_without_beta_L_min: Flow
    """Flow at zero command after closing with beta held at 1. It shows the effect of over-compensation."""
    flow_miss: Annotated[float, quantity("1", ge=0, le=1e6)]
    """Largest deviation of the plant's flow without the compensator from the recorded one, over the largest recorded
    flow. Both are averaged over 1 % of command."""
    flow_miss_at: Annotated[float, quantity("1", ge=0, le=1)]
    """Command share at which this deviation is largest, the middle of 1 %."""
    q_max_direct_L_min: Flow
    """Largest flow without the compensator."""
    q_max_L_min: Flow
    """Largest flow with the compensator."""
    full_from: Share
    """Command from which the output is the largest that it comes to."""
    hysteresis: Share
    """Distance of the branches with the compensator over the command, the mean from 5 to 99 % of the largest flow."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLoopResult:
    """Ramps in closed loop with the generated C."""

    plant: Plant | None
    """Given plant; null if the recorded flow stood in for the valve."""
    plant_source: str
    """Origin of the plant."""
    plant_sha256: Sha256 | None
    """SHA-256 of the plant's file; null if the recorded flow stood in for the valve."""
    dynamics: Plant | None
    """Coil and spool that moved the recorded flow (`recorded` in valve.json), without their metering edge. Null if a
    plant was given."""
    back_MPa: Annotated[tuple[float, ...], quantity("MPa")]
    """Pressures downstream of the edge. The ramps use the highest, failing sensors use each."""
    pressures: tuple[PressureResult, ...]
    """Result for each side and tested pressure drop; empty if the closed loop did not run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioResult(AtZero):
    """Result of one scenario other than ramps, at one pressure drop."""

    name: str
    """Name of the scenario."""
    back_MPa: Annotated[float, quantity("MPa", ge=0, le=1000)]
    """Pressure downstream of the edge at the end."""
    q_peak_at_zero_L_min: Flow
    """Largest flow while the command was zero and the valve had already closed."""
    must_shut: bool
    """Whether flow at zero command is a failure."""
    not_required: str
    """Reason why it is not a failure: the firmware cannot detect the disturbance, or nothing was declared. Empty if it
    is a failure."""
    figures: Mapping[str, float]
    """Other measured values; each name ends in its unit."""

    @property
    def is_load_step(self) -> bool:
        """Whether the pressure drop jumps in it."""
        return "pressure_drop_then_MPa" in self.figures
