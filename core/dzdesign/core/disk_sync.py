"""What is written reaches the disk before its name says that it is there: a power cut leaves the old or the new.

A rename may reach the disk before the content of what is renamed; after a power cut the name then leads to empty files.
Everything that is written whole is therefore synced in this order: its files, its folders, then the rename, then the
folder that holds the name.
"""

import contextlib
import os
from pathlib import Path

#: Windows opens no folder; its file systems write names and their changes into a journal in order.
FOLDERS_OPEN = os.name == "posix"


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
    if not FOLDERS_OPEN:
        return
    with contextlib.suppress(OSError):  # no right to read the folder, or a network's file system without such a call
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
