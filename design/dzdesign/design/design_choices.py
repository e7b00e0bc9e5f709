"""Every option of `design`, declared once; compensator.json keeps what was asked for, so that it can be designed again.

Light on imports: the command line reads the options here. What an option's text means without the target it is for is
read here too; the rest, such as a signal's codes, in `dzdesign.design.options` and `dzdesign.design.declared`.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any, Literal, get_args

from dzdesign.core.errors import InputError, quoted
from dzdesign.core.option_readers import quantity, quantity_range, with_tolerance
from dzdesign.core.options import BOARD, CONNECTIONS, DRIVE, LAW, MACHINE, Option, Text, arguments_of
from dzdesign.core.units import parse_quantity
from dzdesign.derivation.laws import LAW_NAMES
from dzdesign.identify.constants import L_MIN

#: What to do below the reference pressure drop: beta = 1 as in Eq. (7), or what the tests there say.
BelowDp0 = Literal["hold", "extend"]
BELOW_DP0: tuple[BelowDp0, ...] = get_args(BelowDp0)
#: What to do above the last tested pressure drop: hold its offset, lower it with the continued bound, or release it.
Above = Literal["hold", "lower", "release"]
ABOVE: tuple[Above, ...] = get_args(Above)
POLARITIES = ("normal", "inverted")
#: Pressure drop at negative commands: of a pair of inputs, the one ahead first, or what says which.
NegativeDp = Literal["recorded", "wired", "A-B", "B-A", "A-C", "C-A", "B-C", "C-B"]
NEGATIVE_DP: tuple[NegativeDp, ...] = get_args(NegativeDp)
HYSTERESIS = ("keep", "play")
ON_OFF = ("on", "off")
DRIVES = ("duty", "current")
#: Largest transition, of full command; larger relative errors than the other are no tolerance.
LARGEST_TRANSITION, LARGEST_ERROR = Fraction(1, 10), Fraction(1, 2)
#: Beyond any flow that a valve of a control passes.
MOST_L_MIN = 1e6
#: Decimals of a number that is read from a text.
DIGITS = 9
NUMBER = r"\d+(?:\.\d+)?(?:[eE]-?\d+)?"
RANGE = rf"(?:\s*x\s*(?P<{{0}}low>{NUMBER})\s*\.\.\s*(?P<{{0}}high>{NUMBER}))?"
COIL = re.compile(
    rf"(?P<ohm>{NUMBER})(?:\s*\+\s*(?P<series>{NUMBER}))?\s*(?P<ohms>[a-zΩ]+){RANGE.format('r')}"
    rf"\s*,?\s*(?P<henry>{NUMBER})\s*(?P<henries>[uµm]?H){RANGE.format('l')}"
)
DEGREES = r"[-+]?\d{1,6}(?:\.\d{0,9})?"
TEMPERATURES = re.compile(
    rf"\s*(?P<low>{DEGREES})\s*(?:(?:\.\.|to)\s*(?P<high>{DEGREES})\s*)?(?P<unit>(?:deg|°)?\s?[CF])\s*", re.ASCII
)
#: Lag of a usual proportional valve, and delay of a loop that runs in the drive; shortest and longest that are tried.
LOOP, LOOP_WITH_GAIN = "20 ms, 2 ms", "20 ms, 2 ms, 300/s"
VELOCITY_GAIN, LARGEST_GAIN = re.compile(r"(\d+(?:\.\d+)?)(?: 1| )?/s"), 1e6
SHORTEST_LAG_S, LONGEST_LAG_S = 1e-3, 1.0
CHANNEL = re.compile(r"[A-D]\d{1,2}", re.ASCII)
MOST_HZ = 150e6
CODES = re.compile(r"\s*(\d{1,4})\s*\+\s*(\d{1,4})\s*\+\s*(\d{1,4})\s*codes?\s*", re.ASCII)


def share(most: Fraction, *, or_zero: bool = True) -> Callable[[str, str], Fraction]:
    """Return what reads a share of at most so much, exact to a billionth."""

    def read(text: str, option: str) -> Fraction:
        value = Fraction(round(parse_quantity(text, "ratio", option) * 10**DIGITS), 10**DIGITS)
        if not 0 <= value <= most or not (value or or_zero):
            least = "0 to" if or_zero else "more than 0, up to"
            raise InputError(f"{option} is {quoted(text)}, expected {least} {float(most):.0%}")
        return value

    return read


def read_error(text: str, option: str) -> float:
    """Return a relative error."""
    return float(share(LARGEST_ERROR)(text, option))


def _transition(text: str, option: str) -> Fraction | None:
    """Read ``auto`` (None), ``off`` (0) or a share."""
    if text in ("auto", "off"):
        return Fraction(0) if text == "off" else None
    return share(LARGEST_TRANSITION)(text, option)


def _reading_flow(text: str, option: str) -> float:
    flow = round(parse_quantity(text, "flow", option) / L_MIN, 7)
    if not 0 < flow <= MOST_L_MIN:
        expected = "more than zero" if flow <= 0 else f"at most {MOST_L_MIN:g} L/min"
        raise InputError(f"the reading flow is {flow:g} L/min, expected {expected}, such as '0.6 L/min'")
    return flow


def _times(text: str, option: str) -> tuple[float, float]:
    """Read one time, or two with a slash between: of positive and of negative commands."""
    parts = [parse_quantity(part.strip(), "time", option) for part in text.split("/")]
    if len(parts) > 2:
        raise InputError(f"{option} is '{text}', expected a time, or two such as '0.5 s / 0.8 s'")
    return parts[0], parts[-1]


def _temperatures(text: str, option: str) -> tuple[float, float]:
    """Read one temperature, or two, in degrees Celsius or Fahrenheit."""
    found = TEMPERATURES.fullmatch(text)
    if found is None:
        raise InputError(f"{option} is {quoted(text)}, expected a temperature or two, such as '-20..80 degC'")
    ends = [Fraction(found["low"]), Fraction(found["high"] or found["low"])]
    if found["unit"].endswith("F"):
        ends = [(end - 32) * 5 / 9 for end in ends]
    if ends[0] > ends[1]:
        raise InputError(f"{option} is {quoted(text)}, expected the lower end first")
    low, high = (round(float(end), DIGITS) for end in ends)
    return low, high


def _temperature(text: str, option: str) -> float:
    low, high = _temperatures(text, option)
    if low != high:
        raise InputError(f"{option} is {quoted(text)}, expected one temperature")
    return low


def _converter_errors(text: str, option: str) -> tuple[int, ...]:
    """Read offset, gain error and peak noise of a converter, codes."""
    found = CODES.fullmatch(text)
    if found is None:
        raise InputError(
            f"{option} is {quoted(text)}, expected offset, gain error and noise, such as '15 + 30 + 4 codes'"
        )
    return tuple(map(int, found.groups()))


def read_position_loop(text: str, option: str) -> tuple[float, float, float | None]:
    """Read the lag of a valve and the delay of a loop around it, s, and its velocity gain, 1/s; None: none stated."""
    parts = [part.strip() for part in text.split(",")]
    found = VELOCITY_GAIN.fullmatch(parts[2]) if len(parts) == 3 else None
    if len(parts) != 2 and found is None:
        raise InputError(
            f"{option} is {quoted(text)}, expected a lag and a delay, and a gain if you state one: '{LOOP_WITH_GAIN}'"
        )
    gain = float(found[1]) if found else None
    if gain is not None and not 0 < gain <= LARGEST_GAIN:
        raise InputError(f"{option} is {quoted(text)}, expected a gain above zero, {LARGEST_GAIN:g}/s at most")
    lag, delay = (parse_quantity(part, "time", option) for part in parts[:2])
    if not SHORTEST_LAG_S <= lag <= LONGEST_LAG_S or not 0 <= delay <= LONGEST_LAG_S:
        raise InputError(
            f"{option} is {quoted(text)}, expected a lag of {SHORTEST_LAG_S * 1e3:g} ms to {LONGEST_LAG_S:g} s, and a "
            f"delay of at most {LONGEST_LAG_S:g} s"
        )
    return lag, delay, gain


def _crystal(text: str, option: str) -> int:
    """Read the frequency of a crystal, Hz: a whole number."""
    hertz = parse_quantity(text, "frequency", option)
    if not 0 < hertz <= MOST_HZ or round(hertz) != round(hertz, 3):
        raise InputError(f"{option} is {quoted(text)}, expected a frequency up to 150 MHz, such as '30 MHz'")
    return round(hertz)


def _channels(text: str, option: str) -> tuple[str, ...]:
    """Read the names of the converter's channels: of command and pressures, then of current and supply."""
    names = tuple(text.upper().replace(",", " ").split())
    if not 3 <= len(names) <= 6 or len(set(names)) < len(names) or not all(map(CHANNEL.fullmatch, names)):
        raise InputError(
            f"{option} is {quoted(text)}, expected the channels of command, pressure A and pressure B (then of "
            "pressure C, the current and the supply, where they are read), each once, such as 'A0 A1 A2'"
        )
    return names


