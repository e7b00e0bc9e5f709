"""The units in which a person sees what is computed in V, MPa and L/min; converted here only.

They are those of the recordings.

A number in a text is written with a format and the unit in which it is computed, as in ``{knee:.3f V}``.
`RecordedUnits` turns it into the unit of the recordings, and the decimals into those of the same significance;
`worded` does so for whole texts, in the units that `shown_in` has set once the recordings were read.
"""

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from string import Formatter
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar, final

from msgspec import Meta

from dzdesign.core.artefact_types import RuleError, quantity
from dzdesign.core.units import without_reference

if TYPE_CHECKING:
    import numpy as np

#: Characters of a unit: of a bare number, such as a duty cycle, it is the label of its column.
LONGEST_UNIT = 40
Number = TypeVar("Number", float, "np.ndarray")
UnitName = Annotated[str, Meta(description="Name of the unit.", min_length=1, max_length=LONGEST_UNIT)]


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class CommandUnit:
    """Unit of the command: a reading is ``at_zero + factor * u`` at a command of u volts."""

    unit: UnitName = "V"
    at_zero: Annotated[float, quantity("1", ge=-1e12, le=1e12)] = 0.0
    """Reading at a command of 0 V, such as 12 for 4..20 mA."""
    factor: Annotated[float, quantity("1/V", ge=-1e12, le=1e12)] = 1.0
    """Change of the reading per volt of command."""
    declared: Annotated[str, Meta(max_length=120)] = ""
    """Declared range, such as '4..20 mA = -10..10 V'; empty if none was declared."""

    def __post_init__(self) -> None:
        if self.factor == 0:
            raise RuleError("the command's factor is 0, expected the change of its reading with the command")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class PressureUnit:
    """Unit of the pressure drop."""

    unit: UnitName = "MPa"
    factor: Annotated[float, quantity("1/MPa", "Number of these units in 1 MPa.", gt=0, le=1e12)] = 1.0


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class FlowUnit:
    """Unit of the flow."""

    unit: UnitName = "L/min"
    factor: Annotated[float, quantity("min/L", "Number of these units in 1 L/min.", gt=0, le=1e12)] = 1.0


Quantity = Literal["command", "pressure", "flow"]
Unit = CommandUnit | PressureUnit | FlowUnit


@dataclass(frozen=True, slots=True)
class _Kind:
    """A unit in which something is computed: powers of command, pressure and flow in it, and how it is named.

    `label` is how it is named where its quantities are not in V, MPa and L/min; `scale` brings it to them.
    """

    label: str
    u: int = 0
    dp: int = 0
    q: int = 0
    scale: float = 1.0
    #: A reading, which has a zero, and no difference of two.
    reading: bool = False


