"""`identify`: ramp tests in, `ValveModel` out. Reads as the pipeline: describe, fit, bound, the law's offset."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.bounds import excess_departure, find_trend, lower_bounds, staircase
from dzdesign.identify.described_tests import L_MIN, MPA, DescribedTest, describe_tests
from dzdesign.identify.fit import KneeFit, fit_knees, fit_offset
from dzdesign.identify.model import SideModel, TestResult, ValveModel, Warning_
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.quality import find_warnings
from dzdesign.identify.ramp_files import RampTest

#: dP0 names the tested pressure drop within this share of it.
REFERENCE_TOLERANCE = 0.1
#: Standard errors by which the onset must lie below the knee to be taken for a soft edge.
SOFT_SIGNIFICANCE = 2.0
#: dP0 of the paper, taken where the user names none: the test nearest to it.
PAPER_DP0 = 1 * MPA


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """A valve, and what it was identified from: `described` and the rows of `knees` are in the order of its tests."""

    valve: ValveModel
    described: tuple[DescribedTest, ...]
    knees: KneeFit


def identify(tests: Sequence[RampTest], options: IdentifyOptions | None = None) -> ValveModel:
    """Identify k x_max/u_max, the thresholds and beta(dP) of a valve from ramp tests.

    Parameters
    ----------
    tests : sequence of RampTest
        Recordings, in any order; each may hold several ramps, and ramps at one pressure drop are one test. A single
        recording may lack the pressure drop.
    options : IdentifyOptions, optional
        Choices of the engineer.

    Returns
    -------
    ValveModel
        The law's parameters (Eqs. 5, 11), with bounds, warnings and provenance.

    Raises
    ------
    InputError
        Where no threshold can be given, with the reason.
    """
    return identify_traceably(tests, options).valve


def identify_traceably(tests: Sequence[RampTest], options: IdentifyOptions | None = None) -> Identification:
    """Identify a valve as `identify` does, and return beside it the described tests and the fit of their knees.

    Parameters
    ----------
    tests : sequence of RampTest
        Recordings, in any order.
    options : IdentifyOptions, optional
        Choices of the engineer.

    Raises
    ------
    InputError
        Where no threshold can be given, with the reason.
    """
    options = options or IdentifyOptions()
    group = describe_tests(tests, options)
    described, floor = group.tests, group.floor
    trend, change, change_se, knees, departure = _fit_with_trend(described, floor, options)
    side = _side_model(described, knees, departure, (trend, change, change_se), options)
    u_max = options.u_max
    valve = ValveModel(
        u_max_V=u_max,
        meter_floor_L_min=floor / L_MIN,
        meter_lag_s=options.meter_lag,
        meter_zero_L_min=options.meter_zero / L_MIN,
        knee_window=options.knee_window,
        positive=side,
        warnings=_warnings(described, side, departure, group.zero_L_min, floor, options),
        made_from=tuple(dict.fromkeys(file for item in described for file in item.files)),
    )
    return Identification(valve=valve, described=described, knees=knees)


def _fit_with_trend(
    described: tuple[DescribedTest, ...], floor: float, options: IdentifyOptions
) -> tuple[str, float, float, KneeFit, np.ndarray]:
    """Fit the knees freely, see which way they run, and fit them again under that direction.

    Returns
    -------
    tuple
        Trend, its change and standard error (V), the fit, and how far each test's knees depart from that direction (V,
        beyond their own error): data that contradict the certificate's one premise have to pay for it.
    """
    shapes = [item.shapes for item in described]
    free = fit_knees(shapes, floor=floor, u_max=options.u_max, trend="flat")
    if len(described) < 2:
        return "flat", float("nan"), float("nan"), free, np.zeros(1)
    dp = np.array([item.dp for item in described])
    column = _guarded_column(described)
    knee, knee_se = free.knee[:, column], free.knee_se[:, column]
    trend, change, change_se = find_trend(dp, knee, knee_se, options.u_max)
    if trend == "flat":
        return trend, change, change_se, free, excess_departure(np.abs(knee - knee.mean()), knee_se, options.u_max)
    knees = fit_knees(shapes, floor=floor, u_max=options.u_max, trend=trend, ordered=column)
    departure = np.abs(knee - knees.knee[:, column])
    return trend, change, change_se, knees, excess_departure(departure, knee_se, options.u_max)


def _guarded_column(described: tuple[DescribedTest, ...]) -> int:
    """Return 1 (the falling branch) wherever there is one, else 0: zero command comes after closing."""
    return 1 if described[0].shapes[1] else 0


def _guard(
    described: tuple[DescribedTest, ...], knees: KneeFit, departure: np.ndarray, options: IdentifyOptions
) -> tuple[str, np.ndarray, np.ndarray, np.ndarray]:
    """Return which branch is guarded, its thresholds, standard errors and lower bounds (V), all (T,).

    Guarded is the knee, or the onset where that lies below the knee by more than its error: a soft edge.
    """
    column = _guarded_column(described)
    shapes = [item.shapes[column] for item in described]
    knee, knee_se = knees.knee[:, column], knees.knee_se[:, column]
    onset = np.array([shape.onset for shape in shapes])
    onset_se = np.array([shape.onset_se for shape in shapes])
    # A zero error of the meter moves each zero by the error over the slope of the line that was extrapolated.
    knee_budget = departure.max() + np.array([options.meter_zero / shape.slope for shape in shapes])
    onset_budget = departure.max() + np.array([options.meter_zero / shape.onset_slope for shape in shapes])
    # A soft edge passes flow below the knee. Where the tail agrees with the knee's line, that line is all there is.
    soft = knee - onset > SOFT_SIGNIFICANCE * np.hypot(knee_se, onset_se)
    knee_bound = lower_bounds(knee, knee_se, options.confidence, knee_budget)
    onset_bound = lower_bounds(onset, onset_se, options.confidence, onset_budget)
    return (
        "closing" if column else "opening",
        np.where(soft, onset, knee),
        np.where(soft, onset_se, knee_se),
        np.where(soft, np.minimum(knee_bound, onset_bound), knee_bound),
    )


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
    described: tuple[DescribedTest, ...],
    knees: KneeFit,
    departure: np.ndarray,
    trend: tuple[str, float, float],
    options: IdentifyOptions,
) -> SideModel:
    """Assemble one side: guarded thresholds, bounds, staircase, the law's offset and k x_max."""
    guard, threshold, threshold_se, bound = _guard(described, knees, departure, options)
    steps, ceiling = staircase(bound, trend[0])
    reference = _reference(described, options.dp0)
    offset = fit_offset(threshold, threshold_se, ceiling, reference, u_max=options.u_max, trend=trend[0])
    results = tuple(_test_result(item, knees, row, threshold[row], bound[row]) for row, item in enumerate(described))
    slope = float(np.nanmean(knees.slope[reference]))
    y_max = float(np.mean([shape.y_max for shape in described[reference].shapes if shape]))
    k_x_max = y_max / slope  # Eq. (11) at full stroke: Q_max = slope (k x_max)
    known = described[0].dp is not None
    several = len(described) > 1
    return SideModel(
        tests=results,
        reference_dp_MPa=described[reference].dp / MPA if known else None,
        u_min0_V=offset.u_min0,
        k_x_max_over_u_max=k_x_max / options.u_max,
        k_V_mm=k_x_max / (options.x_max * 1e3) if options.x_max else None,
        trend=trend[0] if several else None,
        trend_change_V=trend[1] if several else None,
        trend_change_se_V=trend[2] if several else None,
        beta_dp_MPa=tuple(item.dp / MPA for item in described) if known else (),
        beta=tuple(float(value) for value in offset.beta) if known else (),
        confidence=options.confidence,
        guard=guard,
        level_L_min=max(shape.level for item in described for shape in item.shapes if shape) / L_MIN,
        certified_steps_V=tuple(float(step) for step in steps),
        active_constraints=knees.active
        + tuple(f"offset at test {row + 1}" for row, active in enumerate(offset.active) if active),
    )


