"""From the numbers of a column to SI: by its unit, or by the range of a transmitter, ``4..20 mA = 0..50 L/min``.

And the units in which a recording's columns stand, for whoever reads what was found: see `RecordedUnits`.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Literal, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import (
    CommandUnit,
    FlowUnit,
    PressureUnit,
    Quantity,
    RecordedUnits,
    Unit,
    common_units,
    name_of_unit,
    significant,
)
from dzdesign.core.units import SI_UNIT, SignalRange, measures, read_signal_range, si_factor
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.reading.column_labels import (
    EXAMPLE_UNITS,
    LONGEST_NAME,
    PER_CENT,
    PRESSURES,
    QUANTITY_OF_COLUMN,
    Column,
    same_unit,
)
from dzdesign.identify.reading.missing_values import NO_CURRENT
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, Table

#: What a transmitter gives, or an amplifier takes; a range may be of any other unit, or of bare numbers.
TRANSMITTED = ("current", "voltage")
SIGNALS = (*TRANSMITTED, "frequency")
#: Units of them in another case, for which no broken wire would be seen.
MISTYPED = {"ma": "mA", "a": "A", "v": "V", "mv": "mV"}
#: Where a signal begins that is never below it, A.
LIVE_ZERO = 0.004
#: Full scale in the examples of messages.
FULL_SCALE = {"u": "0..10 V", "Q": "0..50 L/min", **dict.fromkeys(PRESSURES, "0..250 bar")}
#: SI numbers beyond these are not a measurement of a valve: a wrong unit, or what a logger writes for an overflow.
LARGEST = {"time": 1e12, "voltage": 1e4, "pressure": 1e9, "flow": 10.0}
#: How many of a unit are 1 V, MPa or L/min, where numbers in it can be read: 1 MPa is 1e7 Ba.
SMALLEST_FACTOR, LARGEST_FACTOR = 1e-9, 1e9
#: What stands in front of one.
NOT_OF_A_UNIT = " +-0123456789.,"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Scaling:
    """What turns a column's number into SI: ``gain * number + offset``.

    Numbers below `no_signal_below` are those of a broken wire; `ends` are those of a declared range, in SI.
    """

    gain: float
    offset: float = 0.0
    no_signal_below: float = -math.inf
    ends: tuple[float, float] | None = None


def scaling_of(path: Path, quantity: str, column: Column, u_max: float) -> Scaling:
    """Return how a column's numbers become SI.

    A column's unit may be a range such as ``4..20 mA = 0..50 L/min``; 100 % of a command is `u_max`, V.

    Raises
    ------
    InputError
        If the unit is none of the quantity's.
    """
    if not column.unit:
        raise no_unit(path, quantity, column.label)
    try:
        if "=" in column.unit or ".." in column.unit:
            return _of_range(quantity, column, u_max)
        return Scaling(gain=_factor(quantity, column.unit, u_max))
    except InputError as error:
        is_signal = quantity != "time" and any(measures(column.unit, kind) for kind in TRANSMITTED)
        example = range_example(quantity, column.label, column.unit) if is_signal else ""
        hint = f"; say what the signal means, {example}" if is_signal else ""
        raise InputError(f"'{path}' column '{column.label}': {error}{hint}") from error


def no_unit(path: Path, quantity: str, label: str) -> InputError:
    """Return the error for a column whose unit nobody knows."""
    meaning = f', or what its numbers mean, --columns "u={label}:0..1 = 0..100 %"' if quantity == "u" else ""
    example = f'--columns "{quantity}={label}:{EXAMPLE_UNITS[quantity]}"{meaning}'
    return InputError(f"'{path}' column '{label}' has no unit; write for example {example}")


def in_SI(table: Table, quantity: str, column: Column, numbers: np.ndarray, scaling: Scaling) -> np.ndarray:
    """Return one column in SI, NaN where a sample is missing; refuse what no valve gives."""
    with np.errstate(over="ignore", invalid="ignore"):  # an infinity is refused below
        numbers = numbers * scaling.gain
        numbers += scaling.offset
    largest = LARGEST[QUANTITY_OF_COLUMN[quantity]]
    if np.fmax.reduce(numbers, initial=0.0) > largest or np.fmin.reduce(numbers, initial=0.0) < -largest:
        row = int(np.flatnonzero(np.abs(numbers) > largest)[0])
        raise InputError(
            f"'{table.path}' {table.place(row)}, column '{column.label}': "
            f"'{table.cell(column.label, row)[:QUOTED_CHARACTERS]}' is no measurement of a valve in that unit; "
            "correct it, or leave the cell blank if the sample is missing"
        )
    return numbers


def _of_range(quantity: str, column: Column, u_max: float) -> Scaling:
    text = column.unit[:LONGEST_NAME]
    found = read_signal_range(column.unit.strip(), f"'{text}'", points=True)
    if found is None or found.meaning is None:
        raise InputError(f"'{text}' is no range, expected one such as '4..20 mA = {FULL_SCALE[quantity]}'")
    meaning = found.meaning
    if found.unit.lower() in MISTYPED and not any(measures(found.unit, kind) for kind in TRANSMITTED):
        raise InputError(f"'{found.unit}' is no unit of a signal (did you mean '{MISTYPED[found.unit.lower()]}'?)")
    low, high = _ends_in_the_file(quantity, column, found)
    if low == high or meaning.bottom == meaning.top:
        raise InputError(f"the range '{text}' has no width, expected one such as '4..20 mA = 0..50 L/min'")
    gain = (meaning.top - meaning.bottom) / (high - low)
    factor = _factor(quantity, meaning.unit, u_max)
    return Scaling(
        gain=float(gain) * factor,
        offset=float(meaning.bottom - gain * low) * factor,
        no_signal_below=_no_signal_below(found, low, high),
        ends=(float(meaning.bottom) * factor, float(meaning.top) * factor),
    )


def _no_signal_below(found: SignalRange, low: Fraction, high: Fraction) -> float:
    """Return the number of a column below which a signal of 4 to 20 mA is none; infinite for other signals.

    `low` and `high` are what the column holds at the ends of the range.
    """
    if not measures(found.unit, "current"):
        return -math.inf
    first, last = (float(end) * si_factor(found.unit, "current") for end in (found.low, found.high))
    if not math.isclose(min(first, last), LIVE_ZERO):
        return -math.inf
    return float(low) + (NO_CURRENT - first) * float(high - low) / (last - first)


def _ends_in_the_file(quantity: str, column: Column, found: SignalRange) -> tuple[Fraction, Fraction]:
    """Return the ends of a signal in the unit of the column: its own, or that of the voltage that its wiring makes."""
    stated = column.stated
    if not found.is_wired:
        of_signal = (found.unit, found.meaning.unit if found.meaning else "")
        kinds = [kind for kind in SI_UNIT if measures(stated, kind) and measures(found.unit, kind)]
        is_same = [math.isclose(si_factor(stated, kind), si_factor(found.unit, kind)) for kind in kinds]
        in_doubt = not all(is_same) if kinds else any(measures(stated, kind) for kind in SIGNALS)
        if in_doubt and not any(same_unit(stated, unit, quantity) for unit in of_signal):
            raise InputError(
                f"the range '{found.text}' is of a column in {found.unit or 'bare numbers'}, but the file says "
                f"'{stated}'; write the range in {stated}, or correct the unit in the file"
            )
        return found.low, found.high
    if any(measures(stated, kind) for kind in SIGNALS) and not measures(stated, "voltage"):
        raise InputError(
            f"the range '{found.text}' is of the voltage behind its wiring, but the file says '{stated}'; write the "
            "range of that alone"
        )
    kind = "voltage" if found.shunt_ohm is None else "current"
    volts = Fraction(repr(si_factor(found.unit, kind))) * (found.shunt_ohm or 1) * found.gain
    per_volt = 1 / Fraction(repr(si_factor(stated, "voltage"))) if measures(stated, "voltage") else Fraction(1)
    low, high = ((end * volts + found.offset_V) * per_volt for end in (found.low, found.high))
    return low, high


def _factor(quantity: str, unit: str, u_max: float) -> float:
    """Return the factor from a unit to SI; a command may also be in percent of u_max."""
    if quantity == "u" and unit.lower() in PER_CENT:
        return u_max * si_factor(unit, "ratio")
    return si_factor(unit, QUANTITY_OF_COLUMN[quantity])


def turned(quantity: str, column: Column, u_max: float) -> str:
    """Return how --columns turns a command that opens the valve as it falls, or a flow of the wrong sign.

    Examples
    --------
    >>> turned("u", Column(label="u_V", unit="V"), 10.0), turned("Q", Column(label="Q", unit="L/min"), 10.0)
    ('u=u_V:10..0 V = 0..10 V', 'Q=Q:0..-1 L/min = 0..1 L/min')
    >>> turned("Q", Column(label="I", unit="4..20 mA = 0..50 L/min"), 10.0)
    'Q=I:4..20 mA = 0..-50 L/min'
    """
    unit, end = column.unit, "1"
    if "=" in unit:
        signal, _, meaning = (part.strip() for part in unit.partition("="))
        if quantity == "u":
            signal = re.sub(r"^(\S+?)\s*\.\.\s*([-+]?[\d.,]*\d)", r"\2..\1", signal)
        else:
            first, _, last = meaning.rpartition("..")
            minus = {"": "-", "+": "-", "-": ""}
            ends = (re.split(r"^([-+]?)", each.strip())[1:] for each in (first or "0", last))
            meaning = "..".join(f"{minus[sign] if re.match('0*[1-9.,]', end) else sign}{end}" for sign, end in ends)
        return f"{quantity}={column.label}:{signal} = {meaning}"
    if quantity == "u":
        end = "100" if unit.lower() in PER_CENT else f"{u_max / si_factor(unit, 'voltage'):g}"
        return f"u={column.label}:{end}..0 {unit} = 0..{end} {unit}"
    return f"{quantity}={column.label}:0..-1 {unit} = 0..1 {unit}"


def range_example(quantity: str, label: str, unit: str) -> str:
    """Return how a range is declared.

    Examples
    --------
    >>> range_example("Q", "Flow (mA)", "mA")
    'for example --columns "Q=Flow (mA):4..20 mA = 0..50 L/min"'
    """
    signal = "4..20" if measures(unit, "current") else "0..10"
    return f'for example --columns "{quantity}={label}:{signal} {unit} = {FULL_SCALE[quantity]}"'


# the units for a reader


def units_of_columns(
    path: Path, found: Mapping[str, Column], command: Scaling, u_max: float
) -> dict[Quantity, tuple[Unit, ...]]:
    """Return the units of a recording's columns, by quantity, with the command's scaling; 100 % of it is `u_max`, V."""
    pressures = (_recorded_unit("pressure", found[name].unit) for name in PRESSURES if name in found)
    units: dict[Quantity, tuple[Unit | None, ...]] = {
        "command": (_command_unit(path, found["u"], command, u_max),),
        "pressure": tuple(dict.fromkeys(pressures)),
        "flow": (_recorded_unit("flow", found["Q"].unit),),
    }
    return {name: known for name, every in units.items() if (known := tuple(unit for unit in every if unit))}


def units_of(tests: Sequence[RampTest]) -> RecordedUnits:
    """Return the units of recordings: of each quantity that in which all stand, or else V, MPa or L/min."""
    every: dict[Quantity, tuple[Unit, ...]] = {}
    for test in tests:
        for name, units in test.units.items():
            every[name] = (*every.get(name, ()), *units)
    return common_units(every)


def _recorded_unit(quantity: Literal["pressure", "flow"], text: str) -> PressureUnit | FlowUnit | None:
    """Return a unit of pressure or flow, or that of what a transmitter's range means; None if there is none.

    Nobody reads a flow in milliamperes.
    """
    unit = text.rpartition("=")[2].lstrip(NOT_OF_A_UNIT).strip() if "=" in text else text.strip()
    if not measures(unit, quantity):
        return None
    kind, one = (PressureUnit, MPA) if quantity == "pressure" else (FlowUnit, L_MIN)
    factor = significant(one / si_factor(unit, quantity))
    return kind() if factor == 1 or _extreme(factor) else kind(unit=name_of_unit(unit), factor=factor)


def unit_of_pressure(text: str) -> dict[Quantity, tuple[Unit, ...]]:
    """Return the unit of a declared pressure drop, such as ``20 bar``, as that of a recording without a column of it.

    Examples
    --------
    >>> unit_of_pressure("20 bar")
    {'pressure': (PressureUnit(unit='bar', factor=10.0),)}
    """
    unit = _recorded_unit("pressure", text.lstrip(NOT_OF_A_UNIT))
    return {"pressure": (unit,)} if unit else {}


def _extreme(factor: float) -> bool:
    """Whether a unit is none that a person reads a valve's quantity in."""
    return not SMALLEST_FACTOR <= abs(factor) <= LARGEST_FACTOR


