"""The codes of a compensator in words, and the wire failures that they do not reveal."""

from dzdesign.design.compensator import Compensator
from dzdesign.design.pressure_inputs.negative_drop import wiring_in_words
from dzdesign.design.signals import PressureSignal, Signals


def signals_in_words(compensator: Compensator) -> list[str]:
    """Return one line for the command, one for each sensor, and what the sensors are in the recordings."""
    signals, u_max_V = compensator.signals, float(compensator.u_max_V)
    units, command = compensator.valve.recorded_units.of_controller, signals.command
    text = f"command: ADC code {command.zero_code} is zero, {command.full_code} is {units.text(u_max_V, 'g V')}"
    if command.negative_full_code is not None:
        text += f", {command.negative_full_code} is {units.text(-u_max_V, 'g V')}"
    lines = [f"{text}; {_valid(command.valid_codes, signals.code_max, 'fault')}"]
    for name, sensor in _sensors(signals).items():
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
    for name, sensor in _sensors(signals).items():
        low, high = sensor.valid_codes
        unseen = ["a broken wire"] if low == 0 else []
        unseen += ["a reading above the span"] if high == signals.code_max else []
        if unseen:
            lines.append(f"of sensor {name} {' and '.join(unseen)} can't be told from a pressure")
    return lines


def _sensors(signals: Signals) -> dict[str, PressureSignal]:
    return {"A": signals.pressure_a, "B": signals.pressure_b}


def _valid(codes: tuple[int, int], code_max: int, fault: str) -> str:
    if codes == (0, code_max):
        return "every code is valid"
    return f"a code outside {codes[0]} to {codes[1]} is a {fault}"
