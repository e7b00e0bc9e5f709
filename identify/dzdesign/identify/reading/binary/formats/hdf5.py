"""HDF5: datasets, and the fields of compound ones; MATLAB 7.3 is HDF5 too, its texts and cells left aside."""

from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from math import prod
from pathlib import Path
from typing import Any, BinaryIO

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.binary.file_format import (
    NUMBER_KINDS,
    FileColumn,
    FileFormat,
    columns_of_array,
    unit_among,
)

#: A chunk is unpacked whole: one of more bytes is refused.
LARGEST_CHUNK = 1 << 26
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
        yield from columns_of_array(item, name, group=group, unit=unit_among(item.attrs))
    for field in item.dtype.names or ():
        dtype = item.dtype[field]
        if item.ndim == 1 and dtype.shape == () and dtype.kind in "fiubSUO":
            read = partial(_field, item, field)
            yield FileColumn(group=place, name=field, kind=dtype.kind, size=item.size, read=read)
        elif item.size * dtype.itemsize <= LARGEST_CHUNK:
            yield from columns_of_array(item[field], field, group=place)


def _field(item: Any, field: str) -> Any:
    return item.fields(field)[:]


FORMATS = (
    FileFormat(name="MATLAB 7.3", mark=b"MATLAB 7.3 MAT-file", columns=_columns),
    FileFormat(name="HDF5", mark=b"\x89HDF\r\n\x1a\n", columns=_columns),
)
