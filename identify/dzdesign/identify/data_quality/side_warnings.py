"""Warnings about one side, after its identification: what is weak, with the numbers and what to do."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.data_quality.flow_meter import about_the_meter
from dzdesign.identify.data_quality.pressures import about_flow_gains
from dzdesign.identify.data_quality.sweeps import about_errors, about_sweeps
from dzdesign.identify.fit.scatter import Scatter
from dzdesign.identify.fitting.certifying import Certified
from dzdesign.identify.knees.between_ramps import ScatterChecks
from dzdesign.identify.knees.described_tests import DescribedTest, DescribedTests
from dzdesign.identify.options import ASSUMED_REPEATABILITY, IdentifyOptions
from dzdesign.identify.ramps.sweep_pressure import SWINGS
from dzdesign.identify.valve.bound_proof import BoundProof
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.side_model import Repeatability, SideModel

#: A softer edge than this share of u_max between knee and the tail's zero is said.
SOFT_EDGE = 5e-3
#: Distance of opening and closing knee over u_max above which dither is missing, or there is play.
WIDE_HYSTERESIS = 0.03
#: Half swings of the pressure drop on one ramp, while the valve is shut, from which it swings.
FEWEST_SWINGS = 6
#: With fewer degrees of freedom the scatter is known so badly that repeats pay twice.
FEW_DEGREES = 4
#: Standard errors from which a drift is said, and share of u_max from which it matters.
DRIFT_SIGNIFICANCE, SMALLEST_DRIFT = 3.0, 1e-3
#: Shares of u_max from which an outlying ramp's distance, and the scatter of ramps like their neighbours, matter.
SMALLEST_DISTANCE, SMALLEST_SCATTER = 1e-3, 5e-4


def find_warnings(
    side: SideModel,
    group: DescribedTests,
    departure: np.ndarray,
    certified: Certified,
    options: IdentifyOptions,
) -> tuple[Warning_, ...]:
    """Return the warnings about one side.

    `departure` (T,) says by how much each test's threshold departs from one direction with the pressure drop, V; zero
    within its error, and of no matter under another premise. `certified` is the default guard's curve, with what the
    tests say against a premise.
    """
    checks = group.between(1 if side.certificate.guard == "closing" else 0).checks
    return (
        *about_the_meter(side, group, options),
        *about_ramps(side, certified.scatter, checks, group.tests, options),
        *(
            warn(
                "not-monotone",
                test.source,
                gap_mV=1e3 * float(gap),
            )
            for test, gap in zip(side.tests, departure, strict=True)
            if gap > 0
        ),
        *(
            warn("premise-refused", premise=each.premise, p=each.lack_of_fit_p or 0.0, taken=side.curve.premise)
            for each in filter(None, [certified.refused])
        ),
        *(
            warn("stick-slip", test.source, ripple_mV=1e3 * test.spool_ripple_V, stop_mV=1.732e3 * test.spool_ripple_V)
            for test in side.tests
            if test.spool_ripple_V > 0
        ),
        *_about_hysteresis(side, group, options.u_max),
        *about_flow_gains(side.tests),
        *_about_pressure(side, group.tests),
        *about_sweeps(side, group.tests, options.u_max),
        *about_errors(side, group.tests, options.u_max, options.knee_window),
        *_about_the_edge(side, group, options.u_max),
    )


def _about_hysteresis(side: SideModel, group: DescribedTests, u_max: float) -> Iterator[Warning_]:
    """Say of a wide hysteresis whether it may be the meter's lag: on ramps of one rate both look alike."""
    gaps = [(test.u_knee_rising_V or 0.0) - (test.u_knee_falling_V or math.inf) for test in side.tests]
    widest = int(np.argmax(gaps))
    if gaps[widest] <= WIDE_HYSTERESIS * u_max:
        return
    wide = sum(gap > WIDE_HYSTERESIS * u_max for gap in gaps)
    numbers = {"gap_mV": 1e3 * gaps[widest], "percent": 100 * gaps[widest] / u_max, "count": wide, "tests": len(gaps)}
    both = float(group.rates(0)[widest] + group.rates(1)[widest])
    if group.lag.seen_by_rates or not both > 0:
        yield warn("hysteresis", side.tests[widest].source, "rates", **numbers)
    else:
        lag = {"longer_s": gaps[widest] / both, "lag_s": group.lag.seconds}
        yield warn("hysteresis", side.tests[widest].source, "one-rate", **lag, **numbers)


def _about_pressure(side: SideModel, tests: tuple[DescribedTest, ...]) -> Iterator[Warning_]:
    if side.reference.dp_MPa is None:
        yield warn("no-pressure", side.tests[0].source)
    elif len(side.tests) == 1:
        yield warn("one-pressure", side.tests[0].source, dp_MPa=side.reference.dp_MPa)
    elif side.trend == "flat" and side.trend_change_V is not None and side.trend_change_se_V is not None:
        change_mV, se_mV = 1e3 * side.trend_change_V, 1e3 * side.trend_change_se_V
        yield warn("flat-trend", change_mV=change_mV, change_se_mV=se_mV, p_value=side.trend_p)
    yield from _about_swings(tests)
    for item in tests:
        share = _sag(item)
        if share > 1 / 3:
            yield warn("pressure-sag", item.test.source, share=share)
        if item.test.dp_is_declared:
            yield warn("declared-pressure", item.test.source, "declared")


