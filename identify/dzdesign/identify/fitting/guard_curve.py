"""What may be certified of one threshold, and where the valve opens: curves over the pressure drop, for valve.json."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from itertools import pairwise
from typing import Any

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.fitting.bounds import staircase

#: Thresholds that a certificate may protect, from the safest on.
GUARDS = ("closing", "mean", "opening")
#: Numbers of the file are right to seven decimals; a comparison of two allows ten times that.
ROUNDING_V = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class GuardCurve:
    """The law's offset beta(dP) u_min0 under the certified bound of one threshold; one entry a test, dP rising.

    Attributes
    ----------
    u_min0_V : float
        The largest offset at dP0 that the certificate allows, V.
    beta_dp_MPa, beta : tuple of float
        Nodes of the piecewise linear beta(dP), at the tests; empty where dP is unknown.
    certified_steps_V : tuple of float
        Staircase: lower bound of the threshold between neighbouring tests, V; one fewer than tests.
    u_lower_V : tuple of float
        Lower bounds of the threshold at the tests, V; all of one curve hold together with the side's confidence. Those
        of two curves are not meant to hold together: a certificate protects one threshold.
    u_threshold_V : tuple of float
        The threshold itself, as the monotone fit has it, V.

    Raises
    ------
    InputError
        If the numbers do not fit together.
    """

    u_min0_V: float
    beta_dp_MPa: tuple[float, ...]
    beta: tuple[float, ...]
    certified_steps_V: tuple[float, ...]
    u_lower_V: tuple[float, ...]
    u_threshold_V: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.beta) != len(self.beta_dp_MPa) or not _rises(self.beta_dp_MPa):
            raise InputError("the nodes of beta must be as many as their pressure drops, which must rise")
        count = len(self.u_lower_V)
        if len(self.u_threshold_V) != count:
            raise InputError(
                f"{count} lower bounds stand beside {len(self.u_threshold_V)} thresholds, expected one each"
            )
        if not count or (self.beta_dp_MPa and count != len(self.beta_dp_MPa)):
            raise InputError(f"{count} tests stand beside {len(self.beta_dp_MPa)} nodes of beta, expected one each")
        if len(self.certified_steps_V) != count - 1:
            raise InputError(f"{len(self.certified_steps_V)} steps bound {count} tests, expected one fewer")
        if any(low > high + ROUNDING_V for low, high in zip(self.u_lower_V, self.u_threshold_V, strict=True)):
            raise InputError("a lower bound lies above the threshold that it bounds")
        if not self.u_min0_V > 0:
            raise InputError(f"u_min0 is {self.u_min0_V} V, expected a positive threshold")

    @property
    def u_offset_V(self) -> tuple[float, ...]:
        """Offset beta u_min0 at the tests, V."""
        return tuple(share * self.u_min0_V for share in self.beta) or (self.u_min0_V,)

    def check_staircase(self, trend: str) -> None:
        """Check that the steps follow from the tests' bounds under a trend.

        Raises
        ------
        InputError
            If they do not.
        """
        steps, _ = staircase(np.array(self.u_lower_V), trend)
        if any(abs(step - known) > ROUNDING_V for step, known in zip(steps, self.certified_steps_V, strict=True)):
            raise InputError("the certified steps do not follow from the tests' lower bounds")

    def to_document(self) -> dict[str, Any]:
        """Return the entry of valve.json."""
        return asdict(self)


@dataclass(frozen=True, slots=True, kw_only=True)
class OpeningCurve:
    """Best estimate of where useful flow begins on opening: straight lines over dP between the tests. No bound.

    It is the knee of the rising branch, not the onset: the onset is where a soft edge begins to leak, below what is
    useful, and is known several times worse; at the knee a soft edge passes flow already, so a drive that reaches the
    knee has left the dead zone behind. What it overshoots the onset by is at commands above zero and opens nothing at
    zero command.

    Attributes
    ----------
    dp_MPa : tuple of float
        Pressure drops of the tests, rising.
    u_V, u_se_V : tuple of float
        The threshold, running the way of the side's trend ("flat": constant), and the standard error of that test's
        knee, V. At every node it is at least the offset of every guard's curve, so that the drive of an edge rises from
        the one to the other.
    """

    dp_MPa: tuple[float, ...]
    u_V: tuple[float, ...]
    u_se_V: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.dp_MPa or not len(self.dp_MPa) == len(self.u_V) == len(self.u_se_V) or not _rises(self.dp_MPa):
            raise InputError(
                f"the opening curve has {len(self.u_V)} thresholds and {len(self.u_se_V)} errors at "
                f"{len(self.dp_MPa)} pressure drops, expected as many, at least one, and rising pressure drops"
            )

    def check_order(self, trend: str, guards: Sequence[GuardCurve]) -> None:
        """Check that it runs the way of the trend, and nowhere below the offset of a guard's curve.

        Raises
        ------
        InputError
            If it does not.
        """
        steps = np.diff(self.u_V)
        wrong_way = {"decreasing": steps, "increasing": -steps, "flat": np.abs(steps)}[trend]
        if np.any(wrong_way > ROUNDING_V):
            raise InputError(f"the opening curve does not run one way, expected a {trend} one like the trend")
        for guard in guards:
            offset = np.array(guard.u_offset_V)
            if len(offset) != len(self.u_V) or np.any(np.array(self.u_V) < offset - ROUNDING_V * (1 + offset)):
                raise InputError("the opening curve lies below the offset of a guard's curve")

    def to_document(self) -> dict[str, Any]:
        """Return the entry of valve.json."""
        return asdict(self)


#: Lists of a guard's curve in valve.json.
CURVE_LISTS = tuple(field.name for field in fields(GuardCurve) if field.name != "u_min0_V")


def _rises(values: Sequence[float]) -> bool:
    return all(left < right for left, right in pairwise(values))
