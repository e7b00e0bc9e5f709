"""Putting a finished folder in the place of another, so that at every moment one of the two stands there whole."""

import contextlib
import ctypes
import errno
import os
import secrets
import shutil
import sys
import threading
import time
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

from dzdesign.core.disk_sync import sync_folder
from dzdesign.core.scratch import is_scratch

#: Of renameat2 (Linux) and renamex_np (macOS); both systems number it so. Paths are relative to the working folder.
EXCHANGE, HERE = 2, -100
#: What a system or a file system says that has no such step.
UNKNOWN = (errno.EINVAL, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
#: How files and folders are called until they are put in their place.
UNPLACED = ".dzdesign-new-"
#: How a place is called in which an old folder waits until the new one stands.
RETIRED = ".dzdesign-old-"
#: Where a system has no locks, one of this age was left by a process that was killed.
ABANDONED_S = 86400.0
#: The folders that a thread is alone in.
_held = threading.local()
#: Another dzdesign holds a folder for less than this.
LOCK_PATIENCE_S = 30.0


def beside(path: Path) -> Path:
    """Return a name beside `path` that nothing has; hidden, and short, for a file's name may be as long as can be."""
    return path.parent / f"{UNPLACED}{secrets.token_hex(6)}"


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[bool]:
    """Keep other processes of dzdesign from writing in `folder` meanwhile; False where the system has no such locks.

    The lock goes with the process, however it ends; no file is made for it. If another one holds it for
    `LOCK_PATIENCE_S`, that is an OSError. Within a thread it may be held twice.
    """
    place = os.path.realpath(folder)
    mine = _held.__dict__.setdefault("folders", set())
    if place in mine:
        yield True
        return
    if is_scratch(folder):  # no other process writes there, and its lock says that the folder is in use
        yield False
        return
    with _locked(folder) as held:
        if held:
            mine.add(place)
        try:
            yield held
        finally:
            mine.discard(place)


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[bool]:
    try:
        import fcntl
    except ImportError:  # Windows: of two writers, one is refused by the system or the later one stays
        yield False
        return
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except PermissionError:  # a folder may be written into that can't be listed
        yield False
        return
    try:
        end, held = time.monotonic() + LOCK_PATIENCE_S, False
        while not held:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                held = True
            except BlockingIOError as error:
                if time.monotonic() > end:
                    raise OSError(errno.EBUSY, f"another dzdesign is writing in '{folder}'") from error
                time.sleep(0.02)
            except OSError:  # a network's file system without locks
                break
        yield held
    finally:
        os.close(descriptor)


def remove_abandoned(folder: Path, *, alone: bool) -> None:
    """Remove what a killed process had begun to write in `folder`, from within `alone_in`, which says if we are."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if not entry.name.startswith(UNPLACED):
                continue
            with contextlib.suppress(OSError):
                if not alone and time.time() - entry.stat(follow_symlinks=False).st_mtime < ABANDONED_S:
                    continue
                if entry.is_dir(follow_symlinks=False):
                    shutil.rmtree(entry.path, ignore_errors=True)
                else:
                    os.unlink(entry.path)


def put_in_place(staging: Path, folder: Path) -> None:
    """Put `staging` in the place of `folder`, which exists; what was there stands at `staging` then, or is gone.

    In one step where the system has one. Elsewhere in two, and between them a kill leaves the old folder beside its
    place, from where `bring_back` fetches it.
    """
    if exchanged(staging, folder):
        return
    retired = _retired(folder)
    old = retired / "old"
    retired.mkdir(exist_ok=True)
    try:
        os.replace(folder, old)
        os.replace(staging, folder)
        sync_folder(folder.parent)  # before the old one is removed
    except BaseException:
        if old.exists() and not folder.exists():
            os.replace(old, folder)
        with contextlib.suppress(OSError):  # not empty if the old one could not come back: then it stays there
            retired.rmdir()
        raise
    shutil.rmtree(retired, ignore_errors=True)


def _retired(folder: Path) -> Path:
    """Return where a folder stands between two steps: a name that no person gives, and short, as of `beside`."""
    return folder.parent / f"{RETIRED}{sha256(os.fsencode(folder.name)).hexdigest()[:16]}"


def bring_back(folder: Path) -> None:
    """Undo the first of two steps, if a process was killed between them; clear away what is left of the second."""
    retired = _retired(folder)
    if not retired.is_dir():
        return
    if not os.path.lexists(folder) and (retired / "old").is_dir():
        os.replace(retired / "old", folder)
    shutil.rmtree(retired, ignore_errors=True)


def exchanged(one: Path, other: Path) -> bool:
    """Exchange two folders in one step; return False, with nothing done, where the system has no such step."""
    if sys.platform == "win32":
        return False
    library = ctypes.CDLL(None, use_errno=True)
    first, second = os.fsencode(one), os.fsencode(other)
    if hasattr(library, "renameat2"):
        failed = library.renameat2(HERE, first, HERE, second, EXCHANGE)
    elif hasattr(library, "renamex_np"):
        failed = library.renamex_np(first, second, EXCHANGE)
    else:
        return False
    if not failed:
        return True
    number = ctypes.get_errno()
    if number in UNKNOWN:
        return False
    raise OSError(number, os.strerror(number), str(other))
