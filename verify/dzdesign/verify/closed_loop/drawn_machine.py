"""One machine of a population: what its place in each half-width of the budget does to the loop."""

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from dzdesign.design.machine.machine import Machine
from dzdesign.verify.closed_loop.drive_corners import COPPER_AT_C, holds_current, resistance_ratio
from dzdesign.verify.closed_loop.loop import ClosedLoop
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.readings import ReadingErrors
from dzdesign.verify.closed_loop.scene import Scene

#: What is drawn, and the end of each at which the valve passes flow soonest; of pressures where dP reads too low.
ENDS = MappingProxyType(
    {
        "recording": -1.0, "coil temperature": -1.0, "supply": 1.0, "current": 1.0, "bench current": 1.0,
        "current's rest": 1.0, "oil": -1.0, "ageing": -1.0, "pressure sensor A": -1.0, "pressure sensor B": 1.0,
        "bench pressure drop": -1.0, "offset of converter A": -1.0, "offset of converter B": 1.0,
        "gain of converter A": -1.0, "gain of converter B": 1.0, "zero command": 1.0,
    }
)  # fmt: skip
COMPONENTS = tuple(ENDS)
#: Those that make the pressure drop read wrong.
PRESSURES = tuple(name for name in COMPONENTS if "pressure" in name or "converter" in name)


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnMachine:
    """A machine, its valve's threshold apart."""

    #: With its coil, supply or current, and the valve's oil and age.
    loop: ClosedLoop
    #: Added to the drive whatever it is, V of command.
    added_V: float
    errors: ReadingErrors
    #: Where the threshold lies in its band, from -1 to 1.
    threshold: float
    #: Where each component lies in its half-width.
    shares: np.ndarray

    def in_words(self) -> dict[str, float]:
        """Return the place of every component in its half-width."""
        return {name: round(float(share), 6) for name, share in zip(COMPONENTS, self.shares, strict=True)}


def worst_ends(scene: Scene) -> np.ndarray:
    """Return the end of each component at which the valve of a scene passes flow soonest."""
    trend = scene.compensator.valve.sides[scene.side].trend
    way = -1.0 if trend == "increasing" else 1.0
    return np.array([end * (way if name in PRESSURES else 1.0) for name, end in ENDS.items()])


def drawn_machine(scene: Scene, machine: Machine, shares: np.ndarray, index: int) -> DrawnMachine:
    """Return the machine at so many half-widths from the bench, -1 to 1 each."""
    at = dict(zip(COMPONENTS, map(float, shares), strict=True))
    loop, ratio = _driven(scene, machine, at)
    # The threshold moves with oil and age, and the drive over it the other way.
    ratio /= (1 + at["oil"] * machine.oil_error) * (1 + at["ageing"] * machine.ageing_error)
    rest_V = at["current's rest"] * (machine.current_rest_error or 0.0) * scene.loop.u_max_V
    return DrawnMachine(
        loop=loop.with_drive(ratio),
        added_V=rest_V * ratio,
        errors=_errors(scene, machine, at, index),
        threshold=at["recording"],
        shares=shares,
    )


def _driven(scene: Scene, machine: Machine, at: dict[str, float]) -> tuple[ClosedLoop, float]:
    """Return the loop with its coil, and the drive over that on the bench."""
    if machine.drive != "duty" or holds_current(scene.compensator):
        error = machine.amplifier_error if machine.drive == "amplifier" else machine.current_error
        bench = 1 - at["bench current"] * (machine.bench_current_error or 0.0)
        loop = scene.loop
        if loop.controls_current and (drive := scene.compensator.current_drive):
            coil, supply = drive.circuit.resistance_factors, drive.circuit.supply_V
            loop = loop.with_coil(
                resistance=_between(coil, at["coil temperature"]), supply_V=_between(supply, at["supply"])
            )
        return loop, (1 + at["current"] * (error or 0.0)) / bench
    bench_C = COPPER_AT_C if machine.bench_coil_C is None else machine.bench_coil_C
    resistance = resistance_ratio(
        _between(machine.coil_temperature_C or (bench_C, bench_C), at["coil temperature"]), bench_C
    )
    bench_V = machine.bench_supply_V or 1.0
    voltage = _between(machine.supply_V or (bench_V, bench_V), at["supply"]) / bench_V
    if isinstance(scene.plant, Plant):
        plant = replace(scene.plant, R_c_ohm=scene.plant.R_c_ohm * resistance)
        return scene.loop.with_plant(plant), voltage
    return scene.loop, voltage / resistance


def _between(ends: tuple[float, float], share: float) -> float:
    low, high = ends
    return low + (high - low) * (share + 1) / 2


def _errors(scene: Scene, machine: Machine, at: dict[str, float], index: int) -> ReadingErrors:
    """Return what is read wrong; a wrong pressure drop on the bench is one of the sensor ahead."""
    channels, command = scene.loop.channels, scene.compensator.command_error
    a_codes, b_codes = channels.codes_per_MPa
    a_MPa = at["pressure sensor A"] * machine.pressure_error_a_MPa
    b_MPa = at["pressure sensor B"] * machine.pressure_error_b_MPa
    # It is drawn for a drop of A minus B; where that is B minus A, all of it turns round.
    a_MPa += at["bench pressure drop"] * machine.bench_pressure_error_MPa
    way = -1.0 if channels.swapped else 1.0
    offset_a, offset_b = (at[f"offset of converter {name}"] * machine.pressure_offset_codes for name in "AB")
    gain_a, gain_b = (at[f"gain of converter {name}"] * machine.pressure_gain_codes for name in "AB")
    has_band = scene.compensator.zero_band_codes > 0
    noise = machine.pressure_noise_codes
    # Whichever way the command's codes run.
    direction = scene.compensator.signals.command.direction(scene.sign)
    return ReadingErrors(
        offset_codes=(
            direction * at["zero command"] * command.offset_codes if has_band else 0.0,
            way * (a_MPa * a_codes + offset_a),
            way * (b_MPa * b_codes + offset_b),
        ),
        gain_codes=(0.0, way * gain_a, way * gain_b),
        noise_codes=(command.noise_codes if has_band else 0, noise, noise),
        seed=index + 1,
    )
