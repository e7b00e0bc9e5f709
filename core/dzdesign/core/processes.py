"""Programs that dzdesign starts and waits for, and its own worker processes: none is one of the working folder.

Whoever works in a folder that somebody sent must not run what lies in it. So an entry of PATH that is empty or relative
is left out, for dzdesign and for the programs that it starts; and Windows, which looks into the working folder before
PATH, is given full names alone.
"""

import contextlib
import errno
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from dzdesign.core.placing import remove_scratch

#: By which programs on Windows do not look for others in the working folder.
NOT_HERE = "NoDefaultCurrentDirectoryInExePath"
#: How often a worker looks for its parent.
LOOK_S = 0.5


def find_program(name: str, folders: Sequence[str] | None = None) -> str | None:
    """Return the full path of a program, by default one of PATH, or None; a name with a folder in it stands for itself.

    Examples
    --------
    >>> find_program("no-such-program") is None
    True
    """
    if os.path.dirname(name):
        folder, name = os.path.split(os.path.abspath(name))
        folders = [folder]
    for folder in search_folders() if folders is None else folders:
        # The second for Windows and Python 3.11, whose first adds no ending; it looks into the working folder before.
        found = shutil.which(os.path.join(folder, name)) or shutil.which(name, path=folder)
        if found and os.path.isabs(found):
            return found
    return None


def search_folders() -> list[str]:
    """Return the folders of PATH that are named in full."""
    entries = os.environ.get("PATH", os.defpath).split(os.pathsep)
    return [entry for entry in (each.strip('"') for each in entries) if entry and Path(entry).is_absolute()]


def program_environment(environment: Mapping[str, str] | None = None) -> dict[str, str]:
    """Return an environment, by default that of this process, with which a program finds others likewise."""
    given = dict(os.environ if environment is None else environment)
    if "PATH" in given:
        given["PATH"] = os.pathsep.join(search_folders())
    return {**given, NOT_HERE: "1"} if os.name == "nt" else given


def run_program(
    command: Sequence[str],
    *,
    timeout: float,
    cwd: str | Path | None = None,
    env: Mapping[str, str] | None = None,
) -> subprocess.CompletedProcess[str]:
    """Run a program without input, and return its exit status and what it wrote.

    On POSIX it is the head of a group of processes, so that what it has started ends with it if it is late, or if this
    process is interrupted. Windows has no such groups.

    Raises
    ------
    OSError
        If it can't be run.
    subprocess.TimeoutExpired
        If it does not end in time (s); it was ended then.
    """
    path = find_program(command[0])
    if path is None:
        raise FileNotFoundError(errno.ENOENT, "no such program on PATH", command[0])
    process = subprocess.Popen(
        [path, *command[1:]], cwd=cwd, env=program_environment(env), text=True, errors="replace",
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        process_group=0 if os.name == "posix" else None,
    )  # fmt: skip
    with process:
        try:
            out, err = process.communicate(timeout=timeout)
        except BaseException:  # late, or interrupted: what it has started ends as well, and holds no pipe
            if os.name == "posix":
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
            process.kill()
            process.communicate()
            raise
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def end_with(parent: int) -> None:
    """Let this process, a worker of loky, end soon after its parent, whose number is given; its scratch folders too."""
    threading.Thread(target=_end_after, args=(parent,), daemon=True).start()


def _end_after(parent: int) -> None:
    if sys.platform == "win32":  # which gives no orphan to another process
        from multiprocessing import parent_process

        if known := parent_process():
            known.join()
    else:
        while os.getppid() == parent:
            time.sleep(LOOK_S)
    remove_scratch()
    os._exit(1)  # from another thread than the main one nothing else ends a process


def safe_path() -> contextlib.AbstractContextManager[None]:
    """Let processes that are started meanwhile import no module from the working folder: recordings lie there."""
    return _environment("PYTHONSAFEPATH", "1")


@contextlib.contextmanager
def _environment(name: str, value: str) -> Iterator[None]:
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        os.environ.pop(name)
        if before is not None:
            os.environ[name] = before


@contextlib.contextmanager
def interrupts_kept_waiting() -> Iterator[None]:
    """Let processes that are started meanwhile hear no Ctrl-C, which is for this one: as they start it is a traceback.

    The helpers of joblib, which allow it again as they start, are started before; they say nothing of what is left to
    clean up where this process is killed.
    """
    if sys.platform == "win32":
        yield
        return
    from multiprocessing import resource_tracker

    from joblib.externals.loky.backend import resource_tracker as loky_tracker

    with _environment("PYTHONWARNINGS", "ignore"):
        resource_tracker.ensure_running()
        loky_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
