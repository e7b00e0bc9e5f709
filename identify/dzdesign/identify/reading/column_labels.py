"""Labels of columns as they stand, or as the engineer gives them: the quantity and the unit that one says."""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from math import isclose

from dzdesign.core.errors import InputError, nearest
from dzdesign.core.units import RELATIVE, measures, si_factor
from dzdesign.identify.reading.metering_edge import PORTS
from dzdesign.identify.reading.table import Table, clean_label

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
#: Labels among which the one that was meant is looked for.
MOST_MEANT = 200
#: Units of a command that is a share of u_max.
PER_CENT = ("%", "pct", "percent")
QUANTITIES = ("time", "voltage", "pressure", "flow")
#: The last letters of the labels of two sides, exchanged.
TWINS = str.maketrans("ABab", "BAba")
#: Labels of a table with a row for each variable: what names it, and its value.
VARIABLES = ("path", "name", "variable", "varname", "tag", "tagname", "signal", "channel", "sensor", "metric", "field")
VALUES = ("value", "varvalue", "tagvalue", "wert")
#: Units of a volume, and what a column of a meter's pulses is called.
VOLUMES = ("l", "ml", "cl", "m3", "m³", "cm3", "cm³", "dm3", "dm³", "ccm", "cc", "gal", "liter", "litre", "in3", "in³")
SPEEDS = re.compile(r"(?:^|[\W_\d])(?:[mcµ]?m|inch?)(?:/|_per_)s|speed|velocity|geschwindigkeit", re.IGNORECASE)
COUNTS = re.compile(r"puls|impuls|\bcounts?\b|_counts?$|\bticks?\b", re.IGNORECASE)
#: Characters of a label in which a quantity is looked for.
LONGEST_NAME = 80


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column that was found: its label in the file, and its unit ("" if none is known)."""

    #: As the file or ``--columns`` says.
    label: str
    unit: str
    #: The unit that the file states, where ``--columns`` says another or a range.
    stated: str = ""
    #: What is subtracted from it: the command of the other solenoid.
    less: "Column | None" = None
    #: Its own column of time, where that is another than the command's.
    clock: "Column | None" = None

    @property
    def every(self) -> "tuple[Column, ...]":
        """This column, and the one that is subtracted from it."""
        return (self,) if self.less is None else (self, self.less)


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
        quantity = quantity_named(candidate)
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


def quantity_named(name: str) -> str | None:
    """Return the quantity of a ramp test that a name is of, in any spelling; None if it is of none."""
    return COLUMN_NAMES.get(re.sub(r"[\s_]", "", name[:LONGEST_NAME]).lower())


def _after_a_blank_or_slash(label: str) -> tuple[str | None, str]:
    """Split ``p / bar``, ``Druck in bar`` and ``flow l/min``; what follows must be a unit of a ramp test."""
    for name, unit in (label.rpartition(" ")[::2], label.partition("/")[::2], label.rpartition("_")[::2]):
        unit = unit.strip()
        if name and names_a_quantity(unit):
            name = name.rstrip(" /,").removesuffix(" in")
            return quantity_named(name), unit
    return None, label.rpartition("_")[2]


def names_a_quantity(unit: str) -> bool:
    """Tell whether a unit says by itself which quantity of a ramp test it may be of."""
    return unit.lower() in PER_CENT or any(measures(unit, quantity) for quantity in QUANTITIES)


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
