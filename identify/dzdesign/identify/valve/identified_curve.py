"""`IdentifiedCurve`: what the data say of one branch's threshold over the pressure drop, for valve.json."""

from dataclasses import dataclass
from typing import Annotated

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.valve.quantity_types import (
    IdentifiedRatio,
    PressureDrop,
    RatioError,
    Voltage,
    VoltageError,
)

#: The branches, by what the valve does on them.
IDENTIFIED = ("closing", "opening")


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedCurve:
    """Thresholds (knees) of one branch by the fit of the side, and their ratio of Eq. (5); one entry for each test."""

    dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Tested pressure drops; empty if the pressure drop is unknown."""
    u_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Threshold u_min at each test: the knee as fitted under the premise."""
    u_se_V: Annotated[tuple[VoltageError, ...], quantity("V")]
    """Standard error of the threshold by noise, scatter from ramp to ramp, and the width of the straight part."""
    beta: Annotated[tuple[IdentifiedRatio, ...], quantity("1")]
    """Threshold relative to that at dP0 (Eq. 5); empty if the pressure drop is unknown."""
    beta_se: Annotated[tuple[RatioError, ...], quantity("1")]
    """Standard error of beta; 0 at dP0."""

    def __post_init__(self) -> None:
        lengths = {len(self.u_V), len(self.u_se_V), *((len(self.dp_MPa),) if self.dp_MPa else ())}
        if len(lengths) > 1 or not self.u_V or not len(self.beta) == len(self.beta_se) == len(self.dp_MPa):
            raise RuleError(
                f"{len(self.u_V)} identified thresholds stand beside {len(self.u_se_V)} errors, {len(self.beta)} beta "
                f"and {len(self.dp_MPa)} pressure drops, expected one each"
            )
