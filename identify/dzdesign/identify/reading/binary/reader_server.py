"""The process that reads binary files: requests on its standard input, answers on its standard output.

A request is a line of JSON, and so is its answer, which samples as float64 may follow. See `reader_process`.
"""

import os
import signal
import sys
import warnings
from contextlib import ExitStack
from itertools import islice
from pathlib import Path

import msgspec
import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.binary.file_format import NUMBER_KINDS
from dzdesign.identify.reading.binary.registry import file_formats
from dzdesign.identify.reading.table import QUOTED_CHARACTERS

#: Memory that reading may take beyond what the libraries themselves need: this, and so many times the file's size.
SPARE_BYTES, MOST_TIMES = 1 << 30, 64
#: Columns that are looked at.
MOST_FOUND = 4096


class Request(msgspec.Struct, frozen=True, kw_only=True):
    """What the other process is asked: the columns of a file, or the samples of those with some numbers."""

    place: str
    path: str
    format_name: str
    numbers: tuple[int, ...] = ()


class ListedColumn(msgspec.Struct, frozen=True, kw_only=True):
    """A column as its file lists it: see `FileColumn`."""

    group: str
    name: str
    unit: str
    start: str
    size: int
    clock: int = -1


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """What the other process answers: columns, the sizes of those that follow, or why the file can't be read."""

    columns: tuple[ListedColumn, ...] = ()
    sizes: tuple[int, ...] = ()
    refused: str = ""
    failed: str = ""


def serve() -> None:
    """Answer requests on standard input until it ends."""
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # a library that prints does not answer
    for line in sys.stdin.buffer:
        arrays: list[np.ndarray] = []
        try:
            answer, arrays = _read(msgspec.json.decode(line, type=Request))
        except InputError as error:
            answer = Answer(refused=str(error))
        except Exception as error:  # each library raises kinds of its own; all mean "no whole file of this format"
            answer = Answer(failed=str(error) or type(error).__name__)
        answers.write(msgspec.json.encode(answer) + b"\n")
        for array in arrays:
            answers.write(array.data)
        answers.flush()


def _read(request: Request) -> tuple[Answer, list[np.ndarray]]:
    path = Path(request.path)
    find = next(item.columns for item in file_formats() if item.name == request.format_name)
    _bound_memory(SPARE_BYTES + MOST_TIMES * os.path.getsize(request.place))
    with open(request.place, "rb") as file, ExitStack() as stack:
        found = list(islice(find(file, path, stack), MOST_FOUND + 1))
        if not request.numbers:
            listed = (
                ListedColumn(
                    group=column.group,
                    name=column.name,
                    unit=column.unit,
                    start=column.start,
                    size=int(column.size),
                    clock=column.clock,
                )
                for column in found
            )
            return Answer(columns=tuple(listed)), []
        arrays = []
        for column in (found[number] for number in request.numbers):
            samples = column.read()
            if column.kind not in NUMBER_KINDS:
                first = str(samples[:1])[:QUOTED_CHARACTERS]
                raise InputError(
                    f"'{path}' column '{column.name}' holds no numbers (first: '{first}'); give another column by "
                    "--columns, or save it as numbers"
                )
            arrays.append(np.ascontiguousarray(samples, dtype=np.float64))
        return Answer(sizes=tuple(array.size for array in arrays)), arrays


def _bound_memory(spare: int) -> None:
    """Let this process have no more memory than it has now and `spare`, where the system can say so (Linux)."""
    now = _memory()
    if not now:
        return
    import resource

    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    most = now + spare if hard == resource.RLIM_INFINITY else min(now + spare, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def _memory() -> int:
    """Return the bytes of memory that this process has of its own; 0 where the system does not say."""
    try:
        status = Path("/proc/self/status").read_text()
    except OSError:
        return 0
    return next(int(line.split()[1]) << 10 for line in status.splitlines() if line.startswith("VmData:"))
