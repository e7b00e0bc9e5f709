"""Kills: commands that are ended at random times leave whole artefacts, no process and, after the next run, no folder.

Linux: the processes of a command are found by the folder for temporary files in their environment. Some have a session
of their own.
"""

import contextlib
import os
import random
import shutil
import signal
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from power_cut import PROGRAM, UNPLACED, Job, judged, tree

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP)
#: For so long after the end of a command its processes may still be there, in s.
PATIENCE_S = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Kill:
    """What one kill left."""

    command: str
    #: Whether something was being written, or whether the command had ended by itself before.
    writing: bool
    ended_before: bool
    left: str
    processes_left: int
    made_again: bool
    folders_left: tuple[str, ...]


def run_kills(job: Job, folder: Path, kills: int, rng: random.Random) -> list[Kill]:
    """Kill a job so many times, each from its old state, and run it again on what was left."""
    base, temporary = folder / "base", folder / "tmp"
    for each in (base, temporary):
        shutil.rmtree(each, ignore_errors=True)
        each.mkdir(parents=True)
    for path in job.inputs:
        (shutil.copytree if path.is_dir() else shutil.copy)(path, base / path.name)
    if job.old:
        _run(job.old, base, temporary)
    old = tree(base)
    begun = time.monotonic()
    new = _new_of(job, folder, temporary)
    lasts = time.monotonic() - begun
    return [_one(job, folder, number, rng, lasts, old, new) for number in range(kills)]


def _new_of(job: Job, folder: Path, temporary: Path) -> dict[str, str]:
    place = _copied(folder)
    _run(job.new, place, temporary)
    return tree(place)


def _copied(folder: Path) -> Path:
    place = folder / "place"
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(folder / "base", place)
    return place


def _run(words: tuple[str, ...], place: Path, temporary: Path) -> int:
    environment = {**os.environ, "TMPDIR": str(temporary)}
    return subprocess.run([PROGRAM, *words], cwd=place, env=environment, capture_output=True, check=False).returncode


def _one(
    job: Job, folder: Path, number: int, rng: random.Random, lasts: float, old: dict[str, str], new: dict[str, str]
) -> Kill:
    place, temporary = _copied(folder), folder / "tmp"
    process = subprocess.Popen(
        [PROGRAM, *job.new], cwd=place, env={**os.environ, "TMPDIR": str(temporary)}, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    writing = False
    if number % 3:  # two of three while something is written
        while process.poll() is None and not writing:
            writing = _is_writing(place)
            time.sleep(0.0005)
        time.sleep(0.02 * rng.random() ** 3)
        writing = writing and process.poll() is None
    else:
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(lasts * rng.random())
    ended_before = process.poll() is not None
    with contextlib.suppress(ProcessLookupError):
        process.send_signal(SIGNALS[number % len(SIGNALS)])
    process.wait()
    end = time.monotonic() + PATIENCE_S
    while (left := _processes_of(temporary)) and time.monotonic() < end:
        time.sleep(0.05)
    state = judged(place, old, new, job)
    _run(job.new, place, temporary)
    litter = [path.name for path in temporary.iterdir()] + [path.name for path in place.rglob(f"{UNPLACED}*")]
    return Kill(
        command=job.name,
        writing=writing,
        ended_before=ended_before,
        left=state,
        processes_left=len(left),
        made_again=judged(place, old, new, job) == "new",
        folders_left=tuple(litter),
    )


def _is_writing(place: Path) -> bool:
    return any(name.startswith(UNPLACED) for _, folders, files in os.walk(place) for name in (*folders, *files))


def _processes_of(temporary: Path) -> list[int]:
    """Return the processes with that folder for temporary files; one that has ended has no environment any more."""
    named = f"TMPDIR={temporary}".encode()
    found = []
    for path in Path("/proc").iterdir():
        if path.name.isdigit():
            with contextlib.suppress(OSError):
                if named in (path / "environ").read_bytes().split(b"\0"):
                    found.append(int(path.name))
    return found
