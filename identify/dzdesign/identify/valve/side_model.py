"""`SideModel`: one side of a valve (one direction of flow), an entry of ``sides`` in valve.json."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal, get_args

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.identify.constants import Direction
from dzdesign.identify.fit.scatter import Origin
from dzdesign.identify.valve.guard_curve import GUARDS, CertifiedCurve, Guard, OpeningCurve
from dzdesign.identify.valve.low_flow import LowFlow
from dzdesign.identify.valve.quantity_types import (
    Flow,
    IdentifiedRatio,
    PressureDrop,
    Probability,
    RatioError,
    Voltage,
    VoltageError,
)
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.recorded_drop import RecordedDrop

NoDrift = Literal["", "one pressure drop", "order unknown", "order of pressure"]
#: The branches, by what the valve does on them.
IDENTIFIED = ("closing", "opening")
#: What bounds answer for over the declared zero flow, above which it is said to be more.
PROMISED = 1.001
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Repeatability:
    """Scatter of the guarded threshold from ramp to ramp, and its drift through the series of ramps."""

    sd_V: VoltageError
    """Standard deviation of the threshold from ramp to ramp."""
    origin: Origin
    """Origin of the standard deviation: measured on repeats, declared by --repeatability, or assumed by dzdesign."""
    degrees_of_freedom: Annotated[float, quantity("1", gt=0, le=1e9)] | None
    """Degrees of freedom of a measured standard deviation; null if it was not measured."""
    drift_V: Voltage | None
    """Change of the threshold from the first ramp of the series to the last; null if the model has no drift. The
    thresholds refer to the middle of the series, and the bounds hold at both ends."""
    drift_se_V: VoltageError | None
    """Standard error of drift_V."""
    no_drift: NoDrift
    """Reason why the model has no drift; empty if it has one."""

    def in_words(self, units: RecordedUnits) -> str:
        """Return by how much the guarded threshold scatters from ramp to ramp, and drifts, and how that is known."""
        how = {
            "repeats": f"from repeated ramps, {self.degrees_of_freedom or 0:.0f} degrees of freedom",
            "declared": "declared",
            "assumed": "assumed, too few repeated ramps",
        }
        drift = (
            f"drift from the first ramp to the last: {units.number(1e3 * self.drift_V, '+.1f mV')} ± "
            f"{units.text(1e3 * self.drift_se_V, '.1f mV')}"
            if self.drift_V is not None and self.drift_se_V is not None
            else f"no drift in the model ({self.no_drift})"
        )
        return (
            f"standard deviation {units.text(1e3 * self.sd_V, '.1f mV')} ({how[self.origin]}), included in "
            f"the bounds; {drift}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """The reference point of the law."""

    dp_MPa: PressureDrop | None
    """Reference pressure drop dP0; null if the ramp test has no pressure."""
    u_min_V: Voltage
    """Identified threshold u_min0 at dP0, on the branch that is guarded by default."""
    u_min_se_V: VoltageError
    """Standard error of u_min0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BetaNodes:
    """Identified beta(dP) of Eq. (5), on the branch that is guarded by default; without nodes if dP is unknown."""

    dp_MPa: Annotated[tuple[PressureDrop, ...], quantity("MPa")]
    """Pressure drops of the nodes, which are those of the tests."""
    beta: Annotated[tuple[IdentifiedRatio, ...], quantity("1")]
    """Threshold at each node relative to that at dP0: u_min(dP) / u_min0."""
    beta_se: Annotated[tuple[RatioError, ...], quantity("1")]
    """Standard error of beta at each node; 0 at dP0."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundsBasis:
    """Basis of the lower bounds."""

    confidence: Annotated[float, quantity("1", ge=0.5, le=1)]
    """Joint confidence level of all bounds of a guard."""
    guard: Guard
    """Threshold that is protected by default: the safest one that was recorded. `design --guard` can select another."""
    level_L_min: Flow
    """Largest noise level of the tests; a flow below it counts as no flow."""
    zero_flow_L_min: Flow | None
    """Flow at zero command, leak included, that --zero-flow declared as allowed; null if none was declared."""
    unseen_below_L_min: Flow
    """Flow below which nothing is known at the guard's bounds. It is level_L_min. It is less if low-flow readings at or
    above the guarded threshold of every test show that no more flows. It is more if the readings at rest may hide a
    larger zero error of the meter."""
    repeatability: Repeatability
    """Differences from ramp to ramp."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SideModel:
    """One side of the valve, identified separately. The negative side counts commands and flows from zero downwards."""

    tests: Annotated[tuple[TestResult, ...], Meta(min_length=1)]
    """Ramp tests in ascending order of pressure drop."""
    recorded_drop: RecordedDrop | None
    """Origin and sign of the recorded pressure drop; null if it was declared or is unknown."""
    reference: Reference
    """Reference point of the law."""
    k_x_max_over_u_max: Annotated[float, quantity("1", ge=1e-3, le=1e3)]
    """Command range from the knee to full stroke, over full command (k x_max / u_max of Eq. 18)."""
    k_x_max_over_u_max_se: Annotated[float, quantity("1", ge=0, le=1e3)]
    """Standard error of k_x_max_over_u_max."""
    k_V_mm: Annotated[float, quantity("V/mm", ge=0, le=1e9)] | None
    """Constant k of Eq. (11), if --x-max was given."""
    k_V_mm_se: Annotated[float, quantity("V/mm", ge=0, le=1e9)] | None
    """Standard error of k_V_mm."""
    trend: Direction | None
    """Trend of the guarded threshold over the pressure drop; null if fewer than two pressure drops were tested."""
    trend_change_V: Voltage | None
    """Change of the guarded threshold over the tested range, by a straight-line fit."""
    trend_change_se_V: VoltageError | None
    """Standard error of trend_change_V."""
    trend_p: Probability | None
    """Probability of a change at least this large if the threshold were constant."""
    beta: Annotated[BetaNodes, Meta(description="Identified beta(dP). It is an estimate, not a bound.")] = field(
        init=False
    )
    valid_dp_MPa: Annotated[tuple[PressureDrop, PressureDrop] | None, quantity("MPa")] = field(init=False)
    """Tested interval of the pressure drop; nothing is certified outside it."""
    certificate: BoundsBasis
    """Basis of the lower bounds."""
    low_flow: tuple[LowFlow, ...]
    """Flows measured by hand below the meter's floor, by --low-flow."""
    identified: Annotated[
        Mapping[str, IdentifiedCurve], Meta(extra_json_schema={"propertyNames": {"enum": list(IDENTIFIED)}})
    ]
    """Identified threshold (knee) of each recorded branch with its error. It is an estimate, not a safe bound."""
    certified: Annotated[
        Mapping[str, CertifiedCurve], Meta(extra_json_schema={"propertyNames": {"enum": list(GUARDS)}})
    ]
    """Safe bounds: one curve for each threshold that the recordings allow, which are closing, opening and the mean of
    both. The error of the mean assumes the least favourable covariance."""
    opening_curve: OpeningCurve | None
    """Threshold of useful flow on opening; null without a rising branch or without pressure."""

    def __post_init__(self) -> None:
        if self.trend is None and len(self.tests) != 1:
            raise RuleError(f"trend is missing beside {len(self.tests)} tests, expected one of {', '.join(DIRECTIONS)}")
        if self.certificate.guard not in self.certified or not set(self.certified) <= set(GUARDS):
            raise RuleError(
                f"the guard is '{self.certificate.guard}' and there are curves of {', '.join(self.certified) or 'none'}"
                f", expected the guard among them, and no others than {', '.join(GUARDS)}"
            )
        guard = self.certificate.guard
        if guard not in self.identified or not set(self.identified) <= set(IDENTIFIED):
            raise RuleError(
                f"there are identified thresholds on {', '.join(self.identified) or 'no branch'}, expected the guarded "
                f"one's, {guard}, and no others than {', '.join(IDENTIFIED)}"
            )
        for curve in self.certified.values():
            curve.check_offset(self.trend or "flat")
        if self.opening_curve is not None:
            self.opening_curve.check_order(self.trend or "flat", tuple(self.certified.values()))
        dp, of_guarded = self.curve.dp_MPa, self.identified[guard]
        beta = BetaNodes(dp_MPa=of_guarded.dp_MPa, beta=of_guarded.beta, beta_se=of_guarded.beta_se)
        object.__setattr__(self, "beta", beta)
        object.__setattr__(self, "valid_dp_MPa", (dp[0], dp[-1]) if dp else None)

    def premise_in_words(self, units: RecordedUnits) -> str:
        """Return what the bounds between the tests rest on."""
        if len(self.tests) < 2:
            return "one pressure drop was tested: the bound holds there, and nothing is certified at another"
        return f"{len(self.tests)} pressure drops were tested. {self.curve.premise_in_words(units)}"

    def between_in_words(self, guard: Guard) -> str:
        """Return which premise a guard's bound rests on between the tests, and whether these could contradict it.

        No test shows that the threshold runs one way between two neighbours, nor the bend that was estimated from them.
        """
        curve = self.certified[guard]
        if len(self.tests) < 2:
            return "at one tested pressure drop: the bound holds there alone"
        if curve.premise == "none":
            return "at the tested pressure drops alone: nothing is declared between them"
        told = any(each.premise == curve.premise and each.lack_of_fit_p is not None for each in curve.premises)
        stated = curve.premise == "line" or (curve.premise == "smooth" and curve.curvature_is != "estimated")
        declared = "declared, " if curve.premise == "smooth" and stated else ""
        tested = "not contradicted by the tests" if told and stated and len(self.tests) > 2 else "untested"
        return f"between the tests: premise {curve.premise}, {declared}{tested}"

    @property
    def zero_flow_L_min(self) -> float | None:
        """Largest flow at zero command that the bounds answer for, a leak included; None where none was declared."""
        allowed = [test.zero_flow_L_min for test in self.tests if test.zero_flow_L_min is not None]
        return max(allowed, default=None)

    def zero_flow_in_words(self, units: RecordedUnits) -> str:
        """Say what flows at zero command at most, and what was declared; nothing where nothing was declared."""
        declared, allowed = self.certificate.zero_flow_L_min, self.zero_flow_L_min
        if declared is None or allowed is None:
            return ""
        text = f"up to {units.text(allowed, '.3g L/min')} may flow, a leak included: "
        if self.certificate.unseen_below_L_min > self.certificate.level_L_min:
            hidden = units.text(self.certificate.unseen_below_L_min, ".3g L/min")
            text = f"beside a zero error of the meter up to {hidden} that readings at rest hide, {text}"
        if allowed <= PROMISED * declared:
            return f"{text}the declared zero flow"
        zero_flow = units.text(declared, ".3g L/min")
        return f"{text}leak and noise level come to more than the declared zero flow of {zero_flow}"

    def zero_flow_at(self, dp_MPa: float) -> float | None:
        """Return the flow at zero command that the bounds answer for at a pressure drop, L/min; None: not declared."""
        if self.zero_flow_L_min is None:
            return None
        if len(self.tests) == 1:
            return self.zero_flow_L_min
        places, flows = ([getattr(test, key) for test in self.tests] for key in ("dp_MPa", "zero_flow_L_min"))
        return float(np.interp(dp_MPa, places, flows))

    def unseen_below_L_min(self, guard: str) -> float:
        """Return the flow at a guard's bounds below which nothing is known, L/min: of another guard the meter's level.

        Readings by hand tell of the default one's bounds.
        """
        basis = self.certificate
        unseen = basis.unseen_below_L_min
        return unseen if guard == basis.guard else max(unseen, basis.level_L_min)

    def none_in_words(self, guard: str, units: RecordedUnits) -> str:
        """Say which flow at a guard's bounds counts as no flow, and by what."""
        unseen, level = self.unseen_below_L_min(guard), self.certificate.level_L_min
        if unseen < level:
            by_hand, meter = units.text(unseen, ".3g L/min"), units.text(level, ".2f L/min")
            return f"flow below {by_hand} (the low-flow readings; the meter shows it from {meter} on) counts as no flow"
        if unseen > level:
            flow, meter = units.text(unseen, ".3g L/min"), units.text(level, ".2f L/min")
            hidden = "a zero error of the meter that readings at rest may hide; declare --meter-zero"
            return f"flow below {flow} counts as no flow ({hidden}; beside it the meter shows flow from {meter} on)"
        flow = units.text(level, ".2f L/min")
        by = "the largest of meter floor, noise of averaged readings and 0.5 % of the largest flow"
        return f"flow below {flow} counts as no flow ({by})"

    @property
    def curve(self) -> CertifiedCurve:
        """The curve of the guard that is protected by default."""
        return self.certified[self.certificate.guard]
