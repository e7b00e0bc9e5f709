"""Signals as an engineer writes them, such as ``4..20 mA on 150 ohm = 25 MPa``, turned into converter codes."""

import re
from dataclasses import dataclass
from fractions import Fraction

from dzdesign.core.errors import InputError, quoted
from dzdesign.core.units import parse_quantity, si_factor
from dzdesign.design.signals import CommandSignal, PressureSignal
from dzdesign.design.target_inputs import Converter

#: A sound signal may pass its ends by as much as the field's 3.6 mA and 21 mA pass those of 4-20 mA.
BELOW_LIVE_ZERO = Fraction(9, 10)
ABOVE_SPAN = Fraction(21, 20)
NUMBER = r"[-+]?\d+(?:\.\d+)?"
SIGNAL = re.compile(
    rf"\s*(?P<low>{NUMBER})\s*\.\.\s*(?P<high>{NUMBER})\s*(?P<unit>[A-Za-z]+)"
    rf"(?:\s+on\s+(?P<shunt>\d+(?:\.\d+)?)\s*(?P<ohm>[A-Za-zΩ]+))?"
    rf"(?:\s+x\s+(?P<gain>\d+(?:\.\d+)?))?"
    rf"(?:\s*\+\s*(?P<offset>\d+(?:\.\d+)?)\s*(?P<volt>[A-Za-z]+))?"
    r"(?:\s*=\s*(?P<span>.+?))?\s*"
)
#: Beyond this it is none, and matching it would take the square of its length.
LONGEST = 120
EXAMPLE = "'0..10 V x 0.3', '-10..10 V x 0.15 + 1.5 V' or '4..20 mA on 150 ohm = 25 MPa'"


@dataclass(frozen=True, slots=True, kw_only=True)
class PinSignal:
    """A signal's ends in its own unit, and the straight line from there to the voltage at the converter's pin."""

    #: As it was written, for messages.
    text: str
    #: Ends of the span, in V or A.
    low: Fraction
    high: Fraction
    #: Of the line.
    volts_per_unit: Fraction
    offset_V: Fraction
    #: Pressure at `high`, where it was given.
    span_MPa: Fraction | None

    def volts(self, value: Fraction) -> Fraction:
        """Return the voltage at the pin."""
        return value * self.volts_per_unit + self.offset_V

    def check_within(self, converter: Converter) -> None:
        """Refuse a signal that the converter can't see whole."""
        for end in (self.low, self.high):
            if not 0 <= self.volts(end) <= converter.full_V:
                raise InputError(
                    f"the signal '{self.text}' reaches {float(self.volts(end)):g} V at the converter's pin, expected 0 "
                    f"to {float(converter.full_V):g} V; give the attenuator, shunt or offset, such as {EXAMPLE}"
                )

    def sound_codes(self, converter: Converter) -> tuple[int, int]:
        """Return the first and last code of a sound signal: a broken wire reads below a live zero.

        Without a live zero it may be as much below its low end as above its high one, or a code of noise at the end
        would count as a failure.
        """
        margin = (ABOVE_SPAN - 1) * self.high
        low = self.low * BELOW_LIVE_ZERO if self.low > 0 else self.low - margin
        return converter.code(self.volts(low)), converter.code(self.volts(self.high + margin))


def parse_signal(text: str, option: str) -> PinSignal:
    """Read a signal, ``LOW..HIGH UNIT [on SHUNT ohm] [x GAIN] [+ OFFSET V] [= PRESSURE]``, in V or A or the like.

    Examples
    --------
    >>> float(parse_signal("4..20 mA on 150 ohm = 25 MPa", "--pressure-a").volts_per_unit)
    150.0
    """
    match = SIGNAL.fullmatch(text) if len(text) <= LONGEST else None
    if not match:
        raise InputError(f"{option}: {quoted(text)} is no signal, expected one such as {EXAMPLE}")
    current = match["shunt"] is not None
    factor = Fraction(repr(si_factor(match["unit"], "current" if current else "voltage")))
    low, high = (Fraction(match[end]) * factor for end in ("low", "high"))
    if not low < high:
        raise InputError(f"{option}: '{text}' runs from {match['low']} to {match['high']}, expected it to rise")
    per_unit = Fraction(match["gain"] or 1)
    if current:
        per_unit *= Fraction(match["shunt"]) * Fraction(repr(si_factor(match["ohm"].replace("Ω", "ohm"), "resistance")))
    offset = Fraction(match["offset"] or 0) * (
        Fraction(repr(si_factor(match["volt"], "voltage"))) if match["volt"] else 1
    )
    if per_unit == 0:
        raise InputError(f"{option}: '{text}' has gain 0")
    span = None
    if match["span"]:
        span = Fraction(round(parse_quantity(match["span"], "pressure", option)), 10**6)
    return PinSignal(text=text, low=low, high=high, volts_per_unit=per_unit, offset_V=offset, span_MPa=span)


def command_signal(signal: PinSignal, converter: Converter, *, inverted: bool = False) -> CommandSignal:
    """Return the codes of a command; one that runs from below zero to above it has both signs.

    `inverted` exchanges the signs of a command of both, and zero and full of a command of one.
    """
    signal.check_within(converter)
    both = signal.low < 0
    if both and signal.low != -signal.high:
        raise InputError(f"the command '{signal.text}' has ends of unlike size, expected such as -10..10 V")
    low, high = (converter.code(signal.volts(end)) for end in (signal.low, signal.high))
    zero = converter.code(signal.volts(Fraction(0))) if both else low
    if inverted:
        low, high = high, low
        zero = zero if both else low
    return CommandSignal(
        zero_code=zero,
        full_code=high,
        negative_full_code=low if both else None,
        valid_codes=signal.sound_codes(converter),
    )


def pressure_signal(signal: PinSignal, converter: Converter, span_MPa: Fraction) -> PressureSignal:
    """Return the codes of a pressure sensor, with the exact bounds of a code's error.

    `span_MPa` is the pressure at the signal's upper end, unless the signal states its own.
    """
    signal.check_within(converter)
    if signal.low < 0:
        raise InputError(f"the pressure signal '{signal.text}' starts below zero, expected 0 or a live zero")
    span = span_MPa if signal.span_MPa is None else signal.span_MPa
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
