"""Columns of a program's file, found and read by a process of their own.

What reads TDMS, MAT, HDF5, Parquet and Feather is C, C++ and Rust. A damaged file makes it crash, ask for all memory or
write to the terminal, and no `except` catches that. So it works in another process, with memory of its own that has a
bound; when that ends, this one says so in a sentence. One such process serves all files, until one of them ends it.
Rejected: to check each format before its library reads it, which is to write five readers more.

Requests are lines of JSON; an answer is a kind, a length, and as many bytes.
"""

import atexit
import contextlib
import io
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, BinaryIO, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, Samples, unreadable

#: Memory that reading may take beyond what the libraries themselves need: this, and so many times the file's size.
SPARE_BYTES, MOST_TIMES = 1 << 30, 64
#: Columns that are looked at; and rows, beyond which a file says more of itself than it can hold: a reading of a meter
#: has noise, and does not pack into a quarter of a bit.
MOST_FOUND, SPARE_ROWS, ROWS_PER_BYTE = 4096, 1_000_000, 32
#: One answer takes no longer than this, s, and what the file's size at so many bytes a second adds.
PATIENCE_S, SLOWEST_BYTES_S = 60.0, 2e6
HEAD = struct.Struct("<cQ")
FOUND, NUMBERS, TEXT, REFUSED, FAILED, CLOSED, SPENT = b"C", b"N", b"T", b"R", b"F", b"0", b"1"
#: The other process imports from where this one does, but never from the working folder.
START = (
    "import sys; sys.path[:] = sys.argv[1:]; "
    "from dzdesign.identify.reading.binary.reader_process import serve; serve()"
)


