"""Tables of programs: TDMS, MAT, HDF5, Parquet, Feather; an open file in, `ArrayTable`s out.

Columns are read `BLOCK_ROWS` rows at a time, so a file may be larger than memory. Two can't: MAT before version 7.3 is
read whole, for its reader knows no parts; of TDMS a whole chunk is read, and a file that was defragmented is one.

Every reader's own errors become one sentence: a file that is cut off, or of a kind within its format that holds no
columns, is bad input like any other. The libraries are imported where they are needed: a CSV costs none of them.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.column_streams import evenly_spaced, frame_columns, in_sequence, whole
from dzdesign.identify.table import ArrayTable, Samples, unreadable

#: Rows that are read at a time: about a row group of Parquet.
BLOCK_ROWS = 1 << 18
#: Names of an attribute or property that holds a column's unit.
UNIT_PROPERTIES = ("unit_string", "unit", "units", "Unit", "Units", "NI_UnitDescription")
#: A matrix has at most this many columns, or rows: its longer side is time.
MOST_COLUMNS = 256
#: A column before its label is made unique: (group, name, unit, samples).
Found = tuple[str, str, str, Samples]
#: What finds the columns of an open file; what must stay open with it goes on the stack.
Finder = Callable[[BinaryIO, ExitStack], Iterator[Found]]


def binary_reader(start: bytes, path: Path) -> Callable[[BinaryIO, Path], Iterator[ArrayTable]] | None:
    """Return the reader of a file, by its first bytes; None if it is none of these formats.

    Parameters
    ----------
    start : bytes
        The first twenty or more of the file.
    path : Path
        Its name decides for the one format without a mark: MAT before version 5.
    """
    if start[:19] == b"MATLAB 7.3 MAT-file":
        return _reader("MATLAB 7.3", _hdf5_columns)
    for mark, name, columns in (
        (b"TDSm", "TDMS", _tdms_columns),
        (b"\x89HDF\r\n\x1a\n", "HDF5", _hdf5_columns),
        (b"MATLAB", "MATLAB", _mat_columns),
        (b"PAR1", "Parquet", _parquet_columns),
        (b"ARROW1", "Feather", _feather_columns),
    ):
        if start.startswith(mark):
            return _reader(name, columns)
    return _reader("MATLAB", _mat_columns) if path.suffix.lower() == ".mat" else None


def _reader(name: str, columns: Finder) -> Callable[[BinaryIO, Path], Iterator[ArrayTable]]:
    """Return a function that reads a file by `columns`, whose errors become one sentence."""

    def read(file: BinaryIO, path: Path) -> Iterator[ArrayTable]:
        with ExitStack() as stack:
            try:
                found = list(columns(file, stack))
            except Exception as error:  # each library raises kinds of its own; all mean "no whole file of this format"
                raise unreadable(path, name, error) from error
            unique = _told_apart(found, path, name)
            rows = max(samples.size for _, samples in unique.values())
            for start in range(0, rows, BLOCK_ROWS):
                yield ArrayTable(
                    path=path,
                    labels=tuple(unique),
                    units={label: unit for label, (unit, _) in unique.items() if unit},
                    columns={label: samples for label, (_, samples) in unique.items()},
                    start=start,
                    stop=min(start + BLOCK_ROWS, rows),
                    format=name,
                )

    return read


def _told_apart(found: list[Found], path: Path, name: str) -> dict[str, tuple[str, Samples]]:
    """Return label -> unit and samples; a name that two groups have is told apart by its group."""
    if not found:
        table = "; save a MATLAB table by s = table2struct(T, 'ToScalar', true); save(file, '-struct', 's')"
        hint = table if name == "MATLAB" else ""
        raise InputError(
            f"'{path}' ({name}) holds no columns of numbers; expected one vector per quantity, such as u_V{hint}"
        )
    names = [name for _, name, _, _ in found]
    return {
        (f"{group}/{name}" if group and names.count(name) > 1 else name): (unit, samples)
        for group, name, unit, samples in found
    }


def _unit(properties: Any) -> str:
    """Return the unit among a column's properties, or an empty string."""
    for name in UNIT_PROPERTIES:
        value = properties.get(name)
        if isinstance(value, bytes | str | np.ndarray) and np.size(value) == 1:
            value = np.asarray(value).item()
            return (value.decode(errors="replace") if isinstance(value, bytes) else str(value)).strip()
    return ""


