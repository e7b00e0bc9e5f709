"""Whether a test's recorded characteristic is that of its thresholds: both were found in the same readings.

The closed loop of `verify` takes the recorded curve as the valve, and judges by it the law that was made from the
thresholds. A file in which one of them was changed would have the loop judge another valve.
"""

import numpy as np

from dzdesign.core.artefact_types import RuleError
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.recorded_curve import SAG_STEPS, RecordedBranch
from dzdesign.identify.valve.side_model import SideModel

#: A knee and the recorded curve's own are one up to this share of full command: five times what was seen between the
#: two on 1 470 branches, benches' and simulated ones, staircases and leaking valves among them. And up to so many
#: standard errors of the knee more, and what the few points miss of the recording.
KNEE_TOLERANCE, KNEE_ERRORS = 0.01, 5.0
#: Slopes are one up to this share; seen were 0.024, of a staircase of few levels.
SLOPE_TOLERANCE = 0.1
#: The flow at the first command at which it is seen, beyond the leak: the noise level up to this share of it, and up to
#: this one of the largest flow, beside what the few points miss.
SEEN_OF_LEVEL, SEEN_OF_LARGEST = 0.5, 0.005
#: Points along a branch at which its straight part is looked for, and how few of them tell it.
STEPS, FEWEST_STEPS = 400, 3
#: Which branch shows what the valve does.
IDENTIFIED_ON = {"rising": "opening", "falling": "closing"}


def check_recorded(side: SideModel, u_max_V: float) -> None:
    """Check that each recorded branch begins where the test's onset and knee say, and is as steep in its straight part.

    Raises
    ------
    RuleError
        If one contradicts its test.
    """
    for row, test in enumerate(side.tests):
        if not test.slope_L_min_V > 0:
            raise RuleError(f"the slope of '{test.source}' is {test.slope_L_min_V:g} L/min/V, expected more than zero")
        slopes = []
        for name, action in IDENTIFIED_ON.items():
            branch: RecordedBranch | None = getattr(test.recorded, name)
            knee_V: float | None = getattr(test, f"u_knee_{name}_V")
            if (branch is None) != (knee_V is None):
                has, lacks = ("a knee", "recorded curve") if branch is None else ("a recorded curve", "knee")
                raise RuleError(f"'{test.source}' has {has} of its {name} branch, and no {lacks}")
            if branch is None or knee_V is None:
                continue
            # Where the premise moved the test's knee, the identified threshold is the one that its readings show.
            knees = [knee_V, *([side.identified[action].u_V[row]] if action in side.identified else [])]
            slopes += _check_branch(test, branch, name, knees, u_max_V)
        if slopes and abs(float(np.mean(slopes)) / test.slope_L_min_V - 1) > SLOPE_TOLERANCE:
            raise RuleError(
                f"the slope of '{test.source}' is {test.slope_L_min_V:g} L/min/V, but its recorded flow rises by "
                f"{np.mean(slopes):.4g} L/min/V, expected within {100 * SLOPE_TOLERANCE:g} %"
            )


def _check_branch(
    test: TestResult, branch: RecordedBranch, name: str, knees_V: list[float], u_max_V: float
) -> list[float]:
    """Check where a branch begins, and where its straight part runs to zero; return its slope, if it can be told."""
    knee_se_V, onset_V = getattr(test, f"u_knee_{name}_se_V"), getattr(test, f"u_onset_{name}_V")
    allowed_V = KNEE_TOLERANCE * u_max_V + KNEE_ERRORS * knee_se_V + branch.error_L_min / test.slope_L_min_V
    _check_begin(test, branch, name, [min(onset_V, knee) for knee in knees_V], allowed_V)
    line = _straight_part(test, branch, name)
    if line is None:
        return []
    slope, *zeros_V = line
    # Of an own slope, or of the test's, which is the mean of both branches'.
    if min(abs(zero - knee) for zero in zeros_V for knee in knees_V) > allowed_V:
        raise RuleError(
            f"the {name} branch of '{test.source}' has its knee at {knees_V[0]:g} V, but its recorded flow runs "
            f"straight to zero at {zeros_V[0]:.4g} V, expected within {allowed_V:.2g} V"
        )
    return [slope]


def _check_begin(test: TestResult, branch: RecordedBranch, name: str, begins_V: list[float], allowed_V: float) -> None:
    """Check the points about the first flow: none up to the onset, or the knee below it; the noise level where seen."""
    first, u_seen = branch.u_V[0], branch.u_seen_V
    if u_seen <= first:
        return
    # The second point, unless it is that of the first flow seen itself.
    stands = min(branch.u_V[1], u_seen)
    if min(abs(stands - min(max(begin, first), u_seen)) for begin in begins_V) > allowed_V:
        raise RuleError(
            f"the flow of the {name} branch of '{test.source}' begins at {begins_V[0]:g} V, but that of its recorded "
            f"curve at {stands:g} V, expected within {allowed_V:.2g} V"
        )
    level = test.leak_L_min + test.noise_level_L_min
    allowed = SEEN_OF_LEVEL * test.noise_level_L_min + SEEN_OF_LARGEST * test.recorded.q_max_L_min + branch.error_L_min
    seen = float(branch.flow_at(np.array(u_seen)))
    if abs(seen - level) > allowed:
        raise RuleError(
            f"the recorded flow of the {name} branch of '{test.source}' is {seen:.3g} L/min at u_seen_V, expected "
            f"leak and noise level, {level:.3g} L/min, within {allowed:.2g} L/min"
        )


def _straight_part(test: TestResult, branch: RecordedBranch, name: str) -> tuple[float, float, float] | None:
    """Return slope (L/min/V) and zero (V) of a line through the straight part, and the zero with the test's slope.

    The flow is beyond the leak, and brought to the test's pressure drop by Eq. (1). None where the whole part lies
    between two steps; a curve that does not reach it is refused.
    """
    curve = test.recorded
    u = np.linspace(max(branch.u_seen_V, branch.u_V[0]), branch.u_V[-1], STEPS)
    q = branch.flow_at(u)
    beyond = q - test.leak_L_min
    if curve.dp_at_flow_MPa is not None and test.dp_MPa is not None and curve.q_max_L_min > 0:
        sagged = np.interp(q / curve.q_max_L_min, np.linspace(0, 1, SAG_STEPS + 1), curve.dp_at_flow_MPa)
        beyond = beyond * np.sqrt(test.dp_MPa / sagged)
    low, high = (share * test.q_max_L_min for share in getattr(test, f"straight_{name}"))
    if beyond.max() < low:
        raise RuleError(
            f"the recorded flow of the {name} branch of '{test.source}' comes to {beyond.max():.3g} L/min, expected "
            f"its straight part there, from {low:.3g} to {high:.3g} L/min"
        )
    inside = (beyond >= low) & (beyond <= high)
    if inside.sum() < FEWEST_STEPS or u[-1] == u[0]:
        return None
    u, beyond = u[inside], beyond[inside]
    middle, flow = float(u.mean()), float(beyond.mean())
    slope = float((u - middle) @ (beyond - flow) / ((u - middle) @ (u - middle)))
    at_slope = middle - flow / test.slope_L_min_V
    return slope, middle - flow / slope if slope > 0 else at_slope, at_slope
