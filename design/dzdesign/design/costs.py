"""Costs of a design in words: remaining dead zone, flow at the transition, drive at full command, the machine."""

from dataclasses import dataclass

import numpy as np

from dzdesign.design.certificate import above_in_words, below_in_words
from dzdesign.design.compensator import Compensator
from dzdesign.design.costs_at_tests import corners_of, costs_at_tests, last_opening
from dzdesign.design.drive_functions import RAMP_UNIT
from dzdesign.design.machine import COPPER_PER_K, REFERENCE_C, Machine, premise_of_bench_current
from dzdesign.design.pressure_inputs import ACCEPTED, hidden_failure, unseen_failures
from dzdesign.identify.valve.reading_flow import default_reading_flow
from dzdesign.identify.valve.side_model import SideModel

#: By how much colder, K, than a bench's coil at `REFERENCE_C`.
COLDER_K = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class ColderCoil:
    """At the tested pressure drop at which most would flow at zero command, the duty going straight to the coil."""

    dp_MPa: float
    #: By how much the guarded threshold falls.
    lowered_V: float
    #: Flow at zero command by the recorded characteristic, on closing where that was recorded.
    flow_L_min: float
    #: Whether the recording shows that flow, or it lies below the noise level.
    seen: bool


def colder_coil(compensator: Compensator, sign: int) -> ColderCoil:
    """Return what a coil 40 K colder than on the bench does at zero command, at the worst tested pressure drop."""
    factor = float(1 - COPPER_PER_K * COLDER_K)
    side, u_max_V = compensator.valve.side(sign), float(compensator.u_max_V)
    thresholds = side.certified[compensator.side(sign).certificate.guard].u_threshold_V
    found = []
    for test, threshold_V in zip(side.tests, thresholds, strict=True):
        dp_code = compensator.signals.pair(sign).code_at(test.dp_MPa)
        # The coil has the current that the bench's coil had at a command higher by the ratio of the resistances.
        reached_V = corners_of(compensator, dp_code, sign).offset * u_max_V / factor
        branch = test.recorded.closing
        found.append(
            ColderCoil(
                dp_MPa=test.dp_MPa or 0.0,
                lowered_V=(1 - factor) * threshold_V,
                flow_L_min=float(branch.flow_at(np.array([reached_V]))[0]),
                seen=reached_V >= branch.u_seen_V,
            )
        )
    return max(found, key=lambda each: each.flow_L_min)


def machine_costs(compensator: Compensator, sign: int) -> list[str]:
    """Return the lines of one side; the premises of the machine stand with positive commands."""
    machine, budget = compensator.machine, compensator.side(sign).budget
    units = compensator.valve.recorded_units.of_side(compensator.valve.side_name(sign))
    if machine is None or budget is None:
        found = colder_coil(compensator, sign)
        flow = units.text(found.flow_L_min, ".2f L/min") if found.seen else "less than the recordings show"
        return [
            "the certificate covers only the valve as recorded: no machine is declared. Without current control, a "
            f"coil at {REFERENCE_C - COLDER_K} degC instead of {REFERENCE_C} degC lowers the threshold by "
            f"{units.text(1e3 * found.lowered_V, '.0f mV')}. At zero command the valve then passes {flow} at "
            f"{units.text(found.dp_MPa, '.2f MPa')}. Declare one of: --coil-temperature with --supply; --amplifier; "
            "--drive current"
        ]
    taken_mV = max(budget.combined_mV)
    lines = [
        f"the budget takes {units.text(taken_mV, '.0f mV')} from the threshold at most "
        f"({taken_mV / 1e3 / float(compensator.u_max_V):.2%} of command); the largest part: "
        f"{budget.largest.component}, {budget.largest.price:.2%}"
    ]
    tests = compensator.valve.side(sign).tests
    # The machine that opens last, which the transition does not reach.
    last = [share for test in tests if (share := last_opening(compensator, test, sign)) is not None]
    if last:
        longest = "the valve does not open at any command; control the current, or declare narrower ranges"
        if max(last) <= 1:
            longest = f"the dead zone on opening is there up to {max(last):.2%} of command"
        lines.append(
            f"at the other end of the machine the threshold is {float(machine.largest_factor):.3f} times the bench's: "
            f"{longest}"
        )
    if compensator.transition_codes:
        lines.append(_jump(compensator, machine, sign))
    if compensator.current_drive is not None and sign > 0:
        rated_A = compensator.current_drive.circuit.rated_A
        premise = premise_of_bench_current(compensator.valve, rated_A, machine.bench_full_A)
        lines += [premise] if premise else []
    return lines


