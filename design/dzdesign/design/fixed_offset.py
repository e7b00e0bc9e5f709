"""Fixed compensation: the largest offset that needs no pressure, an amplifier's characteristic, and what it leaves.

An amplifier without pressure sensors holds one offset whatever the pressure drop is. It is safe where it lies under
the lower bound of the guarded threshold on the whole tested interval, between the tests too, on the machine that lowers
the threshold furthest. Its characteristic is the law at one pressure drop beyond the transition; in the zero band it is
not the law's offset there, which would open the valve at another pressure drop, but the fixed one.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.design.certificate import guarded_curve
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import falling_corners, flow_at_end, remaining_dead_zone
from dzdesign.design.side_law import Component
from dzdesign.identify.valve.certified_bound import BoundPiece
from dzdesign.identify.valve.ramp_result import TestResult

Node = tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True, kw_only=True)
class Characteristic:
    """Drive over full drive as straight parts over the command, a share of full command, exact.

    Up to and with `rest` the drive is zero; behind it, it begins at the first node's drive and ends at full command.
    """

    rest: Fraction
    #: Command and drive: the first command is `rest`, the last one 1, and both numbers never fall.
    nodes: tuple[Node, ...]

    def __post_init__(self) -> None:
        commands, drives = zip(*self.nodes, strict=True)
        if commands[0] != self.rest or commands[-1] != 1 or not 0 <= self.rest < 1:
            raise ValueError("a characteristic runs from where it leaves its rest to full command")
        if any(left >= right for left, right in pairwise(commands)):
            raise ValueError("the commands of a characteristic rise")
        if any(left > right for left, right in pairwise(drives)) or drives[0] < 0 or drives[-1] > 1:
            raise ValueError("the drive of a characteristic never falls, and is 0 to 1")

    @property
    def offset(self) -> Fraction:
        """Largest drive of a command that counts as zero: where it leaves its rest, or at the end of a first ramp."""
        return self.nodes[0][1] or self.nodes[1][1]

    def drive(self, command: Fraction) -> Fraction:
        """Return the drive at a command, 0 to 1."""
        if command <= self.rest:
            return Fraction(0)
        for (left, low), (right, high) in pairwise(self.nodes):
            if command <= right:
                return low + (high - low) * (command - left) / (right - left)
        return self.nodes[-1][1]

    def command_at(self, drive: Fraction) -> Fraction | None:
        """Return the command behind which the drive is at least this: the dead zone to a threshold; None: never."""
        if drive <= self.nodes[0][1]:
            return self.rest
        for (left, low), (right, high) in pairwise(self.nodes):
            if drive <= high:
                return left + (right - left) * (drive - low) / (high - low)
        return None


def jump(offset: Fraction, full: Fraction, rest: Fraction) -> Characteristic:
    """Return the drive that jumps to an offset behind its rest, and runs straight from there to full command."""
    return Characteristic(rest=rest, nodes=((rest, offset), (Fraction(1), full)))


def added(offset: Fraction) -> Characteristic:
    """Return the drive of a device that adds an offset to every command but zero, and is limited to full drive."""
    none, one = Fraction(0), Fraction(1)
    limited: tuple[Node, ...] = ((1 - offset, one),) if offset else ()
    return Characteristic(rest=none, nodes=((none, offset), *limited, (one, one)))


BENCH_ERROR: Component = "bench pressure drop"
#: A fixed offset reads no pressure, and it is rounded to the steps of an amplifier, not of a PWM.
NOT_OF_AN_AMPLIFIER: tuple[Component, ...] = ("rounding of the drive",)


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedOffset:
    """The largest fixed offset of one sign of command, exact, before an amplifier rounds it."""

    sign: int
    #: Over full drive.
    share: Fraction
    #: Pressure drop as the bench read it at which the bound is lowest, MPa; of a lot that of the valve whose bound is.
    lowest_at_MPa: Fraction
    #: Interval of the pressure drop on which it is safe, MPa.
    dp_MPa: tuple[Fraction, Fraction]


def fixed_offset(compensator: Compensator, sign: int = 1) -> FixedOffset:
    """Return the largest offset of a side that is certified at every tested pressure drop at once.

    Of a lot setting it is safe for each valve of the lot, over all pressure drops that this valve was tested at.

    Raises
    ------
    InputError
        If no positive offset is left, or a valve of the lot has no bounds of this side.
    """
    allowance = compensator.allowance(sign)
    model, side = compensator.valve.side(sign), compensator.valve.side_name(sign)
    # Above the tests the bound goes down: a gauge that read too little there had tests at higher pressure drops.
    guard, machine = compensator.side(sign).certificate.guard, compensator.machine
    curve = guarded_curve(model, guard, compensator.below_dp0, "lower", machine)
    pieces = [*(curve.certified.pieces if curve.certified else ()), *_of_the_lot(compensator, sign)]
    bounds = [(piece.at(end), end) for piece in pieces for end in (piece.from_MPa, piece.to_MPa)]
    if error_MPa := allowance.pressures_MPa.get(BENCH_ERROR):
        # What was read as the highest drop may have been higher by the error: above the tests the bound never rises.
        bounds.append((curve.at(curve.dp_MPa[-1] + error_MPa), curve.dp_MPa[-1]))
    least_V, lowest_at = min(bounds)
    kept = sum((share for name, share in allowance.shares.items() if name not in NOT_OF_AN_AMPLIFIER), Fraction(0))
    share = least_V * allowance.factor / compensator.u_max_V - kept
    if share <= 0:
        raise InputError(
            f"no fixed offset of the {side} side is safe at every pressure drop: budget and dither take "
            "all of the certified one; use the law with pressure sensors, or declare a smaller budget"
        )
    return FixedOffset(sign=sign, share=share, lowest_at_MPa=lowest_at, dp_MPa=(curve.dp_MPa[0], curve.dp_MPa[-1]))


def _of_the_lot(compensator: Compensator, sign: int) -> Iterator[BoundPiece]:
    """Yield the bounds of every valve of a lot."""
    for valve in compensator.lot:
        side = valve.side(sign)
        if side is None:
            raise InputError(f"'{valve.name}' of the lot has no bounds of the negative side; run `batch` again")
        yield from side.bound().pieces


def zero_band(compensator: Compensator, sign: int = 1) -> Fraction:
    """Return up to which command, a share of full, a zero command may read, as declared for the design."""
    return Fraction(compensator.command_error.zero_band_codes, compensator.signals.command.span(sign))


def full_drive(compensator: Compensator, dp_MPa: Fraction, sign: int = 1) -> Fraction:
    """Return the drive of the law at full command and a pressure drop, limited as the design limits it."""
    signals = compensator.signals
    command, limit = signals.command, compensator.drive_functions.compare_limit
    code = command.zero_code + command.direction(sign) * command.span(sign)
    drive = compensator.drive(code, round(signals.pair(sign).dp_code(dp_MPa)), sign)
    return min(drive, Fraction(limit, signals.compare_max))


def pressure_line(
    compensator: Compensator, offset: FixedOffset, dp_MPa: Fraction, rest: Fraction | None = None
) -> Characteristic:
    """Return the characteristic at a pressure drop inside the tests, MPa: continuous, from no drive at zero command.

    At the command `rest`, a share of full, the drive has come to the fixed offset; without one that is the end of the
    design's zero band.

    Raises
    ------
    InputError
        If the pressure drop is outside the tested interval.
    """
    sign, low, high = offset.sign, *offset.dp_MPa
    if not low <= dp_MPa <= high:
        raise InputError(
            worded(
                "--table-dp is {dp:.4g MPa}, outside the tests from {low:.4g MPa} to {high:.4g MPa}; choose one inside",
                dp=float(dp_MPa),
                low=float(low),
                high=float(high),
            )
        )
    signals = compensator.signals
    command, dp_code = signals.command, round(signals.pair(sign).dp_code(dp_MPa))
    limit = Fraction(compensator.drive_functions.compare_limit, signals.compare_max)

    def law(share: Fraction) -> Fraction:
        code = command.zero_code + command.direction(sign) * round(share * command.span(sign))
        return compensator.drive(code, dp_code, sign)

    band = zero_band(compensator, sign) if rest is None else rest
    end, full = Fraction(compensator.transition_end, command.span(sign)), law(Fraction(1))
    nodes: list[Node] = [(Fraction(0), Fraction(0))] if band else []
    nodes.append((band, min(offset.share, limit)))
    # Without a transition the law jumps at zero command, to an offset that is not the fixed one: a line leads to its
    # full drive.
    if end > band and nodes[-1][1] < law(end) < limit:
        nodes.append((end, law(end)))
    if full > limit:
        left, start = nodes[-1]
        nodes.append((left + (1 - left) * (limit - start) / (full - start), limit))
    nodes.append((Fraction(1), max(min(full, limit), nodes[-1][1])))
    return Characteristic(rest=Fraction(0), nodes=tuple(nodes))


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
    tests = compensator.valve.side(sign).tests
    return tuple(_at_test(compensator, characteristic, test, sign) for test in tests)


def _at_test(compensator: Compensator, characteristic: Characteristic, test: TestResult, sign: int) -> FixedDeadZone:
    end_code, signals = compensator.transition_end, compensator.signals
    dp_code = signals.pair(sign).code_at(test.dp_MPa)
    knees = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
    by_law = falling_corners(compensator, dp_code, sign).at_end
    by_fixed = float(characteristic.drive(Fraction(end_code, signals.command.span(sign))))
    return FixedDeadZone(
        side=compensator.valve.side_name(sign),
        dp_MPa=test.dp_MPa or 0.0,
        fixed={
            branch: _left(characteristic, Fraction(repr(knee)) / compensator.u_max_V)
            for branch, knee in knees.items()
            if knee is not None
        },
        law=remaining_dead_zone(compensator, test, sign),
        fixed_end_L_min=flow_at_end(compensator, test, by_fixed),
        law_end_L_min=flow_at_end(compensator, test, by_law),
    )


def _left(characteristic: Characteristic, knee: Fraction) -> float:
    found = characteristic.command_at(knee)
    return float("inf") if found is None else float(found)
