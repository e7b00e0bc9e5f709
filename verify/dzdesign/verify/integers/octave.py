"""GNU Octave as a process that evaluates a function for MATLAB, block after block of inputs."""

import os
import re
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from threading import Lock, Timer

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes.programs import find_program
from dzdesign.core.processes.running import run_program
from dzdesign.core.scratch import scratch_folder

PROGRAM = Path(__file__).parent / "programs" / "answers_of.m"
#: The one without a window first.
NAMES = ("octave-cli", "octave")
#: No file of the user's or the site's is run, and nothing of the run is kept.
FLAGS = ("--norc", "--no-init-file", "--no-site-file", "--no-history", "--no-window-system", "--quiet")
MISSING = "GNU Octave not found; install it (Debian: apt install octave) to have the function itself run"
#: A block of inputs that takes longer hangs, s; and so many characters of what Octave says are told.
TIMEOUT_S, LONGEST = 120.0, 300
OUTPUTS = ("compare", "status", "beta")


@dataclass(frozen=True, slots=True, kw_only=True)
class Octave:
    """Octave on this machine: its path, and as what its version stands in the evidence; or why it can't be run."""

    path: str = ""
    versions: Mapping[str, str] = field(default_factory=dict)
    missing: str = ""


def available_octave() -> Octave:
    """Return Octave where it runs."""
    path = next((found for name in NAMES if (found := find_program(name))), None)
    if path is None:
        return Octave(missing=MISSING)
    try:
        done = run_program([path, "--version"], timeout=60.0)
    except (OSError, subprocess.TimeoutExpired) as error:
        return Octave(missing=f"'{path}' does not run: {error}")
    version = re.search(r"GNU Octave, version (\S+)", done.stdout)
    if version is None:
        return Octave(missing=f"'{path} --version' does not say that it is GNU Octave; install it anew")
    return Octave(path=path, versions={"octave": f"GNU Octave {version[1]}"})


class RunningFunction:
    """A function in a running Octave; one that ends or hangs is a `RequirementError`."""

    def __init__(self, process: "subprocess.Popen[bytes]", complaints: Path, name: str) -> None:
        self.process, self.complaints, self.name, self.lock = process, complaints, name, Lock()

    def run(self, given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return compare, status and beta at codes u, p_a, p_b, which broadcast against each other."""
        codes = np.broadcast_arrays(*(given[name] for name in ("u", "p_a", "p_b")))
        size, to, back = codes[0].size, self.process.stdin, self.process.stdout
        if to is None or back is None:
            raise RequirementError(f"{self.name}.m has no pipe to Octave")
        content = b"".join(np.ascontiguousarray(each, dtype="<u2").tobytes() for each in codes)
        with self.lock:
            watch = Timer(TIMEOUT_S, self.process.kill)
            watch.start()
            try:
                to.write(np.array([size], dtype="<u4").tobytes() + content)
                to.flush()
                answers = back.read(2 * len(OUTPUTS) * size)
            except OSError:  # it has ended: what it says tells why
                answers = b""
            finally:
                watch.cancel()
        if len(answers) != 2 * len(OUTPUTS) * size:
            self.process.kill()
            self.process.wait()
            said = " ".join(self.complaints.read_text(encoding="utf-8", errors="replace").split())[:LONGEST]
            raise RequirementError(f"{self.name}.m gave no answer in Octave: {said or 'it hangs'}")
        rows = np.frombuffer(answers, dtype="<u2").reshape(len(OUTPUTS), *codes[0].shape)
        return {name: row.astype(np.int64) for name, row in zip(OUTPUTS, rows, strict=True)}


@contextmanager
def running(path: str, name: str, text: bytes) -> Iterator[RunningFunction]:
    """Give a function with this text in Octave, in a folder of its own and with nothing of the user's."""
    with scratch_folder() as place:
        (place / f"{name}.m").write_bytes(text)
        (place / PROGRAM.name).write_bytes(PROGRAM.read_bytes())
        # It does little linear algebra, and a thread of a library for each core would only wait.
        own = {"HOME": str(place), "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        kept = {each: value for each, value in os.environ.items() if each == "OCTAVE_HOME" or each[:6] != "OCTAVE"}
        with (place / "complaints").open("wb") as complaints:
            process = subprocess.Popen(
                [path, *FLAGS, PROGRAM.name, name], cwd=place, env={**kept, **own}, stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=complaints,
            )  # fmt: skip
            try:
                yield RunningFunction(process, place / "complaints", name)
            finally:
                process.kill()
                process.communicate()
