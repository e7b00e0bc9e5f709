"""Which column of a table is which quantity, by its label or the engineer's word; which has a time of its own."""

import re
from collections.abc import Mapping
from dataclasses import replace

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.clock import ClockColumns
from dzdesign.identify.reading.column_labels import (
    EXAMPLE_UNITS,
    LONGEST_NAME,
    PRESSURES,
    Column,
    fits,
    names_a_quantity_or_current,
    no_flow,
    same_unit,
    split_column,
)
from dzdesign.identify.reading.metering_edge import metering_edge
from dzdesign.identify.reading.table import AND, Table, clean_label

#: Stands between the commands of two solenoids whose difference is the signed command.
LESS = re.compile(r"\s[-\u2212\u2013]\s")


def labelled_columns(table: Table, chosen: Mapping[str, str], clocks: ClockColumns) -> dict[str, Column]:
    """Return what `find_columns` does, without a word on quantities that have no column."""
    equal, unit = _label_and_unit(table, chosen.get("time", ""))
    if equal not in table.labels and any(table.in_file(label) == equal for label in table.labels):
        # Of equal columns of time the command's is meant, if it has one of them.
        others = {name: text for name, text in chosen.items() if name != "time"}
        columns = labelled_columns(table, others, clocks)
        if "time" in columns and table.in_file(columns["time"].label) == equal:
            return columns | {"time": replace(columns["time"], unit=unit or columns["time"].unit)}
    columns = {quantity: _chosen_column(table, quantity, label) for quantity, label in chosen.items()}
    taken = {each.label for column in columns.values() for each in column.every}
    edge = metering_edge(chosen)
    pressures = set(PRESSURES) if edge.ambiguous or edge.quantities else set()
    also_time = ""
    for label in table.labels:
        quantity, in_label = split_column(table, label)
        if quantity is None or label in taken or quantity in chosen.keys() | pressures:
            continue
        is_unit = in_label and (fits(in_label, quantity) or label not in table.units)
        unit = in_label if is_unit else table.units.get(label, "")
        unit = "s" if quantity == "time" and not fits(unit, "time") and table.is_clock(label) else unit
        if quantity in columns and not fits(unit, quantity):
            continue  # an oil temperature T_degC beside the time t_s, a set point Q_set beside Q_Lmin
        if quantity in ("pP", "pT", "time") and unit and not fits(unit, quantity):
            continue  # a thermometer Pt_degC or T_degC
        if quantity == "time" and "time" in columns and fits(columns["time"].unit, "time"):
            also_time = label
            continue
        if quantity in columns and fits(columns[quantity].unit, quantity):
            raise InputError(
                f"'{table.path}'{table.header} has two columns of {quantity}: '{columns[quantity].label}' and "
                f"'{label}'; choose one, for example --columns \"{quantity}={label}\""
            )
        _refuse_two_units(table, quantity, label, in_label)
        columns[quantity] = Column(label=table.dated(label) if quantity == "time" else label, unit=unit)
    if "time" not in chosen and "u" in columns and (clock := clocks.of("u", columns["u"].label)):
        columns["time"] = clocks.column(clock)
    elif also_time and "u" in columns:
        raise InputError(
            f"'{table.path}'{table.header} has columns of time '{columns['time'].label}' and '{also_time}', and which "
            f"is that of '{columns['u'].label}' can't be told; name them by their quantity, such as t_u_s and t_Q_s, "
            "or choose one by --columns"
        )
    elif also_time:
        del columns["time"]  # the command will tell which it is
    return columns


