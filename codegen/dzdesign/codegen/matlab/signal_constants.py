"""What a code stands for: every `#define` of the core that comes from the scalings of command and pressures."""

from dataclasses import dataclass
from math import floor

from dzdesign.codegen.core.command_shares import share_of_command
from dzdesign.codegen.core.constants import EXACT
from dzdesign.codegen.matlab.law_constants import Named
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import WEIGHT_SHIFT, PressureSignal

DOWN = "the converter's code, rounded down"


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalConstants:
    """The codes of one sign of command, of both pressures, and of the segments that these choose."""

    compensator: Compensator
    sign: int

    @property
    def passes_full(self) -> bool:
        """True if a valid command may lie beyond full command."""
        command = self.compensator.signals.command
        ends = (command.direction(self.sign) * (code - command.zero_code) for code in command.valid_codes)
        return max(ends) > command.span(self.sign)

    def signals(self) -> list[Named]:
        """Return the codes of command and pressures."""
        c = self.compensator
        signals, command = c.signals, c.signals.command
        span, direction = command.span(self.sign), command.direction(self.sign)
        u_max_V, units = float(c.u_max_V) * self.sign, c.valve.recorded_units.of_controller

        def reading(code: int) -> str:
            return units.text(direction * (code - command.zero_code) / span * u_max_V + 0.0, ".4g V")

        zero, (low, high) = command.zero_code, command.valid_codes
        full = self._signal("COMMAND_SPAN", span, "Eq. (29), codes from zero to full command",
                            units.text(u_max_V, "g V"))  # fmt: skip
        return [
            self._signal("COMMAND_ZERO", zero, "Eq. (29), code of zero command", reading(zero), DOWN),
            self._signal("COMMAND_LOW", low, "Eq. (29), lowest valid code of the command", reading(low), DOWN),
            self._signal("COMMAND_HIGH", high, "Eq. (29), highest valid code of the command", reading(high), DOWN),
            *([full] if self.passes_full else []),
            *self._sensor("A", signals.pressure_a),
            *self._sensor("B", signals.pressure_b),
            *([] if signals.like_sensors else self._weights()),
            self._reverse(),
            self._tested_to(),
        ]  # fmt: skip

    def _signal(
        self, symbol: str, value: int, equation: str, engineering: str, rounding: str = EXACT
    ) -> Named:
        return Named(symbol=symbol, value=value, equation=equation, engineering=engineering, rounding=rounding)

    def _sensor(self, name: str, sensor: PressureSignal) -> list[Named]:
        units = self.compensator.valve.recorded_units

        def pressure(code: int) -> str:
            return units.text(float((code - sensor.zero_code) * sensor.per_code_MPa), ".4g MPa")

        low, high = sensor.valid_codes
        a_code = units.text(float(sensor.per_code_MPa), ".6g MPa")
        what = f"text below Eq. (29), {{}} of sensor {name}, {a_code} a code"
        return [
            self._signal(f"PRESSURE_{name}_ZERO", sensor.zero_code, what.format("code at zero pressure"),
                         pressure(sensor.zero_code), DOWN),
            self._signal(f"PRESSURE_{name}_LOW", low, what.format("lowest valid code"), pressure(low), DOWN),
            self._signal(f"PRESSURE_{name}_HIGH", high, what.format("highest valid code"), pressure(high), DOWN),
        ]  # fmt: skip

    def _weights(self) -> list[Named]:
        signals, units = self.compensator.signals, self.compensator.valve.recorded_units
        a, b = (float(each.per_code_MPa) for each in (signals.pressure_a, signals.pressure_b))
        weight = 2**WEIGHT_SHIFT
        return [
            self._signal("PRESSURE_A_WEIGHT", weight, "weight of a code of sensor A, in codes of sensor A",
                         f"one code, times {weight}"),
            self._signal("PRESSURE_B_WEIGHT", signals.weight_b, "weight of a code of sensor B, in codes of A",
                         f"{units.text(b, '.6g MPa')} / {units.text(a, '.6g MPa')} = {b / a:.6g}, times {weight}",
                         "rounded to nearest"),
            self._signal("WEIGHT_SHIFT", WEIGHT_SHIFT, "from weighted codes to codes of sensor A",
                         f"1/2^{WEIGHT_SHIFT}", "the difference is rounded down"),
        ]  # fmt: skip

    def _reverse(self) -> Named:
        c = self.compensator
        weighted = not c.signals.like_sensors
        return self._signal(
            "REVERSE",
            c.reverse_codes << WEIGHT_SHIFT if weighted else c.reverse_codes,
            "a pressure drop less than minus this means that a sensor has failed",
            f"{c.valve.recorded_units.text(float(c.signals.dp_MPa(c.reverse_codes)), '.3f MPa')} in codes of sensor A"
            + (f", times {2**WEIGHT_SHIFT}" if weighted else ""),
            "a hundredth of the span, rounded down to a code",
        )

    def _tested_to(self) -> Named:
        c, sensors = self.compensator, self.compensator.signals
        last_MPa = c.side(self.sign).certificate.dp_MPa[1]
        codes = floor(sensors.dp_code(last_MPa))
        weighted = not sensors.like_sensors
        return self._signal(
            "TESTED_TO",
            ((codes + 1) << WEIGHT_SHIFT) - 1 if weighted else codes,
            "a pressure drop of more than this lies above the tests",
            f"{c.valve.recorded_units.text(float(last_MPa), '.4g MPa')} in codes of sensor A"
            + (f", times {2**WEIGHT_SHIFT}" if weighted else ""),
            "rounded down to a code" + (", with all that is rounded down to that code" if weighted else ""),
        )

    def steps(self) -> list[Named]:
        """Return what finds a segment of the tables, and the transition's length."""
        c = self.compensator
        step, transition = c.beta_step_codes, c.transition_codes
        width = c.valve.recorded_units.text(float(c.signals.dp_MPa(step)), ".4f MPa")
        found = [
            Named(symbol="STEP_CODES", value=step, equation="width of a segment of beta, codes of sensor A",
                     engineering=width),
            Named(symbol="STEP_SHIFT", value=step.bit_length() - 1, equation="from codes to segments",
                     engineering=f"1/{step} segment a code", rounding="the segment is rounded down"),
        ]  # fmt: skip
        if transition:
            found += self._zero_band()
        return found

    def _zero_band(self) -> list[Named]:
        c = self.compensator
        error = c.command_error
        return [
            Named(symbol="ZERO_BAND", value=c.zero_band_codes, equation="codes of command that count as zero, u_z",
                   engineering=f"{share_of_command(c, c.zero_band_codes, self.sign)}; error of a zero command, "
                   f"{error.offset_codes} + {error.noise_codes} codes"),
            Named(symbol="TRANSITION_CODES", value=c.transition_codes,
                   equation="codes of command that the transition takes, u_t - u_z",
                   engineering=share_of_command(c, c.transition_codes, self.sign),
                   rounding="a power of two"),
        ]  # fmt: skip