#: Units that stand in formats. A difference of two commands is in ``mV``, or in ``dV`` where it is printed in V.
_KINDS = {
    "V": _Kind("{u}", u=1, reading=True),
    "dV": _Kind("{u}", u=1),
    "mV": _Kind("{u}", u=1, scale=1e-3),
    "V/s": _Kind("{u}/s", u=1),
    "V/mm": _Kind("{u}/mm", u=1),
    "MPa": _Kind("{dp}", dp=1),
    "L/min": _Kind("{q}", q=1),
    "L/min/V": _Kind("{q}/{u}", u=-1, q=1),
    "L/min a volt": _Kind("{q} per {u}", u=-1, q=1),
    "mV/MPa²": _Kind("{u}/{dp}²", u=1, dp=-2, scale=1e-3),
    "L/min per MPa": _Kind("{q} per {dp}", dp=-1, q=1),
    "A": _Kind("A"),
}
_FORMAT = re.compile(r"(?P<sign>\+?)(?:\.(?P<digits>\d+))?(?P<kind>[fg])")


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordedUnits:
    """Units in which a valve is shown; the numbers of an artefact are in V, MPa and L/min whatever these are."""

    command: CommandUnit = CommandUnit()
    """Unit of the command."""
    pressure: PressureUnit = PressureUnit()
    """Unit of the pressure drop."""
    flow: FlowUnit = FlowUnit()
    """Unit of the flow."""
    differ: tuple[Quantity, ...] = ()
    """Quantities whose units differ between the recordings. They are displayed in V, MPa or L/min."""

    def of_side(self, side: str) -> "RecordedUnits":
        """Return the units in which a side's commands were recorded, which are counted from zero in valve.json.

        A reading that is not zero at zero command, such as 12 mA, falls on the negative side; any other is shown as its
        distance from zero, as volts are.
        """
        command = self.command
        if side != "negative" or command.at_zero == 0:
            return self
        return replace(self, command=replace(command, factor=-command.factor))

    @property
    def of_controller(self) -> "RecordedUnits":
        """Units in which the controller's own command is shown: V, or per cent where the recordings are.

        What the bench put out, such as 4..20 mA, is not the signal that --command-signal declares at the converter.
        """
        return self if self.command.unit == "%" else replace(self, command=CommandUnit())

    @property
    def falling(self) -> bool:
        """Whether the reading of the command falls where the valve opens."""
        return self.command.factor < 0

    def text(self, value: float, form: str) -> str:
        """Return a number with its unit.

        Examples
        --------
        >>> bench = RecordedUnits(command=CommandUnit(unit="mA", at_zero=4.0, factor=1.6))
        >>> bench.text(5.2, ".2f V"), bench.text(3.0, ".0f mV"), RecordedUnits().text(3.0, ".0f mV")
        ('12.32 mA', '0.005 mA', '3 mV')
        """
        return f"{self.number(value, form)} {self.label(form.partition(' ')[2])}"

    def number(self, value: float, form: str) -> str:
        """Return a number without its unit, for a cell under the unit or in front of it."""
        spec, _, unit = form.partition(" ")
        kind = _KINDS[unit]
        if self._as_computed(kind):
            return _without_exponent(value, spec)
        found = _FORMAT.fullmatch(spec)
        if found is None:
            raise ValueError(f"{spec!r} is no format of a quantity, expected one such as '.3f'")
        gain, shown = self._gain(kind), float(self.convert(value, unit))
        digits = int(found["digits"] or 6)
        if found["kind"] == "f":
            shown = round(shown, decimals := max(0, round(digits - math.log10(abs(gain)))))
            return format(shown + 0.0, f"{found['sign']}.{decimals}f")
        return _without_exponent(shown, spec)

    def label(self, unit: str) -> str:
        """Return the name of the unit that stands for one in which something is computed, for a header or an axis."""
        kind = _KINDS[unit]
        if self._as_computed(kind):
            return "V" if unit == "dV" else unit
        return kind.label.format(u=self.command.unit, dp=self.pressure.unit, q=self.flow.unit)

    def convert(self, value: Number, unit: str) -> Number:
        """Return a number or an array of the unit in which it is computed in that of the recordings, for a plot."""
        kind = _KINDS[unit]
        if self._as_computed(kind):
            return value
        return value * self._gain(kind) + (self.command.at_zero if kind.reading else 0.0)

    def span(self, low: float, high: float, form: str) -> str:
        """Return from where to where something runs, or where it is.

        Examples
        --------
        >>> RecordedUnits().span(1.0, 4.0, ".2f MPa"), RecordedUnits().span(0.9993, 0.9993, ".2f MPa")
        ('from 1.00 to 4.00 MPa', 'at 1.00 MPa')
        """
        first, last = self.number(low, form), self.number(high, form)
        unit = self.label(form.partition(" ")[2])
        return f"at {first} {unit}" if first == last else f"from {first} to {last} {unit}"

    def in_words(self) -> str:
        """Return what is shown in which unit; nothing where all are V, MPa and L/min."""
        command, parts = self.command, []
        if not self._as_computed(_KINDS["V"]):
            declared = f" ({command.declared})" if command.declared else ""
            counted = f", {command.at_zero:g} {command.unit} being zero" if command.at_zero else ""
            parts.append(f"command in {command.unit}{declared}{counted}")
        parts += [f"pressure drop in {self.pressure.unit}"] if self.pressure.factor != 1 else []
        parts += [f"flow in {self.flow.unit}"] if self.flow.factor != 1 else []
        differing = f"the recordings differ in the unit of {' and '.join(self.differ)}, shown in " + " and ".join(
            {"command": "V", "pressure": "MPa", "flow": "L/min"}[name] for name in self.differ
        )
        lines = (", ".join(parts), self.differ and differing)
        return "; ".join(line for line in lines if line)

    def _as_computed(self, kind: _Kind) -> bool:
        """Whether a unit stays as it is; then a number is printed to the same digit as without recordings."""
        command = self.command
        return not (
            (kind.u and (command.unit, command.at_zero, command.factor) != ("V", 0.0, 1.0))
            or (kind.dp and (self.pressure.unit, self.pressure.factor) != ("MPa", 1.0))
            or (kind.q and (self.flow.unit, self.flow.factor) != ("L/min", 1.0))
        )

    def _gain(self, kind: _Kind) -> float:
        """Return the factor of a unit; that of a difference is positive: it counts from zero command outwards."""
        factor = self.command.factor if kind.reading else abs(self.command.factor)
        return kind.scale * factor**kind.u * self.pressure.factor**kind.dp * self.flow.factor**kind.q


