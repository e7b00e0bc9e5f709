"""Ramp tests made comparable: zero error out, branches apart, at the nominal pressure drop, in order, described."""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.identify.constants import FULL_SWEEP, L_MIN, MPA, SMALLEST_DP, ANYWHERE_MPa, Shown
from dzdesign.identify.knees.between_ramps import BetweenRamps, compare_ramps, knees_of_ramps
from dzdesign.identify.knees.characteristic import describe_branches
from dzdesign.identify.knees.described_tests import DescribedTest, DescribedTests
from dzdesign.identify.knees.gated_line import BranchShape, prepare_branch
from dzdesign.identify.knees.meter import MeterLag, find_lag, find_meter_floor, known_floor
from dzdesign.identify.knees.profile import largest_at_top
from dzdesign.identify.knees.readings_at_rest import find_rest_flows, hidden_zero
from dzdesign.identify.knees.refusals import (
    refuse_a_jump,
    refuse_a_shut_valve,
    refuse_a_total,
    refuse_a_wrong_pressure,
    refuse_an_impossible_knee,
    refuse_an_open_valve,
    refuse_mixed_branches,
    refuse_two_directions,
    refuse_two_signs_of_flow,
)
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.pooling import PooledTest, name_of_ramp, pool_ramps
from dzdesign.identify.ramps.splitting import Ramp, dp_under_flow, nominal_dp, split_ramps
from dzdesign.identify.ramps.sweep_pressure import NO_PRESSURE
from dzdesign.identify.reading.column_labels import PER_CENT
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.scaling import units_of
from dzdesign.identify.reading.series import with_clock_of_series
from dzdesign.identify.valve.left_out import left_out_in_words

logger = logging.getLogger(__name__)

#: A recording whose command moves by less than this share of u_max is no part of a ramp.
SMALLEST_SWEEP = 0.1


def describe_tests(tests: Sequence[RampTest], options: IdentifyOptions) -> DescribedTests:
    """Make ramp tests, in any order, comparable and describe their branches.

    Raises
    ------
    InputError
        For a test that holds no ramp or no flow, and for tests that can't stand beside one another.
    """
    refuse_two_directions(tests)
    for test in tests:
        refuse_a_total(test)
        refuse_an_open_valve(test, options.u_max)
    rest = find_rest_flows(tests, options.u_max)
    as_read = tests
    tests = [replace(test, q=test.q - flow) for test, flow in zip(tests, rest.flows, strict=True)]
    tests = with_clock_of_series(tests)
    ramps = split_recordings(tests, options, options.meter_lag or 0.0)
    lag = find_lag(ramps, options)
    pooled = pool_ramps(ramps if lag.origin != "identified" else split_recordings(tests, options, lag.seconds))
    # What was read of all ramps together may fall together with the next test's by a hair.
    pooled = sorted(pooled, key=lambda item: (nominal_dp(item.test) or 0.0, item.test.source))
    left_out = dict.fromkeys(part for item in pooled for part in item.left_out)
    for line in left_out_in_words(left_out, units_of(tests)):
        logger.info("%s", line)
    _refuse_what_shows_no_dead_zone(pooled, options)
    known = known_floor(tests, options)
    floor = found_floor(pooled, options) if known is None else known
    described = _described(pooled, floor, lag, options)
    refuse_mixed_branches(described)
    between = [_between_ramps(described, column, options) for column in (0, 1)]
    if any(np.any(shift != 0) for found in between if found for shift in found.shifts):
        moved = [_with_ramps_together(item, row, between) for row, item in enumerate(pooled)]
        described = _described(moved, floor, lag, options)
    return DescribedTests(
        tests=tuple(described),
        between_ramps=(between[0], between[1]),
        floor=floor,
        lag=lag,
        zero_L_min={source: zero / L_MIN for source, zero in rest.zero.items() if zero},
        hidden_zero=hidden_zero(as_read, floor, options),
        # Of several recordings pooled to one test, the worst: each stands for its own part of the ramp.
        zero_se=tuple(max(rest.se.get(name, 0.0) for name, _ in item.files) for item in described),
        leak=tuple(rest.leak_per_Pa * (item.dp or 0.0) for item in described),
        at_rest=tuple(rest.passed_by_the_valve([name for name, _ in item.files], item.dp) for item in described),
    )


def split_recordings(tests: Sequence[RampTest], options: IdentifyOptions, lag: float) -> list[Ramp]:
    """Split every recording into ramps; refuse what has no ramp, too large a command, a wrong pressure, or no flow.

    The flow meter's lag is in s.
    """
    ramps, split = list[Ramp](), list[list[Ramp]]()
    tops = [test.top for test in tests]
    for test, top in zip(tests, tops, strict=True):
        if top > 1.05 * options.u_max:
            above = "'{source}': the command reaches {top:.2f V}, above u_max = {u_max:g V}; give --u-max"
            raise InputError(worded(above, source=test.source, top=top, u_max=options.u_max))
        if test.dp is None and len(tests) > 1:
            raise InputError(
                f"'{test.source}' has no column of dP (or pA and pB); several ramp tests can only be told apart by it: "
                "record it, or declare it by --dp or [dp]"
            )
        if lag != 0 and not np.ptp(test.time) > 0:
            raise InputError(
                f"'{test.source}': the time stands still at {test.time[0]:g} s, so the meter's lag can't be taken out; "
                "correct the column of time, or leave out --meter-lag"
            )
        found = split_ramps(test, lag)
        if np.ptp(test.u) < SMALLEST_SWEEP * options.u_max or not any(ramp.branches for ramp in found):
            raise _no_ramp(test)
        split.append(found)
    refuse_two_signs_of_flow([ramp for found in split for ramp in found])
    for found, top in zip(split, tops, strict=True):
        for ramp in found:
            _refuse_what_has_no_pressure(ramp, options.u_max)
            refuse_a_wrong_pressure(name_of_ramp(ramp), ramp.dp, ramp.test.dp_sign)
        for item in pool_ramps(found) if top >= FULL_SWEEP * max(tops) else ():  # a fragment may well see no flow
            refuse_a_shut_valve(item.test, item.branches, options.u_max)
        ramps += found
    return ramps


