"""What a fixed compensation leaves of the dead zone at the tested pressure drops, beside the law that reads them."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import falling_corners, remaining_dead_zone
from dzdesign.design.fixed.characteristic import Characteristic
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.identify.valve.ramp_result import TestResult


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedDeadZone:
    """Dead zone up to the knee at one tested pressure drop, as shares of command by recorded branch."""

    side: str
    dp_MPa: float
    #: Of the fixed compensation; infinite where no command opens the valve.
    fixed: Mapping[str, float]
    #: Of the compensator, which reads the pressures.
    law: Mapping[str, float]
    #: Flow on closing at the end of the design's transition, L/min; None without one, or without a falling branch.
    fixed_end_L_min: float | None
    law_end_L_min: float | None


def dead_zones(compensator: Compensator, characteristic: Characteristic, sign: int = 1) -> tuple[FixedDeadZone, ...]:
    """Return what a characteristic leaves at each tested pressure drop of a side, and what the compensator leaves."""
    tests = compensator.valve.sides[SIDE_NAMES[sign]].tests
    return tuple(_at_test(compensator, characteristic, test, sign) for test in tests)


def _at_test(compensator: Compensator, characteristic: Characteristic, test: TestResult, sign: int) -> FixedDeadZone:
    end_code, signals = compensator.transition_end, compensator.signals
    dp_code = round(signals.dp_code(Fraction(repr(test.dp_MPa))))
    knees = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
    by_law = falling_corners(compensator, dp_code, sign).at_end
    by_fixed = float(characteristic.drive(Fraction(end_code, signals.command.span(sign))))
    return FixedDeadZone(
        side=SIDE_NAMES[sign],
        dp_MPa=test.dp_MPa or 0.0,
        fixed={
            branch: _left(characteristic, Fraction(repr(knee)) / compensator.u_max_V)
            for branch, knee in knees.items()
            if knee is not None
        },
        law=remaining_dead_zone(compensator, test, sign),
        fixed_end_L_min=_flow_at_end(compensator, test, by_fixed),
        law_end_L_min=_flow_at_end(compensator, test, by_law),
    )


def _left(characteristic: Characteristic, knee: Fraction) -> float:
    found = characteristic.command_at(knee)
    return float("inf") if found is None else float(found)


def _flow_at_end(compensator: Compensator, test: TestResult, drive: float) -> float | None:
    """Return the flow on closing that a drive makes, as the straight part of the test has it, L/min."""
    if not compensator.transition_end or test.u_knee_falling_V is None:
        return None
    return test.slope_L_min_V * max(drive * float(compensator.u_max_V) - test.u_knee_falling_V, 0.0)
