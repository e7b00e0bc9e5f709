"""Frama-C's Eva on the core: no undefined behaviour where `int` has 16 bits.

Running the core at every input, on the host and in simulators, can't show that: a signed overflow or an index beyond a
table may do by chance what was meant. Eva reads the C code as the standard does, with the 16-bit `int` of TI's C28x,
for every input; and a core in block form for any octets of a block, which is that of every valve.
"""

import csv
import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from dzdesign.core.errors import RequirementError
from dzdesign.core.placing import scratch_folder
from dzdesign.core.processes import run_program
from dzdesign.verify.folder import read_compensator
from dzdesign.verify.toolchain.machines import block_of

PROGRAM = "frama-c"
#: A shift of a negative number to the right is each compiler's own; overflow of unsigned words is the core's tool.
OPTIONS = (
    "-eva", "-eva-slevel", "100", "-eva-no-show-progress", "-eva-no-results",
    "-warn-right-shift-negative",
)  # fmt: skip
#: `int` of 16 bits, as of TI's C28x, and of 32.
BOTH_WIDTHS = ("x86_16", "x86_64")
TIMEOUT_S = 1800
PROVEN = ("Valid", "Considered valid", "Partially proven")


class Alarm(NamedTuple):
    """What Eva could not exclude: where in the core's C, and the property that it could not show."""

    file: str
    line: int
    function: str
    what: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof:
    """What is left of Eva's alarms."""

    #: Of Frama-C.
    version: str
    #: That were analysed for all inputs.
    functions: tuple[str, ...]
    #: Not excluded by any of the analyses; none: there is no undefined behaviour.
    alarms: tuple[Alarm, ...]
    #: Machines whose widths of `int` and `long` were taken.
    widths: tuple[str, ...] = BOTH_WIDTHS


def prove(folder: Path, machines: tuple[str, ...] = BOTH_WIDTHS) -> Proof:
    """Analyse a core for any codes and any state, and one in block form for any octets of a block, with its check.

    Frama-C that fails or takes longer than `TIMEOUT_S` is a `RequirementError`.
    """
    compensator, in_block_form = read_compensator(folder), block_of(folder) is not None
    signals, drive = compensator.signals, compensator.current_drive
    with scratch_folder() as work:
        for path in [*(folder / "core").glob("*.[ch]"), Path(__file__).with_name("proof.c")]:
            shutil.copyfile(path, work / path.name)
        sources = sorted(path.name for path in work.glob("dz_*.c"))
        defines = ["-DIN_BLOCK_FORM"] if in_block_form else []
        defines += ["-DBIPOLAR"] if len(signals.signs) > 1 else []
        defines += ["-DWITH_CURRENT"] if drive else []
        defines += ["-DWITH_SUPPLY"] if drive and drive.loop.supply else []
        mains = ["law", *(["check"] if in_block_form else []), "drive", *(["current"] if drive else [])]
        runs = [(machine, main) for machine in machines for main in mains]
        what = " ".join(defines)
        with ThreadPoolExecutor(max(1, min(os.cpu_count() or 1, 8))) as pool:
            found = list(pool.map(lambda run: _analysed(work, sources, run[0], run[1], what), runs))
    endings = ("", "_negative") if len(signals.signs) > 1 else ("",)
    functions = [f"dz_{name}{ending}" for ending in endings for name in ("comp", "beta", "status")]
    functions += ["dz_calibration_check"] * in_block_form + ["dz_current_tick"] * (drive is not None)
    return Proof(version=_version(), functions=tuple(functions), alarms=tuple(sorted(set().union(*found))),
                 widths=machines)  # fmt: skip


def _analysed(work: Path, sources: list[str], machine: str, main: str, defines: str) -> set[Alarm]:
    """Analyse from one entry point of a program on, with the widths of a machine."""
    report = work / f"{machine}_{main}.csv"
    command = [
        PROGRAM, "-machdep", machine, *OPTIONS, f"-cpp-extra-args={defines}", "-main", main, "proof.c",
        *sources, "-then", "-report-csv", report.name,
    ]  # fmt: skip
    try:
        # It trusts PWD, not the folder.
        done = run_program(command, cwd=work, timeout=TIMEOUT_S, env={**os.environ, "PWD": str(work)})
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RequirementError(f"{PROGRAM} did not end: {error}") from error
    if done.returncode or not report.exists():
        errors = [line for line in (done.stdout + done.stderr).splitlines() if "rror" in line or "aborted" in line]
        raise RequirementError(f"{PROGRAM} {_version()} failed on {main}: {' '.join(errors)[:300]}")
    with report.open(newline="") as lines:
        rows = list(csv.DictReader(lines, dialect="excel-tab"))
    return {
        Alarm(file=row["file"], line=int(row["line"]), function=row["function"], what=row["property"])
        for row in rows
        # What a function of Frama-C's own library asks is a row at each call; that of the function itself stays open
        # where the sources have calls that this entry point does not come to.
        if row["status"] not in PROVEN and not row["directory"].startswith("FRAMAC_SHARE")
    }


def _version() -> str:
    try:
        done = run_program([PROGRAM, "-version"], timeout=TIMEOUT_S)
    except (OSError, subprocess.TimeoutExpired):
        return "of an unknown version"
    return re.sub(r"\s+", " ", done.stdout).strip() or "of an unknown version"
