"""Warnings about one side, after its identification: what is weak, with the numbers and what to do."""

from collections.abc import Iterator, Mapping

import numpy as np

from dzdesign.identify.constants import L_MIN
from dzdesign.identify.data_quality.between_ramps import about_ramps
from dzdesign.identify.data_quality.knee_errors import about_errors
from dzdesign.identify.data_quality.pressures import about_flow_gains
from dzdesign.identify.data_quality.sweeps import about_sweeps
from dzdesign.identify.knees.described_tests import DescribedTest, DescribedTests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.ramp_result import TestResult
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
#: Readings a level, from which on a flow is one of steps.
READINGS_A_LEVEL = 5
#: A leak below this share of the largest flow is not worth a word.
LEAK_SHARE = 1e-3


def find_warnings(
    side: SideModel, group: DescribedTests, departure: np.ndarray, options: IdentifyOptions
) -> tuple[Warning_, ...]:
    """Return the warnings about one side.

    Parameters
    ----------
    side : SideModel
        What was identified.
    group : DescribedTests
        What it was identified from.
    departure : (T,) array
        By how much each test's knees depart from one direction with the pressure drop, V; zero within their error.
    options : IdentifyOptions
        Choices of the engineer.
    """
    return (
        *_about_the_meter(group.zero_L_min),
        *_about_steps(side, group.tests, options),
        *_about_the_lag(group, options),
        *about_ramps(side.certificate.repeatability, len(side.tests), options),
        *_about_order(side, departure),
        *about_flow_gains(side.tests),
        *_about_pressure(side, group.tests),
        *_about_declarations(group.tests),
        *about_sweeps(side, group.tests, options.u_max),
        *about_errors(side, group.tests, options.u_max, options.knee_window),
        *_about_the_edge(side, group, options.u_max),
    )


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
        yield Warning_(
            code="coarse-flow",
            text=(
                f"the flow is written in steps of {2 * half:.3g} L/min: if the meter or the logger cuts off what lies "
                f"between two steps, and does not round it, every threshold here is up to {1e3 * shifts[worst]:.2g} mV "
                f'too high. Write more digits, or, if it cuts off, allow for it by --meter-zero "{half:.3g} L/min"'
            ),
            source=tests[worst].test.source,
        )


def _about_the_lag(group: DescribedTests, options: IdentifyOptions) -> Iterator[Warning_]:
    rates = [shape.prepared.branch.rate for item in group.tests for shape in item.branches]
    rates = [rate for rate in rates if rate > 0]
    fastest, lag = max(rates, default=0.0), group.lag
    if not rates:
        yield Warning_(
            code="clock",
            text="the column of time tells no ramp rate, so what the flow meter's lag does to the knees can't be said",
            source=None,
        )
    elif lag.origin == "unknown":
        yield Warning_(
            code="lag-unknown",
            text=(
                f"the flow meter's lag is not declared: {LIKELY_LAG:g} s of it moves the opening knee up and the "
                f"closing knee down by {1e3 * fastest * LIKELY_LAG:.0f} mV at {fastest:.3g} V/s. Give --meter-lag, or "
                "record one more ramp at another rate: two rates tell it"
            ),
            source=None,
        )
    elif fastest * lag.seconds > LARGE_LAG * options.u_max:
        yield Warning_(
            code="lag-large",
            text=(
                f"the meter's lag of {lag.seconds:.3g} s moves the knees by {1e3 * fastest * lag.seconds:.0f} mV at "
                f"{fastest:.3g} V/s; a tenth of it wrong is {1e2 * fastest * lag.seconds:.0f} mV. Record slower ramps"
            ),
            source=None,
        )


def _about_the_meter(zero_L_min: Mapping[str, float]) -> Iterator[Warning_]:
    for source, zero in zero_L_min.items():
        yield Warning_(
            code="meter-zero",
            text=(
                f"the flow reads {zero:+.3f} L/min at zero command: taken as the meter's zero error and subtracted"
                + ("; if it is a leak, the valve passes it whatever the compensator does" if zero > 0 else "")
                + ". Set the meter to zero and record again"
            ),
            source=source,
        )


def _about_order(side: SideModel, departure: np.ndarray) -> Iterator[Warning_]:
    for test, gap in zip(side.tests, departure, strict=True):
        if gap > 0:
            yield _not_monotone(test, float(gap))


