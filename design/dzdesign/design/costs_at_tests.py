"""The law at one pressure drop as straight parts, and the dead zone that it leaves at the tests: onset, flow, drive."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.reading_flow import ideal_line


@dataclass(frozen=True, slots=True, kw_only=True)
class LawCorners:
    """The law at one pressure drop, two straight parts behind the zero band, all over full command and full drive."""

    #: Drive in the zero band, at the transition's end and at full command.
    offset: float
    at_end: float
    full: float
    #: Command at the ends of zero band and transition, 0 without one; and beyond which the drive leaves its rest.
    zero_band: float
    end: float
    leaves: float

    def command_at(self, drive: float) -> float:
        """Return the command at which the drive reaches a threshold."""
        if drive <= self.at_end and self.end:
            passed = (drive - self.offset) / (self.at_end - self.offset) if self.at_end > self.offset else 0.0
            return self.zero_band + (self.end - self.zero_band) * passed
        return self.end + (1 - self.end) * (drive - self.at_end) / (self.full - self.at_end)


#: Shares of the largest flow at which the recorded branches are compared.
LEVELS = tuple(level / 100 for level in range(5, 100))


def branch_commands(test: TestResult) -> Iterator[tuple[float, float]]:
    """Yield the commands, V, at which opening and closing branch pass a flow, level by level; of one branch none."""
    recorded = test.recorded
    if recorded.rising is None or recorded.falling is None:
        return
    for level in LEVELS:
        up, down = (each.command_at(level * recorded.q_max_L_min) for each in (recorded.rising, recorded.falling))
        if up is not None and down is not None:
            yield up, down


def corners_of(compensator: Compensator, dp_code: int, sign: int) -> LawCorners:
    """Return the law's corners at a difference of pressure codes."""
    command, end = compensator.signals.command, compensator.transition_end
    span = command.span(sign)
    at = (command.zero_code + command.direction(sign) * from_zero for from_zero in (0, end, span))
    offset, at_end, full = (float(compensator.drive(code, dp_code, sign)) for code in at)
    leaves = compensator.drive_functions.leave_zero_codes / span if compensator.zero_band_codes else 0.0
    zero_band = compensator.zero_band_codes / span
    return LawCorners(offset=offset, at_end=at_end, full=full, zero_band=zero_band, end=end / span, leaves=leaves)


@dataclass(frozen=True, slots=True, kw_only=True)
class CostAtTest:
    """What remains at one tested pressure drop, by branch where there are two; shares are of full command or drive."""

    side: str
    dp_MPa: float
    offset_V: float
    #: Dead zone to the knee; missing where the branch was not recorded, or `above_knee_V` says more.
    onset: Mapping[str, float]
    #: By how much the offset lies above the knee, so that flow passes at zero command.
    above_knee_V: Mapping[str, float]
    #: Flow that was declared to be allowed at zero command, of the guarded branch; empty if none was.
    allowed_L_min: Mapping[str, float]
    #: Flow on closing at the transition's end, None without one.
    at_end_L_min: float | None
    reading_flow_L_min: float
    #: Command at which the reading flow passes, and that of an ideal line to the largest flow.
    read: Mapping[str, float]
    ideal: float
    #: Dead zone on opening of the declared machine that opens last: infinite where no command opens it, None where no
    #: machine is declared or no rising branch was recorded.
    last_opening: float | None
    #: Drive at full command, and the command from which it no longer rises, None where that is full command.
    full: float
    limited_from: float | None

    def text(self, units: RecordedUnits) -> str:
        """Return all of it as one line."""
        parts = [f"{units.text(self.dp_MPa, '.2f MPa')}: offset {units.text(self.offset_V, '.3f V')}"]
        for name in ("opening", "closing"):
            if name in self.onset:
                parts.append(f"dead zone that remains on {name} {self.onset[name]:.2%} of command (knee)")
            elif name in self.above_knee_V:
                above = units.text(self.above_knee_V[name], ".3f dV")
                allowed = self.allowed_L_min.get(name)
                of_it = "" if allowed is None else f", of which {units.text(allowed, '.3g L/min')} are allowed"
                parts.append(f"flow at zero command on {name}{of_it}: the offset lies {above} above the knee")
        if self.at_end_L_min is not None:
            parts.append(f"flow on closing at the transition's end {units.text(self.at_end_L_min, '.2f L/min')}")
        read = " and ".join(f"{share:.2%} on {name}" for name, share in self.read.items())
        at = units.text(self.reading_flow_L_min, ".2f L/min")
        parts.append(f"read at {at} {read or 'nothing: the valve never passes it'} (ideal line {self.ideal:.2%})")
        if self.limited_from is None:
            parts.append(f"drive at full command {self.full:.2%}")
        else:
            parts.append(f"the largest drive, {self.full:.2%}, is reached at {self.limited_from:.1%} of command")
        return ", ".join(parts)


def costs_at_tests(compensator: Compensator, sign: int) -> tuple[CostAtTest, ...]:
    """Return what remains at every tested pressure drop of a side; an output that never opens the valve is refused."""
    tests = compensator.valve.side(sign).tests
    return tuple(_cost_at_test(compensator, test, sign) for test in tests)


