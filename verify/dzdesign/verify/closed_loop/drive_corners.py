"""The drive at the ends of coil temperature and supply, by formulas of this room's own: R = R20 (1 + alpha (T - 20)).

Where the duty is the coil's voltage, the current is duty V / R, and a threshold of the valve, which is one of current,
comes at a duty of R / V times that on the bench. An amplifier, or the firmware's current control, holds the current to
its declared error instead.

What is done to a plant: a stand-in's drive is multiplied, and only by what changes the current; a plant of equations
has the coil's resistance itself, and its PWM's voltage goes with the supply where the duty is the coil's voltage. Under
the firmware's current control the coil is the declared one, in the loop with the C, and the plant's own is left alone.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import CoilCircuit
from dzdesign.design.machine import Machine
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.ramps import FLOW_SHARE, dead_zone
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.loop_results import ScenarioResult

#: Of copper, per kelvin of its resistance at 20 °C.
COPPER_PER_K, COPPER_AT_C = 0.00393, 20.0
#: Of a machine that was not declared: a coil so much colder and hotter than on the bench, which was at 20 °C; and a
#: supply so much lower and higher.
COLDER_K, HOTTER_K, SUPPLY_SHARE = 40.0, 60.0, 0.2
NOT_DECLARED = "the machine is not declared"
#: Figure of a current that the firmware controls.
RELEASED = "flow_on_release_L_min"
#: Ramp up on which the dead zone is read, s: the spool's lag is some thousandths of a command of the quick ones.
READING_RAMP_S = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveCorner:
    """One end of coil and supply, or of a current that is held, beside the bench."""

    name: str
    #: Of the coil's resistance, and of the voltage that full duty puts on it; 1 on the bench.
    resistance_ratio: float = 1.0
    voltage_ratio: float = 1.0
    #: Of a coil in the loop with the C: of its inductance; its supply, V.
    inductance_ratio: float = 1.0
    supply_V: float | None = None
    #: Of the current that an amplifier, or the firmware's control, holds; 1 on the bench.
    current_ratio: float = 1.0
    #: What is added to that current, share of full drive.
    current_rest: float = 0.0
    #: Why no flow is not required there; empty: it is.
    not_required: str = ""

    def at_supply(self, supply: "DriveCorner") -> "DriveCorner":
        """Return this coil at another's supply."""
        return replace(
            self,
            name=f"{self.name}, {supply.name}",
            voltage_ratio=supply.voltage_ratio,
            not_required=self.not_required or supply.not_required,
        )


def resistance_ratio(coil_C: float, bench_coil_C: float) -> float:
    """Return a copper coil's resistance at a temperature over that on the bench.

    Examples
    --------
    >>> round(resistance_ratio(-20.0, 20.0), 4), round(resistance_ratio(20.0, 60.0), 4)
    (0.8428, 0.8641)
    """
    at, bench = (1 + COPPER_PER_K * (temperature_C - COPPER_AT_C) for temperature_C in (coil_C, bench_coil_C))
    return at / bench


def holds_current(compensator: Compensator) -> bool:
    """Return whether an amplifier, or the firmware, holds the current; else the duty is the coil's voltage."""
    machine = compensator.machine
    return compensator.current_drive is not None or (machine is not None and machine.drive != "duty")


def drive_corners(compensator: Compensator) -> Iterator[DriveCorner]:
    """Give the corners of a declared machine, and usual ones of what was not declared."""
    machine = compensator.machine
    if compensator.current_drive is not None:
        yield from _coils_of_loop(compensator.current_drive.circuit)
    else:
        (cold, hot), (low, high) = _coils(machine), _supplies(machine)
        yield from (cold, hot, low, high, cold.at_supply(high), hot.at_supply(low))
    if machine is None or machine.drive == "duty":
        return
    # The ends of a current that is held: its error on the machine, and that of the bench.
    error = machine.amplifier_error or machine.current_error or 0.0
    bench, rest = machine.bench_current_error or 0.0, machine.current_rest_error or 0.0
    for name, ratio, added in (("low", (1 - error) / (1 + bench), -rest), ("high", (1 + error) / (1 - bench), rest)):
        yield DriveCorner(name=f"current at its {name} end", current_ratio=ratio, current_rest=added)