def _jump(compensator: Compensator, machine: Machine, sign: int) -> str:
    """Say what the transition's end passes on the machine that opens earliest."""
    factor, found = float(machine.least_factor), []
    for test in compensator.valve.side(sign).tests:
        dp_code = compensator.signals.pair(sign).code_at(test.dp_MPa)
        at_end_V = corners_of(compensator, dp_code, sign).at_end * float(compensator.u_max_V)
        found.append(float(test.recorded.opening.flow_at(np.array([at_end_V / factor]))[0]))
    share = compensator.transition_end / compensator.signals.command.span(sign)
    flow = compensator.valve.recorded_units.text(max(found), ".2f L/min")
    return (
        f"the transition ends at the bench's opening threshold: on the machine that opens earliest ({factor:.3f} times "
        f"the bench's threshold) a command of {share:.2%} passes up to {flow}; --transition off does without that jump"
    )


def costs_of(compensator: Compensator) -> tuple[str, ...]:
    """Return one line per test and per choice; an output that never opens the valve is refused."""
    valve = compensator.valve
    lines = list(hidden_failures(compensator))
    for sign in compensator.signals.signs:
        side, label = valve.side(sign), _side_label(compensator, sign)
        lines += lines_of_tests(compensator, sign)
        lines += [label + line for line in machine_costs(compensator, sign)]
        lines += [label + line for line in _cost_of_side(compensator, side, sign)]
    units = valve.recorded_units
    lines.append(
        f"a pressure difference below -{compensator.reverse_codes} codes counts as a sensor fault"
        + (
            " and selects the smallest beta"
            if compensator.side().certificate.released_from_MPa is None
            else ". The offset is then zero, and the full dead zone is back"
        )
    )
    if compensator.reading_flow_L_min < (least := default_reading_flow(valve)):
        lines.append(
            f"dead zones read at {units.text(compensator.reading_flow_L_min, '.3g L/min')} are those of straight lines "
            f"from the first flow seen down to the onset: below {units.text(least, '.3g L/min')} not all of the "
            "recordings show a flow"
        )
    if any(warning.code == "flow-clipped" for warning in valve.warnings):
        lines.append(
            "flow-clipped: the meter's range ended below the largest flow of a test. If no other test shows a stop of "
            "the valve, the drive range and the largest output are those of a flow that goes on straight"
        )
    return (*lines, *_left_out(compensator), *_released(compensator), *_cost_of_options(compensator))


def design_warnings(compensator: Compensator) -> tuple[str, ...]:
    """Return one line for each failure that the firmware can't see, and for a side of the valve that it does not drive.

    And for a current that overshoots as the drive is released. They are among the costs; whoever generates a firmware
    without a look at these is told them again.
    """
    return (*hidden_failures(compensator), *_left_out(compensator), *_released(compensator))


def _released(compensator: Compensator) -> tuple[str, ...]:
    drive = compensator.current_drive
    return drive.release_in_words(compensator.valve.recorded_units) if drive else ()


def _left_out(compensator: Compensator) -> list[str]:
    if compensator.two_sided or len(compensator.valve.sides) == 1:
        return []
    return [
        "the valve's negative side is left out: the command has one sign; leave out --command-signal, or give one of "
        "both signs, to drive two solenoids"
    ]


def lines_of_tests(compensator: Compensator, sign: int) -> list[str]:
    """Return one line for each test of a side."""
    label, valve = _side_label(compensator, sign), compensator.valve
    units = valve.recorded_units.of_side(valve.side_name(sign))
    return [label + cost.text(units) for cost in costs_at_tests(compensator, sign)]


