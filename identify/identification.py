"""`identify`: ramp tests in, `ValveModel` out. Reads as the pipeline: split, describe, fit, bound, law's offset."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.bounds import excess_departure, find_trend, lower_bounds, staircase
from dzdesign.identify.branches import Branch, split_branches
from dzdesign.identify.characteristic import BranchShape, describe_branch, find_meter_floor, flow_at_top, smooth_profile
from dzdesign.identify.fit import KneeFit, fit_knees, fit_offset
from dzdesign.identify.model import SideModel, TestResult, ValveModel, Warning_
from dzdesign.identify.quality import find_warnings
from dzdesign.identify.ramp_files import RampTest

MPA = 1e6
L_MIN = 1e-3 / 60
#: Two tests whose pressure drops differ by less than this share are the same test twice.
SAME_PRESSURE = 0.02
#: Pressure drops beyond these, Pa, are a wrong unit.
SMALLEST_DP, LARGEST_DP = 1e3, 200 * MPA
#: Commands within this share of u_max are at rest.
AT_REST = 0.01
#: A reading at rest below this share of the largest flow is no zero error.
ZERO_SHARE = 2e-3
#: dP0 names the tested pressure drop within this share of it.
REFERENCE_TOLERANCE = 0.1
#: dP0 of the paper, taken where the user names none: the test nearest to it.
PAPER_DP0 = 1 * MPA


@dataclass(frozen=True, slots=True, kw_only=True)
class IdentifyOptions:
    """Choices of the engineer, SI.

    Attributes
    ----------
    u_max : float
        Full command, V.
    dp0 : float or None
        Reference pressure drop, Pa; None takes the test nearest to 1 MPa.
    meter_floor : float or None
        Flow below which the meter reads zero, m³/s; None finds it in the data.
    meter_lag : float
        Lag of the flow meter, s.
    meter_zero : float
        Bound of the meter's zero error, m³/s, against which the certificate guards.
    x_max : float or None
        Stroke, m; with it k comes in V/mm.
    confidence : float
        Of all lower bounds together.
    knee_window : tuple of float
        Shares of the largest flow between which the characteristic is taken as straight. The lower edge is 12 %: on a
        bent characteristic the knee moves with it, on a straight one it does not matter.
    """

    u_max: float = 10.0
    dp0: float | None = None
    meter_floor: float | None = None
    meter_lag: float = 0.0
    meter_zero: float = 0.0
    x_max: float | None = None
    confidence: float = 0.99
    knee_window: tuple[float, float] = (0.12, 0.5)

    def __post_init__(self) -> None:
        if not self.u_max > 0:
            raise InputError(f"u_max is {self.u_max} V, expected a positive command")
        if not 0.5 <= self.confidence < 1:
            raise InputError(f"the confidence is {self.confidence}, expected 0.5 to below 1, such as 0.99")
        if not 0 < self.knee_window[0] < self.knee_window[1] <= 1:
            raise InputError(f"the knee window is {self.knee_window}, expected two rising shares such as '12-50 %'")
        for name in ("meter_floor", "meter_lag", "meter_zero"):
            if (getattr(self, name) or 0) < 0:
                raise InputError(f"{name} is negative, expected zero or more")
        for name in ("dp0", "x_max"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise InputError(f"{name} is {value}, expected a positive number")


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedTest:
    """One ramp test with its nominal pressure drop (Pa, None if unknown), its branches and their shapes."""

    test: RampTest
    dp: float | None
    branches: tuple[Branch | None, Branch | None]
    shapes: tuple[BranchShape | None, BranchShape | None]
    q_max: float


def identify(tests: Sequence[RampTest], options: IdentifyOptions | None = None) -> ValveModel:
    """Identify k x_max/u_max, the thresholds and beta(dP) of a valve from ramp tests.

    Parameters
    ----------
    tests : sequence of RampTest
        One per pressure drop, in any order; a single one may lack the pressure drop.
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
    options = options or IdentifyOptions()
    if not tests:
        raise InputError("no ramp tests were given; expected at least one file")
    zeros = [_reading_at_zero(test, options.u_max) for test in tests]
    tests = [replace(test, q=test.q - zero) for test, zero in zip(tests, zeros, strict=True)]
    zero_of = {test.source: zero / L_MIN for test, zero in zip(tests, zeros, strict=True) if zero}
    split = _split_all(tests, options)
    floor = options.meter_floor if options.meter_floor is not None else _found_floor(split, options)
    described = _in_order_of_pressure([_describe(*item, floor=floor, options=options) for item in split])
    _refuse_mixed_branches(described)
    trend, change, change_se, knees, departure = _fit_with_trend(described, floor, options)
    side = _side_model(described, knees, departure, (trend, change, change_se), options)
    u_max = options.u_max
    return ValveModel(
        u_max_V=u_max,
        meter_floor_L_min=floor / L_MIN,
        meter_lag_s=options.meter_lag,
        meter_zero_L_min=options.meter_zero / L_MIN,
        knee_window=options.knee_window,
        positive=side,
        warnings=_warnings(described, side, departure, zero_of, floor, options),
        made_from=tuple((item.test.source, item.test.sha256) for item in described),
    )


