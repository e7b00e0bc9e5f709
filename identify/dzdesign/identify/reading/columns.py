"""Which column of a recording is which quantity: by the engineer's word, by its label, or as it may be read.

The reader's own recognition goes first; a quantity whose label it does not know is proposed, for a person to declare,
where only one column is in a unit of it.
"""

import re
from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations, permutations
from pathlib import Path

import numpy as np

from dzdesign.core.documents import open_bytes
from dzdesign.core.errors import InputError, nearest
from dzdesign.core.units import measures
from dzdesign.identify.reading.binary_table import read_table
from dzdesign.identify.reading.clock import ClockColumns, is_milliseconds
from dzdesign.identify.reading.column_labels import (
    COLUMN_NAMES,
    EXAMPLE_UNITS,
    LONGEST_NAME,
    MOST_MEANT,
    PRESSURES,
    QUANTITY_OF_COLUMN,
    Column,
    fits,
    long_format,
    names_a_quantity_or_current,
    no_flow,
    same_unit,
    split_column,
    split_label,
)
from dzdesign.identify.reading.metering_edge import (
    PORTS,
    gauge_beside_absolute,
    metering_edge,
    which_edge,
)
from dzdesign.identify.reading.scaling import no_unit, range_example, scaling_of
from dzdesign.identify.reading.table import AND, Table, clean_label

#: Stands between the commands of two solenoids whose difference is the signed command.
LESS = re.compile(r"\s[-\u2212\u2013]\s")

#: A label that may be a pressure's, and has no unit: p1, P_in, Druck A, but neither pos nor PWM.
PRESSURE_LIKE = re.compile(
    r"(?:[dΔδ]|delta|diff)?[\s_.-]?p[\s_.-]?(?:[abpst]|in|out|\d{1,2})?|[^\[(]{0,20}(?:press|druck)[^\[(]{0,20}",
    re.IGNORECASE,
)
#: A label that may be of a command as a share: duty, Duty_cycle, PWM, Tastgrad, Tastverhältnis.
DUTY_LIKE = re.compile(r"\bduty|_duty|pwm|tast(?:grad|verh)", re.IGNORECASE)
#: Counts of a command that has no unit are fewer.
LARGEST_COMMAND = 1e6
#: A solenoid is driven above this share of its largest command; of two, both in so few rows, over those of either.
DRIVEN, BOTH = 0.1, 0.01
#: Columns among which two solenoids' are looked for.
MOST_COMMANDS = 6


def find_columns(table: Table, chosen: Mapping[str, str], sample_rate: float | None = None) -> dict[str, Column]:
    """Return quantity -> column of a table: those that were chosen, the others by their labels.

    Of the pressures only those that make the drop of the metering edge are there. With a declared `sample_rate`, Hz,
    there is no column of time, and one is refused.

    Raises
    ------
    InputError
        If a quantity has no column, or two, or a chosen label is not in the table; if pressures could make the drop of
        two edges, or a working port's makes none.
    """
    clocks = ClockColumns(table)
    columns = _labelled(table, chosen, clocks)
    if sample_rate is not None:
        time = columns.pop("time", None)
        if len(clocks.labels) > 1 or (time is not None and fits(time.unit, "time")):
            raise InputError(
                f"'{table.path}' has a column of time ('{time.label if time else clocks.labels[0]}'), and "
                f"--sample-rate declares {sample_rate:g} Hz too; leave one of them out"
            )
    edge = metering_edge(columns)
    if edge.ambiguous:
        labels = {quantity: column.label for quantity, column in columns.items()}
        raise InputError(f"'{table.path}'{table.header} has {which_edge(labels)}")
    have = next((port for port in ("pA", "pB") if port in columns), "")
    if have and not edge.quantities:
        lack = "pB" if have == "pA" else "pA"
        raise InputError(
            f"'{table.path}'{table.header} has a column of {have} but none of {lack}; expected both, or that of "
            "P or T, or dP"
        )
    columns = {name: column for name, column in columns.items() if name not in PRESSURES or name in edge.quantities}
    texts = [{name: getattr(column, text) for name, column in columns.items()} for text in ("label", "unit")]
    if why := gauge_beside_absolute(edge, *texts):
        raise InputError(f"'{table.path}'{table.header} has {why}")
    # Of several times the command tells which is its own.
    several = sample_rate is None and (table.clocks or len(clocks.labels) > 1)
    for quantity in ("u", "time", "Q") if several else ("time", "u", "Q") if sample_rate is None else ("u", "Q"):
        if quantity not in columns:
            raise _missing_column(quantity, table, chosen, columns, clocks, time_is_declared=sample_rate is not None)
    return columns if sample_rate is not None else _with_own_clocks(table, columns, clocks)


