"""Run by `test_interrupted_writes` under failing_calls.c: each write in a process of its own, which fails at one call.

Prints a line of JSON per write: job, how it failed, at which call, what the writer said, what stood there afterwards,
and what stood there after the next run.
"""

import ctypes
import json
import os
import shutil
import signal
import sys
from pathlib import Path

from dzdesign.core.artefact_files import write_file, write_files, write_folder
from dzdesign.core.errors import InputError

WAYS = {"ENOSPC": 1, "EIO": 2, "SIGKILL": 3, "SIGINT": 4}
SHIM = ctypes.CDLL(None)
SHIM.dz_seen.restype = ctypes.c_long
FIRMWARE = {"schema": "dzdesign.firmware/1"}
BIG = "x" * 300_000  # more than one buffer


def old_file(place: Path) -> None:
    (place / "valve.json").write_text('{"schema": "dzdesign.valve/1", "old": 1}')


def new_file(place: Path) -> None:
    write_file(place / "valve.json", '{"schema": "dzdesign.valve/1", "new": "' + BIG + '"}', "dzdesign.valve/1")


def old_plots(place: Path) -> None:
    (place / "plots").mkdir()
    (place / "plots" / "a.svg").write_text("old a")


def new_plots(place: Path) -> None:
    write_files(place / "plots", {"a.svg": b"new a", "b.svg": b"new b"}, "--plots")


def old_folder(place: Path) -> None:
    write_folder(place / "firmware", {"core/a.c": "old a", "core/gone.c": "old"}, FIRMWARE)
    (place / "firmware" / "core" / "notes.txt").write_text("mine")
    (place / "firmware" / "link").symlink_to("core")


def new_folder(place: Path) -> None:
    write_folder(place / "firmware", {"core/a.c": "new a", "core/b.c": BIG}, FIRMWARE)


def nothing(place: Path) -> None:
    """Leave the place empty: the first run."""


JOBS = {
    "file": (old_file, new_file),
    "first file": (nothing, new_file),
    "plots": (old_plots, new_plots),
    "folder": (old_folder, new_folder),
    "first folder": (nothing, new_folder),
}


def tree(place: Path) -> dict[str, str]:
    """Return what stands in a place: path to content or target, of long contents the length."""
    return {
        path.relative_to(place).as_posix(): os.readlink(path) if path.is_symlink() else path.read_text()[:200]
        for path in sorted(place.rglob("*"))
        if path.is_symlink() or path.is_file()
    }


def in_a_process(work) -> int:
    child = os.fork()
    if not child:
        status = 3
        try:
            status = work()
        finally:
            os._exit(status)
    return os.waitpid(child, 0)[1]


def said(job, place: Path, at: int, how: int) -> int:
    SHIM.dz_arm(ctypes.c_long(at), ctypes.c_int(how))
    try:
        job(place)
        status = 0
    except InputError:
        status = 2
    except KeyboardInterrupt:
        status = 4
    calls = SHIM.dz_seen()
    (place.parent / "calls").write_text(str(calls))
    return status


def main() -> None:
    # A shell that starts the tests in the background has them ignore an interrupt.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    scratch = Path(sys.argv[1])
    place = scratch / "place"
    for name, (old, new) in JOBS.items():
        trees = {}
        for which, jobs in (("old", [old]), ("new", [old, new])):
            place.mkdir()
            for job in jobs:
                job(place)
            trees[which] = tree(place)
            if which == "old":
                in_a_process(lambda new=new: said(new, place, 0, 0))
                calls = int((scratch / "calls").read_text())
            shutil.rmtree(place)
        print(json.dumps({"job": name, "calls": calls, **trees}))
        for way, how in WAYS.items():
            if way == "EIO" and "file" not in name:  # told from a full disk by nothing but its words
                continue
            for at in range(1, calls + 1):
                place.mkdir()
                old(place)
                status = in_a_process(lambda new=new, at=at, how=how: said(new, place, at, how))
                after = tree(place)
                status_again = in_a_process(lambda new=new: said(new, place, 0, 0))
                row = {"job": name, "way": way, "at": at, "status": status, "after": after}
                print(json.dumps({**row, "status_again": status_again, "again": tree(place)}))
                shutil.rmtree(place)


if __name__ == "__main__":
    main()
