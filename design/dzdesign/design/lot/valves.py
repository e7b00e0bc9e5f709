"""The valves of a lot: of each, what its ramp tests bounded the guarded threshold to.

The certificate of a compensator's file is for the valve in it. A lot setting is of many, so its file holds of each what
`verify` needs to see that none is over-compensated: name, hash of valve.json, and the guarded threshold's bounds.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from dzdesign.core.artefact_types import RuleError, Sha256, quantity
from dzdesign.identify.constants import Premise
from dzdesign.identify.valve.certified_bound import CertifiedBound
from dzdesign.identify.valve.quantity_types import PressureDrop, SecondDifference, Voltage
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.identify.valve.staircase import Direction


@dataclass(frozen=True, slots=True, kw_only=True)
class LotSide:
    """Lower bounds of a valve's guarded threshold for one sign of the command."""

    trend: Direction | None
    """Trend of the threshold over the pressure drop; null if fewer than two pressure drops were tested."""
    confidence: Annotated[float, quantity("1", ge=0.5, le=1)]
    """Joint confidence level of all bounds."""
    premise: Premise
    """Premise of the bound between the tests."""
    curvature_V_MPa2: Annotated[tuple[SecondDifference, ...], quantity("V/MPa2")]
    """Bound M of the curvature in each interval between neighbouring tests; 0 for line, empty for monotone."""
    dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Tested pressure drops, in ascending order."""
    u_lower_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Lower bound of the threshold at each tested pressure drop."""

    def __post_init__(self) -> None:
        if not self.dp_MPa or len(self.dp_MPa) != len(self.u_lower_V):
            raise RuleError(f"{len(self.dp_MPa)} pressure drops have {len(self.u_lower_V)} bounds, expected one each")
        if any(left >= right for left, right in pairwise(self.dp_MPa)):
            raise RuleError("the pressure drops of a valve do not rise from test to test")
        bends = 0 if self.premise == "monotone" else len(self.dp_MPa) - 1
        if len(self.curvature_V_MPa2) != bends:
            found = len(self.curvature_V_MPa2)
            raise RuleError(f"the premise {self.premise} has {found} values of M, expected {bends}")

    @classmethod
    def of(cls, side: SideModel, guard: str) -> "LotSide":
        """Return the bounds of an identified side."""
        curve = side.certified[guard]
        return cls(
            trend=side.trend,
            confidence=side.certificate.confidence,
            premise=curve.premise,
            curvature_V_MPa2=curve.curvature_V_MPa2,
            dp_MPa=curve.dp_MPa,
            u_lower_V=curve.u_lower_V,
        )

    def bound(self) -> CertifiedBound:
        """Return the bound on the whole tested interval, exact."""
        trend = self.trend or "flat"
        return CertifiedBound.of(self.premise, self.dp_MPa, self.u_lower_V, self.curvature_V_MPa2, trend)


@dataclass(frozen=True, slots=True, kw_only=True)
class LotValve:
    """A valve of the lot."""

    name: str
    """Name of the valve in the table of the batch."""
    valve_sha256: Sha256
    """SHA-256 of its valve.json."""
    positive: LotSide
    """Bounds for positive commands."""
    negative: LotSide | None = None
    """Bounds for negative commands; null if the setting drives none."""

    def side(self, sign: int) -> LotSide | None:
        """Return the bounds of one sign of command."""
        return self.positive if sign > 0 else self.negative

    @classmethod
    def of(cls, name: str, valve_sha256: str, sides: Mapping[int, SideModel], guards: Mapping[int, str]) -> "LotValve":
        """Return a valve's part; `sides` and `guards` by the sign of command."""
        bounds = {sign: LotSide.of(side, guards[sign]) for sign, side in sides.items()}
        return cls(name=name, valve_sha256=valve_sha256, positive=bounds[1], negative=bounds.get(-1))