def _without_exponent(value: float, spec: str) -> str:
    """Return a number in a format; one such as 1150 as it is, where ``.3g`` makes 1.15e+03 of it."""
    text = format(value, spec)
    return format(value, f"{'+' if spec.startswith('+') else ''}.0f") if "e+" in text else text


#: V, MPa and L/min.
AS_COMPUTED = RecordedUnits()
_SHOWN: ContextVar[RecordedUnits] = ContextVar("units in which texts are worded", default=AS_COMPUTED)


@contextmanager
def shown_in(units: RecordedUnits) -> Iterator[None]:
    """Word the texts of a block in units: who words a warning or a refusal need not know those of the recordings."""
    before = _SHOWN.set(units)
    try:
        yield
    finally:
        _SHOWN.reset(before)


class _Filler(Formatter):
    """Fills the places of a text with quantities, or anything else."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Write a number; of a quantity, in the unit of the recordings."""
        spec, blank, unit = format_spec.partition(" ")
        if not blank:
            return format(value, spec)
        if unit.startswith("#"):  # without its unit, which another number of the sentence has
            return _SHOWN.get().number(value, f"{spec} {unit[1:]}")
        return _SHOWN.get().text(value, format_spec)


def worded(template: str, /, **numbers: object) -> str:
    """Return a text with quantities, in the units of `shown_in`; ``{low:.2f #V}`` leaves the unit out.

    Examples
    --------
    >>> with shown_in(RecordedUnits(command=CommandUnit(unit="mA", at_zero=4.0, factor=1.6))):
    ...     worded("it opens at {knee:.2f V}", knee=5.2)
    'it opens at 12.32 mA'
    """
    return _Filler().vformat(template, (), numbers)


#: Spellings of a unit the name of which is another.
_NAMES: dict[str, str] = {
    "m3s": "m3/s", "lph": "L/h", "l/h": "L/h", "pct": "%", "percent": "%",
}  # fmt: skip


def name_of_unit(written: str) -> str:
    """Return the name of a unit as written somewhere, on one printable line; empty if that is no text for people."""
    name = _NAMES.get(written.lower()) or " ".join(without_reference(written).split())
    return name if name.isprintable() and len(name) <= LONGEST_UNIT else ""


def significant(factor: float) -> float:
    """Return a factor without the noise of its last digits."""
    return float(f"{factor:.12g}")


def common_units(units: "Mapping[Quantity, tuple[Unit, ...]]") -> RecordedUnits:
    """Return the units of several recordings: of a quantity the one that all have, or else V, MPa, L/min.

    Of recordings that differ none is the reader's own, and to take the first would hang on the order of the files.
    """
    chosen: dict[str, Any] = {}
    differ: list[Quantity] = []
    for name in ("command", "pressure", "flow"):
        known = tuple(dict.fromkeys(units.get(name, ())))
        if len(known) == 1:
            chosen[name] = known[0]
        elif known:
            differ.append(name)
    return RecordedUnits(**chosen, differ=tuple(differ))
