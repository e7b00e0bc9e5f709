"""Labels of columns: which column is which quantity of a ramp test, by its label or by the engineer's word."""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from math import isclose

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.units import RELATIVE, measures, si_factor
from dzdesign.identify.reading.metering_edge import PORTS, gauge_beside_absolute, metering_edge, which_edge
from dzdesign.identify.reading.table import AND, Table, clean_label

#: Spelling in a header (lower case, letters only) -> quantity of a ramp test.
COLUMN_NAMES = {
    "time": "time", "t": "time",
    "u": "u", "command": "u",
    "dp": "dP", "δp": "dP", "deltap": "dP",
    "pp": "pP", "pa": "pA", "pb": "pB", "pt": "pT",
    "q": "Q", "flow": "Q",
}  # fmt: skip
PRESSURES: tuple[str, ...] = ("dP", *PORTS)
QUANTITY_OF_COLUMN = {"time": "time", "u": "voltage", **dict.fromkeys(PRESSURES, "pressure"), "Q": "flow"}
#: How a column is best named, for the messages.
EXAMPLE_UNITS = {"time": "s", "u": "V", **dict.fromkeys(PRESSURES, "MPa"), "Q": "L/min"}
EXAMPLE_LABELS = {name: f"{name}_{unit.replace('/', '')}" for name, unit in EXAMPLE_UNITS.items()}
#: Labels among which the one that was meant is looked for.
MOST_MEANT = 200
#: Units of a command that is a share of u_max.
PER_CENT = ("%", "pct", "percent")
QUANTITIES = ("time", "voltage", "pressure", "flow")
#: The last letters of the labels of two sides, exchanged.
TWINS = str.maketrans("ABab", "BAba")
#: Stands between the commands of two solenoids whose difference is the signed command.
LESS = re.compile(r"\s[-\u2212\u2013]\s")
#: Labels of a table with a row for each variable: what names it, and its value.
VARIABLES = ("path", "name", "variable", "varname", "tag", "tagname", "signal", "channel", "sensor", "metric", "field")
VALUES = ("value", "varvalue", "tagvalue", "wert")
#: Units of a volume, and what a column of a meter's pulses is called.
VOLUMES = ("l", "ml", "cl", "m3", "m³", "cm3", "cm³", "dm3", "dm³", "ccm", "cc", "gal", "liter", "litre", "in3", "in³")
SPEEDS = re.compile(r"(?:^|[\W_\d])(?:[mcµ]?m|inch?)(?:/|_per_)s|speed|velocity|geschwindigkeit", re.IGNORECASE)
COUNTS = re.compile(r"puls|impuls|\bcounts?\b|_counts?$|\bticks?\b", re.IGNORECASE)
#: Characters of a label in which a quantity is looked for.
LONGEST_NAME = 80
#: A column of time, and the quantity that it may name before or behind: Time, t_u, X_Value, time of Q, Flow Time.
CLOCK_OF = re.compile(
    r"((?i:time[ _]?stamp|time|zeit|x_?value)|[tT])(?:[\s_.:-]+|(?=[A-Z0-9]|d[pP]|$))(?:(?:of|for)\s)?(.*)"
)
ELAPSED = re.compile(r"elapsed|relative|clock|uhr", re.IGNORECASE)
OF_CLOCK = re.compile(r"(.*?)[\s_.:-]+(time[ _]?stamp|time|zeit|t)", re.IGNORECASE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column that was found: its label in the file, and its unit ("" if none is known).

    Attributes
    ----------
    label, unit : str
        As the file or ``--columns`` says.
    stated : str
        The unit that the file states, where ``--columns`` says another or a range.
    less : Column or None
        What is subtracted from it: the command of the other solenoid.
    clock : Column or None
        Its own column of time, where that is another than the command's.
    """

    label: str
    unit: str
    stated: str = ""
    less: "Column | None" = None
    clock: "Column | None" = None

    @property
    def every(self) -> "tuple[Column, ...]":
        """This column, and the one that is subtracted from it."""
        return (self,) if self.less is None else (self, self.less)


class MissingColumnError(InputError):
    """A table has no column of a quantity that a ramp test needs; `what` says so, without what to do."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(what + remedy)
        self.what = what


def parse_columns(text: str | Mapping[str, str]) -> dict[str, str]:
    """Read what ``--columns`` or the table ``columns`` of the options says: quantity -> label in the file.

    Parameters
    ----------
    text : str or mapping
        ``"u=AO0:V, Q=Flow (L/min)"``, or the same as a mapping. A quantity is one of time, u, dP, pP, pA, pB, pT, Q; a
        label stands as in the file, and a unit that it lacks follows after a colon. A comma parts two entries only
        before another ``quantity=``, so a label may hold one. Of equal labels ``Q_Lmin#2`` is the second; of two
        solenoids ``u=uA_V - uB_V`` is the signed command.

    Raises
    ------
    InputError
        If a quantity is unknown or named twice, or a label is missing.

    Examples
    --------
    >>> parse_columns("u=AO0:V, Q=Flow (L/min)")
    {'u': 'AO0:V', 'Q': 'Flow (L/min)'}
    """
    if isinstance(text, str):
        entries = [entry.partition("=")[::2] for entry in re.split(r"[,;]\s*(?=[^\W\d]\w*\s*=)", text)]
    else:
        entries = list(text.items())
    columns: dict[str, str] = {}
    for name, label in entries:
        name, label = name.strip(), clean_label(label)
        quantity = COLUMN_NAMES.get(name.lower())
        if quantity is None:
            raise InputError(
                f"--columns names '{name}', expected {', '.join(QUANTITY_OF_COLUMN)}{nearest(name, QUANTITY_OF_COLUMN)}"
                '; write for example --columns "u=AO0:V, Q=Flow (L/min)"'
            )
        if quantity in columns:
            raise InputError(f"--columns names {quantity} twice; keep one")
        if not label:
            raise InputError(f"--columns gives no label for {quantity}; write for example {quantity}=AO0:V")
        columns[quantity] = label
    return columns


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
    columns = labelled_columns(table, chosen)
    if "time" not in chosen and "time" in columns and columns["time"].unit and not fits(columns["time"].unit, "time"):
        del columns["time"]  # T_degC is no time
    if sample_rate is not None:
        columns = _without_time(table, columns, sample_rate)
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
    several = sample_rate is None and (table.clocks or len(time_columns(table)) > 1)
    for quantity in ("u", "time", "Q") if several else ("time", "u", "Q") if sample_rate is None else ("u", "Q"):
        if quantity not in columns:
            raise _missing_column(quantity, table, columns)
    return columns if sample_rate is not None else _with_own_clocks(table, columns)


def _with_own_clocks(table: Table, columns: dict[str, Column]) -> dict[str, Column]:
    """Return columns with those of time of their own; refuse another one for the command than its own."""
    time = columns["time"]
    for quantity, column in columns.items():
        own = clock_of(table, quantity, column.label) if quantity != "time" else ""
        for less in filter(None, (column.less,)):
            if clock_of(table, quantity, less.label) != own:
                raise InputError(
                    f"'{table.path}': '{column.label}' and '{less.label}' have clocks of their own, and no difference "
                    "of the two is taken; export the commands with one"
                )
        if not own or time.label in (own, table.dated(own)):
            continue
        if quantity == "u":
            raise InputError(
                f"'{table.path}': '{own}' is the column of time of '{column.label}', but --columns names "
                f"'{time.label}'; name '{own}', or none"
            )
        clock = column_of_time(table, own)
        columns[quantity] = replace(column, clock=clock if clock.unit else replace(clock, unit=time.unit))
    return columns


def _without_time(table: Table, columns: dict[str, Column], sample_rate: float) -> dict[str, Column]:
    """Return columns without one of time whose unit nobody knows; refuse a clock."""
    time, times = columns.get("time"), time_columns(table)
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


def labelled_columns(table: Table, chosen: Mapping[str, str]) -> dict[str, Column]:
    """Return what `find_columns` does, without a word on quantities that have no column."""
    equal, unit = _label_and_unit(table, chosen.get("time", ""))
    if equal not in table.labels and any(table.in_file(label) == equal for label in table.labels):
        # Of equal columns of time the command's is meant, if it has one of them.
        columns = labelled_columns(table, {name: text for name, text in chosen.items() if name != "time"})
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
        if quantity in ("pP", "pT") and unit and not fits(unit, quantity):
            continue  # a thermometer Pt_degC
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
    if "time" not in chosen and "u" in columns and (clock := clock_of(table, "u", columns["u"].label)):
        columns["time"] = column_of_time(table, clock)
    elif also_time and "u" in columns:
        raise InputError(
            f"'{table.path}'{table.header} has columns of time '{columns['time'].label}' and '{also_time}', and which "
            f"is that of '{columns['u'].label}' can't be told; name them by their quantity, such as t_u_s and t_Q_s, "
            "or choose one by --columns"
        )
    elif also_time:
        del columns["time"]  # the command will tell which it is
    return columns


def time_columns(table: Table) -> list[str]:
    """Return the labels of the columns that are a time by label and unit, by their cells, or by whose they are."""
    units = {label: kind[1] for label in table.labels if (kind := _kind_of_clock(table, label))}
    claimed = {clock_of(table, "", label) for label in table.labels} if "?" in units.values() else set()
    return [label for label, unit in units.items() if unit != "?" or label in claimed]


def counts_time(table: Table, label: str) -> Column | None:
    """Return a column that counts time by its label, be it elapsed, a sensor's or a lone t, with its unit if known."""
    name, unit = _name_and_unit(table, label)
    if _kind_of_clock(table, label) is None and not (ELAPSED.fullmatch(name) and (not unit or fits(unit, "time"))):
        return None
    return Column(label=label, unit=unit if fits(unit, "time") else "")


def clock_of(table: Table, quantity: str, label: str) -> str:
    """Return the column of time of a quantity's column, in a file that has several; empty where nothing tells.

    What the file states for each channel goes first. Else the time that names the quantity or its column (``t_u_s``,
    ``Flow Time``), then the only one of its group, then the one before it where all columns of time are alike.
    """
    if table.clocks:
        return table.clocks.get(label, "")
    times = {each: kind for each in table.labels if (kind := _kind_of_clock(table, each))}
    if len(times) < 2 or label in times:
        return ""
    names = {_name_and_unit(table, label)[0].casefold(), table.in_file(label).casefold(), quantity.casefold()}
    named = [each for each, (*_, of) in times.items() if of.casefold() in names or _quantity_named(of) == quantity]
    named = [each for each in named if table.group(each) == table.group(label)] or named
    if named:
        return named[0] if len(named) == 1 else ""
    times = {each: kind for each, kind in times.items() if kind[1] != "?"}
    group = table.group(label)
    while len({table.group(each) for each in times}) > 1:
        inside = [each for each in times if table.group(each) == group]
        inside = [each for each in inside if not times[each][2]] or inside
        if len(inside) == 1:
            return inside[0]
        if not group:
            break
        group = group.rpartition("/")[0]
    return _clock_before(table, label, times)


def are_alike(table: Table, one: str, other: str) -> bool:
    """Tell whether the labels of two columns of time differ in nothing but the quantity or number that they name."""
    kinds = [_kind_of_clock(table, label) for label in (one, other)]
    return len({kind and (*kind[:2], bool(kind[2])) for kind in kinds}) == 1


def _clock_before(table: Table, label: str, times: Collection[str]) -> str:
    """Return the last column of time before a column, in a table in which each such column stands before quantities."""
    at = [index for index, each in enumerate(table.labels) if each in times]
    ends = [*at[1:], len(table.labels)]
    apart = len(at) > 1 and at[0] == 0 and all(end - index > 1 for index, end in zip(at, ends, strict=True))
    alike = all(are_alike(table, each, next(iter(times))) for each in times)
    if not (apart and alike) or sorted(table.labels) == list(table.labels):  # the order of HDF5 is the alphabet's
        return ""
    return next(table.labels[index] for index in reversed(at) if index < table.labels.index(label))


def _kind_of_clock(table: Table, label: str) -> tuple[str, str, str] | None:
    """Return word, unit and quantity of a column of time; None for any other.

    The unit of one that may be a time as well as a temperature is ``?``.
    """
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
    return word.lower(), unit, of


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


def column_of_time(table: Table, label: str) -> Column:
    """Return a column of time with its unit, which is empty if nobody knows it."""
    unit = _name_and_unit(table, label)[1]
    return Column(label=table.dated(label), unit=unit if fits(unit, "time") else "s" if table.is_clock(label) else "")


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


def no_flow(labels: Collection[str]) -> str:
    """Return what to do about the first label that is a volume, a count, a position or a speed; nothing if none is.

    Examples
    --------
    >>> no_flow(["time_s", "Total_L"])
    "; 'Total_L' is a volume and no flow: differentiate it over time"
    >>> no_flow(["Q_Lmin"])
    ''
    """
    for label in labels:
        unit = split_label(label)[1].lower()
        if SPEEDS.search(label):
            example = f'--columns "Q={label}:0..100 mm/s = 0..12 L/min"'
            return f"; '{label}' is a speed: of a cylinder, the flow is area x speed, for example {example}"
        if unit in VOLUMES:
            return f"; '{label}' is a volume and no flow: differentiate it over time"
        if COUNTS.search(label):
            return f"; '{label}' counts pulses and is no flow: differentiate it, or record the frequency"
        if measures(unit, "length"):
            return f"; '{label}' is a position and no flow: differentiate it; of a cylinder, the flow is area x speed"
    return ""


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


def same_unit(one: str, other: str, column: str) -> bool:
    """Tell whether two units are the same for a column of that quantity, however they are spelled.

    Examples
    --------
    >>> same_unit("Lmin", "l/min", "Q"), same_unit("Lmin", "l/h", "Q"), same_unit("V", "%", "u")
    (True, False, False)
    """
    if one.lower() in PER_CENT or other.lower() in PER_CENT:
        return one.lower() in PER_CENT and other.lower() in PER_CENT
    kinds = [QUANTITY_OF_COLUMN[column], "voltage", "current"]
    kind = next((kind for kind in kinds if measures(one, kind) and measures(other, kind)), None)
    return kind is not None and isclose(si_factor(one, kind), si_factor(other, kind), rel_tol=1e-9)


def names_a_quantity_or_current(unit: str) -> bool:
    """Tell whether a unit is one of a ramp test's quantities or of a current."""
    return names_a_quantity(unit) or measures(unit, "current")


def split_label(label: str) -> tuple[str | None, str]:
    """Split a column's label into the quantity (None if it is not one of a ramp test's) and its unit.

    Examples
    --------
    >>> split_label("dP_MPa"), split_label("Q [L/min]"), split_label("u (V)"), split_label("u")
    (('dP', 'MPa'), ('Q', 'L/min'), ('u', 'V'), ('u', ''))
    >>> split_label("t/s"), split_label("p_diff/bar"), split_label("Flow in l/min")
    (('time', 's'), (None, 'bar'), ('Q', 'l/min'))
    """
    bare = clean_label(label)
    # By hand: a regular expression for both brackets takes the cube of the label's length.
    bracket = re.compile(r"[\[(]").search(bare, 1)
    relative = re.search(rf"(?<![^\W\d_]){RELATIVE.pattern}$", bare[-LONGEST_NAME:], re.IGNORECASE)
    if relative:  # dP_bar_g, dP_MPa(g)
        name, unit = bare[: len(bare) - len(relative[0])].rstrip(" _/,").removesuffix(" in"), relative[0]
    elif bracket and bare[-1] in "])":
        name, unit = bare[: bracket.start()].rstrip(" /"), bare[bracket.end() : -1].strip()
    else:  # the unit follows the last underscore; L_min, as artefacts spell it, has one itself
        match = re.fullmatch(r"(.+?)_([lL]_min|[^_]*)", bare)
        name, unit = match.groups() if match else ("", bare)
    for candidate, its_unit in ((name, unit), (bare, "")):
        quantity = _quantity_named(candidate)
        if quantity:
            return quantity, its_unit
    return (None, unit) if bracket or relative else _after_a_blank_or_slash(bare)


def split_column(table: Table, label: str) -> tuple[str | None, str]:
    """Return what `split_label` does, for a column of a table: beside ``PWM_B`` the A of ``PWM_A`` is no unit.

    Of ``u_A`` and ``u_B`` neither is the command.
    """
    in_file = table.in_file(label)
    quantity, unit = split_label(in_file)
    twin = in_file[:-1] + in_file[-1:].translate(TWINS)
    if twin == in_file or twin not in table.labels or unit.lower() not in ("a", "b"):
        return quantity, unit
    return None if quantity == "u" else quantity, ""


def _quantity_named(name: str) -> str | None:
    return COLUMN_NAMES.get(re.sub(r"[\s_]", "", name[:LONGEST_NAME]).lower())


def _after_a_blank_or_slash(label: str) -> tuple[str | None, str]:
    """Split ``p / bar``, ``Druck in bar`` and ``flow l/min``; what follows must be a unit of a ramp test."""
    for name, unit in (label.rpartition(" ")[::2], label.partition("/")[::2], label.rpartition("_")[::2]):
        unit = unit.strip()
        if name and names_a_quantity(unit):
            name = name.rstrip(" /,").removesuffix(" in")
            return _quantity_named(name), unit
    return None, label.rpartition("_")[2]


def names_a_quantity(unit: str) -> bool:
    """Tell whether a unit says by itself which quantity of a ramp test it may be of."""
    return unit.lower() in PER_CENT or any(measures(unit, quantity) for quantity in QUANTITIES)


def _missing_column(quantity: str, table: Table, columns: Collection[str]) -> InputError:
    """Return the error that names the columns found, and the one that may have been meant."""
    unused = [label for label in table.labels[:MOST_MEANT] if split_column(table, label)[0] not in columns]
    bare = {re.split(r"[_\[(]", label)[0].strip().lower(): label for label in unused}
    spellings = [name for name, its in COLUMN_NAMES.items() if its == quantity and len(name) > 1]  # T_degC is no time
    meant = [bare[near] for name in spellings for near in get_close_matches(name, bare, n=1)]
    kind = QUANTITY_OF_COLUMN[quantity]
    meant += [label for label in unused if measures(table.units.get(label, "") or split_label(label)[1], kind)]
    begin = f"'{table.path}' has no column of {quantity} (columns found: {table.found_labels()})"
    if other := long_format(table.labels) or (no_flow(unused) if quantity == "Q" and not meant else ""):
        return InputError(begin + other)
    hint = f" (did you mean '{meant[0]}'? name it {EXAMPLE_LABELS[quantity]})" if meant else ""
    rate = ', or --sample-rate "100 Hz"' if quantity == "time" and not time_columns(table) else ""
    return MissingColumnError(
        begin + hint,
        f"; expected names with units such as time_s,u_V,dP_MPa,Q_Lmin, or --columns{rate}",
    )


def long_format(labels: Collection[str]) -> str:
    """Return what to do about a table with a row for each variable; nothing for any other."""
    words = [re.sub(r"[\s_]", "", label).lower() for label in list(labels)[:MOST_MEANT]]
    value = next((label for label, word in zip(labels, words, strict=False) if word in VALUES), "")
    name = next((label for label, word in zip(labels, words, strict=False) if word in VARIABLES), "")
    if not (value and name):
        return ""
    return f"; the table has a row for each variable ({name}, {value}): export a column for each, or pivot it"


def fits(unit: str, column: str) -> bool:
    """Tell whether a column of that quantity may be in that unit."""
    return measures(unit, QUANTITY_OF_COLUMN[column]) or (column == "u" and unit.lower() in PER_CENT)
