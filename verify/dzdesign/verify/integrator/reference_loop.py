"""The loop once more: converter, compiled core and PWM by their words, around the spool that CVODES moves.

The rules that both loops keep. A compare value acts from the next period of the PWM on, the first part of which is on.
The core samples at the beginning of a period. The play: the magnetic force follows the mean current of the last period
within half the play to either side, and what it differs by is a constant force over the next period. Of a drive by
current the spool feels the mean current of the period. A stand-in's flow is that at the mean position of the period,
told by its beginning, its middle and its end.
"""

import ctypes
from dataclasses import dataclass
from math import floor

import numpy as np

from dzdesign.design.signals import PressureSignal, Signals
from dzdesign.verify.closed_loop.coil_in_loop import CoilAtSupply
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.stand_in import StandIn
from dzdesign.verify.integrator.compiled_calls import CompiledDrive
from dzdesign.verify.integrator.edge import edge_of
from dzdesign.verify.integrator.spool import Acting, CvodesSpool, SpoolState
from dzdesign.verify.integrator.switched_coil import SwitchedCoil

PERIOD_MS = 1e3 * PWM_PERIOD_S
#: A pressure as near as this to the border of a code, in codes, may be converted to either.
AT_BORDER = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferenceRun:
    """What the reference did, an entry for the end of each period of the PWM of its window, (M,)."""

    position_mm: np.ndarray
    q_L_min: np.ndarray
    #: Written in the period, in force in the next one.
    compare: np.ndarray
    #: How often the spool met a stop.
    impacts: int
    #: Pressures at the border of a code, for which the native loop's code was taken.
    codes_at_border: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """What happens, a value for each period, (N,), and the codes that the native loop read, (N, 2)."""

    command: np.ndarray
    supply_MPa: np.ndarray
    back_MPa: float
    native_codes: np.ndarray


class ReferenceLoop:
    """One plant, one side of a drive, from rest."""

    def __init__(
        self, plant: Plant | StandIn, library: ctypes.CDLL, signals: Signals, sign: int, coil: CoilAtSupply | None,
        *, without_dither: bool,
    ) -> None:  # fmt: skip
        self._parameters, self._signals, self._sign = plant.parameters, signals, sign
        self._drive = CompiledDrive(library, sign)
        self._without_dither = without_dither
        self._coil = SwitchedCoil(coil, library) if coil else None
        self._spool, self._edge = CvodesSpool(plant.parameters), edge_of(plant)
        self._state = SpoolState()
        #: Mean current of the last period, and that which the play holds, A.
        self._mean_A = self._played_A = 0.0
        self._codes_at_border = 0

    def run(self, course: Course, begin: int = 0) -> ReferenceRun:
        """Run through it, at rest until the period `begin`, in which the core is given the native loop's codes."""
        count = course.command.size - begin
        position, flow, written = np.empty(count), np.empty(count), np.empty(count)
        compare, supplied = 0, None
        for k in range(course.command.size):
            supply = float(course.supply_MPa[k])
            if supply != supplied:
                self._edge.supplied(self._state.position, supply)
                supplied = supply
            in_force = compare
            if k % self._drive.periods_per_sample == 0:
                self._drive.sample(self._codes(course, k, at_rest=k < begin))
            compare = self._drive.tick(without_dither=self._without_dither)
            if k >= begin:
                self._period(in_force, compare, supply)
                position[k - begin], flow[k - begin] = self._state.position, self._edge.q_L_min
                written[k - begin] = compare
        return ReferenceRun(
            position_mm=position, q_L_min=flow, compare=written, impacts=self._state.impacts,
            codes_at_border=self._codes_at_border,
        )  # fmt: skip

    def _codes(self, course: Course, k: int, *, at_rest: bool) -> tuple[int, int, int]:
        """Return the codes of command, sensor A and sensor B, rounded down as converters do."""
        signals, back = self._signals, course.back_MPa
        span = signals.command.direction(self._sign) * signals.command.span(self._sign)
        # A span of n codes has n + 1 of them, of one width.
        command = signals.command.zero_code + float(course.command[k]) * (span + (1 if span > 0 else -1))
        ahead = back + self._edge.dp_MPa
        a, b = (back, ahead) if self._sign < 0 and signals.swapped else (ahead, back)
        native = course.native_codes[k]
        if at_rest:
            return self._limited(floor(command)), int(native[0]), int(native[1])
        return (
            self._limited(floor(command)),
            self._pressure_code(signals.pressure_a, a, int(native[0])),
            self._pressure_code(signals.pressure_b, b, int(native[1])),
        )

    def _pressure_code(self, sensor: PressureSignal, pressure_MPa: float, native: int) -> int:
        value = sensor.zero_code + pressure_MPa * (sensor.full_code - sensor.zero_code + 1) / float(sensor.span_MPa)
        code = self._limited(floor(value))
        if code != native and native - AT_BORDER <= value <= native + 1 + AT_BORDER:
            self._codes_at_border += 1
            return native
        return code

    def _limited(self, code: int) -> int:
        return min(max(code, 0), self._signals.code_max)

    def _period(self, in_force: int, written: int, supply_MPa: float) -> None:
        """Move through a period of the PWM: on until the switching instant, then off."""
        parameters, state = self._parameters, self._state
        half_A = parameters.hysteresis_V / 2 * self._spool.N_per_V / parameters.K_i_N_A
        self._played_A = min(max(self._played_A, self._mean_A - half_A), self._mean_A + half_A)
        push_N = parameters.K_i_N_A * (self._played_A - self._mean_A)
        held = self._coil is not None
        if self._coil:
            state.current = self._coil.period(written) * self._spool.full_A
        on_ms = PERIOD_MS if held else PERIOD_MS * min(in_force / self._signals.compare_max, 1.0)
        before, middle, now, state.charge = state.position, state.position, 0.0, 0.0
        instants = {on_ms, PERIOD_MS} | ({PERIOD_MS / 2} if self._edge.of_mean else set())
        for until in sorted(instants):
            acting = Acting(
                volts=parameters.u_max_V if until <= on_ms else 0.0,
                push_N=push_N, supply_MPa=supply_MPa, current_held=held,
            )  # fmt: skip
            if not self._spool.stays(state, acting):
                self._spool.phase(state, acting, until - now)
            now = until
            middle = state.position if until <= PERIOD_MS / 2 else middle
        self._mean_A = state.charge / PERIOD_MS
        at = (before + 2 * middle + state.position) / 4 if self._edge.of_mean else state.position
        self._edge.at(at, supply_MPa)
