"""Ramp files: a table with a header row whose columns are a quantity and its unit; read into SI, or written."""

import gzip
import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.artefacts import read_bytes, sha256_of
from dzdesign.core.errors import InputError, nearest
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
#: Fewest complete rows in which two branches with a threshold could stand.
MIN_ROWS = 20


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
    cells = _read_cells(lines, separator, path)
    data = {name: _numbers(cells, label, lines, path) for name, (label, _) in columns.items()}
    for name, (label, unit) in columns.items():
        data[name] = data[name] * _factor(name, unit, label, u_max, path)
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
        source=path.name,
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
        return plain.decode("utf-8-sig")
    except (OSError, EOFError) as error:
        raise InputError(f"'{path}' is not a whole gzip file ({error}); copy it again") from error
    except UnicodeDecodeError as error:
        raise InputError(f"'{path}' is not a text file in UTF-8 (byte {error.start}); save it as CSV UTF-8") from error


def _table_lines(text: str) -> Lines:
    """Return every line that is neither a comment nor empty; the first is the header."""
    return [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.startswith("#")
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
    name, unit = match.groups() if match else (bare.rpartition("_")[0], bare.rpartition("_")[2])
    for candidate, its_unit in ((name, unit), (bare, "")):
        quantity = COLUMN_NAMES.get(re.sub(r"[\s_]", "", candidate).lower())
        if quantity:
            return quantity, its_unit
    return None, unit


def _read_header(lines: Lines, path: Path) -> tuple[dict[str, tuple[str, str]], str]:
    """Return quantity -> (label, unit) from the header row, and the separator."""
    if not lines:
        raise InputError(f"'{path}' is empty; expected a header row such as time_s,u_V,dP_MPa,Q_Lmin and samples")
    header = lines[0][1]
    separator = max(",;\t", key=header.count)
    labels = [clean_label(label) for label in header.split(separator)]
    if all(re.fullmatch(r"[-+\d.,eE\s]*", label) for label in labels):
        raise InputError(
            f"'{path}' has no header row (it begins with '{header[:40]}'); "
            "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
        )
    columns: dict[str, tuple[str, str]] = {}
    for label in labels:
        quantity, unit = split_label(label)
        if quantity is None:
            continue
        if quantity in columns:
            raise InputError(f"'{path}' has two columns of {quantity}: '{columns[quantity][0]}' and '{label}'")
        columns[quantity] = (label, unit)
    if ("pA" in columns) != ("pB" in columns) and "dP" not in columns:
        have, lack = ("pA", "pB") if "pA" in columns else ("pB", "pA")
        raise InputError(f"'{path}' has a column of {have} but none of {lack}; expected both, or dP")
    for quantity in ("time", "u", "Q"):
        if quantity not in columns:
            bare = {re.split(r"[_\[(]", label)[0].strip().lower(): label for label in labels}
            hint = nearest(quantity.lower(), bare)
            raise InputError(
                f"'{path}' has no column of {quantity} (columns found: {', '.join(labels)}){hint}; "
                "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
            )
    return columns, separator


def _read_cells(lines: Lines, separator: str, path: Path) -> "pl.DataFrame":
    """Return all cells as strings: numbers are read column by column, so that an error can name its row."""
    import polars as pl

    width = lines[0][1].count(separator)
    for number, line in lines:
        if line.count(separator) != width:
            raise InputError(
                f"'{path}' row {number} has {line.count(separator) + 1} cells, expected {width + 1} as in the header"
            )
    table = "\n".join(line for _, line in lines).encode()
    try:
        return pl.read_csv(table, separator=separator, infer_schema=False, quote_char=None)
    except pl.exceptions.PolarsError as error:
        raise InputError(f"'{path}' can't be read as a table: {str(error).splitlines()[0]}") from error


def _numbers(cells: "pl.DataFrame", label: str, lines: Lines, path: Path) -> np.ndarray:
    """Return one column as float64, NaN where the cell is blank."""
    import polars as pl

    column = cells[next(found for found in cells.columns if clean_label(found) == label)].str.strip_chars(' \t"')
    # A decimal comma can only stand where the comma does not separate the cells.
    column = column.str.replace(",", ".", literal=True)
    numbers = column.cast(pl.Float64, strict=False)
    blank = column.is_null() | (column == "") | (column.str.to_lowercase() == "nan")
    bad = (~blank & (numbers.is_null() | numbers.is_infinite())).arg_true()
    if len(bad):
        row = int(bad[0])
        raise InputError(
            f"'{path}' row {lines[row + 1][0]}, column '{label}': '{column[row]}' is not a number; "
            "correct it, or leave the cell blank if the sample is missing"
        )
    return numbers.fill_null(np.nan).to_numpy().copy()


def _factor(name: str, unit: str, label: str, u_max: float, path: Path) -> float:
    """Return the factor from the column's unit to SI; a command may also be in per cent of u_max."""
    if not unit:
        example = {"time": "time_s", "u": "u_V", "Q": "Q_Lmin"}.get(name, f"{name}_MPa")
        raise InputError(f"'{path}' column '{label}' has no unit; write for example {example}")
    try:
        if name == "u" and unit.lower() in ("%", "pct", "percent"):
            return u_max * si_factor(unit, "ratio")
        return si_factor(unit, QUANTITY_OF_COLUMN[name])
    except InputError as error:
        raise InputError(f"'{path}' column '{label}': {error}") from error
