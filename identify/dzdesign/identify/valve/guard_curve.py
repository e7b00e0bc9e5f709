"""What may be certified of one threshold, and where the valve opens: curves over the pressure drop, for valve.json."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Literal, get_args

import numpy as np

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.constants import ANYWHERE_MPa, Direction, Premise
from dzdesign.identify.valve.bound_proof import BoundProof
from dzdesign.identify.valve.certified_bound import CertifiedBound, largest_excess
from dzdesign.identify.valve.quantity_types import (
    PressureDrop,
    Probability,
    Ratio,
    SecondDifference,
    Voltage,
    VoltageError,
)

Guard = Literal["closing", "mean", "opening"]
#: Thresholds that a certificate may protect, from the safest on.
GUARDS: tuple[Guard, ...] = get_args(Guard)
#: What a bound rests on between the tests; `none` where nothing is known there.
CurvePremise = Literal["line", "smooth", "monotone", "none"]
#: Numbers of the file are right to seven decimals; a comparison of two allows ten times that.
ROUNDING_V = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class AboveTests:
    """The bound above the last tested pressure drop; nothing is known beyond its last node."""

    certified: bool
    """Whether the bound above the tests holds with the side's confidence, provided that its premise holds. False: the
    premise gives no bound there."""
    dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Nodes from the last tested pressure drop to the point at which the bound reaches zero."""
    u_lower_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Lower bounds at the nodes, linear between them: the continued threshold minus its errors."""

    def __post_init__(self) -> None:
        count = len(self.dp_MPa)
        if count < 2 or count != len(self.u_lower_V):
            raise RuleError(
                f"above the tests {count} pressure drops stand beside {len(self.u_lower_V)} bounds, expected two or "
                "more, and as many of each"
            )
        if any(left >= right for left, right in pairwise(self.dp_MPa)):
            raise RuleError("the pressure drops above the tests must rise")
        if any(right > left + ROUNDING_V for left, right in pairwise(self.u_lower_V)):
            raise RuleError("a bound above the tests must not rise")

    def bound(self) -> CertifiedBound:
        """Return the bound on the interval of the nodes, exact."""
        return CertifiedBound.of(self.dp_MPa, self.u_lower_V)

    def in_words(self, premise: str) -> str:
        """Return what the continued bound rests on."""
        rests: dict[str, str] = {
            "line": "the threshold continues as a straight line",
            "smooth": "the threshold continues from the last tests' value and slope, with curvature at most M",
            "monotone": "the threshold keeps rising or stays constant",
        }
        if self.certified:
            return f"certified if {rests[premise]}"
        return (
            "not certified: the threshold continues with the steepest slope between two tests: nothing bounds it there"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PremiseCheck:
    """One premise about the threshold between the tests: how it fits them, and the dead zone that it would leave."""

    premise: Premise
    """Premise. line: the threshold is a straight line over the pressure drop. smooth: it has at most one kink, or a
    smooth bend, between two tests, no stronger than the tests show. If an M was declared, its second divided difference
    is at most M. monotone: it only rises or only falls."""
    lack_of_fit_p: Probability | None
    """Probability of tests that contradict the premise at least as much as these if it were true, given noise and
    scatter. The premise is rejected below 0.01. Null: the tests can't contradict the premise."""
    dead_zone_over_u_max: Annotated[Ratio | None, quantity("1")]
    """Largest dead zone on opening that a law without transition would leave on the tested interval. The opening knee
    is taken as straight between tests. Null: no positive offset follows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CertifiedCurve:
    """The law's offset under the certified bound of one threshold; bounds hold together with the side's confidence.

    Those of two curves are not meant to hold together: a certificate protects one threshold.
    """

    premise: CurvePremise
    """Premise of the bound between the tests; none: nothing is certified between two tests."""
    premises: tuple[PremiseCheck, ...]
    """Premises that these tests allow, with the dead zone that each would leave."""
    curvature_V_MPa2: Annotated[SecondDifference | None, quantity("V/MPa2")]
    """Largest curvature M that a smooth curve may have; null for another premise."""
    curvature_is: Literal["declared", "estimated"] | None
    """Whether the M of a smooth curve was declared or estimated; null for another premise."""
    dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Tested pressure drops; empty if the pressure drop is unknown."""
    u_threshold_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Guarded threshold at each test."""
    u_lower_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Lower bound of the threshold at each test."""
    bound_dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Nodes of the bound; empty if the pressure drop is unknown."""
    bound_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Lower bound of the threshold at each node: the largest that no threshold contradicts which the ramps and the
    premise allow. It is linear between the nodes, except for none, which has tests alone."""
    proof: BoundProof
    """Ramps, scatter and multipliers from which the bound follows."""
    u_min0_V: Voltage
    """Largest offset at dP0 that the certificate allows."""
    offset_dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")] = field(init=False)
    """Nodes of the offset, which are those of the bound; empty if the pressure drop is unknown."""
    offset_V: Annotated[tuple[Voltage, ...], quantity("V")]
    """Largest piecewise linear offset below the bound that follows the direction of the trend."""
    above: AboveTests | None
    """Bound above the last test; null if the premise says nothing there."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "offset_dp_MPa", self.bound_dp_MPa)
        for name, nodes, values in (
            ("the offset", self.bound_dp_MPa, self.offset_V),
            ("the bound", self.bound_dp_MPa, self.bound_V),
            ("the tests", self.dp_MPa, self.u_lower_V),
        ):
            if not _rises(nodes) or len(nodes) not in (len(values), 0) or not values or (not nodes and len(values) > 1):
                raise RuleError(f"the nodes of {name} must be as many as their pressure drops, which must rise")
        if not self.u_min0_V > 0 or min(self.offset_V) <= 0:
            raise RuleError(f"u_min0 is {self.u_min0_V:g} V, expected a positive threshold")
        self.proof.check(self.bound_dp_MPa, self.bound_V)

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
        aside = len(self.proof.set_aside)
        beside = f"; {aside} ramp{'s' * (aside > 1)} set aside, on the premise that it was no closing" if aside else ""
        if self.premise == "line":
            return f"Premise line: the threshold is a straight line against the pressure drop ({tested}){beside}"
        if self.premise == "none":
            return (
                "Nothing is certified between the tests: declare --curve line or monotone, or a --curvature, if the "
                f"valve is known to be so, or record three pressure drops or more{beside}"
            )
        if self.premise == "monotone":
            return (
                f"Premise monotone: the threshold runs one way over the pressure drop ({tested}): one that is lowest "
                f"between two tests lies below the bound{beside}"
            )
        bend = units.text(1e3 * (self.curvature_V_MPa2 or 0.0), ".3g mV/MPa²")
        if self.curvature_is == "declared":
            return f"Premise smooth: the threshold's curvature is at most M = {bend} (declared, {tested}){beside}"
        return (
            "Premise smooth: between two tests the threshold has at most one kink or a smooth bend, no stronger than "
            f"from test to test: M up to {bend} (estimated from these tests, not proved by them){beside}"
        )

    def bound(self) -> CertifiedBound:
        """Return the bound, exact: on the whole tested interval, or at the tests alone."""
        return CertifiedBound.of(self.bound_dp_MPa or (ANYWHERE_MPa,), self.bound_V, apart=self.premise == "none")

    def check_offset(self, trend: Direction) -> None:
        """Refuse an offset that lies above the bound anywhere, or does not run the way of the trend."""
        bound, offset = self.bound(), np.array(self.offset_V)
        nodes = np.array(self.bound_dp_MPa or (ANYWHERE_MPa,))
        if largest_excess(bound, nodes, offset) > ROUNDING_V:
            raise RuleError("the offset does not follow from the tests' lower bounds: it lies above them")
        steps = np.diff(offset)
        wrong_way = {"decreasing": steps, "increasing": -steps, "flat": np.abs(steps)}[trend]
        if np.any(wrong_way > ROUNDING_V):
            raise RuleError(f"the offset does not run one way, expected a {trend} one like the trend")


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
