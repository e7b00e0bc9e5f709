"""Warnings about one side, after its identification: what is weak, with the numbers and what to do."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.between_ramps import about_ramps
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.data_quality.knee_errors import about_errors
from dzdesign.identify.data_quality.pressures import about_flow_gains
from dzdesign.identify.data_quality.sweeps import about_sweeps
from dzdesign.identify.knees.described_tests import DescribedTest, DescribedTests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.side_model import SideModel

#: A softer edge than this share of u_max between knee and the tail's zero is said.
SOFT_EDGE = 5e-3
#: Shift of the knees by the meter's lag, over u_max, above which a tenth of it matters.
LARGE_LAG = 1e-2
#: Lag that a flow meter without a word about it may well have, s.
LIKELY_LAG = 0.1
#: Shares of the guarded threshold between which a leak inside the overlap is looked for, and its standard errors.
OVERLAP, LEAK_SIGNIFICANCE = (0.6, 0.85), 5.0
#: Half a step of the flow, as a shift of the threshold over u_max, above which it matters whether it was cut off.
COARSE_STEP = 5e-4
#: The same where it is more than the bounds' distance from the threshold: a certificate that counts on less is none.
SMALL_SHIFT = 5e-5
#: Distance of opening and closing knee over u_max above which dither is missing, or there is play.
WIDE_HYSTERESIS = 0.03
#: Readings a level, from which on a flow is one of steps.
READINGS_A_LEVEL = 5
#: A leak below this share of the largest flow is not worth a word.
LEAK_SHARE = 1e-3


def find_warnings(
    side: SideModel, group: DescribedTests, departure: np.ndarray, options: IdentifyOptions
) -> tuple[Warning_, ...]:
    """Return the warnings about one side.

    `departure` (T,) says by how much each test's knees depart from one direction with the pressure drop, V; zero
    within their error.
    """
    return (
        *_about_the_meter(group.zero_L_min),
        *_about_steps(side, group.tests, options),
        *_about_the_lag(group, options),
        *about_ramps(side.certificate.repeatability, len(side.tests), options),
        *(
            warn("not-monotone", test.source, gap_mV=1e3 * float(gap))
            for test, gap in zip(side.tests, departure, strict=True)
            if gap > 0
        ),
        *(
            warn("stick-slip", test.source, ripple_mV=1e3 * test.spool_ripple_V, stop_mV=1.732e3 * test.spool_ripple_V)
            for test in side.tests
            if test.spool_ripple_V > 0
        ),
        *_about_hysteresis(side, options.u_max),
        *about_flow_gains(side.tests),
        *_about_pressure(side, group.tests),
        *about_sweeps(side, group.tests, options.u_max),
        *about_errors(side, group.tests, options.u_max, options.knee_window),
        *_about_the_edge(side, group, options.u_max),
    )


def _about_hysteresis(side: SideModel, u_max: float) -> Iterator[Warning_]:
    for test in side.tests:
        gap = (test.u_knee_rising_V or 0.0) - (test.u_knee_falling_V or math.inf)
        if gap > WIDE_HYSTERESIS * u_max:
            yield warn("hysteresis", test.source, gap_mV=1e3 * gap, percent=100 * gap / u_max)


def _about_steps(side: SideModel, tests: tuple[DescribedTest, ...], options: IdentifyOptions) -> Iterator[Warning_]:
    """Say of a flow in coarse steps that a logger which cuts off, instead of rounding, puts all thresholds too high."""
    levels = [np.unique(item.test.q) for item in tests]
    steps = [
        float(np.median(np.diff(known))) if 2 < known.size * READINGS_A_LEVEL < item.test.q.size else 0.0
        for known, item in zip(levels, tests, strict=True)
    ]
    shifts = [0.5 * step / L_MIN / test.slope_L_min_V for step, test in zip(steps, side.tests, strict=True)]
    worst = int(np.argmax(shifts))
    # Half a step matters as well where it is more than what the bounds leave to the noise.
    beyond = any(
        shift > max(test.u_guard_V - test.u_guard_lower_V, SMALL_SHIFT * options.u_max)
        for shift, test in zip(shifts, side.tests, strict=True)
    )
    if options.meter_zero < 0.49 * steps[worst] and (beyond or shifts[worst] > COARSE_STEP * options.u_max):
        half = 0.5 * steps[worst] / L_MIN
        yield warn(
            "coarse-flow", tests[worst].test.source, step_L_min=2 * half, shift_mV=1e3 * shifts[worst], half_L_min=half
        )


def _about_the_lag(group: DescribedTests, options: IdentifyOptions) -> Iterator[Warning_]:
    rates = [shape.prepared.branch.rate for item in group.tests for shape in item.branches]
    rates = [rate for rate in rates if rate > 0]
    fastest, lag = max(rates, default=0.0), group.lag
    if not rates:
        yield warn("clock")
    elif lag.origin == "unknown":
        yield warn("lag-unknown", lag_s=LIKELY_LAG, shift_mV=1e3 * fastest * LIKELY_LAG, rate_V_s=fastest)
    elif fastest * lag.seconds > LARGE_LAG * options.u_max:
        shift_mV = 1e3 * fastest * lag.seconds
        yield warn("lag-large", lag_s=lag.seconds, shift_mV=shift_mV, rate_V_s=fastest, tenth_mV=0.1 * shift_mV)


def _about_the_meter(zero_L_min: Mapping[str, float]) -> Iterator[Warning_]:
    leak = "; if it is a leak, the valve passes it whatever the compensator does"
    for source, zero in zero_L_min.items():
        yield warn("meter-zero", source, zero_L_min=zero, leak=leak if zero > 0 else "")


def _about_pressure(side: SideModel, tests: tuple[DescribedTest, ...]) -> Iterator[Warning_]:
    if side.reference.dp_MPa is None:
        yield warn("no-pressure", side.tests[0].source)
    elif len(side.tests) == 1:
        yield warn("one-pressure", side.tests[0].source, dp_MPa=side.reference.dp_MPa)
    elif side.trend == "flat" and side.trend_change_V is not None and side.trend_change_se_V is not None:
        change_mV, se_mV = 1e3 * side.trend_change_V, 1e3 * side.trend_change_se_V
        yield warn("flat-trend", change_mV=change_mV, change_se_mV=se_mV, p_value=side.trend_p)
    for item in tests:
        share = _sag(item)
        if share > 1 / 3:
            yield warn("pressure-sag", item.test.source, share=share)
        if item.test.dp_is_declared:
            yield warn("declared-pressure", item.test.source, "declared")


def _sag(item: DescribedTest) -> float:
    """Return the share of the pressure drop that is lost at full command."""
    test = item.test
    if item.dp is None or test.dp is None:
        return 0.0
    return 1 - float(np.median(test.dp[test.u >= 0.97 * test.u.max()])) / item.dp


def _about_the_edge(side: SideModel, group: DescribedTests, u_max: float) -> Iterator[Warning_]:
    floor = group.floor / L_MIN
    if floor > 0:
        yield warn("onset-hidden", floor_L_min=floor)
    for test, item in zip(side.tests, group.tests, strict=True):
        knee = test.u_knee_rising_V if test.u_knee_falling_V is None else test.u_knee_falling_V
        if knee is not None and knee - test.u_guard_V > SOFT_EDGE * u_max and not item.closing_branch.tail.hole:
            yield warn("soft-edge", test.source, below_mV=1e3 * (knee - test.u_guard_V))
        leak = _leak_in_overlap(item, test.u_guard_V)
        if leak > max(LEAK_SHARE * item.q_max, group.floor):
            yield warn("leak", test.source, leak_L_min=leak / L_MIN, share=OVERLAP[1])


def _leak_in_overlap(item: DescribedTest, threshold: float) -> float:
    """Return by how much the flow inside the overlap exceeds that near zero, m³/s; zero within its error."""
    branch = item.closing_branch.prepared.branch
    near_zero = branch.q[branch.u < 0.3 * threshold]
    inside = branch.q[(branch.u > OVERLAP[0] * threshold) & (branch.u < OVERLAP[1] * threshold)]
    if min(near_zero.size, inside.size) < 20:
        return 0.0
    blocks = [np.array([block.mean() for block in np.array_split(part, 8)]) for part in (near_zero, inside)]
    gap = float(np.median(blocks[1]) - np.median(blocks[0]))
    error = float(np.sqrt(sum(np.var(means, ddof=1) / means.size for means in blocks)))
    return gap if gap > LEAK_SIGNIFICANCE * error else 0.0
