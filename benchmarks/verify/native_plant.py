"""The native plant beside CasADi's CVODES, as `verify` compares them, over drives, valves and plants at their ends.

Each drive has its firmware, and is tried with the recorded flow and with a plant of equations. The plants differ from
the example's in few parameters, up to the ends of what a plant file may have.
"""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np
from current_valve import CONTROLLED
from example_valve import example_valve
from scoreboard import Row, print_rows, say
from small_budgets import designed
from stand_in_flow import RECORDINGS, valve_of

from dzdesign.core.dither import read_dithered
from dzdesign.design.compensator import Compensator
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import ramp_file_bytes, read_ramp_file
from dzdesign.identify.valve.model import ValveModel
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.loop import RECORD_S, ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.integrator.comparison import MOST_APART, compare, windows_of
from dzdesign.verify.integrator.compiled_calls import compiled_core
from dzdesign.verify.loop_results import PlantComparison

QUICK_S = 0.1
BOTH_SIGNS = {"command_signal": "-10..10 V x 0.15 + 1.5 V"}
FAST_COIL = {"coil": "0.8 ohm 1 mH", "rated_current": "3 A", "current_signal": "0..3.6 A on 0.5 ohm + 0.15 V"}
#: Drives of the example: options of `design`.
DRIVES: Mapping[str, Mapping[str, str]] = {
    "by duty": {},
    "play": {"hysteresis": "play"},
    "dither, of the drive alone": {"dither": "150 Hz 1 %"},
    "ramps, inverted command, 90 % of output": {
        "ramp_up": "0.4 s", "ramp_down": "0.2 s", "polarity": "inverted", "output_max": "90 %",
    },
    "by current": CONTROLLED,
    "by current, fast coil": CONTROLLED | FAST_COIL,
}  # fmt: skip
TWO_SOLENOIDS: Mapping[str, Mapping[str, str]] = {
    "two solenoids": BOTH_SIGNS,
    "two solenoids, sensors swapped": BOTH_SIGNS | {"negative_dp": "swapped"},
}
#: What is other than in `Plant()`.
PLANTS: Mapping[str, Mapping[str, float]] = {
    "low damping, stop at 1.2 mm": {"B_e_N_s_m": 3.0, "stroke_mm": 1.2},
    "no damping, stop at 1.5 mm": {"B_e_N_s_m": 0.0, "stroke_mm": 1.5},
    "thrown at a stop of 0.8 mm": {"K_i_N_A": 120.0, "B_e_N_s_m": 10.0, "stroke_mm": 0.8},
    "edge 0.1 mm before the stop": {"overlap_mm": 0.9, "stroke_mm": 1.0},
    "no overlap, pressure opens it": {"overlap_mm": 0.0, "preload_N": 0.0},
    "coil of 1 mH": {"L_c_H": 1e-3},
    "coil of 0.1 mH": {"L_c_H": 1e-4},
    "coil of 1 H": {"L_c_H": 1.0},
    "coil of 1 mH, spool of 2 g": {"L_c_H": 1e-3, "m_e_kg": 2e-3, "B_e_N_s_m": 5.0},
    "spool of 1 kg": {"m_e_kg": 1.0},
    "damped 20 times": {"B_e_N_s_m": 1000.0},
    "play of 1 V": {"hysteresis_V": 1.0},
    "flow force 10 times": {"flow_force_N_mm_MPa": 15.0},
    "droop 50 times": {"droop_MPa_L_min2": 0.02},
    "nothing depends on the position": {"flow_force_N_mm_MPa": 0.0, "droop_MPa_L_min2": 0.0},
}
#: A valve of high pressure, and where it is recorded, MPa.
HIGH_PRESSURE = Plant(pressure_force_N_MPa=0.1, flow_force_N_mm_MPa=0.3, C_d_W_mm=1.0)
HIGH_MPA, HIGH_SPAN = (2.0, 10.0, 20.0, 35.0), {"pressure_span": "40 MPa"}
DITHER, WAVE = "156.25 Hz 1 %", (600, 8)


def print_native_plant(*, quick: bool, seed: int) -> list[Row]:
    """Print and return a row of positions and one of flows a case."""
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as temporary:
        for name, compensator, folder, plants in _cases(Path(temporary), seed):
            for plant in plants:
                scenes = scenes_of(folder, compensator, plant)
                rows += _rows(f"{name}, {'equations' if plant else 'recorded flow'}", scenes, folder, quick)
            if name == "by duty":
                rows += _plants(scenes, folder, quick)
    print_rows(f"The native plant beside CasADi's CVODES (seed {seed})", rows)
    return rows


