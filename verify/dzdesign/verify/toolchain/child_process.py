"""Compiled code in a child process with a time-out: a crash of it is one sentence that names its signal."""

import re
import signal
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes.running import run_program

#: Largest number that a program of ours prints has 32 bits; what has more digits is none of ours.
NUMBERS = re.compile(r"\s*\d{1,10}(?:\s+\d{1,10})*\s*", re.ASCII)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """How a program ended, and what it printed."""

    #: Why it did not end well, in words; empty where it did.
    reason: str
    printed: str
    complaint: str


def run_child(
    command: Sequence[str],
    what: str,
    timeout_s: float,
    *,
    place: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> Ended:
    """Run a program in a folder and return how it ended; one that does not start or end is a `RequirementError`."""
    try:
        done = run_program(command, timeout=timeout_s, cwd=place, env=environment)
    except subprocess.TimeoutExpired:
        raise RequirementError(f"{what} did not end within {timeout_s:g} s") from None
    except OSError as error:
        raise RequirementError(f"{what} did not start: {error}") from error
    return Ended(reason=reason_of(done.returncode), printed=done.stdout, complaint=done.stderr)


def reason_of(status: int) -> str:
    """Return why an exit status is not that of a good end, in words; empty where it is.

    Examples
    --------
    >>> reason_of(3), reason_of(-11)
    ('exit status 3', 'signal 11 (SIGSEGV)')
    """
    if status >= 0:
        return f"exit status {status}" if status else ""
    name = signal.Signals(-status).name if -status in {*signal.Signals} else "unknown"
    return f"signal {-status} ({name})"


def numbers_in(printed: str) -> list[list[int]]:
    """Return the lines of numbers in what was printed, whatever else there is.

    Examples
    --------
    >>> numbers_in("1 22 \\nnot 3\\n4\\n" + 5000 * "9")
    [[1, 22], [4]]
    """
    return [list(map(int, line.split())) for line in printed.splitlines() if NUMBERS.fullmatch(line)]
