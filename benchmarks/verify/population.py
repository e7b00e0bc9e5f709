"""Machines drawn from the budget: none flows, none of the scenarios does; and how fast."""

import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

from current_valve import CONTROLLED
from example_valve import example_valve
from scoreboard import Row, print_rows, say
from small_budgets import DUTY, designed, drawn_alone
from stand_in_flow import valve_of

from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop import population as population_module
from dzdesign.verify.closed_loop.population import run_population
from dzdesign.verify.closed_loop.scenarios import run_scenarios
from dzdesign.verify.closed_loop.scene import Scene, scenes_of

SHARED = Path(os.environ.get("DZDESIGN_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))
MACHINES, FEW = 1_000_000, 20_000
#: Machines a second, at least.
SPEED_GOAL = 1e6
#: Machines that are timed, one number less the other, and how often: the others held something else too.
TIMED_FROM, TIMED_TO, REPEATS = 200, 200_200, 5


def print_population(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of the populations."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
        for name, valve in valves().items():
            say(f"population: {name}")
            rows += _of_valve(name, valve, Path(folder) / name, quick, seed)
    print_rows(f"Machines drawn from the budget (seed {seed})", rows)
    return rows


def valves() -> dict[str, ValveModel]:
    """Return the example, and the shared measurements where they are here."""
    shared = {name: valve_of(SHARED / name) for name in ("valve_a", "valve_e") if (SHARED / name).is_dir()}
    return {"example": example_valve()} | shared


def shut_rows(name: str, scenes: Sequence[Scene], machines: int, seed: int) -> list[Row]:
    """Run scenarios and machines of one firmware, and return what of them flows at zero command."""
    results = [each for scene in scenes for each in run_scenarios(scene) if each.must_shut]
    flowing = sum(each.q_beyond_L_min > 1e-9 for each in results)
    coil = [each for each in results if each.name.startswith(("coil", "supply"))]
    opening = [each.figures["dead_zone_on_opening_percent"] for each in coil]
    corners = f"; dead zone on opening {min(opening):.1f} to {max(opening):.1f} % at the corners" if opening else ""
    found = run_population(scenes, machines, seed)
    with drawn_alone(scenes):
        corner = run_population(scenes, 4, seed)
    return [
        Row(what=f"{name}: required scenarios that flow at zero", value=flowing, limit=0,
            note=f"of {len(results)}{corners}"),
        Row(what=f"{name}: machines that flow at zero", value=found.flowing, limit=0,
            note=f"of {found.machines}; below {found.upper_limit:.2e} with 95 %; {found.never_open} never opened"),
        Row(what=f"{name}: machines that flow with all at its worst", value=corner.flowing, limit=0,
            note=f"of {corner.machines}"),
    ]  # fmt: skip


def _of_valve(name: str, valve: ValveModel, folder: Path, quick: bool, seed: int) -> list[Row]:
    """Run scenarios and machines of one valve: coil and supply straight at the duty, and its current controlled."""
    scenes = scenes_of(folder, designed(valve, folder, **DUTY), None)
    rows = shut_rows(name, scenes, FEW if quick else MACHINES, seed)
    if name == "example":
        speed = _speed(scenes, seed)
        rows.append(Row(what="example: machines a second, goal over measured", value=SPEED_GOAL / speed, limit=1.0,
                        note=f"{speed:.3g} machines a second by the wall clock, one core"))  # fmt: skip
    by_current = folder.with_name(f"{name}, by current")
    scenes = scenes_of(by_current, designed(valve, by_current, **CONTROLLED), None)
    return rows + shut_rows(by_current.name, scenes, FEW if quick else MACHINES, seed)


def _speed(scenes: Sequence[Scene], seed: int) -> float:
    """Return how many machines are drawn and compared a second, what does not grow with their number left out."""
    side = population_module.MachinesOfSide(scenes, scenes[0].compensator.machine, seed)
    taken = []
    for machines in (TIMED_FROM, TIMED_TO):
        times = []
        for _ in range(REPEATS):
            begin = perf_counter()
            side.compared(machines)
            times.append(perf_counter() - begin)
        taken.append(min(times))
    return (TIMED_TO - TIMED_FROM) / (taken[1] - taken[0])
