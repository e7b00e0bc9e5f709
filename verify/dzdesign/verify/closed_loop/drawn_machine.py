"""Machines drawn from the budget: what their places in each half-width do to the drive at zero command and the loop.

A machine passes flow at zero command if its drive there is above the threshold of its valve. `ZeroDrives` tells the
drive of many machines at once, by the law, without a plant; `drawn_machine` puts one of them into the loop.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from dzdesign.design.machine import Machine
from dzdesign.verify.closed_loop.drive_corners import COPPER_AT_C, holds_current, resistance_ratio
from dzdesign.verify.closed_loop.loop import ClosedLoop, ReadingErrors
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.exhaustive.exact_law import ExactLaw
from dzdesign.verify.exhaustive.zero_command import counted_dither

#: What is drawn, each by itself.
COMPONENTS = (
    "recording", "coil temperature", "supply", "current", "bench current", "current's rest", "oil", "ageing",
    "pressure sensor A", "pressure sensor B", "bench pressure drop", "offset of converter A", "offset of converter B",
    "gain of converter A", "gain of converter B", "zero command",
)  # fmt: skip
#: A component's place in its half-width, of one machine or of many.
Places = Mapping[str, Any]
#: Of command, sensor A and sensor B.
OfChannels = tuple[Any, Any, Any]


def places_of(shares: np.ndarray) -> dict[str, Any]:
    """Return the places of each component: numbers of one machine's shares, (machines, 1) of those of many."""
    if shares.ndim == 1:
        return dict(zip(COMPONENTS, map(float, shares), strict=True))
    return {name: shares[:, [place]] for place, name in enumerate(COMPONENTS)}


def drawn_machine(
    scene: Scene, machine: Machine, shares: np.ndarray, index: int
) -> tuple[ClosedLoop, ReadingErrors]:
    """Return the machine at so many half-widths from the bench, -1 to 1 each: its valve's threshold apart.

    The loop has its coil, supply or current, and the valve's oil and age.
    """
    at, loop = places_of(shares), scene.loop
    resistance, ratio = _resistance_and_drive(scene, machine, at)
    if loop.coil:
        coil, supply = loop.coil.circuit.resistance_factors, loop.coil.circuit.supply_V
        loop = loop.with_coil(
            resistance=_between(coil, at["coil temperature"]), supply_V=_between(supply, at["supply"])
        )
    elif isinstance(loop.plant, Plant):
        loop = loop.with_plant(replace(loop.plant, R_c_ohm=loop.plant.R_c_ohm * resistance))
    else:
        ratio /= resistance
    offsets, gains, noise = _errors(scene, machine, at)
    errors = ReadingErrors(offset_codes=offsets, gain_codes=gains, noise_codes=noise, seed=index + 1)
    return loop.with_drive(ratio).with_added_drive(_rest_V(scene, machine, at) * ratio), errors


def _resistance_and_drive(scene: Scene, machine: Machine, at: Places) -> tuple[Any, Any]:
    """Return the coil's resistance over that on the bench, where it counts, and the drive that is not of it."""
    # The threshold moves with oil and age, and the drive over it the other way.
    aged = (1 + at["oil"] * machine.oil_error) * (1 + at["ageing"] * machine.ageing_error)
    if machine.drive != "duty" or holds_current(scene.compensator):
        error = machine.amplifier_error if machine.drive == "amplifier" else machine.current_error
        bench = 1 - at["bench current"] * (machine.bench_current_error or 0.0)
        return 1.0, (1 + at["current"] * (error or 0.0)) / bench / aged
    bench_C = COPPER_AT_C if machine.bench_coil_C is None else machine.bench_coil_C
    bench_V = machine.bench_supply_V or 1.0
    coil_C = _between(machine.coil_temperature_C or (bench_C, bench_C), at["coil temperature"])
    voltage = _between(machine.supply_V or (bench_V, bench_V), at["supply"]) / bench_V
    return resistance_ratio(coil_C, bench_C), voltage / aged


def _rest_V(scene: Scene, machine: Machine, at: Places) -> Any:
    """Return what a current adds to the drive whatever it is, V of command."""
    return at["current's rest"] * (machine.current_rest_error or 0.0) * scene.loop.u_max_V


def _between(ends: tuple[float, float], share: Any) -> Any:
    low, high = ends
    return low + (high - low) * (share + 1) / 2


