"""What is weak in the sweeps themselves: a branch that is missing or short, in the wrong order, or full of spikes."""

from collections.abc import Iterator

import numpy as np

from dzdesign.identify.constants import L_MIN
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
    """Yield the warnings about the sweeps of one side.

    Parameters
    ----------
    side : SideModel
        What was identified.
    tests : tuple of DescribedTest
        What it was identified from.
    u_max : float
        Full command, V.
    """
    for test, item in zip(side.tests, tests, strict=True):
        yield from _about_branches(test)
        yield from _about_holes(test, item, side.certificate.guard)
        yield from _about_the_command(test, item, side.certificate.guard, u_max)
        yield from _about_the_flow(test, item)
    if not any(test.saturates for test in side.tests):
        yield Warning_(
            code="no-saturation",
            text=(
                f"no test saturates: k x_max/u_max = {side.k_x_max_over_u_max:.4f} comes from the flow at full command "
                "and is a lower bound of the stroke's"
            ),
            source=None,
        )


def _about_branches(test: TestResult) -> Iterator[Warning_]:
    rising, falling = test.u_knee_rising_V, test.u_knee_falling_V
    if falling is None:
        yield Warning_(
            code="one-branch",
            text=(
                "no falling branch: valves close at a lower command than they open, so the certificate guards the "
                "opening threshold only and flow at zero command after closing is possible. Ramp down as well"
            ),
            source=test.source,
        )
    if rising is None:
        yield Warning_(
            code="one-branch",
            text="no rising branch: the residual dead zone on opening can't be said. Ramp up as well",
            source=test.source,
        )
    if test.closes_above_opening:
        yield Warning_(
            code="branch-order",
            text=(
                f"the valve closes ({falling:.3f} V) above where it opens ({rising:.3f} V): is the meter's lag "
                "over-corrected, or the time column wrong? The certificate guards the closing threshold, here the "
                "higher one, so flow at zero command is possible, and `design` refuses it unless it is accepted"
            ),
            source=test.source,
        )


def _about_holes(test: TestResult, item: DescribedTest, guard: str) -> Iterator[Warning_]:
    for way, shape in zip(("opening", "closing"), item.shapes, strict=True):
        if shape is None or not shape.tail.hole:
            continue
        low, high = shape.tail.hole
        bound = f", so the {guard} threshold's bound is lowered below {low:.3f} V" if way == guard else ""
        yield Warning_(
            code="gap",
            text=(
                f"rows are missing on the {way} branch, from {low:.3f} to {high:.3f} V, where the flow begins; a soft "
                f"edge there would not be seen{bound}. Record this ramp again, without losing rows"
            ),
            source=test.source,
        )


def _about_the_command(test: TestResult, item: DescribedTest, guard: str, u_max: float) -> Iterator[Warning_]:
    top = float(item.test.u.max())
    if top < FULL_COMMAND * u_max:
        yield Warning_(
            code="not-full-command",
            text=f"the command reaches {top:.2f} V of {u_max:g} V, so k x_max is too small",
            source=test.source,
        )
    lowest = float(item.branch(1 if guard == "closing" else 0).prepared.branch.u.min())
    if lowest > test.u_guard_V:
        yield Warning_(
            code="edge-not-swept",
            text=(
                f"the ramp goes down to {lowest:.2f} V only, above the {guard} threshold of {test.u_guard_V:.3f} V, "
                "which is therefore extrapolated: a soft edge or a leak below would not be seen, and the certificate "
                "says nothing about it. Record the command from zero"
            ),
            source=test.source,
        )


def _about_the_flow(test: TestResult, item: DescribedTest) -> Iterator[Warning_]:
    shapes = item.branches
    largest, at_top, noise = (
        float(np.mean(values))
        for values in zip(
            *((shape.prepared.profile[1].max(), shape.y_max, shape.sigma) for shape in shapes), strict=True
        )
    )
    if largest - at_top > max(FLOW_FALLS * largest, FALL_SIGNIFICANCE * noise):
        yield Warning_(
            code="flow-falls",
            text=(
                f"the flow falls again before full command, from {largest / L_MIN:.3g} to {at_top / L_MIN:.3g} L/min "
                "at the nominal pressure drop, and k x_max is taken from the latter: is the supply at its limit, or "
                "are there spikes in the column of Q? See --plots"
            ),
            source=test.source,
        )
    missing = float(np.mean([_missing_at_full_drive(shape) for shape in shapes]))
    if missing > CURVED:
        yield Warning_(
            code="curved",
            text=(
                "the flow is not straight over the command: where the straight part would reach the largest flow, "
                f"{missing:.0%} of it are missing. The compensator's full command drives "
                "to there, so that much is lost, and `verify` without --plant, whose plant is straight, does not show "
                "it. A wider --knee-window loses less, with a threshold that is less sharp; see --plots"
            ),
            source=test.source,
        )
    share = sum(shape.outliers for shape in shapes) / max(sum(int(shape.line.inside.sum()) for shape in shapes), 1)
    if share > MANY_OUTLIERS:
        yield Warning_(
            code="outliers",
            text=(
                f"{share:.1%} of the samples of the straight part are outliers and were left out; the flow at full "
                "command, and with it k x_max, may hold such samples still. Look for spikes and drop-outs of Q by "
                "--plots, and leave their cells blank"
            ),
            source=test.source,
        )


def _missing_at_full_drive(shape: BranchShape) -> float:
    """Return which share of the largest flow is missing at the law's full drive, where the line would reach it."""
    u, y = shape.prepared.profile
    return 1.0 - float(np.interp(shape.knee + shape.y_max / shape.slope, u, y)) / shape.y_max
