"""GNU Octave as a process: where it is, and what runs in it, in a folder of its own and with nothing of the user's."""

import os
import re
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes.programs import find_program
from dzdesign.core.processes.running import run_program
from dzdesign.verify.toolchain.child_process import run_child

PROGRAMS = Path(str(files("dzdesign.verify.matlab"))) / "programs"
#: The one without a window first.
NAMES = ("octave-cli", "octave")
#: No file of the user's or the site's is run, and nothing of the run is kept.
FLAGS = ("--norc", "--no-init-file", "--no-site-file", "--no-history", "--no-window-system", "--quiet")
MISSING = "GNU Octave not found; install it (Debian: apt install octave) to have the function itself run"
#: A run that takes longer hangs, s.
TIMEOUT_S = 600.0
#: Characters of what Octave says that a sentence has.
LONGEST = 300


def find_octave() -> str | None:
    """Return the path of Octave, or None."""
    return next((path for name in NAMES if (path := find_program(name))), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Octave:
    """Octave on this machine: its path, and as what its version stands in the evidence; or why it can't be run."""

    path: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    missing: str = ""


def available_octave() -> Octave:
    """Return Octave where it runs."""
    path = find_octave()
    if path is None:
        return Octave(missing=MISSING)
    try:
        done = run_program([path, "--version"], timeout=60.0)
    except (OSError, subprocess.TimeoutExpired) as error:
        return Octave(missing=f"'{path}' does not run: {error}")
    found = re.search(r"GNU Octave, version (\S+)", done.stdout)
    if found is None:
        return Octave(missing=f"'{path} --version' does not say that it is GNU Octave; install it anew")
    return Octave(path=path, versions={"octave": f"GNU Octave {found.group(1)}"})


def run_octave(
    path: str, program: str, arguments: Sequence[str], folder: Path, functions: int = 1
) -> str:
    """Run a program of this room in a folder and return what it prints; if it fails or hangs, `RequirementError`.

    It has the time of so many functions.
    """
    command = [path, *FLAGS, str(PROGRAMS / program), *arguments]
    ended = run_child(command, "Octave", TIMEOUT_S * functions, place=folder, environment=_environment(folder))
    if ended.reason:
        said = " ".join((ended.complaint or ended.printed).split())[:LONGEST]
        raise RequirementError(f"Octave ended with {ended.reason}: {said}")
    return ended.printed


def _environment(folder: Path) -> Mapping[str, str]:
    """Return an environment in which Octave finds no settings and no other functions of the user's."""
    # It does little linear algebra, and a thread of a library for each core would only wait.
    own = {name: value for name, value in os.environ.items() if name == "OCTAVE_HOME" or not name.startswith("OCTAVE")}
    return {**own, "HOME": str(folder), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
