"""CasADi's CVODES over one unit of time, called without the wrapping of its arguments, a third of a short run's time.

CVODES takes Adams' formulas at a relative tolerance of 1e-12. Against the same at 1e-14 a position is then off by
5e-12 mm; collocation of order 3 to 6 in one element a phase, no faster, by 1e-7 mm, as its step does not end where the
metering edge opens.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import casadi

#: For states in A, A ms, mm and m/s.
OPTIONS: dict[str, Any] = {
    "linear_multistep_method": "adams", "nonlinear_solver_iteration": "functional",
    "reltol": 1e-12, "abstol": 1e-14, "max_num_steps": 1_000_000,
}  # fmt: skip


class Cvodes:
    """An integrator of one system; `RuntimeError`, of CasADi, where it gives up."""

    def __init__(self, state: "casadi.SX", given: "casadi.SX", rates: "casadi.SX") -> None:
        import casadi as ca

        function = ca.integrator("phase", "cvodes", {"x": state, "p": given, "ode": rates}, 0, 1, OPTIONS)
        self._state, self._given, self._end = np.zeros(state.numel()), np.zeros(given.numel()), np.zeros(state.numel())
        # It reads and writes the memory of these arrays, which live as long as it does.
        buffer, self._run = function.buffer()
        memory: Any = buffer  # whose stubs ask for sizes
        memory.set_arg(function.index_in("x0"), memoryview(self._state.data))
        memory.set_arg(function.index_in("p"), memoryview(self._given.data))
        memory.set_res(function.index_out("xf"), memoryview(self._end.data))
        self._buffer = memory

    def end(self, state: Sequence[float], given: Sequence[float]) -> np.ndarray:
        """Return the state after one unit of time."""
        self._state[:], self._given[:] = state, given
        self._run()
        return self._end.copy()