def _missing_column(
    quantity: str, table: Table, chosen: Mapping[str, str], columns: Collection[str], clocks: ClockColumns,
    *, time_is_declared: bool,
) -> InputError:  # fmt: skip
    """Return the error that names the columns found, and what to declare."""
    option, proposed = "", dict[str, Column]()
    with suppress(InputError):
        look = _proposed(table, chosen, clocks, time_is_declared=time_is_declared)
        option, proposed = look.option(time_is_declared=time_is_declared), look.proposed
    unused = [label for label in table.labels[:MOST_MEANT] if split_column(table, label)[0] not in columns]
    other = long_format(table.labels) or (no_flow(unused) if quantity == "Q" and "Q" not in proposed else "")
    rate = ', or --sample-rate "100 Hz"' if quantity == "time" and not clocks.labels else ""
    named = f"; expected names with units such as time_s,u_V,dP_MPa,Q_Lmin, or --columns{rate}"
    found = f"'{table.path}' has no column of {quantity} (columns found: {table.found_labels()})"
    return InputError(found + (other or option or named))


# by label, or by the engineer's word


def _labelled(table: Table, chosen: Mapping[str, str], clocks: ClockColumns) -> dict[str, Column]:
    """Return what `find_columns` does, without a word on quantities that have no column."""
    equal, unit = _label_and_unit(table, chosen.get("time", ""))
    if equal not in table.labels and any(table.in_file(label) == equal for label in table.labels):
        # Of equal columns of time the command's is meant, if it has one of them.
        others = {name: text for name, text in chosen.items() if name != "time"}
        columns = _labelled(table, others, clocks)
        if "time" in columns and table.in_file(columns["time"].label) == equal:
            return columns | {"time": replace(columns["time"], unit=unit or columns["time"].unit)}
    columns = {quantity: _column_with_its_unit(table, quantity, label) for quantity, label in chosen.items()}
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


def _column_with_its_unit(table: Table, quantity: str, text: str) -> Column:
    """Return the column that was chosen: the whole text is its label, or else what stands before the last colon."""
    if quantity == "time" and (pair := table.pair(text)):
        return Column(label=AND.join(pair), unit="s")
    label, unit = _label_and_unit(table, text)
    if quantity == "u" and label not in table.labels and (two := _named_solenoids(table, text)):
        column, less = (_column_with_its_unit(table, quantity, each) for each in two)
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
        raise no_unit(table.path, quantity, label)
    return Column(label=label, unit=unit, stated=stated)


def _label_and_unit(table: Table, text: str) -> tuple[str, str]:
    """Return a column's label and the unit behind it; of a single column ``LABEL#1`` is that too."""
    label, colon, unit = (text, "", "") if text in table.labels else text.rpartition(":")
    label, unit = (clean_label(label), unit.strip()) if colon else (text, "")
    only = label.removesuffix("#1")
    return (only if label not in table.labels and only in table.labels else label), unit


def _named_solenoids(table: Table, text: str) -> tuple[str, str] | None:
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


def _with_own_clocks(table: Table, columns: dict[str, Column], clocks: ClockColumns) -> dict[str, Column]:
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


# for a person to declare


