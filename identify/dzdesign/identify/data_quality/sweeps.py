"""What is weak in the sweeps themselves: a branch that is missing, short or full of spikes, and knees known badly.

The errors of `GatedLine` count whatever departs from the line, and rightly so; but slower ramps help against noise
only. One valve has made all branches, so a bend departs from the line in the same way in each of them; noise, fast or
slow, does not. What the branches' departures have in common is the valve's, the rest the meter's.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.knees.described_tests import DescribedTest
from dzdesign.identify.knees.gated_line import BranchShape
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.side_model import SideModel

#: A command that stays below this share of u_max is not full.
FULL_COMMAND = 0.97
#: Share of the largest flow by which the flow at full command may lie below it, and noises of one sample.
FLOW_FALLS, FALL_SIGNIFICANCE = 0.05, 3.0
#: Share of the largest flow that is missing where the straight part would reach it: above this a valve is curved.
CURVED = 0.05
#: Share of the samples of the straight part that are left out as outliers, above which it is said.
MANY_OUTLIERS = 0.02
#: Standard error of a knee, over u_max, above which it decides what the compensator gives up.
NOISY = 2.5e-3
#: A bend is to blame where the noise alone would leave less than this share of the error.
BLAME = 0.5
#: Parts of the straight part, in the order of the command, in which departures from the line are averaged; fewest.
PARTS, FEWEST_PARTS = 8, 4


def about_sweeps(side: SideModel, tests: tuple[DescribedTest, ...], u_max: float) -> Iterator[Warning_]:
    """Yield the warnings about the sweeps of one side."""
    for test, item in zip(side.tests, tests, strict=True):
        yield from _about_branches(test)
        yield from _about_holes(test, item, side.certificate.guard)
        yield from _about_the_command(test, item, side.certificate.guard, u_max)
        yield from _about_the_flow(test, item)
    if not any(test.saturates for test in side.tests):
        unseen = any(shape.prepared.unseen_top for item in tests for shape in item.branches)
        case = "unseen" if unseen else "seen"
        yield warn("no-saturation", None, case, k_x_max_over_u_max=side.k_x_max_over_u_max)


def _about_branches(test: TestResult) -> Iterator[Warning_]:
    rising, falling = test.u_knee_rising_V, test.u_knee_falling_V
    if falling is None:
        yield warn("one-branch", test.source, "rising-only")
    if rising is None:
        yield warn("one-branch", test.source, "falling-only")
    if test.closes_above_opening:
        yield warn("branch-order", test.source, closes=falling, opens=rising)


def _about_holes(test: TestResult, item: DescribedTest, guard: str) -> Iterator[Warning_]:
    for way, shape in zip(("opening", "closing"), item.shapes, strict=True):
        if shape is None or not shape.tail.hole:
            continue
        low, high = shape.tail.hole
        lowered = ", so the {guard} threshold's bound is lowered below {low_V:.3f V}" if way == guard else ""
        bound = worded(lowered, guard=guard, low_V=low)
        yield warn("gap", test.source, way=way, low_V=low, high_V=high, bound=bound)


def _about_the_command(test: TestResult, item: DescribedTest, guard: str, u_max: float) -> Iterator[Warning_]:
    top = max(float(item.test.u.max()), item.test.unseen[1])
    if top < FULL_COMMAND * u_max:
        yield warn("not-full-command", test.source, top_V=top, u_max_V=u_max)
    lowest = float(item.branch(1 if guard == "closing" else 0).prepared.branch.u.min())
    if lowest > test.u_guard_V:
        yield warn("edge-not-swept", test.source, lowest_V=lowest, guard=guard, threshold_V=test.u_guard_V)


def _about_the_flow(test: TestResult, item: DescribedTest) -> Iterator[Warning_]:
    shapes = item.branches
    whole = not any(shape.prepared.unseen_top for shape in shapes)
    largest, at_top, noise = (
        float(np.mean(values))
        for values in zip(
            *((shape.prepared.profile[1].max(), shape.y_max, shape.sigma) for shape in shapes), strict=True
        )
    )
    if whole and largest - at_top > max(FLOW_FALLS * largest, FALL_SIGNIFICANCE * noise):
        yield warn("flow-falls", test.source, largest_L_min=largest / L_MIN, at_top_L_min=at_top / L_MIN)
    missing = float(np.mean([_missing_at_full_drive(shape) for shape in shapes]))
    if whole and missing > CURVED:
        yield warn("curved", test.source, missing=missing)
    share = sum(shape.outliers for shape in shapes) / max(sum(int(shape.line.inside.sum()) for shape in shapes), 1)
    if share > MANY_OUTLIERS:
        yield warn("outliers", test.source, share=share)


def _missing_at_full_drive(shape: BranchShape) -> float:
    """Return which share of the largest flow is missing at the law's full drive, where the line would reach it."""
    u, y = shape.prepared.profile
    return 1.0 - float(np.interp(shape.knee + shape.y_max / shape.slope, u, y)) / shape.y_max


