"""TDMS, as LabVIEW and FlexLogger write it: each waveform brings a column of time; its dates are UTC."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.formats.file_format import FileColumn, FileFormat, stamp_of, unit_among


def _columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[FileColumn]:
    from nptdms import TdmsFile

    tdms = stack.enter_context(TdmsFile.open(file))
    if tdms.file_status.incomplete_final_segment:
        raise InputError(
            f"'{path}' (TDMS) is cut off: its last segment is not whole; copy it again, or open it where it was "
            "recorded and save what is there"
        )
    clocks: dict[tuple[Any, ...], int] = {}  # waveform -> number of its column of time
    count = 0
    for group in tdms.groups():
        for channel in group.channels():
            size = len(channel)
            if channel.dtype.kind == "M":
                yield FileColumn(
                    group=group.name, name=channel.name, unit="s", kind="f", size=size, read=_seconds(channel),
                    start=stamp_of(channel[0], "Z") if size else "",
                )  # fmt: skip
                count += 1
                continue
            # Read for each channel: tasks that are started one after the other state a start each.
            stated = channel.properties
            step, offset = (stated.get(key) or 0.0 for key in ("wf_increment", "wf_start_offset"))
            start = stated.get("wf_start_time", "")
            waveform = (step, offset, start, size)
            is_column = channel.dtype.kind in "fiubSUO" and size >= 2
            is_new = bool(step) and size > 0 and waveform not in clocks
            if is_new:
                clocks[waveform] = count + is_column
            if is_column:
                yield FileColumn(
                    group=group.name, name=channel.name, unit=unit_among(channel.properties), kind=channel.dtype.kind,
                    size=size, read=_samples(channel), clock=clocks.get(waveform, -1),
                )  # fmt: skip
                count += 1
            if is_new:
                times = np.linspace(offset, offset + (size - 1) * step, size)
                name = "time_s" if len(clocks) == 1 else f"time of {channel.name}"
                yield _of_time(group.name, name, times, start)
                count += 1


def _of_time(group: str, name: str, times: np.ndarray, start: Any) -> FileColumn:
    """Return the column of time of a waveform, which counts from the start that its channel states."""
    stamp = stamp_of(start, "Z") if isinstance(start, np.datetime64) else ""
    return FileColumn(group=group, name=name, unit="s", kind="f", size=times.size, read=lambda: times, start=stamp)


def _samples(channel: Any) -> Any:
    return lambda: channel[:]


def _seconds(channel: Any) -> Any:
    """Return what reads a channel of dates as seconds since its first."""
    return lambda: (channel[:] - channel[0]) / np.timedelta64(1, "s")


FORMATS = (FileFormat(name="TDMS", mark=b"TDSm", columns=_columns),)
