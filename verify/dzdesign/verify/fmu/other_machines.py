"""`checks` of FMUs on other machines, in simulators: every input again, and the same hash of all answers."""

from collections.abc import Callable
from pathlib import Path

from dzdesign.core.errors import RequirementError
from dzdesign.core.processes.programs import find_program
from dzdesign.design.compensator import Compensator
from dzdesign.design.output_manifest import OutputManifest
from dzdesign.verify.fmu.binary_core import SIMULATED, FmuCore, Simulated
from dzdesign.verify.fmu.checks import every_input
from dzdesign.verify.fmu.fmu_file import read_fmu
from dzdesign.verify.output_evidence import OutputChecks, TriedInputs
from dzdesign.verify.requirements import MACHINE_CODE, Check
from dzdesign.verify.toolchain.host_compiler import find_zig


def checks(
    folder: Path, _manifest: OutputManifest, compensator: Compensator, say: Callable[[str], None]
) -> OutputChecks:
    """Try every input of the compensator's FMU on each platform that a simulator is here for."""
    found: list[Check] = []
    tried: list[TriedInputs] = []
    fmu = read_fmu(folder / "dz_compensator.fmu")
    for simulated in SIMULATED:
        name = f"{simulated.name}: {MACHINE_CODE.title}"
        binary, missing = fmu.binary(simulated.folder, simulated.ending), _missing(simulated)
        if binary is None or missing:
            text = missing or f"{fmu.name} has no such binary"
            found.append(MACHINE_CODE.check(holds=None if missing else False, text=text, name=name))
            continue
        for sign in compensator.signals.signs:
            say(f"trying every input of {fmu.name} on {simulated.name}")
            core = FmuCore(fmu, sign, binary, simulated.machine, simulated.drive)
            try:
                inputs = every_input(core, compensator, sign)
            except RequirementError as error:
                found.append(MACHINE_CODE.check(holds=False, text=str(error), name=name))
                continue
            text = f"{inputs.inputs} inputs, {inputs.wrong} wrong; hash of all answers {inputs.outputs_hash}"
            faults = inputs.wrong + inputs.odd_pairs + inputs.bad_fallbacks + inputs.bad_status + inputs.bad_betas
            found.append(MACHINE_CODE.check(holds=faults == 0, text=text, name=name))
            tried.append(
                TriedInputs(
                    name=f"{simulated.name}, {inputs.side} commands", inputs=inputs.inputs,
                    wrong=inputs.wrong, outputs_hash=inputs.outputs_hash,
                )
            )  # fmt: skip
    return OutputChecks(checks=tuple(found), inputs=tuple(tried))


def _missing(simulated: Simulated) -> str:
    """Return what a simulator lacks here, with what to install; nothing where it is there."""
    absent = [name for name in simulated.needs if not (find_program(name) or Path(name).exists())]
    words = [f"{name} not found; apt install {simulated.needs[name]}" for name in absent]
    if find_zig() is None:
        words.append('ziglang not found; run `pip install "ziglang>=0.17"`')
    return "; ".join(words)