def _errors(scene: Scene, machine: Machine, at: Places) -> tuple[OfChannels, OfChannels, tuple[int, int, int]]:
    """Return offsets, gains and noise of command, sensor A and sensor B, as `ReadingErrors` has them.

    A wrong pressure drop on the bench is one of the sensor ahead.
    """
    channels, command = scene.loop.channels, scene.compensator.command_error
    a_codes, b_codes = map(float, channels.per_unit[1:])
    a_MPa = at["pressure sensor A"] * machine.pressure_error_a_MPa
    b_MPa = at["pressure sensor B"] * machine.pressure_error_b_MPa
    # It is drawn for a drop of A minus B; where that is B minus A, all of it turns round.
    a_MPa = a_MPa + at["bench pressure drop"] * machine.bench_pressure_error_MPa
    way = -1.0 if channels.swapped else 1.0
    offset_a, offset_b = (at[f"offset of converter {name}"] * machine.pressure_offset_codes for name in "AB")
    gain_a, gain_b = (at[f"gain of converter {name}"] * machine.pressure_gain_codes for name in "AB")
    has_band = scene.compensator.zero_band_codes > 0
    noise = machine.pressure_noise_codes
    # Whichever way the command's codes run.
    direction = scene.compensator.signals.command.direction(scene.sign)
    return (
        (
            direction * at["zero command"] * command.offset_codes if has_band else 0.0,
            way * (a_MPa * a_codes + offset_a),
            way * (b_MPa * b_codes + offset_b),
        ),
        (0.0, way * gain_a, way * gain_b),
        (command.noise_codes if has_band else 0, noise, noise),
    )


class ZeroDrives:
    """The drive at zero command of many machines of a scene's side, V of the bench's drive."""

    def __init__(self, scene: Scene, machine: Machine) -> None:
        self._scene, self._machine, self._exact = scene, machine, ExactLaw(scene.compensator, scene.sign)
        exact, noise = self._exact, machine.pressure_noise_codes
        ends = np.array([0, exact.code_max])
        furthest = np.sort(exact.difference(ends, ends[::-1]))
        self._first = int(furthest[0])
        peaks = np.array([exact.a.zero_code + noise]), np.array([exact.b.zero_code - noise])
        reach = abs(int(exact.difference(*peaks)[0])) + 1
        # The last node is at the largest difference that sound sensors make.
        last = scene.compensator.beta_step_codes * (len(scene.compensator.side(scene.sign).beta) - 1)
        betas = exact.beta_numerators(np.minimum(np.arange(furthest[0], furthest[1] + 1), last))
        lines = exact.lines_in_beta()
        peak, unit_V = counted_dither(scene.compensator), scene.loop.u_max_V / exact.compare_max
        #: Of every difference of codes, with the noise of both sensors at its peak either way: the drive within the
        #: zero band, and where that and the transition end.
        self._drives = []
        for place, (_, none, more) in enumerate(lines[:-1]):
            beta = (betas.zero if place <= (1 if exact.transition_end else 0) else betas.law) / betas.denominator
            counts = np.clip(np.floor(float(none) + float(more) * beta + 0.5), 0, exact.compare_limit) + peak
            self._drives.append(unit_V * _largest_within(counts, reach))
        self._ends = [code for code, _, _ in lines[:-1]]

    def at(self, shares: np.ndarray, dp_MPa: np.ndarray) -> np.ndarray:
        """Return the drive of each machine at its pressure drops, (machines, pressures)."""
        scene, exact, at = self._scene, self._exact, places_of(shares)
        resistance, ratio = _resistance_and_drive(scene, self._machine, at)
        if isinstance(plant := scene.loop.plant, Plant):
            # Eqs. (19)-(21) at rest: the amplifier's feedback holds the current against most of the coil's resistance.
            beside = plant.r_p_ohm + plant.K_a * plant.K_fi_V_A
            resistance = (plant.R_c_ohm * resistance + beside) / (plant.R_c_ohm + beside)
        ratio = ratio / resistance
        (command, *offsets), (_, *gains), (noise, *_) = _errors(scene, self._machine, at)
        ahead = 1 if scene.loop.channels.swapped else 0
        pressures = [scene.back_MPa + (dp_MPa if sensor == ahead else np.zeros((1, 1))) for sensor in (0, 1)]
        codes = [
            np.clip((zero + pressure * per_MPa) * (1 + gain / exact.code_max) + offset, 0, exact.code_max).astype(int)
            for zero, pressure, per_MPa, gain, offset in zip(
                scene.loop.channels.zeros[1:], pressures, scene.loop.channels.converted_per_unit[1:], gains, offsets,
                strict=True,
            )
        ]  # fmt: skip
        place = exact.difference(*codes) - self._first
        drive_V: np.ndarray = self._drives[0][place]
        away = np.abs(np.trunc(command)) + noise
        if exact.transition_end and np.any(away > exact.zero_band):
            share = np.clip((away - self._ends[1]) / (self._ends[2] - self._ends[1]), 0.0, 1.0)
            drive_V = drive_V + share * (self._drives[2][place] - drive_V)
        drives: np.ndarray = (drive_V + _rest_V(scene, self._machine, at)) * ratio
        return drives


def _largest_within(values: np.ndarray, reach: int) -> np.ndarray:
    """Return the largest value within a reach to either side of each."""
    padded = np.pad(values, reach, mode="edge")
    largest: np.ndarray = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=1)
    return largest
