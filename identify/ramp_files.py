"""Ramp files: a table with a header row whose columns are a quantity and its unit; read into SI, or written."""

import csv
import gzip
import io
import re
import zlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.artefacts import read_bytes, sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.units import si_factor

if TYPE_CHECKING:
    import polars as pl

#: The number of a line in its file (1 is the first), and the line.
Lines = list[tuple[int, str]]

#: Spelling in a header (lower case, letters only) -> quantity of a ramp test.
COLUMN_NAMES = {
    "time": "time", "t": "time",
    "u": "u", "command": "u",
    "dp": "dP", "δp": "dP", "deltap": "dP",
    "pa": "pA", "pb": "pB",
    "q": "Q", "flow": "Q",
}  # fmt: skip
QUANTITY_OF_COLUMN = {"time": "time", "u": "voltage", "dP": "pressure", "pA": "pressure", "pB": "pressure", "Q": "flow"}
#: How a column is best named, for the messages.
EXAMPLE_LABELS = {"time": "time_s", "u": "u_V", "dP": "dP_MPa", "pA": "pA_MPa", "pB": "pB_MPa", "Q": "Q_Lmin"}
#: Units of a command that is a share of u_max.
PER_CENT = ("%", "pct", "percent")
#: Fewest complete rows in which two branches with a threshold could stand.
MIN_ROWS = 20
#: Joins the cells of a line inside: no cell of a text file holds it.
CELL_END = "\x1f"
#: SI numbers beyond these are no measurement of a valve: a wrong unit, or what a logger writes for an overflow.
LARGEST = {"time": 1e12, "voltage": 1e4, "pressure": 1e9, "flow": 10.0}
#: Characters of a cell, and columns of a file, that a message quotes.
QUOTED_CHARACTERS, QUOTED_COLUMNS = 40, 12


@dataclass(frozen=True, slots=True, kw_only=True)
class RampTest:
    """One recorded ramp test, SI, read-only.

    Attributes
    ----------
    source, sha256 : str
        File name (without its folder) and the hash of its bytes.
    time, u, q : (N,) array
        Time in s, command in V, flow in m³/s; rows with a missing value are left out.
    dp : (N,) array or None
        Pressure drop in Pa, or None if the file has none.
    """

    source: str
    sha256: str
    time: np.ndarray
    u: np.ndarray
    q: np.ndarray
    dp: np.ndarray | None

    def __post_init__(self) -> None:
        for array in (self.time, self.u, self.q, self.dp):
            if array is None:
                continue
            if array.shape != self.time.shape or array.ndim != 1:
                raise ValueError("the columns of a ramp test are vectors of one length")
            array.flags.writeable = False


def read_ramp_file(path: Path, u_max: float = 10.0) -> RampTest:
    """Read one ramp test from a CSV file (comma, semicolon or tab; plain or gzip).

    Parameters
    ----------
    path : Path
        A table with a header row such as ``time_s,u_V,dP_MPa,Q_Lmin`` (or ``u [V]``, ``u (V)``); lines that start
        with ``#`` are comments, blank cells are missing samples. ``pA`` and ``pB`` may stand in place of ``dP``.
    u_max : float
        Command in V that 100 % means, where the command is in per cent.

    Raises
    ------
    InputError
        Naming file, and row and column where there is one.
    """
    path = Path(path)
    content = read_bytes(path, "ramp file")
    lines = _table_lines(_decode(content, path))
    columns, separator = _read_header(lines, path)
    factors = {name: _factor(name, unit, label, u_max, path) for name, (label, unit) in columns.items()}
    cells = _read_cells(lines, separator, path)
    data = {name: _numbers(cells, name, columns[name][0], lines, factors[name], path) for name in columns}
    dp = data["dP"] if "dP" in data else data["pA"] - data["pB"] if "pA" in data else None
    complete = np.isfinite(data["time"]) & np.isfinite(data["u"]) & np.isfinite(data["Q"])
    if dp is not None:
        complete &= np.isfinite(dp)
    if complete.sum() < MIN_ROWS:
        raise InputError(f"'{path}' has {complete.sum()} complete rows, expected at least {MIN_ROWS} of a ramp test")
    backwards = np.flatnonzero(np.diff(data["time"][complete]) < 0)
    if backwards.size:
        row = int(np.flatnonzero(complete)[backwards[0] + 1])
        raise InputError(
            f"'{path}' row {lines[row + 1][0]}: the time goes back; expected one recording in the order it was taken"
        )
    return RampTest(
        source=path.name.encode(errors="replace").decode(),
        sha256=sha256_of(content),
        time=data["time"][complete],
        u=data["u"][complete],
        q=data["Q"][complete],
        dp=None if dp is None else dp[complete],
    )


