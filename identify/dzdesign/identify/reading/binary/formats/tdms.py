"""TDMS, as LabVIEW and FlexLogger write it: a waveform channel brings a column of time; its dates are UTC."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.binary.file_format import FileColumn, FileFormat, stamp_of, unit_among


def _columns(file: BinaryIO, path: Path, stack: ExitStack) -> Iterator[FileColumn]:
    from nptdms import TdmsFile

    tdms = stack.enter_context(TdmsFile.open(file))
    if tdms.file_status.incomplete_final_segment:
        raise InputError(
            f"'{path}' (TDMS) is cut off: its last segment is not whole; copy it again, or open it where it was "
            "recorded and save what is there"
        )
    has_time = False
    for group in tdms.groups():
        for channel in group.channels():
            size = len(channel)
            if channel.dtype.kind == "M":
                yield FileColumn(
                    group=group.name, name=channel.name, unit="s", kind="f", size=size, read=_seconds(channel),
                    start=stamp_of(channel[0], "Z") if size else "",
                )  # fmt: skip
                continue
            if channel.dtype.kind in "fiubSUO" and size >= 2:
                yield FileColumn(
                    group=group.name, name=channel.name, unit=unit_among(channel.properties), kind=channel.dtype.kind,
                    size=size, read=_samples(channel),
                )  # fmt: skip
            step = channel.properties.get("wf_increment")
            if step and size and not has_time:
                has_time = True
                start = channel.properties.get("wf_start_offset", 0.0)
                times = np.linspace(start, start + (size - 1) * step, size)
                yield _of_time(group.name, times, channel.properties.get("wf_start_time"))


def _of_time(group: str, times: np.ndarray, start: Any) -> FileColumn:
    """Return the column of time of a waveform, which counts from the start that its channel states."""
    stamp = stamp_of(start, "Z") if isinstance(start, np.datetime64) else ""
    return FileColumn(group=group, name="time_s", unit="s", kind="f", size=times.size, read=lambda: times, start=stamp)


def _samples(channel: Any) -> Any:
    return lambda: channel[:]


def _seconds(channel: Any) -> Any:
    """Return what reads a channel of dates as seconds since its first."""
    return lambda: (channel[:] - channel[0]) / np.timedelta64(1, "s")


FORMATS = (FileFormat(name="TDMS", mark=b"TDSm", columns=_columns),)
