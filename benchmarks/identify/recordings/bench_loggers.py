"""What loggers write of a bench's readings: one table of numbers in the ways of several makers.

The readings are columns by name: ``t`` (s), ``u`` (V), ``Q`` (L/min), and pressures, ``dP`` or a port's, in MPa. NumPy
only, no code shared with the product that reads the text.
"""

import datetime
from collections.abc import Callable

import numpy as np

Rows = dict[str, np.ndarray]
#: How many of a unit of flow are one litre a minute, by what a gallon, an hour and a second are.
PER_L_MIN = {"Lmin": 1.0, "gpm": 1 / 3.785411784, "mL/s": 1000 / 60, "m3/h": 0.06}
#: Logger -> unit of its pressures.
PRESSURE_OF = {"plain": "MPa", "german": "bar", "with_units_below": "psi"}
BEGIN = datetime.datetime(2026, 3, 4, 9, 30)


def table(columns: dict[str, tuple[np.ndarray, int]], separator: str = ",", comma: bool = False) -> str:
    """Return a table: label -> column and its decimals."""
    cells = [[f"{value:.{digits}f}" for value in column.tolist()] for column, digits in columns.values()]
    rows = "\n".join(separator.join(row) for row in zip(*cells, strict=True))
    return separator.join(columns) + "\n" + (rows.replace(".", ",") if comma else rows) + "\n"


def plain(rows: Rows, *pressures: str) -> str:
    """Return time, command, some pressures in MPa and the flow, the unit in each label."""
    columns = {f"{name}_MPa": (rows[name], 5) for name in pressures or ("dP",)}
    return table({"time_s": (rows["t"], 4), "u_V": (rows["u"], 4), **columns, "Q_Lmin": (rows["Q"], 4)})


def semicolons(rows: Rows) -> str:
    """Return a table with decimal commas and units in brackets, in bar."""
    columns = {"t [s]": (rows["t"], 4), "u [V]": (rows["u"], 3), "dP [bar]": (10 * rows["dP"], 3)}
    return table(columns | {"Q [l/min]": (rows["Q"], 3)}, ";", comma=True)


def stamped(rows: Rows) -> str:
    """Return what a logger with a preamble and date-and-time stamps writes."""
    columns = {"u (V)": (rows["u"], 4), "dP (MPa)": (rows["dP"], 5), "Q (L/min)": (rows["Q"], 3)}
    text = _with_stamps(rows["t"], "time", "%Y-%m-%d %H:%M:%S.%f", table(columns, "\t"), "\t")
    return f"Logger DL-40;SN 00417\nChannels: 3\n\n{text}"


def german(rows: Rows, *pressures: str) -> str:
    """Return stamps of the day first, and decimal commas, in bar."""
    columns = {f"{name} [bar]": (10 * rows[name], 3) for name in pressures}
    text = table({"u [V]": (rows["u"], 4), **columns, "Q [l/min]": (rows["Q"], 3)}, ";", comma=True)
    return _with_stamps(rows["t"], "t", "%d.%m.%Y %H:%M:%S,%f", text, ";")


def two_ports(rows: Rows) -> str:
    """Return milliseconds and the pressures of two ports in bar in place of the drop."""
    back = np.full(rows["t"].size, 12.0)
    ports = {"pA [bar]": (10 * rows["dP"] + back, 3), "pB [bar]": (back, 3)}
    return table({"time [ms]": (1e3 * rows["t"], 1), "u [V]": (rows["u"], 4), **ports, "Q [L/min]": (rows["Q"], 3)})


def with_units_below(rows: Rows, *pressures: str) -> str:
    """Return a table with a row of units below the labels, pressures in psi."""
    columns = {"t": (1e3 * rows["t"], 1), "u": (rows["u"], 4)}
    columns |= {name: (rows[name] * 145.0377, 3) for name in pressures} | {"Q": (rows["Q"], 3)}
    head, *lines = table(columns, "\t").splitlines()
    return "\n".join([head, "\t".join(["ms", "V", *["psi"] * len(pressures), "l/min"]), *lines]) + "\n"


def command_text(
    rows: Rows, label: str, values: np.ndarray, digits: int = 4, clock: bool = True, flow: str = "Lmin"
) -> str:
    """Return a recording whose command stands under another label, in its own unit; its flow in one of `PER_L_MIN`."""
    time = {"time_s": (rows["t"], 3)} if clock else {}
    flows = rows["Q"] * PER_L_MIN[flow]
    return table({**time, label: (values, digits), "dP_bar": (10 * rows["dP"], 3), f"Q_{flow}": (flows, 4)})


def _with_stamps(time: np.ndarray, label: str, pattern: str, text: str, separator: str) -> str:
    head, *lines = text.splitlines()
    stamps = (f"{BEGIN + datetime.timedelta(seconds=at):{pattern}}" for at in time.tolist())
    rows = (f"{at}{separator}{line}" for at, line in zip(stamps, lines, strict=True))
    return "\n".join([f"{label}{separator}{head}", *rows]) + "\n"


LOGGERS: tuple[Callable[[Rows], str], ...] = (plain, semicolons, stamped, two_ports)
