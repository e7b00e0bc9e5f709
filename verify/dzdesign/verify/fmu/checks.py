"""`checks` of a folder of FMUs: files, descriptions, libraries, every input, V and MPa, the drive, the closed loop."""

import json
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from math import floor
from pathlib import Path

import numpy as np

from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.design.compensator import Compensator
from dzdesign.design.output_manifest import OutputManifest
from dzdesign.verify import requirements
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.evidence import InputCheck
from dzdesign.verify.exhaustive.all_inputs import input_check, input_checks
from dzdesign.verify.exhaustive.drive_check import drive_samples
from dzdesign.verify.exhaustive.exact_drive import DriveModel
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.fmu.binary_core import ENDINGS, FmuCore
from dzdesign.verify.fmu.closed_loop import closed_loop_check
from dzdesign.verify.fmu.described_model import compensator_faults, plant_faults
from dzdesign.verify.fmu.descriptions import file_faults, library_faults
from dzdesign.verify.fmu.exchange import compensator_exchange_check, plant_exchange_check, starts_check
from dzdesign.verify.fmu.fmu_file import FmuFile, read_fmu
from dzdesign.verify.fmu.stepping import stepped
from dzdesign.verify.output_evidence import OutputChecks, TriedInputs
from dzdesign.verify.requirements import Check

Say = Callable[[str], None]
#: Of the drive: samples and their seed; of V and MPa: rows.
DRIVE_SAMPLES, SEED, PHYSICAL_ROWS = 3000, 25, 4000
#: Of a code, as near its border as this the rounding of a double decides.
AT_BORDER = Fraction(1, 10**6)


def checks(folder: Path, manifest: OutputManifest, compensator: Compensator, say: Say) -> OutputChecks:
    """Check the FMUs in a folder; the binaries of this machine are run, those of others are only read.

    On a machine that the FMUs have no binary for, what would run is not checked.
    """
    plant = plant_of(manifest)
    kinds = ["dz_compensator"] + (["dz_plant"] if plant else [])
    fmu, *of_plant = fmus = [read_fmu(folder / f"{kind}.fmu") for kind in kinds]
    digest = sha256_of((folder / Compensator.FILE_NAME).read_bytes())
    found = list(_read_checks(fmus, compensator, digest, plant))
    tried: list[TriedInputs] = []
    units, two = compensator.valve.recorded_units, len(compensator.signals.signs) == 2
    if (binary := fmu.binary_here()) is None:
        text = "the FMU has no binary for this machine; verify on Linux, on x86_64 Windows, or on macOS"
        found.append(requirements.EXACT_LAW.check(holds=None, text=text))
        return OutputChecks(checks=tuple(found), inputs=())
    say(f"trying every input of {fmu.name}")
    for sign in compensator.signals.signs:
        try:
            inputs = every_input(FmuCore(fmu, sign, binary), compensator, sign)
        except RequirementError as error:
            found.append(requirements.EXACT_LAW.check(holds=False, text=str(error), name=fmu.name))
            continue
        found += input_checks(inputs, units, both_signs=two)
        tried.append(_tried(inputs))
    found += [drive_check(fmu, binary, compensator), physical_check(fmu, binary, compensator)]
    found += [starts_check(fmu, binary), compensator_exchange_check(fmu, binary, compensator)]
    for plant_fmu in of_plant:
        if (plant_binary := plant_fmu.binary_here()) is not None:
            found.append(starts_check(plant_fmu, plant_binary))
            found.append(plant_exchange_check(plant_fmu, plant_binary, plant, compensator))
        say(f"running {fmu.name} with the plant's FMU")
        found.append(closed_loop_check(fmu, plant_fmu, plant, compensator))
    return OutputChecks(checks=tuple(found), inputs=tuple(tried))


def plant_of(manifest: OutputManifest) -> dict[str, float]:
    """Return the parameters of the plant that the FMUs were made with; empty without one."""
    text = manifest.settings.get("plant", "")
    try:
        plant = {str(name): float(value) for name, value in (json.loads(text) if text else {}).items()}
        if plant:
            Plant(**plant)
    except (ValueError, AttributeError, TypeError, InputError) as error:
        raise InputError(f"the manifest's setting plant is no plant: {error}; make the FMUs again") from error
    return plant


def every_input(core: FmuCore, compensator: Compensator, sign: int) -> InputCheck:
    """Compare one side of the law behind an FMU's getters with the exact law on every input."""
    prepared = PreparedInputs(ExactLaw(compensator, sign))
    return input_check(prepared, core.sha256, core.check(prepared.everything()))


def _tried(inputs: InputCheck) -> TriedInputs:
    return TriedInputs(
        name=f"codes, {inputs.side} commands",
        inputs=inputs.inputs,
        wrong=inputs.wrong,
        outputs_hash=inputs.outputs_hash,
    )


def _read_checks(
    fmus: list[FmuFile], compensator: Compensator, digest: str, plant: Mapping[str, float]
) -> Iterator[Check]:
    """Yield what is found by reading alone."""
    by_file = [f"{fmu.name}: {fault}" for fmu in fmus for fault in file_faults(fmu, compensator, digest)]
    count = sum(len(fmu.files) for fmu in fmus)
    yield _verdict(requirements.FMU_FILES, by_file, f"{len(fmus)} FMUs with {count} files as their manifests say")
    described = [
        f"{fmu.name}: {fault}"
        for fmu in fmus
        for fault in (
            plant_faults(fmu, plant, compensator)
            if fmu.name.startswith("dz_plant")
            else compensator_faults(fmu, compensator)
        )
    ]
    variables = sum(len(fmu.variables) for fmu in fmus)
    yield _verdict(requirements.FMU_DESCRIPTION, described, f"{variables} variables with units, starts and roles")
    needed = [f"{fmu.name}: {fault}" for fmu in fmus for fault in library_faults(fmu)]
    binaries = sum(path.startswith("binaries/") for fmu in fmus for path in fmu.files)
    text = f"{binaries} binaries: for Linux none; for Windows at most KERNEL32; for macOS, not run, libSystem alone"
    yield _verdict(requirements.FMU_LIBRARIES, needed, text)


