"""A firmware in closed loop: ramps and scenarios at every tested pressure drop, and the checks."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from dzdesign.design.compensator import Compensator
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.loop_checks import loop_checks
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.ramps import LoopComparison, compare_at_pressure
from dzdesign.verify.closed_loop.scenarios import run_scenarios
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.loop_results import ClosedLoopResult, ScenarioResult
from dzdesign.verify.requirements import Check

#: Shows how far a stage is: pieces and their number in, the pieces out.
Watch = Callable[[Iterable[Any], int], Iterable[Any]]
#: Runs side by side.
WORKERS = 2
#: How the evidence calls the plant where none was given.
STAND_IN = "the recorded flow against command, moved by the default plant's coil and spool"


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareLoop:
    """What the closed loop showed; nothing of it where there was no core to close it with."""

    checks: tuple[Check, ...] = ()
    scenes: tuple[Scene, ...] = ()
    loops: tuple[LoopComparison, ...] = ()
    scenarios: tuple[ScenarioResult, ...] = ()

    def result(self, plant: Plant | None, source: str, sha256: str | None) -> ClosedLoopResult:
        """Return what the evidence has of the ramps and of the plant, given from a file or made of the recordings."""
        first = self.scenes[0] if self.scenes else None
        return ClosedLoopResult(
            plant=plant,
            plant_source=source or STAND_IN,
            plant_sha256=sha256,
            dynamics=first.loop.plant.parameters if first and not plant else None,
            back_MPa=first.backs_MPa if first else (),
            pressures=tuple(loop.result for loop in self.loops),
        )


def close_the_loop(
    scenes: tuple[Scene, ...],
    compensator: Compensator,
    plant: Plant | None,
    sequence: RampSequence,
    say: Callable[[str], None],
    watch: Watch,
) -> FirmwareLoop:
    """Run the ramps and the scenarios."""
    with ThreadPoolExecutor(WORKERS) as pool:

        def at_each(text: str, run: Callable[[Scene], Any]) -> tuple[Any, ...]:
            say(text)
            return tuple(watch(pool.map(run, scenes), len(scenes)))

        loops = at_each("running the closed loop", lambda scene: compare_at_pressure(scene, sequence))
        scenarios = at_each("running the scenarios", lambda scene: tuple(run_scenarios(scene)))
    results, found = [loop.result for loop in loops], tuple(each for of_scene in scenarios for each in of_scene)
    return FirmwareLoop(
        checks=loop_checks(results, found, compensator, plant_given=plant is not None),
        scenes=scenes,
        loops=loops,
        scenarios=found,
    )
