"""Compiled code as a process of its own: limits of time, memory and files, few rights, and its output as data.

What runs may be anybody's. It starts behind programs/confined.c, which takes its rights before a constructor of it can
run; in an empty folder; with an environment of a few variables; and without the terminal. What it prints goes to a
file of limited size, so that neither an endless text nor a child that holds a pipe open keeps `dzdesign` waiting.

Windows has no such limits: there the time alone is limited, and the environment is that of `dzdesign`.
"""

import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import ceil
from pathlib import Path
from threading import Event, Timer
from typing import IO

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes.programs import program_environment, with_full_name
from dzdesign.core.processes.running import ended_with_this_process, start_watch
from dzdesign.verify.toolchain.host_compiler import build_folder, built, host_compiler, words_of

LAUNCHER = "confined"
#: Without these a program does not start on some system, or a simulator does not find its libraries.
KEPT = ("PATH", "LD_LIBRARY_PATH", "SYSTEMROOT", "TEMP", "TMP", "TMPDIR")
#: Most that a program may print, that it may write into a file of results (the codes of all inputs are 0.2 GB), and
#: the address space that it may have: a check takes 0.1 GB.
MOST_WRITTEN, MOST_RESULTS, MOST_MEMORY = 64 * 2**20, 2**30, 4 * 2**30
#: Largest number that a program of ours prints has 32 bits; what has more digits is none of ours.
NUMBERS = re.compile(r"\s*\d{1,10}(?:\s+\d{1,10})*\s*", re.ASCII)
#: Signals that a limit sends, by name, and what was reached.
OF_LIMITS = {"SIGXCPU": "the limit of CPU time", "SIGXFSZ": "the limit of what it may write"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """How a program ended, and what it printed."""

    #: Why it did not end well, in words; empty where it did.
    reason: str
    printed: str
    complaint: str


def run_confined(
    command: Sequence[str],
    what: str,
    timeout_s: float,
    *,
    memory: int = MOST_MEMORY,
    results: Path | None = None,
    place: Path | None = None,
    confined: bool = True,
    more: Mapping[str, str] | None = None,
) -> Ended:
    """Run a program and return how it ended; one that does not start or end is a `RequirementError`.

    `memory` is its address space, bytes, 0 for any; `results` is the one folder in which it may write. It works in
    `place`, by default in `results`. One that is not `confined` has the time limit alone, and the environment of
    `dzdesign`. `more` are further variables of its environment.
    """
    try:
        named = with_full_name(command)
    except OSError as error:
        raise RequirementError(f"{what} did not start: {error}") from error
    limited = limits(timeout_s, memory, results) if confined else ()
    environment = {**(limited_environment() if confined else program_environment()), **(more or {})}
    with tempfile.TemporaryDirectory(dir=build_folder(), ignore_cleanup_errors=True) as folder:
        outputs, empty = (Path(folder) / "out", Path(folder) / "err"), Path(folder) / "empty"
        empty.mkdir()
        with outputs[0].open("wb") as out, outputs[1].open("wb") as err:
            status = _status([*limited, *named], environment, what, timeout_s, (out, err), place or results or empty)
        printed, complaint = map(text_of, outputs)
    return Ended(reason=reason_of(status), printed=printed, complaint=complaint)


def _status(
    command: Sequence[str],
    environment: Mapping[str, str],
    what: str,
    timeout_s: float,
    streams: tuple[IO[bytes], IO[bytes]],
    place: Path,
) -> int:
    """Run a program in a folder until it ends or its time is up, and return its exit status."""
    out, err = streams
    start_watch()
    try:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, cwd=place, env=environment,
            start_new_session=sys.platform != "win32",
        )  # fmt: skip
    except OSError as error:
        raise RequirementError(f"{what} did not start: {error}") from error
    late = Event()

    def end_late() -> None:
        late.set()
        process.kill()

    with ended_with_this_process(process.pid):
        timer = Timer(timeout_s, end_late)  # a wait with a time limit would look every 50 ms
        timer.start()
        try:
            status = process.wait()
        finally:
            timer.cancel()
            end_program(process)
    if late.is_set():
        raise RequirementError(f"{what} did not end within {timeout_s:g} s")
    return status


def end_program(process: "subprocess.Popen[bytes]") -> None:
    """End a program, and what it has started."""
    if sys.platform != "win32":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    if process.poll() is None:
        process.kill()
        process.wait()


@cache
def _compiled() -> Path:
    """Return the launcher, compiled once."""
    name = f"{LAUNCHER}.c"
    source = (Path(str(files("dzdesign.verify.toolchain"))) / "programs" / name).read_bytes()
    return built(LAUNCHER, [*words_of(host_compiler()), "-std=gnu99", "-O1", name], {name: source}, "the limits")


def limits(timeout_s: float, memory: int, results: Path | None) -> tuple[str, ...]:
    """Return how the command of a program with limits begins; nothing on Windows."""
    if sys.platform == "win32":
        return ()
    program = _compiled()
    # Of all its threads together.
    seconds = ceil(timeout_s * (os.cpu_count() or 1))
    most, folder = (MOST_WRITTEN, "") if results is None else (MOST_RESULTS, str(results))
    return (str(program), str(seconds), str(most), str(memory), folder)


def limited_environment() -> dict[str, str]:
    """Return the environment of a program with limits; on Windows that of `dzdesign`."""
    found = program_environment()
    return {name: value for name, value in found.items() if name in KEPT or sys.platform == "win32"}


def reason_of(status: int) -> str:
    """Return why an exit status is not that of a good end, in words; empty where it is."""
    if status >= 0:
        return f"exit status {status}" if status else ""
    name = signal.Signals(-status).name if -status in {*signal.Signals} else ""
    return f"signal {-status}" + (f": it reached {OF_LIMITS[name]}" if name in OF_LIMITS else "")


def text_of(path: Path) -> str:
    """Return what was printed; a program that has put something else in the place has printed nothing."""
    if path.is_symlink() or not path.is_file():
        return ""
    with path.open("rb") as file:
        return file.read(MOST_WRITTEN).decode("ascii", "replace")


def numbers_in(printed: str) -> list[list[int]]:
    """Return the lines of numbers in what was printed, whatever else there is.

    Examples
    --------
    >>> numbers_in("1 22 \\nnot 3\\n4\\n" + 5000 * "9")
    [[1, 22], [4]]
    """
    return [list(map(int, line.split())) for line in printed.splitlines() if NUMBERS.fullmatch(line)]
