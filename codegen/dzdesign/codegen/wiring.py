"""What an engineer wires and tries first, in the words of a README: volts at the pin, codes, and what they command.

Everything is computed from the codes that the core has. A compensator keeps no attenuator, shunt or offset, so a
voltage is that at the converter's pin, behind them.
"""

from dataclasses import dataclass
from fractions import Fraction

from dzdesign.codegen.core.plan import zero_command
from dzdesign.design.compensator import Compensator
from dzdesign.design.signal_text import Converter
from dzdesign.design.signals import CommandSignal, PressureSignal

#: Shares of full command, of each sign, that the first power-up gives.
TRIED = (Fraction(1, 10), Fraction(1, 2), Fraction(1))
#: Upper end of a current loop, A; its live zero is a fifth of it.
LOOP_A, LIVE_ZERO = Fraction(20, 1000), 5


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandPoint:
    """One command to try, printed.

    Attributes
    ----------
    u_i, share : str
        The command in volts, as u_max counts it, and its share of full command, or ``zero``, ``full``.
    code, volts, of_range : str
        What the converter reads, the voltage at its pin, and that voltage's share of its range.
    """

    u_i: str
    share: str
    code: str
    volts: str
    of_range: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PressureWiring:
    """One pressure sensor, printed.

    Attributes
    ----------
    name, span_MPa : str
        ``A`` or ``B``, and the pressure at the upper end.
    zero_code, full_code, valid : str
        Codes of no pressure and of the span, and its valid codes.
    zero_volts, full_volts, zero_of_range, full_of_range : str
        Voltages at the pin, and their share of the converter's range.
    shunt_ohm : str
        Shunt that makes this of 4-20 mA; empty without a live zero of that kind.
    """

    name: str
    span_MPa: str
    zero_code: str
    full_code: str
    valid: str
    zero_volts: str
    full_volts: str
    zero_of_range: str
    full_of_range: str
    shunt_ohm: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Wiring:
    """What a target's templates print of signals and outputs, every value a printed string.

    Attributes
    ----------
    u_max_V : str
        Full command.
    commands : tuple of CommandPoint
        From full negative command (or zero) to full positive command.
    ends : tuple of CommandPoint
        Those of `commands` that are zero or full.
    command_valid, command_shunt_ohm : str
        Sound codes, and the shunt that makes the signal of 4-20 mA, or nothing.
    no_voltage : str
        What 0 V at the command's pin commands; empty where that code is not valid.
    no_voltage_drives : bool
        True if that is more than zero command.
    pressures : tuple of PressureWiring
        Sensors A and B.
    compare_full, compare_limit : str
        Compare value of full drive, and the largest that is put out.
    limited, ramped : bool
        True if the output ends below full drive; if the command has ramps.
    zero_a, zero_b : str
        Compare values of zero command of the sides that there are, from the least to the largest by the pressure drop.
    window : str
        First and last code of the zero window, in which the side does not change; empty for one sign.
    dither_counts, dither_Hz : str
        Peak and frequency of the dither, or nothing.
    code_max, sample_Hz, tick_Hz : str
        Largest code, samples and PWM periods in a second.
    """

    u_max_V: str
    commands: tuple[CommandPoint, ...]
    ends: tuple[CommandPoint, ...]
    command_valid: str
    command_shunt_ohm: str
    no_voltage: str
    no_voltage_drives: bool
    pressures: tuple[PressureWiring, ...]
    compare_full: str
    compare_limit: str
    limited: bool
    ramped: bool
    zero_a: str
    zero_b: str
    window: str
    dither_counts: str
    dither_Hz: str
    code_max: str
    sample_Hz: str
    tick_Hz: str


