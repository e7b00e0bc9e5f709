"""Programs that this process starts and waits for end with it, however it ends.

On POSIX a watch, a process of its own, is told of each program; it holds a pipe, which ends with this process, and then
ends the programs with all that they have started. A kill within the millisecond between a program's start and that
word leaves it. Windows has no such groups: there a program runs to its end.
"""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from threading import RLock

from dzdesign.core.processes.programs import program_environment, with_full_name

#: The watch: lines such as +4711 and -4711 on its input, until that ends.
WATCH = """
import os, signal, sys
for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(each, signal.SIG_IGN)
groups = set()
for line in sys.stdin:
    (groups.add if line[0] == "+" else groups.discard)(int(line[1:]))
for group in groups:
    try:
        os.killpg(group, signal.SIGKILL)
    except OSError:
        pass
"""
#: Taken again by a thread that has it, if the garbage collector ends a program there.
_starting = RLock()


def run_program(
    command: Sequence[str],
    *,
    timeout: float,
    cwd: str | Path | None = None,
    env: Mapping[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    """Run a program without input, and return its exit status and what it wrote.

    It is never one of the working folder, and neither is what it starts by name.

    Raises
    ------
    OSError
        If it can't be run.
    subprocess.TimeoutExpired
        If it does not end in time (s); it was ended then, with all that it had started.
    """
    command, env = with_full_name(command), program_environment(env)
    if os.name != "posix":
        return subprocess.run(
            command, cwd=cwd, env=env, timeout=timeout, check=False, capture_output=True, text=True, errors="replace",
            stdin=subprocess.DEVNULL,
        )  # fmt: skip
    start_watch()
    process = subprocess.Popen(
        command, cwd=cwd, env=env, text=True, errors="replace", process_group=0,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    with ended_with_this_process(process.pid):
        try:
            out, err = process.communicate(timeout=timeout)
        except BaseException:  # late, or interrupted: what it has started ends as well, and holds no pipe
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def start_watch() -> None:
    """Start the watch of this process, if it has none; called before a program, so that none runs without one."""
    if os.name == "posix":
        with contextlib.suppress(OSError), _starting:
            _watch_of(os.getpid())


@contextlib.contextmanager
def ended_with_this_process(group: int) -> Iterator[None]:
    """Have a group of processes end with this process, if that ends within the context; not on Windows."""
    if os.name == "posix":
        _tell("+", group)
    try:
        yield
    finally:
        if os.name == "posix":
            _tell("-", group)


def _tell(sign: str, group: int) -> None:
    """Tell the watch of a program that begins or has ended; without a watch it is no less run."""
    with contextlib.suppress(OSError), _starting:
        os.write(_watch_of(os.getpid()), f"{sign}{group}\n".encode())


@cache
def _watch_of(process: int) -> int:
    """Start the watch of this process, whose number is given, and return the end of its pipe."""
    watch = subprocess.Popen(
        [sys.executable, "-I", "-S", "-c", WATCH], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, process_group=0, cwd="/",
    )  # fmt: skip
    if watch.stdin is None:
        raise OSError("the watch has no pipe")
    end = os.dup(watch.stdin.fileno())  # it stays open until this process ends
    watch.stdin.close()
    watch.returncode = 0  # nobody waits for it, and Python does not warn of that
    return end
