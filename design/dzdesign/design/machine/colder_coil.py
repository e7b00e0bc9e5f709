"""Effect of a coil colder than the bench's on a design without a declared machine."""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.design.law_corners import corners_of
from dzdesign.design.machine.machine import COPPER_PER_K, REFERENCE_C
from dzdesign.design.signals import SIDE_NAMES

#: By how much colder, K, than a bench's coil at `REFERENCE_C`.
COLDER_K = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class ColderCoil:
    """At the tested pressure drop at which most would flow at zero command, the duty going straight to the coil."""

    dp_MPa: float
    #: By how much the guarded threshold falls.
    lowered_V: float
    #: Flow at zero command by the recorded characteristic, on closing where that was recorded.
    flow_L_min: float
    #: Whether the recording shows that flow, or it lies below the noise level.
    seen: bool


def colder_coil(compensator: Compensator, sign: int) -> ColderCoil:
    """Return what a coil 40 K colder than on the bench does at zero command, at the worst tested pressure drop."""
    factor = float(1 - COPPER_PER_K * COLDER_K)
    side, u_max_V = compensator.valve.sides[SIDE_NAMES[sign]], float(compensator.u_max_V)
    thresholds = side.certified[compensator.side(sign).certificate.guard].u_threshold_V
    found = []
    for test, threshold_V in zip(side.tests, thresholds, strict=True):
        dp_code = round(compensator.signals.dp_code(Fraction(repr(test.dp_MPa))))
        # The coil has the current that the bench's coil had at a command higher by the ratio of the resistances.
        reached_V = corners_of(compensator, dp_code, sign).offset * u_max_V / factor
        branch = test.recorded.closing
        found.append(
            ColderCoil(
                dp_MPa=test.dp_MPa or 0.0,
                lowered_V=(1 - factor) * threshold_V,
                flow_L_min=float(branch.flow_at(np.array([reached_V]))[0]),
                seen=reached_V >= branch.u_seen_V,
            )
        )
    return max(found, key=lambda each: each.flow_L_min)


def colder_coil_in_words(compensator: Compensator, sign: int) -> str:
    """Return it as a line for a person."""
    found, units = colder_coil(compensator, sign), compensator.valve.recorded_units.of_side(SIDE_NAMES[sign])
    lowered = units.text(1e3 * found.lowered_V, ".0f mV")
    flow = units.text(found.flow_L_min, ".2f L/min") if found.seen else "less than the recordings show"
    return (
        "the certificate covers only the valve as recorded: no machine is declared. Without current control, a coil at "
        f"{REFERENCE_C - COLDER_K} degC instead of {REFERENCE_C} degC lowers the threshold by {lowered}. At zero "
        f"command the valve then passes {flow} at {units.text(found.dp_MPa, '.2f MPa')}. Declare one of: "
        "--coil-temperature with --supply; --amplifier; --drive current"
    )
