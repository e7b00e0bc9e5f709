"""One side of a valve: ramp tests in, `SideModel` out. The pipeline: describe, fit, bound, the law's offset."""

import math
from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.worded import all_of, worded
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.data_quality.side_warnings import find_warnings
from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM, Trend, find_trend
from dzdesign.identify.fitting.constrained_fits import KneeFit, fit_knees
from dzdesign.identify.fitting.guarding import (
    OrderedKnees,
    Threshold,
    bound_threshold,
    fit_guard_curves,
    mean_threshold,
    opening_curve,
    order_knees,
    systematic_change,
)
from dzdesign.identify.knees.between_ramps import FEW_DEGREES, BetweenRamps
from dzdesign.identify.knees.described_tests import DescribedTest, DescribedTests
from dzdesign.identify.knees.prepared_tests import describe_tests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.results import SideIdentification
from dzdesign.identify.valve.guard_curve import GUARDS, Guard, GuardCurve
from dzdesign.identify.valve.ramp_result import BRANCHES, TestResult
from dzdesign.identify.valve.repeatability import Repeatability
from dzdesign.identify.valve.side_model import BoundsBasis, Reference, SideModel

#: dP0 names the tested pressure drop within this share of it.
REFERENCE_TOLERANCE = 0.1
#: dP0 of the paper, taken where the user names none: the test nearest to it.
PAPER_DP0 = 1 * MPA


def identify_side(tests: Sequence[RampTest], options: IdentifyOptions) -> SideIdentification:
    """Identify the side of positive commands from ramp tests in any order.

    Raises
    ------
    InputError
        Where no threshold can be given, with the reason.
    """
    group = describe_tests(tests, options)
    trend, free, guarded = _fit_with_trend(group, options)
    model = _side_model(group, trend, free, guarded, options)
    return SideIdentification(
        model=model,
        described=group,
        knees=guarded.fit,
        warnings=find_warnings(model, group, guarded.departure, options),
    )


def _fit_with_trend(group: DescribedTests, options: IdentifyOptions) -> tuple[Trend, KneeFit, OrderedKnees]:
    """Fit the knees freely, see which way the guarded ones run, and fit them again under that direction."""
    free = fit_knees([item.shapes for item in group.tests], floor=group.floor, u_max=options.u_max, trend="flat")
    dp = np.array([item.dp or math.nan for item in group.tests])
    column = 1 if group.tests[0].shapes[1] else 0  # falling wherever there is one: zero command comes after closing
    between, knee_se = group.between(column), free.knee_se[:, column]
    degrees = float(between.degrees_of_freedom(knee_se, DEGREES_OF_FREEDOM).min())
    trend = find_trend(
        dp,
        free.knee[:, column],
        between.covariance_of_mean(knee_se),
        degrees,
        options.u_max,
        systematic_change(group, column, options),
    )
    return trend, free, order_knees(group, free, trend.direction, column, options)


def _reference(described: tuple[DescribedTest, ...], dp0: float | None) -> int:
    """Return the index of the test at dP0."""
    if described[0].dp is None:
        if dp0 is not None:
            no_column = "dP0 = {dp0:g MPa} was asked for, but '{source}' has no column of dP"
            raise InputError(worded(no_column, dp0=dp0 / MPA, source=described[0].test.source))
        return 0
    dp = np.array([item.dp for item in described])
    index = int(np.argmin(np.abs(np.log(dp / (dp0 or PAPER_DP0)))))
    if dp0 is not None and abs(dp[index] - dp0) > REFERENCE_TOLERANCE * dp0:
        tested = all_of([worded("{dp:.3g #MPa}", dp=value / MPA) for value in dp[:-1]], ", ")
        raise InputError(
            worded(
                "dP0 = {dp0:g MPa} is not among the tested pressure drops ({tested}{comma}{last:.3g MPa})",
                dp0=dp0 / MPA, tested=tested, comma=", " if dp.size > 1 else "", last=dp[-1] / MPA,
            )
        )  # fmt: skip
    return index


