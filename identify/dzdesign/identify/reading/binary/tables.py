"""Tables of programs: TDMS, MAT, HDF5, Parquet, Feather; an open file in, `ArrayTable`s out.

Columns are read `BLOCK_ROWS` rows at a time, so a file may be larger than memory. Two can't: MAT before version 7.3 is
read whole, for its reader knows no parts; of TDMS a whole chunk is read, and a file that was defragmented is one.

Every reader's own errors become one sentence: a file that is cut off, or of a kind within its format that holds no
columns, is bad input like any other. The libraries run in a process of their own, see `separate_reader`: what finds the
columns here is called there.
"""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from math import prod
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.binary.column_streams import evenly_spaced, frame_columns, in_sequence, whole
from dzdesign.identify.reading.binary.reader_process import separate_columns
from dzdesign.identify.reading.table import ArrayTable, Samples

#: Rows that are read at a time: about a row group of Parquet.
BLOCK_ROWS = 1 << 18
#: Names of an attribute or property that holds a column's unit.
UNIT_PROPERTIES = ("unit_string", "unit", "units", "Unit", "Units", "NI_UnitDescription")
#: A matrix has at most this many columns, or rows: its longer side is time.
MOST_COLUMNS = 256
#: A column before its label is made unique: (group, name, unit, samples).
Found = tuple[str, str, str, Samples]
#: What finds the columns of an open file, whose name is for messages; what must stay open with it goes on the stack.
Finder = Callable[[BinaryIO, Path, ExitStack], Iterator[Found]]
#: A chunk of HDF5 is unpacked whole: one of more bytes is refused.
LARGEST_CHUNK = 1 << 26


def binary_reader(start: bytes, path: Path) -> Callable[[BinaryIO, Path], Iterator[ArrayTable]] | None:
    """Return the reader of a file, by its first bytes; None if it is none of these formats.

    Parameters
    ----------
    start : bytes
        The first twenty or more of the file.
    path : Path
        Its name decides for the one format without a mark: MAT before version 5.
    """
    for mark, name in (
        (b"MATLAB 7.3 MAT-file", "MATLAB 7.3"),
        (b"TDSm", "TDMS"),
        (b"\x89HDF\r\n\x1a\n", "HDF5"),
        (b"MATLAB", "MATLAB"),
        (b"PAR1", "Parquet"),
        (b"ARROW1", "Feather"),
    ):
        if start.startswith(mark):
            return _reader(name)
    return _reader("MATLAB") if path.suffix.lower() == ".mat" else None


def _reader(name: str) -> Callable[[BinaryIO, Path], Iterator[ArrayTable]]:
    """Return a function that reads a file of a format, a key of `FINDERS`."""

    def read(file: BinaryIO, path: Path) -> Iterator[ArrayTable]:
        with separate_columns(file, path, name) as found:
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


def _told_apart(found: list[Found], path: Path, name_of_format: str) -> dict[str, tuple[str, Samples]]:
    """Return label -> unit and samples; a name that two groups have is told apart by its group."""
    if not found:
        table = "; save a MATLAB table by s = table2struct(T, 'ToScalar', true); save(file, '-struct', 's')"
        hint = table if name_of_format == "MATLAB" else ""
        raise InputError(
            f"'{path}' ({name_of_format}) holds no columns of numbers; "
            f"expected one vector per quantity, such as u_V{hint}"
        )
    names = Counter(name for _, name, _, _ in found)
    unique = {
        (f"{group}/{name}" if group and names[name] > 1 else name): (unit, samples)
        for group, name, unit, samples in found
    }
    if len(unique) < len(found):
        twice = next(name for name, count in names.items() if count > 1)
        raise InputError(f"'{path}' ({name_of_format}) has two columns '{twice[:80]}'; keep one")
    return unique


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


def _tdms_columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[Found]:
    """Return the channels; a waveform channel brings a column of time."""
    from nptdms import TdmsFile

    tdms = stack.enter_context(TdmsFile.open(file))
    if tdms.file_status.incomplete_final_segment:
        raise InputError(
            f"'{path}' (TDMS) is cut off: its last segment is not whole; copy it again, or open it where it was "
            "recorded and save what is there"
        )
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


def _mat_columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[Found]:
    """Return the variables of a MAT file before 7.3, and the fields of its structs."""
    import warnings

    from scipy.io import loadmat
    from scipy.io.matlab import MatReadWarning

    with warnings.catch_warnings():
        warnings.simplefilter("error", MatReadWarning)  # of two variables with one name, the last would count
        variables = loadmat(file, squeeze_me=False, struct_as_record=True)
    for name, value in variables.items():
        if name.startswith("__") or not isinstance(value, np.ndarray):
            continue
        if value.dtype.names and value.size == 1:
            record = value.reshape(-1)[0]
            for field in value.dtype.names:
                yield from _vectors(name, field, "", np.asarray(record[field]))
        elif value.dtype.kind in "fiub":
            yield from _vectors("", name, "", value)


def _hdf5_columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[Found]:
    """Return the datasets, and the fields of compound ones; MATLAB 7.3 is HDF5 too, its texts and cells left aside.

    Links to other files are not followed.
    """
    import h5py

    found: list[Found] = []

    def visit(place: str, item: Any) -> None:
        if not isinstance(item, h5py.Dataset) or place.startswith("#") or item.size is None or item.size < 2:
            return
        if item.external or item.is_virtual:  # its hash would be that of another file than the samples'
            raise InputError(f"'{path}': the samples of '{place[:80]}' lie in another file; copy them into this one")
        if item.chunks and prod(item.chunks) * item.dtype.itemsize > LARGEST_CHUNK:
            raise InputError(
                f"'{path}': '{place[:80]}' is stored in chunks of more than {LARGEST_CHUNK >> 20} MiB; save it in "
                "smaller ones, or export it as CSV"
            )
        if item.attrs.get("MATLAB_class", b"double") in (b"char", b"cell", b"function_handle"):
            return
        group, _, name = place.rpartition("/")
        if item.dtype.names:
            for field in item.dtype.names:
                dtype = item.dtype[field]
                if item.ndim == 1 and dtype.shape == () and dtype.kind in "fiubSUO":
                    samples = Samples(dtype=dtype, size=item.size, read=_field(item, field))
                    found.append((place, field, "", samples))
                elif item.size * dtype.itemsize <= LARGEST_CHUNK:
                    found.extend(_vectors(place, field, "", item[field]))
        elif item.dtype.kind in "fiub":
            found.extend(_vectors(group, name, _unit(item.attrs), item))

    stack.enter_context(h5py.File(file, "r")).visititems(visit)
    return iter(found)


def _field(item: Any, field: str) -> Callable[[int, int], np.ndarray]:
    return lambda start, stop: item.fields(field)[start:stop]


def _parquet_columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[Found]:
    """Return the columns of a Parquet file."""
    import polars as pl

    return frame_columns(pl.scan_parquet(file))


def _feather_columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[Found]:
    """Return the columns of a Feather (Arrow IPC) file."""
    import polars as pl

    return frame_columns(pl.scan_ipc(file))


#: Format -> what finds its columns.
FINDERS: dict[str, Finder] = {
    "MATLAB 7.3": _hdf5_columns,
    "TDMS": _tdms_columns,
    "HDF5": _hdf5_columns,
    "MATLAB": _mat_columns,
    "Parquet": _parquet_columns,
    "Feather": _feather_columns,
}
