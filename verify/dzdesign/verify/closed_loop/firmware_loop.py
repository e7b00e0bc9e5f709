"""A firmware in closed loop: ramps, scenarios and a series of plants at every tested pressure drop, and the checks."""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.recorded_curve import RecordedCurve
from dzdesign.verify.closed_loop.dead_zone import LoopComparison, compare_at_pressure
from dzdesign.verify.closed_loop.drive_corners import valve_at_corners, valve_at_corners_check
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.loop_checks import loop_checks
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.population import run_population
from dzdesign.verify.closed_loop.scenarios import run_scenarios
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.closed_loop.stand_in import stand_in_of
from dzdesign.verify.closed_loop.tolerances import Tolerances, monte_carlo, scatter
from dzdesign.verify.current.results import ValveAtCorners
from dzdesign.verify.loop_results import ClosedLoopResult, MonteCarlo, PlantComparison, Population, ScenarioResult, Side
from dzdesign.verify.requirements import Check

#: Shows how far a stage is: pieces and their number in, the pieces out.
Watch = Callable[[Iterable[Any], int], Iterable[Any]]
#: Runs side by side.
WORKERS = 2
#: How the evidence calls the plant where none was given.
STAND_IN = "the recorded flow against command, moved by the default plant's coil and spool"
SIGNS: dict[Side, int] = {"positive": 1, "negative": -1}
#: Pressures downstream of the edge where none were given, MPa: a port open to the tank, and a pipe's back pressure.
BACKS_MPA = (0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareLoop:
    """What the closed loop showed; nothing of it where there was no core to close it with."""

    checks: tuple[Check, ...] = ()
    dynamics: Plant | None = None
    backs_MPa: tuple[float, ...] = ()
    loops: tuple[LoopComparison, ...] = ()
    scenarios: tuple[ScenarioResult, ...] = ()
    population: Population | None = None
    monte_carlo: MonteCarlo | None = None
    #: Of a drive by current.
    valve_at_corners: tuple[ValveAtCorners, ...] = ()

    def result(
        self, plant: Plant | None, source: str, sha256: str | None, against_cvodes: tuple[PlantComparison, ...]
    ) -> ClosedLoopResult:
        """Return what the evidence has of the ramps and of the plant, given from a file or made of the recordings."""
        return ClosedLoopResult(
            plant=plant,
            plant_source=source or STAND_IN,
            plant_sha256=sha256,
            dynamics=None if plant else self.dynamics,
            back_MPa=self.backs_MPa,
            pressures=tuple(loop.result for loop in self.loops),
            against_cvodes=against_cvodes,
        )


def scenes_of(
    folder: Path, compensator: Compensator, plant: Plant | None, backs_MPa: Sequence[float] | None = None
) -> tuple[Scene, ...]:
    """Return the compensated loop of each side at every tested pressure drop.

    Without a plant the recorded characteristic stands in for the valve. Pressures behind the edge that were given must
    be within the sensors' spans; usual ones are lowered until they are.
    """
    valve = compensator.valve
    scenes: list[Scene] = []
    for name, sign in SIGNS.items():
        if sign not in compensator.signals.signs:
            continue
        side = valve.sides[name]
        one = plant or stand_in_of(side, valve.u_max_V)
        pressures = side.beta.dp_MPa or tuple(test.dp_MPa for test in side.tests if test.dp_MPa is not None)
        loop = ClosedLoop(one, folder, compensator, sign)
        for back_MPa in backs_MPa or ():
            if loop.back_within_span(back_MPa, max(pressures)) < back_MPa:
                first, second = (valve.recorded_units.text(each, ".3g MPa") for each in (back_MPa, max(pressures)))
                raise InputError(
                    f"a back pressure of {first} and the tested {second} together exceed the sensors' span; give a "
                    "lower --back-pressure, or design with larger sensors"
                )
        for dp_MPa in pressures:
            reference = dp_MPa if side.reference.dp_MPa is None else side.reference.dp_MPa
            # A recording at one pressure drop says nothing of another.
            tested = (min(pressures), max(pressures)) if plant or len(pressures) > 1 else None
            scenes.append(
                Scene(
                    loop=loop,
                    plant=one,
                    compensator=compensator,
                    side=name,
                    dp_MPa=dp_MPa,
                    reference_MPa=reference,
                    tested_MPa=tested,
                    backs_MPa=tuple(sorted(BACKS_MPA if backs_MPa is None else backs_MPa)),
                )
            )
    return tuple(scenes)


def recorded_at(compensator: Compensator, scene: Scene) -> RecordedCurve:
    """Return what was recorded at a scene's pressure drop."""
    tests = compensator.valve.sides[scene.side].tests
    return min(tests, key=lambda test: abs((test.dp_MPa or 0.0) - scene.dp_MPa)).recorded


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
            lambda scene: compare_at_pressure(
                scene.loop, scene.dp_MPa, scene.reference_MPa, sequence, scene.side,
                reading_flow_L_min=compensator.reading_flow_L_min, recorded=recorded_at(compensator, scene),
                back_MPa=scene.back_MPa,
            ),
            scenes,
        )
        loops = tuple(watch(ramps, len(scenes)))
        say("running the scenarios")
        done = pool.map(lambda scene: tuple(run_scenarios(scene)), scenes)
        scenarios = tuple(result for results in watch(done, len(scenes)) for result in results)
        valve = _at_every_coil(scenes, compensator, pool, watch, say)
    series = None
    population = None
    if tolerances and tolerances.machines:
        say(f"running {tolerances.machines} machines drawn from the budget (seed {tolerances.seed})")
        population = run_population(scenes, tolerances.machines, tolerances.seed)
    if tolerances and tolerances.spreads and plant:
        say(f"running {tolerances.plants} plants at {len(scenes)} pressure drops")
        pieces = watch(scenes, len(scenes))
        series = monte_carlo(tolerances, [scatter(s.loop, plant, tolerances, s.dp_MPa, s.side) for s in pieces])
    results = [loop.result for loop in loops]
    checks = loop_checks(results, scenarios, compensator, population, plant_given=plant is not None)
    if valve:
        checks += (valve_at_corners_check(valve, compensator.valve.recorded_units),)
    return FirmwareLoop(
        checks=checks,
        valve_at_corners=valve,
        dynamics=scenes[0].plant.parameters if scenes else None,
        backs_MPa=scenes[0].backs_MPa if scenes else (),
        loops=loops,
        scenarios=scenarios,
        population=population,
        monte_carlo=series,
    )


def _at_every_coil(
    scenes: tuple[Scene, ...],
    compensator: Compensator,
    pool: ThreadPoolExecutor,
    watch: Watch,
    say: Callable[[str], None],
) -> tuple[ValveAtCorners, ...]:
    """Run the valve with every coil and supply; nothing of a drive by duty."""
    drive = compensator.current_drive
    if drive is None:
        return ()
    say("running the closed loop with every coil and supply")
    return tuple(watch(pool.map(lambda scene: valve_at_corners(scene, drive.circuit), scenes), len(scenes)))
