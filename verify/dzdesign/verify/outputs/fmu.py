"""`checks` of a folder of FMUs, by FMPy: valid, every input, the drive by both interfaces, V and MPa, closed loop."""

import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from importlib.util import find_spec
from math import floor, isclose
from pathlib import Path

import numpy as np

from dzdesign.core.errors import InputError, RequirementError, and_more
from dzdesign.core.placing import scratch_folder
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.verify import requirements
from dzdesign.verify.closed_loop.loop import BENCH_BACK_MPA, ClosedLoop
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.evidence import OutputChecks
from dzdesign.verify.exhaustive.all_inputs import core_checks
from dzdesign.verify.exhaustive.drive_check import drive_samples
from dzdesign.verify.exhaustive.exact_drive import DriveModel
from dzdesign.verify.exhaustive.exact_law import BETA_UNIT, ExactLaw
from dzdesign.verify.exhaustive.test_vectors import PreparedInputs
from dzdesign.verify.outputs.fmu_importer import Row, binary_here, run_in_child
from dzdesign.verify.requirements import Check
from dzdesign.verify.toolchain.compiled_core import ENDINGS

Say = Callable[[str], None]
Codes = tuple[int, ...]
INSTALL = 'FMPy, which runs FMUs, is not installed; run `pip install "fmpy>=0.3.20,<0.4"`'
COMPENSATOR, PLANT = "dz_compensator", "dz_plant"
#: Of the drive: samples and their seed; of V and MPa: rows.
DRIVE_SAMPLES, SEED, PHYSICAL_ROWS = 3000, 25, 4000
#: Of a code, as near its border as this the rounding of a double decides.
AT_BORDER = Fraction(1, 10**6)
#: Of the closed loop: share of the largest flow that is allowed, and the command over time: rest, up, full, down, rest,
#: then steps; s and shares of full command.
TOLERANCE = 1e-4
COURSE = ((0.0, 0.0), (0.1, 0.0), (0.5, 1.0), (0.55, 1.0), (0.9, 0.0), (1.0, 0.0), (1.0, 0.5), (1.1, 0.5),
          (1.1, 0.02), (1.2, 0.02), (1.2, 1.0), (1.3, 0.0), (1.4, 0.0))  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Unpacked:
    """An FMU in a folder of its own, what its description says, and its binary for this machine."""

    name: str
    folder: Path
    binary: Path | None
    problems: tuple[str, ...]


def checks(folder: Path, manifest: OutputManifest, compensator: Compensator, say: Say) -> OutputChecks:
    """Check the FMUs in a folder; of their binaries that of this machine is run.

    On a machine that the FMUs have no binary for, and without FMPy, what would run is not checked.
    """
    plant = plant_of(manifest)
    if find_spec("fmpy") is None:
        return OutputChecks(checks=(requirements.FMU_VALID.check(holds=None, text=INSTALL),), inputs=())
    with scratch_folder() as place:
        fmus = [unpacked(folder / f"{name}.fmu", place) for name in ((COMPENSATOR, PLANT) if plant else (COMPENSATOR,))]
        problems = [f"{fmu.name}: {problem}" for fmu in fmus for problem in fmu.problems]
        text = and_more(problems, 3) if problems else f"{len(fmus)} FMUs, 0 problems"
        valid = requirements.FMU_VALID.check(holds=not problems, text=text)
        if problems:
            return OutputChecks(checks=(valid,), inputs=())
        if any(fmu.binary is None for fmu in fmus):
            text = "there is no binary for this machine; verify on Linux, on x86_64 Windows, or on macOS"
            return OutputChecks(checks=(valid, requirements.EXACT_LAW.check(holds=None, text=text)), inputs=())
        say(f"trying every input of the C code of {fmus[0].name}")
        # The core that the FMU carries as sources, where a check finds it.
        firmware = place / "firmware"
        shutil.copytree(fmus[0].folder / "sources", firmware / "core")
        of_core = [core_checks(firmware, compensator, sign) for sign in compensator.signals.signs]
        say(f"comparing {fmus[0].name} with the exact law and the exact drive")
        found = [check(fmus[0], compensator) for check in (law_check, drive_check, physical_check)]
        for plant_fmu in fmus[1:]:
            say(f"running {fmus[0].name} with {plant_fmu.name}")
            found.append(closed_loop_check(fmus[0], plant_fmu, Plant(**plant), compensator, firmware))
    return OutputChecks(
        checks=(valid, *(check for each in of_core for check in each.checks), *found),
        inputs=tuple(each for side in of_core for each in side.inputs),
    )


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


def unpacked(path: Path, place: Path) -> Unpacked:
    """Unpack an FMU by FMPy; a file that is none has problems and nothing else."""
    import fmpy
    from fmpy.validation import validate_fmu

    folder = place / path.stem
    try:
        problems = tuple(validate_fmu(str(path)))
        fmpy.extract(str(path), str(folder))
        described = fmpy.read_model_description(str(folder))
        if path.stem == COMPENSATOR and described.modelExchange is None:
            problems += ("it offers no Model Exchange",)
        binary = binary_here(folder, described.coSimulation.modelIdentifier)
    except Exception as error:  # FMPy raises what its parsers do
        problems = (f"FMPy can't read it: {str(error)[:200]}",)
        return Unpacked(name=path.name, folder=folder, binary=None, problems=problems)
    return Unpacked(name=path.name, folder=folder, binary=binary, problems=problems)