@dataclass(frozen=True, slots=True, kw_only=True)
class ProposedColumns:
    """How the columns of a recording may be read."""

    #: All of the file's.
    labels: tuple[str, ...]
    #: Quantity -> column that its label, or the engineer, says to be it.
    known: dict[str, Column]
    #: Quantity -> column that is the only one it can be, by its unit.
    proposed: dict[str, Column]
    #: Quantity -> why it could not be told.
    unclear: dict[str, str]
    #: Columns that may make the pressure drop, for a person to say which is which: label -> unit, "" if it has none.
    pressures: dict[str, str]
    #: Column of an unclear command with the range of its numbers, ``duty:0..0.9 = 0..100 %``, for a person to correct;
    #: or of two columns that may drive a solenoid each the difference, ``uA_V - uB_V``.
    command_range: str = ""
    #: Labels of the columns that are a time.
    times: tuple[str, ...] = ()

    def option(self, *, time_is_declared: bool) -> str:
        """Return what to declare, as the rest of a sentence; nothing where the columns tell nothing.

        LABEL stands for a label that is not known.
        """
        known = {name: column for name, column in (self.known | self.proposed).items() if name not in self.unclear}
        labels = {name: known[name].label for name in ("time", "u", *PORTS, "dP", "Q") if name in known}
        if not any(name in labels for name in PRESSURES):
            labels |= _two_ports(self.pressures)
        if not labels:
            return ""
        if LESS.search(self.command_range):
            labels |= {"u": self.command_range}
        unknown = " (LABEL: the one that you know)" if {"u", "Q"} - labels.keys() else ""
        labels |= {name: f"LABEL:{EXAMPLE_UNITS[name]}" for name in ("u", "Q") if name not in labels}
        timeless = not time_is_declared and "time" not in self.known | self.proposed
        clock = ', and --sample-rate "100 Hz" (the rate of your logger)' if timeless else ""
        if timeless and self.times:
            clock = f", and as time that of the command, for example time={self.times[0]}"
        columns = ", ".join(f"{name}={label}" for name, label in labels.items())
        return f'; by their units, give --columns "{columns}"{unknown}{clock}'

    @property
    def bare_pressures(self) -> tuple[str, ...]:
        """Labels that look like a pressure and have no unit, where no pressure drop is known."""
        ports = {column.label for column in self.known.values()}
        bare = (label for label, unit in self.pressures.items() if not unit and label not in ports)
        return () if self.has_dp or "dP" in self.proposed else tuple(bare)

    @property
    def has_dp(self) -> bool:
        """Whether columns that are known make the pressure drop."""
        return bool(metering_edge(self.known).quantities)


def _two_ports(labels: Collection[str]) -> dict[str, str]:
    """Return the working ports where the labels are alike but for an A and a B, such as ``Druck A [bar]``."""
    pairs = permutations(labels) if len(labels) == 2 else ()
    alike = (pair for pair in pairs if re.sub(r"(?<![^\W_])A(?![^\W_])", "B", pair[0]) == pair[1])
    return next(({"pA": one, "pB": other} for one, other in alike), {})


def propose_columns(
    path: Path, chosen: Mapping[str, str], skip_rows: int | None = None, *, time_is_declared: bool = False
) -> ProposedColumns:
    """Tell which column of a recording is which quantity.

    `chosen` is what the engineer has declared, as `parse_columns` gives it.

    Raises
    ------
    InputError
        If the file can't be read, or its labels contradict one another.
    """
    with open_bytes(path, "ramp file") as file:
        table = read_table(file, path, skip_rows)
        return _proposed(table, chosen, ClockColumns(table), time_is_declared=time_is_declared)


