"""What an engineer wires and tries first, in the words of a README: volts at the pin, codes, and what they command.

Everything is computed from the codes that the core has. A compensator keeps no attenuator, shunt or offset, so a
voltage is that at the converter's pin, behind them.
"""

from dataclasses import dataclass
from fractions import Fraction

from dzdesign.codegen.core.constants import Values
from dzdesign.core.errors import one_line
from dzdesign.design.compensator import Compensator
from dzdesign.design.pressure_inputs import input_columns, negative_drop_in_words, what_machine_switches
from dzdesign.design.signals import CommandSignal, PressureSignal
from dzdesign.design.target_inputs import Converter

#: Shares of full command, of each sign, that the first power-up gives.
TRIED = (Fraction(1, 10), Fraction(1, 2), Fraction(1))
#: Upper end of a current loop, A; its live zero is a fifth of it.
LOOP_A, LIVE_ZERO = Fraction(20, 1000), 5


@dataclass(frozen=True, slots=True, kw_only=True)
class PinReading:
    """A code, and the voltage at the pin that it stands for: its middle, as codes are rounded down."""

    code: int
    converter: Converter

    @property
    def _pin_V(self) -> Fraction:
        return sum(self.converter.ends(self.code), Fraction(0)) / 2

    @property
    def volts(self) -> str:
        """The voltage, printed to the millivolt."""
        return f"{float(self._pin_V):.3f}"

    @property
    def of_range(self) -> str:
        """Its share of the converter's range in percent, printed."""
        return f"{100 * float(self._pin_V / self.converter.full_V):.1f}"

    def shunt_ohm(self, other: int) -> str:
        """Return the shunt on which 4-20 mA read as these codes; nothing if the lower is no fifth of the upper.

        Both codes are rounded down, and so is a fifth of the upper one: floor(floor(5 x) / 5) = floor(x).
        """
        low, high = sorted((self.code, other))
        if not low or high // LIVE_ZERO != low:
            return ""
        full = PinReading(code=high, converter=self.converter)
        return f"{float(full._pin_V / LOOP_A):.1f}".removesuffix(".0")


def wiring_of(compensator: Compensator, converter: Converter) -> Values:
    """Return what is to be wired to a target's converter, and tried: what the targets' templates print of it."""
    signals, command = compensator.signals, compensator.signals.command
    points = _commands(compensator, converter)
    zero = PinReading(code=command.zero_code, converter=converter)
    return {
        "command_range": f"{points[min(points)]['u_i']} to {points[max(points)]['u_i']}",
        # From the lowest; then those that are zero or full.
        "commands": tuple(points.values()),
        "ends": tuple(point for share, point in points.items() if share in (-1, 0, 1)),
        # That makes the command of 4-20 mA, or nothing.
        "command_shunt_ohm": "" if len(signals.signs) == 2 else zero.shunt_ohm(command.full_code),
        # What 0 V at the command's pin commands; empty where that code is not valid. Then whether that opens the valve.
        "no_voltage": _no_voltage(command, signals.signs),
        "no_voltage_drives": any(command.from_zero(0, sign) for sign in signals.signs) and command.valid_codes[0] == 0,
        "pressures": tuple(
            _pressure(name, signal, converter, compensator) for name, signal in signals.pressures.items()
        ),
        # How the pressure drop of negative commands comes of the inputs; empty for a command of one sign.
        "negative_drop": _in_a_table(negative_drop_in_words(compensator)).replace("negative", "Negative", 1),
        # What the machine must switch at negative commands; nothing of most.
        "switched": _in_a_table(what_machine_switches(compensator)),
        "current": _current(compensator, converter),
    }


def _commands(compensator: Compensator, converter: Converter) -> dict[Fraction, Values]:
    """Return the commands to try, by their share of full command, from the lowest: in the unit that a person sees."""
    signs, command = compensator.signals.signs, compensator.signals.command
    units, sided = compensator.valve.recorded_units.of_controller, len(signs) == 2
    points: dict[Fraction, Values] = {}
    for share in sorted({Fraction(0), *(sign * share for sign in signs for share in TRIED)}):
        sign = -1 if share < 0 else 1
        codes = int(abs(share) * command.span(sign) + Fraction(1, 2))
        volts = float(share * compensator.u_max_V)
        points[share] = {
            "u_i": ("+" if share > 0 and sided else "") + units.text(volts, "g V"),
            "share": "zero" if not share else f"full{_side(sign, signs)}" if abs(share) == 1 else _percent(abs(share)),
            "pin": PinReading(code=command.zero_code + command.direction(sign) * codes, converter=converter),
        }
    return points


def _no_voltage(command: CommandSignal, signs: tuple[int, ...]) -> str:
    """Say what command the code of 0 V is; nothing if it is not valid."""
    if command.valid_codes[0] > 0:
        return ""
    for sign in signs:
        if codes := command.from_zero(0, sign):
            share = Fraction(codes, command.span(sign))
            return f"{'' if share == 1 else _percent(share) + ' of '}full{_side(sign, signs)} command"
    return "zero command"


def _side(sign: int, signs: tuple[int, ...]) -> str:
    return "" if len(signs) == 1 else " positive" if sign > 0 else " negative"


def _percent(share: Fraction) -> str:
    return f"{100 * float(share):.3g} %"


def _in_a_table(text: str) -> str:
    """Return a text, which may hold labels of recordings, as a cell of a Markdown table takes it."""
    return one_line(text).replace("|", "\\|")


def _pressure(name: str, signal: PressureSignal, converter: Converter, compensator: Compensator) -> Values:
    """Return one sensor at no pressure and at its span, and the column of the recordings that it stands for."""
    units, columns = compensator.valve.recorded_units, input_columns(compensator)
    zero, full = (PinReading(code=code, converter=converter) for code in (signal.zero_code, signal.full_code))
    return {
        "name": name,
        "recorded": _in_a_table(columns.get(name, "")),
        "signal": signal,
        "zero": zero,
        "full": full,
        "none": units.text(0.0, "g MPa"),
        "span": units.text(float(signal.span_MPa), "g MPa"),
        # That makes this of 4-20 mA; empty without a live zero of that kind.
        "shunt_ohm": zero.shunt_ohm(full.code),
    }


def _current(compensator: Compensator, converter: Converter) -> Values | None:
    """Return the sensor of the controlled current, without one and at the rated one, at the converter's pin."""
    if (drive := compensator.current_drive) is None:
        return None
    sensor = drive.sensor
    rated_V = sensor.offset_V + sensor.V_per_A * drive.circuit.rated_A
    return {
        "zero_V": sensor.offset_V,
        "rated_V": rated_V,
        "zero_code": converter.code(Fraction(sensor.offset_V)),
        "rated_code": converter.code(Fraction(rated_V)),
    }
