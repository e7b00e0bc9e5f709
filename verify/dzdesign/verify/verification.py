"""`verify`: a firmware folder in, evidence out: strict compilation, every input, closed loop."""

import json
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dzdesign.core.artefact_files import MANIFEST_NAME, TOOL, read_bytes, sha256_of, to_json
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.result_display import ShownInNotebooks
from dzdesign.design.compensator_file import compensator_from_document
from dzdesign.identify.valve.valve_file import valve_from_document
from dzdesign.verify.analysis.core_state import keeps_no_state
from dzdesign.verify.checks import (
    Check,
    certificate_follows,
    compiles_strictly,
    drive_follows,
    files_unchanged,
    input_checks,
    law_follows,
    lot_checked,
    no_flow_at_zero,
    own_files,
    plant_is_the_valve,
    plant_opens,
    shut_after_scenarios,
)
from dzdesign.verify.closed_loop.evidence_curves import curve_files
from dzdesign.verify.closed_loop.loop import ClosedLoop, LoopComparison, RampSequence, compare_at_pressure
from dzdesign.verify.closed_loop.loop_plot import plot_loops
from dzdesign.verify.closed_loop.plant import Plant, plant_document, plants_from_tests
from dzdesign.verify.closed_loop.scenarios import ScenarioResult, Scene, run_scenarios
from dzdesign.verify.closed_loop.tolerances import Scatter, Tolerances, scatter, scatter_document
from dzdesign.verify.exhaustive.all_inputs import InputCheck, check_all_inputs
from dzdesign.verify.exhaustive.input_map import InputMap, map_inputs
from dzdesign.verify.firmware.board_files import board_compiles, board_files, check_include
from dzdesign.verify.firmware.folder import read_firmware_manifest
from dzdesign.verify.firmware.manifest import manifest_follows
from dzdesign.verify.firmware.one_core import seen_by_all
from dzdesign.verify.firmware.valve_check import valve_follows
from dzdesign.verify.toolchain.host_compiler import host_compiler

SCHEMA = "dzdesign.evidence/1"
#: Shows how far a stage is: pieces and their number in, the pieces out.
Watch = Callable[[Iterable[Any], int], Iterable[Any]]
#: Runs side by side.
WORKERS = 2


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Verification(ShownInNotebooks):
    """All evidence about one firmware folder.

    Attributes
    ----------
    checks : tuple of Check
        Every requirement that was tried; the firmware holds if all of them do.
    inputs : tuple of InputCheck
        Figures of the input check, one a sign of command; empty if the core did not compile.
    maps : tuple of InputMap
        What the core gives over its inputs, one a sign of command, to be drawn.
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
    maps: tuple[InputMap, ...]
    loops: tuple[LoopComparison, ...]
    scenarios: tuple[ScenarioResult, ...]
    scatter: tuple[Scatter, ...]
    plant_source: str
    document: dict[str, Any]

    @property
    def holds(self) -> bool:
        """True if every requirement holds."""
        return all(check.holds for check in self.checks)

    @property
    def verdict(self) -> str:
        """In words, as the report's: what does not hold goes before what could not be checked."""
        missed = [check.name for check in self.checks if check.holds is False]
        unknown = [check.name for check in self.checks if check.holds is None]
        if missed:
            return f"DOES NOT HOLD: {', '.join(missed)}" + (f"; NOT CHECKED: {', '.join(unknown)}" if unknown else "")
        return f"NOT CHECKED: {', '.join(unknown)}" if unknown else "Every requirement holds."


