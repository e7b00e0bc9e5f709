"""The coil of a drive by current, integrated by CasADi's CVODES from edge to edge: switch, diode, samples, controller.

Written from the circuit: L di/dt = supply - R i with the switch on; -freewheel - R i with it off, until the diode
blocks at no current. Nothing of coil.h is used here.
"""

import ctypes
from math import floor
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.verify.closed_loop.coil_in_loop import CoilAtSupply
from dzdesign.verify.integrator.compiled_calls import CompiledController
from dzdesign.verify.integrator.root import root
from dzdesign.verify.integrator.spool import CVODES, SHORTEST_MS, IntegratorCalls

if TYPE_CHECKING:
    import casadi


class SwitchedCoil:
    """A coil at a supply, with its sensor, around the compiled controller; begins without current."""

    def __init__(self, coil: CoilAtSupply, library: ctypes.CDLL) -> None:
        around = coil.around
        self._corner, self._circuit, self._sampling = coil.corner, around.circuit, around.sampling
        self._sensor, self._converter = around.sensor, around.converter
        self._full_counts = around.loop.full_counts
        self._solve = IntegratorCalls(_integrator())
        self._current = 0.0
        self._compare = 0
        none = self._code(self._sensor.offset_V)
        self._last = [none] * self._sampling.samples
        self._controller = CompiledController(library, none * self._sampling.samples)
        self._supply_code = self._code(self._corner.supply_V * self._sensor.supply_divider)

    def period(self, set_point: int) -> float:
        """Let a period pass, with the interrupt in it; return the mean current as a share of the rated one."""
        period_ms, count = 1e3 * self._sampling.period_s, self._sampling.samples
        opens_ms = period_ms * min(self._compare / self._full_counts, 1.0)
        samples_ms = [period_ms * (part + 0.5) / count for part in range(count)]
        codes: list[int] = []
        charge, now = 0.0, 0.0
        for until in [*samples_ms, period_ms]:
            for end, on in ((min(max(opens_ms, now), until), True), (until, False)):
                charge += self._passed(end - now, on=on)
                now = end
            if len(codes) < count:
                codes.append(self._code(self._sensor.offset_V + self._current * self._sensor.V_per_A))
        # The interrupt comes after some of this period's codes; the others are of the last one.
        before = self._sampling.before
        total = sum(codes[:before] + self._last[before:])
        self._last = codes
        self._compare = self._controller.tick(set_point, total % 65536, self._supply_code)
        return charge / period_ms / self._circuit.rated_A

    def _code(self, volts: float) -> int:
        converter = self._converter
        code = floor(volts * converter.levels / float(converter.full_V))
        return min(max(code, 0), converter.code_max)

    def _passed(self, milliseconds: float, *, on: bool) -> float:
        """Move on with the switch on or off; return the charge, A ms."""
        if milliseconds <= SHORTEST_MS or (not on and self._current <= 0.0):
            return 0.0
        volts = self._corner.supply_V if on else -self._circuit.freewheel_V
        end = self._integrated(volts, milliseconds)
        if end[0] < 0.0:
            blocks = root(lambda ms: float(self._integrated(volts, ms)[0]), 0.0, milliseconds)
            end = self._integrated(volts, blocks)
            end[0] = 0.0
        self._current = float(end[0])
        return float(end[1])

    def _integrated(self, volts: float, milliseconds: float) -> np.ndarray:
        given = (milliseconds, volts, self._corner.resistance_ohm, self._corner.inductance_H)
        return self._solve((self._current, 0.0), given)


def _integrator() -> "casadi.Function":
    import casadi as ca

    state, given = ca.SX.sym("state", 2), ca.SX.sym("given", 4)
    milliseconds, volts, ohm, henry = ca.vertsplit(given)
    rates = ca.vertcat(1e-3 * (volts - ohm * state[0]) / henry, state[0])
    return ca.integrator("coil", "cvodes", {"x": state, "p": given, "ode": milliseconds * rates}, 0, 1, CVODES)