def _refuse_what_has_no_pressure(ramp: Ramp, u_max: float) -> None:
    """Refuse a ramp without a pressure drop at rest by what it shows where oil flows: the pump may have come up late.

    Of a ramp whose flow has the wrong sign the rest before that can't be told from the ramp.
    """
    under_flow = dp_under_flow(ramp.test)
    if ramp.dp is None or under_flow is None or abs(under_flow) < SMALLEST_DP:
        return
    if under_flow >= 0 and ramp.dp >= max(SMALLEST_DP, NO_PRESSURE * under_flow):
        return
    refuse_a_wrong_pressure(name_of_ramp(ramp), under_flow, ramp.test.dp_sign)
    refuse_a_shut_valve(ramp.test, ramp.branches, u_max)


def _no_ramp(test: RampTest) -> InputError:
    return InputError(
        f"'{test.source}' holds no ramp of the command from near zero up: it runs from {Shown(test.u.min()):.2f #V} "
        f"to {Shown(test.u.max()):.2f V}, expected a sweep over half of the command at least, without jumps; record "
        f"it so, from below the threshold{_if_it_is_a_share(test)}"
    )


def _if_it_is_a_share(test: RampTest) -> str:
    """Return how a command of 0 to 1 that is labelled in percent is declared; nothing for any other."""
    column = test.columns.get("u")
    if column is None or column.unit.lower() not in PER_CENT or test.units["command"][0].factor * test.u.max() > 1.01:
        return ""
    return f'; if it is a share of 1, declare --columns "u={column.label}:0..1 = 0..100 %"'


def _refuse_what_shows_no_dead_zone(pooled: list[PooledTest], options: IdentifyOptions) -> None:
    """Refuse a pressure drop without a whole branch, and a recording or a test whose valve never opens."""
    for item in pooled:
        if item.branches == (None, None):
            raise _no_ramp(item.test)
        refuse_a_shut_valve(item.test, item.branches, options.u_max)


def found_floor(pooled: list[PooledTest], options: IdentifyOptions) -> float:
    """Return the meter's floor as the branches show it, m³/s; 0 if none can tell."""
    branches = [branch for item in pooled for branch in item.branches if branch is not None]
    return find_meter_floor(branches, options.u_max)


def _described(pooled: list[PooledTest], floor: float, lag: MeterLag, options: IdentifyOptions) -> list[DescribedTest]:
    """Describe the branches of all tests."""
    reads = [
        prepare_branch(branch, item.test, u_max=options.u_max, floor=floor)
        for item in pooled
        for branch in filter(None, item.branches)
    ]
    for read in reads:
        refuse_a_jump(read, options.u_max)
    shapes = describe_branches(
        reads,
        u_max=options.u_max,
        window=options.knee_window,
        noise_level=options.noise_level,
        longest_lag=lag.longest,
    )
    for shape in shapes:
        refuse_an_impossible_knee(shape.prepared.branch, shape.knee, shape.prepared.source, options.u_max)
    of_tests = iter(shapes)
    return [_describe(item, of_tests) for item in pooled]


def _between_ramps(described: list[DescribedTest], column: int, options: IdentifyOptions) -> BetweenRamps | None:
    """Compare the ramps of the rising (0) or falling (1) branch; None where it was not recorded."""
    shapes = [shape for item in described if (shape := item.shapes[column])]
    if not shapes:
        return None
    known = knees_of_ramps(shapes, [item.ramps for item in described], [item.when for item in described])
    dp_MPa = np.array([ANYWHERE_MPa if item.dp is None else item.dp / MPA for item in described])
    return compare_ramps(known, dp_MPa, [len(item.when) for item in described], options)


def _with_ramps_together(item: PooledTest, row: int, between: Sequence[BetweenRamps | None]) -> PooledTest:
    """Return a test with each ramp's commands moved to the middle of the series and of the test's ramps."""
    rising, falling = (
        replace(branch, u=branch.u - np.repeat(found.shifts[row], branch.counts)) if branch and found else branch
        for branch, found in zip(item.branches, between, strict=True)
    )
    return replace(item, branches=(rising, falling))


def _describe(item: PooledTest, shapes: Iterator[BranchShape]) -> DescribedTest:
    """Put a test together; `shapes` gives those of its branches next."""
    rising, falling = (next(shapes) if branch else None for branch in item.branches)
    return DescribedTest(
        test=item.test,
        dp=nominal_dp(item.test),
        shapes=(rising, falling),
        q_max=largest_at_top([shape.prepared.recorded for shape in (rising, falling) if shape]),
        ramps=item.ramps,
        when=item.when,
        files=item.files,
        left_out=item.left_out,
    )
