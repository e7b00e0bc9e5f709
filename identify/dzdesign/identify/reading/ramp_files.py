"""Ramp files: a recorded table whose columns are a quantity and its unit; read into SI, or written.

A long recording is thinned: see `thin`.
"""

import gzip
import io
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dzdesign.core.artefact_files import open_bytes, sha256_of_file
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import Quantity, Unit
from dzdesign.identify.reading.binary_table import LONGEST_MARK, format_of, read_binary_table
from dzdesign.identify.reading.channel_clocks import lay_on_one_clock, refuse_an_early_end
from dzdesign.identify.reading.clock import ASSUMED_MS, clock_doubt, may_count_ms, never_back, read_times_of_day
from dzdesign.identify.reading.column_labels import PRESSURES, QUANTITY_OF_COLUMN, Column
from dzdesign.identify.reading.columns import find_columns
from dzdesign.identify.reading.metering_edge import metering_edge, side_without_dp
from dzdesign.identify.reading.missing_values import (
    Missing,
    describe_missing,
    without_failed_signals,
    without_placeholders,
)
from dzdesign.identify.reading.ramp_test import RampTest, Switch, thin
from dzdesign.identify.reading.scaling import Scaling, scaling_of, units_of_columns
from dzdesign.identify.reading.table import AND, QUOTED_CHARACTERS, Table
from dzdesign.identify.reading.text_layout import read_text_table
from dzdesign.identify.reading.time_stamps import Start
from dzdesign.identify.valve.recorded_drop import DropColumns

