"""A table of a binary file: its columns as arrays, found and read by a process of their own.

What reads TDMS, MAT, HDF5, Parquet and Feather is C, C++ and Rust. A damaged file makes it crash, ask for all memory or
write to the terminal, and no `except` catches that. So it works in a process of loky's, whose memory has a bound; when
that ends, this one says so in a sentence. One such process serves all files, until one of them ends it. Rejected: to
check each format before its library reads it, which is to write five readers more.
"""

import importlib
import io
import os
import pkgutil
import re
import signal
import warnings
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.placing import scratch_folder
from dzdesign.core.processes import end_with, interrupts_kept_waiting, safe_path
from dzdesign.identify.reading import formats
from dzdesign.identify.reading.formats.file_format import NO_NUMBERS_UNIT, NUMBER_KINDS, FileColumn, FileFormat
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, Table, numbered, unreadable
from dzdesign.identify.reading.text_file import read_text_table
from dzdesign.identify.reading.time_stamps import Start, start_of

if TYPE_CHECKING:
    from joblib.externals.loky import ProcessPoolExecutor

#: First bytes of a file among which its format's mark stands.
LONGEST_MARK = 32
#: Rows, beyond which a file says more of itself than it can hold: a reading of a meter has noise, and does not pack
#: into a quarter of a bit.
SPARE_ROWS, ROWS_PER_BYTE = 1_000_000, 32
#: Columns that are looked at.
MOST_FOUND = 4096
#: One answer takes no longer than this, s, and what the file's size at so many bytes a second adds.
PATIENCE_S, SLOWEST_BYTES_S = 60.0, 2e6
#: Memory that reading may take beyond what the libraries themselves need: this, and so many times the file's size.
SPARE_BYTES, MOST_TIMES = 1 << 30, 64
#: Few threads, few arenas: what each of them reserves counts as memory.
FEW = {"POLARS_MAX_THREADS": "2", "OPENBLAS_NUM_THREADS": "1", "MALLOC_ARENA_MAX": "2"}


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ArrayTable(Table):
    """A table whose columns are arrays."""

    #: Open as long as columns are loaded.
    file: BinaryIO
    #: Of the file.
    file_format: FileFormat
    #: Label -> number of the column in the file, and what the file says of it.
    columns: Mapping[str, tuple[int, FileColumn]]
    _loaded: dict[str, np.ndarray] = field(default_factory=dict)

    def load(self, labels: Collection[str]) -> None:
        """Read columns at once."""
        numbers = [self.columns[label][0] for label in labels]
        _, arrays = _ask_the_reader(self.file, self.path, self.file_format.name, numbers)
        self._loaded.update(zip(labels, arrays, strict=True))

    def length(self, label: str) -> int:
        """Return how many samples a column has."""
        return self.columns[label][1].size

    def group(self, label: str) -> str:
        """Return the group of a column, which its label may lack."""
        return self.columns[label][1].group

    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64."""
        if label not in self._loaded:
            self.load([label])
        return self._loaded.pop(label)

    def started(self, label: str) -> Start | None:
        """Return the date and time at which a column of time counts zero, where the file states them."""
        return start_of(self.columns[label][1].start)

    def found_labels(self) -> str:
        """Return the labels for a message, and what to do about what could not be read."""
        return Table.found_labels(self) + (self.file_format.hint if NO_NUMBERS_UNIT in self.units.values() else "")

    def place(self, row: int) -> str:
        """Return ``sample 8``: such files have no rows that an editor would count."""
        return f"sample {row + 1}"


@cache
def file_formats() -> tuple[FileFormat, ...]:
    """Return all formats, the longest mark first: the mark of MATLAB 7.3 begins as that of MATLAB does.

    Every module of `formats` that declares ``FORMATS`` takes part.
    """
    names = sorted(module.name for module in pkgutil.iter_modules(formats.__path__))
    modules = [importlib.import_module(f"{formats.__name__}.{name}") for name in names]
    found = [item for module in modules for item in getattr(module, "FORMATS", ())]
    return tuple(sorted(found, key=lambda item: -len(item.mark)))


def read_table(
    file: BinaryIO, path: Path, skip_rows: int | None = None, missing: Collection[str] = ()
) -> Table:
    """Read a table of any known format; its first bytes tell which, and its suffix where the format has no mark.

    Raises
    ------
    InputError
        If it is none of these, or not a whole one.
    """
    start = file.read(LONGEST_MARK)
    file.seek(0)
    for item in file_formats():
        if start.startswith(item.mark) if item.mark else path.suffix.lower() == item.suffix:
            return read_binary_table(file, path, item)
    return read_text_table(file, path, skip_rows, missing)


def read_binary_table(file: BinaryIO, path: Path, file_format: FileFormat) -> ArrayTable:
    """Read a table of a binary format.

    Raises
    ------
    InputError
        If the file is not a whole one of that format, takes more than its share of memory or time, or holds no columns
        of numbers.
    """
    size = file.seek(0, os.SEEK_END)
    found, _ = _ask_the_reader(file, path, file_format.name)
    if not found:
        raise InputError(
            f"'{path}' ({file_format.name}) holds no columns of numbers; "
            f"expected one vector per quantity, such as u_V{file_format.hint}"
        )
    if len(found) > MOST_FOUND:
        raise InputError(f"'{path}' has more than {MOST_FOUND} columns; export only those of the ramp test")
    for column in found:
        if column.size > SPARE_ROWS + ROWS_PER_BYTE * size:
            raise InputError(
                f"'{path}' ({file_format.name}) says that '{column.name[:QUOTED_CHARACTERS]}' has {column.size} "
                f"samples, which its {size} bytes can't hold; save it again, or export it as CSV"
            )
    labels = _unique_labels(found)
    return ArrayTable(
        path=path,
        labels=labels,
        units={label: column.unit for label, column in zip(labels, found, strict=True) if column.unit},
        clocks={label: labels[each.clock] for label, each in zip(labels, found, strict=True) if each.clock >= 0},
        file=file,
        file_format=file_format,
        columns={label: (number, column) for number, (label, column) in enumerate(zip(labels, found, strict=True))},
    )


def _unique_labels(found: Sequence[FileColumn]) -> tuple[str, ...]:
    """Return a label for each column: its name, and before it its group where another group has that name too."""
    names = Counter(column.name for column in found)
    groups = [f"{column.group}/" if column.group and names[column.name] > 1 else "" for column in found]
    return numbered([group + column.name for group, column in zip(groups, found, strict=True)])


# in this process


def _ask_the_reader(
    file: BinaryIO, path: Path, format_name: str, numbers: Sequence[int] = ()
) -> tuple[list[FileColumn], list[np.ndarray]]:
    """Return the columns of a file; or the samples of those with some numbers as float64, NaN where one is missing."""
    with _on_disk(file, path) as place:
        patience = PATIENCE_S + os.path.getsize(place) / SLOWEST_BYTES_S
        with safe_path(), interrupts_kept_waiting():
            answer = _reader(os.getpid()).submit(_read, place, path, format_name, tuple(numbers))
        try:
            found: tuple[list[FileColumn], list[np.ndarray]] = answer.result(patience)
            return found
        except InputError:
            raise
        except TimeoutError as error:
            end_reader()
            reason = f"reading takes more than {patience:.0f} s"
            raise unreadable(path, format_name, EOFError(reason)) from error
        except BrokenProcessPool as error:
            end_reader()
            how = re.search(r"\bSIG[A-Z]+\b", str(error))
            reason = f"its reader crashed{f', {how[0]}' if how else ''}"
            raise unreadable(path, format_name, EOFError(reason)) from error
        except BaseException:
            end_reader()
            raise


@cache
def _reader(process: int) -> "ProcessPoolExecutor":
    """Return what starts and asks the reader of this process, whose number is given: a forked one has its own."""
    from joblib.externals.loky import ProcessPoolExecutor

    return ProcessPoolExecutor(1, initializer=_prepare_reader, initargs=(process,), env=FEW)


def end_reader() -> None:
    """End the process that reads, whatever it is doing; the next file is read by another."""
    _reader(os.getpid()).shutdown(wait=False, kill_workers=True)
    _reader.cache_clear()


@contextmanager
def _on_disk(file: BinaryIO, path: Path) -> Iterator[str]:
    """Return a name by which another process finds the file: what came through a pipe is stored for it."""
    if not isinstance(file, io.BytesIO):
        yield os.path.abspath(path)
        return
    with scratch_folder() as folder:
        place = folder / "piped"
        place.write_bytes(file.getvalue())
        yield str(place)


# in the reader's process


def _prepare_reader(parent: int) -> None:
    """Let it end with its parent, leave Ctrl-C to that, and write nothing to the terminal, as some libraries do."""
    end_with(parent)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore")
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, 1)
    os.dup2(nothing, 2)


def _read(
    place: str, path: Path, format_name: str, numbers: Sequence[int]
) -> tuple[list[FileColumn], list[np.ndarray]]:
    find = next(item.columns for item in file_formats() if item.name == format_name)
    _bound_memory(SPARE_BYTES + MOST_TIMES * os.path.getsize(place))
    try:
        with open(place, "rb") as file, ExitStack() as stack:
            found = list(islice(find(file, path, stack), MOST_FOUND + 1))
            if numbers:
                return [], [_samples(found[number], path) for number in numbers]
            return [replace(column, size=int(column.size), read=_not_here) for column in found], []
    except InputError:
        raise
    except Exception as error:  # each library raises kinds of its own; all mean "no whole file of this format"
        raise unreadable(path, format_name, error) from None


def _samples(column: FileColumn, path: Path) -> np.ndarray:
    samples = column.read()
    if column.kind not in NUMBER_KINDS:
        first = str(samples[:1])[:QUOTED_CHARACTERS]
        raise InputError(
            f"'{path}' column '{column.name}' holds no numbers (first: '{first}'); give another column by "
            "--columns, or save it as numbers"
        )
    return np.ascontiguousarray(samples, dtype=np.float64)


def _not_here() -> np.ndarray:
    raise TypeError("the samples are in another process")


def _bound_memory(spare: int) -> None:
    """Let this process have no more memory than it has now and `spare`, where the system can say so (Linux)."""
    try:
        status = Path("/proc/self/status").read_text()
    except OSError:
        return
    import resource

    now = next(int(line.split()[1]) << 10 for line in status.splitlines() if line.startswith("VmData:"))
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    most = now + spare if hard == resource.RLIM_INFINITY else min(now + spare, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
