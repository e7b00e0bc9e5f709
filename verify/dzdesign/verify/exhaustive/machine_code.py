"""The core on other processors: a Cortex-M4 in QEMU, and an AVR in simavr, where `int` has 16 bits."""

from dataclasses import dataclass
from pathlib import Path

from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.errors import RequirementError
from dzdesign.verify.current.current_checks import controller_on_machine
from dzdesign.verify.evidence import InputCheck
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import SAMPLED_STRIDE, PreparedInputs
from dzdesign.verify.folder import read_compensator, read_firmware_manifest
from dzdesign.verify.requirements import MACHINE_CODE, Check
from dzdesign.verify.toolchain.compiled_core import CompiledCore, Findings
from dzdesign.verify.toolchain.machines import AVR, CORTEX_M4, Machine

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
        text = "; ".join(map(_words, done))
        checks.append(MACHINE_CODE.check(name=name, holds=all(each.holds for each in done), text=text))
    return checks


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
