"""From the numbers of a column to SI: by its unit, or by the range of a transmitter, ``4..20 mA = 0..50 L/min``."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import final

from dzdesign.core.errors import InputError
from dzdesign.core.units import measures, refuse_thousands, si_factor
from dzdesign.identify.reading.column_labels import EXAMPLE_LABELS, PER_CENT, QUANTITY_OF_COLUMN, Column, same_unit

_NUMBER = r"([-+]?\d{1,9}(?:[.,]\d{1,9})?)"
_ENDS = rf"{_NUMBER}\s?\.\.\s?{_NUMBER}\s?"
#: A range of what the column holds, and what it means.
RANGE = re.compile(rf"{_ENDS}([^\s=][^=]{{0,39}})=\s?{_ENDS}(\S.{{0,39}})")
#: What a transmitter gives.
SIGNALS = ("current", "voltage")
#: Full scale in the examples of messages.
FULL_SCALE: Mapping[str, str] = {"u": "0..10 V", "Q": "0..50 L/min"}


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Scaling:
    """What turns a column's number into SI: ``gain * number + offset``."""

    gain: float
    offset: float = 0.0


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
    text = column.unit
    found = RANGE.fullmatch(text.strip())
    if found is None:
        raise InputError(f"'{text[:80]}' is no range, expected one such as '4..20 mA = {_full_scale(quantity)}'")
    refuse_thousands(text, f"'{text[:80]}'", points=True)
    low, high, bottom, top = (float(found[index].replace(",", ".")) for index in (1, 2, 4, 5))
    signal = found[3].strip()
    if not any(measures(signal, kind) for kind in SIGNALS):
        raise InputError(f"'{signal}' is no unit of a transmitter's signal, expected mA, A, V or mV")
    if any(measures(column.stated, kind) for kind in SIGNALS) and not any(
        same_unit(column.stated, unit, quantity) for unit in (signal, found[6].strip())
    ):
        raise InputError(
            f"the range '{text[:80]}' is of a column in {signal}, but the file says '{column.stated}'; write the range "
            f"in {column.stated}, or correct the unit in the file"
        )
    if low == high or bottom == top:
        raise InputError(f"the range '{text[:80]}' has no width, expected one such as '4..20 mA = 0..50 L/min'")
    gain = (top - bottom) / (high - low)
    factor = _factor(quantity, found[6].strip(), u_max)
    return Scaling(gain=gain * factor, offset=(bottom - gain * low) * factor)


def _factor(quantity: str, unit: str, u_max: float) -> float:
    """Return the factor from a unit to SI; a command may also be in per cent of u_max."""
    if quantity == "u" and unit.lower() in PER_CENT:
        return u_max * si_factor(unit, "ratio")
    return si_factor(unit, QUANTITY_OF_COLUMN[quantity])


def _full_scale(quantity: str) -> str:
    return FULL_SCALE.get(quantity, "0..250 bar")


def _hint(quantity: str, column: Column) -> str:
    """Return what to write for a column that holds a transmitter's signal."""
    if quantity == "time" or not any(measures(column.unit, kind) for kind in SIGNALS):
        return ""
    return f"; say what the signal means, {range_example(quantity, column.label, column.unit)}"


def range_example(quantity: str, label: str, unit: str) -> str:
    """Return how a range is declared.

    Examples
    --------
    >>> range_example("Q", "Flow (mA)", "mA")
    'for example --columns "Q=Flow (mA):4..20 mA = 0..50 L/min"'
    """
    signal = "4..20" if measures(unit, "current") else "0..10"
    return f'for example --columns "{quantity}={label}:{signal} {unit} = {_full_scale(quantity)}"'
