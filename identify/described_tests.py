"""Ramp tests made comparable: zero error out, branches apart, at the nominal pressure drop, in order, described."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.branches import Branch, split_branches
from dzdesign.identify.characteristic import BranchShape, describe_branch, find_meter_floor, flow_at_top, smooth_profile
from dzdesign.identify.options import IdentifyOptions
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


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedTest:
    """One ramp test with its nominal pressure drop (Pa, None if unknown), its branches and their shapes."""

    test: RampTest
    dp: float | None
    branches: tuple[Branch | None, Branch | None]
    shapes: tuple[BranchShape | None, BranchShape | None]
    q_max: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedTests:
    """All ramp tests of a valve, in the order of rising pressure drop.

    Attributes
    ----------
    tests : tuple of DescribedTest
        All with the same branches.
    floor : float
        Meter floor, given or found, m³/s.
    zero_L_min : dict
        Source -> flow read at zero command, where it is not zero; it has been subtracted.
    """

    tests: tuple[DescribedTest, ...]
    floor: float
    zero_L_min: dict[str, float]


def describe_tests(tests: Sequence[RampTest], options: IdentifyOptions) -> DescribedTests:
    """Make ramp tests comparable and describe their branches.

    Parameters
    ----------
    tests : sequence of RampTest
        In any order.
    options : IdentifyOptions
        Choices of the engineer.

    Raises
    ------
    InputError
        For a test that holds no ramp or no flow, and for tests that can't stand beside one another.
    """
    if not tests:
        raise InputError("no ramp tests were given; expected at least one file")
    zeros = [_reading_at_zero(test, options.u_max) for test in tests]
    tests = [replace(test, q=test.q - zero) for test, zero in zip(tests, zeros, strict=True)]
    split = _split_all(tests, options)
    floor = options.meter_floor if options.meter_floor is not None else _found_floor(split, options)
    described = _in_order_of_pressure([_describe(*item, floor=floor, options=options) for item in split])
    _refuse_mixed_branches(described)
    return DescribedTests(
        tests=tuple(described),
        floor=floor,
        zero_L_min={test.source: zero / L_MIN for test, zero in zip(tests, zeros, strict=True) if zero},
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
                f"'{test.source}' has no column of dP (or pA and pB); several ramp tests can only be told apart by it: "
                "record it, or declare it by --dp or [dp]"
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


def _refuse_mixed_branches(described: list[DescribedTest]) -> None:
    """Refuse tests of which some have a branch that others lack: they can't be compared."""
    for column, name in ((0, "rising"), (1, "falling")):
        lacking = [item.test.source for item in described if item.shapes[column] is None]
        if lacking and len(lacking) < len(described):
            raise InputError(
                f"'{lacking[0]}' has no {name} branch while other ramp tests have one; "
                "record every pressure drop up and down, or leave that file out"
            )
