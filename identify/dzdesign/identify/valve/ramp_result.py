"""`TestResult`: what one ramp test shows, an entry of ``tests`` in valve.json."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from msgspec import UNSET, Meta, UnsetType

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.valve.left_out import LeftOut
from dzdesign.identify.valve.quantity_types import Flow, FlowGain, PressureDrop, Ratio, Voltage, VoltageError
from dzdesign.identify.valve.recorded_curve import RecordedCurve

#: Significant digits of a rate: a recording's clock tells no more.
DIGITS = 4
LARGEST = 1e9
#: Standard errors by which closing must lie above opening to be no noise; and V, for a simulation has almost none.
ORDER_SIGNIFICANCE, ORDER_LEAST_V = 5.0, 1e-3
BRANCHES = ("rising", "falling")

StandardError = Annotated[VoltageError | None, Meta(description="Standard error of this threshold.")]
LinearRange = tuple[Ratio, Ratio]


@dataclass(frozen=True, slots=True, kw_only=True)
class RampConditions:
    """Pace and sampling of the ramps of one test."""

    rate_V_s: Annotated[float, quantity("V/s", ge=0, le=LARGEST)] | None
    """Rate of the command ramp, the fastest if there are several; null if unknown."""
    sampling_Hz: Annotated[float, quantity("Hz", ge=0, le=LARGEST)] | None
    """Number of samples used per second. If several rows of a file became one sample, their medians count. Null: no
    time was recorded."""
    samples: Annotated[int, Meta(ge=0, le=10**12)]
    """Number of samples used, over all ramps."""


def conditions_of(rates_V_s: Sequence[float], time_s: np.ndarray) -> RampConditions:
    """Return the conditions of a test from the paces of its branches and the times (N,) of its samples.

    A pace that is not known is NaN; where the time falls, another ramp begins.

    Examples
    --------
    >>> conditions_of([0.5, float("nan")], np.array([0.0, 0.01, 0.02, 0.0, 0.01]))
    RampConditions(rate_V_s=0.5, sampling_Hz=100.0, samples=5)
    """
    known = [rate for rate in rates_V_s if math.isfinite(rate) and rate > 0]
    steps = np.diff(time_s)
    steps = steps[steps > 0]
    interval = float(np.median(steps)) if steps.size else 0.0
    return RampConditions(
        rate_V_s=_significant(max(known)) if known else None,
        sampling_Hz=_significant(1 / interval) if interval > 1 / LARGEST else None,
        samples=int(time_s.size),
    )


def _significant(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class TestResult:
    """Result at one pressure drop: all ramps within 2 % of it. A threshold is null if its branch was not recorded."""

    __test__ = False  # not a test case, whatever its name

    source: str
    """Recording of the test; the first one if there are several."""
    dp_MPa: PressureDrop | None
    """Pressure drop at zero flow; null if none was recorded or declared."""
    dp_from: str | None
    """Origin of the pressure drop: columns of the recordings, such as pP_MPa - pA_MPa, or 'declared' by --dp or [dp].
    Null: the pressure drop is unknown."""
    u_knee_rising_V: Voltage | None
    """Knee on opening: the straight part of Q/sqrt(dP), extrapolated to zero flow."""
    u_knee_rising_se_V: StandardError
    u_onset_rising_V: Voltage | None
    """Onset on opening, as far as the meter shows it. It is the first flow above the meter's noise, or the tail
    extrapolated to zero, whichever is lower."""
    u_onset_rising_se_V: StandardError
    straight_rising: Annotated[LinearRange | None, quantity("1")]
    """Range of flow in which the rising branch is straight, as shares of its largest flow."""
    u_knee_falling_V: Voltage | None
    """Knee on closing: the straight part of Q/sqrt(dP), extrapolated to zero flow."""
    u_knee_falling_se_V: StandardError
    u_onset_falling_V: Voltage | None
    """Onset on closing: the command of the last flow that the meter shows."""
    u_onset_falling_se_V: StandardError
    straight_falling: Annotated[LinearRange | None, quantity("1")]
    """Range of flow in which the falling branch is straight, as shares of its largest flow."""
    not_observable: Mapping[str, str]
    """Reason for each threshold that the meter can't show, by the threshold's key."""
    u_knee_se_V: Annotated[VoltageError, Meta(description="Larger standard error of the two knees.")] = field(
        init=False
    )
    u_guard_V: Voltage
    """Threshold that the certificate protects, on the guarded branch. It is the knee or, for a soft edge that still
    passes flow below the knee, the zero of the tail or the fall to the noise level."""
    u_guard_lower_V: Voltage
    """Lower confidence bound of u_guard_V."""
    slope_L_min_V: FlowGain
    """Slope of the straight part at the test's pressure drop."""
    q_max_L_min: Flow
    """Largest flow, scaled to the test's pressure drop."""
    saturates: bool
    """Whether the flow stops growing before full command because the spool reaches its stop."""
    leak_L_min: Flow
    """Leak: flow at zero command that grows with the pressure drop. The knees refer to the flow minus the leak, and the
    bounds allow for its end where the valve opens."""
    noise_level_L_min: Flow
    """Noise level: a flow below it counts as no flow. It is the largest of the meter's floor, the resolution of
    averages over the dead zone, and 0.5 % of the largest flow or the declared level."""
    zero_flow_L_min: Flow | None
    """Flow at zero command, leak included, that the bound allows if --zero-flow declared one. It is the declared flow,
    or the sum of leak and noise level if that is larger. Null: none was declared."""
    noise_L_min: Flow
    """Standard deviation of the flow noise."""
    noise_variance_inflation: Annotated[float, quantity("1", ge=0, le=1e6)]
    """Variance of a mean flow relative to that under white noise of the same size."""
    spool_ripple_V: VoltageError
    """Standard deviation of the spool around its mean motion by stick-slip, as a command."""
    outliers: Annotated[int, Meta(ge=0, le=10**12)]
    """Number of samples of the straight part that were excluded as outliers."""
    recorded: RecordedCurve
    """Recorded flow over command, reduced to few points."""
    ramps: Annotated[tuple[str, ...], Meta(min_length=1)]
    """Ramps that were pooled in this test."""
    left_out: tuple[LeftOut, ...] = ()
    """Parts of the recordings that were left out, in these ramps and before them."""
    conditions: RampConditions | UnsetType = UNSET
    """Recording conditions. Omitted if they were not kept."""

    def __post_init__(self) -> None:
        errors = [error for error in (self.u_knee_rising_se_V, self.u_knee_falling_se_V) if error is not None]
        if not errors:
            raise RuleError("a test has no knee, neither rising nor falling; expected at least one")
        object.__setattr__(self, "u_knee_se_V", max(errors))

    @property
    def closes_above_opening(self) -> bool:
        """Whether the knees stand in an order that no valve has: then the lag or the time is wrong, and so are they."""
        opens, closes = self.u_knee_rising_V, self.u_knee_falling_V
        least = max(ORDER_SIGNIFICANCE * self.u_knee_se_V, ORDER_LEAST_V)
        return opens is not None and closes is not None and closes - opens > least
