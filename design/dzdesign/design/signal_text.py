"""Signals as an engineer writes them, such as ``4..20 mA on 150 ohm = 25 MPa``, turned into converter codes."""

import re
from dataclasses import dataclass
from fractions import Fraction
from math import ceil

from dzdesign.core.artefact_types import RuleError
from dzdesign.core.errors import InputError, quoted
from dzdesign.core.units import Meaning, measures, parse_quantity, read_signal_range, si_factor
from dzdesign.design.signals import CommandSignal, PressureSignal
from dzdesign.design.target_inputs import CommandError, Converter

#: A sound signal may pass its ends by as much as the field's 3.6 mA and 21 mA pass those of 4-20 mA.
BELOW_LIVE_ZERO = Fraction(9, 10)
ABOVE_SPAN = Fraction(21, 20)
#: Largest current of a sound 4 to 20 mA, A, which a shunt leaves room for; shunts come in steps of this, ohm.
LARGEST_A, SHUNT_STEP_OHM = Fraction(21, 1000), 10
EXAMPLE = "'0..10 V x 0.3', '-10..10 V x 0.12 + 1.5 V' or '4..20 mA on 150 ohm = 25 MPa'"
COMMAND_EXAMPLE = "'4..20 mA on 150 ohm = -10..10 V'"
ERROR_EXPECTED = "expected the offset and the noise's peak, such as '15 + 4 codes' or '0.4 % + 0.1 %'"


@dataclass(frozen=True, slots=True, kw_only=True)
class PinSignal:
    """A signal's ends in its own unit, and the straight line from there to the voltage at the converter's pin."""

    #: As it was written, for messages.
    text: str
    #: V, or A of a signal on a shunt.
    unit: str
    #: Ends of the span, in that unit.
    low: Fraction
    high: Fraction
    #: Of the line.
    volts_per_unit: Fraction
    offset_V: Fraction
    #: What the ends stand for, where it was given.
    meaning: Meaning | None

    def volts(self, value: Fraction) -> Fraction:
        """Return the voltage at the pin."""
        return value * self.volts_per_unit + self.offset_V

    def check_within(self, converter: Converter) -> None:
        """Refuse a signal that the converter can't see whole."""
        for end in (self.low, self.high):
            if not 0 <= self.volts(end) <= converter.full_V:
                raise InputError(
                    f"the signal '{self.text}' reaches {float(self.volts(end)):g} V at the converter's pin, expected 0 "
                    f"to {float(converter.full_V):g} V; give the attenuator, shunt or offset, such as "
                    f"{self._attenuated(converter) or EXAMPLE}"
                )

    def _attenuated(self, converter: Converter) -> str:
        """Return the signal with what brings a voltage into the converter's range; empty where it has a gain, or so."""
        if self.unit != "V" or self.volts_per_unit != 1 or self.offset_V or self.meaning or not self.low <= 0:
            return ""
        # Rounded down: an end would lie above the range.
        gain = 10_000 * converter.full_V / (self.high - self.low) // 1 / 10_000
        offset = f" + {float(-self.low * gain):g} V" if self.low else ""
        return f"'{self.text} x {float(gain):g}{offset}'"

    def sound_codes(self, converter: Converter) -> tuple[int, int]:
        """Return the first and last code of a sound signal: a broken wire reads below a live zero.

        Without a live zero it may be as much below its low end as above its high one, or a code of noise at the end
        would count as a failure.
        """
        margin = (ABOVE_SPAN - 1) * self.high
        low = self.low * BELOW_LIVE_ZERO if self.low > 0 else self.low - margin
        return converter.code(self.volts(low)), converter.code(self.volts(self.high + margin))


def parse_signal(text: str, option: str) -> PinSignal:
    """Read a signal in V or A or the like: see `SignalRange`.

    Examples
    --------
    >>> float(parse_signal("4..20 mA on 150 ohm = 25 MPa", "--pressure-a").volts_per_unit)
    150.0
    """
    found = read_signal_range(text, f"{option} is {quoted(text)}")
    if found is None or not found.unit:
        raise InputError(f"{option}: {quoted(text)} is not a signal, expected one such as {EXAMPLE}")
    factor = Fraction(repr(si_factor(found.unit, "voltage" if found.shunt_ohm is None else "current")))
    if not found.low < found.high:
        ends = f"{float(found.low):g} to {float(found.high):g}"
        raise InputError(f"{option}: '{text}' runs from {ends}, expected it to rise")
    if found.gain == 0:
        raise InputError(f"{option}: '{text}' has gain 0")
    return PinSignal(
        text=text,
        unit="V" if found.shunt_ohm is None else "A",
        low=found.low * factor,
        high=found.high * factor,
        volts_per_unit=found.gain * (found.shunt_ohm or 1),
        offset_V=found.offset_V,
        meaning=found.meaning,
    )


def live_zero_signal(converter: Converter) -> str:
    """Return the pressure signal where nothing is said: 4 to 20 mA, and room above it for what no pressure makes.

    Examples
    --------
    >>> live_zero_signal(Converter())
    '4..20 mA on 140 ohm'
    """
    return f"4..20 mA on {converter.full_V / LARGEST_A // SHUNT_STEP_OHM * SHUNT_STEP_OHM} ohm"


