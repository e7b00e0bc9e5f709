"""`TestResult`: what one ramp test shows, an entry of ``tests`` in valve.json."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from msgspec import UNSET, Meta, UnsetType

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.valve.left_out import LeftOut
from dzdesign.identify.valve.quantity_types import Flow, FlowGain, PressureDrop, Ratio, Voltage, VoltageError
from dzdesign.identify.valve.ramp_conditions import RampConditions
from dzdesign.identify.valve.recorded_curve import RecordedCurve

#: Standard errors by which closing must lie above opening to be no noise; and V, for a simulation has next to none.
ORDER_SIGNIFICANCE, ORDER_LEAST_V = 5.0, 1e-3
#: Of a branch: the thresholds, each with its standard error.
THRESHOLDS = ("knee", "level", "onset")
BRANCHES = ("rising", "falling")

StandardError = Annotated[VoltageError | None, Meta(description="Its standard error.")]
LinearRange = tuple[Ratio, Ratio]


@dataclass(frozen=True, slots=True, kw_only=True)
class TestResult:
    """One pressure drop: all ramps within 2 % of it. A threshold is null where its branch was not recorded."""

    __test__ = False  # not a test case, whatever its name

    source: Annotated[str, Meta(description="Recording, or the first of several.")]
    dp_MPa: Annotated[
        PressureDrop | None, Meta(description="Pressure drop at no flow; null where none was recorded or declared.")
    ]
    dp_from: Annotated[
        str | None,
        Meta(
            description="Columns of the recordings that make it, such as pP_MPa - pA_MPa; 'declared' by --dp or [dp]; "
            "null where it is unknown."
        ),
    ]
    u_knee_rising_V: Annotated[
        Voltage | None, Meta(description="Knee on opening: the straight part of Q/sqrt(dP), extrapolated to zero.")
    ]
    u_knee_rising_se_V: StandardError
    u_level_rising_V: Annotated[
        Voltage | None,
        Meta(description="Level on opening: command at which the flow passes what counts as flow."),
    ]
    u_level_rising_se_V: StandardError
    u_onset_rising_V: Annotated[
        Voltage | None,
        Meta(
            description="Onset on opening, as far as the meter shows it: the first flow that stands out of its noise, "
            "or the tail extrapolated to zero, whichever is lower."
        ),
    ]
    u_onset_rising_se_V: StandardError
    straight_rising: Annotated[
        LinearRange | None,
        quantity("1", "Flows between which the rising branch was found straight, as shares of its largest."),
    ]
    u_knee_falling_V: Annotated[Voltage | None, Meta(description="Knee on closing.")]
    u_knee_falling_se_V: StandardError
    u_level_falling_V: Annotated[Voltage | None, Meta(description="Level on closing.")]
    u_level_falling_se_V: StandardError
    u_onset_falling_V: Annotated[Voltage | None, Meta(description="Onset on closing: the last flow.")]
    u_onset_falling_se_V: StandardError
    straight_falling: Annotated[
        LinearRange | None,
        quantity("1", "Flows between which the falling branch was found straight, as shares of its largest."),
    ]
    not_observable: Annotated[
        Mapping[str, str], Meta(description="Key of a threshold that the meter can't show, and why.")
    ]
    u_knee_se_V: Annotated[VoltageError, Meta(description="The larger of the knees' standard errors.")] = field(
        init=False
    )
    u_guard_V: Annotated[
        Voltage,
        Meta(
            description="Threshold that the certificate protects: on the guarded branch the knee, or below it what a "
            "soft edge still passes, the tail's zero or where the flow falls to the noise level."
        ),
    ]
    u_guard_lower_V: Annotated[Voltage, Meta(description="Its lower confidence bound.")]
    slope_L_min_V: Annotated[FlowGain, Meta(description="Slope of the straight part, at the test's pressure drop.")]
    q_max_L_min: Annotated[Flow, Meta(description="Largest flow, brought to the test's pressure drop.")]
    saturates: Annotated[
        bool, Meta(description="Whether the flow stops growing before full command: the spool is at its stop.")
    ]
    leak_L_min: Annotated[
        Flow,
        Meta(
            description="Flow at zero command that grows with the pressure drop: a leak. The knees are those of the "
            "flow beyond it, the bounds allow for its end where the valve opens."
        ),
    ]
    noise_level_L_min: Annotated[
        Flow,
        Meta(
            description="Flow below which there is none: the largest of the meter's floor, what averages over the dead "
            "zone resolve, and 0.5 % of the largest flow or what was declared."
        ),
    ]
    zero_flow_L_min: Annotated[
        Flow | None,
        Meta(
            description="Flow at zero command, a leak included, that the bound answers for where one was declared by "
            "--zero-flow: the declared one, or leak and noise level where they are more. Null: none was declared."
        ),
    ]
    noise_L_min: Annotated[Flow, Meta(description="Standard deviation of the flow's noise.")]
    noise_variance_inflation: Annotated[
        float,
        quantity("1", "Variance of a mean of the flow over that under white noise of the same size.", ge=0, le=1e6),
    ]
    spool_ripple_V: Annotated[
        VoltageError,
        Meta(description="Standard deviation of the spool about its mean course, as a command: stick and slip."),
    ]
    outliers: Annotated[int, Meta(description="Samples of the straight part that were left out.", ge=0, le=10**12)]
    recorded: Annotated[RecordedCurve, Meta(description="Flow over command as recorded, thinned to few points.")]
    ramps: Annotated[tuple[str, ...], Meta(description="The ramps that were pooled.", min_length=1)]
    left_out: Annotated[
        tuple[LeftOut, ...], Meta(description="What of the recordings was left out: in these ramps, and before them.")
    ] = ()
    conditions: Annotated[
        RampConditions | UnsetType, Meta(description="How it was recorded. Left out where nobody wrote it down.")
    ] = UNSET

    def __post_init__(self) -> None:
        for branch in BRANCHES:
            keys = [f"u_{name}_{branch}_{unit}" for name in THRESHOLDS for unit in ("V", "se_V")]
            known = {getattr(self, key) is not None for key in (*keys, f"straight_{branch}")}
            if len(known) > 1:
                raise RuleError(f"'{self.source}' has some thresholds of its {branch} branch and lacks others")
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