def verify(
    folder: Path,
    plant: Plant | None = None,
    plant_source: str = "",
    plant_sha256: str | None = None,
    sequence: RampSequence | None = None,
    tolerances: Tolerances | None = None,
    include: Sequence[Path] = (),
    say: Callable[[str], None] = lambda _: None,
    watch: Watch = lambda items, _: items,
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
    plant_sha256 : str, optional
        Its hash.
    sequence : RampSequence, optional
        The command over time; 0-10 V in 100 s and back by default.
    tolerances : Tolerances, optional
        Of a series of plants about `plant`, which is then needed.
    include : sequence of Path
        Where headers lie that the user's board files include.
    say : callable
        Told each stage before it begins.
    watch : callable
        Handed the pieces of a long stage and their number; gives them back one by one, as they are done.

    Raises
    ------
    InputError
        If the folder is no firmware, or there is no C compiler.
    """
    if tolerances and plant is None:
        raise InputError("tolerances are about a plant; give it with --plant PLANT.toml")
    folder = Path(folder)
    manifest_bytes, manifest = read_firmware_manifest(folder)
    check_include(include, manifest)
    content = read_bytes(folder / "compensator.json", "compensator")
    compensator = compensator_from_document(content, str(folder / "compensator.json"))  # every key that is read below
    document = json.loads(content)
    host_compiler()
    say("compiling the core with every warning an error")
    checks = [files_unchanged(folder, manifest), manifest_follows(folder, manifest)]
    compiles = compiles_strictly(folder, manifest)
    checks += [compiles, seen_by_all(folder, manifest)]
    inputs: tuple[InputCheck, ...] = ()
    maps: tuple[InputMap, ...] = ()
    loop = _InTheLoop()
    signs = (1, -1) if document["sides"]["negative"] else (1,)
    if compiles.holds:
        say("comparing every input with the exact law")
        building = ThreadPoolExecutor(1).submit(_scenes, folder, document, plant)  # a compiler's time, not ours
        try:
            inputs = tuple(check_all_inputs(folder, sign) for sign in signs)
        except RequirementError as error:
            checks.append(Check(name="equals the exactly rounded law", holds=False, text=str(error)))
    if inputs:
        for each in inputs:
            checks += input_checks(each, len(inputs) > 1)
        checks += lot_checked(inputs, document)
        maps = tuple(map_inputs(folder, document, sign) for sign in signs)
        checks += [drive_follows(folder, compensator), keeps_no_state(folder)]
        loop = _close_the_loop(building.result(), document, plant, sequence or RampSequence(), tolerances, say, watch)
    checks += [*loop.checks, certificate_follows(compensator), law_follows(compensator, document)]
    board = board_compiles(folder, manifest, include)
    checks += [*valve_follows(folder, document), *board.checks]
    source = plant_source or "made from the identified thresholds"
    return Verification(
        checks=tuple(checks),
        inputs=inputs,
        maps=maps,
        loops=loop.loops,
        scenarios=loop.scenarios,
        scatter=loop.scattered,
        plant_source=source,
        document={
            "schema": SCHEMA,
            "tool": TOOL,
            "made_from": [{"source": f"{folder.name}/{MANIFEST_NAME}", "sha256": sha256_of(manifest_bytes)}],
            "target": manifest.get("target", ""),
            "yours": [each.name for each in board_files(folder, manifest) if each.changed],
            "own": own_files(folder, manifest),
            "board_untried": board.untried,
            "holds": all(check.holds for check in checks),
            "checks": [asdict(check) for check in checks],
            "inputs": [asdict(each) for each in inputs],
            "closed_loop": {
                "plant": plant_document(plant) if plant else None,
                "plant_source": source,
                "plant_sha256": plant_sha256,
                "plants": [] if plant else list(loop.plants),
                "pressures": [asdict(each.result) for each in loop.loops],
            },
            "scenarios": [asdict(each) for each in loop.scenarios],
            "monte_carlo": scatter_document(tolerances, loop.scattered) if tolerances else None,
        },
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _InTheLoop:
    """What the closed loop showed; nothing of it where there was no core to close it with."""

    checks: tuple[Check, ...] = ()
    plants: tuple[dict[str, Any], ...] = ()
    loops: tuple[LoopComparison, ...] = ()
    scenarios: tuple[ScenarioResult, ...] = ()
    scattered: tuple[Scatter, ...] = ()


def _close_the_loop(
    scenes: tuple[Scene, ...],
    document: dict[str, Any],
    plant: Plant | None,
    sequence: RampSequence,
    tolerances: Tolerances | None,
    say: Callable[[str], None],
    watch: Watch,
) -> _InTheLoop:
    """Run the ramps, the scenarios and, where tolerances are given, the series of plants."""
    say("running the closed loop")
    loops = _run_loops(scenes, sequence, watch)
    say("running the scenarios")
    scenarios = _run_scenarios(scenes, watch)
    scattered: tuple[Scatter, ...] = ()
    if tolerances and plant:
        say(f"running {tolerances.plants} plants at {len(scenes)} pressure drops")
        scattered = tuple(
            scatter(scene.loop, plant, tolerances, scene.dp_MPa, scene.side) for scene in watch(scenes, len(scenes))
        )
    shut = no_flow_at_zero(loops, document, plant)
    valve = valve_from_document(to_json(document["valve"]).encode(), "compensator.json")
    return _InTheLoop(
        checks=(
            plant_opens(loops),
            plant_is_the_valve(loops, valve),
            shut,
            shut_after_scenarios(scenarios, shut, plant),
        ),
        plants=tuple(
            {"side": scene.side, "dp_MPa": scene.dp_MPa, "parameters": plant_document(scene.plant)} for scene in scenes
        ),
        loops=loops,
        scenarios=scenarios,
        scattered=scattered,
    )


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


def _run_loops(scenes: tuple[Scene, ...], sequence: RampSequence, watch: Watch) -> tuple[LoopComparison, ...]:
    """Run the ramps of every scene, two at a time."""
    with ThreadPoolExecutor(WORKERS) as pool:
        runs = pool.map(
            lambda scene: compare_at_pressure(scene.loop, scene.dp_MPa, scene.reference_MPa, sequence, scene.side),
            scenes,
        )
        return tuple(watch(runs, len(scenes)))


def _run_scenarios(scenes: tuple[Scene, ...], watch: Watch) -> tuple[ScenarioResult, ...]:
    """Run the scenarios of every scene, two scenes at a time."""
    with ThreadPoolExecutor(WORKERS) as pool:
        done = pool.map(lambda scene: tuple(run_scenarios(scene)), scenes)
        return tuple(result for results in watch(done, len(scenes)) for result in results)


def evidence_files(verification: Verification) -> dict[str, str | bytes]:
    """Return the files of the evidence folder: verification.json, the plot of the closed loop, curves to draw."""
    contents: dict[str, str | bytes] = {"verification.json": to_json(verification.document)}
    contents |= curve_files(verification.loops, verification.maps)
    if verification.loops:
        contents["closed_loop.svg"] = plot_loops(verification.loops)
    return contents
