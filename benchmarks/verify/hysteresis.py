"""Hysteresis of the compensated loop, small loops included: kept, with the play, and under a dither.

The valves are those of dithered_valve.py: ramps of them are recorded, identified and designed for, and the firmware
drives the plant. Beside them stand the recordings of A and E, whose own recorded flow stands in for the valve.
"""

import tempfile
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from dithered_valve import CORNERS, VALVES, Loop, driven_loop, library, ramp_recording, widest, written
from scoreboard import Row, print_rows, say
from stand_in_flow import RECORDINGS, valve_of

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.dither import read_dithered
from dzdesign.design.compensator import Compensator
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import read_ramp_file
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop.scene import scenes_of

PRESSURES, RAMPS = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0), 2
LIMIT, FREQUENCY_HZ = 0.5, 150.0
#: The peak of the recordings' dither in percent, what is given to `design`, and limits of the valves that have one.
WAYS: Mapping[str, tuple[float, Mapping[str, str], Mapping[str, float]]] = {
    "kept": (0.0, {}, {}),
    "play": (0.0, {"hysteresis": "play"}, {"A": LIMIT}),
    "dither 1 %": (1.0, {"dither": "150 Hz 1 %"}, {"example": LIMIT}),
    "dither 1 % and play": (1.0, {"dither": "150 Hz 1 %", "hysteresis": "play"}, dict.fromkeys(VALVES, LIMIT)),
    "dither 2 %": (2.0, {"dither": "150 Hz 2 %"}, dict.fromkeys(VALVES, LIMIT)),
}


def print_hysteresis(*, quick: bool, seed: int) -> list[Row]:
    """Print the widest loop of each valve and way, and what flows at zero command, at the wave's top."""
    del quick
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as folder:
        for name in VALVES:
            say(f"hysteresis of the valve like {name}")
            rows += list(_of_plant(name, Path(folder), seed))
        for name in ("valve A", "valve E"):
            if RECORDINGS[name].is_dir():
                say(f"hysteresis of the recordings of {name}")
                rows += list(_of_recordings(name, Path(folder)))
    print_rows("Hysteresis of the compensated loop: largest width from 5 to 100 % of flow, per cent of command", rows)
    return rows


def _of_plant(name: str, folder: Path, seed: int) -> Iterator[Row]:
    known: dict[float, ValveModel] = {}
    for way, (peak, texts, limits) in WAYS.items():
        if peak not in known:
            known[peak] = _identified(name, folder, peak, seed)
        made = design(known[peak], options_of(texts, target_named("f28335").inputs()))
        place = folder / f"{name}_{way.replace(' ', '_').replace('%', '')}"
        plant = library(folder, _firmware(made, place))
        loops = [driven_loop(plant, VALVES[name], dp) for dp in PRESSURES]
        width, flow, dp = max((*widest(loop), dp) for loop, dp in zip(loops, PRESSURES, strict=True))
        leak = max(float(loop.largest[-50:].max()) for loop in loops)
        onset = max(_onset(loop) for loop in loops)
        note = f"at {flow:.0%} of flow, {dp:g} MPa; onset {onset:.2%}; at zero command {leak:.2g} L/min"
        yield Row(what=f"like {name}: {way}", value=100 * width, limit=limits.get(name), unit="%", note=note)


def _identified(name: str, folder: Path, peak: float, seed: int) -> ValveModel:
    plant, tests = library(folder), []
    for ramp in range(RAMPS):
        for dp in PRESSURES:
            path = folder / f"{name}_{peak}_{dp}_{ramp}.csv"
            columns = ramp_recording(
                plant, VALVES[name], dp, seed + 100 * ramp + round(10 * dp), peak_V=peak / 10, frequency_Hz=FREQUENCY_HZ
            )
            written(columns, path)
            tests.append(read_ramp_file(path))
    dithered = read_dithered(f"{FREQUENCY_HZ:g} Hz {peak:g} %", "--dithered") if peak else None
    return identify(tests, IdentifyOptions(meter_lag=0.1, dithered=dithered))


def _firmware(made: Compensator, folder: Path) -> Path:
    generated = generate(made, "f28335")
    write_folder(folder, generated.files, generated.manifest)
    return folder


def _onset(loop: Loop) -> float:
    """Return the command at which the flow begins on the first way up, once the drive has come to rest at zero."""
    first = slice(20, loop.ends[1])
    return float(loop.command[first][np.argmax(loop.mean[first] > 1e-3 * loop.mean.max())])


def _of_recordings(name: str, folder: Path) -> Iterator[Row]:
    made = design(valve_of(RECORDINGS[name]), options_of({"hysteresis": "play"}, target_named("f28335").inputs()))
    parts = [np.linspace(a, b, round(abs(b - a) * 10_000)) for a, b in pairwise(CORNERS)]
    ends = np.cumsum([0, *(part.size for part in parts)])
    for scene in scenes_of(_firmware(made, folder / name.replace(" ", "_")), made, None):
        run = scene.loop.run(np.concatenate([*parts, np.zeros(100)]), scene.dp_MPa, "compensated")
        loop = Loop(command=run.command, mean=run.q_mean_L_min, largest=run.q_largest_L_min, ends=ends)
        (width, flow), (below, _) = widest(loop), widest(loop, 0.85)
        leak = run.q_largest_L_min[-1]
        note = f"at {flow:.1%} of flow; below 85 % of it {below:.2%}; at zero command {leak:.2g} L/min"
        yield Row(what=f"{name}, recorded, play, {scene.dp_MPa:.1f} MPa", value=100 * width, unit="%", note=note)
