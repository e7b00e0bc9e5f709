"""One side of a valve: ramp tests in, `SideModel` out. The pipeline: describe, fit, bound, the law's offset."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.bounds import Trend, excess_departure, find_trend, lower_bounds, staircase
from dzdesign.identify.described_tests import L_MIN, MPA, DescribedTest, DescribedTests, describe_tests
from dzdesign.identify.fit import KneeFit, fit_knees, fit_offset
from dzdesign.identify.model import BranchResult, SideModel, TestResult, Warning_
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.quality import find_warnings
from dzdesign.identify.ramp_files import RampTest

#: dP0 names the tested pressure drop within this share of it.
REFERENCE_TOLERANCE = 0.1
#: Standard errors by which the tail's zero must lie below the knee, in one test or in all together, to be taken for a
#: soft edge.
SOFT_SIGNIFICANCE = 3.0
#: Standard errors of a lag that was found, against which the bounds guard.
LAG_ERRORS = 3.0
#: dP0 of the paper, taken where the user names none: the test nearest to it.
PAPER_DP0 = 1 * MPA


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifiedSide:
    """What was found about one side, and what it was found from."""

    model: SideModel
    described: DescribedTests
    knees: KneeFit
    warnings: tuple[Warning_, ...]


def identify_side(tests: Sequence[RampTest], options: IdentifyOptions) -> IdentifiedSide:
    """Identify the side of positive commands.

    Parameters
    ----------
    tests : sequence of RampTest
        In any order.
    options : IdentifyOptions
        Choices of the engineer.

    Raises
    ------
    InputError
        Where no threshold can be given, with the reason.
    """
    group = describe_tests(tests, options)
    trend, knees, departure = _fit_with_trend(group.tests, group.floor, options)
    model = _side_model(group, knees, departure, trend, options)
    return IdentifiedSide(
        model=model,
        described=group,
        knees=knees,
        warnings=find_warnings(model, group, departure, options),
    )


def _fit_with_trend(
    described: tuple[DescribedTest, ...], floor: float, options: IdentifyOptions
) -> tuple[Trend, KneeFit, np.ndarray]:
    """Fit the knees freely, see which way they run, and fit them again under that direction.

    Returns
    -------
    tuple
        Trend, the fit, and how far each test's knees depart from that direction (V, beyond their own error): data that
        contradict the certificate's one premise have to pay for it.
    """
    shapes = [item.shapes for item in described]
    free = fit_knees(shapes, floor=floor, u_max=options.u_max, trend="flat")
    dp = np.array([item.dp or math.nan for item in described])
    column = _guarded_column(described)
    knee, knee_se = free.knee[:, column], free.knee_se[:, column]
    budget = options.flat_change * options.u_max
    trend = find_trend(dp, knee, knee_se, options.u_max, budget)
    if len(described) < 2:
        return trend, free, np.zeros(1)
    if trend.direction == "flat":
        return trend, free, excess_departure(np.abs(knee - knee.mean()), knee_se, budget)
    knees = fit_knees(shapes, floor=floor, u_max=options.u_max, trend=trend.direction, ordered=column)
    return trend, knees, excess_departure(np.abs(knee - knees.knee[:, column]), knee_se, budget)


def _guarded_column(described: tuple[DescribedTest, ...]) -> int:
    """Return 1 (the falling branch) wherever there is one, else 0: zero command comes after closing."""
    return 1 if described[0].shapes[1] else 0


@dataclass(frozen=True, slots=True)
class _Guarded:
    """The guarded branch's thresholds, standard errors and lower bounds (V), all (T,)."""

    branch: str
    threshold: np.ndarray
    se: np.ndarray
    bound: np.ndarray


def _guard(group: DescribedTests, knees: KneeFit, departure: np.ndarray, options: IdentifyOptions) -> _Guarded:
    """Bound the knee, or the tail's zero where that lies below the knee by more than its error: a soft edge."""
    described = group.tests
    column = _guarded_column(described)
    shapes = [item.shapes[column] for item in described]
    knee, knee_se = knees.knee[:, column], knees.knee_se[:, column]
    zero = np.array([shape.tail.zero for shape in shapes])
    zero_se = np.array([shape.tail.zero_se for shape in shapes])
    shared = departure.max() + _lag_budget(group, column)
    # A zero error of the meter moves each zero by the error over the slope of the line that was extrapolated.
    knee_budget = shared + np.array([options.meter_zero / shape.slope for shape in shapes])
    zero_budget = shared + np.array([options.meter_zero / shape.tail.slope for shape in shapes])
    # A soft edge passes flow below the knee. Where the tail agrees with the knee's line, that line is all there is.
    gap, error = knee - zero, np.hypot(knee_se, zero_se)
    # One edge has passed the flow of all tests, so together they show a softness that none shows alone.
    together = np.sum(gap / error**2) > SOFT_SIGNIFICANCE * math.sqrt(np.sum(error**-2))
    soft = (gap > SOFT_SIGNIFICANCE * error) | (together & (gap > 0))
    knee_bound = lower_bounds(knee, knee_se, options.confidence, knee_budget)
    zero_bound = lower_bounds(zero, zero_se, options.confidence, zero_budget)
    return _Guarded(
        "closing" if column else "opening",
        np.where(soft, zero, knee),
        np.where(soft, zero_se, knee_se),
        np.where(soft, np.minimum(knee_bound, zero_bound), knee_bound),
    )


