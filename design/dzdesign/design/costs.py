"""What a design costs, in a person's words: dead zone that remains, flow at the transition, drive at full command."""

from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.signal_descriptions import unseen_failures
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.side_model import SideModel


def costs_of(compensator: Compensator) -> tuple[str, ...]:
    """Return one line per test and per choice; an output that never opens the valve is refused."""
    valve = compensator.valve
    lines = list(hidden_failures(compensator))
    for sign in compensator.signals.signs:
        side, label = valve.sides[SIDE_NAMES[sign]], _side_label(compensator, sign)
        lines += [label + _cost_of_test(compensator, test, sign) for test in side.tests]
        lines += [label + line for line in _cost_of_side(compensator, side, sign)]
    low, high = (float(end) for end in compensator.positive.certificate.dp_MPa)
    units = valve.recorded_units
    first, last = units.number(low, ".2f MPa"), units.text(high, ".2f MPa")
    beyond = f"outside {first} to {last}" if high > low else f"at any pressure drop but {last}"
    lines.append(
        f"{beyond} the nearest tested beta is held and nothing is certified; "
        f"a pressure difference below -{compensator.reverse_codes} codes is taken as a failed sensor: smallest beta"
    )
    if compensator.negative is None and valve.sides.get("negative") is not None:
        lines.append(
            "the valve's negative side is left out: the command has one sign; give a --command-signal of both to drive "
            "two solenoids"
        )
    return tuple(lines + _cost_of_options(compensator))


def hidden_failures(compensator: Compensator) -> tuple[str, ...]:
    """Return one line for each failure of a signal that the firmware can't see; the first of `costs_of`."""
    lines = unseen_failures(compensator.signals)
    for sign in compensator.signals.signs:
        if compensator.valve.sides[SIDE_NAMES[sign]].trend == "increasing":
            lines.append(
                f"{_side_label(compensator, sign)}the threshold grows with the pressure drop, so a pressure signal "
                "that reads too high raises the offset: a broken wire of sensor B is not recognised unless it has a "
                "live zero; monitor the sensors outside"
            )
    return tuple(lines)


def _side_label(compensator: Compensator, sign: int) -> str:
    return "" if compensator.negative is None else f"{SIDE_NAMES[sign]} side, "


def _cost_of_test(compensator: Compensator, test: TestResult, sign: int) -> str:
    """Say what remains at one tested pressure drop."""
    signals, u_max = compensator.signals, float(compensator.u_max_V)
    code = round(signals.dp_code(Fraction(repr(test.dp_MPa))))
    offset, at_end, full, transition = _corners(compensator, code, sign)
    left = remaining_dead_zone(compensator, test, sign)
    units = compensator.valve.recorded_units.of_side(SIDE_NAMES[sign])
    at = units.text(test.dp_MPa or 0.0, ".2f MPa")
    parts = [f"{at}: offset {units.text(offset * u_max, '.3f V')}"]
    for name, knee in (("opening", test.u_knee_rising_V), ("closing", test.u_knee_falling_V)):
        if knee is not None and knee >= offset * u_max:
            parts.append(f"dead zone that remains on {name} {left[name]:.2%} of command (knee)")
        elif knee is not None:
            above = units.text(offset * u_max - knee, ".3f dV")
            parts.append(f"flow at zero command on {name}: the offset lies {above} above the knee")
    if transition and test.u_knee_falling_V is not None:
        flow = test.slope_L_min_V * max(at_end * u_max - test.u_knee_falling_V, 0.0)
        parts.append(f"flow on closing at the transition's end {units.text(flow, '.2f L/min')}")
    limit = compensator.drive_functions.compare_limit / signals.compare_max
    if limit <= offset or limit <= (test.u_knee_rising_V or 0.0) / u_max:
        raise InputError(
            f"the largest output is {limit:.1%} of full drive, but the valve opens at "
            f"{max(offset, (test.u_knee_rising_V or 0.0) / u_max):.1%} at {at}, so nothing would ever flow; "
            "give a larger --output-max"
        )
    if limit < full:
        reached = transition + (1 - transition) * (limit - at_end) / (full - at_end)
        parts.append(f"the largest drive, {limit:.2%}, is reached at {reached:.1%} of command")
    else:
        parts.append(f"drive at full command {full:.2%}")
    return ", ".join(parts)


