"""What is weak in the flow meter's readings: its steps, its lag, its noise, what it reads at rest."""

from collections.abc import Iterator, Mapping

import numpy as np

from dzdesign.identify.constants import L_MIN, Shown
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.fitting.low_flow import Lowered, unseen_of_curve
from dzdesign.identify.knees.described_tests import DescribedTest, DescribedTests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.guard_curve import Guard
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.side_model import PROMISED, SideModel

#: Shift of the knees by the meter's lag, over u_max, above which a declared lag is not to be taken unchecked.
NOTED_LAG = 1.5e-3
#: Lag that a flow meter without a word about it may well have, s.
LIKELY_LAG = 0.1
#: Half a step of the flow, as a shift of the threshold over u_max, above which it matters whether it was cut off.
COARSE_STEP = 5e-4
#: The same where it is more than the bounds' distance from the threshold: a certificate that counts on less is none.
SMALL_SHIFT = 5e-5
#: Readings a level, from which a flow is one of steps.
READINGS_A_LEVEL = 5
#: Times the level, the flow of the reading that a message asks for.
ASKED = 2.0


def about_the_meter(side: SideModel, group: DescribedTests, options: IdentifyOptions) -> Iterator[Warning_]:
    """Yield the warnings about the flow meter, of one side."""
    yield from _about_a_hidden_zero(side)
    yield from _about_a_leak(side)
    yield from _about_the_zero_flow(side, group)
    yield from _about_the_noise_level(side, options)
    yield from _about_steps(side, group.tests, options)
    yield from _about_the_lag(group, options)


def _about_a_hidden_zero(side: SideModel) -> Iterator[Warning_]:
    """Say that readings at rest are one number where the meter scatters, so that its zero error does not show."""
    unseen = side.certificate.unseen_below_L_min
    if unseen > side.certificate.level_L_min:
        shift_mV = 1e3 * max(unseen / test.slope_L_min_V for test in side.tests)
        yield warn("zero-hidden", zero_L_min=unseen, shift_mV=shift_mV)


def _about_a_leak(side: SideModel) -> Iterator[Warning_]:
    worst = max(side.tests, key=lambda test: test.leak_L_min)
    if worst.leak_L_min > 0 and worst.dp_MPa:
        shift_mV = 1e3 * max(test.leak_L_min / test.slope_L_min_V for test in side.tests)
        leak = worst.leak_L_min
        yield warn("leak", worst.source, per_MPa=leak / worst.dp_MPa, leak_L_min=leak, shift_mV=shift_mV)


def _about_the_zero_flow(side: SideModel, group: DescribedTests) -> Iterator[Warning_]:
    """Say of a declared flow at zero that a leak alone is more, or that it can't be told from none."""
    declared, allowed = side.certificate.zero_flow_L_min, side.zero_flow_L_min
    if declared is None or allowed is None or allowed <= PROMISED * declared:
        return
    rest = [flow / L_MIN for flow, _ in group.at_rest]
    worst = max(side.tests, key=lambda test: test.zero_flow_L_min or 0.0)
    numbers = {"declared_L_min": declared, "allowed_L_min": allowed}
    if max(group.leak) > 0 and max(rest) > declared:
        above = [(test.dp_MPa or 0.0, flow) for test, flow in zip(side.tests, rest, strict=True) if flow > declared]
        places = ", ".join(f"{Shown(dp):.3g #MPa}" for dp, _ in above[:-1])
        flows = ", ".join(f"{Shown(flow):.3g #L/min}" for _, flow in above[:-1])
        comma = ", " if len(above) > 1 else ""
        yield warn(
            "zero-flow", worst.source, "leak",
            leaks=f"{flows}{comma}{Shown(above[-1][1]):.3g L/min}",
            pressures=f"{places}{comma}{Shown(above[-1][0]):.3g MPa}",
            **numbers,
        )  # fmt: skip
    elif len(side.tests) == 1 and rest[0] > 0:
        yield warn("zero-flow", worst.source, "rest", rest_L_min=max(rest), **numbers)
    else:
        yield warn("zero-flow", worst.source, "unresolved", **numbers)


def _about_the_noise_level(side: SideModel, options: IdentifyOptions) -> Iterator[Warning_]:
    if options.noise_level is None:
        return
    declared, worst = options.noise_level / L_MIN, max(side.tests, key=lambda test: test.noise_level_L_min)
    if min(worst.noise_level_L_min, side.certificate.unseen_below_L_min) > 1.001 * declared:
        yield warn("noise-level", worst.source, declared_L_min=declared, level_L_min=worst.noise_level_L_min)


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
        shift_mV = 1e3 * fastest * LIKELY_LAG
        yield warn("lag-unknown", lag_s=LIKELY_LAG, shift_mV=shift_mV, rate_V_s=fastest, longest_s=lag.longer)
    if lag.origin == "declared" and not lag.seen_by_rates and fastest * lag.seconds > NOTED_LAG * options.u_max:
        shift_mV, tolerance_mV = 1e3 * fastest * lag.seconds, 1e3 * fastest * lag.shorter
        yield warn("lag-unchecked", lag_s=lag.seconds, shift_mV=shift_mV, rate_V_s=fastest, tolerance_mV=tolerance_mV)
    if lag.contradicted_by is not None:
        found, se = lag.contradicted_by
        case = "rates" if found >= 0 else "late"
        yield warn("lag-contradicted", None, case, lag_s=lag.seconds, found_s=abs(found), se_s=se)
    elif lag.seconds < 0:
        late, shift_mV = -lag.seconds, -1e3 * fastest * lag.seconds
        yield warn("command-late", late_s=late, error_s=lag.longer, shift_mV=shift_mV, rate_V_s=fastest)


def about_low_flow(side: SideModel, lowered: Mapping[Guard, Lowered]) -> Iterator[Warning_]:
    """Yield the warnings about the readings of one side: thresholds that were lowered, and tests without a reading."""
    for guard, each in lowered.items():
        yield warn(
            "low-flow", each.by.source, "lowered",
            guard=guard, depth_mV=1e3 * each.depth, flow_L_min=each.by.at_least_L_min, u_V=each.by.u_V,
            dp_MPa=each.by.dp_MPa,
        )  # fmt: skip
    if not side.low_flow:
        return
    guard, level = side.certificate.guard, side.certificate.level_L_min
    unseen = unseen_of_curve(side.low_flow, guard, side.curve, level)
    if unseen.unconfirmed:
        middle = len(side.tests) // 2
        recorded = side.tests[middle].recorded
        shown = recorded.closing if guard == "closing" else recorded.opening
        yield warn(
            "low-flow", None, "unconfirmed",
            branch=guard, level_L_min=level, flow_L_min=ASKED * level, dp_MPa=side.curve.dp_MPa[middle],
            u_V=shown.command_at(ASKED * level) or shown.u_V[-1],
        )  # fmt: skip
    if unseen.missing and not unseen.unconfirmed:
        first = unseen.missing[0]
        yield warn(
            "low-flow", None, "short",
            count=len(unseen.missing), tests=len(side.tests), branch=guard, dp_MPa=side.curve.dp_MPa[first],
            u_V=side.curve.u_threshold_V[first], level_L_min=level,
        )  # fmt: skip
