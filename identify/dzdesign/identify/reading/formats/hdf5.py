"""HDF5: datasets, and the fields of compound ones; MATLAB 7.3 is HDF5 too, its texts and cells left aside.

A dataset of time says from when it counts by a unit of the CF conventions (netCDF), ``seconds since 2026-11-22
03:04:05``, UTC unless that says otherwise, or by an attribute ``start`` of the NeXus format, ISO 8601.
"""

import re
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from math import prod
from pathlib import Path
from typing import Any, BinaryIO

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.formats.file_format import (
    NUMBER_KINDS,
    FileColumn,
    FileFormat,
    columns_of_array,
    unit_among,
)
from dzdesign.identify.reading.time_stamps import is_stamp

#: A chunk is unpacked whole: one of more bytes is refused.
LARGEST_CHUNK = 1 << 26
#: Characters of a unit that are looked at.
LONGEST_UNIT = 80
#: A unit of time with the date and time from which it counts; what names a zone after it, and by how much it is off.
SINCE = re.compile(r"(\w+) since (.+?)(?:\s*(Z|UTC|[-+]\d\d:?\d\d))?", re.IGNORECASE)
#: Classes of MATLAB that hold no numbers.
NO_NUMBERS = (b"char", b"cell", b"function_handle")


def _columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[FileColumn]:
    """Yield the columns; links to other files are not followed."""
    import h5py

    found: list[FileColumn] = []

    def visit(place: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not place.startswith("#") and item.size is not None and item.size >= 2:
            _refuse_what_is_not_here(item, place, path)
            if item.attrs.get("MATLAB_class", b"double") not in NO_NUMBERS:
                found.extend(_columns_of_dataset(item, place))

    stack.enter_context(h5py.File(file, "r")).visititems(visit)
    return iter(found)


def _refuse_what_is_not_here(item: Any, place: str, path: Path) -> None:
    if item.external or item.is_virtual:  # its hash would be that of another file than the samples'
        raise InputError(f"'{path}': the samples of '{place[:80]}' lie in another file; copy them into this one")
    if item.chunks and prod(item.chunks) * item.dtype.itemsize > LARGEST_CHUNK:
        raise InputError(
            f"'{path}': '{place[:80]}' is stored in chunks of more than {LARGEST_CHUNK >> 20} MiB; save it in "
            "smaller ones, or export it as CSV"
        )


def _columns_of_dataset(item: Any, place: str) -> Iterator[FileColumn]:
    group, _, name = place.rpartition("/")
    if not item.dtype.names and item.dtype.kind in NUMBER_KINDS:
        unit, start = _unit_and_start(unit_among(item.attrs), unit_among(item.attrs, ("start",)))
        yield from (replace(column, start=start) for column in columns_of_array(item, name, group=group, unit=unit))
    for field in item.dtype.names or ():
        dtype = item.dtype[field]
        if item.ndim == 1 and dtype.shape == () and dtype.kind in "fiubSUO":
            read = partial(_field, item, field)
            yield FileColumn(group=place, name=field, kind=dtype.kind, size=item.size, read=read)
        elif item.size * dtype.itemsize <= LARGEST_CHUNK:
            yield from columns_of_array(item[field], field, group=place)


def _unit_and_start(unit: str, start: str) -> tuple[str, str]:
    """Return the unit of a dataset, and of one of time the date and time from which it counts; empty if unknown."""
    since = SINCE.fullmatch(unit[:LONGEST_UNIT])
    if since is None:
        return unit, start if is_stamp(start) else ""
    midnight = "" if ":" in since[2] else " 00:00:00"
    stamp = f"{since[2]}{midnight}{(since[3] or 'Z').upper()}"
    return since[1], stamp if is_stamp(stamp) else ""


def _field(item: Any, field: str) -> Any:
    return item.fields(field)[:]


FORMATS = (
    FileFormat(name="MATLAB 7.3", mark=b"MATLAB 7.3 MAT-file", columns=_columns),
    FileFormat(name="HDF5", mark=b"\x89HDF\r\n\x1a\n", columns=_columns),
)
