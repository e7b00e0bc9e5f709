"""MAT files before version 7.3: variables, and the fields of structs; version 7.3 is HDF5."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import BinaryIO

import numpy as np

from dzdesign.identify.reading.binary.file_format import NUMBER_KINDS, FileColumn, FileFormat, columns_of_array


def _columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[FileColumn]:
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
                yield from columns_of_array(np.asarray(record[field]), field, group=name)
        elif value.dtype.kind in NUMBER_KINDS:
            yield from columns_of_array(value, name)


HINT = "; save a MATLAB table by s = table2struct(T, 'ToScalar', true); save(file, '-struct', 's')"
FORMATS = (
    FileFormat(name="MATLAB", mark=b"MATLAB", columns=_columns, hint=HINT),
    # Before version 5 such a file has no mark.
    FileFormat(name="MATLAB", suffix=".mat", columns=_columns, hint=HINT),
)