def _values(compensator: Compensator) -> tuple[str, ...]:
    """Return the names of the inputs in V and MPa."""
    return ("u_i", *(f"p_{name}" for name in compensator.signals.pressures))


def _code_inputs(compensator: Compensator) -> tuple[str, ...]:
    return tuple(f"{name}_code" for name in _values(compensator))


def _check(requirement: requirements.Requirement, faults: Iterator[str], text: str) -> Check:
    try:
        found = list(faults)
    except RequirementError as error:
        return requirement.check(holds=False, text=str(error))
    return requirement.check(holds=not found, text=and_more(found, 2) if found else text)


def _law_faults(
    fmu: Unpacked, compensator: Compensator, names: tuple[str, ...], rows: list[Row], codes: list[Codes]
) -> Iterator[str]:
    """Yield where what the FMU shows of both sides, given `rows`, is not the exact law at their codes."""
    signals, drive = compensator.signals, compensator.current_drive
    full = float(compensator.u_max_V if drive is None else drive.circuit.rated_A)
    outputs = [f"{name}{ENDINGS[sign]}" for sign in signals.signs for name in ("compare", "status", "beta", "u_O")]
    must = []
    for exact in (ExactLaw(compensator, sign) for sign in signals.signs):
        read = [0, *(1 + list(signals.pressures).index(name) for name in exact.pair)]
        answers = np.array([exact.answer(*(each[place] for place in read)) for each in codes], dtype=float)
        must += [*(answers / (1, 1, BETA_UNIT)).T, answers[:, 0] * full / signals.compare_max]
    for exchange in (False, True):
        found = np.array(run_in_child(
            "stepped", f"the law of {fmu.name}", folder=str(fmu.folder), names=names, rows=rows,
            codes=names[0].endswith("_code"), outputs=outputs, step_s=1 / signals.tick_Hz,
            exchange=exchange,
        ))[:, : len(outputs)]  # fmt: skip
        wrong = ~np.isclose(found, np.array(must).T, rtol=1e-9, atol=1e-9).all(axis=1)
        for index in np.flatnonzero(wrong):
            shown, expected = (dict(zip(outputs, row, strict=True)) for row in (found[index], np.array(must).T[index]))
            yield f"{', '.join(names)} = {np.round(rows[index], 6).tolist()} give {shown}, expected {expected}"


def law_check(fmu: Unpacked, compensator: Compensator) -> Check:
    """Compare law, status and beta of the binary with the exact law, at a sample of the codes and their ends."""
    codes = [codes for sign in compensator.signals.signs for codes in _sampled_codes(compensator, sign)]
    text = f"{len(codes)} inputs in codes, at the ends of all that is valid and between them: 0 differ"
    rows = [list(map(float, each)) for each in codes]
    return _check(requirements.FMU_LAW, _law_faults(fmu, compensator, _code_inputs(compensator), rows, codes), text)


def _sampled_codes(compensator: Compensator, sign: int) -> list[Codes]:
    """Return codes of all inputs, those of one side's law and any of the pressure that it does not read."""
    exact, names = ExactLaw(compensator, sign), compensator.signals.pressures
    found: list[Codes] = []
    for command, ahead, behind in PreparedInputs(exact).sampled_codes():
        known = dict(zip(exact.pair, (ahead, behind), strict=True))
        found.append((command, *(known.get(name, (command + ahead) % (exact.code_max + 1)) for name in names)))
    return found


