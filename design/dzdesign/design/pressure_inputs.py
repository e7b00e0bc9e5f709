"""The pressure inputs: which ones each side reads, what is said of them, and failures that they hide.

The wires of the firmware's inputs stay where they are. Inputs A and B are the pressures that make the drop of positive
commands, ahead and behind. Negative commands read any two inputs, such as B and A; a pressure that only their drop
needs is input C.
"""

from dataclasses import dataclass, replace
from typing import Literal, cast

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.options import DesignOptions
from dzdesign.design.signal_text import live_zero_signal
from dzdesign.design.signals import INPUT_NAMES, POSITIVE_PAIR, InputPair, Signals
from dzdesign.design.target_inputs import Converter
from dzdesign.identify.reading.metering_edge import TWO_SENSORS
from dzdesign.identify.valve.model import SIDES, ValveModel
from dzdesign.identify.valve.recorded_drop import DropQuantity, RecordedDrop

#: What recordings show where they show no pair of inputs. A dP that is above zero on both sides may be a magnitude, and
#: of any ports; a side whose recordings hold the drop of several pairs of ports has no two inputs.
NoPair = Literal["nothing", "several"]
NOTHING: NoPair = "nothing"
SEVERAL: NoPair = "several"


def shown_pair(valve: ValveModel) -> InputPair | NoPair:
    """Return the inputs ahead and behind at negative commands that the recordings show."""
    positive, negative = (valve.sides[name].recorded_drop for name in ("positive", "negative"))
    if positive is None or negative is None:
        return NOTHING
    ways = positive.ways | negative.ways
    if negative.sign < 0 and ways <= {("dP",), TWO_SENSORS}:
        return "BA"
    if ("dP",) in ways:
        return NOTHING
    ports = _ports(positive, negative)
    if not ports:
        return SEVERAL
    names = [INPUT_NAMES[ports.index(port)] for port in negative.columns[0].quantities]
    return cast(InputPair, "".join(names[:: negative.sign]))


def _ports(positive: RecordedDrop, negative: RecordedDrop) -> list[DropQuantity]:
    """Return the recorded ports in the order of the inputs; none if these are not three at most."""
    if len(positive.ways) > 1 or len(negative.ways) > 1:
        return []
    ports = list(dict.fromkeys((*positive.columns[0].quantities, *negative.columns[0].quantities)))
    return ports if len(ports) <= len(INPUT_NAMES) else []


def with_pressure_inputs(valve: ValveModel, options: DesignOptions) -> DesignOptions:
    """Return the options with the inputs of negative commands; refuse a pressure drop that is not the recorded one.

    Raises
    ------
    InputError
        If no three pressure inputs give the recorded drops, or the recordings contradict what is declared.
    """
    signals = options.signals
    if len(signals.signs) == 1:
        return _with_two(options, POSITIVE_PAIR)
    shown, declared = shown_pair(valve), options.negative_dp or "-".join(signals.negative_pair)
    if shown == SEVERAL and declared != "wired":
        positive, negative = (_recorded(valve, name) for name in ("positive", "negative"))
        raise InputError(
            f"the pressure drop was recorded as {positive} at positive commands and as {negative} at negative ones. "
            "No three fixed pressure inputs give all of these. Design one side alone, by a --command-signal of one "
            "sign, or give --negative-dp wired if the machine switches the inputs"
        )
    pair: InputPair = POSITIVE_PAIR
    if declared == "recorded" and shown not in (NOTHING, SEVERAL):
        pair = cast(InputPair, shown)
    elif declared not in ("recorded", "wired"):
        pair = cast(InputPair, declared.replace("-", ""))
        if shown not in (pair, NOTHING):
            raise InputError(
                f"--negative-dp {declared} is {_minus(pair)}, but the recordings have {_recorded(valve, 'negative')} "
                f"at negative commands, which is {_minus(shown)}; leave it out, or give --negative-dp wired if the "
                "machine switches the inputs"
            )
    if "C" in pair:
        third = signals.pressure_c or options.pressure_c
        return replace(options, signals=replace(signals, negative_pair=pair, pressure_c=third))
    return _with_two(options, pair)


def _with_two(options: DesignOptions, pair: InputPair) -> DesignOptions:
    """Return the options without a third sensor; refuse what is said of one."""
    texts = options.texts or {}
    if texts.get("pressure_c") or texts.get("pressure_error", "").count("/") > 1:
        raise InputError(
            f"--pressure-c, and a third --pressure-error, are for a third sensor, but the pressure drop is that of "
            f"{' and '.join(pair)} at every command; leave it out, or say by --negative-dp whose drop it is: A-C"
        )
    machine = options.machine
    if machine is not None:
        left = {name: text for name, text in machine.defaults.items() if name != "pressure_error_c_MPa"}
        machine = replace(machine, pressure_error_c_MPa=None, defaults=left)
    signals = replace(options.signals, negative_pair=pair, pressure_c=None)
    return replace(options, signals=signals, machine=machine)