def _side_model(
    group: DescribedTests, trend: Trend, free: KneeFit, guarded: OrderedKnees, options: IdentifyOptions
) -> SideModel:
    """Assemble one side: guarded thresholds, the curves that may be certified of them, and k x_max."""
    described, knees = group.tests, guarded.fit
    reference = _reference(described, options.dp0)
    thresholds, rising = _all_thresholds(group, free, guarded, trend, options)
    guard, threshold = next(iter(thresholds.items()))
    dp = [item.dp for item in described]
    _refuse_unlike_repeats(group.between(guarded.column), threshold)
    found = fit_guard_curves(thresholds, dp, reference, trend.direction, options.u_max)
    guards: dict[str, GuardCurve] = {name: found[name][0] for name in GUARDS if name in found}
    slope = float(np.nanmean(knees.slope[reference]))
    y_max = float(np.mean([shape.y_max for shape in described[reference].branches]))
    k_x_max = y_max / slope  # Eq. (11) at full stroke: Q_max = slope (k x_max)
    dp0 = described[reference].dp
    several = len(described) > 1
    return SideModel(
        tests=tuple(_test_result(group, knees, row, threshold) for row in range(len(described))),
        reference=Reference(dp_MPa=None if dp0 is None else dp0 / MPA, u_min_V=guards[guard].u_min0_V),
        k_x_max_over_u_max=k_x_max / options.u_max,
        k_V_mm=k_x_max / (options.x_max * 1e3) if options.x_max else None,
        trend=trend.direction if several else None,
        trend_change_V=trend.change if several else None,
        trend_change_se_V=trend.change_se if several else None,
        trend_p=trend.p_value if several else None,
        certificate=BoundsBasis(
            confidence=options.confidence,
            guard=guard,
            level_L_min=group.noise_level / L_MIN,
            repeatability=_repeatability(group.between(guarded.column)),
        ),
        guards=guards,
        opening_curve=opening_curve(rising, trend.direction, guards, options.u_max) if rising else None,
        active_constraints=knees.active
        + tuple(f"offset at test {row + 1}" for row, holds in enumerate(found[guard][1]) if holds),
    )


def _refuse_unlike_repeats(between: BetweenRamps, threshold: Threshold) -> None:
    """Refuse repeats that differ so much, and are so few, that the next closing may lie anywhere."""
    if between.origin == "repeats" and between.degrees < FEW_DEGREES and threshold.bound.min() <= 0:
        raise InputError(
            worded(
                "ramps at one pressure drop differ: their thresholds scatter by {sd:.0f mV} (one standard deviation, "
                "degrees of freedom: {degrees:.0f}), so that no lower bound above zero follows; record two more ramps "
                "there, or leave out the one that is unlike the rest",
                sd=1e3 * between.sd,
                degrees=between.degrees,
            )
        )


def _repeatability(found: BetweenRamps) -> Repeatability:
    return Repeatability(
        sd_V=found.sd,
        origin=found.origin,
        degrees_of_freedom=found.degrees if found.origin == "repeats" else None,
        drift_V=found.drift.change if found.drift else None,
        drift_se_V=found.drift.change_se if found.drift else None,
        no_drift=found.no_drift,
    )


def _all_thresholds(
    group: DescribedTests, free: KneeFit, guarded: OrderedKnees, trend: Trend, options: IdentifyOptions
) -> tuple[dict[Guard, Threshold], OrderedKnees | None]:
    """Return the threshold of every guard that the branches allow, the default one first, and the rising knees.

    The trend is the one found on the guarded branch: one edge opens and closes. A branch that runs otherwise departs
    from it, and its bounds are lowered by the departure.
    """
    guard: Guard = "closing" if guarded.column else "opening"
    other: Guard = "opening" if guarded.column else "closing"
    knees, thresholds = {guard: guarded}, {guard: bound_threshold(group, guarded, options)}
    # Where the solver finds no order of the other branch's knees, that guard is not on offer, and `design` says so.
    with suppress(InputError):
        if group.tests[0].shapes[1 - guarded.column]:
            knees[other] = order_knees(group, free, trend.direction, 1 - guarded.column, options, alone=True)
    if other in knees:
        thresholds[other] = bound_threshold(group, knees[other], options)
        thresholds["mean"] = mean_threshold(group, thresholds["opening"], thresholds["closing"])
    return thresholds, knees.get("opening")


