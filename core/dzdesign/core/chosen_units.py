"""The units that a person asks for (`--units`), in place of those of the recordings."""

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace

from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.core.options import Texts
from dzdesign.core.recorded_units import (
    CommandUnit,
    CurrentUnit,
    FlowUnit,
    PressureUnit,
    Quantity,
    RecordedUnits,
    name_of_unit,
    significant,
)
from dzdesign.core.units import EXAMPLES, measures, si_factor

#: Quantity -> its unit in the files, in SI.
IN_FILES = {"pressure": 1e6, "flow": 1e-3 / 60, "voltage": 1.0, "current": 1.0}
PER_CENT = ("%", "pct", "percent")
EXAMPLE = "bar, %, mA"
#: How many of a unit are 1 V, MPa, L/min or A, where numbers in it can be read: 1 MPa is 1e7 Ba.
SMALLEST_FACTOR, LARGEST_FACTOR = 1e-9, 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class ChosenUnits:
    """One unit a quantity, as written; empty: that of the recordings."""

    pressure: str = ""
    flow: str = ""
    #: Of the command: "%" of full command, or a voltage.
    command: str = ""
    #: Of a solenoid's current; of the command too where that was recorded as a current.
    current: str = ""

    def over(self, recorded: RecordedUnits, u_max_V: float) -> RecordedUnits:
        """Return the units of recordings with the chosen ones in their place; full command is `u_max_V`.

        Examples
        --------
        >>> units = read_units("bar, %", "--units").over(RecordedUnits(), 10.0)
        >>> units.text(5.2, ".3f V"), units.text(2.5, ".2f MPa"), units.label("L/min")
        ('52.00 %', '25.0 bar', 'L/min')
        """
        chosen = replace(recorded, command=self._command(recorded.command, u_max_V))
        if self.pressure:
            chosen = replace(chosen, pressure=PressureUnit(unit=self.pressure, factor=_per(self.pressure, "pressure")))
        if self.flow:
            chosen = replace(chosen, flow=FlowUnit(unit=self.flow, factor=_per(self.flow, "flow")))
        if self.current:
            chosen = replace(chosen, current=CurrentUnit(unit=self.current, factor=_per(self.current, "current")))
        known: dict[Quantity, bool] = {
            "command": bool(self.command) or chosen.command != recorded.command,
            "pressure": bool(self.pressure),
            "flow": bool(self.flow),
        }
        return replace(chosen, differ=tuple(each for each in recorded.differ if not known[each]))

    def _command(self, recorded: CommandUnit, u_max_V: float) -> CommandUnit:
        if self.command == recorded.unit:  # "%" that runs backwards, or from 4 to 20, stays what the bench shows
            return recorded
        if self.command == "%":
            return CommandUnit(unit="%", factor=significant(100 / u_max_V))
        if self.command:
            return CommandUnit(unit=self.command, factor=_per(self.command, "voltage"))
        if self.current and recorded.unit != self.current and measures(recorded.unit, "current"):
            scale = si_factor(recorded.unit, "current") / si_factor(self.current, "current")
            return replace(
                recorded,
                unit=self.current,
                factor=significant(recorded.factor * scale),
                at_zero=significant(recorded.at_zero * scale),
            )
        return recorded


def read_units(given: Texts, option: str) -> ChosenUnits:
    """Read units with commas between them, or one or several an item: at most one of each quantity.

    Raises
    ------
    InputError
        If one is not a unit, or two are of one quantity.
    """
    items = [given] if isinstance(given, str | os.PathLike) or not isinstance(given, Iterable) else list(given)
    if not all(isinstance(item, str) for item in items):
        raise InputError(f"{option} is {quoted(given)}, expected units such as '{EXAMPLE}'")
    found: dict[str, str] = {}
    for name in (part.strip() for item in items for part in item.split(",")):
        quantity = _quantity_of(name, option)
        if quantity in found:
            raise InputError(
                f"{option} names two units of {quantity}, '{found[quantity]}' and '{name}'; give one of each quantity"
            )
        _refuse_unreadable(name, option)
        found[quantity] = name_of_unit(name)
    return ChosenUnits(**found)


def _quantity_of(name: str, option: str) -> str:
    if name.lower() in PER_CENT or measures(name, "voltage"):
        return "command"
    for quantity in ("pressure", "flow", "current"):
        if measures(name, quantity):
            return quantity
    known = [unit for quantity in IN_FILES for unit in EXAMPLES[quantity].split(", ")]
    raise InputError(
        f"{option} has {quoted(name)}, no unit of a pressure, a flow, a command or a current{nearest(name, known)}; "
        f"expected units such as '{EXAMPLE}'"
    )


def _per(unit: str, quantity: str) -> float:
    """Return how many of a unit are one of the files'."""
    return significant(IN_FILES[quantity] / si_factor(unit, quantity))


def _refuse_unreadable(name: str, option: str) -> None:
    """Refuse a unit in which nobody reads a valve: a number in it would have a dozen digits."""
    kinds = [quantity for quantity in IN_FILES if measures(name, quantity)]
    if kinds and not SMALLEST_FACTOR <= _per(name, kinds[0]) <= LARGEST_FACTOR:
        raise InputError(f"{option} has {quoted(name)}, in which a valve's numbers can't be read; give '{EXAMPLE}'")