def _minus(pair: str) -> str:
    return " minus ".join(pair)


def wiring_in_words(compensator: Compensator) -> list[str]:
    """Say which recorded columns the pressure inputs are, and how the drop of negative commands comes of them."""
    lines = []
    if names := input_columns(compensator):
        inputs = ", ".join(f"{name} = {column}" for name, column in names.items())
        where = "" if "C" in names else f" at {compensator.valve.side_name(1)} commands"
        lines.append(f"pressure inputs: {inputs}, as recorded{where}")
    return lines + ([negative_drop_in_words(compensator)] if compensator.two_sided else [])


def negative_drop_in_words(compensator: Compensator) -> str:
    """Say how the pressure drop of negative commands comes of the inputs, and why; nothing for one sign."""
    if not compensator.two_sided:
        return ""
    drop = _minus(compensator.signals.negative_pair)
    recorded = _recorded(compensator.valve, "negative")
    return f"negative commands: the pressure drop is {drop}{_reason(compensator, recorded)}"


def input_columns(compensator: Compensator) -> dict[str, str]:
    """Return the recorded columns that the pressure inputs stand for, by name; none where no two were recorded."""
    pair = compensator.signals.negative_pair
    columns = dict(zip(POSITIVE_PAIR, _columns(compensator, compensator.valve.side_name(1)), strict=False))
    if columns and "C" in pair:
        columns |= {
            name: column
            for name, column in zip(pair, _columns(compensator, "negative"), strict=False)
            if name not in columns
        }
    return columns


def _columns(compensator: Compensator, side: str) -> list[str]:
    """Return the recorded columns that are ahead and behind on a side; none where no two make all of its drops."""
    drop = compensator.valve.sides[side].recorded_drop
    if drop is None or len(drop.ways) != 1 or len(drop.columns[0].labels) != 2:
        return []
    of_each = zip(*(each.labels[:: drop.sign] for each in drop.columns), strict=True)
    return [" or ".join(dict.fromkeys(labels)) for labels in of_each]


def is_wired(compensator: Compensator) -> bool:
    """Tell whether the machine is declared to switch the pressure inputs."""
    return (compensator.options or {}).get("negative_dp") == "wired" and compensator.two_sided


def what_machine_switches(compensator: Compensator) -> str:
    """Say what every output must say of a machine that switches the pressure inputs; nothing of any other."""
    if not is_wired(compensator):
        return ""
    columns = _columns(compensator, "negative")
    there = f" {columns[0]} to input A and {columns[1]} to input B" if columns else ""
    return (
        f"The machine must switch the pressure inputs at negative commands:{there or ' the drop is A minus B then too'}"
    )


def _reason(compensator: Compensator, recorded: str) -> str:
    """Say what the direction rests on."""
    if is_wired(compensator):
        return f", which the machine must switch to the inputs (--negative-dp wired; recorded as {recorded})"
    if shown_pair(compensator.valve) == NOTHING:
        return f" by assumption: the recordings ({recorded}) do not show which sensor is ahead; see --negative-dp"
    return f", as recorded ({recorded})"


def _recorded(valve: ValveModel, side: str) -> str:
    drop: RecordedDrop | None = valve.sides[side].recorded_drop
    return drop.in_words() if drop else "declared or unknown"


def not_covered(compensator: Compensator) -> tuple[str, ...]:
    """Return each thing that a good verdict says nothing of, as a part of its sentence."""
    if not compensator.two_sided:
        if compensator.positive is None:
            return ("commands from zero to full drive the valve's negative side: its positive one was not tested",)
        if len(compensator.valve.sides) == 1:
            return ()
        return ("positive commands only: the negative side of this valve was identified and is not driven",)
    if is_wired(compensator):
        return ("at negative commands the machine must switch the pressure inputs",)
    if shown_pair(compensator.valve) == NOTHING:
        return ("at negative commands the direction of the pressure drop is declared and was not recorded",)
    return ()


def signals_in_words(compensator: Compensator) -> list[str]:
    """Return one line for the command, one for each sensor, and what the sensors are in the recordings."""
    signals, u_max_V = compensator.signals, float(compensator.u_max_V)
    units, command = compensator.valve.recorded_units.of_controller, signals.command
    full_V = u_max_V * SIDES[compensator.valve.side_name(1)]
    text = f"command: ADC code {command.zero_code} is zero, {command.full_code} is {units.text(full_V, 'g V')}"
    if command.negative_full_code is not None:
        text += f", {command.negative_full_code} is {units.text(-u_max_V, 'g V')}"
    lines = [f"{text}; {_valid(command.valid_codes, signals.code_max, 'fault')}"]
    for name, sensor in signals.pressures.items():
        lines.append(
            f"pressure {name}: ADC code {sensor.zero_code} is zero pressure, {sensor.full_code} is "
            f"{units.text(float(sensor.span_MPa), 'g MPa')}; "
            f"{_valid(sensor.valid_codes, signals.code_max, 'sensor fault')}"
        )
    return [*lines, *wiring_in_words(compensator)]


