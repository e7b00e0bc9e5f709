"""What the engineer chooses for an assessment."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from dzdesign.core.errors import InputError
from dzdesign.identify.options import IdentifyOptions

Side = Literal["positive", "negative"]
BOTH_SIDES: tuple[Side, Side] = ("positive", "negative")
#: Recordings without the compensator, and with it.
Set = Literal["before", "after"]
SETS: tuple[Set, Set] = ("before", "after")


@dataclass(frozen=True, slots=True, kw_only=True)
class AssessOptions:
    """Choices of the engineer, SI."""

    #: How recordings are read: full command, meter, knee window.
    reading: IdentifyOptions = field(default_factory=IdentifyOptions)
    #: Full command of the recordings with the compensator, V; None: the same.
    after_u_max: float | None = None
    #: Reading flow, at which dead zones are read, m³/s, or as a share of the largest flow BEFORE at that pressure drop;
    #: None takes what counts as flow BEFORE: the meter's floor, unless its noise or 0.5 % of the largest flow is more.
    reading_flow: float | None = None
    reading_share: float | None = None
    #: Commands between which linearity is taken, over u_max.
    window: tuple[float, float] = (0.1, 0.9)
    #: Of `parse_limits`.
    limits: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        flow, share = self.reading_flow, self.reading_share
        if flow is not None and share is not None:
            raise InputError("the reading flow is given both as a flow and as a share; keep one")
        if not (flow or share or 1.0) > 0 or 0.0 in (flow, share):
            raise InputError(
                "the reading flow is zero or negative, expected a flow such as '0.6 L/min', or a share of the largest"
            )
        if not (share or 0.0) < 1:
            raise InputError(f"the reading flow is {share:.0%} of the largest flow, expected less than all of it")
        if not 0 <= self.window[0] < self.window[1] <= 1:
            raise InputError(f"the linearity window is {self.window}, expected two rising shares such as '10-90 %'")

    def of_set(self, name: Set) -> IdentifyOptions:
        """Return how the recordings of a set are read."""
        return self.reading if name == "before" else replace(self.reading, u_max=self.after_u_max or self.reading.u_max)