def _coils_of_loop(circuit: CoilCircuit) -> Iterator[DriveCorner]:
    """Give what a current loop was designed for: the declared coil at its nominal supply, and the ends of all three."""
    yield DriveCorner(name="declared coil and supply")
    for ohm, henry, volts in product(circuit.resistance_factors, circuit.inductance_factors, circuit.supply_V):
        name = f"coil of {ohm:g} times the resistance, {henry:g} times the inductance, supply voltage {volts:g} V"
        yield DriveCorner(name=name, resistance_ratio=ohm, inductance_ratio=henry, supply_V=volts)


def _coils(machine: Machine | None) -> Iterator[DriveCorner]:
    """Give the coil's resistance cold and hot."""
    if machine is not None and machine.coil_temperature_C is not None:
        bench_C = COPPER_AT_C if machine.bench_coil_C is None else machine.bench_coil_C
        for end_C in machine.coil_temperature_C:
            yield DriveCorner(name=f"coil at {end_C:g} °C", resistance_ratio=resistance_ratio(end_C, bench_C))
        return
    for name, added_K in ((f"{COLDER_K:g} K colder", -COLDER_K), (f"{HOTTER_K:g} K hotter", HOTTER_K)):
        ratio = resistance_ratio(COPPER_AT_C + added_K, COPPER_AT_C)
        yield DriveCorner(name=f"coil {name}", resistance_ratio=ratio, not_required=NOT_DECLARED)


def _supplies(machine: Machine | None) -> Iterator[DriveCorner]:
    """Give the supply low and high."""
    if machine is not None and machine.supply_V is not None and machine.bench_supply_V is not None:
        for end_V in machine.supply_V:
            yield DriveCorner(name=f"supply voltage {end_V:g} V", voltage_ratio=end_V / machine.bench_supply_V)
        return
    for word, way in (("lower", -1), ("higher", 1)):
        name, ratio = f"supply voltage {SUPPLY_SHARE:.0%} {word}", 1 + way * SUPPLY_SHARE
        yield DriveCorner(name=name, voltage_ratio=ratio, not_required=NOT_DECLARED)


def at_corner(scene: Scene, corner: DriveCorner) -> Scene | None:
    """Return the scene with its plant at a corner; None where the corner changes nothing of it."""
    loop, plant = scene.loop, scene.loop.plant
    if loop.coil and corner.current_ratio == 1.0:
        resistance, inductance = corner.resistance_ratio, corner.inductance_ratio
        coil = loop.with_coil(resistance=resistance, inductance=inductance, supply_V=corner.supply_V)
        return replace(scene, loop=coil)
    voltage, resistance = corner.voltage_ratio, corner.resistance_ratio
    ratio, held = corner.current_ratio, holds_current(scene.compensator)
    added_V = corner.current_rest * loop.u_max_V
    changes = isinstance(plant, Plant) and resistance != 1.0
    if isinstance(plant, Plant):
        loop = loop.with_plant(replace(plant, R_c_ohm=plant.R_c_ohm * resistance))
        ratio *= 1.0 if held else voltage
    else:  # Of a stand-in the current alone counts, and a held one does not know of resistance and supply.
        ratio *= 1.0 if held else voltage / resistance
    if not changes and ratio == 1.0 and added_V == 0.0:
        return None
    return replace(scene, loop=loop.with_drive(ratio).with_added_drive(added_V * ratio))


def coil_and_supply(scene: Scene) -> Iterator[ScenarioResult]:
    """Open and close at every corner; what the corner does to the dead zone on opening is measured.

    Of a current loop's coils also what flows as the drive is released, and the set point steps to the offset.
    """
    for corner in drive_corners(scene.compensator):
        there = at_corner(scene, corner)
        if there is None:
            continue
        of_loop = there.loop.coil is not None and corner.current_ratio == 1.0
        before = there.held(0, 2) if of_loop else np.zeros(0)
        run = there.run(np.concatenate([before, there.opened_and_closed(READING_RAMP_S)]))
        level = there.loop.leak_L_min(there.dp_MPa) + FLOW_SHARE * float(run.q_mean_L_min.max())
        figures = {"dead_zone_on_opening_percent": 100 * dead_zone(run, level, rising=True)}
        if of_loop:
            figures[RELEASED] = float(run.q_largest_L_min[: before.size].max())
        yield there.result(corner.name, run, figures=figures, not_required=corner.not_required)
