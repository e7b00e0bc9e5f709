"""Programs around an FMU's binary, and what they found: read from a file of theirs, never from what is printed."""

import logging
import re
import shlex
import time
from collections.abc import Sequence
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.core.scratch import scratch_folder
from dzdesign.verify.toolchain.child_process import run_child
from dzdesign.verify.toolchain.machines import Machine

logger = logging.getLogger(__name__)

#: Last line of results that are whole, and how the line of a refusal begins.
END, REFUSED = "end", "refused "
NUMBERS = re.compile(r"(?:\d{1,20}(?: |$))*", re.ASCII)


def results_of(
    machine: Machine, program: Path, arguments: Sequence[str], what: str, drive: str = ""
) -> list[list[int]]:
    """Run a program of this room and return its lines of numbers.

    One that fails, hangs, or whose binary ends it before its results are whole, is a `RequirementError`. What is
    printed goes nowhere.
    """
    with scratch_folder() as place:
        file = place / "results"
        command = [*machine.runner, str(program), *arguments, f"{drive}{file}"]
        begin = time.perf_counter()
        ended = run_child(command, f"{what} on the {machine.name}", machine.run_timeout_s, place=place)
        logger.debug("%s (%.3f s)", shlex.join(command), time.perf_counter() - begin)
        lines = _lines(file)
    refusal = next((line.removeprefix(REFUSED)[:200] for line in lines if line.startswith(REFUSED)), "")
    if ended.reason:
        raise RequirementError(f"{what} on the {machine.name} ended with {ended.reason}{': ' * bool(refusal)}{refusal}")
    if not lines or lines[-1] != END or not all(NUMBERS.fullmatch(line) for line in lines[:-1]):
        raise RequirementError(f"{what} on the {machine.name} ended before its results were whole")
    return [list(map(int, line.split())) for line in lines[:-1] if line.strip()]


def _lines(file: Path) -> list[str]:
    return file.read_text("ascii", "replace").splitlines() if file.is_file() else []