def hidden_failures(compensator: Compensator) -> tuple[str, ...]:
    """Return one line for each failure of a signal that the firmware can't see; the first of `costs_of`."""
    lines = unseen_failures(compensator.signals)
    for sign in compensator.signals.signs:
        label, name = _side_label(compensator, sign), compensator.valve.side_name(sign)
        hidden = hidden_failure(compensator, sign)
        if hidden is not None:
            what = hidden.text(compensator.valve.recorded_units.of_side(name))
            lines.append(f"accepted, {ACCEPTED}: {label}{what}; have the sensors supervised outside")
        elif compensator.valve.sides[name].trend == "increasing":
            lines.append(
                f"{label}the threshold grows with the pressure drop, so a pressure signal that reads too high raises "
                "the offset: monitor the sensors outside"
            )
    return tuple(lines)


def _side_label(compensator: Compensator, sign: int) -> str:
    return f"{compensator.valve.side_name(sign)} side, " if compensator.two_sided else ""


def _cost_of_side(compensator: Compensator, side: SideModel, sign: int) -> list[str]:
    lines = []
    units, here = compensator.valve.recorded_units, compensator.valve.side_name(sign)
    crossed = [units.number(test.dp_MPa or 0.0, ".2f MPa") for test in side.tests if test.closes_above_opening]
    if crossed:
        lines.append(
            f"accepted, branch-order: at {', '.join(crossed)} {units.label('MPa')} the valve seems to close above "
            "where it opens, so flow at zero command is possible"
        )
    certificate = compensator.side(sign).certificate
    lines.append(below_in_words(certificate, side, units.of_side(here)))
    lines.append(above_in_words(compensator.above, certificate, side, units.of_side(here)))
    if compensator.machine is None:  # else the budget says more
        lines.append(
            f"rounding and the beta table keep the offset {units.text(1e3 * certificate.mean_loss_V, '.2f mV')} below "
            f"the certified offset on average, {units.text(1e3 * certificate.largest_loss_V, '.2f mV')} at most"
            f"{_of_which_dither(compensator)}"
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
    if compensator.two_sided:
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
        by = "that much" if kept == peak else f"{kept:.2%}, what the controlled current makes of it at its worst corner"
        return f"{what}: the offset stands lower by {by}, so that zero command stays shut at the wave's top"
    return (
        f"{what}: the ramps were recorded with {recorded.in_words()}, so the bounds hold under it; the offset stands "
        f"lower by {kept:.3%} only, for what the two waves differ in"
    )


def _cost_of_zero_band(compensator: Compensator) -> list[str]:
    """Say which commands count as zero, or what a wrong zero does where none but zero itself does."""
    span, error = compensator.signals.command.span(1), compensator.command_error
    declared = f"converter error: {error.offset_codes} codes of offset, {error.noise_codes} of noise"
    if not compensator.transition_codes:
        return [
            f"no transition, so no zero band: a zero command that reads {error.zero_band_codes} codes too high "
            f"({declared}) raises the output by "
            f"{compensator.valve.recorded_units.text(_lift_V(compensator), '.3f dV')}, "
            "which the certificate does not count"
        ]
    leave, end = compensator.drive_functions.leave_zero_codes, compensator.transition_end
    return [
        f"commands up to {compensator.zero_band_codes} codes ({compensator.zero_band_codes / span:.2%}) count as zero "
        f"({declared}). A rising command leaves this band only above {leave} codes ({leave / span:.2%}). At "
        f"{end} codes ({end / span:.2%}) the transition ends: there the output reaches the law's line, above the "
        "recorded opening threshold"
    ]


def _lift_V(compensator: Compensator) -> float:
    """Return by how much the declared error of a zero command lifts the drive at dP0, V."""
    command = compensator.signals.command
    reference = compensator.valve.side().reference.dp_MPa or 0.0
    dp_code = compensator.signals.pair(1).code_at(reference)
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
            name = f"{compensator.valve.side_name(sign)} {way}" if compensator.two_sided else way
            seconds = signals.command.span(sign) * RAMP_UNIT / (steps[place] * signals.sample_Hz) if steps[place] else 0
            parts.append(f"{name} {seconds:.4g} s" if seconds else f"{name} at once")
    return ", ".join(parts)
