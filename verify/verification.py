"""`verify`: a firmware folder in, evidence out: strict compilation, every input, closed loop."""

import io
import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from dzdesign.core.artefacts import MANIFEST_NAME, TOOL, parse_document, read_bytes, sha256_of, to_json
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.shape import check_shape
from dzdesign.design.certifying import prove_certificates
from dzdesign.design.compensator import Compensator
from dzdesign.design.compensator_file import compensator_from_document
from dzdesign.identify.valve_file import valve_from_document
from dzdesign.verify.all_inputs import InputCheck, check_all_inputs
from dzdesign.verify.closed_loop import ClosedLoop, LoopComparison, RampSequence, compare_at_pressure
from dzdesign.verify.drive_check import SEED, CompiledDrive, PreparedDrive
from dzdesign.verify.host_compiler import check_strictly, find_compilers, host_compiler
from dzdesign.verify.plant import Plant, plant_document, plants_from_tests
from dzdesign.verify.scenarios import ScenarioResult, Scene, run_scenarios
from dzdesign.verify.tolerances import NO_FLOW_L_MIN, Scatter, Tolerances, scatter, scatter_document

SCHEMA = "dzdesign.evidence/1"
FIRMWARE_SCHEMA = "dzdesign.firmware/1"
#: Runs side by side.
WORKERS = 2
#: Every so many records are drawn: a tenth of a second, finer than the line is wide.
PLOTTED_RECORD = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One requirement: its name, whether it holds (None: it could not be checked), and the figures in a sentence."""

    name: str
    holds: bool | None
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """All evidence about one firmware folder.

    Attributes
    ----------
    checks : tuple of Check
        Every requirement that was tried; the firmware holds if all of them do.
    inputs : tuple of InputCheck
        Figures of the input check, one a sign of command; empty if the core did not compile.
    loops : tuple of LoopComparison
        Closed loop, one a tested pressure drop.
    scenarios : tuple of ScenarioResult
        What happens beside ramps, at every tested pressure drop.
    scatter : tuple of Scatter
        The series of plants, where tolerances were given.
    plant_source : str
        Where the plant of the closed loop came from.
    document : dict
        verification.json.
    """

    checks: tuple[Check, ...]
    inputs: tuple[InputCheck, ...]
    loops: tuple[LoopComparison, ...]
    scenarios: tuple[ScenarioResult, ...]
    scatter: tuple[Scatter, ...]
    plant_source: str
    document: dict[str, Any]

    @property
    def holds(self) -> bool:
        """True if every requirement holds."""
        return all(check.holds for check in self.checks)


def verify(
    folder: Path,
    plant: Plant | None = None,
    plant_source: str = "",
    sequence: RampSequence | None = None,
    tolerances: Tolerances | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Verification:
    """Verify a firmware folder.

    Parameters
    ----------
    folder : Path
        Made by `dzdesign codegen`.
    plant : Plant, optional
        For the closed loop; without it one is made from the identified thresholds.
    plant_source : str
        Name of the plant's file, for the evidence.
    sequence : RampSequence, optional
        The command over time; 0-10 V in 100 s and back by default.
    tolerances : Tolerances, optional
        Of a series of plants about `plant`, which is then needed.
    say : callable
        Told each stage before it begins.

    Raises
    ------
    InputError
        If the folder is no firmware, or there is no C compiler.
    """
    if tolerances and plant is None:
        raise InputError("tolerances are about a plant; give it with --plant PLANT.toml")
    folder = Path(folder)
    manifest_bytes = read_bytes(folder / MANIFEST_NAME, "firmware manifest")
    manifest = parse_document(manifest_bytes, str(folder / MANIFEST_NAME), (FIRMWARE_SCHEMA,))
    check_shape(
        manifest, {"files": dict, "core": [str]}, str(folder / MANIFEST_NAME), "make it again with `dzdesign codegen`"
    )
    content = read_bytes(folder / "compensator.json", "compensator")
    compensator = compensator_from_document(content, str(folder / "compensator.json"))  # every key that is read below
    document = json.loads(content)
    host_compiler()
    say("compiling the core with every warning an error")
    checks = [_files_unchanged(folder, manifest), _compiles_strictly(folder, manifest)]
    inputs: tuple[InputCheck, ...] = ()
    loops: tuple[LoopComparison, ...] = ()
    scenarios: tuple[ScenarioResult, ...] = ()
    scattered: tuple[Scatter, ...] = ()
    signs = (1, -1) if document["sides"]["negative"] else (1,)
    if checks[1].holds:
        say("comparing every input with the exact law")
        try:
            inputs = tuple(check_all_inputs(folder, sign) for sign in signs)
        except RequirementError as error:
            checks.append(Check(name="equals the exactly rounded law", holds=False, text=str(error)))
    if inputs:
        for each in inputs:
            checks += _input_checks(each, len(inputs) > 1)
        checks.append(_drive_follows(folder, compensator))
        say("running the closed loop")
        scenes = _scenes(folder, document, plant)
        loops = _run_loops(scenes, sequence or RampSequence())
        say("running the scenarios")
        scenarios = tuple(result for scene in scenes for result in run_scenarios(scene))
        shut = _no_flow_at_zero(loops, document, plant)
        checks += [_plant_opens(loops), shut, _shut_after_scenarios(scenarios, shut)]
        if tolerances and plant:
            say(f"running {tolerances.plants} plants at {len(scenes)} pressure drops")
            scattered = tuple(
                scatter(scene.loop, plant, tolerances, scene.dp_MPa, scene.side) for scene in scenes
            )
    checks.append(_certificate_follows(compensator))
    source = plant_source or "made from the identified thresholds"
    return Verification(
        checks=tuple(checks),
        inputs=inputs,
        loops=loops,
        scenarios=scenarios,
        scatter=scattered,
        plant_source=source,
        document={
            "schema": SCHEMA,
            "tool": TOOL,
            "made_from": [{"source": f"{folder.name}/{MANIFEST_NAME}", "sha256": sha256_of(manifest_bytes)}],
            "holds": all(check.holds for check in checks),
            "checks": [asdict(check) for check in checks],
            "inputs": [asdict(each) for each in inputs],
            "closed_loop": {
                "plant": plant_document(plant) if plant else None,
                "plant_source": source,
                "pressures": [asdict(loop.result) for loop in loops],
            },
            "scenarios": [asdict(each) for each in scenarios],
            "monte_carlo": scatter_document(tolerances, scattered) if tolerances else None,
        },
    )


def _files_unchanged(folder: Path, manifest: dict[str, Any]) -> Check:
    """Tell which generated files differ from the manifest: what is checked must be what was generated."""
    changed = [
        name
        for name, digest in manifest["files"].items()
        if not (folder / name).is_file() or sha256_of((folder / name).read_bytes()) != digest
    ]
    text = f"changed or missing: {', '.join(changed)}" if changed else f"{len(manifest['files'])} files as generated"
    return Check(name="files as generated", holds=not changed, text=text)


def _certificate_follows(compensator: Compensator) -> Check:
    """Tell whether what the header promises follows from the valve that the compensator was made from."""
    name = "the certificate follows from the valve"
    try:
        prove_certificates(compensator)
    except InputError as error:
        return Check(name=name, holds=False, text=str(error))
    certificate = compensator.positive.certificate
    return Check(
        name=name,
        holds=True,
        text=f"the {certificate.guard} threshold's {certificate.confidence:.0%} lower bound, from "
        f"{float(certificate.dp_MPa[0]):.2f} to {float(certificate.dp_MPa[1]):.2f} MPa, proved again at every "
        "difference of pressure codes",
    )


def _drive_follows(folder: Path, compensator: Compensator) -> Check:
    """Tell whether the drive around the law does what its model in rational numbers does."""
    name, prepared = "the drive follows its model", PreparedDrive(compensator)
    try:
        found = CompiledDrive(folder).check(prepared)
    except RequirementError as error:
        return Check(name=name, holds=False, text=str(error))
    text = f"outputs and state after each of {found.ticks} PWM periods, {len(prepared.samples)} samples of corners, "
    text += f"steps, noise and random codes (seed {SEED}): {found.wrong} wrong"
    text += f" ({found.first_wrong})" if found.wrong else ""
    return Check(name=name, holds=found.wrong == 0, text=text)


def _compiles_strictly(folder: Path, manifest: dict[str, Any]) -> Check:
    compilers = find_compilers()
    try:
        for compiler in compilers:
            for name in manifest["core"]:
                if name.endswith(".c"):
                    check_strictly(folder / name, compiler)
    except RequirementError as error:
        return Check(name="compiles without a warning", holds=False, text=str(error))
    names = ", ".join(sorted({Path(compiler).name for compiler in compilers}))
    return Check(
        name="compiles without a warning",
        holds=True,
        text=f"-std=c99 -Wall -Wextra -Wconversion -Wpedantic -Werror: {names}",
    )


def _input_checks(inputs: InputCheck, both: bool) -> list[Check]:
    """Return one requirement per property of the input check; of two sides each says which."""
    found = inputs.first_wrong or ""
    checks = [
        Check(
            name="equals the exactly rounded law",
            holds=inputs.wrong == 0,
            text=f"{inputs.inputs} inputs checked, {inputs.wrong} wrong" + (f" ({found})" if found else "")
            + f"; hash of all compare values {inputs.outputs_hash}, object {inputs.object_sha256}",
        ),
        Check(
            name="within range, monotone",
            holds=not (inputs.out_of_range or inputs.not_monotone_in_u or inputs.not_monotone_in_dp),
            text=f"{inputs.out_of_range} out of range, {inputs.not_monotone_in_u} falls with rising command, "
            f"{inputs.not_monotone_in_dp} steps against the law in dP",
        ),
        Check(
            name="no over-compensation on the tested interval",
            holds=inputs.over_compensated == 0,
            text=f"{inputs.over_compensated} pressure codes above the threshold's lower bound, "
            f"smallest margin {1e3 * inputs.smallest_margin_V:.3f} mV",
        ),
        Check(
            name="depends on the pressures by their difference only",
            holds=inputs.odd_pairs == 0,
            text=f"{inputs.odd_pairs} of {inputs.pressure_pairs} pairs of pressure codes differ (the commands of each "
            "difference take its pairs in turn; at zero command all pairs that the law follows or that are not sound)",
        ),
        Check(
            name="codes that are not sound fall back",
            holds=not (inputs.bad_fallbacks or inputs.bad_status or inputs.bad_betas),
            text=f"{inputs.bad_fallbacks} codes outside the sound ones without the safe value, {inputs.bad_status} "
            f"status words that say otherwise, {inputs.bad_betas} values of dz_beta() that are not the law's",
        ),
    ]
    label = ("positive" if inputs.sign > 0 else "negative") + " commands: " if both else ""
    return [replace(check, name=label + check.name) for check in checks]


def _scenes(folder: Path, document: dict[str, Any], plant: Plant | None) -> tuple[Scene, ...]:
    """Return the compensated loop of each side at every tested pressure drop."""
    valve = valve_from_document(to_json(document["valve"]).encode(), "compensator.json")
    scenes: list[Scene] = []
    for name, sign in (("positive", 1), ("negative", -1)):
        if not document["sides"][name]:
            continue
        side = valve.sides[name]
        # One that stands in for the valve at one pressure drop says nothing of another.
        plants = dict.fromkeys(side.beta_dp_MPa, plant) if plant else plants_from_tests(side, valve.u_max_V)
        tested = (min(plants), max(plants)) if plant else None
        first = ClosedLoop(next(iter(plants.values())), folder, document, sign)
        scenes += [
            Scene(
                loop=first.with_plant(one), plant=one, side=name, dp_MPa=dp_MPa,
                reference_MPa=side.reference_dp_MPa, tested_MPa=tested,
            )
            for dp_MPa, one in plants.items()
        ]  # fmt: skip
    return tuple(scenes)


def _run_loops(scenes: tuple[Scene, ...], sequence: RampSequence) -> tuple[LoopComparison, ...]:
    """Run the ramps of every scene, two at a time."""
    with ThreadPoolExecutor(WORKERS) as pool:
        runs = pool.map(
            lambda scene: compare_at_pressure(scene.loop, scene.dp_MPa, scene.reference_MPa, sequence, scene.side),
            scenes,
        )
        return tuple(runs)


def _plant_opens(loops: tuple[LoopComparison, ...]) -> Check:
    """Tell whether flow passes at full command: of a plant that stays shut, or whose motion is not finite, the other
    figures of the closed loop say nothing."""
    least = min(loops, key=lambda loop: loop.result.q_max_L_min).result
    return Check(
        name="the plant of the closed loop opens",
        holds=least.q_max_L_min > NO_FLOW_L_MIN,
        text=f"{least.q_max_L_min:.4g} L/min at full command and {least.dp_MPa:.2f} MPa, where it is least",
    )


def _no_flow_at_zero(loops: tuple[LoopComparison, ...], document: dict[str, Any], plant: Plant | None) -> Check:
    name = "no flow at zero command in the closed loop"
    worst = max(loops, key=lambda loop: loop.result.q_zero_L_min).result
    designed = {side_name: side["certificate"]["guard"] for side_name, side in document["sides"].items() if side}
    chosen = [
        guard
        for side_name, guard in designed.items()
        if guard != document["valve"]["sides"][side_name]["certificate"]["guard"]
    ]
    if chosen:
        return Check(
            name=name,
            holds=None,
            text=f"the {chosen[0]} threshold was chosen to be guarded, above the one at which the valve closes: "
            f"{worst.q_zero_L_min:.4g} L/min after closing (at {worst.dp_MPa:.2f} MPa) is the price of that choice. "
            "Design with --guard closing to have none",
        )
    if plant is None and "opening" in designed.values():
        return Check(
            name=name,
            holds=None,
            text="no falling branch was recorded, so where the valve closes is not known; valves close below where "
            "they open, and flow at zero command after closing is to be expected. Record the falling branch",
        )
    return Check(
        name=name,
        holds=worst.q_zero_L_min <= NO_FLOW_L_MIN,
        text=f"at most {worst.q_zero_L_min:.4g} L/min after closing (at {worst.dp_MPa:.2f} MPa), "
        f"{max(loop.result.q_zero_without_beta_L_min for loop in loops):.3g} L/min without beta",
    )


def _shut_after_scenarios(scenarios: tuple[ScenarioResult, ...], ramps: Check) -> Check:
    """Tell whether the valve is shut at zero command after everything that a core can know of."""
    name = "no flow at zero command after any scenario"
    required = [each for each in scenarios if each.must_shut]
    worst = max(required, key=lambda each: each.q_zero_L_min)
    text = f"{len(required)} runs of {len({each.name for each in required})} scenarios: at most "
    text += f"{worst.q_zero_L_min:.4g} L/min ({worst.name}, at {worst.dp_MPa:.2f} MPa)"
    if ramps.holds is None:
        return Check(name=name, holds=None, text=f"{text}; see the ramps")
    return Check(name=name, holds=worst.q_zero_L_min <= NO_FLOW_L_MIN, text=text)


def evidence_files(verification: Verification) -> dict[str, str | bytes]:
    """Return the files of the evidence folder: verification.json and the plot of the closed loop."""
    contents: dict[str, str | bytes] = {"verification.json": to_json(verification.document)}
    if verification.loops:
        contents["closed_loop.svg"] = _plot(verification.loops)
    return contents


def _plot(loops: tuple[LoopComparison, ...]) -> bytes:
    """Draw flow over command, without and with the compensator, both branches, one colour a pressure drop."""
    from matplotlib import colormaps, rc_context
    from matplotlib.figure import Figure

    with rc_context({"svg.hashsalt": "dzdesign", "svg.fonttype": "path"}):
        figure = Figure(figsize=(8, 5), layout="constrained")
        axes = figure.subplots()
        for index, loop in enumerate(loops):
            colour = colormaps["viridis"](index / max(len(loops) - 1, 1) * 0.9)
            for run, line, label in (
                (loop.direct, ":", None),
                (loop.compensated, "-", f"{loop.result.dp_MPa:.2f} MPa"),
            ):
                thin = slice(None, None, PLOTTED_RECORD)
                axes.plot(100 * run.command[thin], run.q_L_min[thin], line, color=colour, label=label)
        axes.set(
            xlabel="command (% of full)",
            ylabel="flow (L/min)",
            title="Closed loop: without (dotted) and with (solid) the compensator",
            xlim=(0, 100),
            ylim=(0, None),
        )
        axes.grid(alpha=0.3)
        axes.legend(title="pressure drop")
        out = io.BytesIO()
        figure.savefig(out, format="svg", metadata={"Date": None})
    return out.getvalue()
