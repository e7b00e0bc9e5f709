"""The recorded characteristic: flow over command of each branch of a test, thinned, for valve.json.

It is what the recording shows, and nothing of the fits: commands averaged in bins, flow as the meter read it (its zero
error taken out, a leak left in, at the pressure drop of the bench, which sags), straight lines between few points.
Where the flow is below the test's noise level the recording shows nothing. There the curve is a straight line from the
first flow seen to the onset, or to the leak: a reader says "below the noise level" there, and not the line's value.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np
from msgspec import UNSET, Meta, UnsetType

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.valve.quantity_types import Flow, PressureDrop, SignedFlow, Voltage

#: Most points of a branch: beyond, the flow between two points may be off by more than `error_L_min` promises to be.
MOST_POINTS = 100
#: Most single samples of a branch that are kept beside its points.
MOST_SAMPLES = 24
#: Equal steps of the flow, from none to the largest, at whose ends the pressure drop is given.
SAG_STEPS = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedSamples:
    """Single samples of a branch, for a plot that shows how they scatter: none of them is an average."""

    u_V: Annotated[tuple[Voltage, ...], Meta(min_length=1, max_length=MOST_SAMPLES, extra_json_schema={"unit": "V"})]
    """Commands of the samples in ascending order. The branch is divided into equal steps; the sample nearest to each
    step is kept, whichever ramp it belongs to."""
    q_L_min: Annotated[tuple[SignedFlow, ...], quantity("L/min")]
    """Flow of each sample as read, corrected for the meter's lag and zero error; a leak is included."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedBranch:
    """One branch of a test: flow over command, linear between the points."""

    u_V: Annotated[tuple[Voltage, ...], Meta(min_length=2, max_length=MOST_POINTS + 4, extra_json_schema={"unit": "V"})]
    """Commands of the points in ascending order."""
    q_L_min: Annotated[tuple[Flow, ...], quantity("L/min")]
    """Flow at each point, at the actual pressure drop of the bench; a leak is included."""
    u_seen_V: Voltage
    """Command from which the flow exceeds the noise level. Below it the points lie on a straight line to the onset,
    which no reading confirms."""
    error_L_min: Flow
    """Largest deviation of the piecewise linear curve from the visible recorded flow, averaged over 0.5 % of full
    command."""
    samples: RecordedSamples | UnsetType = UNSET
    """Selection of single samples, not averaged. Omitted if none were kept."""

    def __post_init__(self) -> None:
        if len(self.u_V) != len(self.q_L_min):
            raise RuleError(f"{len(self.u_V)} commands stand beside {len(self.q_L_min)} flows, expected one each")
        if not all(left < right for left, right in pairwise(self.u_V)):
            raise RuleError("the commands of the recorded flow must rise")

    def flow_at(self, u_V: np.ndarray) -> np.ndarray:
        """Return the flow at commands, L/min; beyond the recorded ones that of the nearest."""
        flows: np.ndarray = np.interp(u_V, self.u_V, self.q_L_min)
        return flows

    def command_at(self, flow_L_min: float) -> float | None:
        """Return the lowest command at which the branch passes a flow, V; None where it never does."""
        u, q = np.array(self.u_V), np.array(self.q_L_min)
        reached = np.flatnonzero(q >= flow_L_min)
        if reached.size == 0:
            return None
        at = int(reached[0])
        if at == 0:
            return float(u[0])
        return float(np.interp(flow_L_min, q[at - 1 : at + 1], u[at - 1 : at + 1]))


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedCurve:
    """The recorded characteristic of one test; a branch that was not recorded is null."""

    rising: RecordedBranch | None
    """Opening branch."""
    falling: RecordedBranch | None
    """Closing branch."""
    dp_at_flow_MPa: Annotated[tuple[PressureDrop, ...] | None, quantity("MPa")]
    """Pressure drop of the bench at equally spaced flows from zero to the largest point. It shows how the supply sags.
    Null: no pressure drop was recorded."""

    def __post_init__(self) -> None:
        if self.rising is None and self.falling is None:
            raise RuleError("the recorded flow has neither a rising nor a falling branch, expected one at least")
        if self.dp_at_flow_MPa is not None and len(self.dp_at_flow_MPa) != SAG_STEPS + 1:
            raise RuleError(
                f"dp_at_flow_MPa has {len(self.dp_at_flow_MPa)} pressure drops, expected {SAG_STEPS + 1}: of no flow, "
                f"and of {SAG_STEPS} equal steps to the largest"
            )

    @property
    def branches(self) -> tuple[RecordedBranch, ...]:
        """The branches that were recorded, the rising one first."""
        return tuple(branch for branch in (self.rising, self.falling) if branch)

    @property
    def q_max_L_min(self) -> float:
        """Largest flow of the points."""
        return max(max(branch.q_L_min) for branch in self.branches)

    @property
    def opening(self) -> RecordedBranch:
        """The rising branch, or the falling one where there is no other."""
        return self.branches[0]

    @property
    def closing(self) -> RecordedBranch:
        """The falling branch, or the rising one where there is no other."""
        return self.branches[-1]