def _about_swings(tests: tuple[DescribedTest, ...]) -> Iterator[Warning_]:
    """Say of a supply that swings while the valve is shut that it does: the flow follows, and no spool makes it."""
    swings = [_swing(item) for item in tests]
    worst = int(np.argmax(swings))
    if swings[worst] > SWINGS:
        count = sum(share > SWINGS for share in swings)
        yield warn("pressure-swings", tests[worst].test.source, share=swings[worst], count=count, tests=len(tests))


def _swing(item: DescribedTest) -> float:
    """Return the spread of the pressure drop over its mean while the valve is shut; 0 of one that drifts or steps."""
    branch, knee = item.closing_branch.prepared.branch, item.closing_branch.knee
    shares: list[float] = []
    if branch.dp is None:
        return 0.0
    for part in branch.ramps:
        dp = branch.dp[part][branch.u[part] < 0.9 * knee]
        if not dp.size:
            continue
        away = dp - dp.mean()
        beyond = away[np.abs(away) > np.std(away) / 2]
        swings = np.count_nonzero(np.diff(np.sign(beyond))) >= FEWEST_SWINGS
        shares.append(float(np.std(away) / dp.mean()) if swings and dp.mean() > 0 else 0.0)
    return float(np.median(shares)) if shares else 0.0


def _sag(item: DescribedTest) -> float:
    """Return the share of the pressure drop that is lost at full command."""
    test = item.test
    if item.dp is None or test.dp is None:
        return 0.0
    return 1 - float(np.median(test.dp[test.u >= 0.97 * test.u.max()])) / item.dp


def _about_the_edge(side: SideModel, group: DescribedTests, u_max: float) -> Iterator[Warning_]:
    floor = group.floor / L_MIN
    if floor > 0 and side.certificate.unseen_below_L_min >= floor:
        yield warn("onset-hidden", floor_L_min=floor)
    for test, item in zip(side.tests, group.tests, strict=True):
        knee = test.u_knee_rising_V if test.u_knee_falling_V is None else test.u_knee_falling_V
        if knee is not None and knee - test.u_guard_V > SOFT_EDGE * u_max and not item.closing_branch.tail.hole:
            yield warn("soft-edge", test.source, below_mV=1e3 * (knee - test.u_guard_V))


def about_ramps(
    side: SideModel,
    scatter: Scatter,
    checks: ScatterChecks,
    tests: Sequence[DescribedTest],
    options: IdentifyOptions,
) -> Iterator[Warning_]:
    """Yield the warnings about what differs from ramp to ramp, on the guarded branch."""
    found, proof = side.certificate.repeatability, side.curve.proof
    count = len(tests)
    sd_mV, degrees = 1e3 * found.sd_V, found.degrees_of_freedom
    if found.origin == "assumed":
        repeats = sum(len(test.ramps) for test in tests) - count
        drift = " once the drift has taken one" if found.drift_V is not None else ""
        said = {"percent": 100 * ASSUMED_REPEATABILITY, "sd_mV": sd_mV, "drift": drift}
        yield warn("assumed-scatter", None, "few-repeats" if repeats else "no-repeats", **said)
    elif degrees is not None and options.repeatability is not None:
        percent = 100 * found.sd_V / options.u_max
        yield warn("repeatability", sd_mV=sd_mV, percent=percent, declared=100 * options.repeatability)
    elif degrees is not None and degrees < FEW_DEGREES and not scatter.unlike:
        yield warn("few-repeats", sd_mV=sd_mV, differences=degrees)
    yield from _about_scatter(found, scatter, checks, tests, proof, options.u_max)
    if found.no_drift == "order of pressure" or (found.no_drift == "order unknown" and count > 1):
        yield warn("order", None, "unknown" if found.no_drift == "order unknown" else "of-pressure")
    if found.drift_V is not None and found.drift_se_V is not None:
        least = max(DRIFT_SIGNIFICANCE * found.drift_se_V, SMALLEST_DRIFT * options.u_max)
        if abs(found.drift_V) > least:
            yield warn("drift", drift_mV=1e3 * found.drift_V, se_mV=1e3 * found.drift_se_V)


def _about_scatter(
    found: Repeatability,
    scatter: Scatter,
    checks: ScatterChecks,
    tests: Sequence[DescribedTest],
    proof: BoundProof,
    u_max: float,
) -> Iterator[Warning_]:
    """Yield what the repeats say against a scatter that is normal, alike at all pressure drops, and independent."""
    groups, unlike = checks.groups, scatter.unlike
    if groups and groups.apart > SMALLEST_DISTANCE * u_max:
        low, high = (tests[test].ramps[number] for test, number in groups.ramps)
        yield warn(
            "two-groups",
            tests[groups.ramps[0][0]].test.source,
            apart_mV=1e3 * groups.apart,
            low=low,
            high=high,
        )
    if unlike:
        knot_MPa = scatter.model.knots_MPa[unlike.knot]
        nearest = min(tests, key=lambda test: abs((test.dp or 0.0) / MPA - knot_MPa))
        yield warn(
            "unequal-scatter",
            nearest.test.source,
            sd_mV=1e3 * math.sqrt(unlike.variance),
            others_mV=1e3 * found.sd_V,
            differences=unlike.degrees,
        )
    for ramp in proof.set_aside:
        if abs(ramp.distance_V) > SMALLEST_DISTANCE * u_max:
            yield warn("outlying-ramp", ramp.source, distance_mV=1e3 * ramp.distance_V, ratio=ramp.deviations)
    if checks.serial is not None and found.sd_V > SMALLEST_SCATTER * u_max:
        yield warn("serial-scatter", correlation=checks.serial)