def wiring_of(compensator: Compensator, converter: Converter) -> Wiring:
    """Return what is to be wired and tried.

    Parameters
    ----------
    compensator : Compensator
        What the firmware is of.
    converter : Converter
        The target's.
    """
    signals, amplifier = compensator.signals, compensator.amplifier
    command, both = signals.command, len(signals.signs) == 2
    points = _commands(compensator, converter)
    window = amplifier.window_codes
    zeros = ["{} to {}".format(*zero_command(compensator, sign)) for sign in signals.signs]
    return Wiring(
        u_max_V=f"{float(compensator.u_max_V):g}",
        commands=tuple(points.values()),
        ends=tuple(point for share, point in points.items() if share in (-1, 0, 1)),
        command_valid="{}..{}".format(*command.valid_codes),
        command_shunt_ohm="" if both else _shunt_ohm(command.zero_code, command.full_code, converter),
        no_voltage=_no_voltage(command, signals.signs),
        no_voltage_drives=any(command.from_zero(0, sign) for sign in signals.signs) and command.valid_codes[0] == 0,
        pressures=(_pressure("A", signals.pressure_a, converter), _pressure("B", signals.pressure_b, converter)),
        compare_full=str(signals.compare_max),
        compare_limit=str(amplifier.compare_limit),
        limited=amplifier.compare_limit < signals.compare_max,
        ramped=amplifier.has_ramp,
        zero_a=zeros[0],
        zero_b=zeros[-1] if both else "",
        window=f"{command.zero_code - window} to {command.zero_code + window}" if both else "",
        dither_counts=str(amplifier.dither_counts or ""),
        dither_Hz=f"{signals.tick_Hz / (2 * amplifier.dither_ticks):g}" if amplifier.dither_counts else "",
        code_max=str(signals.code_max),
        sample_Hz=str(signals.sample_Hz),
        tick_Hz=str(signals.tick_Hz),
    )


def _commands(compensator: Compensator, converter: Converter) -> dict[Fraction, CommandPoint]:
    """Return the commands to try, by their share of full command, from the lowest."""
    signs, command = compensator.signals.signs, compensator.signals.command
    sign_shown = "+" if len(signs) == 2 else ""
    shares = sorted({Fraction(0), *(sign * share for sign in signs for share in TRIED)})
    points = {}
    for share in shares:
        sign = -1 if share < 0 else 1
        named = {0: "zero", 1: f"full{_side(sign, signs)}"}
        code = command.zero_code + command.direction(sign) * _nearest(abs(share) * command.span(sign))
        shown = sign_shown if share else ""
        points[share] = CommandPoint(
            u_i=f"{float(share * compensator.u_max_V):{shown}g} V",
            share=named.get(abs(share), _share(abs(share))),
            code=str(code),
            volts=_volts(code, converter),
            of_range=_of_range(code, converter),
        )
    return points


def _no_voltage(command: CommandSignal, signs: tuple[int, ...]) -> str:
    """Say what command the code of 0 V is; nothing if it is not valid."""
    if command.valid_codes[0] > 0:
        return ""
    for sign in signs:
        if codes := command.from_zero(0, sign):
            share = Fraction(codes, command.span(sign))
            return f"{'' if share == 1 else _share(share) + ' of '}full{_side(sign, signs)} command"
    return "zero command"


def _side(sign: int, signs: tuple[int, ...]) -> str:
    return "" if len(signs) == 1 else " positive" if sign > 0 else " negative"


def _share(share: Fraction) -> str:
    return f"{100 * float(share):.3g} %"


def _pressure(name: str, sensor: PressureSignal, converter: Converter) -> PressureWiring:
    zero, full = sensor.zero_code, sensor.full_code
    return PressureWiring(
        name=name,
        span_MPa=f"{float(sensor.span_MPa):g}",
        zero_code=str(zero),
        full_code=str(full),
        valid="{}..{}".format(*sensor.valid_codes),
        zero_volts=_volts(zero, converter),
        full_volts=_volts(full, converter),
        zero_of_range=_of_range(zero, converter),
        full_of_range=_of_range(full, converter),
        shunt_ohm=_shunt_ohm(zero, full, converter),
    )


def _shunt_ohm(one: int, other: int, converter: Converter) -> str:
    """Return the shunt on which 4-20 mA read so; nothing if the lower code is not a fifth of the upper one.

    Both codes are rounded down, and so is a fifth of the upper one: floor(floor(5 x) / 5) = floor(x).
    """
    low, high = sorted((one, other))
    if not low or high // LIVE_ZERO != low:
        return ""
    return f"{float(sum(converter.ends(high)) / 2 / LOOP_A):.1f}".removesuffix(".0")


def _volts(code: int, converter: Converter) -> str:
    """Print the voltage at the pin to the millivolt: the middle of the code, which was rounded down."""
    return f"{float(sum(converter.ends(code)) / 2):.3f}"


def _of_range(code: int, converter: Converter) -> str:
    return f"{100 * float(sum(converter.ends(code)) / 2 / converter.full_V):.1f}"


def _nearest(value: Fraction) -> int:
    return int(value + Fraction(1, 2))
