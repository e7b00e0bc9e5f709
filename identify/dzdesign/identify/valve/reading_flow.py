"""The reading flow: a dead zone as it is read at a stated flow, beside the one at the onset.

A bench reads where its meter starts, not where the edge opens. Even a valve without any dead zone, whose flow rises in
a straight line from zero command to the largest flow, shows one there: the reading flow over the largest flow. That
value stands beside every reading.
"""

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.valve.model import ValveModel


def default_reading_flow(valve: ValveModel) -> float:
    """Return the flow at which dead zones are read unless another is stated, L/min: the meter's floor.

    Of a meter without one it is the largest noise level of the tests: the least flow that all of them show. Where a
    flow at zero command was declared as allowed, no less than what may flow there: a smaller one is no end of a dead
    zone.
    """
    levels = (test.noise_level_L_min for side in valve.sides.values() for test in side.tests)
    at_zero = (side.zero_flow_L_min or 0.0 for side in valve.sides.values())
    return max(valve.meter.floor_L_min or max(levels), *at_zero)


def ideal_line(flow_L_min: float, largest_L_min: float) -> float:
    """Return the command at which a straight line from zero passes a flow, as a share of full; 1 if it never does.

    Examples
    --------
    >>> round(ideal_line(0.6, 15.2), 4)
    0.0395
    """
    return min(flow_L_min / largest_L_min, 1.0) if largest_L_min > 0 else 1.0


def dead_zone_at(flow_L_min: float, command: np.ndarray, flows_L_min: np.ndarray, *, rising: bool) -> float:
    """Return the command share at which a ramp up and down passes a flow; 1 where it never does.

    Parameters
    ----------
    flow_L_min : float
        The flow.
    command, flows_L_min : (N,) array
        Command as a share of full, up and down again, and the flow.
    rising : bool
        On the way up, where the flow comes to it first; else on the way down, where it was last above.
    """
    if command.shape != flows_L_min.shape:
        raise InputError(f"{flows_L_min.size} flows stand beside {command.size} commands, expected as many")
    top = int(np.argmax(command))
    above = np.flatnonzero(flows_L_min > flow_L_min)
    part = above[above <= top] if rising else above[above > top]
    return float(command[part[0] if rising else part[-1]]) if part.size else 1.0