@final
class _Reader:
    """The other process, as this one sees it."""

    def __init__(self) -> None:
        # Few threads, few arenas: what each of them reserves counts as memory.
        few = {"POLARS_MAX_THREADS": "2", "OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2"}
        self.owner, self.patience, self.in_step = os.getpid(), PATIENCE_S, True
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", START, *(entry for entry in sys.path if entry)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env={**os.environ, **few},
        )  # fmt: skip

    def ask(self, request: dict[str, Any]) -> tuple[bytes, bytes]:
        """Return kind and content of the answer.

        Raises
        ------
        EOFError
            If the process ended instead; how, in words.
        """
        self.in_step = False
        watch = threading.Timer(self.patience, self.process.kill)
        watch.daemon = True
        watch.start()
        try:
            with contextlib.suppress(BrokenPipeError):
                self.process.stdin.write(json.dumps(request).encode() + b"\n")
                self.process.stdin.flush()
            head = self.process.stdout.read(HEAD.size)
            kind, size = HEAD.unpack(head) if len(head) == HEAD.size else (b"", 0)
            content = self.process.stdout.read(size)
        finally:
            late = not watch.is_alive()
            watch.cancel()
        if not kind or len(content) < size:
            raise EOFError(f"reading takes more than {self.patience:.0f} s" if late else self._end())
        self.in_step = True
        return kind, content

    def leave(self) -> bool:
        """Close the file; return whether the process can serve another."""
        try:
            return self.ask({"close": True})[0] == CLOSED
        except EOFError:
            return False

    def _end(self) -> str:
        status = self.process.wait()
        if status >= 0:
            return "its reader failed"
        return f"its reader crashed, {signal.Signals(-status).name}"

    def close(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()


_idle: list[_Reader] = []


@contextlib.contextmanager
def _reader() -> Iterator[_Reader]:
    """Return a process that is used by nobody else; it is used again unless something went wrong."""
    try:
        reader = _idle.pop()
    except IndexError:
        reader = None
    if reader is None or reader.owner != os.getpid():  # this process may be a copy of the one that it serves
        reader = _Reader()
    try:
        yield reader
    finally:
        if reader.in_step and reader.leave():
            _idle.append(reader)
        else:
            reader.close()


@atexit.register
def _close_idle() -> None:
    while _idle:
        reader = _idle.pop()
        if reader.owner == os.getpid():
            reader.close()


@contextlib.contextmanager
def separate_columns(file: BinaryIO, path: Path, name: str) -> Iterator[list[tuple[str, str, str, Samples]]]:
    """Find the columns of a file, in another process; they can be read until the context is left.

    Parameters
    ----------
    file : binary file
        Opened.
    path : Path
        Its name.
    name : str
        Of its format.

    Raises
    ------
    InputError
        If the file can't be read, or takes more than its share of memory or time.
    """
    with _on_disk(file, path) as place, _reader() as reader:
        size = os.path.getsize(place)
        reader.patience = PATIENCE_S + size / SLOWEST_BYTES_S
        _, content = _asked(reader, {"place": place, "path": str(path), "name": name}, path, name)
        columns = json.loads(content)
        most = SPARE_ROWS + ROWS_PER_BYTE * size
        if len(columns) > MOST_FOUND:
            raise InputError(f"'{path}' has more than {MOST_FOUND} columns; export only those of the ramp test")
        for _, label, _, _, rows in columns:
            if rows > most:
                raise InputError(
                    f"'{path}' ({name}) says that '{label[:QUOTED_CHARACTERS]}' has {rows} samples, which its {size} "
                    "bytes can't hold; save it again, or export it as CSV"
                )
        yield [
            (group, label, unit, _samples(reader, index, dtype, rows, path, name))
            for index, (group, label, unit, dtype, rows) in enumerate(columns)
        ]


def _samples(reader: _Reader, index: int, dtype: str, rows: int, path: Path, name: str) -> Samples:
    def read(start: int, stop: int) -> np.ndarray:
        kind, content = _asked(reader, {"column": index, "start": start, "stop": stop}, path, name)
        return np.frombuffer(content) if kind == NUMBERS else np.array(json.loads(content))

    return Samples(dtype=np.dtype(dtype), size=rows, read=read)


def _asked(reader: _Reader, request: dict[str, Any], path: Path, name: str) -> tuple[bytes, bytes]:
    try:
        kind, content = reader.ask(request)
    except EOFError as error:
        raise unreadable(path, name, error) from error
    if kind == REFUSED:
        raise InputError(json.loads(content))
    if kind == FAILED:
        raise unreadable(path, name, ValueError(json.loads(content)))
    return kind, content


@contextlib.contextmanager
def _on_disk(file: BinaryIO, path: Path) -> Iterator[str]:
    """Return a name by which another process finds the file: what came through a pipe is stored for it."""
    if not isinstance(file, io.BytesIO):
        yield os.path.abspath(path)
        return
    with tempfile.TemporaryDirectory(prefix="dzdesign-") as folder:
        place = Path(folder) / "piped"
        place.write_bytes(file.getvalue())
        yield str(place)


# what follows runs in the other process


def serve() -> None:
    """Answer requests on standard input until it ends."""
    import warnings

    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # a library that prints does not answer
    columns: list[Samples] = []
    usual = 0  # memory of the libraries
    with ExitStack() as stack:
        for line in sys.stdin.buffer:
            request = json.loads(line)
            try:
                if "close" in request:
                    columns.clear()
                    stack.close()
                    kind, content = SPENT if _memory() > usual + SPARE_BYTES // 4 else CLOSED, b""
                elif "place" in request:
                    found = _found(request, stack)
                    usual = usual or _memory()
                    columns += [samples for *_, samples in found]
                    listing = [(*words, samples.dtype.str, samples.size) for *words, samples in found]
                    kind, content = FOUND, json.dumps(listing, default=int).encode()
                else:
                    kind, content = _read(columns[request["column"]], request["start"], request["stop"])
            except InputError as error:
                kind, content = REFUSED, json.dumps(str(error)).encode()
            except Exception as error:  # each library raises kinds of its own; all mean "no whole file of this format"
                kind, content = FAILED, json.dumps(str(error) or type(error).__name__).encode()
            answers.write(HEAD.pack(kind, len(content)) + content)
            answers.flush()


def _found(request: dict[str, str], stack: ExitStack) -> list[tuple[str, str, str, Samples]]:
    from itertools import islice

    from dzdesign.identify.reading.binary.tables import FINDERS

    place = request["place"]
    finder = FINDERS[request["name"]]
    _bound_memory(SPARE_BYTES + MOST_TIMES * os.path.getsize(place))
    file = stack.enter_context(open(place, "rb"))  # noqa: SIM115
    return list(islice(finder(file, Path(request["path"]), stack), MOST_FOUND + 1))


def _read(samples: Samples, start: int, stop: int) -> tuple[bytes, bytes]:
    if samples.dtype.kind in "fiub":
        return NUMBERS, np.asarray(samples.read(start, stop)).astype(np.float64).tobytes()
    first = samples.read(start, min(stop, start + 1))
    return TEXT, json.dumps([str(value)[:QUOTED_CHARACTERS] for value in first]).encode()


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
