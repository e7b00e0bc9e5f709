"""Valves with friction and magnetic hysteresis under an actual dither: ramps as a logger writes them, and the loop.

The plant is dithered_valve.c, which shares no code with the product; here stand its numbers, the bench's meter, and how
the hysteresis of the compensated loop is measured.
"""

import ctypes
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

SOURCE = Path(__file__).with_name("dithered_valve.c")
PERIOD_S, PLAYS = 400e-6, 8
#: Periods in a record: 100 a second.
EVERY = 25
FULL_V = 10.0
#: Rates and noise of the bench.
METER_LAG_S, METER_NOISE_L_MIN = 0.1, 0.03
#: The machine's pressure sensors, 4 to 20 mA for 0 to 20 MPa, on a converter of 12 bits and 3 V; and behind the edge.
LOWEST_A, HIGHEST_A, SENSOR_MPA, SHUNT_OHM, CONVERTER_V, CODES, BACK_MPA = 4e-3, 20e-3, 20.0, 140.0, 3.0, 4096, 1.0
#: Loops within loops of the command: full, half, and small ones, back to zero at the end.
CORNERS = (0, 1, 0, 0.5, 0.4, 0.5, 0.3, 0.35, 0.1, 0.2, 0)


@dataclass(frozen=True, kw_only=True)
class Valve:
    """Numbers of a valve, in volts of drive; the magnetic plays are of total width `width_V`, the widest `widest_V`."""

    edge_V: float
    fall_V_MPa: float
    gain: float  # L/min a volt at 1 MPa
    stroke_V: float
    width_V: float
    widest_V: float
    friction_V: float
    #: Share of the pressure drop lost is sag times the flow at 1 MPa squared.
    sag: float
    notch_V: float = 0.05
    floor_L_min: float = 0.0
    omega: float = 2 * np.pi * 80

    def numbers(self) -> np.ndarray:
        """Return them as the C takes them: radii spread evenly up to the widest, weights that fall with them."""
        radii = np.arange(1, PLAYS + 1) / PLAYS * self.widest_V / 2
        weights = 1 / radii
        weights *= self.width_V / (2 * weights @ radii)
        head = (1e-3, self.omega, 0.7, self.friction_V, 20.0, self.edge_V, self.fall_V_MPa, self.gain, self.notch_V,
                self.stroke_V, self.sag, 1 - weights.sum())  # fmt: skip
        return np.array([*head, *weights, *radii])


#: Like the example and the valves A and E of the shared measurements.
VALVES = {
    "example": Valve(
        edge_V=5.3, fall_V_MPa=0.045, gain=3.6, stroke_V=12.0, width_V=0.15, widest_V=0.16, friction_V=0.05, sag=4e-4
    ),
    "A": Valve(
        edge_V=5.35, fall_V_MPa=0.055, gain=4.6, stroke_V=9.6, width_V=0.16, widest_V=0.45, friction_V=0.05,
        sag=1.6e-3, floor_L_min=0.6,
    ),
    "E": Valve(
        edge_V=0.8, fall_V_MPa=0.005, gain=4.1, stroke_V=12.0, width_V=0.18, widest_V=0.4, friction_V=0.04, sag=3e-4
    ),
}  # fmt: skip


def library(folder: Path, core: Path | None = None) -> ctypes.CDLL:
    """Compile the plant, with the core of a firmware folder where one is given."""
    made = folder / f"plant{'' if core is None else '_' + core.name}.so"
    with_core = [] if core is None else ["-DWITH_DRIVE", f"-I{core / 'core'}", *map(str, (core / "core").glob("*.c"))]
    command = ["gcc", "-O2", "-shared", "-fPIC", "-o", str(made), str(SOURCE), *with_core, "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    return ctypes.CDLL(str(made))


def _pointer(array: np.ndarray) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)