def _command_unit(path: Path, column: Column, scaling: Scaling, u_max: float) -> CommandUnit:
    """Return the unit of a command: that of the signal as it is declared, or else the column's own.

    A range of volts that stands for other volts, or for percent, is shown in what it stands for: two kinds of volts
    in one table would be taken for one another.
    """
    unit, declared = column.unit.strip(), ""
    signal = read_signal_range(unit, "u", points=True) if "=" in unit else None
    if signal is not None and signal.meaning is not None:
        declared = " ".join(unit.split())
        low, high = float(signal.low), float(signal.high)
        name = signal.unit or column.stated or column.label
        means = signal.meaning
        factor = scaling_of(path, "u", Column(label=column.label, unit=means.unit), u_max).gain
        bottom, top = float(means.bottom) * factor, float(means.top) * factor
        gain = (top - bottom) / (high - low)
        if measures(name, "voltage"):
            scaling, unit, declared = Scaling(gain=factor), means.unit, ""
        else:
            scaling, unit = Scaling(gain=gain, offset=bottom - gain * low), name
    unit = name_of_unit(unit)
    factor, at_zero = significant(1 / scaling.gain), significant(-scaling.offset / scaling.gain)
    if column.less is not None and at_zero:  # the difference of two currents from 4 mA on is none of that range
        return CommandUnit()
    if not unit or _extreme(factor) or (measures(unit, "voltage") and (factor, at_zero) == (1.0, 0.0)):
        return CommandUnit()
    return CommandUnit(unit=unit, factor=factor, at_zero=at_zero + 0.0, declared=declared)
