"""Columns that are read where they are needed: of an array, of a sequence of chunks, of a file of data frames."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from dzdesign.identify.reading.table import Samples


def whole(array: Any) -> Samples:
    """Return a vector, in memory or in a file, as samples.

    Parameters
    ----------
    array : (N,) array or dataset
        Anything that gives a slice.
    """
    return Samples(dtype=array.dtype, size=array.shape[0], read=lambda start, stop: array[start:stop])


def evenly_spaced(first: float, step: float, size: int) -> Samples:
    """Return the clock of a waveform.

    Parameters
    ----------
    first, step : float
        First sample, and from one to the next.
    size : int
        Samples.
    """
    last = first + (size - 1) * step
    pace = (last - first) / max(size - 1, 1)

    def read(start: int, stop: int) -> np.ndarray:
        times = np.arange(start, stop) * pace + first
        times[max(size - 1 - start, 0) :] = last  # as numpy.linspace ends
        return times

    return Samples(dtype=np.dtype(float), size=size, read=read)


def in_sequence(dtype: np.dtype, size: int, pieces: Callable[[], Iterator[np.ndarray]]) -> Samples:
    """Return samples that come in pieces of any length; each piece is read once if the samples are read in order.

    Parameters
    ----------
    dtype : dtype
        Of a sample.
    size : int
        Samples.
    pieces : callable
        Returns the pieces from the beginning.
    """
    held, first, source = np.empty(0, dtype), 0, pieces()

    def read(start: int, stop: int) -> np.ndarray:
        nonlocal held, first, source
        if start < first:
            held, first, source = np.empty(0, dtype), 0, pieces()
        parts, end = [held], first + held.size
        while end < stop:
            piece = next(source, None)
            if piece is None:
                break
            parts.append(piece)
            end += len(piece)
            if end <= start:  # passed over
                parts, first = [held[:0]], end
        held = np.concatenate(parts) if len(parts) > 1 else held
        drop = min(max(start - first, 0), held.size)
        held, first = held[drop:], first + drop
        return held[: stop - start]

    return Samples(dtype=dtype, size=size, read=read)


def frame_columns(scan: Any) -> Iterator[tuple[str, str, str, Samples]]:
    """Return the columns of a lazy data frame; a date becomes seconds since the first row.

    Parameters
    ----------
    scan : polars.LazyFrame
        Of a file.
    """
    import polars as pl

    size = scan.select(pl.len()).collect().item()
    number = np.dtype(float)
    for name, dtype in scan.collect_schema().items():
        column = scan.select(pl.col(name))
        if dtype.is_temporal():
            yield "", name, "s", Samples(dtype=number, size=size, read=_seconds(column))
        elif dtype.is_numeric():
            yield "", name, "", Samples(dtype=number, size=size, read=_numbers(column))


def _numbers(column: Any) -> Callable[[int, int], np.ndarray]:
    def read(start: int, stop: int) -> np.ndarray:
        series = column.slice(start, stop - start).collect().to_series()
        return series.cast(float).fill_null(float("nan")).to_numpy()

    return read


def _seconds(column: Any) -> Callable[[int, int], np.ndarray]:
    def read(start: int, stop: int) -> np.ndarray:
        series = column.slice(start, stop - start).collect().to_series()
        if str(series.dtype) == "Time":  # of a day, in ns; a recording over midnight goes back and is refused
            return series.to_physical().cast(float).to_numpy() / 1e9
        if str(series.dtype).startswith(("Date", "Datetime")):
            series = series - column.slice(0, 1).collect().to_series()[0]
        return series.dt.total_microseconds().cast(float).to_numpy() / 1e6

    return read
