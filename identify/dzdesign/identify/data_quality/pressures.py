"""What is weak in the pressure drop of recordings: a stuck sensor, a number typed in, flows that contradict it.

Recordings are those of one side, their commands and flows positive.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from dzdesign.identify.constants import FULL_SWEEP, L_MIN, MPA
from dzdesign.identify.data_quality.catalogue import warn
from dzdesign.identify.ramps.pooling import SAME_PRESSURE
from dzdesign.identify.ramps.splitting import SHUT
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.series import contradicts
from dzdesign.identify.valve.model import Warning_
from dzdesign.identify.valve.ramp_result import TestResult

#: Pressure drops that differ by less than this share are one number: averaging may round the last digit.
ONE_NUMBER = 1e-12
#: Pressure drops that differ by more than this factor are several, or one that does not stand still.
APART = 1.2
#: Share of the readings, at either end, among which spikes may lie.
OUTERMOST = 0.005
#: Flows are compared within this share of the largest command that all recordings reach.
NEAR_TOP = 0.02
#: A flow below this share of the largest one is none to compare: the command does not open the valve.
SMALL_FLOW = 0.05
#: A sensor scatters if its reading changes from row to row in this share of them, among so many levels: one whose last
#: digit only flickers where a level ends may well stand still at another pressure, for fewer rows than these.
CHANGES, SCATTERED_LEVELS, ROWS = 0.2, 4, 100
#: Share by which the flows of recordings that are taken as one test may differ: twice what warmer oil or a repeated
#: ramp may do, and what pressure drops of a factor of 1.7 do.
GROSSLY_APART = 0.3
#: Flow gains of two tests contradict their pressure drops if that at the higher one is less than this share of the
#: other, or differs by these factors from the root: by 0.70 from 0.5 to 5 MPa does that of the paper's valve, and one
#: that keeps its flow the same by less than 2.5 up to a range of 1 to 6.
FALLS, GROWS_TOO_LITTLE, GROWS_TOO_MUCH = 0.9, 2.5, 1.75
#: Flow gains do not grow at all if over pressure drops of this factor they do so by less than this power: the root has
#: 0.5, the paper's valve 0.35.
WIDE_APART, NO_GROWTH = 1.4, 0.12


def about_single_pressures(tests: Sequence[RampTest]) -> tuple[Warning_, ...]:
    """Return what is weak in the pressure drop of single recordings; of a stuck one not that it was typed in."""
    stuck = tuple(about_stuck_recordings(tests))
    known = {item.source for item in stuck}
    return (*stuck, *(item for item in about_typed_pressures(tests) if item.source not in known))


def _flows_at_one_command(tests: Sequence[RampTest]) -> tuple[float, list[float]]:
    """Return the largest command that all recordings reach, V, and each one's flow there; zero where that is small."""
    top = min(test.top for test in tests)
    flows = []
    for test in tests:
        away = np.abs(test.u - top)
        flows.append(float(np.median(test.q[away <= max(NEAR_TOP * top, away.min())])))
    return top, [flow if flow > SMALL_FLOW * max(flows) else 0.0 for flow in flows]