def _test_result(item: DescribedTest, knees: KneeFit, row: int, guard: float, bound: float) -> TestResult:
    """Return one row of valve.json's tests."""

    def of(column: int, value: float) -> float | None:
        return float(value) if item.shapes[column] else None

    shapes = [shape for shape in item.shapes if shape]
    rising, falling = item.shapes
    return TestResult(
        source=item.test.source,
        dp_MPa=None if item.dp is None else item.dp / MPA,
        u_knee_rising_V=of(0, knees.knee[row, 0]),
        u_knee_falling_V=of(1, knees.knee[row, 1]),
        u_knee_se_V=float(np.nanmax(knees.knee_se[row])),
        u_onset_rising_V=rising.onset if rising else None,
        u_onset_falling_V=falling.onset if falling else None,
        u_guard_V=float(guard),
        u_guard_lower_V=float(bound),
        slope_L_min_V=float(np.nanmean(knees.slope[row])) / L_MIN,
        q_max_L_min=item.q_max / L_MIN,
        saturates=all(shape.saturates for shape in shapes),
        noise_L_min=max(shape.sigma for shape in shapes) / L_MIN,
        noise_colour=max(shape.colour for shape in shapes),
        outliers=sum(shape.outliers for shape in shapes),
        ramps=item.ramps,
    )


def _warnings(
    described: tuple[DescribedTest, ...],
    side: SideModel,
    departure: np.ndarray,
    zero_of: dict[str, float],
    floor: float,
    options: IdentifyOptions,
) -> tuple[Warning_, ...]:
    sag = {
        item.test.source: 1 - float(np.median(item.test.dp[item.test.u >= 0.97 * item.test.u.max()])) / item.dp
        for item in described
        if item.dp is not None
    }
    top = {item.test.source: float(item.test.u.max()) for item in described}
    bottom = {item.test.source: float(item.test.u.min()) for item in described}
    return find_warnings(
        side,
        floor_L_min=floor / L_MIN,
        u_max=options.u_max,
        sag=sag,
        u_top=top,
        u_bottom=bottom,
        zero_L_min=zero_of,
        declared=[item.test.source for item in described if item.test.dp_is_declared],
        departure_V={item.test.source: float(gap) for item, gap in zip(described, departure, strict=True) if gap > 0},
    )
