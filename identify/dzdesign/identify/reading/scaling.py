"""From the numbers of a column to SI: by its unit, or by the range of a transmitter, ``4..20 mA = 0..50 L/min``."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import final

from dzdesign.core.errors import InputError
from dzdesign.core.units import SI_UNIT, SignalRange, measures, read_signal_range, si_factor
from dzdesign.identify.reading.column_labels import (
    EXAMPLE_LABELS,
    LONGEST_NAME,
    PER_CENT,
    QUANTITY_OF_COLUMN,
    Column,
    same_unit,
)
from dzdesign.identify.reading.missing_values import NO_CURRENT

#: What a transmitter gives, or an amplifier takes; a range may be of any other unit, or of bare numbers.
TRANSMITTED = ("current", "voltage")
SIGNALS = (*TRANSMITTED, "frequency")
#: Units of them in another case, for which no broken wire would be seen.
MISTYPED = {"ma": "mA", "a": "A", "v": "V", "mv": "mV"}
#: Where a signal begins that is never below it, A.
LIVE_ZERO = 0.004
#: Full scale in the examples of messages.
FULL_SCALE: Mapping[str, str] = {"u": "0..10 V", "Q": "0..50 L/min"}


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
        raise InputError(f"'{path}' column '{column.label}' has no unit; write for example {EXAMPLE_LABELS[quantity]}")
    try:
        if "=" in column.unit or ".." in column.unit:
            return _of_range(quantity, column, u_max)
        return Scaling(gain=_factor(quantity, column.unit, u_max))
    except InputError as error:
        raise InputError(f"'{path}' column '{column.label}': {error}{_hint(quantity, column)}") from error


def _of_range(quantity: str, column: Column, u_max: float) -> Scaling:
    text = column.unit[:LONGEST_NAME]
    found = read_signal_range(column.unit.strip(), f"'{text}'", points=True)
    if found is None or found.meaning is None:
        raise InputError(f"'{text}' is no range, expected one such as '4..20 mA = {_full_scale(quantity)}'")
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


def _full_scale(quantity: str) -> str:
    return FULL_SCALE.get(quantity, "0..250 bar")


def _hint(quantity: str, column: Column) -> str:
    """Return what to write for a column that holds a transmitter's signal."""
    if quantity == "time" or not any(measures(column.unit, kind) for kind in TRANSMITTED):
        return ""
    return f"; say what the signal means, {range_example(quantity, column.label, column.unit)}"


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
            ends, _, last = meaning.rpartition("..")
            ends = ends or "0"
            first, last = (re.sub(r"^([-+]?)(?=0*[1-9.,])", _negated, each.strip()) for each in (ends, last))
            meaning = f"{first}..{last}"
        return f"{quantity}={column.label}:{signal} = {meaning}"
    if quantity == "u":
        end = "100" if unit.lower() in PER_CENT else f"{u_max / si_factor(unit, 'voltage'):g}"
        return f"u={column.label}:{end}..0 {unit} = 0..{end} {unit}"
    return f"{quantity}={column.label}:0..-1 {unit} = 0..1 {unit}"


def _negated(sign: re.Match[str]) -> str:
    return "" if sign[1] == "-" else "-"


def range_example(quantity: str, label: str, unit: str) -> str:
    """Return how a range is declared.

    Examples
    --------
    >>> range_example("Q", "Flow (mA)", "mA")
    'for example --columns "Q=Flow (mA):4..20 mA = 0..50 L/min"'
    """
    signal = "4..20" if measures(unit, "current") else "0..10"
    return f'for example --columns "{quantity}={label}:{signal} {unit} = {_full_scale(quantity)}"'
