"""What is weak in the sweeps themselves: a branch that is missing or short, in the wrong order, or full of spikes."""

from collections.abc import Iterator

import numpy as np

from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.knees.branch_shape import BranchShape
from dzdesign.identify.knees.described_tests import DescribedTest
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
