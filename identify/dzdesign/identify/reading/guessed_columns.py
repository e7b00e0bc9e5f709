"""Which column of a recording may be which quantity, for a person who has yet to declare it: by labels, or by units."""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dzdesign.core.artefact_files import open_bytes
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.units import measures, si_factor
from dzdesign.identify.reading.clock import is_milliseconds
from dzdesign.identify.reading.column_labels import (
    COLUMN_NAMES,
    EXAMPLE_UNITS,
    PER_CENT,
    QUANTITY_OF_COLUMN,
    Column,
    find_columns,
    fits,
    names_a_quantity,
    split_label,
)
from dzdesign.identify.reading.ramp_files import read_table
from dzdesign.identify.reading.scaling import range_example
from dzdesign.identify.reading.table import Table

#: A label that may be a pressure's, and has no unit: p1, P_in, Druck A, but neither pos nor PWM.
PRESSURE_LIKE = re.compile(
    r"(?:[dΔδ]|delta|diff)?[\s_.-]?p[\s_.-]?(?:[abpst]|in|out|\d{1,2})?|[^\[(]{0,20}(?:press|druck)[^\[(]{0,20}",
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class GuessedColumns:
    """How the columns of a recording may be read.

    Attributes
    ----------
    labels : tuple of str
        All of the file's.
    understood : dict
        Quantity -> `Column` whose label says what it is.
    chosen : dict
        Quantity -> label (with a colon and its unit, where it lacks one) that is the only one it can be.
    unclear : dict
        Quantity -> why it could not be told.
    bare_pressures : dict
        Label that looks like a pressure and has no unit -> the quantity that it says ("" if none), where no pressure
        drop was understood.
    pressures : tuple of str
        Labels in a unit of pressure that say no quantity, where no pressure drop was understood.
    """

    labels: tuple[str, ...]
    understood: dict[str, Column]
    chosen: dict[str, str]
    unclear: dict[str, str]
    bare_pressures: dict[str, str]
    pressures: tuple[str, ...] = ()


def guess_columns(path: Path, skip_rows: int | None = None) -> GuessedColumns:
    """Tell which column of a recording is which quantity, by the labels or else by the units.

    Parameters
    ----------
    path, skip_rows
        As for `read_ramp_file`.

    Raises
    ------
    InputError
        If the file can't be read, or its labels contradict one another.
    """
    with open_bytes(Path(path), "ramp file") as file:
        table = read_table(file, Path(path), skip_rows)
        try:
            understood = find_columns(table, {})
        except InputError:
            return _guess(table)
    bare = {quantity: column for quantity, column in understood.items() if not column.unit}
    foreign = {
        quantity: column
        for quantity, column in understood.items()
        if column.unit and not fits(column.unit, quantity) and quantity not in bare
    }
    chosen, unclear = _foreign_pressures(table, understood)
    return GuessedColumns(
        labels=table.labels,
        understood={name: column for name, column in understood.items() if name not in bare.keys() | foreign.keys()},
        chosen=chosen,
        unclear=unclear
        | {
            quantity: f"'{column.label}' has no unit; give it after a colon, such as {EXAMPLE_UNITS[quantity]}"
            for quantity, column in bare.items()
        }
        | {quantity: _no_unit_of_it(quantity, column) for quantity, column in foreign.items()},
        bare_pressures=_bare_pressures(table, understood.keys() - bare.keys()),
        pressures=_foreign(table, understood),
    )


def _no_unit_of_it(quantity: str, column: Column) -> str:
    """Return what is unclear of a column whose label says a quantity, and a unit that is none of it."""
    if quantity != "time" and any(measures(column.unit, kind) for kind in ("current", "voltage")):
        kind = QUANTITY_OF_COLUMN[quantity]
        example = range_example(quantity, column.label, column.unit)
        return f"'{column.label}' is in {column.unit}, which is no unit of {kind}; say what the signal means, {example}"
    try:
        si_factor(column.unit, QUANTITY_OF_COLUMN[quantity])
    except InputError as error:
        return f"'{column.label}': {error}"
    return f"'{column.label}' is in {column.unit}"


def _guess(table: Table) -> GuessedColumns:
    """Take labels for what they say, and give each of the other quantities the one column that is left in its unit."""
    understood: dict[str, Column] = {}
    for label in table.labels:
        quantity, unit = split_label(label)
        unit = unit or table.units.get(label, "")
        if quantity and quantity not in understood and fits(unit, quantity):
            understood[quantity] = Column(label=label, unit=unit)
    taken = {column.label for column in understood.values()}
    chosen, unclear = {}, {}
    for quantity in ("time", "u", "Q"):
        if quantity in understood:
            continue
        left = [label for label in table.labels if label not in taken and _fits(table, label, quantity)]
        if quantity == "time":
            clocks = [label for label in table.labels if label not in taken and _is_clock(table, label)]
            # Milliseconds beside a clock are its fractions.
            left = [label for label in left if not (clocks and is_milliseconds(label))] or clocks
        named = [label for label in left if nearest(re.split(r"[_\[( ]", label)[0], _names_of(quantity))]
        if len(left) == 1 or len(named) == 1:
            chosen[quantity] = (left if len(left) == 1 else named)[0]
            taken.add(chosen[quantity])
        elif left:
            unclear[quantity] = f"{' and '.join(map(repr, left))} could each be it, by their units"
        else:
            kind = QUANTITY_OF_COLUMN[quantity]
            unclear[quantity] = f"no column has a unit of {kind}{_or_a_signal(table, quantity)}{_or_one_a_row(table)}"
            if quantity == "time":
                unclear[quantity] += _or_without_a_unit(table)
    its_pressure, its_doubt = _foreign_pressures(table, understood)
    return GuessedColumns(
        labels=table.labels, understood=understood, chosen=chosen | its_pressure, unclear=unclear | its_doubt,
        bare_pressures=_bare_pressures(table, understood.keys()), pressures=_foreign(table, understood),
    )  # fmt: skip


def _foreign(table: Table, understood: Mapping[str, Column]) -> tuple[str, ...]:
    """Return the labels in a unit of pressure that were not understood."""
    labels = [column.label for column in understood.values()]
    return tuple(label for label in table.labels if label not in labels and _fits(table, label, "dP"))


def _foreign_pressures(table: Table, understood: Mapping[str, Column]) -> tuple[dict[str, str], dict[str, str]]:
    """Return what is to be taken as the pressure drop, and what is unclear of it, where no label says it.

    A column in a unit of pressure is never passed over: the one in the file's name may be another's.
    """
    if "dP" in understood or {"pA", "pB"} <= understood.keys():
        return {}, {}
    port = next((understood[name].label for name in ("pA", "pB") if name in understood), None)
    left = list(_foreign(table, understood))
    if port is not None:
        return {}, {"dP": f"'{port}' is the pressure of one port; which column is that of the other, or the drop?"}
    if len(left) == 1:
        return {"dP": left[0]}, {}
    if left:
        ports = f' If one stands on either side: --columns "pA={left[0]}, pB={left[1]}"' if len(left) == 2 else ""
        return {}, {"dP": f"{' and '.join(map(repr, left))}: a pressure, but is it the drop, pA or pB?{ports}"}
    signals = [label for label in _signals(table) if PRESSURE_LIKE.fullmatch(re.split(r"[\[(/]", label)[0].strip())]
    if signals:
        example = range_example("dP", signals[0], _unit_of(table, signals[0]))
        return {}, {"dP": f"'{signals[0]}' is a current; say what it means, {example}"}
    return {}, {}


def _signals(table: Table) -> list[str]:
    """Return the columns of currents."""
    return [label for label in table.labels if measures(_unit_of(table, label), "current")]


def _or_a_signal(table: Table, quantity: str) -> str:
    """Return how a current is declared as a quantity, where there is one."""
    signals = _signals(table)
    if not signals or quantity == "time":
        return ""
    example = range_example(quantity, signals[0], _unit_of(table, signals[0]))
    return f"; if {' or '.join(map(repr, signals))} is it, say what the current means, {example}"


def _or_without_a_unit(table: Table) -> str:
    """Return how the first column is declared as time, where it rises and has no unit, as LabVIEW's X_Value.

    One that counts the rows is no time: a unit would make a wrong one of it.
    """
    first = table.labels[0]
    if not first or table.units.get(first) or names_a_quantity(split_label(first)[1]):
        return ""
    try:
        steps = np.diff(table.numbers(first))
    except InputError:
        return ""
    rises = steps.size > 0 and bool(np.all(steps >= 0)) and float(steps.max()) > 0
    if rises and bool(np.all(steps == 1)):
        return f"; '{first}' counts the rows: export the time beside it"
    return f'; if \'{first}\' is it, say its unit, for example --columns "time={first}:s"' if rises else ""


def _or_one_a_row(table: Table) -> str:
    """Return what to do about a table with a row a variable, as an archive of WinCC is."""
    words = " ".join(table.labels).lower()
    if not ("varname" in words and "varvalue" in words):
        return ""
    return "; the table has a row for each variable (VarName, VarValue): export a column for each"


def _is_clock(table: Table, label: str) -> bool:
    try:
        return table.is_clock(label)
    except InputError:  # a date without a time of day
        return False


def _bare_pressures(table: Table, known: Collection[str]) -> dict[str, str]:
    """Return the labels that look like a pressure and have no unit, unless the pressure drop is known without them."""
    if "dP" in known or {"pA", "pB"} <= set(known):
        return {}
    found = {}
    for label in table.labels:
        quantity, unit = split_label(label)
        says = quantity if quantity in ("dP", "pA", "pB") and not unit else ""
        if (says or PRESSURE_LIKE.fullmatch(label)) and not table.units.get(label):
            found[label] = says
    return found


def _unit_of(table: Table, label: str) -> str:
    return table.units.get(label) or split_label(label)[1]


def _fits(table: Table, label: str, quantity: str) -> bool:
    return fits(_unit_of(table, label), quantity)


def _names_of(quantity: str) -> list[str]:
    return [name for name, its in COLUMN_NAMES.items() if its == quantity and len(name) > 1]


def is_per_cent(column: Column | None) -> bool:
    """Tell whether a command was recorded as a share of full command."""
    return column is not None and column.unit.lower() in PER_CENT
