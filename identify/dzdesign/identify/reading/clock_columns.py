"""Which columns of a table are times, and whose clock each is: told by labels and units, once for a table."""

import re
from dataclasses import dataclass
from functools import cached_property
from typing import final

from dzdesign.core.errors import InputError
from dzdesign.core.units import measures
from dzdesign.identify.reading.column_labels import (
    LONGEST_NAME,
    Column,
    fits,
    names_a_quantity_or_current,
    quantity_named,
    split_label,
)
from dzdesign.identify.reading.table import Table

#: A column of time, and the quantity that it may name before or behind: Time, t_u, X_Value, time of Q, Flow Time.
CLOCK_OF = re.compile(
    r"((?i:time[ _]?stamp|time|zeit|x_?value)|[tT])(?:[\s_.:-]+|(?=[A-Z0-9]|d[pP]|$))(?:(?:of|for)\s)?(.*)"
)
ELAPSED = re.compile(r"elapsed|relative|clock|uhr", re.IGNORECASE)
OF_CLOCK = re.compile(r"(.*?)[\s_.:-]+(time[ _]?stamp|time|zeit|t)", re.IGNORECASE)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class _Kind:
    """What a column of time says of itself: its word, its unit, and what it is the time of.

    `unit` is empty for stamps, ``-`` where it is not known, and ``?`` for what may be a temperature as well.
    """

    word: str
    unit: str
    of: str


@final
class ClockColumns:
    """The columns of time of one table."""

    def __init__(self, table: Table) -> None:
        self._table = table
        self._kinds = {label: kind for label in table.labels if (kind := _kind_of_clock(table, label))}
        self._sure = {label: kind for label, kind in self._kinds.items() if kind.unit != "?"}
        self._places = {label: place for place, label in enumerate(table.labels)}

    @cached_property
    def labels(self) -> list[str]:
        """Those that are a time by label and unit, by their cells, or by whose they are."""
        in_doubt = len(self._sure) < len(self._kinds)
        claimed = {self.of("", label) for label in self._table.labels} if in_doubt else set()
        return [label for label in self._kinds if label in self._sure or label in claimed]

    def column(self, label: str) -> Column:
        """Return a column of time with its unit, which is empty if nobody knows it."""
        table, unit = self._table, _name_and_unit(self._table, label)[1]
        unit = unit if fits(unit, "time") else "s" if table.is_clock(label) else ""
        return Column(label=table.dated(label), unit=unit)

    def counted(self, label: str) -> Column | None:
        """Return a column that counts time by its label, be it elapsed, a sensor's or a lone t; with a known unit."""
        name, unit = _name_and_unit(self._table, label)
        if label not in self._kinds and not (ELAPSED.fullmatch(name) and (not unit or fits(unit, "time"))):
            return None
        return Column(label=label, unit=unit if fits(unit, "time") else "")

    def of(self, quantity: str, label: str) -> str:
        """Return the column of time of a quantity's column, in a file that has several; empty where nothing tells.

        What the file states for each channel goes first. Else the time that names the quantity or its column
        (``t_u_s``, ``Flow Time``), then the only one of its group, then the one before it where all are alike.
        """
        table, times = self._table, self._kinds
        if table.clocks:
            return table.clocks.get(label, "")
        if len(times) < 2 or label in times:
            return ""
        names = {_name_and_unit(table, label)[0].casefold(), table.in_file(label).casefold(), quantity.casefold()}
        named = [
            each
            for each, kind in times.items()
            if kind.of.casefold() in names or quantity_named(kind.of) == quantity
        ]
        group = table.group(label)
        named = [each for each in named if table.group(each) == group] or named
        if named:
            return named[0] if len(named) == 1 else ""
        while len({table.group(each) for each in self._sure}) > 1:
            inside = [each for each in self._sure if table.group(each) == group]
            inside = [each for each in inside if not self._sure[each].of] or inside
            if len(inside) == 1:
                return inside[0]
            if not group:
                break
            group = group.rpartition("/")[0]
        return next((each for each in self._before_quantities if self._places[each] < self._places[label]), "")

    def are_alike(self, one: str, other: str) -> bool:
        """Tell whether the labels of two columns of time differ in nothing but the quantity or number they name."""
        kinds = [self._kinds.get(label) for label in (one, other)]
        return len({kind and (kind.word, kind.unit, bool(kind.of)) for kind in kinds}) == 1

    @cached_property
    def _before_quantities(self) -> list[str]:
        """The columns of time, the last first, of a table in which each such column stands before quantities."""
        at = [self._places[each] for each in self._sure]
        ends = [*at[1:], len(self._table.labels)]
        apart = len(at) > 1 and at[0] == 0 and all(end - index > 1 for index, end in zip(at, ends, strict=True))
        alike = all(self.are_alike(each, next(iter(self._sure))) for each in self._sure)
        if not (apart and alike) or sorted(self._table.labels) == list(self._table.labels):
            return []  # in the order of HDF5, which is the alphabet's
        return list(reversed(self._sure))


def _kind_of_clock(table: Table, label: str) -> _Kind | None:
    """Return what a column of time says of itself; None for any other."""
    name, unit = _name_and_unit(table, label)
    found, after = CLOCK_OF.fullmatch(name), OF_CLOCK.fullmatch(name)
    if unit and not measures(unit, "time"):
        return None
    if found:
        word, of = found.groups()
    elif after:
        of, word = after.groups()
    else:
        return None
    if not unit:
        try:
            unit = "" if table.is_clock(label) else "?" if len(word) == 1 else "-"
        except InputError:  # a date without a time of day
            return None
    return _Kind(word=word.lower(), unit=unit, of=of)


def _name_and_unit(table: Table, label: str) -> tuple[str, str]:
    """Return a column's label without group and unit, and the unit if it is known."""
    bare = table.in_file(label).removeprefix(f"{table.group(label)}/")[:LONGEST_NAME]
    in_label = split_label(bare)[1]
    bracket = re.compile(r"[\[(]").search(bare, 1)
    if bracket:
        return bare[: bracket.start()].rstrip(" _/"), table.units.get(label, "") or in_label
    if in_label != bare and names_a_quantity_or_current(in_label):
        return bare[: -len(in_label)].rstrip(" _/,").removesuffix(" in"), in_label
    return bare, table.units.get(label, "")