def ramp_file_bytes(columns: Mapping[str, np.ndarray], comments: tuple[str, ...], *, compress: bool) -> bytes:
    """Return the bytes of a ramp file: comment lines, header, rows with four decimals; gzip carries no date.

    Parameters
    ----------
    columns : mapping
        Label with unit, such as ``"u_V"``, to an (N,) array.
    comments : tuple of str
        Lines without the leading ``#``.
    compress : bool
        Whether to gzip.
    """
    out = io.StringIO()
    for line in comments:
        out.write(f"# {line}\n")
    out.write(",".join(columns) + "\n")
    np.savetxt(out, np.column_stack(list(columns.values())), fmt="%.4f", delimiter=",")
    data = out.getvalue().encode()
    return gzip.compress(data, mtime=0) if compress else data


def _decode(content: bytes, path: Path) -> str:
    try:
        plain = gzip.decompress(content) if content[:2] == b"\x1f\x8b" else content
        text = plain.decode("utf-8-sig")
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"'{path}' is not a whole gzip file ({error}); copy it again") from error
    except UnicodeDecodeError as error:
        raise InputError(
            f"'{path}' is not a text file in UTF-8 (byte {error.start + 1}); save the table as 'CSV UTF-8'"
        ) from error
    if "\0" in text:
        raise InputError(f"'{path}' is UTF-16 or no text at all, expected UTF-8; save the table as 'CSV UTF-8'")
    return text


def _table_lines(text: str) -> Lines:
    """Return every line that is neither a comment nor blank; the first is the header.

    A spreadsheet that has saved a file again leaves comments in quotes, and blank lines as a row of separators.
    """
    # Not splitlines(): to an editor, whose line numbers the messages give, a form feed or U+0085 ends no line.
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip(' \t,;"') and not line.lstrip(' \t"').startswith("#")
    ]


def clean_label(label: str) -> str:
    """Return a column's label without the blanks and quotes around it."""
    return label.strip(' \t"')


def split_label(label: str) -> tuple[str | None, str]:
    """Split a column's label into the quantity (None if it is not one of a ramp test's) and its unit.

    Examples
    --------
    >>> split_label("dP_MPa"), split_label("Q [L/min]"), split_label("u (V)"), split_label("u")
    (('dP', 'MPa'), ('Q', 'L/min'), ('u', 'V'), ('u', ''))
    """
    bare = clean_label(label)
    match = re.fullmatch(r"(.+?)\s*[\[(]\s*(.*?)\s*[\])]", bare)
    if match is None:  # the unit follows the last underscore; L_min, as artefacts spell it, has one itself
        match = re.fullmatch(r"(.+?)_([lL]_min|[^_]*)", bare)
    name, unit = match.groups() if match else ("", bare)
    for candidate, its_unit in ((name, unit), (bare, "")):
        quantity = COLUMN_NAMES.get(re.sub(r"[\s_]", "", candidate).lower())
        if quantity:
            return quantity, its_unit
    return None, unit


def _read_header(lines: Lines, path: Path) -> tuple[dict[str, tuple[str, str]], str]:
    """Return quantity -> (label, unit) from the header row, and the separator."""
    if not lines:
        raise InputError(f"'{path}' is empty; expected a header row such as time_s,u_V,dP_MPa,Q_Lmin and samples")
    number, header = lines[0]
    separator = max(",;\t", key=header.count)
    labels = [clean_label(label) for label in _split(header, separator)]
    if all(re.fullmatch(r"[-+\d.,eE\s]*", label) for label in labels):
        raise InputError(
            f"'{path}' has no header row (row {number} is '{header[:QUOTED_CHARACTERS]}'); "
            "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
        )
    columns: dict[str, tuple[str, str]] = {}
    for label in labels:
        quantity, unit = split_label(label)
        if quantity is None:
            continue
        if quantity in columns and not _fits(unit, quantity):
            continue  # an oil temperature T_degC beside the time t_s, a set point Q_set beside Q_Lmin
        if quantity in columns and _fits(columns[quantity][1], quantity):
            raise InputError(
                f"'{path}' row {number} has two columns of {quantity}: '{columns[quantity][0]}' and '{label}'; "
                "keep one, or give the other another name"
            )
        columns[quantity] = (label, unit)
    if ("pA" in columns) != ("pB" in columns) and "dP" not in columns:
        have, lack = ("pA", "pB") if "pA" in columns else ("pB", "pA")
        raise InputError(f"'{path}' row {number} has a column of {have} but none of {lack}; expected both, or dP")
    for quantity in ("time", "u", "Q"):
        if quantity not in columns:
            raise _missing_column(quantity, labels, columns, path)
    return columns, separator


