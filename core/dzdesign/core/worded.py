"""Texts whose quantities are formatted later, in the units of the recordings, which their author need not know."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from string import Formatter
from typing import Any, final

from dzdesign.core.errors import DzdesignError
from dzdesign.core.recorded_units import AS_COMPUTED, RecordedUnits


class _Filler(Formatter):
    """Fills the places of a text: a quantity, another text with quantities, an error of one, or anything else."""

    def __init__(self, units: RecordedUnits) -> None:
        self._units = units

    def convert_field(self, value: Any, conversion: Any) -> Any:
        """Fill a text within the text."""
        if isinstance(value, Worded | DzdesignError):
            return in_units(value, self._units)
        return super().convert_field(value, conversion)

    def format_field(self, value: Any, format_spec: str) -> str:
        """Write a number; of a quantity, in the unit of the recordings."""
        spec, blank, unit = format_spec.partition(" ")
        if not blank:
            return format(value, spec)
        if unit.startswith("#"):  # without its unit, which another number of the sentence has
            return self._units.number(value, f"{spec} {unit[1:]}")
        return self._units.text(value, format_spec)


@final
@dataclass(frozen=True, slots=True)
class Worded:
    """A text with quantities that waits for the units of the recordings; `str` of it is in V, MPa and L/min.

    It stands in the place of the text in an error, so that whoever refuses a recording need not know its units.
    """

    template: str
    numbers: Mapping[str, object]

    def __str__(self) -> str:
        return in_units(self, AS_COMPUTED)


def worded(template: str, /, **numbers: object) -> Worded:
    """Return a text with quantities, such as ``worded("it opens at {knee:.2f V}", knee=5.2)``.

    ``{low:.2f #V}`` leaves the unit out. A place that nobody fills is a KeyError at once.
    """
    made = Worded(template, numbers)
    str(made)
    return made


def all_of(texts: Sequence[Worded], between: str = " and ") -> Worded:
    """Return several texts as one."""
    places = [f"text_{index}" for index in range(len(texts))]
    return worded(between.join(f"{{{place}}}" for place in places), **dict(zip(places, texts, strict=True)))


def in_units(text: "Worded | DzdesignError", units: RecordedUnits) -> str:
    """Return a text, or that of an error, in units."""
    if isinstance(text, DzdesignError):
        inner = text.args[0] if text.args else ""
        return in_units(inner, units) if isinstance(inner, Worded) else str(text)
    return _Filler(units).vformat(text.template, (), text.numbers)


@contextmanager
def errors_in(units: RecordedUnits) -> Iterator[None]:
    """Raise the errors of a block with their quantities in units."""
    try:
        yield
    except DzdesignError as error:
        error.args = (in_units(error, units),)
        raise