def _reading_at_zero(test: RampTest, u_max: float) -> float:
    """Return what the meter reads at zero command where that is not zero, m³/s: its zero error, or a leak.

    Thousands of readings at rest tell it far better than any declared bound; 0 is returned where it does not stand out.
    """
    rest = test.q[(test.u >= -AT_REST * u_max) & (test.u <= AT_REST * u_max)]
    if rest.size < 20:
        return 0.0
    zero = float(np.median(rest))
    error = 1.4826 * float(np.median(np.abs(rest - zero))) / np.sqrt(rest.size)
    return zero if abs(zero) > max(5 * error, ZERO_SHARE * float(np.abs(test.q).max())) else 0.0


def _split_all(
    tests: Sequence[RampTest], options: IdentifyOptions
) -> list[tuple[RampTest, tuple[Branch | None, Branch | None]]]:
    """Split every test into branches; refuse what has no ramp, too large a command, or no flow."""
    split = []
    for test in tests:
        top = float(test.u.max())
        if top > 1.05 * options.u_max:
            raise InputError(
                f"'{test.source}': the command reaches {top:.2f} V, above u_max = {options.u_max:g} V; give --u-max"
            )
        branches = split_branches(test, options.meter_lag)
        if branches == (None, None):
            raise InputError(f"'{test.source}' holds no ramp of the command from near zero up; expected a ramp test")
        if test.dp is None and len(tests) > 1:
            raise InputError(
                f"'{test.source}' has no column of dP (or pA and pB); several ramp tests can only be told apart by it"
            )
        split.append((test, branches))
        _refuse_a_shut_valve(test, branches, options.u_max)
    return split


def _refuse_a_shut_valve(test: RampTest, branches: tuple[Branch | None, Branch | None], u_max: float) -> None:
    """Refuse a test whose flow at full command does not stand out of the meter's noise."""
    for branch in branches:
        if branch is None:
            continue
        bottom = branch.q[branch.u <= branch.u.min() + 0.05 * np.ptp(branch.u)]
        noise = 1.4826 * float(np.median(np.abs(bottom - np.median(bottom))))
        rise = flow_at_top(*smooth_profile(branch.u, branch.q, u_max)) - float(np.median(bottom))
        if rise <= max(6 * noise, 0.01 * L_MIN):
            raise InputError(
                f"'{test.source}': the valve never opens: the flow at {branch.u.max():.2f} V is "
                f"{rise / L_MIN:.3f} L/min above that at zero, within the meter's noise of {noise / L_MIN:.3f} L/min; "
                "check the solenoid, the supply and the column of Q"
            )


def _found_floor(split: list[tuple[RampTest, tuple[Branch | None, Branch | None]]], options: IdentifyOptions) -> float:
    """Return the largest meter floor that any branch shows (one meter, so one floor), m³/s."""
    return max(
        find_meter_floor(branch.u, branch.q, options.u_max)
        for _, branches in split
        for branch in branches
        if branch is not None
    )


