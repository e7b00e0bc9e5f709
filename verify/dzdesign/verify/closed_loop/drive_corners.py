"""The drive at the ends of coil temperature and supply, by formulas of this room's own: R = R20 (1 + alpha (T - 20)).

Where the duty is the coil's voltage, the current is duty V / R, and a threshold of the valve, which is one of current,
comes at a duty of R / V times that on the bench. An amplifier, or the firmware's current control, holds the current to
its declared error instead.

What is done to a plant: a stand-in's drive is multiplied, and only by what changes the current; a plant of equations
has the coil's resistance itself, and its PWM's voltage goes with the supply where the duty is the coil's voltage. Under
the firmware's current control the coil is the declared one, in the loop with the C, and the plant's own is left alone.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.current.circuit import CoilCircuit
from dzdesign.design.machine import Machine
from dzdesign.verify.closed_loop.dead_zone import FLOW_SHARE, dead_zone
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.closed_loop.stored_digits import stored
from dzdesign.verify.current.results import ValveAtCorners
from dzdesign.verify.loop_results import ScenarioResult, flow_in_words
from dzdesign.verify.requirements import CURRENT_VALVE, Check

#: Of copper, per kelvin of its resistance at 20 °C.
COPPER_PER_K, COPPER_AT_C = 0.00393, 20.0
#: Of a machine that was not declared: a coil so much colder and hotter than on the bench, which was at 20 °C; and a
#: supply so much lower and higher.
COLDER_K, HOTTER_K, SUPPLY_SHARE = 40.0, 60.0, 0.2
NOT_DECLARED = "the machine is not declared"
#: Of a current that the firmware controls: a ramp slow enough that a record is 0.05 % of command, and by how much the
#: dead zone on opening may move with coil and supply, of full command.
CORNER_RAMP, MOST_MOVED = RampSequence(rest=1.0, ramp=20.0, top=0.5), 0.003
#: Ramp up on which the dead zone is read, s: the spool's lag is some thousandths of a command of the quick ones.
READING_RAMP_S = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveCorner:
    """One end of coil and supply, or of a current that is held, beside the bench."""

    name: str
    #: Of the coil's resistance, and of the voltage that full duty puts on it; 1 on the bench.
    resistance_ratio: float = 1.0
    voltage_ratio: float = 1.0
    #: Of a coil in the loop with the C: its supply, V.
    supply_V: float | None = None
    #: Of the current that an amplifier, or the firmware's control, holds; 1 on the bench.
    current_ratio: float = 1.0
    #: What is added to that current, share of full drive.
    current_rest: float = 0.0
    #: Why no flow is not required there; empty: it is.
    not_required: str = ""


def resistance_ratio(coil_C: float, bench_coil_C: float) -> float:
    """Return a copper coil's resistance at a temperature over that on the bench.

    Examples
    --------
    >>> round(resistance_ratio(-20.0, 20.0), 4), round(resistance_ratio(20.0, 60.0), 4)
    (0.8428, 0.8641)
    """

    def over_20(temperature_C: float) -> float:
        return 1 + COPPER_PER_K * (temperature_C - COPPER_AT_C)

    return over_20(coil_C) / over_20(bench_coil_C)


def holds_current(compensator: Compensator) -> bool:
    """Return whether an amplifier, or the firmware, holds the current; else the duty is the coil's voltage."""
    machine = compensator.machine
    return compensator.current_drive is not None or (machine is not None and machine.drive != "duty")


def drive_corners(compensator: Compensator) -> Iterator[DriveCorner]:
    """Give the corners of a declared machine, and usual ones of what was not declared."""
    machine = compensator.machine
    here = _End(name="", ratio=1.0)
    drive = compensator.current_drive
    (cold, hot), (low, high) = (_coils(machine), _supplies(machine)) if drive is None else _circuit_ends(drive.circuit)
    for coil, supply in ((cold, here), (hot, here), (here, low), (here, high), (cold, high), (hot, low)):
        yield DriveCorner(
            name=", ".join(filter(None, (coil.name, supply.name))),
            resistance_ratio=coil.ratio,
            voltage_ratio=supply.ratio,
            supply_V=supply.supply_V,
            not_required=coil.not_required or supply.not_required,
        )
    yield from _current_corners(machine)


