"""Machines drawn from the budget of a drive by current: none flows at zero command, none of the scenarios does."""

import tempfile
from pathlib import Path

from current_valve import CONTROLLED
from population import FEW, MACHINES, shut_rows, valves
from scoreboard import Row, print_rows, say
from small_budgets import designed

from dzdesign.verify.closed_loop.scene import scenes_of


def print_current_population(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of each valve behind the current loop, its true current simulated."""
    rows = []
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as folder:
        for name, valve in valves().items():
            say(f"machines of {name} by current")
            firmware = Path(folder) / name
            scenes = scenes_of(firmware, designed(valve, firmware, **CONTROLLED), None)
            rows += shut_rows(f"{name}, by current", scenes, FEW if quick else MACHINES, seed)
    print_rows(f"Machines drawn from the budget of a drive by current (seed {seed})", rows)
    return rows
