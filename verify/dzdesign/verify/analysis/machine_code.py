"""The core on other processors, and where `int` has 16 bits: a Cortex-M4 in QEMU, an AVR in simavr, and Frama-C.

Running the core at every input, on the host and in simulators, can't show that nothing is undefined where `int` has 16
bits: a signed overflow or an index beyond a table may do by chance what was meant. Frama-C's Eva reads the C code as
the standard does, with the 16-bit `int` of TI's C28x, for every input.
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
from dzdesign.core.folder_contents import MANIFEST_NAME
from dzdesign.core.processes.programs import find_program
from dzdesign.core.processes.running import run_program
from dzdesign.core.scratch import scratch_folder
from dzdesign.verify.analysis.core_cost import core_cost
from dzdesign.verify.current.current_checks import controller_on_machine
from dzdesign.verify.evidence import InputCheck
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import SAMPLED_STRIDE, PreparedInputs
from dzdesign.verify.folder import read_compensator, read_firmware_manifest
from dzdesign.verify.requirements import MACHINE_CODE, UNDEFINED_BEHAVIOUR, Check
from dzdesign.verify.toolchain.compiled_core import CompiledCore, Findings
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4, PROGRAMS, Machine, block_of

MACHINES = (CORTEX_M4, AVR)


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineCheck:
    """What a machine found of one side, and the hash of the same inputs' compare values on the host."""

    machine: Machine
    found: Findings
    host_hash: str

    @property
    def holds(self) -> bool:
        """True if nothing was wrong and all compare values are those of the host."""
        return not self.found.faults and self.found.outputs_hash == self.host_hash


def check_on_machine(folder: Path, machine: Machine, host: InputCheck) -> MachineCheck:
    """Check one side's machine code for another processor, of which `host` is the host's check.

    On a small machine a sample is tried, there and on the host. Elsewhere all inputs are, but without the host's second
    look at the pairs of pressures. A core that does not compile, or does not end there, is a `RequirementError`.
    """
    core = CompiledCore(folder, host.sign)
    prepared = PreparedInputs(ExactLaw(read_compensator(folder), host.sign))
    if machine.small:
        sample = prepared.sample()
        found, host_hash = core.check(sample, machine), core.check(sample, sample=True).outputs_hash
    else:
        found, host_hash = core.check(prepared.everything(cube=False), machine), host.outputs_hash
    return MachineCheck(machine=machine, found=found, host_hash=host_hash)


def machine_code_checks(folder: Path, inputs: tuple[InputCheck, ...]) -> list[Check]:
    """Return one requirement per machine: its machine code is right at every input, or at a sample of them.

    Of a drive by current also one of its controller. Firmware for one of the machines needs no tools of the others.
    """
    compensator = read_compensator(folder)
    names = [machine.name.lower() for machine in MACHINES]
    with_manifest = (folder / MANIFEST_NAME).is_file()
    target = read_firmware_manifest(folder).target if with_manifest else ""
    checks = []
    for machine, name in zip(MACHINES, names, strict=True):
        if target in names and target != name and machine.missing():
            continue
        if compensator.current_drive is not None:
            checks.append(controller_on_machine(folder, compensator, machine))
        name = f"machine code of the {machine.name}"
        missing = "the core was not checked on the host" if not inputs else machine.missing()
        if missing:
            checks.append(MACHINE_CODE.check(name=name, holds=None, text=f"not run: {missing}"))
            continue
        try:
            done = [check_on_machine(folder, machine, host) for host in inputs]
        except RequirementError as error:
            checks.append(MACHINE_CODE.check(name=name, holds=False, text=str(error)))
            continue
        text = "; ".join([*map(_words, done), _cost(folder, machine)])
        checks.append(MACHINE_CODE.check(name=name, holds=all(each.holds for each in done), text=text))
    return checks


def _cost(folder: Path, machine: Machine) -> str:
    """Return what the core takes there: a figure, and no requirement."""
    try:
        return core_cost(folder, machine).words
    except RequirementError as error:
        return f"memory and time were not measured: {error}"


def _words(done: MachineCheck) -> str:
    found, machine = done.found, done.machine
    which = f"a sample of {found.inputs} inputs with the corners" if machine.small else f"{found.inputs} inputs, all"
    beyond = f" (every {SAMPLED_STRIDE}th)" if machine.small else ""
    elsewhere = found.bad_fallbacks + found.bad_status + found.bad_betas
    same = "as on the host" if found.outputs_hash == done.host_hash else f"on the host {done.host_hash}"
    return (
        f"{which}: {found.wrong} wrong, {found.odd_pairs} odd pairs, {elsewhere} wrong at codes outside their signal's "
        f"valid range{beyond}; hash of all compare values {found.outputs_hash}, {same}; {machine.runner[0]}, "
        f"{machine.compiler} {' '.join(machine.core_flags)}, object {found.object_sha256}"
    )


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
        text += ", and one step of the drive from any state"
        text += "" if block_of(folder) is None else "; any octets of a calibration block"
    widths = " and ".join(proof.widths)
    return UNDEFINED_BEHAVIOUR.check(holds=not proof.alarms, text=f"{text}; Frama-C {proof.version}, -machdep {widths}")


def prove(folder: Path, machines: tuple[str, ...] = BOTH_WIDTHS) -> Proof:
    """Analyse a core for any codes and any state, and one in block form for any octets of a block, with its check.

    Frama-C that fails or takes longer than `TIMEOUT_S` is a `RequirementError`.
    """
    compensator, in_block_form = read_compensator(folder), block_of(folder) is not None
    signals, drive = compensator.signals, compensator.current_drive
    with scratch_folder() as work:
        for path in [*(folder / "core").glob("*.[ch]"), PROGRAMS / "proof.c"]:
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
