"""MAT files before version 7.3: variables, and the fields of structs within structs; version 7.3 is HDF5."""

from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dzdesign.identify.reading.formats.file_format import (
    MOST_COLUMNS,
    NO_NUMBERS_UNIT,
    NUMBER_KINDS,
    FileColumn,
    FileFormat,
    columns_of_array,
)

#: Structs are followed so deep: Simulink's "structure with time" has three levels, dSPACE's capture two.
DEEPEST = 4
#: Fields of a struct that name the signal which stands beside them, and those that hold it.
NAMES, SAMPLES = ("label", "Name", "name"), ("values", "Data", "data")


def _columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[FileColumn]:
    import warnings

    from scipy.io import loadmat
    from scipy.io.matlab import MatlabOpaque, MatReadWarning

    with warnings.catch_warnings():
        warnings.simplefilter("error", MatReadWarning)  # of two variables with one name, the last would count
        # Tables, dates and other objects have no name that SciPy knows, and it calls them all so.
        warnings.filterwarnings("ignore", 'Duplicate variable name "None"', MatReadWarning)
        variables = loadmat(file, squeeze_me=False, struct_as_record=True)
    found: list[FileColumn] = []
    objects: list[FileColumn] = []
    for name, value in variables.items():
        if isinstance(value, MatlabOpaque):
            title = value.reshape(-1)[0]["s0"].decode(errors="replace")
            read = partial(np.array, [title])
            objects.append(FileColumn(name=title, kind="O", unit=NO_NUMBERS_UNIT, size=1, read=read))
        elif not name.startswith("__") and isinstance(value, np.ndarray):
            found.extend(_columns_in(value, name, "", 0))
    yield from [*found, *objects] if found else []


def _columns_in(value: np.ndarray, name: str, group: str, depth: int) -> Iterator[FileColumn]:
    """Yield the columns of a variable or field, `group` the variable that it is in."""
    if not value.dtype.names:
        if value.dtype.kind in NUMBER_KINDS:
            yield from columns_of_array(value, name, group)
        return
    if depth == DEEPEST:
        return
    records = value.reshape(-1)[:MOST_COLUMNS]
    for number, record in enumerate(records, start=1):
        place = f"{name}({number})" if records.size > 1 else name
        title = next((text for field in NAMES if (text := _text(record, field))), "")
        for field in value.dtype.names:
            inner = np.asarray(record[field])
            label = title if title and field in SAMPLES else f"{place}.{field}" if depth else field
            yield from _columns_in(inner, label, group or name, depth + 1)


def _text(record: np.void, field: str) -> str:
    """Return the text in a field of a struct, or nothing."""
    value = np.asarray(record[field]) if field in (record.dtype.names or ()) else np.empty(0)
    return str(value.reshape(-1)[0]).strip() if value.dtype.kind == "U" and value.size == 1 else ""


HINT = "; save a MATLAB table T by s = table2struct(T, 'ToScalar', true); save(file, '-struct', 's')"
FORMATS = (
    FileFormat(name="MATLAB", mark=b"MATLAB", columns=_columns, hint=HINT),
    # Before version 5 such a file has no mark.
    FileFormat(name="MATLAB", suffix=".mat", columns=_columns, hint=HINT),
)
