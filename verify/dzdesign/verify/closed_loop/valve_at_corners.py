"""The valve behind the current loop: the same ramp with every coil and supply, at every tested pressure drop."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.current.circuit import CoilCircuit
from dzdesign.verify.closed_loop.dead_zone import FLOW_SHARE
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.scene import Scene
from dzdesign.verify.closed_loop.stored_digits import stored
from dzdesign.verify.current.results import ValveAtCorners
from dzdesign.verify.loop_results import flow_in_words
from dzdesign.verify.requirements import CURRENT_VALVE, Check

#: A ramp slow enough that a record is 0.05 % of command.
SEQUENCE = RampSequence(rest=1.0, ramp=20.0, top=0.5)
#: By how much the dead zone on opening may move, of full command.
MOST_MOVED = 0.003


def valve_at_corners(scene: Scene, circuit: CoilCircuit) -> ValveAtCorners:
    """Run the ramp with the declared coil at its nominal supply, and at the ends of all three ranges."""
    command = SEQUENCE.for_drive(scene.loop).command()
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