def _lag_budget(group: DescribedTests, column: int) -> float:
    """Return by how much an error of a lag that was found may have moved the guarded thresholds, V."""
    if group.lag.origin != "identified":
        return 0.0
    rates = [item.branches[column].rate for item in group.tests]
    return LAG_ERRORS * group.lag.se * float(np.nanmax(rates))


def _reference(described: tuple[DescribedTest, ...], dp0: float | None) -> int:
    """Return the index of the test at dP0."""
    if described[0].dp is None:
        if dp0 is not None:
            raise InputError(
                f"dP0 = {dp0 / MPA:g} MPa was asked for, but '{described[0].test.source}' has no column of dP"
            )
        return 0
    dp = np.array([item.dp for item in described])
    index = int(np.argmin(np.abs(np.log(dp / (dp0 or PAPER_DP0)))))
    if dp0 is not None and abs(dp[index] - dp0) > REFERENCE_TOLERANCE * dp0:
        tested = ", ".join(f"{value / MPA:.3g}" for value in dp)
        raise InputError(f"dP0 = {dp0 / MPA:g} MPa is not among the tested pressure drops ({tested} MPa)")
    return index


def _side_model(
    group: DescribedTests, knees: KneeFit, departure: np.ndarray, trend: Trend, options: IdentifyOptions
) -> SideModel:
    """Assemble one side: guarded thresholds, bounds, staircase, the law's offset and k x_max."""
    described = group.tests
    guarded = _guard(group, knees, departure, options)
    steps, ceiling = staircase(guarded.bound, trend.direction)
    reference = _reference(described, options.dp0)
    offset = fit_offset(guarded.threshold, guarded.se, ceiling, reference, u_max=options.u_max, trend=trend.direction)
    slope = float(np.nanmean(knees.slope[reference]))
    y_max = float(np.mean([shape.y_max for shape in described[reference].shapes if shape]))
    k_x_max = y_max / slope  # Eq. (11) at full stroke: Q_max = slope (k x_max)
    known = described[0].dp is not None
    several = len(described) > 1
    return SideModel(
        tests=tuple(_test_result(group, knees, row, guarded) for row in range(len(described))),
        reference_dp_MPa=described[reference].dp / MPA if known else None,
        u_min0_V=offset.u_min0,
        k_x_max_over_u_max=k_x_max / options.u_max,
        k_V_mm=k_x_max / (options.x_max * 1e3) if options.x_max else None,
        trend=trend.direction if several else None,
        trend_change_V=trend.change if several else None,
        trend_change_se_V=trend.change_se if several else None,
        trend_p=trend.p_value if several else None,
        beta_dp_MPa=tuple(item.dp / MPA for item in described) if known else (),
        beta=tuple(float(value) for value in offset.beta) if known else (),
        confidence=options.confidence,
        guard=guarded.branch,
        level_L_min=max(shape.level for item in described for shape in item.shapes if shape) / L_MIN,
        certified_steps_V=tuple(float(step) for step in steps),
        active_constraints=knees.active
        + tuple(f"offset at test {row + 1}" for row, active in enumerate(offset.active) if active),
    )


def _test_result(group: DescribedTests, knees: KneeFit, row: int, guarded: _Guarded) -> TestResult:
    """Return one row of valve.json's tests."""
    item = group.tests[row]
    shapes = [shape for shape in item.shapes if shape]
    return TestResult(
        source=item.test.source,
        dp_MPa=None if item.dp is None else item.dp / MPA,
        rising=_branch_result(group, knees, row, 0),
        falling=_branch_result(group, knees, row, 1),
        not_observable=_not_observable(group, row),
        u_guard_V=float(guarded.threshold[row]),
        u_guard_lower_V=float(guarded.bound[row]),
        slope_L_min_V=float(np.nanmean(knees.slope[row])) / L_MIN,
        q_max_L_min=item.q_max / L_MIN,
        saturates=all(shape.saturates for shape in shapes),
        noise_L_min=max(shape.sigma for shape in shapes) / L_MIN,
        noise_colour=max(shape.colour for shape in shapes),
        outliers=sum(shape.outliers for shape in shapes),
        ramps=item.ramps,
    )


def _branch_result(group: DescribedTests, knees: KneeFit, row: int, column: int) -> BranchResult | None:
    shape = group.tests[row].shapes[column]
    if shape is None:
        return None
    return BranchResult(
        knee_V=float(knees.knee[row, column]),
        knee_se_V=float(knees.knee_se[row, column]),
        level_V=shape.tail.at_level,
        level_se_V=shape.tail.at_level_se,
        onset_V=shape.onset,
        onset_se_V=shape.onset_se,
        straight=shape.window,
    )


def _not_observable(group: DescribedTests, row: int) -> dict[str, str]:
    """Say of thresholds that can't be seen why; what valve.json gives instead is said too."""
    reasons = {}
    for direction, shape in zip(("rising", "falling"), group.tests[row].shapes, strict=True):
        if shape is None:
            for name in ("knee", "level", "onset"):
                reasons[f"u_{name}_{direction}_V"] = f"there is no {direction} branch"
        elif group.floor > 0:
            reasons[f"u_onset_{direction}_V"] = (
                f"the meter shows nothing below {group.floor / L_MIN:.2f} L/min; the value is the tail above that "
                "flow, extrapolated to zero"
            )
    return reasons
