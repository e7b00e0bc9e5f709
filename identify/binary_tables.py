"""Tables of programs: TDMS, MAT, HDF5, Parquet, Feather; bytes in, an `ArrayTable` out.

Every reader's own errors become one sentence: a file that is cut off, or of a kind within its format that holds no
columns, is bad input like any other. The libraries are imported where they are needed: a CSV costs none of them.
"""

import io
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.table import ArrayTable

#: Names of an attribute or property that holds a column's unit.
UNIT_PROPERTIES = ("unit_string", "unit", "units", "Unit", "Units", "NI_UnitDescription")
#: A matrix has at most this many columns, or rows: its longer side is time.
MOST_COLUMNS = 256
#: A column before its label is made unique: (group, name, unit, samples).
Found = tuple[str, str, str, np.ndarray]


def binary_reader(content: bytes, path: Path) -> Callable[[bytes, Path], ArrayTable] | None:
    """Return the reader of a file, by its first bytes; None if it is none of these formats.

    Parameters
    ----------
    content : bytes
        Of the file.
    path : Path
        Its name decides for the one format without a mark: MAT before version 5.
    """
    if content[:19] == b"MATLAB 7.3 MAT-file":
        return _reader("MATLAB 7.3", _hdf5_columns)
    for mark, name, columns in (
        (b"TDSm", "TDMS", _tdms_columns),
        (b"\x89HDF\r\n\x1a\n", "HDF5", _hdf5_columns),
        (b"MATLAB", "MATLAB", _mat_columns),
        (b"PAR1", "Parquet", _parquet_columns),
        (b"ARROW1", "Feather", _feather_columns),
    ):
        if content.startswith(mark):
            return _reader(name, columns)
    return _reader("MATLAB", _mat_columns) if path.suffix.lower() == ".mat" else None


def _reader(name: str, columns: Callable[[bytes], Iterator[Found]]) -> Callable[[bytes, Path], ArrayTable]:
    """Return a function that reads a file by `columns`, whose errors become one sentence."""

    def read(content: bytes, path: Path) -> ArrayTable:
        try:
            found = list(columns(content))
        except Exception as error:  # each library raises kinds of its own; all mean "not a whole file of this format"
            reason = str(error).splitlines()[0] if str(error) else type(error).__name__
            raise InputError(
                f"'{path}' is not a {name} file that can be read ({reason}); save it again, or export it as CSV"
            ) from error
        if not found:
            table = "; save a MATLAB table by s = table2struct(T, 'ToScalar', true); save(file, '-struct', 's')"
            hint = table if name == "MATLAB" else ""
            raise InputError(
                f"'{path}' ({name}) holds no columns of numbers; expected one vector per quantity, such as u_V{hint}"
            )
        names = [name for _, name, _, _ in found]
        unique = {  # a name that two groups have is told apart by its group
            (f"{group}/{name}" if group and names.count(name) > 1 else name): (unit, array)
            for group, name, unit, array in found
        }
        return ArrayTable(
            path=path,
            labels=tuple(unique),
            units={label: unit for label, (unit, _) in unique.items() if unit},
            arrays={label: array for label, (_, array) in unique.items()},
        )

    return read


def _unit(properties: Any) -> str:
    """Return the unit among a column's properties, or an empty string."""
    for name in UNIT_PROPERTIES:
        value = properties.get(name)
        if isinstance(value, bytes | str | np.ndarray) and np.size(value) == 1:
            value = np.asarray(value).item()
            return (value.decode(errors="replace") if isinstance(value, bytes) else str(value)).strip()
    return ""


def _vectors(group: str, name: str, unit: str, array: np.ndarray) -> Iterator[Found]:
    """Return an array's columns: one of a vector, ``name(:,2)`` and so on of a matrix whose longer side is time."""
    array = np.asarray(array)
    if array.dtype.kind not in "fiubSUOMm" or array.ndim > 2 or array.size < 2:
        return
    if array.ndim == 1 or 1 in array.shape:
        yield group, name, unit, array.ravel()
        return
    if min(array.shape) <= MOST_COLUMNS:
        for index, column in enumerate(array if array.shape[0] < array.shape[1] else array.T, start=1):
            yield group, f"{name}(:,{index})", unit, column


def _tdms_columns(content: bytes) -> Iterator[Found]:
    """Return the channels; a waveform channel brings a column of time."""
    from nptdms import TdmsFile

    file = TdmsFile.read(io.BytesIO(content))
    timed = False
    for group in file.groups():
        for channel in group.channels():
            data = channel[:]
            if data.dtype.kind == "M":
                data = (data - data[:1]) / np.timedelta64(1, "s")
                yield group.name, channel.name, "s", data
                continue
            yield from _vectors(group.name, channel.name, _unit(channel.properties), data)
            if channel.properties.get("wf_increment") and len(data) and not timed:
                timed = True
                yield group.name, "time_s", "s", channel.time_track()


def _mat_columns(content: bytes) -> Iterator[Found]:
    """Return the variables of a MAT file before 7.3, and the fields of its structs."""
    from scipy.io import loadmat

    for name, value in loadmat(io.BytesIO(content), squeeze_me=False, struct_as_record=True).items():
        if name.startswith("__") or not isinstance(value, np.ndarray):
            continue
        if value.dtype.names and value.size == 1:
            record = value.reshape(-1)[0]
            for field in value.dtype.names:
                yield from _vectors(name, field, "", record[field])
        elif value.dtype.kind in "fiub":
            yield from _vectors("", name, "", value)


def _hdf5_columns(content: bytes) -> Iterator[Found]:
    """Return the datasets, and the fields of compound ones; MATLAB 7.3 is HDF5 too, its texts and cells left aside."""
    import h5py

    found: list[Found] = []

    def visit(path: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or path.startswith("#") or item.size < 2:
            return
        if item.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"function_handle"):
            return
        group, _, name = path.rpartition("/")
        if item.dtype.names:
            for field in item.dtype.names:
                found.extend(_vectors(path, field, "", item[field]))
        elif item.dtype.kind in "fiub":
            found.extend(_vectors(group, name, _unit(item.attrs), item[()]))

    with h5py.File(io.BytesIO(content), "r") as file:
        file.visititems(visit)
    return iter(found)


def _parquet_columns(content: bytes) -> Iterator[Found]:
    """Return the columns of a Parquet file."""
    import polars as pl

    return _frame_columns(pl.read_parquet(io.BytesIO(content)))


def _feather_columns(content: bytes) -> Iterator[Found]:
    """Return the columns of a Feather (Arrow IPC) file."""
    import polars as pl

    return _frame_columns(pl.read_ipc(io.BytesIO(content)))


def _frame_columns(frame: Any) -> Iterator[Found]:
    """Return the columns of a data frame; a date becomes seconds since the first row."""
    for column in frame.iter_columns():
        if column.dtype.is_temporal():
            since = column - column[0] if str(column.dtype).startswith(("Date", "Datetime")) else column
            yield "", column.name, "s", since.dt.total_microseconds().cast(float).to_numpy() / 1e6
        elif column.dtype.is_numeric():
            yield "", column.name, "", column.cast(float).fill_null(float("nan")).to_numpy()