def _chosen_column(table: Table, quantity: str, text: str) -> Column:
    """Return the column that was chosen: the whole text is its label, or else what stands before the last colon."""
    if quantity == "time" and (pair := table.pair(text)):
        return Column(label=AND.join(pair), unit="s")
    label, unit = _label_and_unit(table, text)
    if quantity == "u" and label not in table.labels and (two := _two_solenoids(table, text)):
        column, less = (_chosen_column(table, quantity, each) for each in two)
        if " ".join(column.unit.split()) != " ".join(less.unit.split()) and not same_unit(column.unit, less.unit, "u"):
            raise InputError(
                f"'{table.path}': '{column.label}' is in '{column.unit}', '{less.label}' in '{less.unit}'; give both "
                f'one unit, for example --columns "u={column.label} - {less.label}:{column.unit}"'
            )
        return replace(column, less=less)
    if label not in table.labels:
        raise table.no_column(label, f"--columns names for {quantity}", quantity)
    _, in_label = split_column(table, label)
    bracketed = bool(re.search(r"[\[(]", label))
    stated = (in_label if bracketed or names_a_quantity_or_current(in_label) else "") or table.units.get(label, "")
    if not unit:
        _refuse_two_units(table, quantity, label, in_label)
    unit = unit or (in_label if bracketed or fits(in_label, quantity) else "") or table.units.get(label, "")
    if quantity == "time" and not fits(unit, "time") and table.is_clock(label):
        unit = "s"
    if not unit:
        if quantity == "Q" and (other := no_flow([label])):
            raise InputError(f"'{table.path}'{other.replace(';', ':', 1)}")
        raise InputError(
            f"'{table.path}' column '{label}' has no unit; write for example "
            f'--columns "{quantity}={label}:{EXAMPLE_UNITS[quantity]}"'
            + (f', or what its numbers mean, --columns "u={label}:0..1 = 0..100 %"' if quantity == "u" else "")
        )
    return Column(label=label, unit=unit, stated=stated)


def _label_and_unit(table: Table, text: str) -> tuple[str, str]:
    """Return a column's label and the unit behind it; of a single column ``LABEL#1`` is that too."""
    label, colon, unit = (text, "", "") if text in table.labels else text.rpartition(":")
    label, unit = (clean_label(label), unit.strip()) if colon else (text, "")
    only = label.removesuffix("#1")
    return (only if label not in table.labels and only in table.labels else label), unit


def _two_solenoids(table: Table, text: str) -> tuple[str, str] | None:
    """Return the two columns, each with its unit, whose difference a text such as ``uA_V - uB_V`` names; else None.

    A unit behind the second one only is that of both.
    """
    for less in LESS.finditer(text):
        one, other = text[: less.start()].strip(), text[less.end() :].strip()
        (label, unit), (its_label, its_unit) = (_label_and_unit(table, each) for each in (one, other))
        if label in table.labels and its_label in table.labels and label != its_label:
            return (f"{label}:{its_unit}" if its_unit and not unit else one), other
    return None


def _refuse_two_units(table: Table, quantity: str, label: str, in_label: str) -> None:
    """Refuse a label whose unit is another than the one that the file states beside it."""
    beside = table.units.get(label, "")
    known = fits(in_label, quantity) and names_a_quantity_or_current(beside)
    if beside and known and not same_unit(in_label, beside, quantity):
        raise InputError(
            f"'{table.path}' column '{label}' says '{in_label}' in its label, and '{beside[:LONGEST_NAME]}' is stated "
            "as its unit beside it; correct one, or say which it is, for example --columns "
            f'"{quantity}={label}:{in_label}"'
        )


def with_own_clocks(table: Table, columns: dict[str, Column], clocks: ClockColumns) -> dict[str, Column]:
    """Return columns with those of time of their own; refuse another one for the command than its own."""
    time = columns["time"]
    for quantity, column in columns.items():
        own = clocks.of(quantity, column.label) if quantity != "time" else ""
        if column.less and clocks.of(quantity, column.less.label) != own:
            raise InputError(
                f"'{table.path}': '{column.label}' and '{column.less.label}' have clocks of their own, and no "
                "difference of the two is taken; export the commands with one"
            )
        if not own or time.label in (own, table.dated(own)):
            continue
        if quantity == "u":
            raise InputError(
                f"'{table.path}': '{own}' is the column of time of '{column.label}', but --columns names "
                f"'{time.label}'; name '{own}', or none"
            )
        clock = clocks.column(own)
        columns[quantity] = replace(column, clock=clock if clock.unit else replace(clock, unit=time.unit))
    return columns


def without_time(
    table: Table, columns: dict[str, Column], clocks: ClockColumns, sample_rate: float
) -> dict[str, Column]:
    """Return columns without one of time whose unit nobody knows; refuse a clock."""
    time, times = columns.get("time"), clocks.labels
    if len(times) > 1:
        raise InputError(
            f"'{table.path}' has columns of time ('{times[0]}', '{times[1]}'), and --sample-rate declares "
            f"{sample_rate:g} Hz too; leave it out"
        )
    if time is not None and fits(time.unit, "time"):
        raise InputError(
            f"'{table.path}' has a column of time ('{time.label}'), and --sample-rate declares {sample_rate:g} Hz too; "
            "leave one of them out"
        )
    return {quantity: column for quantity, column in columns.items() if quantity != "time"}
