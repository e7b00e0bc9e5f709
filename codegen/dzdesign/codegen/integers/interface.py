"""What a function block takes and gives: numbers of a PLC, or the converter codes of the design.

A number of a PLC is coarser than a code, so each is taken on the safe side. The output is rounded down. A pressure drop
of n tenths of a bar stands for all within one of it, for two pressures were rounded: beta is the least of the codes
about them. Zero band and transition are widened to whole numbers.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor

from dzdesign.core.errors import InputError, quoted
from dzdesign.core.units import parse_quantity
from dzdesign.design.compensator import Compensator
from dzdesign.design.signals import WEIGHT_UNIT, InputPair, PressureSignal

#: Units of a PLC: 0.01 % of full command and of full drive, and 0.1 bar.
FULL = 10_000
PRESSURE_MPa = Fraction(1, 100)
DINT_MAX = 2**31 - 1
#: Cycle times of a PLC, and the parts of a second that times are rounded to.
SHORTEST_CYCLE_S, LONGEST_CYCLE_S = Fraction(1, 20_000), Fraction(1)
PER_SECOND = 10**9


@dataclass(frozen=True, slots=True, kw_only=True)
class Pressure:
    """One pressure input: first and last valid number, and the number of no pressure."""

    low: int
    high: int
    zero: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SideScaling:
    """What is of one sign of command alone, in units of the inputs."""

    #: Full command, from zero command on.
    span: int
    zero_band: int
    transition: int
    #: The command must pass this to leave zero command, or to change the side.
    leave_zero: int
    #: The interlock takes a command up to this for zero command; None without an interlock.
    interlock: int | None
    #: Names of the pressure inputs ahead and behind, and what one number behind weighs, over `weight_unit`.
    pair: InputPair
    weight: int
    #: Codes of the design in one unit of the pressure drop.
    codes_per_unit: Fraction
    #: Largest pressure drop that was tested, and the largest code of the tables.
    tested_to: int
    last_code: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Interface:
    """Scaling of every input and of the output."""

    #: Value of ``--interface``.
    name: str
    command_low: int
    command_high: int
    command_zero: int
    #: 1: positive commands have larger numbers than zero command, -1: smaller ones.
    command_direction: int
    pressures: Mapping[str, Pressure]
    #: A difference of weighted pressures over this, rounded down, is the pressure drop.
    weight_unit: int
    #: A pressure drop below the negative of this can't be right.
    reverse: int
    #: A pressure drop that is read stands for all within so many units of it.
    resolution: int
    #: Output of full drive, and its limit.
    full: int
    limit: int
    #: Whether the output is rounded to the nearest, a half up; else it is rounded down.
    rounds: bool
    sides: Mapping[int, SideScaling]
    #: Valid cycles in a row that end a fault; 0: each cycle is judged by itself.
    fault_cycles: int

    @property
    def three(self) -> bool:
        """True if the two sides read different pressures."""
        return "C" in self.pressures


def cycle_time_s(text: str) -> Fraction | None:
    """Return the cycle time of ``--cycle-time``, s; None where it was not given.

    Examples
    --------
    >>> cycle_time_s("10 ms"), cycle_time_s("")
    (Fraction(1, 100), None)
    """
    if not text:
        return None
    cycle_s = _seconds(text, "--cycle-time")
    if not SHORTEST_CYCLE_S <= cycle_s <= LONGEST_CYCLE_S:
        raise InputError(
            f"--cycle-time is {quoted(text)}, expected {float(SHORTEST_CYCLE_S) * 1e3:g} ms to "
            f"{float(LONGEST_CYCLE_S):g} s, the time between two calls of the function block"
        )
    return cycle_s


def debounce_s(compensator: Compensator) -> Fraction:
    """Return the debounce time that was asked for, s; where that was a number of samples, the time that they take."""
    asked, signals = (compensator.options or {}).get("fault_debounce", ""), compensator.signals
    if not asked or "sample" in asked:
        return Fraction(compensator.drive_functions.fault_samples, signals.sample_Hz)
    return _seconds(asked, "--fault-debounce")


def _seconds(text: str, option: str) -> Fraction:
    return Fraction(round(parse_quantity(text, "time", option) * PER_SECOND), PER_SECOND)


def interface_named(name: str, compensator: Compensator, cycle_time: str = "") -> Interface:
    """Return the scaling of an interface, ``plc`` or ``codes``, for a compensator, and its count of cycles."""
    cycle_s = cycle_time_s(cycle_time)
    signals, functions = compensator.signals, compensator.drive_functions
    command, of_codes, full = signals.command, name == "codes", signals.compare_max if name == "codes" else FULL
    pairs = {sign: signals.pair(sign) for sign in signals.signs}
    reverse = compensator.reverse_codes
    if not of_codes:
        reverse = floor(reverse * min(pair.ahead.per_code_MPa for pair in pairs.values()) / PRESSURE_MPa)
    unit = 1 if not of_codes or all(pair.like_sensors for pair in pairs.values()) else WEIGHT_UNIT
    pressures = {
        name: Pressure(low=each.valid_codes[0], high=each.valid_codes[1], zero=each.zero_code)
        if of_codes
        else _pressure(each, reverse)
        for name, each in signals.pressures.items()
    }
    low, high = command.valid_codes if of_codes else (-FULL, FULL)

    def units(codes: int, sign: int) -> int:
        """Return codes of command in units of the interface, rounded up."""
        return codes if of_codes else ceil(Fraction(codes * FULL, command.span(sign)))

    def per_unit(sign: int) -> Fraction:
        """Return the codes in a unit of the pressure drop."""
        if of_codes:
            return Fraction(1)
        ahead, behind = (pressures[each] for each in pairs[sign].names)
        largest = max(ahead.high - behind.low, behind.high - ahead.low)
        return _codes_per_unit(pairs[sign].ahead.per_code_MPa, largest)

    def tested_to(sign: int) -> int:
        """Return the largest tested pressure drop, in units of it."""
        last_MPa = compensator.side(sign).certificate.dp_MPa[1]
        return floor(last_MPa / (pairs[sign].ahead.per_code_MPa if of_codes else PRESSURE_MPa))

    return Interface(
        name=name,
        command_low=low,
        command_high=high,
        command_zero=command.zero_code if of_codes else 0,
        command_direction=command.direction(1) if of_codes else 1,
        pressures=pressures,
        weight_unit=unit,
        reverse=reverse,
        resolution=0 if of_codes else 1,
        full=full,
        limit=full * functions.compare_limit // signals.compare_max,
        rounds=of_codes,
        sides={
            sign: SideScaling(
                span=units(command.span(sign), sign),
                zero_band=units(compensator.zero_band_codes, sign),
                transition=units(compensator.transition_codes, sign),
                leave_zero=units(functions.leave_zero_codes, sign),
                interlock=None if functions.interlock_codes is None else units(functions.interlock_codes, sign),
                pair=pairs[sign].names,
                weight=pairs[sign].weight if unit > 1 else 1,
                codes_per_unit=per_unit(sign),
                tested_to=tested_to(sign),
                last_code=pairs[sign].largest_difference,
            )
            for sign in signals.signs
        },
        fault_cycles=ceil(debounce_s(compensator) / cycle_s) if cycle_s else 0,
    )


def _pressure(signal: PressureSignal, reverse: int) -> Pressure:
    """Return the valid pressures of a sensor in 0.1 bar.

    A converter that reads zero at no pressure reads it below, too: there a PLC may read as much less as is noise.
    """
    low, high = ((code - signal.zero_code) * signal.per_code_MPa / PRESSURE_MPa for code in signal.valid_codes)
    return Pressure(low=ceil(low) if signal.valid_codes[0] else -reverse, high=floor(high), zero=0)


def _codes_per_unit(per_code_MPa: Fraction, largest: int) -> Fraction:
    codes = PRESSURE_MPa / per_code_MPa
    if (largest + 1) * codes.numerator + codes.denominator > DINT_MAX:
        raise InputError(
            f"a pressure of 0.1 bar is {codes} codes of the sensor ahead, which needs more than 32 bits; give "
            "--pressure-span fewer digits, or take --interface codes"
        )
    return codes
