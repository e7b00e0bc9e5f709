"""Ramp files: a recorded table whose columns are a quantity and its unit; read into SI, or written.

A file is read block by block, and a long one thinned on the way: see `thinning`.
"""

import gzip
import io
import re
from collections.abc import Generator, Mapping
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dzdesign.core.artefact_files import open_bytes, sha256_of_file
from dzdesign.core.errors import InputError
from dzdesign.identify.reading.binary.tables import binary_reader
from dzdesign.identify.reading.clock import ASSUMED_MS, Clock
from dzdesign.identify.reading.column_labels import QUANTITY_OF_COLUMN, Column, find_columns
from dzdesign.identify.reading.missing_values import NoValues
from dzdesign.identify.reading.scaling import scaling_of
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, Table
from dzdesign.identify.reading.text.tables import text_tables
from dzdesign.identify.reading.thinning import Thinner

#: Fewest complete rows in which two branches with a threshold could stand.
MIN_ROWS = 20
#: First word of the first comment line of a recording that is none: whoever makes one up writes it there.
SIMULATED_MARK = "SIMULATED"
#: SI numbers beyond these are no measurement of a valve: a wrong unit, or what a logger writes for an overflow.
LARGEST = {"time": 1e12, "voltage": 1e4, "pressure": 1e9, "flow": 10.0}


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
        Pressure drop in Pa, or None if it is unknown.
    dp_is_declared : bool
        True if the pressure drop is the engineer's word (one constant) and not a recording.
    rows_read, run : int
        Complete rows in the file, and how many of them in a row were averaged to one sample (1: none were).
    clock_doubt : str
        What is doubtful about the unit of the time, as `Clock.doubt` gives it.
    simulated : bool
        True if a comment line above the labels begins with `SIMULATED_MARK`.
    no_values : str
        Numbers that were taken for missing samples, as `NoValues.said` gives them.
    """

    source: str
    sha256: str
    time: np.ndarray
    u: np.ndarray
    q: np.ndarray
    dp: np.ndarray | None
    dp_is_declared: bool = False
    rows_read: int = 0
    run: int = 1
    clock_doubt: str = ""
    simulated: bool = False
    no_values: str = ""

    def __post_init__(self) -> None:
        for array in (self.time, self.u, self.q, self.dp):
            if array is None:
                continue
            if array.shape != self.time.shape or array.ndim != 1:
                raise ValueError("the columns of a ramp test are vectors of one length")
            array.flags.writeable = False


def read_ramp_file(
    path: Path,
    u_max: float = 10.0,
    *,
    columns: Mapping[str, str] | None = None,
    dp: float | None = None,
    skip_rows: int | None = None,
) -> RampTest:
    """Read one recording from a file.

    Parameters
    ----------
    path : Path
        CSV, TDMS, MAT, HDF5, Parquet or Feather: a table with labels such as ``time_s,u_V,dP_MPa,Q_Lmin`` (or
        ``u [V]``, ``u (V)``). In text, lines that start with ``#`` are comments, blank cells are
        missing samples. ``pA`` and ``pB`` may stand in place of ``dP``.
    u_max : float
        Command in V that 100 % means, where the command is in per cent.
    columns : mapping, optional
        Quantity -> label in the file, as `column_labels.parse_columns` gives it; it goes before what labels say.
    dp : float, optional
        Pressure drop in Pa of a file that has no column of it.
    skip_rows : int, optional
        Lines above the header of a file of text. None: the header is found.

    Raises
    ------
    InputError
        Naming file, and row and column where there is one.
    """
    path = Path(path)
    thinner, clock, no_values = Thinner(u_max), Clock(), NoValues()
    found: dict[str, Column] = {}
    simulated = False
    with open_bytes(path, "ramp file") as file:
        sha256 = sha256_of_file(file)
        with closing(read_tables(file, path, skip_rows)) as tables:
            for table in tables:
                if not found:
                    found = find_columns(table, columns or {})
                    simulated = _is_marked(table.comments)
                    _refuse_two_pressures(table, found, dp)
                    _refuse_unequal_lengths(table, found)
                thinner.add(_complete_rows(table, found, clock, no_values, u_max, dp))
    _refuse_too_few_rows(path, thinner.read, no_values)
    time, u, q, *measured = (column.copy() for column in thinner.rows())
    doubt = clock.doubt(time, u)
    if doubt == ASSUMED_MS:
        time /= 1e3
    elif not found["time"].unit:
        scaling_of(path, "time", found["time"], u_max)  # says that it lacks one
    return RampTest(
        source=path.name.encode(errors="replace").decode(),
        sha256=sha256,
        time=time,
        u=u,
        q=q,
        dp=measured[0] if measured else None,
        dp_is_declared=dp is not None,
        rows_read=thinner.read,
        run=thinner.run,
        clock_doubt=doubt,
        simulated=simulated,
        no_values=no_values.said(),
    )


def _refuse_too_few_rows(path: Path, rows: int, no_values: NoValues) -> None:
    if rows < MIN_ROWS:
        missing = f"; {no_values.said()} are missing samples" if no_values.said() else ""
        raise InputError(f"'{path}' has {rows} complete rows, expected at least {MIN_ROWS} of a ramp test{missing}")


def _is_marked(comments: str) -> bool:
    """Tell whether a comment line says that this is no measurement; a spreadsheet may have put it in quotes."""
    return re.search(rf'^[ \t,;"]*#[ \t"]*{SIMULATED_MARK}\b', comments, re.MULTILINE) is not None


def read_tables(file: BinaryIO, path: Path, skip_rows: int | None = None) -> Generator[Table, None, None]:
    """Read a table of any known format, block by block; its first bytes tell which, not its name.

    Parameters
    ----------
    file : binary file
        CSV (plain or gzip), TDMS, MAT, HDF5, Parquet or Feather.
    path : Path
        For messages.
    skip_rows : int, optional
        Of `text_tables`.

    Raises
    ------
    InputError
        If it is none of these, or not a whole one.
    """
    start = file.read(32)
    file.seek(0)
    read = binary_reader(start, path)
    return read(file, path) if read else text_tables(file, path, skip_rows)


def _complete_rows(
    table: Table, found: Mapping[str, Column], clock: Clock, no_values: NoValues, u_max: float, dp: float | None
) -> np.ndarray:
    """Return time, command, flow and, if it is known, pressure drop of the rows of a block that lack none of them."""
    data = {
        quantity: _si_numbers(table, quantity, column, clock, no_values, u_max) for quantity, column in found.items()
    }
    measured = data["dP"] if "dP" in data else data["pA"] - data["pB"] if "pA" in data else None
    if measured is None and dp is not None:
        measured = np.full(data["time"].size, dp)
    rows = np.stack([data["time"], data["u"], data["Q"], *([] if measured is None else [measured])])
    complete = np.isfinite(rows).all(axis=0)
    rows = rows[:, complete]
    rows[0] = clock.steady(table, rows[0], complete)
    return rows


def _refuse_two_pressures(table: Table, found: Mapping[str, Column], dp: float | None) -> None:
    """Refuse a declared pressure drop beside a recorded one: neither may silently stand in for the other."""
    recorded = next((found[name].label for name in ("dP", "pA") if name in found), None)
    if dp is not None and recorded is not None:
        raise InputError(
            f"'{table.path}' has a column of the pressure drop ('{recorded}'), and --dp or [dp] declares it as "
            f"{dp / 1e6:g} MPa too; leave one of them out"
        )
    if dp is not None and not dp > 0:
        raise InputError(f"'{table.path}': the declared pressure drop is {dp / 1e6:g} MPa, expected a positive one")


def _refuse_unequal_lengths(table: Table, found: Mapping[str, Column]) -> None:
    """Refuse columns that are not samples of one clock."""
    expected = table.length(found["time"].label)
    for column in found.values():
        if table.length(column.label) != expected:
            raise InputError(
                f"'{table.path}' column '{column.label}' has {table.length(column.label)} samples, but "
                f"'{found['time'].label}' has {expected}; expected one clock, so resample it before"
            )


def _si_numbers(
    table: Table, quantity: str, column: Column, clock: Clock, no_values: NoValues, u_max: float
) -> np.ndarray:
    """Return one column in SI, NaN where a sample is missing; refuse what no valve gives."""
    if quantity == "time":
        seconds = clock.stamps(table, column)
        if seconds is not None:
            return seconds
    numbers = no_values.without(table.numbers(column.label), column.label, rises=quantity == "time")
    if quantity == "time" and not column.unit and clock.may_be_ms(numbers):
        return numbers  # until the whole of it tells
    scaling = scaling_of(table.path, quantity, column, u_max)
    with np.errstate(over="ignore", invalid="ignore"):  # an infinity is refused below
        numbers = numbers * scaling.gain + scaling.offset
    far = np.flatnonzero(np.abs(numbers) > LARGEST[QUANTITY_OF_COLUMN[quantity]])
    if far.size:
        row = int(far[0])
        raise InputError(
            f"'{table.path}' {table.place(row)}, column '{column.label}': "
            f"'{table.cell(column.label, row)[:QUOTED_CHARACTERS]}' is no measurement of a valve in that unit; "
            "correct it, or leave the cell blank if the sample is missing"
        )
    return numbers


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
