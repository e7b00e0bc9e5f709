"""What is written reaches the disk before its name says that it is there: a power cut leaves the old or the new.

A rename may reach the disk before the content of what is renamed; after a power cut the name then leads to empty files.
Everything that is written whole is therefore synced in this order: its files, its folders, then the rename, then the
folder that holds the name. Temporary folders go with their process, and need none of this.
"""

import atexit
import contextlib
import os
import secrets
import shutil
import tempfile
import time
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from pathlib import Path

from dzdesign.core.errors import InputError

#: How files and folders are called until they are put in their place, and folders in that for temporary files.
UNPLACED, SCRATCH = ".dzdesign-new-", ".dzdesign-tmp-"
#: How an old folder is called until the new one stands.
RETIRED = ".dzdesign-old-"
#: Of this age it was left by a process that was killed, s: no command runs for three days.
ABANDONED_S = 3 * 86_400.0
#: Windows opens no folder; its file systems write names and their changes into a journal in order.
FOLDERS_OPEN = os.name == "posix"

#: The temporary folders of this process.
_held: set[Path] = set()


@contextlib.contextmanager
def scratch_folder() -> Iterator[Path]:
    """Create a temporary folder that is removed at the end of the context."""
    try:
        place = tempfile.gettempdir()
    except FileNotFoundError as error:
        raise InputError(
            "no folder for temporary files can be written into; set TMPDIR to one that can, and make room there"
        ) from error
    remove_abandoned(Path(place), SCRATCH)
    folder = Path(os.path.realpath(tempfile.mkdtemp(prefix=SCRATCH)))
    _held.add(folder)
    try:
        yield folder
    finally:
        _held.discard(folder)
        shutil.rmtree(folder, ignore_errors=True)


@cache
def process_folder() -> Path:
    """Return a temporary folder that is removed when this process ends."""
    stack = contextlib.ExitStack()
    atexit.register(stack.close)
    return stack.enter_context(scratch_folder())


def is_scratch(path: Path) -> bool:
    """Tell whether a path lies in a temporary folder of this process: no power cut matters to it."""
    place = Path(os.path.realpath(path))
    return any(folder == place or folder in place.parents for folder in _held)


def remove_scratch() -> None:
    """Remove the folders of this process now, before it ends by a way on which nothing else is done."""
    for folder in list(_held):
        shutil.rmtree(folder, ignore_errors=True)


def remove_abandoned(folder: Path, prefix: str = UNPLACED) -> None:
    """Remove what a killed process had begun to write in `folder`; nothing is removed through a link."""
    with contextlib.suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            with contextlib.suppress(OSError):
                if not entry.name.startswith(prefix):
                    continue
                if time.time() - entry.stat(follow_symlinks=False).st_mtime < ABANDONED_S:
                    continue
                if entry.is_dir(follow_symlinks=False):
                    shutil.rmtree(entry.path, ignore_errors=True)
                else:
                    os.unlink(entry.path)


def beside(path: Path) -> Path:
    """Return a name beside `path` that nothing has; hidden, and short, for a file's name may be as long as can be."""
    return path.parent / f"{UNPLACED}{secrets.token_hex(6)}"


def put_in_place(new: Path, place: Path) -> None:
    """Put a file or a folder in its place; what was there goes.

    A folder that was there goes in two steps: between them a kill leaves it beside its place, from where `bring_back`
    fetches it.
    """
    durable, retired = not is_scratch(place), _retired(place)
    if durable:
        _sync_content(new)
    try:
        if place.is_dir():
            os.replace(place, retired)
        os.replace(new, place)
        if durable:  # before the old one is removed: the removal must not reach the disk alone
            sync_folder(place.parent)
    except BaseException:
        bring_back(place)
        raise
    shutil.rmtree(retired, ignore_errors=True)


def bring_back(folder: Path) -> None:
    """Undo the first of two steps, if a process was killed between them; clear away what is left of the second."""
    retired = _retired(folder)
    if not retired.is_dir():
        return
    if os.path.lexists(folder):
        shutil.rmtree(retired, ignore_errors=True)
    else:
        os.replace(retired, folder)


def _retired(folder: Path) -> Path:
    """Return where a folder stands between two steps: a name that no person gives, and short, as of `beside`."""
    return folder.parent / f"{RETIRED}{sha256(os.fsencode(folder.name)).hexdigest()[:16]}"


def _sync_file(path: Path) -> None:
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
            _sync_file(path)


def make_folder(path: Path) -> None:
    """Make a folder and those above it, if they are missing, and wait until the new names are on the disk.

    Without this a power cut may take what was synced in them: no name leads there.
    """
    if not path.is_dir():
        if path != path.parent:
            make_folder(path.parent)
        path.mkdir(exist_ok=True)
        sync_folder(path.parent)


def _sync_content(path: Path) -> None:
    """Wait until a file, or all in a folder, is on the disk; what a link leads to is not touched."""
    if path.is_file():
        _sync_file(path)
    for place, _, names in os.walk(path, topdown=False):
        for each in (Path(place) / name for name in names):
            if each.is_file() and not each.is_symlink():
                _sync_file(each)
        sync_folder(Path(place))