def _test_result(group: DescribedTests, knees: KneeFit, row: int, guarded: Threshold) -> TestResult:
    """Return one row of valve.json's tests."""
    item = group.tests[row]
    rising, falling = item.shapes
    return TestResult(
        source=item.test.source,
        dp_MPa=None if item.dp is None else item.dp / MPA,
        dp_from="declared" if item.test.dp_is_declared else item.test.dp_from[0] or None,
        **_thresholds(item, knees, row),
        straight_rising=rising.line.window if rising else None,
        straight_falling=falling.line.window if falling else None,
        not_observable=_not_observable(group, row),
        u_guard_V=float(guarded.value[row]),
        u_guard_lower_V=float(guarded.bound[row]),
        slope_L_min_V=float(np.nanmean(knees.slope[row])) / L_MIN,
        q_max_L_min=item.q_max / L_MIN,
        saturates=all(shape.saturates for shape in item.branches),
        leak_L_min=group.leak[row] / L_MIN,
        noise_level_L_min=max(shape.dead_zone.noise_level for shape in item.branches) / L_MIN,
        noise_L_min=max(shape.sigma for shape in item.branches) / L_MIN,
        noise_variance_inflation=max(shape.variance_inflation for shape in item.branches),
        spool_ripple_V=max(shape.ripple for shape in item.branches),
        outliers=sum(shape.outliers for shape in item.branches),
        ramps=item.ramps,
        left_out=item.left_out,
    )


def _thresholds(item: DescribedTest, knees: KneeFit, row: int) -> dict[str, float | None]:
    """Return the thresholds of a test under their keys in valve.json; None where a branch was not recorded."""
    values: dict[str, float | None] = {}
    for column, (branch, shape) in enumerate(zip(BRANCHES, item.shapes, strict=True)):
        knee, knee_se = knees.knee[row, column], knees.knee_se[row, column]
        values |= {
            f"u_knee_{branch}_V": float(knee) if shape else None,
            f"u_knee_{branch}_se_V": float(knee_se) if shape else None,
            f"u_level_{branch}_V": shape.tail.at_level if shape else None,
            f"u_level_{branch}_se_V": shape.tail.at_level_se if shape else None,
            f"u_onset_{branch}_V": shape.onset if shape else None,
            f"u_onset_{branch}_se_V": shape.onset_se if shape else None,
        }
    return values


def _not_observable(group: DescribedTests, row: int) -> dict[str, str]:
    """Say of thresholds that can't be seen why; what valve.json gives instead is said too."""
    reasons = {}
    for direction, shape in zip(BRANCHES, group.tests[row].shapes, strict=True):
        if shape is None:
            for name in ("knee", "level", "onset"):
                reasons[f"u_{name}_{direction}_V"] = f"there is no {direction} branch"
        elif shape.tail.hole:
            low, high = shape.tail.hole
            for name in ("level", "onset"):
                reasons[f"u_{name}_{direction}_V"] = (
                    f"rows are missing from {low:.3f} to {high:.3f} V, where the flow begins; the onset's value is the "
                    "lower end"
                )
        elif group.floor > 0:
            reasons[f"u_onset_{direction}_V"] = (
                f"the meter shows nothing below {group.floor / L_MIN:.2f} L/min; the value is the tail above that "
                "flow, extrapolated to zero"
            )
    return reasons
