"""Why a knee is known badly: the meter's noise, a bend where a straight line was laid, or levels too far apart.

The errors of `GatedLine` count whatever departs from the line, and rightly so; but slower ramps help against noise
only. One valve has made all branches, so a bend departs from the line in the same way in each of them; noise, fast or
slow, does not. What the branches' departures have in common is the valve's, the rest the meter's.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.knees.branch_shape import BranchShape
from dzdesign.identify.knees.described_tests import DescribedTest
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.side_model import SideModel

#: Standard error of a knee, over u_max, above which it decides what the compensator gives up.
NOISY = 2.5e-3
#: A bend is to blame where the noise alone would leave less than this share of the error.
BLAME = 0.5
#: Parts of the straight part, in the order of the command, in which departures from the line are averaged; fewest.
PARTS, FEWEST_PARTS = 8, 4


def about_errors(
    side: SideModel, tests: tuple[DescribedTest, ...], u_max: float, window: tuple[float, float]
) -> Iterator[Warning_]:
    """Yield a warning for each test whose knees are known badly, with the reason."""
    if all(test.u_knee_se_V <= NOISY * u_max for test in side.tests):
        return
    left = _left_without_the_bend([shape for item in tests for shape in item.branches if _has_noise(shape)])
    for test, group in zip(side.tests, (item.branches for item in tests), strict=True):
        if test.u_knee_se_V <= NOISY * u_max:
            continue
        if not any(map(_has_noise, group)):
            yield warn("coarse-levels", test.source, knee_se_mV=1e3 * test.u_knee_se_V)
        elif left < BLAME:
            yield _bent(test, left, window)
        else:
            alone = "; one branch alone can't tell noise from a bend of the flow, see --plots"
            yield warn(
                "noise", test.source, knee_se_mV=1e3 * test.u_knee_se_V, noise_L_min=test.noise_L_min,
                inflation=test.noise_variance_inflation, alone=alone if len(tests) == len(group) == 1 else "",
            )  # fmt: skip


def _has_noise(shape: BranchShape) -> bool:
    """Tell whether a line goes through noisy samples; one from level to level of a table has no residuals."""
    return shape.line.roughness.n > 0


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
