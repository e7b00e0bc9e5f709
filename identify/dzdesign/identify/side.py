"""One side of a valve: ramp tests in, `SideModel` out. The pipeline: describe, fit, bound, the law's offset."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.core.artefact_types import own_result
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits, worded
from dzdesign.identify.constants import L_MIN, MPA, Shown
from dzdesign.identify.data_quality.flow_meter import about_low_flow
from dzdesign.identify.data_quality.side_warnings import find_warnings
from dzdesign.identify.fit.scatter import Scatter
from dzdesign.identify.fitting.certifying import Certified, Tested, certify_thresholds
from dzdesign.identify.fitting.guarded_thresholds import Guarding, departures, guard_thresholds
from dzdesign.identify.fitting.identifying import identify_curve, opening_curve
from dzdesign.identify.fitting.low_flow import unseen_of_curve, with_low_flow
from dzdesign.identify.fitting.zero_flow import allowed_at_zero
from dzdesign.identify.knees.curve_thinning import recorded_curve
from dzdesign.identify.knees.described_tests import DescribedTest, DescribedTests, Knees
from dzdesign.identify.knees.prepared_tests import describe_tests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.guard_curve import GUARDS, CertifiedCurve, Guard
from dzdesign.identify.valve.low_flow import LowFlow
from dzdesign.identify.valve.model import ValveModel, Warning_
from dzdesign.identify.valve.ramp_result import BRANCHES, TestResult, conditions_of
from dzdesign.identify.valve.recorded_drop import RecordedDrop, drop_in_words
from dzdesign.identify.valve.side_model import BoundsBasis, NoDrift, Reference, Repeatability, SideModel

#: dP0 names the tested pressure drop within this share of it.
REFERENCE_TOLERANCE = 0.1
#: dP0 of the paper, taken where the user names none: the test nearest to it.
PAPER_DP0 = 1 * MPA


@dataclass(frozen=True, slots=True, kw_only=True)
class SideIdentification:
    """What was found about one side, and what it was found from."""

    model: SideModel
    described: DescribedTests
    knees: Knees
    warnings: tuple[Warning_, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """The model of a valve, and per side what it was found from."""

    model: ValveModel
    sides: dict[str, SideIdentification]


@own_result()
def identify_side(
    tests: Sequence[RampTest],
    options: IdentifyOptions,
    units: RecordedUnits = AS_COMPUTED,
    low_flow: Sequence[LowFlow] = (),
) -> SideIdentification:
    """Identify the side of positive commands from ramp tests in any order; texts of its model are in `units`.

    `low_flow` are flows below the meter's floor that were measured by hand.

    Raises
    ------
    InputError
        Where no threshold can be given, with the reason.
    """
    group = describe_tests(tests, options)
    knees = Knees.of([item.shapes for item in group.tests])
    reference = _reference(group.tests, options.dp0)
    guarding, lowered = with_low_flow(guard_thresholds(group, knees, options), group, low_flow, options)
    certified = _certify(group, guarding, reference, options)
    default = next(iter(certified.values()))
    model = _side_model(group, guarding, certified, knees, reference, options, units, low_flow)
    one_way = next((each.lack_of_fit_p for each in default.curve.premises if each.premise == "monotone"), None)
    departure = departures(next(iter(guarding.thresholds.values())), guarding.trend.direction, one_way)
    return SideIdentification(
        model=model,
        described=group,
        knees=knees,
        warnings=(
            *find_warnings(model, group, departure, default, options),
            *about_low_flow(model, lowered),
        ),
    )


def _certify(
    group: DescribedTests, guarding: Guarding, reference: int, options: IdentifyOptions
) -> dict[Guard, Certified]:
    """Certify the offset of every guard, the default one first."""
    dp = np.array([math.nan if item.dp is None else item.dp / MPA for item in group.tests])
    opens = guarding.knees.knee[:, 0]
    tested = Tested(
        dp_MPa=dp,
        reference=reference,
        direction=guarding.trend.direction,
        opens_V=np.where(np.isnan(opens), guarding.knees.knee[:, 1], opens),
        options=options,
    )
    return certify_thresholds(guarding.thresholds, tested)


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
        tested = ", ".join(f"{Shown(value / MPA):.3g #MPa}" for value in dp[:-1])
        raise InputError(
            worded(
                "dP0 = {dp0:g MPa} is not among the tested pressure drops ({tested}{comma}{last:.3g MPa})",
                dp0=dp0 / MPA, tested=tested, comma=", " if dp.size > 1 else "", last=dp[-1] / MPA,
            )
        )  # fmt: skip
    return index


def _side_model(
    group: DescribedTests,
    guarding: Guarding,
    certified: dict[Guard, Certified],
    knees: Knees,
    reference: int,
    options: IdentifyOptions,
    units: RecordedUnits,
    low_flow: Sequence[LowFlow],
) -> SideModel:
    """Assemble one side: what was identified, the curves that may be certified, and k x_max."""
    described, trend = group.tests, guarding.trend
    guard = next(iter(certified))
    curves: dict[str, CertifiedCurve] = {name: certified[name].curve for name in GUARDS if name in certified}
    columns = {name: column for name, column in (("closing", 1), ("opening", 0)) if described[0].shapes[column]}
    branches = {name: group.between(column).scatter for name, column in columns.items()}
    joint = identify_curve(group, branches, certified[guard].curves, reference)
    dp0 = described[reference].dp
    several = len(described) > 1
    k_mm = 1 / (options.x_max * 1e3) if options.x_max else None
    rows = range(len(described))
    drop = tuple(dict.fromkeys(each for item in described for each in item.test.dp_from[0]))
    level = group.noise_level / L_MIN
    unseen = unseen_of_curve(low_flow, guard, curves[guard], level).below_L_min
    # Readings by hand at the threshold tell what a meter that hides its zero can't.
    unseen = max(unseen, group.hidden_zero / L_MIN) if unseen == level else unseen
    return SideModel(
        recorded_drop=RecordedDrop(columns=drop, sign=described[0].test.dp_sign) if drop else None,
        tests=tuple(_test_result(group, knees, row, curves[guard], options, units) for row in rows),
        reference=Reference(
            dp_MPa=None if dp0 is None else dp0 / MPA,
            u_min_V=joint.curves[guard].u_V[reference],
            u_min_se_V=joint.curves[guard].u_se_V[reference],
        ),
        k_x_max_over_u_max=joint.k_x_max / options.u_max,
        k_x_max_over_u_max_se=joint.k_x_max_se / options.u_max,
        k_V_mm=joint.k_x_max * k_mm if k_mm else None,
        k_V_mm_se=joint.k_x_max_se * k_mm if k_mm else None,
        trend=trend.direction if several else None,
        trend_change_V=trend.change if several else None,
        trend_change_se_V=trend.change_se if several else None,
        trend_p=trend.p_value if several else None,
        certificate=BoundsBasis(
            confidence=options.confidence,
            guard=guard,
            level_L_min=level,
            unseen_below_L_min=unseen,
            zero_flow_L_min=None if options.zero_flow is None else options.zero_flow / L_MIN,
            repeatability=_repeatability(certified[guard].scatter, len(described)),
        ),
        low_flow=tuple(low_flow),
        identified=joint.curves,
        certified=curves,
        opening_curve=opening_curve(knees, trend.direction, curves, options.u_max),
    )


def _repeatability(found: Scatter, tests: int) -> Repeatability:
    model = found.model
    drift_se = math.sqrt(float(model.weights[-1] ** 2 @ found.of_ramps)) if model.drift else None
    no_drift: NoDrift = "order unknown" if model.ramps.clock is None else "order of pressure"
    if model.drift or tests == 1:
        no_drift = "" if model.drift else "one pressure drop"
    return Repeatability(
        sd_V=math.sqrt(found.variance if found.origin == "repeats" else model.scatter),
        origin=found.origin,
        degrees_of_freedom=found.degrees if found.origin == "repeats" else None,
        drift_V=model.drift_V,
        drift_se_V=drift_se,
        no_drift=no_drift,
    )


def _test_result(
    group: DescribedTests,
    knees: Knees,
    row: int,
    guarded: CertifiedCurve,
    options: IdentifyOptions,
    units: RecordedUnits,
) -> TestResult:
    """Return one row of valve.json's tests."""
    item, u_max = group.tests[row], options.u_max
    allowed = allowed_at_zero(group, options)
    at_zero = None if allowed is None else allowed[row]
    rising, falling = item.shapes
    noise_level = max(shape.dead_zone.noise_level for shape in item.branches)
    return TestResult(
        source=item.test.source,
        dp_MPa=None if item.dp is None else item.dp / MPA,
        dp_from="declared"
        if item.test.dp_is_declared
        else drop_in_words(item.test.dp_from[0], item.test.dp_sign) or None,
        **_thresholds(item, knees, row),
        straight_rising=rising.line.window if rising else None,
        straight_falling=falling.line.window if falling else None,
        not_observable=_not_observable(group, row, units),
        u_guard_V=guarded.u_threshold_V[row],
        u_guard_lower_V=guarded.u_lower_V[row],
        slope_L_min_V=float(np.nanmean(knees.slope[row])) / L_MIN,
        q_max_L_min=item.q_max / L_MIN,
        saturates=all(shape.saturates for shape in item.branches),
        leak_L_min=group.leak[row] / L_MIN,
        noise_level_L_min=noise_level / L_MIN,
        zero_flow_L_min=None if at_zero is None else at_zero / L_MIN,
        noise_L_min=max(shape.sigma for shape in item.branches) / L_MIN,
        noise_variance_inflation=max(shape.variance_inflation for shape in item.branches),
        spool_ripple_V=max(shape.ripple for shape in item.branches),
        outliers=sum(shape.outliers for shape in item.branches),
        recorded=recorded_curve(item, group.leak[row], noise_level, u_max, at_zero),
        ramps=item.ramps,
        left_out=item.left_out,
        conditions=conditions_of([shape.prepared.branch.rate for shape in item.branches], item.test.time),
    )