def _missing_column(quantity: str, labels: list[str], columns: Collection[str], path: Path) -> InputError:
    """Return the error that names the columns found, and the one that may have been meant."""
    unused = [label for label in labels if split_label(label)[0] not in columns]
    bare = {re.split(r"[_\[(]", label)[0].strip().lower(): label for label in unused}
    spellings = [name for name, its in COLUMN_NAMES.items() if its == quantity]
    meant = [bare[near] for name in spellings for near in get_close_matches(name, bare, n=1)]
    meant += [label for label in unused if _measures(split_label(label)[1], QUANTITY_OF_COLUMN[quantity])]
    hint = f" (did you mean '{meant[0]}'? name it {EXAMPLE_LABELS[quantity]})" if meant else ""
    found = ", ".join(labels[:QUOTED_COLUMNS]) + (", ..." if len(labels) > QUOTED_COLUMNS else "")
    return InputError(
        f"'{path}' has no column of {quantity} (columns found: {found}){hint}; "
        "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
    )


def _fits(unit: str, column: str) -> bool:
    """Tell whether a column of that kind may be in that unit."""
    return _measures(unit, QUANTITY_OF_COLUMN[column]) or (column == "u" and unit.lower() in PER_CENT)


def _measures(unit: str, quantity: str) -> bool:
    try:
        return bool(si_factor(unit, quantity))
    except InputError:
        return False


def _split(line: str, separator: str) -> list[str]:
    """Return the cells of a line; inside quotes the separator is a character as any other."""
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True))


def _read_cells(lines: Lines, separator: str, path: Path) -> "pl.DataFrame":
    """Return all cells as strings: numbers are read column by column, so that an error can name its row."""
    import polars as pl

    width = len(_split(lines[0][1], separator))
    table = []
    for number, line in lines:
        cells = _split(line, separator) if '"' in line else None
        count = line.count(separator) + 1 if cells is None else len(cells)
        if count != width:
            comma = separator == "," and count == 2 * width
            hint = "; decimal commas need ';' or a tab between the cells" if comma else ""
            raise InputError(f"'{path}' row {number} has {count} cells, expected {width} as in the header{hint}")
        table.append(line.replace(separator, CELL_END) if cells is None else CELL_END.join(cells))
    try:
        return pl.read_csv("\n".join(table).encode(), separator=CELL_END, infer_schema=False, quote_char=None)
    except pl.exceptions.PolarsError as error:
        raise InputError(f"'{path}' can't be read as a table: {str(error).splitlines()[0]}") from error


def _numbers(cells: "pl.DataFrame", name: str, label: str, lines: Lines, factor: float, path: Path) -> np.ndarray:
    """Return one column in SI as float64, NaN where the cell is blank."""
    import polars as pl

    column = cells[next(found for found in cells.columns if clean_label(found) == label)].str.strip_chars(' \t"')
    # A decimal comma can only stand where the comma does not separate the cells.
    column = column.str.replace(",", ".", literal=True)
    numbers = column.cast(pl.Float64, strict=False) * factor
    blank = column.is_null() | (column == "") | numbers.is_nan().fill_null(False)
    bad = (~blank & numbers.is_null()).arg_true()
    far = (~blank & (numbers.abs() > LARGEST[QUANTITY_OF_COLUMN[name]])).arg_true()
    for rows, what in ((bad, "is not a number"), (far, "is no measurement of a valve in that unit")):
        if len(rows):
            row = int(rows[0])
            raise InputError(
                f"'{path}' row {lines[row + 1][0]}, column '{label}': '{column[row][:QUOTED_CHARACTERS]}' {what}; "
                "correct it, or leave the cell blank if the sample is missing"
            )
    return numbers.fill_null(np.nan).to_numpy().copy()


def _factor(name: str, unit: str, label: str, u_max: float, path: Path) -> float:
    """Return the factor from the column's unit to SI; a command may also be in per cent of u_max."""
    if not unit:
        raise InputError(f"'{path}' column '{label}' has no unit; write for example {EXAMPLE_LABELS[name]}")
    try:
        if name == "u" and unit.lower() in PER_CENT:
            return u_max * si_factor(unit, "ratio")
        return si_factor(unit, QUANTITY_OF_COLUMN[name])
    except InputError as error:
        raise InputError(f"'{path}' column '{label}': {error}") from error
