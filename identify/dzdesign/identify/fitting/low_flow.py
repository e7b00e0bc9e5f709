"""What flows that were measured by hand say of the guarded thresholds, which the meter shows from its floor on only.

Flow grows with the command. So where a reading shows flow at a command below a threshold, the edge opens below that
command: the threshold is lowered to the highest command below it that a reading shows none at, and so are those of all
tests, for one edge has made them. And where a reading shows at most so much at the threshold or above it, no more flows
at any bound, which lies below the threshold by all that the next closing may differ; unless another reading shows more
at a lower command. That counts only beside a reading that the ramps confirm: below the meter's floor they contradict
nothing, neither a wrong unit nor readings of another valve.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import L_MIN, MPA, Shown
from dzdesign.identify.fitting.guarded_thresholds import GuardedThreshold, Guarding
from dzdesign.identify.fitting.zero_flow import allowed_at_zero
from dzdesign.identify.knees.between_ramps import DECIMALS
from dzdesign.identify.knees.described_tests import DescribedTests
from dzdesign.identify.knees.gated_line import BranchShape
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.guard_curve import CertifiedCurve, Guard
from dzdesign.identify.valve.low_flow import IN_WORDS, SAME_PRESSURE, Branch, LowFlow

#: The branch of each guard that a branch has.
BRANCH_OF: dict[Guard, Branch] = {"closing": "falling", "opening": "rising"}
COLUMN_OF = {"rising": 0, "falling": 1}
#: A threshold that was lowered to the command of a reading is that command, but for rounding.
ROUNDING_V = 1e-6
#: Of a ramp's flow, what it may differ from a reading at rest by beside the threshold's own error: its meter's span.
OF_FLOW = 0.1
#: Of a reading's flow, its largest error where the ramps are to confirm it.
CONFIRMS = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Unseen:
    """The flow at a guard's bounds below which nothing is known, L/min; where no reading tells, and why."""

    below_L_min: float
    #: The tests that no reading tells of.
    missing: tuple[int, ...] = ()
    #: Whether no reading lies where the ramps could confirm it.
    unconfirmed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Lowered:
    """By how much the thresholds of a guard were lowered, V, and the reading that asked for most of it."""

    depth: float
    by: LowFlow


def with_low_flow(
    guarding: Guarding, group: DescribedTests, rows: Sequence[LowFlow], options: IdentifyOptions
) -> tuple[Guarding, dict[Guard, Lowered]]:
    """Return thresholds that agree with the readings, and which of them were lowered for that.

    Raises
    ------
    InputError
        If a reading is of no tested pressure drop, or contradicts the ramps, or shows flow below a threshold and no
        other shows a command at which there is none.
    """
    if not rows:
        return guarding, {}
    dp = _tested(group, rows)
    for row in rows:
        _refuse_another_valve(row, dp, guarding, group)
    none = what_counts_as_none(group, options)
    depths: dict[Guard, Lowered] = {}
    for guard, branch in BRANCH_OF.items():
        if guard in guarding.thresholds:
            found = [_lowered(row, rows, branch, guarding.thresholds[guard], dp, none) for row in rows]
            if lowered := max(filter(None, found), key=lambda each: each.depth, default=None):
                depths[guard] = lowered
    taken_off: dict[Guard, float] = {guard: each.depth for guard, each in depths.items()}
    if "mean" in guarding.thresholds:
        taken_off["mean"] = sum(taken_off.get(guard, 0.0) for guard in BRANCH_OF) / 2
    thresholds = {
        name: _shifted(threshold, taken_off.get(name, 0.0)) for name, threshold in guarding.thresholds.items()
    }
    return replace(guarding, thresholds=thresholds), depths


def what_counts_as_none(group: DescribedTests, options: IdentifyOptions) -> np.ndarray:
    """Return the flow above which a reading shows that the edge is open, at each test, L/min (T,).

    The flow that is allowed at zero, or what was declared as noise level, which the readings may resolve where the
    meter does not; else the meter's noise level. A leak may flow beside the latter two.
    """
    allowed = allowed_at_zero(group, options)
    level = group.noise_level if options.noise_level is None else options.noise_level
    return np.array(allowed or [level + leak for leak in group.leak]) / L_MIN