def _verdict(requirement: requirements.Requirement, faults: list[str], text: str) -> Check:
    return requirement.check(holds=not faults, text=and_more(faults, 3) if faults else text)


def drive_check(fmu: FmuFile, binary: bytes, compensator: Compensator) -> Check:
    """Compare the drive's outputs, and the law's, after each step of Co-Simulation with the exact models.

    The inputs of a step show in the outputs after it: a step of delay, no less and no more.
    """
    signals = compensator.signals
    held = signals.tick_Hz // signals.sample_Hz
    samples = drive_samples(compensator, SEED, DRIVE_SAMPLES)
    model, expected = DriveModel(compensator), []
    for sample in samples:
        model.sample(*sample)
        for _ in range(held):
            model.tick()
            expected.append(model.outputs)
    rows = np.repeat(np.array(samples, dtype=float), held, axis=0)
    outputs = ("compare_a", "compare_b", "drive_status")
    try:
        found = stepped(fmu, binary, rows, outputs, 1 / signals.tick_Hz, codes=True)
    except RequirementError as error:
        return requirements.FMU_DRIVE.check(holds=False, text=str(error))
    wrong = np.flatnonzero((found != np.array(expected)).any(axis=1))
    text = f"{len(expected)} steps of a PWM period, {wrong.size} differ from the exact drive"
    if wrong.size:
        first = int(wrong[0])
        text += f"; the first after step {first}: {found[first].tolist()}, expected {list(expected[first])}"
    return requirements.FMU_DRIVE.check(holds=not wrong.size, text=text)


def physical_check(fmu: FmuFile, binary: bytes, compensator: Compensator) -> Check:
    """Compare the law on inputs in V and MPa with the exact law on the codes of an ideal converter."""
    signals, rng = compensator.signals, np.random.default_rng(SEED)
    u_max = float(compensator.u_max_V)
    spans = [float(sensor.span_MPa) for sensor in (signals.pressure_a, signals.pressure_b)]
    low = -u_max if len(signals.signs) == 2 else 0.0
    rows = rng.uniform([low, 0.0, 0.0], [u_max, *spans], (PHYSICAL_ROWS, 3))
    rows[::7, 1] = rows[::7, 2] + rng.uniform(0, spans[0] / 4, rows[::7].shape[0])  # pressure drops as tested
    rows[::7, 1] = np.minimum(rows[::7, 1], spans[0])
    rows[:5, 0] = 0.0
    codes = [_codes(compensator, row) for row in rows.tolist()]
    inside = [index for index, code in enumerate(codes) if code is not None]
    laws = {sign: ExactLaw(compensator, sign) for sign in signals.signs}
    outputs = [f"compare{ENDINGS[sign]}" for sign in signals.signs]
    try:
        found = stepped(fmu, binary, rows, outputs, 1 / signals.tick_Hz, codes=False)
    except RequirementError as error:
        return requirements.FMU_UNITS.check(holds=False, text=str(error))
    wrong = []
    for index in inside:
        command, p_a, p_b = codes[index] or (0, 0, 0)
        expected = [_law(law, command, p_a, p_b) for law in laws.values()]
        if found[index].tolist() != expected:
            wrong.append(f"{rows[index].round(6).tolist()} gives {found[index].tolist()}, expected {expected}")
    text = f"{len(inside)} random inputs in V and MPa, {len(wrong)} differ from the exact law of their codes"
    return requirements.FMU_UNITS.check(
        holds=not wrong and len(inside) > PHYSICAL_ROWS // 2,
        text=f"{text}: {and_more(wrong, 1)}" if wrong else text,
    )


def _law(law: ExactLaw, command: int, p_a: int, p_b: int) -> int:
    sound = (law.a, p_a), (law.b, p_b)
    if command not in law.sound_commands:
        return 0
    valid = all(sensor.valid_codes[0] <= code <= sensor.valid_codes[1] for sensor, code in sound)
    difference = int(law.difference(np.array(p_a), np.array(p_b))) if valid else -law.reverse - 1
    return law.compare_value(command, law.corners(law.betas(difference)))


def _codes(compensator: Compensator, row: list[float]) -> tuple[int, int, int] | None:
    """Return the codes that an ideal converter makes of V, MPa and MPa; None at a border.

    A span of n codes has n + 1 of them, of one width.
    """
    signals = compensator.signals
    command, sign = signals.command, -1 if row[0] < 0 else 1
    share = abs(Fraction(row[0])) / compensator.u_max_V
    exact = [command.zero_code + command.direction(sign) * share * (command.span(sign) + 1)]
    for value, sensor in zip(row[1:], (signals.pressure_a, signals.pressure_b), strict=True):
        exact.append(sensor.zero_code + Fraction(value) / sensor.span_MPa * (sensor.full_code - sensor.zero_code + 1))
    if any(abs(each - round(each)) < AT_BORDER and each != round(each) for each in exact):
        return None
    command_code, p_a, p_b = (min(max(floor(each), 0), signals.code_max) for each in exact)
    return command_code, p_a, p_b