def _cases(folder: Path, seed: int) -> Iterator[tuple[str, Compensator, Path, tuple[Plant | None, ...]]]:
    """Yield name, compensator, firmware and plants of each drive and valve."""
    example, both = example_valve(), (None, Plant())
    two = replace(example, sides={"positive": example.positive, "negative": example.positive})
    cases: list[tuple[str, ValveModel, Mapping[str, str], tuple[Plant | None, ...]]] = [
        *((name, example, texts, both) for name, texts in DRIVES.items()),
        *((name, two, texts, both) for name, texts in TWO_SOLENOIDS.items()),
        ("recorded under a dither", _recorded(folder / "dithered", Plant(), (0.5, 2.0, 5.0), seed, DITHER),
         {"dither": DITHER}, both),
        ("35 MPa", _recorded(folder / "high", HIGH_PRESSURE, HIGH_MPA, seed), HIGH_SPAN, (None, HIGH_PRESSURE)),
        *((name, valve_of(place), {}, both) for name, place in RECORDINGS.items()
          if name != "the example" and place.is_dir()),
    ]  # fmt: skip
    for number, (name, valve, texts, plants) in enumerate(cases):
        firmware = folder / f"case{number}"
        yield name, designed(valve, firmware, **texts), firmware, plants


def _recorded(folder: Path, plant: Plant, pressures: tuple[float, ...], seed: int, dither: str = "") -> ValveModel:
    """Return a valve as identified from ramps of a plant of equations, by a meter without a floor."""
    folder.mkdir()
    loop, tests = ClosedLoop(plant, dither=WAVE if dither else None), []
    rng, sequence = np.random.default_rng(seed), RampSequence(ramp=40.0)
    for dp_MPa in pressures:
        run = loop.run(sequence.command(), dp_MPa, back_MPa=0.0)
        every = slice(None, None, round(0.04 / RECORD_S))
        noise = rng.standard_normal((2, run.time[every].size))
        columns = {
            "time_s": run.time[every], "u_V": plant.u_max_V * run.command[every],
            "dP_MPa": run.dp_MPa[every] + 0.01 * noise[0], "Q_Lmin": run.q_mean_L_min[every] + 0.05 * noise[1],
        }  # fmt: skip
        path = folder / f"dP{dp_MPa:g}.csv"
        path.write_bytes(ramp_file_bytes(columns, (), compress=False))
        tests.append(read_ramp_file(path))
    return identify(tests, IdentifyOptions(dithered=read_dithered(dither, "--dithered") if dither else None))


def _plants(scenes: Sequence[Scene], folder: Path, quick: bool) -> Iterator[Row]:
    for name, changes in PLANTS.items():
        plant = replace(Plant(), **changes)
        loops = [replace(scene, plant=plant, loop=scene.loop.with_plant(plant)) for scene in scenes]
        yield from _rows(name, loops, folder, quick)


def _rows(name: str, scenes: Sequence[Scene], folder: Path, quick: bool) -> list[Row]:
    begin = process_time()
    found = list(_compared(scenes, folder, quick))
    passed = sum(each.seconds for each in found)
    unlike = sum(each.unlike_compare_values for each in found)
    position = max(found, key=lambda each: each.position_difference)
    flow = max(found, key=lambda each: each.flow_difference)
    shut = sum(each.q_largest_L_min <= 0 for each in found)
    say(f"{name}: {position.position_difference:.1e} of the stroke, {flow.flow_difference:.1e} of the flow")
    note = f"{sum(each.impacts for each in found)} stops met; {shut} of {len(found)} windows stay shut; "
    note += f"{process_time() - begin:.1f} s of processor for {passed:.2g} s"
    rows = [
        Row(what=f"{name}: position, of the stroke", value=position.position_difference, limit=MOST_APART, note=note),
        Row(what=f"{name}: flow, of the largest", value=flow.flow_difference, limit=MOST_APART,
            note=f"{flow.kind} at {flow.dp_MPa:.3g} MPa"),
    ]  # fmt: skip
    return [*rows, Row(what=f"{name}: unlike compare values", value=unlike, limit=0)] if unlike else rows


def _compared(scenes: Sequence[Scene], folder: Path, quick: bool) -> Iterator[PlantComparison]:
    core = compiled_core(folder, scenes[0].loop.coil)
    for window in windows_of(scenes):
        yield compare(replace(window, seconds=QUICK_S) if quick else window, core)
