"""A firmware in closed loop: ramps, scenarios and a series of plants at every tested pressure drop, and the checks."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.dead_zone import LoopComparison, compare_at_pressure
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.loop_checks import loop_checks
from dzdesign.verify.closed_loop.plant import Plant, plants_from_tests
from dzdesign.verify.closed_loop.scenarios import Scene, run_scenarios
from dzdesign.verify.closed_loop.tolerances import Tolerances, monte_carlo, scatter
from dzdesign.verify.evidence import ClosedLoopResult, IdentifiedPlant, MonteCarlo, ScenarioResult, Side
from dzdesign.verify.requirements import Check

#: Shows how far a stage is: pieces and their number in, the pieces out.
Watch = Callable[[Iterable[Any], int], Iterable[Any]]
#: Runs side by side.
WORKERS = 2
SIGNS: dict[Side, int] = {"positive": 1, "negative": -1}


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareLoop:
    """What the closed loop showed; nothing of it where there was no core to close it with."""

    checks: tuple[Check, ...] = ()
    plants: tuple[IdentifiedPlant, ...] = ()
    loops: tuple[LoopComparison, ...] = ()
    scenarios: tuple[ScenarioResult, ...] = ()
    monte_carlo: MonteCarlo | None = None

    def result(self, plant: Plant | None, source: str, sha256: str | None) -> ClosedLoopResult:
        """Return what the evidence has of the ramps and of the plant, given from a file or made from the thresholds."""
        return ClosedLoopResult(
            plant=plant,
            plant_source=source or "made from the identified thresholds",
            plant_sha256=sha256,
            plants=() if plant else self.plants,
            pressures=tuple(loop.result for loop in self.loops),
        )


def scenes_of(folder: Path, compensator: Compensator, plant: Plant | None) -> tuple[Scene, ...]:
    """Return the compensated loop of each side at every tested pressure drop.

    Without a plant there is one for each pressure drop, made from the identified thresholds.
    """
    valve = compensator.valve
    scenes: list[Scene] = []
    for name, sign in SIGNS.items():
        if sign not in compensator.signals.signs:
            continue
        side = valve.sides[name]
        # One that stands in for the valve at one pressure drop says nothing of another.
        plants = dict.fromkeys(side.beta.dp_MPa, plant) if plant else plants_from_tests(side, valve.u_max_V)
        tested = (min(plants), max(plants)) if plant else None
        first = ClosedLoop(next(iter(plants.values())), folder, compensator, sign)
        for dp_MPa, one in plants.items():
            reference = dp_MPa if side.reference.dp_MPa is None else side.reference.dp_MPa
            loop = first.with_plant(one)
            scenes.append(
                Scene(
                    loop=loop,
                    plant=one,
                    side=name,
                    dp_MPa=dp_MPa,
                    reference_MPa=reference,
                    tested_MPa=tested,
                    command_error=compensator.command_error,
                    has_zero_band=compensator.zero_band_codes > 0,
                )
            )
    return tuple(scenes)


def close_the_loop(
    scenes: tuple[Scene, ...],
    compensator: Compensator,
    plant: Plant | None,
    sequence: RampSequence,
    tolerances: Tolerances | None,
    say: Callable[[str], None],
    watch: Watch,
) -> FirmwareLoop:
    """Run the ramps, the scenarios and, where tolerances are given, the series of plants."""
    say("running the closed loop")
    with ThreadPoolExecutor(WORKERS) as pool:
        ramps = pool.map(
            lambda scene: compare_at_pressure(scene.loop, scene.dp_MPa, scene.reference_MPa, sequence, scene.side),
            scenes,
        )
        loops = tuple(watch(ramps, len(scenes)))
        say("running the scenarios")
        done = pool.map(lambda scene: tuple(run_scenarios(scene)), scenes)
        scenarios = tuple(result for results in watch(done, len(scenes)) for result in results)
    series = None
    if tolerances and plant:
        say(f"running {tolerances.plants} plants at {len(scenes)} pressure drops")
        pieces = watch(scenes, len(scenes))
        series = monte_carlo(tolerances, [scatter(s.loop, plant, tolerances, s.dp_MPa, s.side) for s in pieces])
    return FirmwareLoop(
        checks=loop_checks([loop.result for loop in loops], scenarios, compensator, plant_given=plant is not None),
        plants=tuple(IdentifiedPlant(side=scene.side, dp_MPa=scene.dp_MPa, parameters=scene.plant) for scene in scenes),
        loops=loops,
        scenarios=scenarios,
        monte_carlo=series,
    )
