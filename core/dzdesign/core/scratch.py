"""Temporary folders of a process, which go with it; what a killed one left goes with a later one."""

import atexit
import contextlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from dzdesign.core.errors import InputError

#: How the folders are called, in the system's folder for temporary files.
PREFIX = "dzdesign-tmp-"
#: File by which a folder is known as made here; without it none is ever removed.
MARK = ".dzdesign-scratch"
#: A folder of this age was left by a process that was killed: no command runs for three days.
ABANDONED_S = 3 * 86_400.0

#: The folders of this process.
_held: set[Path] = set()


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """Create a folder that is removed at the end of the context."""
    folder = _made()
    try:
        yield folder
    finally:
        _remove(folder)


@cache
def process_folder() -> Path:
    """Return the folder of this process, which is removed when the process ends."""
    folder = _made()
    atexit.register(_remove, folder)
    return folder


def is_scratch(path: Path) -> bool:
    """Tell whether a path lies in a folder of this process that goes anyway: no power cut matters to it."""
    place = Path(os.path.realpath(path))
    return any(folder == place or folder in place.parents for folder in _held)


def remove_scratch() -> None:
    """Remove the folders of this process now, before it ends by a way on which nothing else is done."""
    for folder in list(_held):
        _remove(folder)


def _made() -> Path:
    try:
        tempfile.gettempdir()
    except FileNotFoundError as error:
        raise InputError(
            "no folder for temporary files can be written into; set TMPDIR to one that can, and make room there"
        ) from error
    _remove_abandoned()
    folder = Path(os.path.realpath(tempfile.mkdtemp(prefix=PREFIX)))
    (folder / MARK).touch()
    _held.add(folder)
    return folder


def _remove(folder: Path) -> None:
    _held.discard(folder)
    shutil.rmtree(folder, ignore_errors=True)


@cache
def _remove_abandoned() -> None:
    """Remove the folders of processes that were killed; what can't be looked at or removed is left."""
    with contextlib.suppress(OSError), os.scandir(tempfile.gettempdir()) as entries:
        for entry in entries:
            if entry.name.startswith(PREFIX):
                with contextlib.suppress(OSError):
                    _remove_if_abandoned(Path(entry.path))


def _remove_if_abandoned(folder: Path) -> None:
    found = os.lstat(folder)  # nothing is removed through a link
    if not stat.S_ISDIR(found.st_mode) or (os.name == "posix" and found.st_uid != os.getuid()):
        return
    if time.time() - os.lstat(folder / MARK).st_mtime > ABANDONED_S:
        shutil.rmtree(folder, ignore_errors=True)