def about_stuck_recordings(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield a warning for each recording whose pressure drop is one number to the last digit, and should not be.

    That is so where other recordings' readings scatter, or where the file's name says another pressure.
    """
    scatters = any(_scatters(test) for test in tests)
    for test in sorted(tests, key=lambda test: test.source):
        dp = _one_number(test)
        if dp is None:
            continue
        stated = contradicts(test.source.rpartition("/")[2], dp)
        signs = ["that of other recordings scatters"] if scatters and test.u.size >= ROWS else []
        signs += [f"the file's name says {stated}"] if stated else []
        if signs:
            yield warn("pressure-stuck", test.source, dp_MPa=dp / MPA, signs=" and ".join(signs))


def about_typed_pressures(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield a warning for each recording, if the pressure drop of every one is one number: nothing was measured."""
    recorded = [test for test in tests if test.dp is not None and not test.dp_is_declared]
    typed = [(dp, test.source) for test in recorded if (dp := _one_number(test)) is not None]
    for dp, source in sorted(typed) if len(typed) == len(recorded) else ():
        yield warn("declared-pressure", source, "typed", dp_MPa=dp / MPA)


def _one_number(test: RampTest) -> float | None:
    """Return a recorded pressure drop (Pa) that is one number to the last digit; None if it is not, or was declared."""
    if test.dp is None or test.dp_is_declared or test.dp.size < 2:
        return None
    first = float(test.dp[0])
    return first if float(np.ptp(test.dp)) <= ONE_NUMBER * abs(first) else None


def _scatters(test: RampTest) -> bool:
    if test.dp is None or test.dp_is_declared:
        return False
    low, high = np.quantile(test.dp, [OUTERMOST, 1 - OUTERMOST])
    inner = test.dp[(test.dp >= low) & (test.dp <= high)]
    return float(np.mean(np.diff(test.dp) != 0)) > CHANGES and np.unique(inner).size >= SCATTERED_LEVELS


def about_mixtures(tests: Sequence[RampTest]) -> Iterator[Warning_]:
    """Yield a warning for each pressure drop at which recordings, taken as one test, differ grossly in their flow."""
    tops = [test.top for test in tests]
    whole = [test for test, top in zip(tests, tops, strict=True) if top >= FULL_SWEEP * max(tops)]
    for dp, group in _at_one_pressure(whole):
        top, flows = _flows_at_one_command(group)
        if min(flows) <= 0 or max(flows) <= (1 + GROSSLY_APART) * min(flows):
            continue
        least, most = (group[flows.index(extreme(flows))].source for extreme in (min, max))
        yield warn(
            "flow-contradicts-dp", None, "one-test", dp_MPa=dp / MPA, u_V=top, least_L_min=min(flows) / L_MIN,
            least=least, most_L_min=max(flows) / L_MIN, most=most,
        )  # fmt: skip


def _at_one_pressure(tests: Sequence[RampTest]) -> Iterator[tuple[float, list[RampTest]]]:
    """Yield recordings of one pressure drop, two or more, their flows brought to it, and that, Pa.

    A recording that was run at several pressure drops, or whose valve is never shut, belongs to none.
    """
    steady = []
    for test in tests:
        if test.dp is None:
            continue
        shut = test.dp[test.u <= SHUT * test.u.max()]
        low, dp, high = np.quantile(shut, [0.05, 0.5, 0.95]) if shut.size else (0.0, 0.0, 0.0)
        if 0 < high < APART * low:
            at_nominal = np.sqrt(dp / np.maximum(test.dp, SMALL_FLOW * dp))
            steady.append((float(dp), replace(test, q=test.q * at_nominal)))
    steady.sort(key=lambda pair: (pair[0], pair[1].source))
    while steady:
        lowest = steady[0][0]
        group = [test for dp, test in steady if dp <= (1 + SAME_PRESSURE) * lowest]
        if len(group) > 1:
            yield lowest, group
        steady = steady[len(group) :]


def about_flow_gains(tests: Sequence[TestResult]) -> Iterator[Warning_]:
    """Yield a warning for each test whose flow gain contradicts its pressure drop, by those of the other tests.

    The gain beyond the knee, and not the flow at one command, is compared: a supply at its limit and a knee that moves
    leave it as it is. The tests stand in the order of rising pressure drop.
    """
    left = [test for test in tests if test.dp_MPa is not None and test.slope_L_min_V > 0]
    # Without the worst one the others may agree; of two, either may be wrong, and both are named.
    while len(left) > 1:
        against = [[other for other in left if _contradict(test, other)] for test in left]
        per_root = [test.slope_L_min_V / float(test.dp_MPa or 1) ** 0.5 for test in left]
        usual = float(np.median(per_root))
        worst = max(range(len(left)), key=lambda at: (len(against[at]), abs(np.log(per_root[at] / usual))))
        if not against[worst]:
            yield from _about_no_growth(left)
            return
        test, other = left.pop(worst), against[worst][0]
        expected = float(np.median([value for at, value in enumerate(per_root) if at != worst]))
        expected *= float(test.dp_MPa or 1) ** 0.5
        yield warn(
            "flow-contradicts-dp", test.source, "flow-gains", gain=test.slope_L_min_V, dp_MPa=test.dp_MPa,
            expected=expected, other_gain=other.slope_L_min_V, other_dp_MPa=other.dp_MPa, other=other.source,
        )  # fmt: skip


def _about_no_growth(tests: Sequence[TestResult]) -> Iterator[Warning_]:
    """Say of flow gains that are the same at all pressure drops that these are not the valve's, or do not act on it."""
    low, high = tests[0], tests[-1]
    dp, gains = (np.log([getattr(test, key) for test in tests]) for key in ("dp_MPa", "slope_L_min_V"))
    away = dp - dp.mean()
    if dp[-1] - dp[0] > np.log(WIDE_APART) and away @ gains < NO_GROWTH * (away @ away):
        yield warn(
            "flow-contradicts-dp", None, "no-growth", gain=low.slope_L_min_V, dp_MPa=low.dp_MPa,
            other_gain=high.slope_L_min_V, other_dp_MPa=high.dp_MPa,
            expected=low.slope_L_min_V * float(np.exp((dp[-1] - dp[0]) / 2)),
        )  # fmt: skip


def _contradict(one: TestResult, other: TestResult) -> bool:
    """Tell whether the flow gains of two tests can't be of one valve at their pressure drops."""
    low, high = sorted((one, other), key=lambda test: test.dp_MPa or 0.0)
    pressures = float(high.dp_MPa or 1) / float(low.dp_MPa or 1)
    gains = high.slope_L_min_V / low.slope_L_min_V
    grown = gains / pressures**0.5
    return pressures > APART and (gains < FALLS or not 1 / GROWS_TOO_LITTLE < grown < GROWS_TOO_MUCH)