def command_signal(signal: PinSignal, converter: Converter, *, inverted: bool = False) -> CommandSignal:
    """Return the codes of a command; one that runs from below zero to above it has both signs.

    What it stands for goes before the signal itself: ``4..20 mA = -10..10 V`` has both signs, and zero at 12 mA.
    `inverted` exchanges the signs of a command of both, and zero and full of a command of one.
    """
    signal.check_within(converter)
    stands_for = command_ends(signal)
    both = stands_for[0] < 0
    if both and stands_for[0] != -stands_for[1]:
        raise InputError(f"the command '{signal.text}' has ends of unlike size, expected such as -10..10 V")
    low, high = (converter.code(signal.volts(end)) for end in (signal.low, signal.high))
    # Ends of like size: zero lies in the middle, 0 V of -10..10 V, 12 mA of 4..20 mA.
    zero = converter.code(signal.volts((signal.low + signal.high) / 2)) if both else low
    if inverted:
        low, high = high, low
        zero = zero if both else low
    return CommandSignal(
        zero_code=zero,
        full_code=high,
        negative_full_code=low if both else None,
        valid_codes=signal.sound_codes(converter),
    )


def command_ends(signal: PinSignal) -> tuple[Fraction, Fraction]:
    """Return what a command's ends stand for, in V or in shares of full command; those of the signal if it says none.

    Raises
    ------
    InputError
        If that is not a command.
    """
    if signal.meaning is None:
        return signal.low, signal.high
    bottom, top, unit = signal.meaning.bottom, signal.meaning.top, signal.meaning.unit
    if not (measures(unit, "voltage") or measures(unit, "ratio")):
        raise InputError(f"the command '{signal.text}' stands for '{unit}', expected V or %, such as {COMMAND_EXAMPLE}")
    if not (bottom < top and bottom <= 0):
        raise InputError(
            f"the command '{signal.text}' runs from {float(bottom):g} to {float(top):g} {unit}, expected it to rise "
            f"from zero, or from below it, such as {COMMAND_EXAMPLE}"
        )
    factor = Fraction(repr(si_factor(unit, "voltage" if measures(unit, "voltage") else "ratio")))
    return bottom * factor, top * factor


def full_command_V(signal: PinSignal) -> Fraction | None:
    """Return the full command that a signal states, V; None if it states none."""
    stated = signal.meaning is not None and measures(signal.meaning.unit, "voltage")
    return command_ends(signal)[1] if stated else None


def pressure_signal(signal: PinSignal, converter: Converter, span_MPa: Fraction) -> PressureSignal:
    """Return the codes of a pressure sensor, with the exact bounds of a code's error.

    `span_MPa` is the pressure at the signal's upper end, unless the signal states its own.
    """
    signal.check_within(converter)
    if signal.low < 0:
        raise InputError(f"the pressure signal '{signal.text}' starts below zero, expected 0 or a live zero")
    span = span_MPa if signal.meaning is None else _span_MPa(signal, signal.meaning)
    zero, full = (converter.code(signal.volts(end)) for end in (signal.low, signal.high))
    if not zero < full:
        raise InputError(f"the pressure signal '{signal.text}' spans no code of the converter")
    zero_V, full_V = signal.volts(signal.low), signal.volts(signal.high)
    errors = [Fraction(0)]
    for code in (zero, full):  # both are straight in the code, so the ends decide
        taken = span * (code - zero) / (full - zero)
        errors += [span * (volts - zero_V) / (full_V - zero_V) - taken for volts in converter.ends(code)]
    return PressureSignal(
        span_MPa=span,
        zero_code=zero,
        full_code=full,
        valid_codes=signal.sound_codes(converter),
        error_MPa=(min(errors), max(errors)),
    )


def _span_MPa(signal: PinSignal, meaning: Meaning) -> Fraction:
    """Return the pressure at a signal's upper end."""
    factor = si_factor(meaning.unit, "pressure")
    if meaning.bottom != 0:
        raise InputError(
            f"the pressure signal '{signal.text}' begins at {float(meaning.bottom):g} {meaning.unit}, expected 0"
        )
    return Fraction(round(meaning.top * Fraction(repr(factor))), 10**6)


def command_error_of(text: str, converter: Converter, command: CommandSignal) -> CommandError:
    """Read the declared error, or take the converter's where the text is empty.

    Of the gain error what it makes at the code of zero command counts: nothing of a signal that begins at code 0, half
    of it of one that has zero in the middle.
    """
    if not text:
        at_zero = Fraction(command.zero_code, converter.code_max)
        offset, noise = converter.offset_codes + round(converter.gain_codes * at_zero), max(converter.noise_codes, 1)
        return CommandError(offset_codes=offset, noise_codes=noise)
    parts = [part.strip() for part in text.split("+")]
    if len(parts) != 2:
        raise InputError(f"--command-error is '{text}', {ERROR_EXPECTED}")
    if re.search(r"codes?$", parts[1]) and re.fullmatch(r"\d+(\.\d+)?", parts[0]):
        parts[0] += " codes"
    try:
        offset, noise = (_codes(part, command) for part in parts)
        return CommandError(offset_codes=offset, noise_codes=noise)
    except (ValueError, ZeroDivisionError, RuleError) as error:
        raise InputError(f"--command-error is '{text}', {ERROR_EXPECTED} ({error})") from error


def _codes(part: str, command: CommandSignal) -> int:
    """Return codes of command, a fraction of one as a whole."""
    if re.search(r"codes?$", part):
        return ceil(Fraction(re.sub(r"\s*codes?$", "", part)))
    return ceil(Fraction(repr(parse_quantity(part, "ratio", "--command-error"))) * command.span(1))
