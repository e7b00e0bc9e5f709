"""Columns of a binary file, found and read by a process of their own.

What reads TDMS, MAT, HDF5, Parquet and Feather is C, C++ and Rust. A damaged file makes it crash, ask for all memory or
write to the terminal, and no `except` catches that. So it works in another process, with memory of its own that has a
bound; when that ends, this one says so in a sentence. One such process serves all files, until one of them ends it.
Rejected: to check each format before its library reads it, which is to write five readers more; and the pools of
`concurrent.futures` and loky, whose processes import from the working folder while they start.
"""

import atexit
import contextlib
import io
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, BinaryIO, final

import msgspec
import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.processes.running import ended_with_this_process
from dzdesign.core.scratch import scratch_folder
from dzdesign.identify.reading.binary.reader_server import MOST_FOUND, Answer, ListedColumn, Request
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, unreadable

#: Rows, beyond which a file says more of itself than it can hold: a reading of a meter has noise, and does not pack
#: into a quarter of a bit.
SPARE_ROWS, ROWS_PER_BYTE = 1_000_000, 32
#: One answer takes no longer than this, s, and what the file's size at so many bytes a second adds.
PATIENCE_S, SLOWEST_BYTES_S = 60.0, 2e6
#: The other process imports from where this one does, but never from the working folder.
START = (
    "import sys; sys.path[:] = sys.argv[1:]; from dzdesign.identify.reading.binary.reader_server import serve; serve()"
)


def list_columns(file: BinaryIO, path: Path, format_name: str) -> tuple[ListedColumn, ...]:
    """Return the columns of a file.

    Raises
    ------
    InputError
        If the file can't be read, or takes more than its share of memory or time.
    """
    with _on_disk(file, path) as place:
        columns = _answer(Request(place=place, path=str(path), format_name=format_name))[0].columns
        size = os.path.getsize(place)
    if len(columns) > MOST_FOUND:
        raise InputError(f"'{path}' has more than {MOST_FOUND} columns; export only those of the ramp test")
    for column in columns:
        if column.size > SPARE_ROWS + ROWS_PER_BYTE * size:
            raise InputError(
                f"'{path}' ({format_name}) says that '{column.name[:QUOTED_CHARACTERS]}' has {column.size} samples, "
                f"which its {size} bytes can't hold; save it again, or export it as CSV"
            )
    return columns


def read_columns(file: BinaryIO, path: Path, format_name: str, numbers: Sequence[int]) -> list[np.ndarray]:
    """Return the samples of columns as float64, NaN where one is missing.

    `numbers` are the places of the columns in what `list_columns` returns.

    Raises
    ------
    InputError
        As `list_columns` does; and if a column holds no numbers.
    """
    with _on_disk(file, path) as place:
        return _answer(Request(place=place, path=str(path), format_name=format_name, numbers=tuple(numbers)))[1]


def _answer(request: Request) -> tuple[Answer, list[np.ndarray]]:
    patience = PATIENCE_S + os.path.getsize(request.place) / SLOWEST_BYTES_S
    try:
        answer, arrays = _ask_a_process(request, patience)
    except EOFError as error:
        raise unreadable(Path(request.path), request.format_name, error) from error
    if answer.refused:
        raise InputError(answer.refused)
    if answer.failed:
        raise unreadable(Path(request.path), request.format_name, ValueError(answer.failed))
    return answer, arrays


@contextlib.contextmanager
def _on_disk(file: BinaryIO, path: Path) -> Iterator[str]:
    """Return a name by which another process finds the file: what came through a pipe is stored for it."""
    if not isinstance(file, io.BytesIO):
        yield os.path.abspath(path)
        return
    with scratch_folder() as folder:
        place = folder / "piped"
        place.write_bytes(file.getvalue())
        yield str(place)


@final
class ReaderProcess:
    """The other process, as this one sees it."""

    def __init__(self) -> None:
        # Few threads, few arenas: what each of them reserves counts as memory.
        few = {"POLARS_MAX_THREADS": "2", "OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2"}
        self.owner = os.getpid()
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", START, *(entry for entry in sys.path if entry)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env={**os.environ, **few},
            process_group=0 if os.name == "posix" else None,
        )  # fmt: skip

    def ask(self, request: Request, patience: float) -> tuple[Answer, list[np.ndarray]]:
        """Return the answer, and the arrays that belong to it.

        Raises
        ------
        EOFError
            If the process ended instead; how, in words.
        """
        questions, answers = self._pipes()
        watch = threading.Timer(patience, self.process.kill)
        watch.daemon = True
        watch.start()
        try:
            with ended_with_this_process(self.process.pid):  # idle, it ends with its pipe; busy, it would read on
                return self._exchange(request, questions, answers)
        except (msgspec.DecodeError, ValueError) as error:  # or none
            late = not watch.is_alive()
            raise EOFError(f"reading takes more than {patience:.0f} s" if late else self._end()) from error
        finally:
            watch.cancel()

    def _exchange(
        self, request: Request, questions: IO[bytes], answers: IO[bytes]
    ) -> tuple[Answer, list[np.ndarray]]:
        """Return the answer; a `ValueError` is half of one, or none."""
        with contextlib.suppress(BrokenPipeError):
            questions.write(msgspec.json.encode(request) + b"\n")
            questions.flush()
        answer = msgspec.json.decode(answers.readline(), type=Answer)
        arrays = [np.frombuffer(answers.read(8 * size)) for size in answer.sizes]
        if tuple(array.size for array in arrays) != answer.sizes:
            raise ValueError("half of an answer")
        return answer, arrays

    def _pipes(self) -> tuple[IO[bytes], IO[bytes]]:
        if self.process.stdin is None or self.process.stdout is None:
            raise TypeError("the process has no pipes")
        return self.process.stdin, self.process.stdout

    def _end(self) -> str:
        status = self.process.wait()
        return "its reader failed" if status >= 0 else f"its reader crashed, {signal.Signals(-status).name}"

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        for pipe in self._pipes():
            with contextlib.suppress(BrokenPipeError):
                pipe.close()
        self.process.wait()


_idle: list[ReaderProcess] = []


def _ask_a_process(request: Request, patience: float) -> tuple[Answer, list[np.ndarray]]:
    """Ask a process that serves nobody else; it is used again unless something went wrong."""
    try:
        reader = _idle.pop()
    except IndexError:
        reader = ReaderProcess()
    if reader.owner != os.getpid() or reader.process.poll() is not None:  # it serves another process, or has ended
        reader = ReaderProcess()
    try:
        answer = reader.ask(request, patience)
    except BaseException:
        reader.close()
        raise
    _idle.append(reader)
    return answer


@atexit.register
def _close_idle() -> None:
    while _idle:
        reader = _idle.pop()
        if reader.owner == os.getpid():
            reader.close()