def _vectors(group: str, name: str, unit: str, array: Any) -> Iterator[Found]:
    """Return the columns of an array or HDF5 dataset: one of a vector, ``name(:,2)`` and so on of a matrix.

    The longer side of a matrix is time.
    """
    if array.dtype.kind not in "fiubSUOMm" or array.ndim > 2 or array.size < 2:
        return
    if array.ndim == 1:
        yield group, name, unit, whole(array)
        return
    across = array.shape[0] < array.shape[1]
    if min(array.shape) == 1:
        yield group, name, unit, _line(array, 0, across)
    elif min(array.shape) <= MOST_COLUMNS:
        for index in range(min(array.shape)):
            yield group, f"{name}(:,{index + 1})", unit, _line(array, index, across)


def _line(array: Any, index: int, across: bool) -> Samples:
    """Return a row (`across`) or a column of a matrix."""
    if across:
        return Samples(dtype=array.dtype, size=array.shape[1], read=lambda start, stop: array[index, start:stop])
    return Samples(dtype=array.dtype, size=array.shape[0], read=lambda start, stop: array[start:stop, index])


def _tdms_columns(file: BinaryIO, stack: ExitStack) -> Iterator[Found]:
    """Return the channels; a waveform channel brings a column of time."""
    from nptdms import TdmsFile

    tdms = stack.enter_context(TdmsFile.open(file))
    timed = False
    for group in tdms.groups():
        for channel in group.channels():
            if channel.dtype.kind == "M":
                yield group.name, channel.name, "s", _seconds(channel)
                continue
            if channel.dtype.kind in "fiubSUO" and len(channel) >= 2:
                yield group.name, channel.name, _unit(channel.properties), _channel(channel)
            step = channel.properties.get("wf_increment")
            if step and len(channel) and not timed:
                timed = True
                offset = channel.properties.get("wf_start_offset", 0.0)
                yield group.name, "time_s", "s", evenly_spaced(offset, step, len(channel))


def _channel(channel: Any) -> Samples:
    return in_sequence(channel.dtype, len(channel), lambda: (chunk[:] for chunk in channel.data_chunks()))


def _seconds(channel: Any) -> Samples:
    """Return a channel of dates as seconds since its first."""
    dates = _channel(channel)

    def read(start: int, stop: int) -> np.ndarray:
        return (dates.read(start, stop) - channel[0]) / np.timedelta64(1, "s") if stop > start else np.empty(0)

    return Samples(dtype=np.dtype(float), size=dates.size, read=read)


def _mat_columns(file: BinaryIO, stack: ExitStack) -> Iterator[Found]:
    """Return the variables of a MAT file before 7.3, and the fields of its structs."""
    from scipy.io import loadmat

    for name, value in loadmat(file, squeeze_me=False, struct_as_record=True).items():
        if name.startswith("__") or not isinstance(value, np.ndarray):
            continue
        if value.dtype.names and value.size == 1:
            record = value.reshape(-1)[0]
            for field in value.dtype.names:
                yield from _vectors(name, field, "", np.asarray(record[field]))
        elif value.dtype.kind in "fiub":
            yield from _vectors("", name, "", value)


def _hdf5_columns(file: BinaryIO, stack: ExitStack) -> Iterator[Found]:
    """Return the datasets, and the fields of compound ones; MATLAB 7.3 is HDF5 too, its texts and cells left aside."""
    import h5py

    found: list[Found] = []

    def visit(path: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or path.startswith("#") or item.size is None or item.size < 2:
            return
        if item.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"function_handle"):
            return
        group, _, name = path.rpartition("/")
        if item.dtype.names:
            for field in item.dtype.names:
                dtype = item.dtype[field]
                if item.ndim == 1 and dtype.shape == () and dtype.kind in "fiub":
                    samples = Samples(dtype=dtype, size=item.size, read=_field(item, field))
                    found.append((path, field, "", samples))
                else:
                    found.extend(_vectors(path, field, "", item[field]))
        elif item.dtype.kind in "fiub":
            found.extend(_vectors(group, name, _unit(item.attrs), item))

    stack.enter_context(h5py.File(file, "r")).visititems(visit)
    return iter(found)


def _field(item: Any, field: str) -> Callable[[int, int], np.ndarray]:
    return lambda start, stop: item.fields(field)[start:stop]


def _parquet_columns(file: BinaryIO, stack: ExitStack) -> Iterator[Found]:
    """Return the columns of a Parquet file."""
    import polars as pl

    return frame_columns(pl.scan_parquet(file))


def _feather_columns(file: BinaryIO, stack: ExitStack) -> Iterator[Found]:
    """Return the columns of a Feather (Arrow IPC) file."""
    import polars as pl

    return frame_columns(pl.scan_ipc(file))
