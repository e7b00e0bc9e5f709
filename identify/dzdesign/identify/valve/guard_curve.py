"""What may be certified of one threshold, and where the valve opens: curves over the pressure drop, for valve.json."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal, get_args

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.valve.quantity_types import PressureDrop, Ratio, Voltage, VoltageError
from dzdesign.identify.valve.staircase import Direction, staircase

Guard = Literal["closing", "mean", "opening"]
#: Thresholds that a certificate may protect, from the safest on.
GUARDS: tuple[Guard, ...] = get_args(Guard)
#: Numbers of the file are right to seven decimals; a comparison of two allows ten times that.
ROUNDING_V = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardCurve:
    """The law's offset beta(dP) u_min0 under the certified bound of one threshold; one entry a test, dP rising.

    Its bounds hold together with the side's confidence. Those of two curves are not meant to hold together: a
    certificate protects one threshold.
    """

    u_min0_V: Annotated[Voltage, Meta(description="The largest offset at dP0 that the certificate allows.")]
    beta_dp_MPa: Annotated[
        tuple[PressureDrop, ...],
        quantity("MPa", "Nodes of beta, at the tests; empty where the pressure drop is unknown."),
    ]
    beta: Annotated[tuple[Ratio, ...], quantity("1", "beta at the nodes, straight between them.")]
    certified_steps_V: Annotated[
        tuple[Voltage, ...],
        quantity("V", "Staircase: lower bound of the threshold between neighbouring tests, one fewer than tests."),
    ]
    u_lower_V: Annotated[tuple[Voltage, ...], quantity("V", "Lower bounds of the threshold at the tests.")]
    u_threshold_V: Annotated[tuple[Voltage, ...], quantity("V", "The threshold itself, as the monotone fit has it.")]

    def __post_init__(self) -> None:
        if len(self.beta) != len(self.beta_dp_MPa) or not _rises(self.beta_dp_MPa):
            raise RuleError("the nodes of beta must be as many as their pressure drops, which must rise")
        count = len(self.u_lower_V)
        if len(self.u_threshold_V) != count:
            raise RuleError(
                f"{count} lower bounds stand beside {len(self.u_threshold_V)} thresholds, expected one each"
            )
        if not count or (self.beta_dp_MPa and count != len(self.beta_dp_MPa)):
            raise RuleError(f"{count} tests stand beside {len(self.beta_dp_MPa)} nodes of beta, expected one each")
        if len(self.certified_steps_V) != count - 1:
            raise RuleError(f"{len(self.certified_steps_V)} steps bound {count} tests, expected one fewer")
        if any(low > high + ROUNDING_V for low, high in zip(self.u_lower_V, self.u_threshold_V, strict=True)):
            raise RuleError("a lower bound lies above the threshold that it bounds")
        if not self.u_min0_V > 0:
            raise RuleError(f"u_min0 is {self.u_min0_V:g} V, expected a positive threshold")

    @property
    def u_offset_V(self) -> tuple[float, ...]:
        """Offset beta u_min0 at the tests, V."""
        return tuple(share * self.u_min0_V for share in self.beta) or (self.u_min0_V,)

    def check_staircase(self, trend: Direction) -> None:
        """Refuse steps that do not follow from the tests' bounds under a trend."""
        steps, _ = staircase(np.array(self.u_lower_V), trend)
        if any(abs(step - known) > ROUNDING_V for step, known in zip(steps, self.certified_steps_V, strict=True)):
            raise RuleError("the certified steps do not follow from the tests' lower bounds")


@dataclass(frozen=True, slots=True, kw_only=True)
class OpeningCurve:
    """Best estimate of where useful flow begins on opening: straight lines over dP between the tests. No bound.

    It is the knee of the rising branch, not the onset: the onset is where a soft edge begins to leak, below what is
    useful, and is known several times worse; at the knee a soft edge passes flow already, so a drive that reaches the
    knee has left the dead zone behind. What it overshoots the onset by is at commands above zero and opens nothing at
    zero command.

    At every node it is at least the offset of every guard's curve, so that the drive of a transition rises from the one
    to the other.
    """

    dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa", "Pressure drops of the tests.")]
    u_V: Annotated[
        tuple[Voltage, ...], quantity("V", "The threshold there, running the way of the trend (flat: constant).")
    ]
    u_se_V: Annotated[tuple[VoltageError, ...], quantity("V", "Standard error of that test's knee.")]

    def __post_init__(self) -> None:
        if not self.dp_MPa or not len(self.dp_MPa) == len(self.u_V) == len(self.u_se_V) or not _rises(self.dp_MPa):
            raise RuleError(
                f"the opening curve has {len(self.u_V)} thresholds and {len(self.u_se_V)} errors at "
                f"{len(self.dp_MPa)} pressure drops, expected as many, at least one, and rising pressure drops"
            )

    def check_order(self, trend: Direction, guards: Sequence[GuardCurve]) -> None:
        """Refuse a curve that does not run the way of the trend, or lies below the offset of a guard's curve."""
        steps = np.diff(self.u_V)
        wrong_way = {"decreasing": steps, "increasing": -steps, "flat": np.abs(steps)}[trend]
        if np.any(wrong_way > ROUNDING_V):
            raise RuleError(f"the opening curve does not run one way, expected a {trend} one like the trend")
        for guard in guards:
            offset = np.array(guard.u_offset_V)
            if len(offset) != len(self.u_V) or np.any(np.array(self.u_V) < offset - ROUNDING_V * (1 + offset)):
                raise RuleError("the opening curve lies below the offset of a guard's curve")


def _rises(values: Sequence[float]) -> bool:
    return all(left < right for left, right in pairwise(values))