def about_errors(
    side: SideModel, tests: tuple[DescribedTest, ...], u_max: float, window: tuple[float, float]
) -> Iterator[Warning_]:
    """Yield a warning for each test whose knees are known badly, with the reason."""
    if all(test.u_knee_se_V <= NOISY * u_max for test in side.tests):
        return
    left = _left_without_the_bend([shape for item in tests for shape in item.branches])
    for test, group in zip(side.tests, (item.branches for item in tests), strict=True):
        if test.u_knee_se_V <= NOISY * u_max:
            continue
        if left < BLAME:
            yield _bent(test, left, window)
        else:
            alone = "; one branch alone can't tell noise from a bend of the flow, see --plots"
            yield warn(
                "noise", test.source, knee_se_mV=1e3 * test.u_knee_se_V, noise_L_min=test.noise_L_min,
                inflation=test.noise_variance_inflation, alone=alone if len(tests) == len(group) == 1 else "",
            )  # fmt: skip


def _left_without_the_bend(shapes: Sequence[BranchShape]) -> float:
    """Return which share of the departures from the lines is not common to all branches; 1 where that can't be told."""
    count = min((PARTS, *(int(np.sum(shape.line.kept & ~shape.line.censored)) // 2 for shape in shapes)))
    if len(shapes) < 2 or count < FEWEST_PARTS:
        return 1.0
    departures = np.array([_departures(shape, count) for shape in shapes])
    not_common = departures - departures.mean(axis=0)
    every = float(np.sum(departures**2)) * (len(shapes) - 1) / len(shapes)
    return min(float(np.sqrt(np.sum(not_common**2) / every)), 1.0) if every > 0 else 1.0


def _departures(shape: BranchShape, count: int) -> np.ndarray:
    """Return the means of the departures from a branch's line in parts of it, over the flow of the straight part."""
    line, seen = shape.line, shape.line.kept & ~shape.line.censored
    u, y = shape.prepared.branch.u[seen], shape.prepared.y[seen]
    order = np.argsort(u, kind="stable")
    residual = (y - line.slope * (u - line.knee))[order] / (line.slope * np.ptp(u))
    return np.array([part.mean() for part in np.array_split(residual, count)])


def _bent(test: TestResult, left: float, declared: tuple[float, float]) -> Warning_:
    of_rising = test.u_knee_rising_se_V == test.u_knee_se_V
    straight = (test.straight_rising if of_rising else test.straight_falling) or declared
    (low, high), asked = ([100 * share for share in shares] for shares in (straight, declared))
    widened = f" (--knee-window {asked[0]:.3g}-{asked[1]:.3g}, widened)"
    widened = widened if straight != declared else ""
    se_mV = 1e3 * test.u_knee_se_V
    return warn("bend", test.source, knee_se_mV=se_mV, low=low, high=high, widened=widened, left_mV=left * se_mV)