@dataclass(frozen=True, slots=True, kw_only=True)
class _End:
    """One end of the coil's temperature or of the supply, over the bench."""

    name: str
    ratio: float
    not_required: str = ""
    supply_V: float | None = None


def _coils(machine: Machine | None) -> tuple[_End, _End]:
    """Return the coil's resistance cold and hot."""
    if machine is not None and machine.coil_temperature_C is not None:
        bench_C = COPPER_AT_C if machine.bench_coil_C is None else machine.bench_coil_C
        cold, hot = (
            _End(name=f"coil at {end:g} °C", ratio=resistance_ratio(end, bench_C)) for end in machine.coil_temperature_C
        )
        return cold, hot
    cold, hot = (
        _End(name=name, ratio=resistance_ratio(COPPER_AT_C + added_K, COPPER_AT_C), not_required=NOT_DECLARED)
        for name, added_K in ((f"coil {COLDER_K:g} K colder", -COLDER_K), (f"coil {HOTTER_K:g} K hotter", HOTTER_K))
    )
    return cold, hot


def _supplies(machine: Machine | None) -> tuple[_End, _End]:
    """Return the supply low and high."""
    if machine is not None and machine.supply_V is not None and machine.bench_supply_V is not None:
        bench_V = machine.bench_supply_V
        low, high = (_End(name=f"supply voltage {end:g} V", ratio=end / bench_V) for end in machine.supply_V)
        return low, high
    low, high = (
        _End(name=f"supply voltage {SUPPLY_SHARE:.0%} {word}", ratio=1 + way * SUPPLY_SHARE, not_required=NOT_DECLARED)
        for word, way in (("lower", -1), ("higher", 1))
    )
    return low, high


def _circuit_ends(circuit: CoilCircuit) -> tuple[tuple[_End, _End], tuple[_End, _End]]:
    """Return the declared ends of the coil and the supply that the current loop was designed for."""
    cold, hot = (
        _End(name=f"coil of {factor:g} times the resistance", ratio=factor) for factor in circuit.resistance_factors
    )
    low, high = (_End(name=f"supply voltage {end:g} V", ratio=1.0, supply_V=end) for end in circuit.supply_V)
    return (cold, hot), (low, high)


def _current_corners(machine: Machine | None) -> Iterator[DriveCorner]:
    """Give the ends of a current that is held: its error on the machine, and that of the bench."""
    if machine is None or machine.drive == "duty":
        return
    error = machine.amplifier_error or machine.current_error or 0.0
    bench, rest = machine.bench_current_error or 0.0, machine.current_rest_error or 0.0
    for name, ratio, added in (
        ("low", (1 - error) / (1 + bench), -rest),
        ("high", (1 + error) / (1 - bench), rest),
    ):
        yield DriveCorner(name=f"current at its {name} end", current_ratio=ratio, current_rest=added)


def at_corner(scene: Scene, corner: DriveCorner) -> Scene | None:
    """Return the scene with its plant at a corner; None where the corner changes nothing of it."""
    if scene.loop.controls_current and corner.current_ratio == 1.0:
        coil = scene.loop.with_coil(resistance=corner.resistance_ratio, supply_V=corner.supply_V)
        return replace(scene, loop=coil)
    voltage, resistance = (corner.voltage_ratio, corner.resistance_ratio)
    ratio, loop = corner.current_ratio, scene.loop
    held, added_V = holds_current(scene.compensator), corner.current_rest * scene.loop.u_max_V
    if isinstance(scene.plant, Plant):
        loop = loop.with_plant(replace(scene.plant, R_c_ohm=scene.plant.R_c_ohm * resistance))
        changes = resistance != 1.0
        ratio *= 1.0 if held else voltage
    else:  # Of a stand-in the current alone counts, and a held one does not know of resistance and supply.
        changes = False
        ratio *= 1.0 if held else voltage / resistance
    if not changes and ratio == 1.0 and added_V == 0.0:
        return None
    return replace(scene, loop=loop.with_drive(ratio).with_added_drive(added_V * ratio))