def _tested(group: DescribedTests, rows: Sequence[LowFlow]) -> np.ndarray:
    """Return the tested pressure drops, MPa; refuse readings where none is known, or at another one."""
    if group.tests[0].dp is None:
        raise InputError(f"{rows[0].source}: the ramp tests have no pressure drop to compare with; declare it by --dp")
    dp = np.array([(item.dp or 0.0) / MPA for item in group.tests])
    for row in rows:
        if not dp[0] * (1 - SAME_PRESSURE) <= row.dp_MPa <= dp[-1] * (1 + SAME_PRESSURE):
            expected = "{high:.3g MPa}" if dp[0] == dp[-1] else "{low:.3g #MPa} to {high:.3g MPa}"
            raise InputError(
                worded(
                    "{source}: the pressure drop is {at:.3g MPa}, expected " + expected + " as in the ramp tests; "
                    "measure the flow there, or record a ramp at this pressure drop",
                    source=row.source, at=row.dp_MPa, low=dp[0], high=dp[-1],
                )
            )  # fmt: skip
    return dp


def _refuse_another_valve(row: LowFlow, dp: np.ndarray, guarding: Guarding, group: DescribedTests) -> None:
    """Refuse a reading that a ramp at its pressure drop contradicts: a wrong unit, or another valve."""
    for test, item in enumerate(group.tests):
        shape = item.shapes[COLUMN_OF[row.branch]]
        if shape is None or not row.is_at(float(dp[test])):
            continue
        apart = max(_apart(each, test) for each in guarding.thresholds.values())
        low, high = (_seen(shape, row.u_V + shift, group.leak[test]) for shift in (-apart, apart))
        # Below the level a ramp tells no more than that; above it, it tells the flow.
        level = (group.noise_level + group.leak[test]) / L_MIN
        least = (1 - OF_FLOW) * low if low > level else 0.0
        most = max((1 + OF_FLOW) * high, level)
        if row.at_most_L_min < least or row.at_least_L_min > most:
            raise InputError(
                f"{row.source} has {Shown(row.q_L_min):.3g L/min} at {Shown(row.u_V):.4g V} and "
                f"{Shown(row.dp_MPa):.3g MPa}, but the ramps allow {Shown(least):.3g #L/min} to "
                f"{Shown(most):.3g L/min} there; check the units and the branch, and whether it was taken at this "
                "valve"
            )  # fmt: skip


def _apart(threshold: GuardedThreshold, test: int) -> float:
    """Return how far a threshold stands above its bound at a test, V: by so much the next closing may differ."""
    return float((threshold.threshold.value - threshold.threshold.bound)[test])


def _seen(shape: BranchShape, u: float, leak: float) -> float:
    """Return the flow that a branch shows at a command, L/min, its leak included."""
    return (float(np.interp(u, *shape.prepared.recorded)) + leak) / L_MIN


def _lowered(
    row: LowFlow,
    rows: Sequence[LowFlow],
    branch: Branch,
    guarded: GuardedThreshold,
    dp: np.ndarray,
    none: np.ndarray,
) -> Lowered | None:
    """Return by how much a reading lowers a branch's thresholds; None where it agrees with them.

    Raises
    ------
    InputError
        If no reading below it shows that there is none.
    """

    def threshold_at(dp_MPa: float) -> float:
        return _continued(dp_MPa, dp, guarded.threshold.value)

    threshold, least = threshold_at(row.dp_MPa), float(np.interp(row.dp_MPa, dp, none))
    if not row.shows_flow_on(branch) or row.u_V > threshold or row.at_least_L_min <= least:
        return None
    # Each counts from the threshold at its own pressure drop: at a higher one the edge may open earlier.
    depths = [
        threshold_at(other.dp_MPa) - other.u_V
        for other in rows
        if other.shows_none_on(branch) and other.is_at(row.dp_MPa) and other.u_V < row.u_V
        and other.at_most_at(row.dp_MPa) <= least
    ]  # fmt: skip
    if not depths:
        raise InputError(_open_below(row, branch, threshold, least))
    return Lowered(depth=min(depths), by=row)