def _not_monotone(test: TestResult, gap: float) -> Warning_:
    return Warning_(
        code="not-monotone",
        text=(
            f"its knee departs by {1e3 * gap:.0f} mV from a threshold that runs one way with the pressure drop, on "
            "which the certificate rests; all bounds are lowered by the departure. Repeat this test and its "
            "neighbours"
        ),
        source=test.source,
    )


def _about_pressure(side: SideModel, tests: tuple[DescribedTest, ...]) -> Iterator[Warning_]:
    if side.reference.dp_MPa is None:
        yield Warning_(
            code="no-pressure",
            text=(
                "the ramp test has no pressure drop: the knee holds for the pressure of that test only; beta(dP), the "
                "trend, k at another pressure and a certified interval can't be said. Record dP (or pA and pB), at two "
                "or more pressure drops, or declare it by --dp"
            ),
            source=side.tests[0].source,
        )
    elif len(side.tests) == 1:
        yield Warning_(
            code="one-pressure",
            text=(
                f"only {side.reference.dp_MPa:.3g} MPa was tested: whether the threshold moves with the pressure drop "
                "can't be said, beta is 1 and nothing is certified at other pressure drops. Record two or more"
            ),
            source=side.tests[0].source,
        )
    elif side.trend == "flat" and side.trend_change_V is not None and side.trend_change_se_V is not None:
        yield Warning_(
            code="flat-trend",
            text=(
                f"the threshold changes by {1e3 * side.trend_change_V:.1f} mV over the tested range (standard error "
                f"{1e3 * side.trend_change_se_V:.1f} mV, p = {side.trend_p:.2g}): too little to be called a trend, so "
                "beta is 1. What systematic errors may make is set by --flat-below"
            ),
            source=None,
        )
    for item in tests:
        share = _sag(item)
        if share > 1 / 3:
            yield Warning_(
                code="pressure-sag",
                text=f"the pressure drop sags by {share:.0%} at full command; a larger pump or accumulator would help",
                source=item.test.source,
            )


def _sag(item: DescribedTest) -> float:
    """Return the share of the pressure drop that is lost at full command."""
    test = item.test
    if item.dp is None or test.dp is None:
        return 0.0
    return 1 - float(np.median(test.dp[test.u >= 0.97 * test.u.max()])) / item.dp


def _about_declarations(tests: tuple[DescribedTest, ...]) -> Iterator[Warning_]:
    for item in tests:
        if not item.test.dp_is_declared:
            continue
        yield Warning_(
            code="declared-pressure",
            text=(
                "the pressure drop is declared, not recorded: if it sags under flow, the knee is found too low (21 mV "
                "for 5 % on a 10 V valve like the example's). Record dP (or pA and pB)"
            ),
            source=item.test.source,
        )


def _about_the_edge(side: SideModel, group: DescribedTests, u_max: float) -> Iterator[Warning_]:
    floor = group.floor / L_MIN
    if floor > 0:
        yield Warning_(
            code="onset-hidden",
            text=(
                f"the flow meter starts at {floor:.2f} L/min: a leak or a soft edge below that flow can't be observed, "
                "and the certificate says nothing about it"
            ),
            source=None,
        )
    for test, item in zip(side.tests, group.tests, strict=True):
        knee = test.u_knee_rising_V if test.u_knee_falling_V is None else test.u_knee_falling_V
        if knee is not None and knee - test.u_guard_V > SOFT_EDGE * u_max and not item.closing_branch.tail.hole:
            yield Warning_(
                code="soft-edge",
                text=(
                    "the edge is soft: the first flows that count lie on a line that comes to zero "
                    f"{1e3 * (knee - test.u_guard_V):.0f} mV below the knee. Its zero is guarded instead of the knee, "
                    "at the price of that much residual dead zone"
                ),
                source=test.source,
            )
        leak = _leak_in_overlap(item, test.u_guard_V)
        if leak > max(LEAK_SHARE * item.q_max, group.floor):
            yield Warning_(
                code="leak",
                text=(
                    f"{leak / L_MIN:.3g} L/min more flows at {OVERLAP[1]:.0%} of the threshold than near zero: a leak "
                    "inside the overlap, which the compensator's offset lets through at zero command"
                ),
                source=test.source,
            )


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