def coil_and_supply(scene: Scene) -> Iterator[ScenarioResult]:
    """Open and close at every corner; what the corner does to the dead zone on opening is measured."""
    for corner in drive_corners(scene.compensator):
        there = at_corner(scene, corner)
        if there is None:
            continue
        run = there.run(there.opened_and_closed(READING_RAMP_S))
        level = there.loop.leak_L_min(there.dp_MPa) + FLOW_SHARE * float(run.q_mean_L_min.max())
        opening = {"dead_zone_on_opening_percent": 100 * dead_zone(run, level, rising=True)}
        yield there.result(corner.name, run, figures=opening, not_required=corner.not_required)


def valve_at_corners(scene: Scene, circuit: CoilCircuit) -> ValveAtCorners:
    """Run the ramp with the declared coil at its nominal supply, and at the ends of all three ranges."""
    command = CORNER_RAMP.for_drive(scene.loop).command()
    direct = scene.loop.run(command, scene.dp_MPa)
    level = scene.loop.leak_L_min(scene.dp_MPa) + FLOW_SHARE * float(direct.q_L_min.max())
    ends = product(circuit.resistance_factors, circuit.inductance_factors, circuit.supply_V)
    loops = [scene.loop.with_coil()]
    loops += [scene.loop.with_coil(resistance=ohm, inductance=henry, supply_V=volts) for ohm, henry, volts in ends]
    openings, at_zero, released = zip(*(_read(loop, command, scene.dp_MPa, level) for loop in loops), strict=True)
    found = ValveAtCorners(
        dp_MPa=scene.dp_MPa,
        runs=len(loops),
        opening_least=min(openings),
        opening_largest=max(openings),
        q_zero_L_min=max(at_zero),
        q_released_L_min=max(released),
        unseen_below_L_min=scene.loop.unseen_below_L_min(scene.dp_MPa),
        leak_L_min=scene.loop.leak_L_min(scene.dp_MPa),
        allowed_at_zero_L_min=scene.loop.allowed_at_zero_L_min(scene.dp_MPa),
    )
    return stored(found)


def _read(loop: ClosedLoop, command: np.ndarray, dp_MPa: float, level: float) -> tuple[float, float, float]:
    """Return where the valve opens, the flow at zero command after closing, and the largest before the ramp."""
    run = loop.run(command, dp_MPa, "compensated")
    opens = np.flatnonzero((run.q_mean_L_min >= level) & (run.command > 0))
    before = run.q_largest_L_min[: int(np.argmax(run.command > 0))]
    opening = float(run.command[opens[0]]) if len(opens) else 1.0
    return opening, float(run.q_largest_L_min[-1]), float(before.max())


def valve_at_corners_check(found: Sequence[ValveAtCorners], units: RecordedUnits) -> Check:
    """Tell whether coil and supply leave the valve's opening where it is, and none of them opens it at zero command."""
    widest = max(found, key=lambda each: each.opening_largest - each.opening_least)
    worst = max(found, key=lambda each: each.q_beyond_L_min)
    closed = max(found, key=lambda each: each.q_zero_L_min)
    released = max(found, key=lambda each: each.q_released_L_min)
    moved = widest.opening_largest - widest.opening_least
    text = (
        f"{sum(each.runs for each in found)} ramps, with the declared coil and at the limits of coil and supply: the "
        f"dead zone on opening moves by {moved:.2%} of full command (at {units.text(widest.dp_MPa, '.2f MPa')}; "
        f"allowed: {MOST_MOVED:.1%}); the flow at zero command after closing is at most "
        f"{_flow(closed, closed.q_zero_L_min, units)}; on release, as the set point steps to the offset, it is at most "
        f"{_flow(released, released.q_released_L_min, units)}"
    )
    return CURRENT_VALVE.check(holds=moved <= MOST_MOVED and worst.q_beyond_L_min <= NO_FLOW_L_MIN, text=text)


def _flow(found: ValveAtCorners, flow_L_min: float, units: RecordedUnits) -> str:
    """Return a flow; where the recordings can't show it, below what, and what their first flows, continued, say."""
    shown = f"{flow_in_words(flow_L_min, found.unseen_below_L_min, units)} {units.label('L/min')}"
    if found.unseen_below_L_min is None or not found.leak_L_min + NO_FLOW_L_MIN < flow_L_min < found.unseen_below_L_min:
        return shown
    return f"{shown} ({units.text(flow_L_min, '.2g L/min')} by extrapolation of the first flow seen)"
