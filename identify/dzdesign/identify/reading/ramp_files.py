"""Ramp files: a recorded table whose columns are a quantity and its unit; read into SI, or written.

A long recording is thinned: see `thin`.
"""

import gzip
import io
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import final

import numpy as np

from dzdesign.core.documents import open_bytes, sha256_of_file
from dzdesign.core.errors import InputError
from dzdesign.core.units import NUMBER
from dzdesign.identify.reading.binary_table import read_table
from dzdesign.identify.reading.channel_clocks import lay_on_one_clock, refuse_an_early_end
from dzdesign.identify.reading.clock import ASSUMED_MS, Clock, doubt_of_clock, never_back, read_clock, stamp_beside
from dzdesign.identify.reading.column_labels import PRESSURES, Column
from dzdesign.identify.reading.columns import find_columns
from dzdesign.identify.reading.metering_edge import metering_edge, side_without_dp
from dzdesign.identify.reading.missing_values import (
    Missing,
    describe_missing,
    without_failed_signals,
    without_placeholders,
)
from dzdesign.identify.reading.ramp_test import RampTest, thin
from dzdesign.identify.reading.scaling import Scaling, in_SI, scaling_of, units_of_columns
from dzdesign.identify.reading.table import Table

#: Fewest complete rows in which two branches with a threshold could stand.
MIN_ROWS = 20
#: First word of the first comment line of a recording that is none: whoever makes one up writes it there.
SIMULATED_MARK = "SIMULATED"
#: A comment line that says that this is not a measurement; a spreadsheet may have put it in quotes.
MARKED = re.compile(rf'^[ \t,;"]*#[ \t"]*{SIMULATED_MARK}\b', re.MULTILINE)


def read_ramp_file(
    path: Path,
    u_max: float = 10.0,
    *,
    columns: Mapping[str, str] | None = None,
    dp: float | None = None,
    sample_rate: float | None = None,
    skip_rows: int | None = None,
    missing: Collection[str] = (),
) -> RampTest:
    """Read one recording from a file.

    Parameters
    ----------
    path : Path
        CSV, TDMS, MAT, HDF5, Parquet or Feather: a table with labels such as ``time_s,u_V,dP_MPa,Q_Lmin`` (or
        ``u [V]``, ``u (V)``). In text, lines that start with ``#`` are comments, blank cells are
        missing samples. Pressures of ports may stand in place of ``dP``: see `metering_edge`.
    u_max : float
        Command in V that 100 % means, where the command is in percent.
    columns : mapping, optional
        Quantity -> label in the file, as `column_labels.parse_columns` gives it; it goes before what labels say.
    dp : float, optional
        Pressure drop in Pa of a file that has no column of it.
    sample_rate : float, optional
        Samples a second of a file that has no column of time.
    skip_rows : int, optional
        Lines above the header of a file of text. None: the header is found.
    missing : collection of str
        Texts and numbers that stand for no value, beside those that are known.

    Raises
    ------
    InputError
        Naming file, and row and column where there is one.
    """
    path = Path(path)
    with open_bytes(path, "ramp file") as file:
        sha256 = sha256_of_file(file)
        table = read_table(file, path, skip_rows, missing)
        no_numbers = [float(text) for each in missing if NUMBER.fullmatch(text := each.replace(",", "."))]
        return _ramp_test(table, sha256, columns or {}, u_max, dp, sample_rate, no_numbers)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class _Channels:
    """The columns of a recording as they were found and read."""

    #: Quantity -> samples in SI, NaN where one is missing.
    data: dict[str, np.ndarray]
    #: Quantity -> what turned them into SI, the time apart.
    scalings: dict[str, Scaling]
    #: Label -> what stood there for no value.
    missing: dict[str, Missing]
    #: The time; None where the sample rate is declared.
    clock: Clock | None


def _read_channels(table: Table, found: Mapping[str, Column], u_max: float, no_numbers: Sequence[float]) -> _Channels:
    data: dict[str, np.ndarray] = {}
    scalings: dict[str, Scaling] = {}
    missing: dict[str, Missing] = {}
    clock = None
    for quantity, column in found.items():
        if quantity == "time":
            clock = read_clock(table, column, u_max, no_numbers)
            data[quantity], missing[column.label] = clock.seconds, clock.missing
            continue
        for each in column.every:
            numbers, placeholders = without_placeholders(table.numbers(each.label), rises=False, declared=no_numbers)
            scaling = scaling_of(table.path, quantity, each, u_max)
            numbers, failed = without_failed_signals(numbers, scaling.no_signal_below)
            missing[each.label] = table.marked.get(each.label, Missing()) + placeholders + failed
            numbers = in_SI(table, quantity, each, numbers, scaling)
            data[quantity] = numbers if each is column else data[quantity] - numbers
            scalings.setdefault(quantity, scaling)
    return _Channels(data=data, scalings=scalings, missing=missing, clock=clock)


