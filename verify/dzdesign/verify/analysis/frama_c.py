"""No undefined behaviour where `int` has 16 bits, for every input: shown by Frama-C's Eva, where that is installed.

Running the core at every input, on the host and in simulators, can't show that: a signed overflow or an index beyond a
table may do by chance what was meant. Eva reads the C code as the standard does, with the 16-bit `int` of TI's C28x.
"""

import csv
import os
import re
import shutil
import subprocess
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import RequirementError
from dzdesign.core.processes.programs import find_program
from dzdesign.core.processes.running import run_program
from dzdesign.core.scratch import scratch_folder
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.firmware.folder import read_compensator
from dzdesign.verify.requirements import UNDEFINED_BEHAVIOUR, Check
from dzdesign.verify.toolchain.bound_block import block_of
from dzdesign.verify.toolchain.compiled_core import SOURCES
from dzdesign.verify.toolchain.machines import PROGRAMS

PROGRAM = "frama-c"
#: A shift of a negative number to the right is each compiler's own; overflow of unsigned words is the core's tool.
OPTIONS = (
    "-eva", "-eva-slevel", "100", "-eva-no-show-progress", "-eva-no-results",
    "-warn-right-shift-negative",
)  # fmt: skip
#: `int` of 16 bits, as of TI's C28x; and where the block form is asked, of 32 too.
SHORT_INT, BOTH_WIDTHS = "x86_16", ("x86_16", "x86_64")
TIMEOUT_S = 1800
PROVEN = ("Valid", "Considered valid", "Partially proven")
CODES = 65536


class Alarm(NamedTuple):
    """What Eva could not exclude: where in the core's C, and the property that it could not show."""

    file: str
    line: int
    function: str
    what: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Proof:
    """What is left of Eva's alarms when each place counts as shown by the analysis that shows it."""

    #: Of Frama-C.
    version: str
    #: That were analysed for all inputs.
    functions: tuple[str, ...]
    #: Not excluded by any of the analyses; none: there is no undefined behaviour.
    alarms: tuple[Alarm, ...]
    #: Machines whose widths of `int` and `long` were taken.
    widths: tuple[str, ...] = (SHORT_INT,)


def proof_check(folder: Path) -> Check:
    """Return the requirement that no input makes the core's C overflow, index beyond a table or shift too far."""
    if not find_program(PROGRAM):
        return UNDEFINED_BEHAVIOUR.check(holds=None, text=f"not run: {PROGRAM} not found; apt install frama-c-base")
    try:
        proof = prove(folder)
    except RequirementError as error:
        return UNDEFINED_BEHAVIOUR.check(holds=None, text=f"not run: {error}")
    if proof.alarms:
        first = proof.alarms[0]
        where = f"{first.function}, {first.file}:{first.line}"
        text = f"{len(proof.alarms)} not excluded, the first in {where}: {first.what}"
    else:
        text = f"{', '.join(proof.functions)}: none, for all 2^48 triples of codes"
        text += ", and one step of the drive from any state in its range"
        text += "" if block_of(folder) is None else "; any octets of a calibration block"
    widths = " and ".join(proof.widths)
    return UNDEFINED_BEHAVIOUR.check(holds=not proof.alarms, text=f"{text}; Frama-C {proof.version}, -machdep {widths}")


def prove(folder: Path, rows: int | None = None) -> Proof:
    """Analyse each side's core, and the drive.

    Each analysis gives the core every input, cut to pieces in another way. A place that one of them shows to be sound
    is sound: the first undefined behaviour of a run, were there one, would be an alarm of each. With `rows`, so many
    codes of sensor B, from its first sound one on, stand for all: no proof, but a quick look.

    Frama-C that fails or takes longer than `TIMEOUT_S` is a `RequirementError`.
    """
    if block_of(folder) is not None:
        return prove_any_block(folder)
    compensator = read_compensator(folder)
    sources = sorted(path.name for path in (folder / "core").glob("*.[ch]"))
    alarms: set[Alarm] = set()
    functions: list[str] = []
    with scratch_folder() as place:
        for sign, (source, ending) in SOURCES.items():
            if source not in sources:
                continue
            law = ExactLaw(compensator, sign)
            work = place / source
            work.mkdir()
            for each in sources:
                shutil.copyfile(folder / "core" / each, work / each)
            shutil.copyfile(PROGRAMS / "proof.c", work / "proof.c")
            tried = _sound(law.b.valid_codes)[:rows]
            (work / "pieces.h").write_text(_pieces(law, ending, tried))
            alarms |= _of_side(work, [each for each in sources if each.endswith(".c")], len(tried))
            functions += [f"dz_{function}{ending}" for function in ("comp", "beta", "status")]
    return Proof(version=_version(), functions=tuple(functions), alarms=tuple(sorted(alarms)))