def unseen_failures(signals: Signals) -> list[str]:
    """Return one line for each signal whose sound codes hide a failure."""
    lines = []
    command = signals.command
    away = -command.direction(1) * command.zero_code
    sign = 1 if away > 0 else -1
    if command.valid_codes[0] == 0 and away and sign in signals.signs:
        share = command.from_zero(0, sign) / command.span(sign)
        lines.append(
            f"a broken wire of the command that reads code 0 is taken for {'-' if sign < 0 else ''}{share:.0%} of "
            "command: have the wire supervised outside, or use a signal with a live zero"
        )
    for name, sensor in signals.pressures.items():
        low, high = sensor.valid_codes
        unseen = ["a broken wire"] if low == 0 else []
        unseen += ["a reading above the span"] if high == signals.code_max else []
        if unseen:
            lines.append(f"of sensor {name} {' and '.join(unseen)} can't be told from a pressure")
    return lines


def _valid(codes: tuple[int, int], code_max: int, fault: str) -> str:
    if codes == (0, code_max):
        return "every code is valid"
    return f"a code outside {codes[0]} to {codes[1]} is a {fault}"


#: What `--accept` calls it.
ACCEPTED = "broken-sensor"


@dataclass(frozen=True, slots=True, kw_only=True)
class HiddenFailure:
    """Failures of a sensor that one side's law can't tell from a pressure, and what they cost at zero command."""

    #: In words, with the sensor's name.
    failures: tuple[str, ...]
    #: Pressure drop at which the offset passes most flow, of those tested.
    dp_MPa: float
    #: Flow there by the recorded characteristic on closing; None where it is below what the recording resolves.
    flow_L_min: float | None

    def text(self, units: RecordedUnits) -> str:
        """Return it as a sentence."""
        flow = "less flow than the recordings show"
        if self.flow_L_min is not None:
            flow = f"{units.text(self.flow_L_min, '.2f L/min')} at {units.text(self.dp_MPa, '.2f MPa')}"
        reads = "reads as a valid pressure and gives" if len(self.failures) == 1 else "read as valid pressures and give"
        return f"{' and '.join(self.failures)} {reads} the largest offset: {flow} at zero command"


def hidden_failure(compensator: Compensator, sign: int) -> HiddenFailure | None:
    """Return the failures that raise the offset of a side unseen; None where every one is seen or lowers it.

    A threshold that falls with the pressure drop has its largest offset at a reading of none, one that grows at the
    largest reading. Codes that a sound signal never makes give the smallest beta; those of such a failure can not.
    """
    model, side = compensator.valve.side(sign), compensator.side(sign)
    if model.trend not in ("increasing", "decreasing"):
        return None
    rising = model.trend == "increasing"
    signals = compensator.signals
    failures = signals.pair(sign).hidden_failures(signals.code_max, broken_code(compensator), reads_high=rising)
    if not failures:
        return None
    largest = max(side.beta) / compensator.beta_denominator
    offset_V = largest * float(side.u_min0_over_u_max * compensator.u_max_V)
    flows = []
    for test in model.tests:
        closing = test.recorded.closing
        flow = float(closing.flow_at(np.array([offset_V]))[0]) if offset_V > closing.u_seen_V else None
        flows.append((flow or 0.0, test.dp_MPa or 0.0, flow))
    _, dp_MPa, flow = max(flows, key=lambda each: each[:2])
    return HiddenFailure(failures=failures, dp_MPa=dp_MPa, flow_L_min=flow)


def broken_code(compensator: Compensator) -> int:
    """Return the largest code that a broken wire may read: the converter's offset, and its noise, at no voltage."""
    machine, target = compensator.machine, compensator.target
    if machine is not None:
        return machine.pressure_offset_codes + machine.pressure_noise_codes
    converter = target.converter if target else Converter()
    return converter.offset_codes + converter.noise_codes


def refuse_hidden_failures(compensator: Compensator) -> None:
    """Refuse pressure signals that hide a failure which opens the valve at zero command."""
    for sign in compensator.signals.signs:
        hidden = hidden_failure(compensator, sign)
        if hidden is not None:
            converter, valve = compensator.target.converter if compensator.target else Converter(), compensator.valve
            raise InputError(
                f"{hidden.text(valve.recorded_units.of_side(valve.side_name(sign)))}; take a signal with a live "
                f"zero and room above, such as '{live_zero_signal(converter)}', or --accept {ACCEPTED}"
            )
