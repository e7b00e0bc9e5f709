"""What a design costs, in a person's words: dead zone that remains, flow at the transition, drive at full command."""

from collections.abc import Mapping
from fractions import Fraction

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.law_corners import corners_of
from dzdesign.design.signal_descriptions import unseen_failures
from dzdesign.design.signals import SIDE_NAMES
from dzdesign.identify.valve.ramp_result import TestResult
from dzdesign.identify.valve.reading_flow import ideal_line
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
    corners = corners_of(compensator, code, sign)
    left = remaining_dead_zone(compensator, test, sign)
    units = compensator.valve.recorded_units.of_side(SIDE_NAMES[sign])
    at = units.text(test.dp_MPa or 0.0, ".2f MPa")
    parts = [f"{at}: offset {units.text(corners.offset * u_max, '.3f V')}"]
    for name, knee in (("opening", test.u_knee_rising_V), ("closing", test.u_knee_falling_V)):
        if knee is not None and knee >= corners.offset * u_max:
            parts.append(f"dead zone that remains on {name} {left[name]:.2%} of command (knee)")
        elif knee is not None:
            above = units.text(corners.offset * u_max - knee, ".3f dV")
            parts.append(f"flow at zero command on {name}: the offset lies {above} above the knee")
    if corners.end and test.u_knee_falling_V is not None:
        flow = test.slope_L_min_V * max(corners.at_end * u_max - test.u_knee_falling_V, 0.0)
        parts.append(f"flow on closing at the transition's end {units.text(flow, '.2f L/min')}")
    parts.append(_reading(compensator, test, sign, units))
    limit = compensator.drive_functions.compare_limit / signals.compare_max
    if limit <= corners.offset or limit <= (test.u_knee_rising_V or 0.0) / u_max:
        raise InputError(
            f"the largest output is {limit:.1%} of full drive, but the valve opens at "
            f"{max(corners.offset, (test.u_knee_rising_V or 0.0) / u_max):.1%} at {at}, so nothing would ever flow; "
            "give a larger --output-max"
        )
    if limit < corners.full:
        reached = corners.command_at(limit)
        parts.append(f"the largest drive, {limit:.2%}, is reached at {reached:.1%} of command")
    else:
        parts.append(f"drive at full command {corners.full:.2%}")
    return ", ".join(parts)


def remaining_dead_zone(compensator: Compensator, test: TestResult, sign: int = 1) -> dict[str, float]:
    """Return the dead zone that the law leaves at a tested pressure drop, as a share of command, by branch.

    The test need not be of the valve that the law was designed for. A branch that was not recorded is left out; the
    share is 0 where flow passes at zero command.
    """
    knees = {"opening": test.u_knee_rising_V, "closing": test.u_knee_falling_V}
    return _commands_at(compensator, test, sign, knees)


def read_dead_zone(compensator: Compensator, test: TestResult, sign: int = 1) -> dict[str, float]:
    """Return the command at which the compensated valve passes the reading flow, as a share of full, by branch.

    It is read from the recorded flow; a branch that was not recorded, or never comes to that flow, is left out.
    """
    flow, recorded = compensator.reading_flow_L_min, test.recorded
    thresholds = {
        "opening": recorded.rising.command_at(flow) if recorded.rising else None,
        "closing": recorded.falling.command_at(flow) if recorded.falling else None,
    }
    return _commands_at(compensator, test, sign, thresholds)


def _commands_at(
    compensator: Compensator, test: TestResult, sign: int, thresholds_V: Mapping[str, float | None]
) -> dict[str, float]:
    """Return the command at which the drive reaches each threshold that there is, at a test's pressure drop."""
    corners = corners_of(compensator, round(compensator.signals.dp_code(Fraction(repr(test.dp_MPa)))), sign)
    shares = {name: at / float(compensator.u_max_V) for name, at in thresholds_V.items() if at is not None}
    nodes = compensator.drive_functions.play_counts[0 if sign > 0 else 1] or (0,)
    widths = (nodes[0] / compensator.signals.compare_max, nodes[-1] / compensator.signals.compare_max)
    branches = {"opening": corners, "closing": corners.lowered(*widths)}
    found = {name: max(branches[name].command_at(at), 0.0) for name, at in shares.items()}
    if "opening" in found:  # from rest the drive leaves the zero band at its outer end
        found["opening"] = max(found["opening"], corners.leaves)
    return found


