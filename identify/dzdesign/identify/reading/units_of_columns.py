"""The units in which a recording's columns stand, for whoever reads what was found: see `RecordedUnits`."""

from collections.abc import Mapping, Sequence
from pathlib import Path

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
from dzdesign.core.units import measures, read_signal_range, si_factor
from dzdesign.identify.constants import L_MIN, MPA
from dzdesign.identify.reading.column_labels import PRESSURES, Column
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.reading.scaling import Scaling, scaling_of

#: How many of a unit are 1 V, MPa or L/min, where numbers in it can be read: 1 MPa is 1e7 Ba.
SMALLEST_FACTOR, LARGEST_FACTOR = 1e-9, 1e9
#: What stands in front of one.
NOT_OF_A_UNIT = " +-0123456789.,"


def units_of_columns(path: Path, found: Mapping[str, Column], u_max: float) -> dict[Quantity, tuple[Unit, ...]]:
    """Return the units of a recording's columns, by quantity; 100 % of a command is `u_max`, V."""
    pressures = (pressure_unit(found[name].unit) for name in PRESSURES if name in found)
    units: dict[Quantity, tuple[Unit, ...]] = {
        "command": (_command_unit(path, found["u"], u_max),),
        "pressure": tuple(dict.fromkeys(unit for unit in pressures if unit)),
        "flow": tuple(unit for unit in (_flow_unit(found["Q"].unit),) if unit),
    }
    return {name: known for name, known in units.items() if known}


def units_of(tests: Sequence[RampTest]) -> RecordedUnits:
    """Return the units of recordings: of each quantity that in which all stand, or else V, MPa or L/min."""
    every: dict[Quantity, tuple[Unit, ...]] = {}
    for test in tests:
        for name, units in test.units.items():
            every[name] = (*every.get(name, ()), *units)
    return common_units(every)


def pressure_unit(text: str) -> PressureUnit | None:
    """Return a unit of pressure, or that of what a transmitter's range means; None if there is none."""
    unit = _meant(text)
    if not measures(unit, "pressure"):
        return None
    factor = significant(MPA / si_factor(unit, "pressure"))
    return PressureUnit() if factor == 1 or _extreme(factor) else PressureUnit(unit=name_of_unit(unit), factor=factor)


def unit_of_pressure(text: str) -> dict[Quantity, tuple[Unit, ...]]:
    """Return the unit of a declared pressure drop, such as ``20 bar``, as that of a recording without a column of it.

    Examples
    --------
    >>> unit_of_pressure("20 bar")
    {'pressure': (PressureUnit(unit='bar', factor=10.0),)}
    """
    unit = pressure_unit(text.lstrip(NOT_OF_A_UNIT))
    return {"pressure": (unit,)} if unit else {}


def _flow_unit(text: str) -> FlowUnit | None:
    unit = _meant(text)
    if not measures(unit, "flow"):
        return None
    factor = significant(L_MIN / si_factor(unit, "flow"))
    return FlowUnit() if factor == 1 or _extreme(factor) else FlowUnit(unit=name_of_unit(unit), factor=factor)


def _meant(unit: str) -> str:
    """Return what a transmitter's signal stands for: nobody reads a flow in milliamperes."""
    return unit.rpartition("=")[2].lstrip(NOT_OF_A_UNIT).strip() if "=" in unit else unit.strip()


def _extreme(factor: float) -> bool:
    """Whether a unit is none that a person reads a valve's quantity in."""
    return not SMALLEST_FACTOR <= abs(factor) <= LARGEST_FACTOR


def _command_unit(path: Path, column: Column, u_max: float) -> CommandUnit:
    """Return the unit of a command: that of the signal as it is declared, or else the column's own.

    A range of volts that stands for other volts, or for percent, is shown in what it stands for: two kinds of volts
    in one table would be taken for one another.
    """
    scaling, unit, declared = scaling_of(path, "u", column, u_max), column.unit.strip(), ""
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
