"""What a module of `formats` declares: how a file format is recognised, and what finds the columns of such a file."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, final

import numpy as np

#: Names of an attribute or property that holds a column's unit.
UNIT_PROPERTIES = ("unit_string", "unit", "units", "Unit", "Units", "NI_UnitDescription")
#: Date before which no logger wrote a file: where a clock is not known, programs write the beginning of their calendar.
FIRST_LOGGER = np.datetime64("1980-01-02", "us")
#: A matrix has at most this many columns, or rows: its longer side is time.
MOST_COLUMNS = 256
#: Stands for the unit of what a file holds beside its columns, and can't be read, such as a table of MATLAB.
NO_NUMBERS_UNIT = "no numbers"
#: Kinds of NumPy's types that are columns: numbers, texts, objects and times; and those of them that are numbers.
COLUMN_KINDS, NUMBER_KINDS = "fiubSUOMm", "fiub"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class FileColumn:
    """A column of a file, not read yet."""

    name: str
    #: Kind of NumPy's type: one of `NUMBER_KINDS` for numbers.
    kind: str
    #: Samples.
    size: int
    #: Returns all samples, (size,).
    read: Callable[[], np.ndarray]
    #: As the file states them, or "". Two columns may have one name in different groups.
    group: str = ""
    unit: str = ""
    #: Of a column of time: date and time at which it counts zero, as `stamp_of` writes it; or "".
    start: str = ""
    #: Number of the column of time of this one among all of the file, where the file states it; else -1.
    clock: int = -1


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class FileFormat:
    """A file format."""

    #: For messages.
    name: str
    #: Yields the columns of an open file, whose path is for messages; what must stay open with the file goes on the
    #: stack. Any exception means that the file is not a whole one of this format; an `InputError` says it in a sentence
    #: of its own. It runs in a process of its own.
    columns: Callable[[BinaryIO, Path, ExitStack], Iterator[FileColumn]]
    #: First bytes of such a file.
    mark: bytes = b""
    #: Of the file's name, lower case, for a format without a mark.
    suffix: str = ""
    #: What to do about a file that holds no columns of numbers, or other things too, as the rest of a sentence.
    hint: str = ""


def stamp_of(moment: Any, zone: str) -> str:
    """Return a NumPy date and time as text with its zone, which may lack; empty where it is none a logger writes.

    Examples
    --------
    >>> stamp_of(np.datetime64("2026-11-22T03:04:05.5"), "Z"), stamp_of(np.datetime64("1904-01-01T00:00:00"), "Z")
    ('2026-11-22T03:04:05.500000Z', '')
    """
    moment = np.datetime64(moment, "us")
    return "" if np.isnat(moment) or moment < FIRST_LOGGER else f"{moment}{zone}"


def unit_among(properties: Mapping[str, object], names: Sequence[str] = UNIT_PROPERTIES) -> str:
    """Return the unit, or the text of other `names`, among a column's properties, or an empty string."""
    for name in names:
        value = properties.get(name)
        if isinstance(value, bytes | str | np.ndarray) and np.size(value) == 1:
            value = np.asarray(value).item()
            return (value.decode(errors="replace") if isinstance(value, bytes) else str(value)).strip()
    return ""


def columns_of_array(array: Any, name: str, group: str = "", unit: str = "") -> Iterator[FileColumn]:
    """Yield the columns of an array or HDF5 dataset: one of a vector, ``name(:,2)`` and so on of a matrix.

    The longer side of a matrix is time.

    `array` has NumPy's ``dtype``, ``shape`` and slices.
    """
    if array.dtype.kind not in COLUMN_KINDS or array.ndim > 2 or array.size < 2:
        return
    if array.ndim == 1:
        yield _slice_of(array, slice(None), name, group, unit)
        return
    across = array.shape[0] < array.shape[1]
    for index in range(min(array.shape) if min(array.shape) <= MOST_COLUMNS else 0):
        place = (index, slice(None)) if across else (slice(None), index)
        yield _slice_of(array, place, name if min(array.shape) == 1 else f"{name}(:,{index + 1})", group, unit)


def _slice_of(array: Any, place: Any, name: str, group: str, unit: str) -> FileColumn:
    return FileColumn(
        name=name, kind=array.dtype.kind, size=max(array.shape), read=lambda: np.asarray(array[place]), group=group,
        unit=unit,
    )  # fmt: skip