def _proposed(
    table: Table, chosen: Mapping[str, str], clocks: ClockColumns, *, time_is_declared: bool
) -> ProposedColumns:
    known, times = _labelled(table, chosen, clocks), clocks.labels
    edge = metering_edge(known)
    # A pressure beside the edge's, or a supply's without a unit, is none that the reader takes.
    bare = {name for name in ("pP", "pT") if name in known and not known[name].unit and not edge.ambiguous}
    unused = bare | (set(PRESSURES) - set(edge.quantities) if edge.quantities else set())
    known = {name: column for name, column in known.items() if name not in unused}
    unclear = {name: why for name, column in known.items() if (why := _why_unreadable(table.path, name, column))}
    taken = {column.label for column in known.values()}
    proposed: dict[str, Column] = {}
    for quantity in ("u", "Q", "dP") if time_is_declared else ("time", "u", "Q", "dP"):
        if quantity in known or (quantity == "dP" and edge.quantities):
            continue
        candidates = [label for label in _candidates(table, quantity) if label not in taken]
        names = [name for name, its in COLUMN_NAMES.items() if its == quantity and len(name) > 1]
        named = [label for label in candidates if nearest(re.split(r"[_\[( ]", label)[0], names)]
        port = next((known[name].label for name in PORTS if name in known and quantity == "dP"), None)
        if quantity == "dP" and edge.ambiguous:
            unclear["dP"] = which_edge({name: column.label for name, column in known.items()})
        elif port is not None:
            unclear["dP"] = f"'{port}' is the pressure of one port; which column is that of the other, or the drop?"
        elif len(candidates) == 1 or (len(named) == 1 and quantity != "dP"):
            label = candidates[0] if len(candidates) == 1 else named[0]
            dated = table.dated(label) if quantity == "time" else label
            proposed[quantity] = Column(label=dated, unit=_unit_of(table, label))
            taken.add(label)
        elif why := _why_none(table, quantity, candidates):
            unclear[quantity] = why
    u = (known | proposed).get("u")
    if "time" in unclear and u is not None and (clock := clocks.of("u", u.label)):
        proposed["time"] = clocks.column(clock)
        del unclear["time"]
    elif "time" in unclear and u is None and len(times) > 1:
        unclear["time"] += "; that of the command is taken as soon as u is known"
    command_range = _two_solenoids(table, known, taken) if "u" in unclear else ""
    if "u" in unclear and not command_range:  # one without a unit, or the only one that is named like a duty cycle
        labels = [known["u"].label] if "u" in known and not known["u"].unit else []
        labels = labels or [label for label in table.labels if label not in taken and DUTY_LIKE.search(label)]
        command_range = _range_of(table, labels[0]) if len(labels) == 1 and labels[0] else ""
    drop = {column.label for name, column in proposed.items() if name == "dP"}
    pressures = {} if edge.quantities else _pressures(table, known, taken - drop)
    if command_range:
        why = "if each drives a solenoid, their difference is the signed command:"
        why = why if LESS.search(command_range) else "or say what its numbers mean, for example"
        unclear["u"] += f"; {why} --columns \"u={command_range}\""
    return ProposedColumns(
        labels=table.labels, known=known, proposed=proposed, unclear=unclear, pressures=pressures,
        command_range=command_range, times=tuple(times),
    )  # fmt: skip


def _pressures(table: Table, known: Mapping[str, Column], taken: set[str]) -> dict[str, str]:
    """Return the columns that may be a pressure: of ports, in a unit of pressure, or named like one."""
    found = {column.label: column.unit for name, column in known.items() if name in PORTS}
    for label in table.labels:
        if label in taken:
            continue
        if fits(_unit_of(table, label), "dP"):
            found.setdefault(label, _unit_of(table, label))
        elif not table.units.get(label) and PRESSURE_LIKE.fullmatch(label):
            found.setdefault(label, "")
    return found


