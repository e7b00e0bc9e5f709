"""`LowFlow`: a flow that was measured by hand where the meter shows none; an entry of ``low_flow`` in valve.json."""

from dataclasses import dataclass
from typing import Annotated, Literal

from msgspec import Meta

from dzdesign.core.artefact_types import quantity
from dzdesign.identify.valve.quantity_types import PressureDrop, Voltage

Branch = Literal["rising", "falling"]
#: As a person says it.
IN_WORDS: dict[Branch, str] = {"rising": "opening", "falling": "closing"}
#: A reading tells of a test whose pressure drop is within this share of its own.
SAME_PRESSURE = 0.05
#: As `Flow`, which is rounded to L/min with seven decimals: 0.1 µL/min.
SmallFlow = Annotated[float, quantity("L/min", ge=0, le=1e6)]


@dataclass(frozen=True, slots=True, kw_only=True)
class LowFlow:
    """One reading by hand at a constant command and pressure drop, by volume and time or by piston speed and area."""

    source: Annotated[str, Meta(description="Number of the reading, as given.")]
    branch: Annotated[
        Branch,
        Meta(description="Direction from which the command was approached: rising from below, falling from above."),
    ]
    u_V: Annotated[Voltage, Meta(description="Command during the reading.")]
    dp_MPa: Annotated[PressureDrop, Meta(description="Pressure drop across the metering edge.")]
    q_L_min: Annotated[SmallFlow, Meta(description="Measured flow, leak included.")]
    q_error_L_min: Annotated[SmallFlow, Meta(description="Largest error of the measured flow.")]

    @property
    def at_least_L_min(self) -> float:
        """The least that flows."""
        return self.q_L_min - self.q_error_L_min

    @property
    def at_most_L_min(self) -> float:
        """The most that flows."""
        return self.q_L_min + self.q_error_L_min

    def shows_flow_on(self, branch: Branch) -> bool:
        """Tell whether a flow of it flows on a branch too: after closing a spool is at least as far open."""
        return self.branch in (branch, "rising")

    def shows_none_on(self, branch: Branch) -> bool:
        """Tell whether no more than its flow flows on a branch too: after opening it is at most as far open."""
        return self.branch in (branch, "falling")

    def at_most_at(self, dp_MPa: float) -> float:
        """Return the most that flows at another pressure drop, L/min: a small flow is laminar at the most."""
        return self.at_most_L_min * max(1.0, dp_MPa / self.dp_MPa)

    def is_at(self, dp_MPa: float) -> bool:
        """Tell whether it tells of a test at that pressure drop."""
        return abs(self.dp_MPa - dp_MPa) <= SAME_PRESSURE * dp_MPa
