"""The stand-in plant beside the raw recordings: mean flow per bin of command, both branches, every pressure drop.

The recordings are read and averaged here, by csv and NumPy alone: nothing of `identify` stands between them and the
plant's flow but the valve.json that the plant is made of.
"""

import csv
import gzip
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from scoreboard import Row, print_rows, say

from dzdesign.identify.identification import identify
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.stand_in import stand_in_of

ROOT = Path(__file__).parents[2]
SHARED = Path(os.environ.get("DZDESIGN_SHARED_DATA", ROOT.parent / "shared" / "data"))
RECORDINGS = {
    "the example": ROOT / "examples" / "paper_valve" / "ramps",
    "valve A": SHARED / "valve_a",
    "valve E": SHARED / "valve_e",
}
#: Bins of command over full; samples over which the command is smoothed to find where it turns; V.
BINS, SMOOTHED, FULL_V = 100, 51, 10.0
FEWEST = 20
#: Share of a test's largest flow by which any bin may be off.
LIMIT = 0.03
BRANCHES = ("opening", "closing")


def recorded_bins(paths: Sequence[Path]) -> dict[str, np.ndarray]:
    """Return the mean flow of raw recordings at one pressure drop in each bin of command, L/min; NaN where few are."""
    sums = {branch: np.zeros(BINS) for branch in BRANCHES}
    counts = {branch: np.zeros(BINS) for branch in BRANCHES}
    for path in paths:
        with gzip.open(path, "rt", encoding="utf-8") as lines:
            rows = [
                (float(row["u_V"]), float(row["Q_Lmin"]))
                for row in csv.DictReader(line for line in lines if not line.startswith("#"))
                if row["u_V"].strip() and row["Q_Lmin"].strip()
            ]
        u, q = np.array(rows).T
        turn = int(np.argmax(np.convolve(u, np.ones(SMOOTHED) / SMOOTHED, mode="same")))
        for branch, part in (("opening", slice(0, turn)), ("closing", slice(turn, None))):
            _add(sums[branch], counts[branch], u[part] / FULL_V, q[part])
    return {branch: _means(sums[branch], counts[branch]) for branch in BRANCHES}


def plant_bins(loop: ClosedLoop, dp_MPa: float, floor_L_min: float) -> dict[str, np.ndarray]:
    """Return the same of the plant's flow on the paper's ramp, read by a meter that shows nothing below its floor."""
    run = loop.run(RampSequence().command(), dp_MPa)
    read = np.where(run.q_mean_L_min < floor_L_min, 0.0, run.q_mean_L_min)
    turn = int(np.argmax(run.command))
    found = {}
    for branch, part in (("opening", slice(0, turn)), ("closing", slice(turn, None))):
        total, count = np.zeros(BINS), np.zeros(BINS)
        _add(total, count, run.command[part], read[part])
        found[branch] = _means(total, count)
    return found


def _add(total: np.ndarray, count: np.ndarray, share: np.ndarray, q: np.ndarray) -> None:
    index = np.floor(share * BINS).astype(int)
    inside = (index >= 0) & (index < BINS)
    np.add.at(total, index[inside], q[inside])
    np.add.at(count, index[inside], 1)


def _means(total: np.ndarray, count: np.ndarray) -> np.ndarray:
    return np.where(count >= FEWEST, total / np.maximum(count, 1), np.nan)


def largest_miss(plant: Mapping[str, np.ndarray], recorded: Mapping[str, np.ndarray]) -> tuple[float, str]:
    """Return the largest departure in any bin over the largest recorded flow, and where it is."""
    largest = max(float(np.nanmax(recorded[branch])) for branch in BRANCHES)
    worst = (0.0, "")
    for branch in BRANCHES:
        miss = np.abs(plant[branch] - recorded[branch]) / largest
        at = int(np.nanargmax(miss))
        worst = max(worst, (float(miss[at]), f"on {branch} at {100 * at / BINS:.0f} % of command"))
    return worst


def valve_of(folder: Path) -> ValveModel:
    """Return the valve of a folder's recordings, identified with every default."""
    return identify([read_ramp_file(path) for path in sorted(folder.glob("*.csv.gz"))])


def misses(valve: ValveModel, folder: Path, loop: ClosedLoop | None = None) -> Iterator[tuple[float, float, str]]:
    """Yield each test's pressure drop, the largest departure and where it is."""
    loop = loop or ClosedLoop(stand_in_of(valve.positive, valve.u_max_V))
    for test in valve.positive.tests:
        recorded = recorded_bins([folder / name for name in test.source.split(", ")])
        yield test.dp_MPa, *largest_miss(plant_bins(loop, test.dp_MPa, valve.meter.floor_L_min), recorded)


def print_stand_in(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows; nothing of it is drawn, and there is no less of it."""
    del quick, seed
    rows = []
    for name, folder in RECORDINGS.items():
        if not folder.is_dir():
            say(f"{name}: its recordings are not at {folder} (set DZDESIGN_SHARED_DATA)")
            continue
        found = list(misses(valve_of(folder), folder))
        rows += [
            Row(what=f"{name}, {dp_MPa:.2f} MPa", value=100 * miss, limit=100 * LIMIT, unit="%", note=where)
            for dp_MPa, miss, where in found
        ]
    print_rows("The stand-in plant: mean flow per 1 % of command beside the raw recordings, of the largest flow", rows)
    return rows