def _thresholds(item: DescribedTest, knees: Knees, row: int) -> dict[str, float | None]:
    """Return the thresholds of a test under their keys in valve.json; None where a branch was not recorded."""
    values: dict[str, float | None] = {}
    for column, (branch, shape) in enumerate(zip(BRANCHES, item.shapes, strict=True)):
        knee, knee_se = knees.knee[row, column], knees.knee_se[row, column]
        values |= {
            f"u_knee_{branch}_V": float(knee) if shape else None,
            f"u_knee_{branch}_se_V": float(knee_se) if shape else None,
            f"u_onset_{branch}_V": shape.onset if shape else None,
            f"u_onset_{branch}_se_V": shape.onset_se if shape else None,
        }
    return values


def _not_observable(group: DescribedTests, row: int, units: RecordedUnits) -> dict[str, str]:
    """Say of thresholds that can't be seen why; what valve.json gives instead is said too."""
    reasons = {}
    for direction, shape in zip(BRANCHES, group.tests[row].shapes, strict=True):
        if shape is None:
            for name in ("knee", "onset"):
                reasons[f"u_{name}_{direction}_V"] = f"there is no {direction} branch"
        elif shape.tail.hole:
            low, high = shape.tail.hole
            reasons[f"u_onset_{direction}_V"] = (
                f"rows are missing {units.span(low, high, '.3f V')}, where the flow begins; the value is the lower end"
            )
        elif group.floor > 0:
            least = units.text(group.floor / L_MIN, ".2f L/min")
            reasons[f"u_onset_{direction}_V"] = (
                f"the meter shows nothing below {least}; the value is the tail above that flow, extrapolated to zero"
            )
    return reasons