def prove_any_block(folder: Path, machines: tuple[str, ...] = BOTH_WIDTHS) -> Proof:
    """Analyse a core in block form, and its check of blocks, for any octets of a block, any codes and any state."""
    signals, drive = read_compensator(folder).signals, read_compensator(folder).current_drive
    with scratch_folder() as work:
        for path in [*(folder / "core").glob("*.[ch]"), PROGRAMS / "proof_block.c"]:
            shutil.copyfile(path, work / path.name)
        sources = sorted(path.name for path in work.glob("dz_*.c"))
        defines = ["-DBIPOLAR"] if len(signals.signs) > 1 else []
        defines += ["-DWITH_CURRENT"] if drive else []
        defines += ["-DWITH_SUPPLY"] if drive and drive.loop.supply else []
        mains = ["law", "check", "drive", *(["current"] if drive else [])]
        runs = [(machine, main) for machine in machines for main in mains]
        what = " ".join(defines)
        with ThreadPoolExecutor(max(1, min(os.cpu_count() or 1, 8))) as pool:
            found = list(pool.map(lambda run: _analysed(work, "proof_block.c", sources, run[0], run[1], what), runs))
    functions = ("dz_comp", "dz_beta", "dz_status", "dz_calibration_check", *(["dz_current_tick"] if drive else []))
    return Proof(version=_version(), functions=functions, alarms=tuple(sorted(set().union(*found))), widths=machines)


def _of_side(work: Path, sources: list[str], rows: int) -> set[Alarm]:
    """Return the alarms that are left of one side, and of the drive."""
    parts = np.linspace(0, rows, max(1, min(os.cpu_count() or 1, 8)) + 1).astype(int)
    runs = [("pressures", first, end) for first, end in pairwise(parts)]
    runs += [("no_pressures", 0, rows), ("commands", 0, rows), ("drive", 0, rows)]
    with ThreadPoolExecutor(len(parts)) as pool:
        found = list(pool.map(lambda run: _alarms(work, sources, *run), runs))
    *by_pressure, by_command, of_drive = found
    core = set().union(*by_pressure) & by_command
    return core | {alarm for alarm in of_drive if alarm.file.startswith("dz_drive")}


def _pieces(law: ExactLaw, ending: str, tried: range) -> str:
    """Return pieces.h: the functions of a side, and the codes where the pieces of each input end; of B those tried."""
    a, b = _sound(law.a.valid_codes), _sound(law.b.valid_codes)
    commands = law.sound_commands
    away = (0, law.zero_band, law.transition_end)
    corners = {law.full, *(max(law.zero + sign * codes, 0) for sign in (1, -1) for codes in away)}
    ends = sorted({0, CODES, *_ends_of(commands), *corners, *(code + 1 for code in corners)})
    furthest = max(abs(code - law.zero) for code in (commands.start, commands.stop - 1))
    lines = [f"#define {function.upper()} dz_{function}{ending}" for function in ("comp", "beta", "status")]
    lines += [
        f"#define COMMAND_ENDS {_braces(ends)}",
        f"#define SOUND_B {b.start}u",
        f"#define NOT_OF_A {_invalid(a)}",
        f"#define NOT_OF_B {_invalid(b)}",
        f"#define RAMPED {furthest * CODES}L",
        f"#define FURTHEST {furthest}",
        f"#define TRAVEL {law.compensator.drive_functions.play_codes}",
        f"#define PRESSURE_ENDS {{{', '.join(_braces(_kinds(law, a, code)) for code in tried)}}}",
    ]
    return "\n".join(lines) + "\n"


def _ends_of(sound: range) -> tuple[int, int, int]:
    """Return where codes become sound, where they end to be, and where words of 16 bits take them for negative."""
    return sound.start, sound.stop, sound.start + CODES // 2


def _invalid(sound: range) -> str:
    """Return the pieces of the codes that a sensor can't give."""
    ends = sorted({0, CODES, *_ends_of(sound)})
    pieces = [(first, end) for first, end in pairwise(ends) if first not in sound]
    return f"{{{', '.join(map(_braces, pieces))}}}"


def _kinds(law: ExactLaw, a: range, code_b: int) -> tuple[int, ...]:
    """Return the ends of sensor A's pieces: its zero, and where its difference from a code of B turns sign or good."""
    difference = law.difference(np.arange(a.start, a.stop), np.array(code_b))
    kind = np.where(difference < -law.reverse, 0, np.where(difference < 0, 1, 2))
    changes = (np.flatnonzero(np.diff(kind)) + 1 + a.start).tolist()
    ends = sorted({a.start, a.stop, *changes, *({law.a.zero_code} & {*a})})
    return (*ends, *[a.stop] * (5 - len(ends)))


def _sound(ends: tuple[int, int]) -> range:
    return range(ends[0], ends[1] + 1)


def _braces(numbers: Iterable[int]) -> str:
    return "{" + ", ".join(f"UINT32_C({number})" for number in numbers) + "}"


def _alarms(work: Path, sources: list[str], main: str, first: int, end: int) -> set[Alarm]:
    """Run one analysis and return what it could not exclude in the core's C."""
    return _analysed(work, "proof.c", sources, SHORT_INT, main, f"-DPART_FIRST={first}u -DPART_END={end}u")


def _analysed(work: Path, program: str, sources: list[str], machine: str, main: str, defines: str) -> set[Alarm]:
    """Analyse from one entry point of a program on, with the widths of a machine."""
    report = work / f"{machine}_{main}_{defines.count('=') and sha256_of(defines.encode())[:8]}.csv"
    command = [
        PROGRAM, "-machdep", machine, *OPTIONS, f"-cpp-extra-args={defines}", "-main", main, program,
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
