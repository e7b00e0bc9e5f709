"""Results of the closed loop as the evidence has them: to digits that mean something.

The last digits of a flow depend on the processor, by whose instructions the linear algebra adds up: 1e-14 L/min from
one to another. Evidence is compared by its hash, so these digits must not be in it.
"""

from dataclasses import replace
from math import ceil
from typing import TypeVar

from dzdesign.core.artefact_reading import rounded
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN
from dzdesign.verify.current.results import ValveAtCorners
from dzdesign.verify.loop_results import PlantComparison, PressureResult, ScenarioResult

#: Of a flow in L/min, a share, a time in s: a hundred thousand times more than the kernels differ by.
DECIMALS = 9
STEP = 10.0**-DECIMALS
#: Of a step: so little above one, as a rounding of doubles, is no reason for the next.
TOLERANCE = 1e-3

Judged = TypeVar("Judged", PressureResult, ScenarioResult, ValveAtCorners)


def stored(result: Judged) -> Judged:
    """Return a result with its digits cut; whether the flow at zero command is allowed stays as it was."""
    found = rounded(result, DECIMALS)
    flows = result.q_beyond_L_min > NO_FLOW_L_MIN
    if flows == (found.q_beyond_L_min > NO_FLOW_L_MIN):
        return found
    allowed = max(found.leak_L_min, found.allowed_at_zero_L_min or 0.0)
    return replace(found, q_zero_L_min=round(allowed + 2 * STEP, DECIMALS) if flows else allowed)


def stored_comparison(result: PlantComparison) -> PlantComparison:
    """Return a comparison with its digits cut; a difference is rounded up, as it is an upper limit."""
    return replace(
        rounded(result, DECIMALS),
        position_difference=_up(result.position_difference),
        flow_difference=_up(result.flow_difference),
    )


def _up(difference: float) -> float:
    return round(max(ceil(difference / STEP - TOLERANCE), difference > 0) * STEP, DECIMALS)