def remaining_dead_zone(compensator: Compensator, test: TestResult, sign: int = 1) -> dict[str, float]:
    """Return the dead zone that the law leaves at a tested pressure drop, as a share of command, by branch.

    The test need not be of the valve that the law was designed for. A branch that was not recorded is left out; the
    share is 0 where flow passes at zero command.
    """
    code = round(compensator.signals.dp_code(Fraction(repr(test.dp_MPa))))
    offset, at_end, full, transition = _corners(compensator, code, sign)
    knees = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
    shares = {name: knee / float(compensator.u_max_V) for name, knee in knees.items() if knee is not None}
    return {name: max(_residual(knee, offset, at_end, full, transition), 0.0) for name, knee in shares.items()}


def _corners(compensator: Compensator, dp_code: int, sign: int) -> tuple[float, float, float, float]:
    """Return the drive at zero command, at the transition's end and at full command, and the transition's share."""
    command = compensator.signals.command
    span, transition = command.span(sign), compensator.transition_codes
    at = (command.zero_code + command.direction(sign) * from_zero for from_zero in (0, transition, span))
    offset, at_end, full = (float(compensator.drive(code, dp_code, sign)) for code in at)
    return offset, at_end, full, transition / span


def _residual(knee: float, offset: float, at_end: float, full: float, transition: float) -> float:
    """Return the command at which the drive reaches a threshold: two straight parts, their corner at the transition."""
    if knee <= at_end and transition:
        return transition * (knee - offset) / (at_end - offset) if at_end > offset else 0.0
    return transition + (1 - transition) * (knee - at_end) / (full - at_end)


def _cost_of_side(compensator: Compensator, side: SideModel, sign: int) -> list[str]:
    lines = []
    units = compensator.valve.recorded_units
    crossed = [units.number(test.dp_MPa or 0.0, ".2f MPa") for test in side.tests if test.closes_above_opening]
    if crossed:
        lines.append(
            f"accepted, branch-order: at {', '.join(crossed)} {units.label('MPa')} the valve seems to close above "
            "where it opens, so flow at zero command is possible"
        )
    certificate = compensator.side(sign).certificate
    lines.append(
        f"the table's offset stays {units.text(1e3 * certificate.mean_loss_V, '.2f mV')} under the certified curve on "
        f"average, {units.text(1e3 * certificate.largest_loss_V, '.2f mV')} at most{_of_which_dither(compensator)}"
    )
    guard = certificate.guard
    if guard != "closing":
        lines.append(
            f"the {guard} threshold is guarded: at zero command, after closing, flow may remain, up to what the valve "
            "passes between its closing threshold and this offset"
        )
    return lines


def _cost_of_options(compensator: Compensator) -> list[str]:
    signals, functions = compensator.signals, compensator.drive_functions
    lines = []
    if functions.dither_counts:
        peak = functions.dither_counts / signals.compare_max
        frequency = signals.tick_Hz / (2 * functions.dither_ticks)
        lines.append(
            f"dither of {frequency:.4g} Hz (half a wave is a whole number of PWM periods) and ±{peak:.2%} of full "
            "drive: the offset stands lower by that much, so that zero command stays shut at the wave's top"
        )
    if compensator.transition_codes:
        lines.append(f"the transition is a power of two in codes of command: {compensator.transition_codes}")
    if functions.has_ramp:
        lines.append(
            f"ramps: {_ramp_text(compensator)}; they hold for zero command too: the valve closes no faster than they "
            "let it"
        )
    if functions.window_codes:
        share = functions.window_codes / signals.command.span(1)
        lines.append(
            f"coming from the other sign a command must pass zero by {share:.2%} before its solenoid is driven: that "
            "much dead zone remains then, if the lines above say less"
        )
    return lines


def _of_which_dither(compensator: Compensator) -> str:
    counts = compensator.drive_functions.dither_counts
    if not counts:
        return ""
    peak = counts / compensator.signals.compare_max * float(compensator.u_max_V)
    return f", of which {compensator.valve.recorded_units.text(1e3 * peak, '.2f mV')} are the dither's peak"


def _ramp_text(compensator: Compensator) -> str:
    """Say how long a command takes from zero to full and back, of each sign."""
    signals, functions = compensator.signals, compensator.drive_functions
    parts = []
    for place, sign in enumerate(signals.signs):
        for way, steps in (("up", functions.ramp_up), ("down", functions.ramp_down)):
            name = way if compensator.negative is None else f"{SIDE_NAMES[sign]} {way}"
            seconds = signals.command.span(sign) * RAMP_UNIT / (steps[place] * signals.sample_Hz) if steps[place] else 0
            parts.append(f"{name} {seconds:.4g} s" if seconds else f"{name} at once")
    return ", ".join(parts)