def _reading(compensator: Compensator, test: TestResult, sign: int, units: RecordedUnits) -> str:
    """Say what is read at the reading flow, beside what an ideal line to the largest flow would read."""
    flow = compensator.reading_flow_L_min
    read = [f"{share:.2%} on {name}" for name, share in read_dead_zone(compensator, test, sign).items()]
    ideal = ideal_line(flow, test.recorded.q_max_L_min)
    words = " and ".join(read) or "nothing: the valve never passes it"
    return f"read at {units.text(flow, '.2f L/min')} {words} (ideal line {ideal:.2%})"


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
        lines.append(_cost_of_dither(compensator))
    lines += _cost_of_zero_band(compensator)
    if functions.has_play:
        width = max(count for nodes in functions.play_counts for count in nodes) / signals.compare_max
        turned = 2 * functions.play_noise_codes + functions.play_codes
        lines.append(
            f"inverse play: a falling command is driven lower by the recorded hysteresis, up to {width:.2%} of full "
            f"drive, once it has turned by {turned} codes ({turned / signals.command.span(1):.2%} of command)"
        )
    if functions.has_ramp:
        lines.append(
            f"ramps: {_ramp_text(compensator)}; they hold for zero command too: the valve closes no faster than they "
            "let it"
        )
    if compensator.negative is not None:
        share = functions.leave_zero_codes / signals.command.span(1)
        lines.append(
            f"coming from the other sign a command must pass zero by {share:.2%} before its solenoid is driven: that "
            "much dead zone remains then, if the lines above say less"
        )
    return lines


def _cost_of_dither(compensator: Compensator) -> str:
    """Say what the dither is, and by how much the offset stands lower for it."""
    signals, functions, recorded = compensator.signals, compensator.drive_functions, compensator.valve.dither
    frequency = signals.tick_Hz / (2 * functions.dither_ticks)
    peak, kept = (
        counts / signals.compare_max for counts in (functions.dither_counts, compensator.dither_reserve_counts)
    )
    what = f"dither of {frequency:.4g} Hz (half a wave is a whole number of PWM periods) and ±{peak:.2%} of full drive"
    if recorded is None:
        return f"{what}: the offset stands lower by that much, so that zero command stays shut at the wave's top"
    return (
        f"{what}: the ramps were recorded with {recorded.in_words()}, so the bounds hold under it; the offset stands "
        f"lower by {kept:.3%} only, for what the two waves differ in"
    )


def _cost_of_zero_band(compensator: Compensator) -> list[str]:
    """Say which commands count as zero, or what a wrong zero does where none but zero itself does."""
    span, error = compensator.signals.command.span(1), compensator.command_error
    declared = f"{error.offset_codes} + {error.noise_codes} codes of declared error"
    if not compensator.transition_codes:
        return [
            f"no transition, so no zero band: a zero command that reads {error.zero_band_codes} codes too high "
            f"({declared}) lifts the drive by {_lift_V(compensator):.3f} V, which the certificate does not count"
        ]
    leave = compensator.drive_functions.leave_zero_codes
    return [
        f"commands up to {compensator.zero_band_codes} codes ({compensator.zero_band_codes / span:.2%}) count as zero, "
        f"{declared}; from rest the drive leaves at more than {leave} codes ({leave / span:.2%})",
        f"the transition behind them is a power of two in codes of command: {compensator.transition_codes} "
        f"({compensator.transition_codes / span:.2%})",
    ]


def _lift_V(compensator: Compensator) -> float:
    """Return by how much the declared error of a zero command lifts the drive at dP0, V."""
    command = compensator.signals.command
    reference = compensator.valve.positive.reference.dp_MPa or 0.0
    dp_code = round(compensator.signals.dp_code(Fraction(repr(reference))))
    at = (0, min(compensator.command_error.zero_band_codes, command.span(1)))
    low, high = (compensator.drive(command.zero_code + command.direction(1) * each, dp_code) for each in at)
    return float((high - low) * compensator.u_max_V)


def _of_which_dither(compensator: Compensator) -> str:
    counts = compensator.dither_reserve_counts
    if not counts:
        return ""
    kept = 1e3 * counts / compensator.signals.compare_max * float(compensator.u_max_V)
    whose = "the dither's peak" if compensator.valve.dither is None else "for the dither"
    return f", of which {compensator.valve.recorded_units.text(kept, '.2f mV')} are {whose}"


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