#: Fewest complete rows in which two branches with a threshold could stand.
MIN_ROWS = 20
#: First word of the first comment line of a recording that is none: whoever makes one up writes it there.
SIMULATED_MARK = "SIMULATED"
#: A column of two values is looked for among so many, in so many rows, and changes so often at most.
MOST_SWITCHES, LONGEST_SWITCH, MOST_CHANGES = 8, 1_000_000, 200
#: Stands for the column of time where the sample rate is declared.
DECLARED_CLOCK = Column(label="--sample-rate", unit="s")
#: SI numbers beyond these are not a measurement of a valve: a wrong unit, or what a logger writes for an overflow.
LARGEST = {"time": 1e12, "voltage": 1e4, "pressure": 1e9, "flow": 10.0}


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
        recording = _read_recording(
            read_table(file, path, skip_rows, missing), columns or {}, u_max, dp, sample_rate, _numbers_among(missing)
        )
    _refuse_too_few_rows(path, recording)
    thinned = thin(recording.rows)
    time, u, q, *measured = (np.array(column) for column in thinned.rows)
    doubt = _doubt_of_clock(path, recording, time, u)
    return RampTest(
        source=path.name.encode(errors="replace").decode(),
        sha256=sha256,
        time=time / 1e3 if doubt == ASSUMED_MS else time,
        u=u,
        q=q,
        dp=measured[0] if measured else None,
        dp_from=recording.dp_from,
        side_without_dp=recording.side_without_dp,
        dp_is_declared=dp is not None,
        rows_read=recording.rows.shape[1],
        run=thinned.run,
        clock_doubt=doubt,
        simulated=recording.simulated,
        missing=recording.missing,
        stamp=recording.stamp,
        started=recording.stamp.seconds if recording.stamp else None,
        q_range=recording.q_range,
        unseen=recording.unseen,
        units=recording.units,
        switches=tuple(
            replace(each, changes=each.changes / (1e3 if doubt == ASSUMED_MS else 1.0)) for each in recording.switches
        ),
        columns=recording.columns,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Recording:
    """The complete rows of a file: time, command, flow and, if it is known, pressure drop (3 or 4, N).

    `clock` is the column of time, which may count milliseconds if `may_count_ms` says so; the rest is of `RampTest`.
    """

    rows: np.ndarray
    clock: Column
    simulated: bool
    may_count_ms: bool
    missing: Mapping[str, str]
    stamp: Start | None
    dp_from: tuple[tuple[DropColumns, ...], tuple[DropColumns, ...]]
    side_without_dp: str
    units: Mapping[Quantity, tuple[Unit, ...]]
    q_range: tuple[float, float] | None
    unseen: tuple[float, float]
    switches: tuple[Switch, ...]
    columns: Mapping[str, Column]


def _doubt_of_clock(path: Path, recording: _Recording, time: np.ndarray, u: np.ndarray) -> str:
    """Return what is doubtful about the unit of the time, as `clock_doubt` does; refuse one that nobody knows."""
    clock = recording.clock
    doubt = clock_doubt(time, u, unit_stated=bool(clock.unit)) if recording.may_count_ms else ""
    if not clock.unit and doubt != ASSUMED_MS:
        scaling_of(path, "time", clock, u_max=1.0)  # says that it lacks one
    return doubt


def _refuse_too_few_rows(path: Path, recording: _Recording) -> None:
    rows = recording.rows.shape[1]
    if rows < MIN_ROWS:
        found = ", ".join(recording.missing.values())
        missing = f"; {found} are missing samples" if found else ""
        raise InputError(f"'{path}' has {rows} complete rows, expected at least {MIN_ROWS} of a ramp test{missing}")


def _is_marked(comments: str) -> bool:
    """Tell whether a comment line says that this is not a measurement; a spreadsheet may have put it in quotes."""
    return re.search(rf'^[ \t,;"]*#[ \t"]*{SIMULATED_MARK}\b', comments, re.MULTILINE) is not None


def _numbers_among(missing: Collection[str]) -> list[float]:
    """Return those of some texts that are numbers."""
    numbers = []
    for text in missing:
        with suppress(ValueError):
            numbers.append(float(text.replace(",", ".")))
    return numbers


def read_table(
    file: BinaryIO, path: Path, skip_rows: int | None = None, missing: Collection[str] = ()
) -> Table:
    """Read a table of any known format; its first bytes tell which, not its name.

    Raises
    ------
    InputError
        If it is none of these, or not a whole one.
    """
    start = file.read(LONGEST_MARK)
    file.seek(0)
    kind = format_of(start, path)
    return read_binary_table(file, path, kind) if kind else read_text_table(file, path, skip_rows, missing)


def _read_recording(
    table: Table,
    chosen: Mapping[str, str],
    u_max: float,
    dp: float | None,
    sample_rate: float | None,
    no_numbers: Sequence[float],
) -> _Recording:
    """Return the rows of a file that lack nothing."""
    found = find_columns(table, chosen, sample_rate)
    _refuse_two_pressures(table, found, dp)
    _refuse_unequal_lengths(table, found)
    table.load([each.label for column in found.values() for each in column.every])
    data: dict[str, np.ndarray] = {}
    missing: dict[str, Missing] = {}
    q_range = None
    is_clock = sample_rate is None and table.is_clock(found["time"].label)
    stamp = table.started(found["time"].label) if sample_rate is None and not is_clock else None
    for quantity, column in found.items():
        if quantity == "time" and is_clock:
            data[quantity], stamp = read_times_of_day(table, column.label)
            missing[column.label] = table.marked.get(column.label, Missing())
            continue
        for each in column.every:
            numbers, found_numbers = without_placeholders(
                table.numbers(each.label), rises=quantity == "time", declared=no_numbers
            )
            missing[each.label] = table.marked.get(each.label, Missing()) + found_numbers
            unclear = quantity == "time" and not each.unit and may_count_ms(numbers)
            if not unclear:  # else the whole recording tells later what they count
                scaling = scaling_of(table.path, quantity, each, u_max)
                numbers, failed = without_failed_signals(numbers, scaling.no_signal_below)
                missing[each.label] += failed
                numbers = _in_SI(table, quantity, each, numbers, scaling)
                q_range = scaling.ends if quantity == "Q" else q_range
            data[quantity] = numbers if each is column else data[quantity] - numbers
    refuse_an_early_end(table, found, data)
    lay_on_one_clock(table, found, data, u_max, time_is_chosen="time" in chosen)
    if sample_rate is not None:
        data["time"] = np.arange(data["u"].size) / sample_rate
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
    return _Recording(
        rows=rows,
        clock=found.get("time", DECLARED_CLOCK),
        simulated=_is_marked(table.comments),
        may_count_ms=sample_rate is None and not is_clock and may_count_ms(rows[0], longest_step=np.inf),
        missing=describe_missing(missing),
        stamp=stamp,
        dp_from=edge.columns(labels),
        side_without_dp=side_without_dp(edge, labels, table.path, data["u"], u_max),
        units=units_of_columns(table.path, found, u_max),
        q_range=q_range,
        unseen=(float(without_flow.min(initial=0.0)), float(without_flow.max(initial=0.0))),
        switches=tuple(_switches(table, found, rows[0], complete)),
        columns={quantity: found[quantity] for quantity in ("u", "Q")},
    )


def _switches(table: Table, found: Mapping[str, Column], time: np.ndarray, complete: np.ndarray) -> Iterator[Switch]:
    """Yield the columns of two values beside those that were read, of a table that has few others."""
    taken = {label for column in found.values() for each in column.every for label in each.label.split(AND)}
    others = [label for label in table.labels if label and label not in taken]
    if len(others) > MOST_SWITCHES or not 0 < time.size <= LONGEST_SWITCH:
        return
    for label in others:
        with suppress(InputError):
            two = table.two_values(label) if table.length(label) == complete.size else None
            changes = np.flatnonzero(np.diff(two[1][complete])) + 1 if two else np.empty(0, dtype=int)
            if two and 0 < changes.size <= MOST_CHANGES:
                values = two[0][::-1] if two[1][complete][0] else two[0]
                yield Switch(label=table.in_file(label), values=values, changes=time[changes])


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


def _in_SI(table: Table, quantity: str, column: Column, numbers: np.ndarray, scaling: Scaling) -> np.ndarray:
    """Return one column in SI, NaN where a sample is missing; refuse what no valve gives."""
    with np.errstate(over="ignore", invalid="ignore"):  # an infinity is refused below
        numbers = numbers * scaling.gain
        numbers += scaling.offset
    largest = LARGEST[QUANTITY_OF_COLUMN[quantity]]
    if np.fmax.reduce(numbers, initial=0.0) > largest or np.fmin.reduce(numbers, initial=0.0) < -largest:
        row = int(np.flatnonzero(np.abs(numbers) > largest)[0])
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
