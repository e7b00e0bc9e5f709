"""What may be certified of one threshold, and where the valve opens: curves over the pressure drop, for valve.json."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Annotated, Literal, get_args

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.constants import REFUSED, Premise
from dzdesign.identify.valve.above_tests import AboveTests
from dzdesign.identify.valve.bound_errors import BoundErrors
from dzdesign.identify.valve.certified_bound import CertifiedBound, largest_excess
from dzdesign.identify.valve.estimated_curvature import (
    END_FACTOR_OF_THREE,
    FEWEST_FOR_CURVATURE,
    bends_of,
    curvature_above,
    estimated_curvature,
)
from dzdesign.identify.valve.quantity_types import (
    PressureDrop,
    Probability,
    Ratio,
    SecondDifference,
    Voltage,
    VoltageError,
)
from dzdesign.identify.valve.staircase import Direction

Guard = Literal["closing", "mean", "opening"]
#: Thresholds that a certificate may protect, from the safest on.
GUARDS: tuple[Guard, ...] = get_args(Guard)
#: Numbers of the file are right to seven decimals; a comparison of two allows ten times that.
ROUNDING_V = 1e-6
#: What a number of the file may be off by, with double precision's error.
ROUNDING = 1e-7
#: Where a single test stands whose pressure drop is unknown, MPa: nothing depends on it.
ANYWHERE = (1.0,)


@dataclass(frozen=True, slots=True, kw_only=True)
class PremiseCheck:
    """One premise about the threshold between the tests: how it fits them, and the dead zone that it would leave."""

    premise: Annotated[
        Premise,
        Meta(
            description="Premise. line: the threshold is a straight line over the pressure drop. smooth: its second "
            "divided difference, kinks included, is at most M. monotone: it only rises or only falls "
            "between neighbouring tests."
        ),
    ]
    lack_of_fit_p: Annotated[
        Probability | None,
        Meta(
            description="Probability of tests that contradict the premise at least as much as these if it were true, "
            "given noise and scatter. The premise is rejected below 0.01. For monotone it is the smaller of "
            "two: that of the steps, and that of a minimum between two tests. Null: the tests can't "
            "contradict the premise."
        ),
    ]
    dead_zone_over_u_max: Annotated[
        Ratio | None,
        quantity(
            "1",
            "Largest dead zone on opening that a law without transition would leave on the tested interval. "
            "The opening knee is taken as straight between tests. Null: no positive offset follows.",
        ),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class CertifiedCurve:
    """The law's offset under the certified bound of one threshold; bounds hold together with the side's confidence.

    Those of two curves are not meant to hold together: a certificate protects one threshold.
    """

    premise: Annotated[Premise, Meta(description="Premise of the bound between the tests.")]
    premises: Annotated[
        tuple[PremiseCheck, ...],
        Meta(description="Premises that these tests allow, with the dead zone that each would leave."),
    ]
    curvature_V_MPa2: Annotated[
        tuple[SecondDifference, ...],
        quantity(
            "V/MPa2",
            "Bound M of the curvature in each interval between neighbouring tests; 0 for line, empty for monotone.",
        ),
    ]
    curvature_is: Annotated[
        Literal["declared", "estimated"] | None,
        Meta(description="Whether the M of a smooth curve was declared or estimated; null for another premise."),
    ]
    dp_MPa: Annotated[
        tuple[PressureDrop, ...], quantity("MPa", "Tested pressure drops; empty if the pressure drop is unknown.")
    ]
    u_threshold_V: Annotated[tuple[Voltage, ...], quantity("V", "Threshold at each test, as fitted under the premise.")]
    u_lower_V: Annotated[
        tuple[Voltage, ...],
        quantity(
            "V",
            "Lower bounds of the threshold at the tests. Between two tests the bound is their chord minus "
            "M/2 (dP - a) (b - dP). For monotone it is the lower of the two.",
        ),
    ]
    errors: Annotated[BoundErrors, Meta(description="Error components of the lower bounds at the tests.")]
    u_min0_V: Annotated[Voltage, Meta(description="Largest offset at dP0 that the certificate allows.")]
    offset_dp_MPa: Annotated[
        tuple[PressureDrop, ...], quantity("MPa", "Nodes of the offset; empty if the pressure drop is unknown.")
    ]
    offset_V: Annotated[
        tuple[Voltage, ...],
        quantity("V", "Largest piecewise linear offset below the bound that follows the direction of the trend."),
    ]
    above: Annotated[
        AboveTests | None,
        Meta(description="Bound above the last test; null for a single test, or if the pressure drop is unknown."),
    ]

    def __post_init__(self) -> None:
        for name, nodes, values in (
            ("the offset", self.offset_dp_MPa, self.offset_V),
            ("the bound", self.dp_MPa, self.u_lower_V),
        ):
            if not _rises(nodes) or len(nodes) not in (len(values), 0) or not values or (not nodes and len(values) > 1):
                raise RuleError(f"the nodes of {name} must be as many as their pressure drops, which must rise")
        if len(self.u_threshold_V) != len(self.u_lower_V):
            raise RuleError(
                f"{len(self.u_lower_V)} lower bounds stand beside {len(self.u_threshold_V)} thresholds, expected one "
                "each"
            )
        if len(self.errors.noise_se_V) != len(self.u_lower_V):
            raise RuleError(f"{len(self.errors.noise_se_V)} errors stand beside {len(self.u_lower_V)} bounds")
        if bool(self.dp_MPa) != bool(self.offset_dp_MPa) or (
            self.dp_MPa and (self.dp_MPa[0], self.dp_MPa[-1]) != (self.offset_dp_MPa[0], self.offset_dp_MPa[-1])
        ):
            raise RuleError("the nodes of the offset must reach from the first tested pressure drop to the last")
        bends = 0 if self.premise == "monotone" else len(self.u_lower_V) - 1
        if len(self.curvature_V_MPa2) != bends:
            raise RuleError(
                f"the premise is '{self.premise}' and {len(self.curvature_V_MPa2)} values of M stand beside "
                f"{len(self.u_lower_V)} tests, expected {bends}"
            )
        if (self.premise == "smooth") != (self.curvature_is is not None):
            raise RuleError("where M is from must be said of a smooth curve, and of no other")
        if any(low > high + ROUNDING_V for low, high in zip(self.u_lower_V, self.u_threshold_V, strict=True)):
            raise RuleError("a lower bound lies above the threshold that it bounds")
        if (self.above is None) != (len(self.dp_MPa) < 2):
            raise RuleError("a bound above the tests must stand beside two tests or more, and beside no other")
        self._check_premise()
        if not self.u_min0_V > 0 or min(self.offset_V) <= 0:
            raise RuleError(f"u_min0 is {self.u_min0_V:g} V, expected a positive threshold")

    def _check_premise(self) -> None:
        """Check that the tests allow the premise, and that M is what follows from them where it was estimated."""
        check = next((each for each in self.premises if each.premise == self.premise), None)
        if check is None:
            raise RuleError(f"the premise is '{self.premise}', expected one of those that the tests allow")
        # `monotone` pays for steps the wrong way: its bounds are lowered.
        if self.premise != "monotone" and check.lack_of_fit_p is not None and check.lack_of_fit_p < REFUSED:
            raise RuleError(f"the premise is '{self.premise}', which the tests refuse (p = {check.lack_of_fit_p:.2g})")
        stated = np.array(self.curvature_V_MPa2)
        if self.premise == "line" and stated.any():
            raise RuleError("a straight threshold has M = 0")
        if self.curvature_is == "declared" and len(set(self.curvature_V_MPa2)) > 1:
            raise RuleError("a declared M is one and the same between all tests")
        if self.premise == "monotone" or self.curvature_is == "declared" or not self.dp_MPa:
            return
        found, errors = bends_of(self.dp_MPa, self.u_threshold_V, ROUNDING)
        if self.premise == "line":
            if np.any(np.abs(found) > errors):
                raise RuleError("the premise is 'line', but the thresholds do not lie on a straight line")
            return
        if len(self.dp_MPa) < FEWEST_FOR_CURVATURE:
            raise RuleError(f"M is estimated from {len(self.dp_MPa)} tests, expected {FEWEST_FOR_CURVATURE} or more")
        allowed = estimated_curvature(found)
        if np.any(np.abs(stated - allowed) > ROUNDING + END_FACTOR_OF_THREE * errors.max()):
            row = int(np.argmax(np.abs(stated - allowed)))
            raise RuleError(
                f"M is {1e3 * stated[row]:.4g} mV/MPa² from {self.dp_MPa[row]:g} to {self.dp_MPa[row + 1]:g} MPa, but "
                f"{1e3 * allowed[row]:.4g} follows from the thresholds at the tests, of which it is estimated"
            )
        above = 0.0 if self.above is None else self.above.curvature_V_MPa2
        if abs(above - curvature_above(found)) > ROUNDING + END_FACTOR_OF_THREE * errors.max():
            raise RuleError(
                f"M is {1e3 * above:.4g} mV/MPa² above the tests, but {1e3 * curvature_above(found):.4g} follows from "
                "the thresholds at the tests, of which it is estimated"
            )

    @property
    def u_offset_V(self) -> tuple[float, ...]:
        """Offset at the tests, V."""
        if not self.dp_MPa:
            return self.offset_V
        return tuple(map(float, np.interp(self.dp_MPa, self.offset_dp_MPa, self.offset_V)))

    @property
    def beta(self) -> tuple[float, ...]:
        """Offset at the tests over that at dP0; empty where the pressure drop is unknown."""
        return tuple(value / self.u_min0_V for value in self.u_offset_V) if self.dp_MPa else ()

    def premise_in_words(self, units: RecordedUnits) -> str:
        """Return what the bound rests on between the tests, and how that was tested."""
        check = next((each for each in self.premises if each.premise == self.premise), None)
        p_value = None if check is None else check.lack_of_fit_p
        tested = "which these tests can't contradict" if p_value is None else f"lack of fit p = {p_value:.2g}"
        if self.premise == "line":
            return f"Premise line: the threshold is a straight line against the pressure drop ({tested})"
        if self.premise == "smooth":
            known = f"declared, {tested}"
            if self.curvature_is == "estimated":
                known = "estimated from these tests, not proved by them"
            bends = [1e3 * value for value in self.curvature_V_MPa2]
            inner, ends = min(bends), {"first": bends[0], "last": bends[-1]}
            larger = [f"{units.number(end, '.3g mV/MPa²')} in the {name}" for name, end in ends.items() if end > inner]
            at_ends = f", but {' and '.join(larger)} interval" if larger else ""
            return (
                "Premise smooth: between two tests h apart, the threshold lies at most M h²/8 below the straight line "
                f"between their bounds, M = {units.text(inner, '.3g mV/MPa²')}{at_ends} ({known})"
            )
        return (
            "Premise monotone: between two tests the bound is the lower one's, on the premise that the threshold runs "
            f"one way there ({tested}): one that is lowest between two tests, in a bend that they do not show, lies "
            "below it"
        )

    def bound(self, trend: Direction) -> CertifiedBound:
        """Return the bound on the whole tested interval, exact."""
        return CertifiedBound.of(self.premise, self.dp_MPa or ANYWHERE, self.u_lower_V, self.curvature_V_MPa2, trend)

    def check_above(self, trend: Direction) -> None:
        """Refuse a bound above the tests that does not follow from the tests and the premise."""
        if self.above is not None:
            lower = self.bound(trend).at(Fraction(repr(self.dp_MPa[-1])))
            self.above.check(self.premise, trend, self.dp_MPa, self.u_threshold_V, float(lower or 0))
            if self.curvature_is == "declared" and self.above.curvature_V_MPa2 != self.curvature_V_MPa2[-1]:
                raise RuleError("a declared M is the same above the tests as between them")

    def check_offset(self, trend: Direction, dp0_MPa: float | None) -> None:
        """Refuse an offset that lies above the bound anywhere, or does not run the way of the trend."""
        bound, offset = self.bound(trend), np.array(self.offset_V)
        nodes = np.array(self.offset_dp_MPa or ANYWHERE)
        if largest_excess(bound, nodes, offset) > ROUNDING_V:
            raise RuleError("the offset does not follow from the tests' lower bounds: it lies above them")
        steps = np.diff(offset)
        wrong_way = {"decreasing": steps, "increasing": -steps, "flat": np.abs(steps)}[trend]
        if np.any(wrong_way > ROUNDING_V):
            raise RuleError(f"the offset does not run one way, expected a {trend} one like the trend")
        at_dp0 = offset[0] if dp0_MPa is None or not self.dp_MPa else float(np.interp(dp0_MPa, nodes, offset))
        if abs(at_dp0 - self.u_min0_V) > ROUNDING_V:
            raise RuleError(f"u_min0 is {self.u_min0_V:g} V, but the offset at dP0 is {at_dp0:g} V")


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
        tuple[Voltage, ...],
        quantity("V", "Opening threshold at each test, monotone in the direction of the trend (flat: constant)."),
    ]
    u_se_V: Annotated[tuple[VoltageError, ...], quantity("V", "Standard error of each test's knee.")]

    def __post_init__(self) -> None:
        if not self.dp_MPa or not len(self.dp_MPa) == len(self.u_V) == len(self.u_se_V) or not _rises(self.dp_MPa):
            raise RuleError(
                f"the opening curve has {len(self.u_V)} thresholds and {len(self.u_se_V)} errors at "
                f"{len(self.dp_MPa)} pressure drops, expected as many, at least one, and rising pressure drops"
            )

    def check_order(self, trend: Direction, guards: Sequence[CertifiedCurve]) -> None:
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
