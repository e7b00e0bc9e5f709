"""What is written reaches the disk before its name says that it is there: a power cut leaves the old or the new.

A rename may reach the disk before the content of what is renamed; after a power cut the name then leads to empty files.
Everything that is written whole is therefore synced in this order: its files, its folders, then the rename, then the
folder that holds the name.
"""

import contextlib
import os
import secrets
import shutil
import time
from hashlib import sha256
from pathlib import Path

#: How files and folders are called until they are put in their place.
UNPLACED = ".dzdesign-new-"
#: How a place is called in which an old folder waits until the new one stands.
RETIRED = ".dzdesign-old-"
#: What waits for its place for longer was left by a process that was killed, s.
ABANDONED_S = 3600.0
#: Windows opens no folder; its file systems write names and their changes into a journal in order.
FOLDERS_OPEN = os.name == "posix"


def beside(path: Path) -> Path:
    """Return a name beside `path` that nothing has; hidden, and short, for a file's name may be as long as can be."""
    return path.parent / f"{UNPLACED}{secrets.token_hex(6)}"


def remove_abandoned(folder: Path) -> None:
    """Remove what a killed process had begun to write in `folder`."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            if not entry.name.startswith(UNPLACED):
                continue
            with contextlib.suppress(OSError):
                if time.time() - entry.stat(follow_symlinks=False).st_mtime < ABANDONED_S:
                    continue
                if entry.is_dir(follow_symlinks=False):
                    shutil.rmtree(entry.path, ignore_errors=True)
                else:
                    os.unlink(entry.path)


def put_in_place(staging: Path, folder: Path) -> None:
    """Put `staging` in the place of `folder`, which exists and goes.

    In two steps: between them a kill leaves the old folder beside its place, from where `bring_back` fetches it.
    """
    retired = _retired(folder)
    old = retired / "old"
    retired.mkdir(exist_ok=True)
    try:
        os.replace(folder, old)
        os.replace(staging, folder)
        sync_folder(folder.parent)  # before the old one is removed: the removal must not reach the disk alone
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


def sync_file(path: Path) -> None:
    """Wait until a file's content is on the disk."""
    # Windows syncs only what is open for writing, Linux also what is read-only.
    try:
        descriptor = os.open(path, os.O_RDONLY if FOLDERS_OPEN else os.O_RDWR)
    except PermissionError:
        if FOLDERS_OPEN:
            raise
        return  # a read-only file that was carried over, as of a version control's store
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sync_folder(path: Path) -> None:
    """Wait until the names in a folder are on the disk; a system or file system that can't is not an error."""
    if FOLDERS_OPEN:
        with contextlib.suppress(OSError):  # no right to read it, or a network's file system without such a call
            sync_file(path)


def make_folder(path: Path) -> None:
    """Make a folder and those above it, if they are missing, and wait until the new names are on the disk.

    Without this a power cut may take what was synced in them: no name leads there.
    """
    missing = []
    while not path.is_dir():
        missing.append(path)
        if path == path.parent:
            break
        path = path.parent
    for each in reversed(missing):
        each.mkdir(exist_ok=True)
        sync_folder(each.parent)


def sync_tree(folder: Path) -> None:
    """Wait until all files in a folder, and the folder itself, are on the disk; what a link leads to is not touched."""
    for place, _, names in os.walk(folder, topdown=False):
        for name in names:
            path = Path(place) / name
            if path.is_file() and not path.is_symlink():
                sync_file(path)
        sync_folder(Path(place))
