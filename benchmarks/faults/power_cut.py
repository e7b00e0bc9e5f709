"""Power cuts: what a command that writes a folder leaves on the disk when the machine stops at any moment.

A file system lies in an image file. While a command writes there, the image is copied as it is at that moment: what the
system still held in memory is not in the copy, as after a power cut. The copy is mounted, and each artefact in it must
be the old one or the new one, whole. Needs root and loop devices (Linux).
"""

import contextlib
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from dzdesign.core.input_files import json_object

#: The program, as it is installed.
PROGRAM = str(Path(sys.executable).with_name("dzdesign"))
#: MiB of the file system; a copy takes some hundredths of a second.
IMAGE_MIB = 96
#: How a folder is called that is not in its place yet.
UNPLACED = ".dzdesign-new-"
#: When the power goes, in turn.
MOMENTS = ("writing", "ended", "writing", "later", "writing")
#: ext4 writes its journal every 5 s.
JOURNAL_S = 7
#: For so many seconds after its end no process of a command may be left.
PATIENCE_S = 5
#: Longest time from the first sign of writing to the cut, in s.
LONGEST_S = 0.15
Tree = dict[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """What one power cut left of one command's artefacts."""

    command: str
    during: str
    left: str
    made_again: bool


@contextlib.contextmanager
def mounted(image: Path, place: Path) -> Iterator[Path]:
    """Give the folder in which an image's file system is mounted."""
    place.mkdir(exist_ok=True)
    subprocess.run(["mount", "-o", "loop", image, place], check=True)
    try:
        yield place
    finally:
        for _ in range(PATIENCE_S):  # processes of a command may end a moment after it
            if subprocess.run(["umount", place], check=False, capture_output=True).returncode == 0:
                break
            time.sleep(1)
        else:
            subprocess.run(["umount", "--lazy", place], check=True)
            raise SystemExit(f"a process still worked in {place} {PATIENCE_S} s after its command")


def new_image(path: Path) -> None:
    """Make an image with an empty ext4."""
    with open(path, "wb") as file:
        file.truncate(IMAGE_MIB << 20)
    subprocess.run(["mkfs.ext4", "-q", "-F", path], check=True)


def tree(folder: Path) -> Tree:
    """Return each file's name and hash, of what is in its place."""
    return {
        path.relative_to(folder).as_posix(): sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and UNPLACED not in path.as_posix()
    }


def artefacts(found: Tree, units: tuple[str, ...]) -> dict[str, Tree]:
    """Return the files of each artefact: those below the folders that are written whole, each other file alone."""
    parts: dict[str, Tree] = {}
    for name, digest in found.items():
        unit = next((unit for unit in units if name.startswith(f"{unit}/")), name)
        parts.setdefault(unit, {})[name] = digest
    return parts


def judged(place: Path, old: Tree, new: Tree, job: "Job") -> str:
    """Say what is left: the old or the new of each artefact, or what is neither."""
    found, units = tree(place), job.units
    parts, before, after = (artefacts(each, units) for each in (found, old, new))
    kinds = set()
    for unit in sorted({*parts, *before, *after}):
        there = parts.get(unit, {})
        if there == before.get(unit, {}) == after.get(unit, {}):  # an input
            continue
        if there == after.get(unit, {}):
            kinds.add("new")
        elif there == before.get(unit, {}):
            kinds.add("old")
        elif unit in job.on_the_way and json_object(place / unit):
            kinds.add("on the way")
        else:
            return f"BROKEN: {unit}"
    return " and ".join(sorted(kinds))


def cut_at(command: list[str], place: Path, image: Path, copy: Path, delay: float, when: str) -> None:
    """Run a command in `place` and copy the image at one moment: while it writes, when it has ended, or later.

    Later the system has written the names into its journal by itself, of the contents perhaps nothing.
    """
    process = subprocess.Popen(command, cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    copied = False
    while when == "writing" and process.poll() is None and not copied:
        if any(name.startswith(UNPLACED) for _, names, files in os.walk(place) for name in (*names, *files)):
            time.sleep(delay)
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGSTOP)
            shutil.copyfile(image, copy)
            copied = True
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGCONT)
        time.sleep(0.0005)
    status = process.wait()
    if when == "later":
        time.sleep(JOURNAL_S)
    if not copied:
        shutil.copyfile(image, copy)
    if status not in (0, 1):
        raise SystemExit(f"{' '.join(command)} ended with status {status}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """A command that writes folders, from an old state to a new one; both are made by commands in the same folder."""

    name: str
    #: Without one, nothing is there before.
    old: tuple[str, ...]
    new: tuple[str, ...]
    #: Folders that are written whole.
    units: tuple[str, ...]
    #: JSON files that have a third state, while the command works.
    on_the_way: tuple[str, ...] = ()
    #: What an artefact is made from, copied beside it.
    inputs: tuple[Path, ...]
    #: Whether the command leaves what it has made alone, with status 2.
    refused_again: bool = False

    def ends_well(self, status: int, left: str) -> bool:
        """Tell whether the status is that of a command which made its artefacts, or found them made."""
        return status in (0, 1) or (status == 2 and self.refused_again and left == "new")


def run_job(job: Job, folder: Path, cuts: int, rng: random.Random) -> list[Cut]:
    """Cut the power of a job so many times; the last step of each is the same command again, on what was left."""
    base, image, copy = folder / "base.img", folder / "disk.img", folder / "cut.img"
    new_image(base)
    with mounted(base, folder / "mount") as place:
        for path in job.inputs:
            (shutil.copytree if path.is_dir() else shutil.copy)(path, place / path.name)
        if job.old:
            subprocess.run([PROGRAM, *job.old], cwd=place, check=False, capture_output=True)
        old = tree(place)
    found = []
    for number in range(cuts):
        when = MOMENTS[number % len(MOMENTS)]
        shutil.copyfile(base, image)
        with mounted(image, folder / "mount") as place:
            cut_at([PROGRAM, *job.new], place, image, copy, LONGEST_S * rng.random() ** 3, when)
            new = tree(place)
        with mounted(copy, folder / "mount") as place:
            left = judged(place, old, new, job)
            if when != "writing" and left != "new":
                left = f"BROKEN: ended well, and left the {left}"
            again = subprocess.run([PROGRAM, *job.new], cwd=place, capture_output=True, check=False)
            made = job.ends_well(again.returncode, left) and judged(place, old, new, job) == "new"
            made = made and not any(UNPLACED in path.as_posix() for path in place.rglob("*"))
        found.append(Cut(command=job.name, during=when, left=left, made_again=made))
    return found
