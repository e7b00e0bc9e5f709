"""Parquet and Feather (Arrow IPC): dates and times become seconds since the first row, whose date is kept."""

from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from dzdesign.identify.reading.formats.file_format import FileColumn, FileFormat, stamp_of

if TYPE_CHECKING:
    import polars as pl


def _parquet_columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[FileColumn]:
    import polars as pl

    return _columns(pl.scan_parquet(file))


def _feather_columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[FileColumn]:
    import polars as pl

    return _columns(pl.scan_ipc(file))


def _columns(scan: "pl.LazyFrame") -> Iterator[FileColumn]:
    import polars as pl

    size = scan.select(pl.len()).collect().item()
    for name, dtype in scan.collect_schema().items():
        column = scan.select(pl.col(name))
        if dtype.is_temporal():
            start = _start(column, dtype) if isinstance(dtype, pl.Datetime) and size else ""
            yield FileColumn(name=name, unit="s", kind="f", size=size, read=partial(_seconds, column), start=start)
        elif dtype.is_numeric():
            yield FileColumn(name=name, kind="f", size=size, read=partial(_numbers, column))


def _numbers(column: "pl.LazyFrame") -> np.ndarray:
    series = column.collect().to_series()
    return np.asarray(series.cast(float).fill_null(float("nan")).to_numpy())


def _start(column: "pl.LazyFrame", dtype: "pl.Datetime") -> str:
    """Return the date and time of the first row; NumPy's is UTC where the column has a time zone."""
    return stamp_of(column.first().collect().to_series().to_numpy()[0], "Z" if dtype.time_zone else "")


def _seconds(column: "pl.LazyFrame") -> np.ndarray:
    series = column.collect().to_series()
    if str(series.dtype) == "Time":  # of a day, in ns; a recording over midnight goes back and is refused
        return np.asarray(series.to_physical().cast(float).to_numpy() / 1e9)
    if str(series.dtype).startswith(("Date", "Datetime")):
        series = series - series[0]
    return np.asarray(series.dt.total_microseconds().cast(float).to_numpy() / 1e6)


FORMATS = (
    FileFormat(name="Parquet", mark=b"PAR1", columns=_parquet_columns),
    FileFormat(name="Feather", mark=b"ARROW1", columns=_feather_columns),
)
