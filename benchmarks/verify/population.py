"""Machines drawn from the budget: none flows, none of the scenarios does, wrong budgets are caught; and how fast."""

import os
import tempfile
from pathlib import Path
from time import perf_counter

from firmware import example_valve
from loop_peers import core_of
from plant import fold_map_speed
from scoreboard import Row, print_rows, say
from small_budgets import DUTY, IN_TURN, LARGEST, LITTLE, called_ten_times_better, designed, right_and_wrong
from stand_in_flow import valve_of

from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.loop import RECORD_S
from dzdesign.verify.closed_loop.population import Openings, run_population
from dzdesign.verify.closed_loop.scenarios import run_scenarios

SHARED = Path(os.environ.get("DZDESIGN_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))
MACHINES, FEW, IN_A_CASE = 10_000, 200, 40
FOLD_GOAL = 35.0


def print_population(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of the populations."""
    valves = {"example": example_valve()}
    valves |= {name: valve_of(SHARED / name) for name in ("valve_a", "valve_e") if (SHARED / name).is_dir()}
    rows = []
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
        for name, valve in valves.items():
            say(f"population: {name}")
            rows += _of_valve(name, valve, Path(folder) / name, quick, seed)
        rows += _wrong_budgets(valves["example"], Path(folder))
    print_rows(f"Machines drawn from the budget (seed {seed})", rows)
    return rows


def _of_valve(name: str, valve: ValveModel, folder: Path, quick: bool, seed: int) -> list[Row]:
    """Run scenarios and machines of one valve, coil and supply straight at the duty."""
    compensator = designed(valve, folder, **DUTY)
    scenes = scenes_of(folder, compensator, None)
    results = [each for scene in scenes for each in run_scenarios(scene) if each.must_shut]
    flowing = sum(each.q_beyond_L_min > 1e-9 for each in results)
    coil = [each for each in results if each.name.startswith(("coil", "supply"))]
    opening = [each.figures["dead_zone_on_opening_percent"] for each in coil]
    begin = perf_counter()
    found = run_population(scenes, FEW if quick else MACHINES, seed)
    taken = perf_counter() - begin
    simulated = found.machines * Openings.of(found.pressures).command.size * RECORD_S
    corner = run_population(scenes, 4, seed, drawn=())
    rows = [
        Row(what=f"{name}: required scenarios that flow at zero", value=flowing, limit=0,
            note=f"of {len(results)}; dead zone on opening {min(opening):.1f} to {max(opening):.1f} % at the corners"),
        Row(what=f"{name}: machines that flow at zero", value=found.flowing, limit=0,
            note=f"of {found.machines}; below {found.upper_limit:.2e} with 95 %; {found.never_open} never opened"),
        Row(what=f"{name}: machines that flow with all at its worst", value=corner.flowing, limit=0,
            note=f"of {corner.machines}"),
    ]  # fmt: skip
    if name == "example":
        theirs = fold_map_speed(core_of(folder), quick, seed)
        ratio = simulated / taken / theirs
        rows.append(Row(what="example: machines over fold.map, goal over measured", value=FOLD_GOAL / ratio, limit=1.0,
                        note=f"{ratio:.4g} times faster; {taken:.1f} s for {found.machines}, both cores"))  # fmt: skip
    return rows


def _wrong_budgets(valve: ValveModel, folder: Path) -> list[Row]:
    """Count the wrong budgets that no machine shows, and the right ones that one contradicts."""
    cases = {name: (*pair, (name,), None) for name, pair in IN_TURN.items()}
    cases["the largest, all drawn"] = (*LARGEST, (), None)
    cases["recording"] = (LITTLE, {}, ("recording",), called_ten_times_better)
    rows = []
    for number, (name, (true, wrong, drawn, change)) in enumerate(cases.items()):
        say(f"population: {name} ten times too small")
        more = {"change": change} if change else {}
        right, short = right_and_wrong(
            valve, folder / f"case{number}", true, wrong, *drawn, machines=IN_A_CASE, **more
        )
        rows.append(Row(what=f"{name}: ten times too small and not seen", value=float(short.flowing == 0), limit=0,
                        note=f"{short.flowing} of {short.machines} flow"))  # fmt: skip
        rows.append(Row(what=f"{name}: right, and one flows", value=right.flowing, limit=0))
    return rows
