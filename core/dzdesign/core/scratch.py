"""Temporary folders of a process; those of a killed process are removed by the next one.

Each is held by a lock that ends with its process, however that ends.
"""

import atexit
import contextlib
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

from dzdesign.core.errors import InputError

#: How the folders are called, in the system's folder for temporary files. A folder is hidden until its lock is held.
PREFIX, HIDDEN = "dzdesign-run-", ".dzdesign-run-"
#: How one is called from the moment that its mark goes.
GONE = ".dzdesign-gone-"
#: A hidden folder of this age was left by a process that was killed before it held the lock.
ABANDONED_S = 60.0
#: File by which a folder is known as made here; without it none is ever removed. Windows locks no folder, but deletes
#: none with an open file: this one.
MARK = ".dzdesign-scratch"

#: The folders of this process, and what ends their locks.
_held: dict[Path, Callable[[], None]] = {}


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
    if os.name != "posix":
        folder = Path(os.path.realpath(tempfile.mkdtemp(prefix=PREFIX)))
        _held[folder] = open(folder / MARK, "xb").close  # noqa: SIM115
        return folder
    hidden = Path(os.path.realpath(tempfile.mkdtemp(prefix=HIDDEN)))
    (hidden / MARK).touch()
    lock = _lock(hidden)
    folder = hidden.with_name(PREFIX + hidden.name.removeprefix(HIDDEN))
    hidden.rename(folder)
    _held[folder] = lambda: None if lock is None else os.close(lock)
    return folder


def _remove(folder: Path) -> None:
    """Remove a folder of this process; the lock goes last where it can, so that nobody else removes it too."""
    unlock = _held.pop(folder, None)
    if unlock is None:
        return
    if os.name != "posix":
        unlock()
    _remove_whole(folder)
    if os.name == "posix":
        unlock()


def _remove_whole(folder: Path) -> None:
    """Remove a folder as far as it can be, its mark last: one that is left half removed is known by it.

    Without its mark an empty folder is known by its name, which no other than one that is removed here has.
    """
    with contextlib.suppress(OSError):
        if os.name != "posix":
            _remove_inside(folder, None)
            shutil.rmtree(folder, ignore_errors=True)
            return
        place = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        try:
            _remove_inside(folder, place)
            if set(os.listdir(place)) <= {MARK}:
                gone = folder.with_name(GONE + folder.name.rpartition("-")[2])
                os.rename(folder, gone)
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(MARK, dir_fd=place)
                os.rmdir(gone)
        finally:
            os.close(place)


def _remove_inside(folder: Path, place: int | None) -> None:
    """Remove what lies in a folder but its mark; through its descriptor where there are such: no link leads away."""
    for name in os.listdir(folder if place is None else place):
        if name == MARK:
            continue
        entry = name if place is not None else folder / name
        try:
            os.unlink(entry, dir_fd=place)
        except OSError:  # a folder
            shutil.rmtree(entry, ignore_errors=True, dir_fd=place)


@cache
def _remove_abandoned() -> None:
    """Remove the folders of processes that were killed; what can't be looked at or removed is left."""
    with contextlib.suppress(OSError), os.scandir(tempfile.gettempdir()) as entries:
        for entry in entries:
            if entry.name.startswith((PREFIX, HIDDEN, GONE)):
                with contextlib.suppress(OSError):
                    _remove_if_abandoned(Path(entry.path))


def _remove_if_abandoned(folder: Path) -> None:
    if os.name != "posix":
        os.unlink(folder / MARK)  # an error while its process lives, or where there is none
        shutil.rmtree(folder, ignore_errors=True)
        return
    found, marked = os.lstat(folder), os.path.lexists(folder / MARK)
    if found.st_uid != os.getuid() or not stat.S_ISDIR(found.st_mode):
        return
    young = folder.name.startswith(HIDDEN) and time.time() - found.st_mtime < ABANDONED_S
    if young or (not marked and folder.name.startswith(PREFIX)):
        return
    if not marked:  # killed before the mark was made, or after it was removed; one in which anything lies stays
        os.rmdir(folder)
        return
    lock = _lock(folder)
    if lock is not None:
        _remove_whole(folder)
        os.close(lock)


def _lock(folder: Path) -> int | None:
    """Return the held lock of a folder as a descriptor; None where another process holds it."""
    import fcntl

    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor
