"""The coil of a drive by current, integrated by CasADi's CVODES from edge to edge: switch, diode, samples, controller.

Written from the circuit: L di/dt = supply - R i with the switch on; -freewheel - R i with it off, until the diode
blocks at no current. Nothing of coil.h is used here.
"""

from collections.abc import Sequence
from math import floor

import numpy as np

from dzdesign.verify.closed_loop.coil_in_loop import CoilAtSupply
from dzdesign.verify.integrator.compiled_calls import CompiledController
from dzdesign.verify.integrator.cvodes import Cvodes
from dzdesign.verify.integrator.spool import SHORTEST_MS
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary


class SwitchedCoil:
    """A coil at a supply, with its sensor, around the compiled controller; begins without current."""

    def __init__(self, coil: CoilAtSupply, library: CompiledLibrary) -> None:
        around = coil.around
        self._corner, self._circuit, self._sampling = coil.corner, around.circuit, around.sampling
        self._sensor, self._converter = around.sensor, around.converter
        self._full_counts = around.loop.full_counts
        self._cvodes = _integrator(self._sampling.samples + 2)
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
        moments = [*samples_ms, period_ms]
        while_on = [each for each in moments if each <= opens_ms]
        currents, charge = self._passed([*while_on, opens_ms], on=True)
        after, freewheeled = self._passed([each - opens_ms for each in moments[len(while_on) :]], on=False)
        charge += freewheeled
        codes = [
            self._code(self._sensor.offset_V + current * self._sensor.V_per_A)
            for current in [*currents[: len(while_on)], *after][:count]
        ]
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

    def _passed(self, spans_ms: Sequence[float], *, on: bool) -> tuple[list[float], float]:
        """Move on by the last of the spans; return the current after each of them, A, and the charge, A ms."""
        if not spans_ms or spans_ms[-1] <= SHORTEST_MS or (not on and self._current <= 0.0):
            return [self._current] * len(spans_ms), 0.0
        volts = self._corner.supply_V if on else -self._circuit.freewheel_V
        found = self._integrated(volts, spans_ms)
        if found[-1, 0] < 0.0:
            from scipy.optimize import brentq

            blocks = brentq(lambda ms: float(self._integrated(volts, [ms])[0, 0]), 0.0, spans_ms[-1], xtol=1e-13)
            found[found[:, 0] < 0.0] = 0.0, self._integrated(volts, [blocks])[0, 1]
        self._current = float(found[-1, 0])
        return found[:, 0].tolist(), float(found[-1, 1])

    def _integrated(self, volts: float, spans_ms: Sequence[float]) -> np.ndarray:
        """Return current and charge after each of the spans, all from now, (M, 2)."""
        spans = np.zeros(self._sampling.samples + 2)
        spans[: len(spans_ms)] = spans_ms
        given = [volts, self._corner.resistance_ohm, self._corner.inductance_H, *spans]
        found = self._cvodes.end([self._current] * spans.size + [0.0] * spans.size, given)
        return found.reshape(2, spans.size).T[: len(spans_ms)]


def _integrator(spans: int) -> Cvodes:
    """Return CVODES of a coil for as many spans of time, all from the same beginning: one run has them all."""
    import casadi as ca

    current, charge, given = ca.SX.sym("current", spans), ca.SX.sym("charge", spans), ca.SX.sym("given", 3 + spans)
    volts, ohm, henry = given[0], given[1], given[2]
    rates = ca.vertcat(1e-3 * (volts - ohm * current) / henry, current)
    return Cvodes(ca.vertcat(current, charge), given, ca.repmat(given[3:], 2, 1) * rates)
