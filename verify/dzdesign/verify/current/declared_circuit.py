"""What follows from the declared coil and supply: corners, duties, the fastest rise. Nothing of `design`'s."""

from itertools import product
from math import inf, log, sqrt

import numpy as np

from dzdesign.design.current.circuit import CORRECTION_SHIFT, CoilCircuit, Corner
from dzdesign.verify.current.coil_simulation import CoilLoop


def nominal_corner(circuit: CoilCircuit) -> Corner:
    """Return the declared coil, as far from the lowest supply as from the highest, in ratio."""
    low, high = circuit.supply_V
    return Corner(circuit.resistance_ohm + circuit.series_ohm, circuit.inductance_H, sqrt(low * high))


def declared_corners(circuit: CoilCircuit) -> tuple[Corner, ...]:
    """Return all 27: the least, declared and largest resistance and inductance, at both ends and the middle supply."""
    ranges = (circuit.resistance_factors, circuit.inductance_factors)
    ohms, henries = (sorted({low, min(max(low, 1.0), high), high}) for low, high in ranges)
    low, high = circuit.supply_V
    return tuple(
        Corner(ohm * circuit.resistance_ohm + circuit.series_ohm, henry * circuit.inductance_H, volts)
        for ohm, henry, volts in product(ohms, henries, sorted({low, sqrt(low * high), high}))
    )


def conducting_duty(circuit: CoilCircuit, corner: Corner, current_A: float) -> float:
    """Return the duty whose mean voltage, supply by turns with the diode's drop, holds a current."""
    # duty V - (1 - duty) V_f = R i
    return (corner.resistance_ohm * current_A + circuit.freewheel_V) / (corner.supply_V + circuit.freewheel_V)


def least_rise_s(corner: Corner, start_A: float, end_A: float) -> float:
    """Return the time from one current to another with the switch on; endless where it does not get there."""
    ends_A = corner.supply_V / corner.resistance_ohm
    return (
        log((ends_A - start_A) / (ends_A - end_A)) * corner.inductance_H / corner.resistance_ohm
        if ends_A > end_A
        else inf
    )


def correction_factor(around: CoilLoop, supply_V: float) -> float:
    """Return by what the controller's output is multiplied at a supply: 1 where it is not measured."""
    supply = around.loop.supply
    if supply is None:
        return 1.0
    codes = supply_V * around.sensor.supply_divider * around.converter.levels / float(around.converter.full_V)
    at = supply.valid_codes[0] + supply.step_codes * np.arange(len(supply.nodes))
    return float(np.interp(np.clip(codes, *supply.valid_codes), at, supply.nodes)) / (1 << CORRECTION_SHIFT)