def ramp_recording(
    plant: ctypes.CDLL,
    valve: Valve,
    dp_MPa: float,
    seed: int,
    *,
    peak_V: float,
    frequency_Hz: float,
    ramp_s: float = 40,
) -> dict[str, np.ndarray]:
    """Return the columns of a ramp test as the logger has them: the command without the dither, the metered flow."""
    corners = np.cumsum([0, 3, ramp_s, 2, ramp_s, 3])
    time = np.arange(0, corners[-1], EVERY * PERIOD_S)
    command = np.interp(time, corners, [0, 0, FULL_V, FULL_V, 0, 0])
    out, numbers = np.empty((time.size, 3)), valve.numbers()
    real = ctypes.c_double
    plant.recorded(_pointer(numbers), time.size, EVERY, _pointer(command), real(dp_MPa), real(FULL_V), real(peak_V),
                   real(frequency_Hz), _pointer(out))  # fmt: skip
    rng = np.random.default_rng(seed)
    pole = np.exp(-EVERY * PERIOD_S / METER_LAG_S)
    metered = lfilter([1 - pole], [1, -pole], out[:, 0])
    seen = metered + METER_NOISE_L_MIN * rng.standard_normal(time.size)
    return {
        "time_s": time,
        "u_V": command + 0.002 * rng.standard_normal(time.size),
        "dP_MPa": out[:, 2] + 0.005 * rng.standard_normal(time.size),
        "Q_Lmin": np.where(metered < valve.floor_L_min, 0.0, seen),
    }


def written(columns: Mapping[str, np.ndarray], path: Path) -> None:
    """Write columns as a logger does."""
    np.savetxt(path, np.column_stack(list(columns.values())), "%.5f", ",", header=",".join(columns), comments="")


@dataclass(frozen=True, kw_only=True)
class Loop:
    """A run of the compensated valve."""

    command: np.ndarray
    mean: np.ndarray
    largest: np.ndarray
    ends: np.ndarray


def driven_loop(
    plant: ctypes.CDLL,
    valve: Valve,
    dp_MPa: float,
    corners: Sequence[float] = CORNERS,
    *,
    records: int = 6000,
) -> Loop:
    """Run the firmware over a command of those corners, `records` from zero to full, and a second of its last."""
    parts = [np.linspace(a, b, max(round(abs(b - a) * records), 2)) for a, b in pairwise(corners)]
    command = np.concatenate([*parts, np.full(100, float(corners[-1]))])
    out = driven(plant, valve, dp_MPa, command * CODES)
    ends = np.cumsum([0, *(part.size for part in parts)])
    return Loop(command=command, mean=out[:, 0], largest=out[:, 1], ends=ends)


def driven(
    plant: ctypes.CDLL, valve: Valve, dp_MPa: float, codes: np.ndarray, *, every: int = EVERY
) -> np.ndarray:  # fmt: skip
    """Return mean and largest flow, pressure drop and compare value of the law after records of those command codes."""
    held, numbers, out = np.clip(codes, 0, CODES - 1).astype(np.uint16), valve.numbers(), np.empty((codes.size, 4))
    real, codes_an_A = ctypes.c_double, SHUNT_OHM / CONVERTER_V * CODES
    zero_code, codes_a_MPa = codes_an_A * LOWEST_A, codes_an_A * (HIGHEST_A - LOWEST_A) / SENSOR_MPA
    plant.driven(_pointer(numbers), held.size, every, _pointer(held), real(dp_MPa), real(FULL_V), real(60000.0),
                 real(BACK_MPA), real(zero_code), real(codes_a_MPa), _pointer(out))  # fmt: skip
    return out


def widest(loop: Loop, upto: float = 1.0) -> tuple[float, float]:
    """Return the largest distance of neighbouring branches over the command, from 5 % of flow on, and its flow."""
    flow = smoothed(loop.mean)
    largest = flow.max()
    branches = [(loop.command[a:b], flow[a:b]) for a, b in pairwise(loop.ends)]
    found = [(0.0, 0.0)]
    for (u, q), (other_u, other_q) in pairwise(branches):
        low, high = max(q.min(), other_q.min(), 0.05 * largest), min(q.max(), other_q.max(), upto * largest)
        flows = np.linspace(low, high, 400)[1:-1]
        if high > low:
            at, other = (
                np.interp(flows, np.sort(v), w[np.argsort(v, kind="stable")]) for w, v in ((u, q), (other_u, other_q))
            )
            place = int(np.abs(at - other).argmax())
            found.append((float(abs(at - other)[place]), float(flows[place] / largest)))
    return max(found)


def smoothed(values: np.ndarray, length: int = 5) -> np.ndarray:
    """Return running means: a record of 10 ms has no whole number of the dither's waves."""
    inner = np.convolve(values, np.full(length, 1 / length), mode="same")
    inner[: length // 2], inner[-(length // 2) :] = values[: length // 2], values[-(length // 2) :]
    return inner
