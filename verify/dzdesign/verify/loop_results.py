"""Evidence of the closed loop: ramps, scenarios and series of plants, as ``verification.json`` holds them."""

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
class PressureResult:
    """One tested pressure drop; dead zones as shares of full command, at the onset (0.1 % of the largest flow) and at
    the reading flow.
    """

    side: Side
    dp_MPa: PressureDrop
    dead_zone_opening: Annotated[Share, about("Dead zone on opening without compensator.")]
    dead_zone_closing: Annotated[Share, about("The same on closing.")]
    residual_opening: Annotated[Share, about("Dead zone on opening that the compensator leaves.")]
    residual_closing: Annotated[Share, about("The same on closing.")]
    reading_flow_L_min: Annotated[Flow, about("Reading flow: a stated flow at which dead zones are read too.")]
    reading_opening_without: Annotated[Share, about("Command at which it is reached on opening, without compensator.")]
    reading_closing_without: Annotated[Share, about("The same on closing.")]
    reading_opening: Annotated[Share, about("Command at which it is reached on opening, with compensator.")]
    reading_closing: Annotated[Share, about("The same on closing.")]
    ideal_line: Annotated[
        Share, about("Command at which an ideal line from zero command to the largest flow reaches it.")
    ]
    unseen_below_L_min: Annotated[
        Flow | None,
        about("Flow below which the recordings show none, so that the plant's is not known; null of a given plant."),
    ]
    leak_L_min: Annotated[Flow, about("Flow without any drive, which no compensator can stop.")]
    allowed_at_zero_L_min: Annotated[
        Flow | None,
        about("Flow allowed at zero command, a leak included, as --zero-flow declares; null: none but the leak."),
    ]
    q_zero_L_min: Annotated[Flow, about("Flow at zero command after closing, with compensator; a leak is in it.")]
    q_zero_without_beta_L_min: Annotated[Flow, about("The same with beta held at 1: what over-compensation would do.")]
    flow_miss: Annotated[
        float,
        quantity(
            "1",
            "Largest departure of the plant's mean flow per 1 % of command from the recorded one, without compensator, "
            "over the largest recorded flow.",
            ge=0,
            le=1e6,
        ),
    ]
    q_max_direct_L_min: Annotated[Flow, about("Largest flow without compensator.")]
    q_max_L_min: Annotated[Flow, about("Largest flow with it.")]

    @property
    def q_beyond_L_min(self) -> float:
        """Flow at zero command beyond what is allowed there: the leak, or more where a flow was declared."""
        return self.q_zero_L_min - max(self.leak_L_min, self.allowed_at_zero_L_min or 0.0)

    def in_words(self, flow_L_min: float, units: RecordedUnits) -> str:
        """Return a flow to two decimals of a L/min; what the recordings can't show is no 0.00."""
        return flow_in_words(flow_L_min, self.unseen_below_L_min, units)


def flow_in_words(flow_L_min: float, unseen_below_L_min: float | None, units: RecordedUnits) -> str:
    """Return a flow to two decimals of a L/min, or below which flow it is where no more is known; without its unit.

    Examples
    --------
    >>> units = RecordedUnits()
    >>> flow_in_words(0.0, 0.63, units), flow_in_words(0.71, 0.63, units), flow_in_words(0.0, None, units)
    ('below 0.63', '0.71', '0.00')
    """
    if unseen_below_L_min is not None and flow_L_min < unseen_below_L_min:
        return f"below {units.number(unseen_below_L_min, '.2f L/min')}"
    return units.number(flow_L_min, ".2f L/min")


