"""The flow curves of an assessment, thinned for assessment.json: what a report draws of each set of recordings."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np
from msgspec import Meta

from dzdesign.assess.flow_curves import FlowCurve, PressureCurves
from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.knees.curve_thinning import TOLERANCE, decimals_of, evenly_spaced, fewest_points
from dzdesign.identify.valve.ramp_result import RampConditions

#: Largest command in percent of full command, and largest flow, that a file may state.
LARGEST_PERCENT, LARGEST_FLOW = 1e4, 1e6
#: Most points of a line, and most samples beside it.
MOST_POINTS, MOST_SAMPLES = 104, 24

Percents = tuple[Annotated[float, Meta(ge=-LARGEST_PERCENT, le=LARGEST_PERCENT)], ...]
Flows = tuple[Annotated[float, Meta(ge=-LARGEST_FLOW, le=LARGEST_FLOW)], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredBranch:
    """One branch: flow over command, linear between the points, and a few of its samples.

    On the negative side commands and flows count from zero down, as in valve.json.
    """

    command_percent: Annotated[Percents, quantity("%")]
    """Commands of the points in ascending order, as a percentage of full command."""
    q_L_min: Annotated[Flows, quantity("L/min")]
    """Flow at each point, scaled to the pressure drop at zero flow."""
    sample_command_percent: Annotated[Percents, quantity("%")]
    """Commands of single samples. The branch is divided into equal steps; the sample nearest to each step is kept."""
    sample_q_L_min: Annotated[Flows, quantity("L/min")]
    """Flow of each single sample, scaled to the same pressure drop."""

    def __post_init__(self) -> None:
        for commands, flows in (
            (self.command_percent, self.q_L_min), (self.sample_command_percent, self.sample_q_L_min)
        ):  # fmt: skip
            if len(commands) != len(flows):
                raise RuleError(f"{len(commands)} commands stand beside {len(flows)} flows, expected one each")
        if not all(left < right for left, right in pairwise(self.command_percent)):
            raise RuleError("the commands of a measured curve must rise")


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredCurve:
    """The curve of one set at one pressure drop; a branch that was not recorded is null."""

    rising: Annotated[MeasuredBranch | None, Meta(description="Opening branch.")]
    falling: Annotated[MeasuredBranch | None, Meta(description="Closing branch.")]
    conditions: Annotated[RampConditions, Meta(description="Conditions under which the ramps were recorded.")]

    @property
    def branches(self) -> tuple[MeasuredBranch, ...]:
        """The branches that were recorded, the rising one first."""
        return tuple(branch for branch in (self.rising, self.falling) if branch)


def measured_curve(curves: PressureCurves, u_max: float) -> MeasuredCurve:
    """Return the curve of one set at one pressure drop, thinned to at most `MOST_POINTS` points a branch.

    Full command `u_max` in V.
    """
    rising, falling = (
        None if curve is None else _branch(curve, u_max, TOLERANCE * curves.y_max)
        for curve in (curves.rising, curves.falling)
    )
    return MeasuredCurve(rising=rising, falling=falling, conditions=curves.conditions)


def _branch(curve: FlowCurve, u_max: float, tolerance: float) -> MeasuredBranch:
    u, q = curve.read.profile
    at, flows = fewest_points(u, q, np.full(q.size, tolerance))
    kept = evenly_spaced(curve.read.branch.u, MOST_SAMPLES)
    decimals = decimals_of(curve.read.y_max / L_MIN)
    # Of two points that round to one command the later one stands for both.
    line = dict(zip(_rounded(100 * u[at] / u_max, 3), _rounded(flows / L_MIN, decimals), strict=True))
    return MeasuredBranch(
        command_percent=tuple(line),
        q_L_min=tuple(line.values()),
        sample_command_percent=_rounded(100 * curve.read.branch.u[kept] / u_max, 3),
        sample_q_L_min=_rounded(curve.read.y[kept] / L_MIN, decimals),
    )


def _rounded(values: np.ndarray, decimals: int) -> tuple[float, ...]:
    return tuple(round(value, decimals) + 0.0 for value in values.tolist())