def _ramp_test(
    table: Table,
    sha256: str,
    chosen: Mapping[str, str],
    u_max: float,
    dp: float | None,
    sample_rate: float | None,
    no_numbers: Sequence[float],
) -> RampTest:
    """Return the rows of a file that lack nothing; of a long one thinned."""
    found = find_columns(table, chosen, sample_rate)
    _refuse_two_pressures(table, found, dp)
    _refuse_unequal_lengths(table, found)
    table.load([each.label for column in found.values() for each in column.every])
    channels = _read_channels(table, found, u_max, no_numbers)
    data, clock, scalings = channels.data, channels.clock, channels.scalings
    refuse_an_early_end(table, found, data)
    if clock:
        lay_on_one_clock(table, found, data, clock, u_max, time_is_chosen="time" in chosen)
    else:
        data["time"] = np.arange(data["u"].size) / (sample_rate or np.nan)
    edge, labels = metering_edge(found), {quantity: column.label for quantity, column in found.items()}
    measured = edge.drop(data, data["u"], u_max)
    if measured is None and dp is not None:
        measured = np.full(data["time"].size, dp)
    columns = [data["time"], data["u"], data["Q"], *([] if measured is None else [measured])]
    complete = np.logical_and.reduce([np.isfinite(column) for column in columns])
    rows = np.empty((len(columns), np.count_nonzero(complete)))
    for row, samples in zip(rows, columns, strict=True):
        row[:] = samples[complete]
    rows[0] = never_back(table, rows[0], complete)
    without_flow = data["u"][np.isfinite(data["u"]) & ~np.isfinite(data["Q"])]
    side_without = side_without_dp(edge, labels, table.path, data["u"], u_max)
    units = units_of_columns(table.path, found, scalings["u"], u_max)
    missing = describe_missing(channels.missing)
    if rows.shape[1] < MIN_ROWS:
        left_out = f"; {', '.join(missing.values())} are missing samples" if missing else ""
        raise InputError(
            f"'{table.path}' has {rows.shape[1]} complete rows, expected at least {MIN_ROWS} of a ramp test{left_out}"
        )
    thinned = thin(rows)
    time, u, q, *drop = (np.array(column) for column in thinned.rows)
    doubt = doubt_of_clock(table.path, clock, rows[0], time, u) if clock else ""
    in_ms = 1e3 if doubt == ASSUMED_MS else 1.0
    stamp = clock and (clock.stamp or stamp_beside(table, clock.label, clock.seconds / in_ms))
    return RampTest(
        source=table.path.name.encode(errors="replace").decode(),
        sha256=sha256,
        time=time / in_ms,
        u=u,
        q=q,
        dp=drop[0] if drop else None,
        dp_from=edge.columns(labels),
        side_without_dp=side_without,
        dp_is_declared=dp is not None,
        rows_read=rows.shape[1],
        run=thinned.run,
        clock_doubt=doubt,
        simulated=MARKED.search(table.comments) is not None,
        missing=missing,
        stamp=stamp,
        started=stamp.seconds if stamp else None,
        q_range=scalings["Q"].ends,
        unseen=(float(without_flow.min(initial=0.0)), float(without_flow.max(initial=0.0))),
        units=units,
        columns={quantity: found[quantity] for quantity in ("u", "Q")},
    )


def _refuse_two_pressures(table: Table, found: Mapping[str, Column], dp: float | None) -> None:
    """Refuse a declared pressure drop beside a recorded one: neither may silently stand in for the other."""
    recorded = next((found[name].label for name in PRESSURES if name in found), None)
    if dp is not None and recorded is not None:
        raise InputError(
            f"'{table.path}' has a column of the pressure drop ('{recorded}'), and --dp or [dp] declares it as "
            f"{dp / 1e6:g} MPa too; leave one of them out"
        )
    if dp is not None and not dp > 0:
        raise InputError(f"'{table.path}': the declared pressure drop is {dp / 1e6:g} MPa, expected a positive one")


def _refuse_unequal_lengths(table: Table, found: Mapping[str, Column]) -> None:
    """Refuse columns that are not samples of one clock, each of its own or the command's."""
    for column in [each for one in found.values() for each in one.every]:
        first = (column.clock or found["time" if "time" in found else "u"]).label
        expected = table.length(first)
        if table.length(column.label) != expected:
            raise InputError(
                f"'{table.path}' column '{column.label}' has {table.length(column.label)} samples, but "
                f"'{first}' has {expected}; expected one clock; export it with a time of its own"
            )


def ramp_file_bytes(columns: Mapping[str, np.ndarray], comments: tuple[str, ...], *, compress: bool) -> bytes:
    """Return the bytes of a ramp file: comment lines, header, rows with four decimals; gzip carries no date.

    Parameters
    ----------
    columns : mapping
        Label with unit, such as ``"u_V"``, to an (N,) array, of numbers or of texts.
    comments : tuple of str
        Lines without the leading ``#``.
    compress : bool
        Whether to gzip.
    """
    out = io.StringIO()
    for line in comments:
        out.write(f"# {line}\n")
    out.write(",".join(columns) + "\n")
    cells = [array if array.dtype.kind == "U" else np.char.mod("%.4f", array) for array in columns.values()]
    np.savetxt(out, np.column_stack(cells), fmt="%s", delimiter=",")
    data = out.getvalue().encode()
    return gzip.compress(data, mtime=0) if compress else data