WindowKind = Literal["ramp", "step", "load step", "disturbances"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantComparison:
    """The closed loop's plant beside CasADi's integrator, over one window of time."""

    kind: Annotated[
        WindowKind,
        about(
            "What the command, or the pressure drop, does in it; disturbances: other pressures, drive, oil and "
            "readings, and a sensor that fails."
        ),
    ]
    side: Side
    dp_MPa: PressureDrop
    then_MPa: Annotated[
        float, quantity("MPa", "Pressure drop at no flow after a load step; else the same.", ge=0, le=1000)
    ]
    seconds: Annotated[float, quantity("s", "Length of the window.", gt=0, le=1000)]
    position_difference: Annotated[
        float,
        quantity(
            "1", "Largest distance of the spool's positions at the ends of PWM periods, over the stroke.", ge=0, le=1e6
        ),
    ]
    flow_difference: Annotated[
        float, quantity("1", "Largest difference of the flows there, over the largest one of the window.", ge=0, le=1e6)
    ]
    q_largest_L_min: Annotated[Flow, about("That largest flow, by the integrator.")]
    unlike_compare_values: Annotated[
        Count,
        about(
            "PWM periods in which the two loops' compare values differ, those of a direct command under the drive's "
            "dither too, and samples of a pressure's code."
        ),
    ]
    codes_at_border: Annotated[
        Count, about("Pressures so close to the border of two codes that the plant's code was taken.")
    ]
    impacts: Annotated[Count, about("How often the spool met a stop, by the integrator.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLoopResult:
    """Ramps in closed loop with the generated C."""

    plant: Annotated[
        Plant | None, about("The plant that was given; null where the recorded flow stood in for the valve.")
    ]
    plant_source: Annotated[str, about("Where the plant came from.")]
    plant_sha256: Annotated[
        Sha256 | None, about("Hash of the plant's file; null where the recorded flow stood in for the valve.")
    ]
    dynamics: Annotated[
        Plant | None,
        about(
            "Coil and spool that moved the recorded flow (`recorded` in valve.json); their edge does not count. Null "
            "where a plant was given."
        ),
    ]
    back_MPa: Annotated[
        tuple[float, ...],
        quantity("MPa", "Pressures behind the edge: ramps at the highest of them, failing sensors at each."),
    ]
    pressures: Annotated[
        tuple[PressureResult, ...], about("One entry a side and tested pressure drop; none if it did not run.")
    ]
    against_integrator: Annotated[
        tuple[PlantComparison, ...], about("One entry a side and kind of window; none if it did not run.")
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class ScenarioResult:
    """One scenario beside the ramps, at one pressure drop."""

    name: Annotated[str, about("What happens.")]
    side: Side
    dp_MPa: PressureDrop
    back_MPa: Annotated[float, quantity("MPa", "Pressure behind the edge, at the end.", ge=0, le=1000)]
    leak_L_min: Annotated[Flow, about("Flow without any drive at the end, which no compensator can stop.")]
    allowed_at_zero_L_min: Annotated[
        Flow | None,
        about("Flow allowed at zero command, a leak included, as --zero-flow declares; null: none but the leak."),
    ]
    q_zero_L_min: Annotated[
        Flow,
        about(
            "Flow at zero command at the end, or the largest where a disturbance lasts and the scenario is judged "
            "throughout; a leak is in it."
        ),
    ]
    q_peak_at_zero_L_min: Annotated[
        Flow, about("Largest flow while the command was zero and the valve had closed before.")
    ]
    unseen_below_L_min: Annotated[
        Flow | None,
        about("Flow below which the recordings show none, so that the plant's is not known; null of a given plant."),
    ]
    must_shut: Annotated[bool, about("Whether that flow is a failure.")]
    not_required: Annotated[str, about("Why it is not: no core can know, or nothing was declared; else empty.")]
    figures: Annotated[Mapping[str, float], about("What else was measured; the unit is the end of the name.")]

    @property
    def is_load_step(self) -> bool:
        """Whether the pressure drop jumps in it."""
        return "pressure_drop_then_MPa" in self.figures

    @property
    def q_beyond_L_min(self) -> float:
        """Flow at zero command beyond what is allowed there: the leak, or more where a flow was declared."""
        return self.q_zero_L_min - max(self.leak_L_min, self.allowed_at_zero_L_min or 0.0)

    def in_words(self, flow_L_min: float, units: RecordedUnits) -> str:
        """Return a flow to two decimals of a L/min; what the recordings can't show is no 0.00."""
        return flow_in_words(flow_L_min, self.unseen_below_L_min, units)


@dataclass(frozen=True, slots=True, kw_only=True)
class Spread:
    """Quantiles of one quantity over a series of plants, and the plant at its bad end."""

    p01: Annotated[float, about("1 % quantile.")]
    p05: Annotated[float, about("5 % quantile.")]
    p50: Annotated[float, about("Median.")]
    p95: Annotated[float, about("95 % quantile.")]
    p99: Annotated[float, about("99 % quantile.")]
    worst: Annotated[float, about("Value of the plant at the bad end.")]
    worst_plant: Annotated[Mapping[str, float], about("Those of its parameters that were drawn.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """What a series of plants does on one side at one pressure drop."""

    side: Side
    dp_MPa: PressureDrop
    plants: Annotated[int, Meta(description="How many plants.", ge=1, le=10**6)]
    leaking: Annotated[
        Count, about("How many pass flow at zero command after closing, or more than was declared as allowed.")
    ]
    residual_opening: Annotated[Spread, about("Dead zone on opening, share of full command.")]
    residual_closing: Annotated[Spread, about("Dead zone on closing, share of full command.")]
    q_zero_L_min: Annotated[Spread, about("Flow at zero command, L/min.")]
    q_max_L_min: Annotated[Spread, about("Largest flow, L/min.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Population:
    """Machines drawn from the declared one, each at zero command at every tested pressure drop and between."""

    machines: Annotated[int, Meta(description="How many.", ge=1, le=10**6)]
    seed: Annotated[int, Meta(description="Of the draw.", ge=0, le=2**60)]
    flowing: Annotated[Count, about("How many pass flow at zero command, beyond what is allowed.")]
    never_open: Annotated[Count, about("How many did not open at some pressure drop, so that their closing is none.")]
    confidence: Annotated[float, quantity("1", "Of the upper limit.", ge=0.5, le=1)]
    upper_limit: Annotated[
        float,
        quantity("1", "Upper limit of the probability that a machine passes flow, by Clopper and Pearson.", ge=0, le=1),
    ]
    pressures: Annotated[int, Meta(description="Pressure drops that each machine was tried at.", ge=1, le=10**6)]
    largest_L_min: Annotated[Flow, about("Largest flow at zero command beyond what is allowed.")]
    largest_dp_MPa: Annotated[float, quantity("MPa", "Pressure drop of it.", ge=0, le=1000)]
    worst: Annotated[
        Mapping[str, float], about("That machine: place of each component in its half-width, from -1 to 1.")
    ]
    drawn: Annotated[tuple[str, ...], about("Components that were drawn; others stood at their worst ends.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class MonteCarlo:
    """A series of plants about the one that was given."""

    plants: Annotated[int, Meta(description="How many.", ge=1, le=10**6)]
    seed: Annotated[int, Meta(description="Of the draw.", ge=0, le=2**60)]
    spreads: Annotated[Mapping[str, str], about("Parameter to its spread, in words.")]
    pressures: Annotated[tuple[Scatter, ...], about("One entry a side and pressure drop.")]