def _cost_at_test(compensator: Compensator, test: TestResult, sign: int) -> CostAtTest:
    side, u_max = compensator.valve.side_name(sign), float(compensator.u_max_V)
    corners = corners_of(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign)
    corners_of_falling = falling_corners(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign)
    offset_V, left = corners.offset * u_max, remaining_dead_zone(compensator, test, sign)
    knees = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
    above = {name: offset_V - knee for name, knee in knees.items() if knee is not None and knee < offset_V}
    limit = compensator.drive_functions.compare_limit / compensator.signals.compare_max
    opens = max(corners.offset, (test.u_knee_rising_V or 0.0) / u_max)
    if limit <= opens:
        at = compensator.valve.recorded_units.of_side(side).text(test.dp_MPa or 0.0, ".2f MPa")
        raise InputError(
            f"the largest output is {limit:.1%} of full drive, but the valve opens at {opens:.1%} at {at}, so nothing "
            "would ever flow; give a larger --output-max"
        )
    allowed = test.zero_flow_L_min
    return CostAtTest(
        side=side,
        dp_MPa=test.dp_MPa or 0.0,
        offset_V=offset_V,
        onset={name: share for name, share in left.items() if name not in above},
        above_knee_V=above,
        allowed_L_min={} if allowed is None else {compensator.side(sign).certificate.guard: allowed},
        at_end_L_min=flow_at_end(compensator, test, corners_of_falling.at_end),
        reading_flow_L_min=compensator.reading_flow_L_min,
        read=read_dead_zone(compensator, test, sign),
        ideal=ideal_line(compensator.reading_flow_L_min, test.recorded.q_max_L_min),
        last_opening=last_opening(compensator, test, sign),
        full=min(limit, corners.full),
        limited_from=corners.command_at(limit) if limit < corners.full else None,
    )


def flow_at_end(compensator: Compensator, test: TestResult, drive: float) -> float | None:
    """Return the flow on closing that a drive makes at the transition's end, by the straight part of a test, L/min.

    None without a transition, or without a falling branch.
    """
    if not compensator.transition_end or test.u_knee_falling_V is None:
        return None
    return test.slope_L_min_V * max(drive * float(compensator.u_max_V) - test.u_knee_falling_V, 0.0)


def remaining_dead_zone(compensator: Compensator, test: TestResult, sign: int = 1) -> dict[str, float]:
    """Return the dead zone that the law leaves at a tested pressure drop, as a share of command, by branch.

    The test need not be of the valve that the law was designed for. A branch that was not recorded is left out; the
    share is 0 where flow passes at zero command.
    """
    knees = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
    return _commands_at(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign, knees)


def last_opening(compensator: Compensator, test: TestResult, sign: int) -> float | None:
    """Return the dead zone on opening, a share of command, of the machine that opens last; as in `CostAtTest`."""
    if compensator.machine is None or test.u_knee_rising_V is None:
        return None
    knee = float(compensator.machine.largest_factor) * test.u_knee_rising_V / float(compensator.u_max_V)
    if knee > compensator.drive_functions.compare_limit / compensator.signals.compare_max:
        return inf
    return corners_of(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign).command_at(knee)


def between_tests(compensator: Compensator, sign: int) -> float:
    """Return the largest dead zone on opening that the law leaves between the tests of a side, a share of command.

    There the opening knee is taken as straight. The law's beta is so between the table's nodes, so that one of these,
    or a test, has the largest. 0 without a rising branch, without pressure, and of tests with no node between.
    """
    tests = compensator.valve.side(sign).tests
    known = [
        (test.dp_MPa, test.u_knee_rising_V)
        for test in tests
        if test.dp_MPa is not None and test.u_knee_rising_V is not None
    ]
    if len(known) < len(tests):
        return 0.0
    dp_MPa, knees_V = zip(*known, strict=True)
    pair = compensator.signals.pair(sign)
    low, high = (pair.code_at(end) for end in (dp_MPa[0], dp_MPa[-1]))
    step = compensator.beta_step_codes
    found = [0.0]
    for code in range((low // step + 1) * step, high, step):
        knee = float(np.interp(float(pair.dp_MPa(code)), dp_MPa, knees_V))
        found.append(_commands_at(compensator, code, sign, {"opening": knee})["opening"])
    return max(found)


def read_dead_zone(compensator: Compensator, test: TestResult, sign: int = 1) -> dict[str, float]:
    """Return the command at which the compensated valve passes the reading flow, as a share of full, by branch.

    It is read from the recorded flow; a branch that was not recorded, or never comes to that flow, is left out.
    """
    flow, recorded = compensator.reading_flow_L_min, test.recorded
    thresholds = {
        "opening": recorded.rising.command_at(flow) if recorded.rising else None,
        "closing": recorded.falling.command_at(flow) if recorded.falling else None,
    }
    return _commands_at(compensator, compensator.signals.pair(sign).code_at(test.dp_MPa), sign, thresholds)


def falling_corners(compensator: Compensator, dp_code: int, sign: int) -> LawCorners:
    """Return the law's corners for a falling command, which an inverse play lowers by its width."""
    corners, functions = corners_of(compensator, dp_code, sign), compensator.drive_functions
    nodes = functions.play_counts[0 if sign > 0 else 1]
    if not nodes:
        return corners
    codes = (compensator.transition_end, compensator.signals.command.span(sign))
    widths = np.interp(codes, np.arange(len(nodes)) * functions.play_step_codes, nodes)
    at_end, at_full = (float(width) / compensator.signals.compare_max for width in widths)
    return replace(corners, at_end=corners.at_end - at_end, full=corners.full - at_full)


def _commands_at(
    compensator: Compensator, dp_code: int, sign: int, thresholds_V: Mapping[str, float | None]
) -> dict[str, float]:
    """Return the command at which the drive reaches each threshold that there is, at a difference of pressure codes."""
    corners = corners_of(compensator, dp_code, sign)
    shares = {name: at / float(compensator.u_max_V) for name, at in thresholds_V.items() if at is not None}
    branches = {"opening": corners, "closing": falling_corners(compensator, dp_code, sign)}
    found = {name: max(branches[name].command_at(at), 0.0) for name, at in shares.items()}
    if "opening" in found:  # from rest the drive leaves the zero band at its outer end
        found["opening"] = max(found["opening"], corners.leaves)
    return found