def _coil(text: str, option: str) -> dict[str, Any]:
    """Read a coil as arguments of `CoilCircuit`."""
    coil = COIL.fullmatch(text.strip())
    if coil is None:
        raise InputError(
            f"{option} is '{text}', expected resistance and inductance, such as '3.5 ohm 40 mH' or "
            "'3.5 + 0.5 ohm x 0.75..1.35, 40 mH x 0.5..1.5'"
        )
    ohms = "ohm" if coil["ohms"] in ("ohm", "ohms", "Ω") else coil["ohms"]
    unit = parse_quantity(f"1 {ohms}", "resistance", option)
    factors = {
        f"{name}_factors": (float(coil[f"{letter}low"]), float(coil[f"{letter}high"]))
        for name, letter in (("resistance", "r"), ("inductance", "l"))
        if coil[f"{letter}low"]
    }
    return factors | {
        "resistance_ohm": float(coil["ohm"]) * unit,
        "inductance_H": parse_quantity(f"{coil['henry']} {coil['henries']}", "inductance", option),
        **({"series_ohm": float(coil["series"]) * unit} if coil["series"] else {}),
    }


@dataclass(frozen=True, kw_only=True)
class DesignChoices:
    """Options of `design`, as written; None takes the default, so that `codegen` can tell what was given."""

    drive: Annotated[Text, Option("D", DRIVE, "duty", choices=DRIVES)] = None
    """Output of the law. duty: the PWM's share of the supply voltage. current: the set point of a current loop in the
    firmware, for one solenoid or two, with the rated current as full drive."""
    coil: Annotated[Text, Option("C", DRIVE, example="3.5 ohm 40 mH", read=_coil)] = None
    """Coil for --drive current, such as "3.5 ohm 40 mH". The form "3.5 + 0.5 ohm x 0.75..1.35, 40 mH x 0.5..1.5" adds
    the resistance of switch and shunt and the ranges, here with their defaults."""
    rated_current: Annotated[Text, Option("I", DRIVE, example="1 A", read=quantity("current"))] = None
    """Current at full drive, for --drive current."""
    current_signal: Annotated[Text, Option("S", DRIVE, example="0..1.2 A on 2 ohm + 0.15 V")] = None
    """Signal of the current sensor at the converter, for --drive current, such as "0..1.2 A on 2 ohm + 0.15 V". It ends
    at 1.2 times the rated current or more, where the over-current fault trips. The resistance is that of the shunt
    times its amplifier's gain, and the voltage is the one without current."""
    supply_signal: Annotated[Text, Option("S", DRIVE, example="0..36 V x 0.075")] = None
    """Signal of the supply voltage at the converter, for --drive current, such as "0..36 V x 0.075" (default: not
    measured). Measuring it makes the current loop faster."""
    coil_temperature: Annotated[Text, Option("T", MACHINE, example="-20..80 degC", read=_temperatures)] = None
    """Lowest and highest coil temperature of the machine, such as "-20..80 degC". Together with --supply it declares a
    machine whose coil is driven by the duty directly; with --drive current --coil has the range."""
    bench_coil: Annotated[Text, Option("T", MACHINE, example="20 degC", read=_temperature)] = None
    """Coil temperature during the recording of the ramps (default: 20 degC)."""
    supply: Annotated[Text, Option("V", MACHINE, example="18..32 V", read=quantity_range("voltage"))] = None
    """Lowest and highest supply voltage of the coil."""
    bench_supply: Annotated[Text, Option("V", MACHINE, example="24 V", read=quantity("voltage"))] = None
    """Supply voltage during the recording of the ramps (default: 12, 24 or 48 V, the one within --supply)."""
    amplifier: Annotated[Text, Option("E", MACHINE, example="1 %", read=read_error)] = None
    """Accuracy of a current-controlling amplifier between PWM and coil, such as "1 %" (default: none, the duty drives
    the coil). It is the deviation from the bench over coil temperature and supply, relative to the value and not to
    full scale."""
    current_error: Annotated[Text, Option("E", MACHINE, example="1 %", read=read_error)] = None
    """Accuracy of the current under --drive current, relative to its value (default: 1 % and the gain error of the
    target's converter). It includes the shunt, its amplifier and the converter's gain."""
    bench_current: Annotated[Text, Option("I", MACHINE, example="1 A +- 1 %", read=with_tolerance("current"))] = None
    """Coil current at full command on the bench, with its accuracy, for --drive current, such as "1 A +- 1 %" (default:
    the rated current, to 1 %)."""
    pressure_error: Annotated[Text, Option("E", MACHINE, example="0.1 %")] = None
    """Error of the pressure sensors, offset and gain together (default: 0.1 %). It is a share of the span or a
    pressure, such as "0.1 %" or "0.02 MPa", or "0.1 % / 0.5 %" for A and B, and a third one for C."""
    bench_pressure_error: Annotated[Text, Option("E", MACHINE, example="0.02 MPa")] = None
    """Error of the recorded pressure drop, as a pressure or as a share of the span (default: two sensors of 0.1 %)."""
    pressure_converter: Annotated[Text, Option("E", MACHINE, example="15 + 30 + 4 codes", read=_converter_errors)] = (
        None
    )
    """Offset, gain error at the top of the range and peak noise of the converter on each pressure channel, such as
    "15 + 30 + 4 codes" (default: the target's data sheet)."""
    oil: Annotated[Text, Option("E", MACHINE, example="0.2 %", read=read_error)] = None
    """Change of the threshold with the oil temperature, relative to its value (default: 0.2 %)."""
    ageing: Annotated[Text, Option("E", MACHINE, example="0.5 %", read=read_error)] = None
    """Change of the threshold by ageing, relative to its value (default: 0.5 %)."""
    law: Annotated[Text, Option("LAW", LAW, "paper", choices=LAW_NAMES)] = None
    """Law of the compensator. `dzdesign derive` states each law."""
    guard: Annotated[Text, Option("G", LAW, "closing")] = None
    """Threshold that the certificate protects: closing, mean or opening."""
    transition: Annotated[Text, Option("C", LAW, "auto", example="1 %", read=_transition)] = None
    """Share of the command, behind the zero band, over which the drive runs from the closing threshold to the opening
    one. auto: 1 %, or 16 codes if that is more. off: no transition and no zero band, with the offset of the closing
    threshold throughout."""
    command_error: Annotated[Text, Option("E", CONNECTIONS, example="15 + 4 codes")] = None
    """Error of the code at zero command, offset and peak noise, such as "15 + 4 codes" or "0.4 % + 0.1 %" (default: the
    error of the target's converter). The sum is the zero band, whose codes count as zero."""
    below_dp0: Annotated[Text, Option("B", LAW, "hold", choices=BELOW_DP0)] = None
    """Beta below dP0. hold: beta stays 1, as in the paper. extend: beta follows the tests there."""
    above: Annotated[Text, Option("A", LAW, "lower", choices=ABOVE)] = None
    """Offset above the highest tested pressure drop. hold: it stays the same, without a certificate there. lower: it
    follows the bound that the curve's premise continues. release: it goes to zero, and the dead zone returns."""
    reading_flow: Annotated[Text, Option("Q", LAW, example="0.6 L/min", read=_reading_flow)] = None
    """Flow at which dead zones are read, in addition to the onset (default: the meter's floor, or the noise level of a
    meter without one)."""
    position_loop: Annotated[Text, Option("T", LAW, LOOP, example=LOOP, read=read_position_loop)] = None
    """Lag of the valve and delay of a position loop around it, of which `design` states the largest gain that does not
    hunt. Nothing of the firmware depends on it."""
    output_max: Annotated[Text, Option("C", LAW, "100 %", example="95 %", read=share(Fraction(1), or_zero=False))] = (
        None
    )
    """Largest drive, in percent of full drive."""
    accept: Annotated[Text, Option("CODE", LAW)] = None
    """Warnings to accept, separated by commas (default: none, the design is refused). branch-order: the valve seems to
    close above its opening threshold. broken-sensor: a failure of a pressure signal raises the offset undetected."""
    command_signal: Annotated[Text, Option("S", CONNECTIONS, example="0..10 V x 0.3")] = None
    """Signal of the command at the converter: range, shunt, attenuator, offset and represented command (default: 0 to
    10 V over the converter's whole range). Examples with both signs are "-10..10 V x 0.12 + 1.5 V" and "4..20 mA on 150
    ohm = -10..10 V"."""
    polarity: Annotated[Text, Option("P", CONNECTIONS, "normal", choices=POLARITIES)] = None
    """Polarity of the command. normal: more signal is more command. inverted: more signal is less command."""
    pressure_span: Annotated[Text, Option("P", CONNECTIONS, "20 MPa", example="20 MPa", read=quantity("pressure"))] = (
        None
    )
    """Span of the pressure sensors."""
    pressure_a: Annotated[Text, Option("S", CONNECTIONS, example="4..20 mA on 140 ohm")] = None
    """Signal of the sensor upstream of the metering edge, such as "4..20 mA on 140 ohm = 25 MPa". The default is 4..20
    mA on a shunt that keeps 21 mA within the converter's range, 140 ohm for 3 V."""
    pressure_b: Annotated[Text, Option("S", CONNECTIONS, example="4..20 mA on 140 ohm")] = None
    """Signal of the sensor downstream of the metering edge (default: as upstream)."""
    pressure_c: Annotated[Text, Option("S", CONNECTIONS, example="4..20 mA on 140 ohm")] = None
    """Signal of the third sensor, which only negative commands use (default: as upstream)."""
    negative_dp: Annotated[Text, Option("D", CONNECTIONS, "recorded", choices=NEGATIVE_DP)] = None
    """Pressure drop at negative commands. recorded: as the recordings show it, and A-B, as at positive commands, if
    they do not. wired: the machine switches the inputs, so that A minus B is the metering drop at both signs. A-C is A
    minus C, where C is a third input."""
    crystal: Annotated[Text, Option("F", BOARD, example="30 MHz", read=_crystal)] = None
    """Frequency of the board's crystal or oscillator, for target f28335 (default: 30 MHz). Processor and PWM get the
    fastest clock that it allows. Target f280049c takes the clock of TI's device.h."""
    channels: Annotated[Text, Option("C", BOARD, example="A0 A1 A2", read=_channels)] = None
    """Channels of the converter for command, pressure A and pressure B, of the targets f28335 and f280049c (default:
    "A0 A1 A2"). That of a third pressure follows (default: "A6"), then with --drive current those of the current and of
    a measured supply (default: "A3 A4")."""
    ramp_up: Annotated[Text, Option("T", DRIVE, "0 s", example="0.5 s", read=_times)] = None
    """Time from zero to full command, such as "0.5 s", or "0.5 s / 0.8 s" for positive and negative commands."""
    ramp_down: Annotated[Text, Option("T", DRIVE, "0 s", example="0.5 s", read=_times)] = None
    """Time from full command to zero."""
    hysteresis: Annotated[Text, Option("H", DRIVE, "keep", choices=HYSTERESIS)] = None
    """Treatment of the valve's hysteresis. keep: no change. play: a falling command is driven lower by the width of the
    hysteresis."""
    dither: Annotated[Text, Option("D", DRIVE, "off", example="150 Hz 1 %")] = None
    """Square wave on the output, such as "150 Hz 1 %" for plus and minus 1 % of full drive."""
    fault_debounce: Annotated[Text, Option("N", DRIVE, "5 samples", example="5 samples")] = None
    """Number of consecutive valid samples that end a fault, such as "5 samples" or "4 ms". A fault acts at once: an
    invalid command releases the valve, and a failed pressure selects the smallest beta."""
    fault_latch: Annotated[Text, Option("L", DRIVE, "off", choices=ON_OFF)] = None
    """Latch of faults. on: a fault that lasts for the debounce time stays until a reset. off: it ends with the
    debounce."""
    interlock: Annotated[Text, Option("I", DRIVE, "on", choices=ON_OFF)] = None
    """Interlock after a reset or an invalid command. on: the drive follows only after zero command has lasted for the
    debounce time. off: it follows at once."""


#: Text of each option where it is not given. Of signals none: they span the target's whole converter.
DEFAULTS = {argument.name: argument.option.default for argument in arguments_of(DesignChoices)}