def _open_below(row: LowFlow, branch: Branch, threshold: float, least: float) -> str:
    return (
        f"{row.source} shows at least {Shown(row.at_least_L_min):.3g L/min} at {Shown(row.u_V):.4g V} and "
        f"{Shown(row.dp_MPa):.3g MPa}. This command lies below the threshold on {IN_WORDS[branch]} from the ramps, "
        f"{Shown(threshold):.4g V}, and a flow of up to {Shown(least):.3g L/min} counts as no flow; add a reading of "
        f"{IN_WORDS[branch]} at a lower command with no more flow, or declare the allowed flow by --zero-flow"
    )  # fmt: skip


def _shifted(guarded: GuardedThreshold, depth: float) -> GuardedThreshold:
    if not depth:
        return guarded
    threshold, ramps = guarded.threshold, guarded.ramps
    lower = replace(threshold, value=threshold.value - depth, bound=threshold.bound - depth)
    return replace(guarded, threshold=lower, ramps=replace(ramps, y=np.round(ramps.y - depth, DECIMALS)))


def unseen_of_curve(rows: Sequence[LowFlow], guard: Guard, curve: CertifiedCurve, level_L_min: float) -> Unseen:
    """Return the flow at a guard's bounds below which nothing is known.

    It is the meter's level unless a reading at every test, at its threshold or above, shows that no more flows there,
    one of which the ramps confirm in their own range; and no other reading shows more at a lower command.
    """
    branch = BRANCH_OF.get(guard)
    if branch is None or not rows:
        return Unseen(below_L_min=level_L_min, missing=tuple(range(len(curve.dp_MPa))) if rows else ())
    confirmed = any(_confirms(row, branch, curve, level_L_min) for row in rows)
    nodes, thresholds = np.array(curve.dp_MPa), np.array(curve.u_threshold_V)
    found, missing = [], []
    for test, (dp, threshold) in enumerate(zip(curve.dp_MPa, curve.u_threshold_V, strict=False)):
        told = [
            flow
            for row in rows
            if (flow := _at_most(row, rows, branch, dp)) < level_L_min  # the meter tells as much
            and confirmed and row.shows_none_on(branch) and row.is_at(dp)
            and row.u_V >= max(threshold, _continued(row.dp_MPa, nodes, thresholds)) - ROUNDING_V
        ]  # fmt: skip
        if told:
            found.append(min(told))
        else:
            missing.append(test)
    least = level_L_min if missing or not found else max(found)
    more = [
        row.at_most_L_min
        for row in rows
        if row.shows_flow_on(branch) and row.at_least_L_min > least
        and row.u_V <= _continued(row.dp_MPa, nodes, thresholds)
    ]  # fmt: skip
    return Unseen(
        below_L_min=min(level_L_min, max([least, *more])),
        missing=tuple(missing),
        unconfirmed=not confirmed,
    )


def _confirms(row: LowFlow, branch: Branch, curve: CertifiedCurve, level_L_min: float) -> bool:
    """Tell whether the ramps show the flow of a reading, which they did not contradict."""
    return (
        row.branch == branch
        and any(row.is_at(dp) for dp in curve.dp_MPa)
        and row.at_least_L_min > level_L_min
        and row.q_error_L_min <= CONFIRMS * row.q_L_min
    )


def _at_most(row: LowFlow, rows: Sequence[LowFlow], branch: Branch, dp_MPa: float) -> float:
    """Return the most that flows at a reading's command at a test, L/min: where another shows more earlier, as much."""
    most = row.at_most_at(dp_MPa)
    more = [
        other.at_most_at(dp_MPa)
        for other in rows
        if other.shows_flow_on(branch) and other.is_at(dp_MPa) and other.u_V <= row.u_V and other.at_least_L_min > most
    ]
    return max([most, *more])


def _continued(dp_MPa: float, nodes: np.ndarray, values: np.ndarray) -> float:
    """Return the straight line between nodes, continued beyond the ends."""
    if nodes.size < 2:
        return float(values[0])
    upper = int(np.clip(np.searchsorted(nodes, dp_MPa), 1, nodes.size - 1))
    share = (dp_MPa - nodes[upper - 1]) / (nodes[upper] - nodes[upper - 1])
    return float(values[upper - 1] + share * (values[upper] - values[upper - 1]))