def _describe(
    test: RampTest, branches: tuple[Branch | None, Branch | None], *, floor: float, options: IdentifyOptions
) -> DescribedTest:
    """Bring the flow to the nominal pressure drop, sample by sample, and describe both branches."""
    dp = None
    shapes = []
    q_max = 0.0
    if test.dp is not None:
        # Nominal is the pressure drop at (almost) no flow, which the supply's droop has not touched.
        shut = test.dp[(test.u >= 0) & (test.u <= 0.05 * options.u_max)]
        dp = float(np.median(shut if shut.size >= 5 else test.dp))
        if 0 < dp < SMALLEST_DP or dp > LARGEST_DP:
            raise InputError(
                f"'{test.source}': the pressure drop is {dp / MPA:.3g} MPa, expected {SMALLEST_DP / MPA:g} to "
                f"{LARGEST_DP / MPA:g} MPa; correct the unit in the header (mPa is a thousandth of a pascal)"
            )
        if dp <= 0:
            raise InputError(
                f"'{test.source}': the pressure drop is {dp / MPA:.3f} MPa, expected a positive one; "
                "swap pA and pB, or correct the sign of dP"
            )
    for branch in branches:
        if branch is None:
            shapes.append(None)
            continue
        # Eq. (1): Q grows as sqrt(dP); below a tenth of the nominal pressure the ratio would only carry noise.
        y = branch.q if dp is None else branch.q * np.sqrt(dp / np.maximum(branch.dp, 0.1 * dp))
        shapes.append(
            describe_branch(branch, y, u_max=options.u_max, floor=floor, window=options.knee_window, source=test.source)
        )
        q_max = max(q_max, flow_at_top(*smooth_profile(branch.u, branch.q, options.u_max)))
    return DescribedTest(test=test, dp=dp, branches=branches, shapes=(shapes[0], shapes[1]), q_max=q_max)


def _in_order_of_pressure(described: list[DescribedTest]) -> list[DescribedTest]:
    """Sort by pressure drop; refuse two tests at one pressure drop."""
    if len(described) < 2:
        return described
    described = sorted(described, key=lambda item: (item.dp, item.test.source))
    for left, right in pairwise(described):
        if right.dp - left.dp < SAME_PRESSURE * right.dp:
            raise InputError(
                f"the pressure drop repeats: '{left.test.source}' ({left.dp / MPA:.3f} MPa) and "
                f"'{right.test.source}' ({right.dp / MPA:.3f} MPa); give one ramp test per pressure drop"
            )
    return described


def _fit_with_trend(
    described: list[DescribedTest], floor: float, options: IdentifyOptions
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


def _guarded_column(described: list[DescribedTest]) -> int:
    """Return 1 (the falling branch) wherever there is one, else 0: zero command comes after closing."""
    return 1 if described[0].shapes[1] else 0


def _refuse_mixed_branches(described: list[DescribedTest]) -> None:
    """Refuse tests of which some have a branch that others lack: they can't be compared."""
    for column, name in ((0, "rising"), (1, "falling")):
        lacking = [item.test.source for item in described if item.shapes[column] is None]
        if lacking and len(lacking) < len(described):
            raise InputError(
                f"'{lacking[0]}' has no {name} branch while other ramp tests have one; "
                "record every pressure drop up and down, or leave that file out"
            )


def _guard(
    described: list[DescribedTest], knees: KneeFit, departure: np.ndarray, options: IdentifyOptions
) -> tuple[str, np.ndarray, np.ndarray, np.ndarray]:
    """Return which branch is guarded, its thresholds, standard errors and lower bounds (V), all (T,).

    Guarded is the lower of knee and onset: a soft edge passes flow below the knee.
    """
    column = _guarded_column(described)
    shapes = [item.shapes[column] for item in described]
    knee, knee_se = knees.knee[:, column], knees.knee_se[:, column]
    onset, onset_se = (np.array([getattr(shape, name) for shape in shapes]) for name in ("onset", "onset_se"))
    # A zero error of the meter moves each zero by the error over the slope of the line that was extrapolated.
    knee_budget = departure.max() + np.array([options.meter_zero / shape.slope for shape in shapes])
    onset_budget = departure.max() + np.array([options.meter_zero / shape.onset_slope for shape in shapes])
    bound = np.minimum(
        lower_bounds(knee, knee_se, options.confidence, knee_budget),
        lower_bounds(onset, onset_se, options.confidence, onset_budget),
    )
    lower_is_knee = knee <= onset
    return (
        "closing" if column else "opening",
        np.where(lower_is_knee, knee, onset),
        np.where(lower_is_knee, knee_se, onset_se),
        bound,
    )


def _reference(described: list[DescribedTest], dp0: float | None) -> int:
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
    described: list[DescribedTest],
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
    )


def _warnings(
    described: list[DescribedTest],
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
        departure_V={item.test.source: float(gap) for item, gap in zip(described, departure, strict=True) if gap > 0},
    )