def _two_solenoids(table: Table, known: Mapping[str, Column], taken: set[str]) -> str:
    """Return the difference of the only two columns that may be commands of which never both are driven; or nothing."""
    taken = taken - {each.label for name, each in known.items() if name == "u"}
    labels = [label for label in table.labels if label not in taken and not LESS.search(label)]
    named = [each for each in labels if DUTY_LIKE.search(each) or split_label(each)[0] == "u"]
    driven = {}
    for label in [each for each in labels if fits(_unit_of(table, each), "u") or each in named][:MOST_COMMANDS]:
        with suppress(InputError):
            numbers = table.numbers(label)
            least = DRIVEN * np.fmax.reduce(numbers, initial=0.0)
            on = numbers > least
            if np.fmin.reduce(numbers, initial=0.0) >= -least and on.any():  # noise at rest is on both sides of zero
                driven[label] = on
    pairs = [
        (one, other)
        for one, other in combinations(driven, 2)
        if driven[one].size == driven[other].size
        and np.count_nonzero(driven[one] & driven[other]) <= BOTH * min(map(np.count_nonzero, driven.values()))
        and same_unit(_unit_of(table, one), _unit_of(table, other), "u") == fits(_unit_of(table, one), "u")
    ]
    if len(pairs) != 1:
        return ""
    one, other = pairs[0]
    if fits(_unit_of(table, one), "u"):
        return f"{one} - {other}"
    ranges = [_range_of(table, label).removeprefix(f"{label}:") for label in pairs[0]]
    return f"{one} - {other}:{max(ranges, key=lambda text: float(text.partition(' ')[0].rpartition('..')[2]))}"


def _range_of(table: Table, label: str) -> str:
    """Return the range form of a column without a unit; nothing where its numbers are no command's."""
    try:
        numbers = table.numbers(label)
    except InputError:
        return ""
    lowest, highest = np.fmin.reduce(numbers, initial=0.0), np.fmax.reduce(numbers, initial=0.0)
    if not 0 < highest < LARGEST_COMMAND:
        return ""
    top = f"{highest:.3g}" if highest < 1000 else f"{highest:.0f}"
    both = bool(lowest < -0.5 * highest)
    return f"{label}:{f'-{top}' if both else '0'}..{top} = {'-100' if both else '0'}..100 %"


def _why_unreadable(path: Path, quantity: str, column: Column) -> str:
    """Return why the reader would refuse a column, or nothing."""
    try:
        scaling_of(path, quantity, column, u_max=1.0)
    except InputError as error:
        return str(error)
    return ""


def _candidates(table: Table, quantity: str) -> list[str]:
    """Return the columns in a unit of a quantity; for the time also those of dates or times of day."""
    candidates = [label for label in table.labels if fits(_unit_of(table, label), quantity)]
    if quantity == "time":
        clocks = [label for label in table.labels if _is_clock(table, label)]
        # Milliseconds beside a clock are its fractions.
        candidates = [label for label in candidates if not (clocks and is_milliseconds(label))] or clocks
    return candidates


def _is_clock(table: Table, label: str) -> bool:
    try:
        return table.is_clock(label)
    except InputError:  # a date without a time of day
        return False


def _unit_of(table: Table, label: str) -> str:
    return table.units.get(label) or split_column(table, label)[1]


def _why_none(table: Table, quantity: str, candidates: list[str]) -> str:
    """Return why no column is proposed, with what to do; nothing for a pressure drop that nothing hints at."""
    both = " and ".join(map(repr, candidates))
    if candidates and quantity != "dP":
        return f"{both} could each be it, by their units"
    if candidates:
        option = f'--columns "pA={candidates[0]}, pB={candidates[-1]}"'
        ports = f" If one is ahead of the metering edge and one behind it: {option}"
        return f"{both}: a pressure, but is it the drop, pA or pB?{ports if len(candidates) == 2 else ''}"
    currents = [label for label in table.labels if measures(_unit_of(table, label), "current")]
    if quantity == "dP":
        currents = [label for label in currents if PRESSURE_LIKE.fullmatch(re.split(r"[\[(/]", label)[0].strip())]
        declared = currents and range_example("dP", currents[0], _unit_of(table, currents[0]))
        return f"'{currents[0]}' is a current; say what it means, {declared}" if currents else ""
    why = f"no column has a unit of {QUANTITY_OF_COLUMN[quantity]}"
    if currents and quantity != "time":
        declared = range_example(quantity, currents[0], _unit_of(table, currents[0]))
        why += f"; if {' or '.join(map(repr, currents))} is it, say what the current means, {declared}"
    why += long_format(table.labels) or (no_flow(table.labels) if quantity == "Q" else "")
    if quantity == "time":
        why += '; give its unit, for example --columns "time=LABEL:s", or if there is none, --sample-rate "100 Hz"'
    return why
