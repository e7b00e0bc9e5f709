"""The native plant beside CasADi's CVODES, as `verify` compares them: over drives, and plants at their ends; its speed.

The speed is simulated time over the wall clock's, of a ramp of the compensated example in the same run.
"""

import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from current_valve import CONTROLLED
from example_valve import example_valve
from scoreboard import Row, print_rows, say

from dzdesign.verify.closed_loop.against_cvodes import MOST_APART, Window, compare
from dzdesign.verify.closed_loop.loop import RECORD_S, ClosedLoop
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.scene import Scene, scenes_of
from tests.support.designs import designed, written

QUICK_S, WHOLE_S = 0.3, 1.0
#: Times real time at least, and how often it is measured: the others held something else too.
SPEED_GOAL, REPEATS = 1000.0, 20
#: Drives of the example: options of `design`.
DRIVES: Mapping[str, Mapping[str, str]] = {
    "by duty": {},
    "dither, of the drive alone": {"dither": "150 Hz 1 %"},
    "ramps, inverted command, 90 % of output": {
        "ramp_up": "0.4 s", "ramp_down": "0.2 s", "polarity": "inverted", "output_max": "90 %",
    },
    "by current": CONTROLLED,
    "by current, fast coil": CONTROLLED
    | {"coil": "0.8 ohm 1 mH", "rated_current": "3 A", "current_signal": "0..3.6 A on 0.5 ohm + 0.15 V"},
}  # fmt: skip
#: What is other than in `Plant()`.
PLANTS: Mapping[str, Mapping[str, float]] = {
    "coil of 2 ms": {"L_c_H": 0.08},
    "coil of 100 ms": {"L_c_H": 4.0},
    "coil of 2.5 us": {"L_c_H": 1e-4},
    "low damping, stop at 1.2 mm": {"B_e_N_s_m": 3.0, "stroke_mm": 1.2},
    "no damping, stop at 1.5 mm": {"B_e_N_s_m": 0.0, "stroke_mm": 1.5},
    "thrown at a stop of 0.8 mm": {"K_i_N_A": 120.0, "B_e_N_s_m": 10.0, "stroke_mm": 0.8},
    "edge 0.1 mm before the stop": {"overlap_mm": 0.9, "stroke_mm": 1.0},
    "no overlap, pressure opens it": {"overlap_mm": 0.0, "preload_N": 0.0},
    "spool of 2 g": {"m_e_kg": 2e-3, "B_e_N_s_m": 5.0},
    "spool of 1 kg": {"m_e_kg": 1.0},
    "damped 20 times": {"B_e_N_s_m": 1000.0},
    "play of 1 V": {"hysteresis_V": 1.0},
    "flow force 10 times": {"flow_force_N_mm_MPa": 15.0},
    "droop 50 times": {"droop_MPa_L_min2": 0.02},
    "nothing depends on the position": {"flow_force_N_mm_MPa": 0.0, "droop_MPa_L_min2": 0.0},
}


def print_native_plant(*, quick: bool, seed: int) -> list[Row]:
    """Print and return a row of positions and one of flows a case, and the speeds; nothing is drawn."""
    del seed
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="bench-verify-") as temporary:
        for number, (name, texts) in enumerate(DRIVES.items()):
            firmware = Path(temporary) / f"case{number}"
            compensator = designed(example_valve(), **texts)
            written(compensator, firmware)
            for plant in (None, Plant()):
                scene = scenes_of(firmware, compensator, plant)[0]
                rows += _rows(f"{name}, {'equations' if plant else 'recorded flow'}", scene, quick, {})
            if name == "by duty":
                for changed, parameters in PLANTS.items():
                    rows += _rows(changed, scene, quick, parameters)
                rows += _speeds(scene.loop)
    print_rows("The native plant beside CasADi's CVODES", rows)
    return rows


def _rows(name: str, scene: Scene, quick: bool, parameters: Mapping[str, float]) -> Iterator[Row]:
    say(name)
    found = compare(Window.of(scene, QUICK_S if quick else WHOLE_S, **parameters))
    note = f"{found.impacts} stops met; at most {found.q_largest_L_min:.3g} L/min"
    yield Row(what=f"{name}: position, of the stroke", value=found.position_difference, limit=MOST_APART, note=note)
    yield Row(what=f"{name}: flow, of the largest", value=found.flow_difference, limit=MOST_APART)


def _speeds(loop: ClosedLoop) -> Iterator[Row]:
    command = np.concatenate([np.linspace(0, 1, 1000), np.linspace(1, 0, 1000)])
    for name in ("the example", "coil of 2 ms", "coil of 100 ms", "flow force 10 times"):
        other, taken = loop.with_plant(replace(Plant(), **PLANTS.get(name, {}))), []
        for _ in range(REPEATS):
            begin = perf_counter()
            other.run(command, 2.0, "compensated")
            taken.append(perf_counter() - begin)
        times = command.size * RECORD_S / min(taken)
        yield Row(what=f"{name}: times real time, goal over measured", value=SPEED_GOAL / times, limit=1.0,
                  note=f"{times:.0f} times real time by the wall clock")  # fmt: skip