def drive_check(fmu: Unpacked, compensator: Compensator) -> Check:
    """Compare the drive's outputs after each PWM period with the exact drive, by both interfaces.

    Of Co-Simulation the inputs of a step show in the outputs after it, of Model Exchange at the event.
    """
    periods = DRIVE_SAMPLES * (compensator.signals.tick_Hz // compensator.signals.sample_Hz)
    text = f"{periods} PWM periods by each interface, 0 differ from the exact drive"
    return _check(requirements.FMU_DRIVE, _drive_faults(fmu, compensator), text)


def _drive_faults(fmu: Unpacked, compensator: Compensator) -> Iterator[str]:
    signals, model, expected = compensator.signals, DriveModel(compensator), []
    held = signals.tick_Hz // signals.sample_Hz
    samples = drive_samples(compensator, SEED, DRIVE_SAMPLES)
    for sample in samples:
        model.sample(*sample)
        for _ in range(held):
            model.tick()
            expected.append([float(value) for value in model.outputs])
    rows = [list(map(float, sample)) for sample in samples for _ in range(held)]
    for exchange in (False, True):
        found = run_in_child(
            "stepped", f"the drive of {fmu.name}", folder=str(fmu.folder), rows=rows, codes=True,
            names=_code_inputs(compensator), outputs=("compare_a", "compare_b", "drive_status"),
            step_s=1 / signals.tick_Hz, exchange=exchange,
        )  # fmt: skip
        kind = "Model Exchange" if exchange else "Co-Simulation"
        for period, (values, must) in enumerate(zip(found, expected, strict=True)):
            if values[:3] != must:
                yield f"{kind}: in period {period} the drive gives {values[:3]}, expected {must}"
            if exchange and not isclose(values[3], (period + 1) / signals.tick_Hz, rel_tol=1e-9):
                yield f"{kind}: after period {period} the next event is at {values[3]:g} s"


def physical_check(fmu: Unpacked, compensator: Compensator) -> Check:
    """Compare the law at inputs in V and MPa with the exact one at the codes of an ideal converter."""
    text = f"{PHYSICAL_ROWS} random inputs in V and MPa, 0 differ from the exact law of their codes"
    return _check(requirements.FMU_UNITS, _physical_faults(fmu, compensator), text)


def _physical_faults(fmu: Unpacked, compensator: Compensator) -> Iterator[str]:
    signals, rng, u_max = compensator.signals, np.random.default_rng(SEED), float(compensator.u_max_V)
    spans = [float(sensor.span_MPa) for sensor in signals.pressures.values()]
    low = [-u_max if len(signals.signs) == 2 else 0.0, *(0.0 for _ in spans)]
    rows = rng.uniform(low, [u_max, *spans], (PHYSICAL_ROWS, len(low)))
    rows[::7, 1] = rows[::7, 2] + rng.uniform(0, spans[0] / 4, rows[::7].shape[0])  # pressure drops as tested
    rows[::7, 1] = np.minimum(rows[::7, 1], spans[0])
    rows[:5, 0] = 0.0
    known = [(row, codes) for row in rows.tolist() if (codes := _codes(compensator, row))]
    yield from _law_faults(
        fmu, compensator, _values(compensator), [row for row, _ in known], [codes for _, codes in known]
    )
    if len(known) < PHYSICAL_ROWS // 2:
        yield f"{len(known)} of {PHYSICAL_ROWS} inputs have codes that rounding does not decide; expected half of them"


def _codes(compensator: Compensator, row: Row) -> Codes | None:
    """Return the codes that an ideal converter makes of V and MPa; None at a border.

    A span of n codes has n + 1 of them, of one width.
    """
    signals = compensator.signals
    command, sign = signals.command, -1 if row[0] < 0 else 1
    share = abs(Fraction(row[0])) / compensator.u_max_V
    exact = [command.zero_code + command.direction(sign) * share * (command.span(sign) + 1)]
    for value, sensor in zip(row[1:], signals.pressures.values(), strict=True):
        exact.append(sensor.zero_code + Fraction(value) / sensor.span_MPa * (sensor.full_code - sensor.zero_code + 1))
    if any(abs(each - round(each)) < AT_BORDER and each != round(each) for each in exact):
        return None
    return tuple(min(max(floor(each), 0), signals.code_max) for each in exact)


def closed_loop_check(
    fmu: Unpacked, plant_fmu: Unpacked, plant: Plant, compensator: Compensator, firmware: Path
) -> Check:
    """Compare the flow of the coupled FMUs with that of `verify`'s own loop, at the least and largest tested drop."""
    signals, worst, periods = compensator.signals, 0.0, 0
    times, corners = np.arange(0, COURSE[-1][0], 1 / signals.tick_Hz), np.array(COURSE)
    share = np.interp(times, corners[:, 0], corners[:, 1])
    try:
        for sign in signals.signs:
            loop = ClosedLoop(plant, firmware, compensator, sign)
            tests = compensator.valve.side(sign).tests
            drops = [test.dp_MPa for test in tests if test.dp_MPa is not None] or [1.0]
            for drop_MPa in sorted({min(drops), max(drops)}):
                back_MPa = loop.back_within_span(BENCH_BACK_MPA, drop_MPa)
                run = loop.run(share, drop_MPa, "compensated", back_MPa=back_MPa, periods_per_record=1)
                found = np.array(run_in_child(
                    "coupled", f"{fmu.name} with {plant_fmu.name}", compensator=str(fmu.folder),
                    plant=str(plant_fmu.folder), drop_MPa=drop_MPa, back_MPa=back_MPa, step_s=1 / signals.tick_Hz,
                    command_V=(sign * share * float(compensator.u_max_V)).tolist(),
                    drive="compare_b" if sign < 0 else "compare_a",
                    pressures=[f"p_{name}" for name in signals.pair(sign).names],
                ))  # fmt: skip
                if (largest := float(run.q_L_min.max())) <= 0:
                    raise RequirementError(f"the same plant lets no flow pass at {drop_MPa:g} MPa")
                worst = max(worst, float(np.abs(found[:, 0] - run.q_L_min).max()) / largest)
                periods += share.size
    except RequirementError as error:
        return requirements.FMU_CLOSED_LOOP.check(holds=False, text=str(error))
    words = f"{periods} PWM periods, flows differ by at most {worst:.2g} of the largest; {TOLERANCE:g} is allowed"
    return requirements.FMU_CLOSED_LOOP.check(holds=worst <= TOLERANCE, text=words)
