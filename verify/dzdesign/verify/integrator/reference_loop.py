"""The loop once more: converter, compiled core and PWM by their words, around the spool that CVODES moves.

The rules that both loops keep. A compare value acts from the next period of the PWM on, the first part of which is on.
The core samples at the beginning of a period. The play: the magnetic force follows the mean current of the last period
within half the play to either side, and what it differs by is a constant force over the next period. Of a drive by
current the spool feels the mean current of the period. A stand-in's flow is that at the mean position of the period,
told by its beginning, its middle and its end.
"""

from dataclasses import dataclass
from math import floor

import numpy as np

from dzdesign.design.signals import Signals
from dzdesign.verify.closed_loop.coil_in_loop import CoilAtSupply
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.readings import ReadingErrors
from dzdesign.verify.closed_loop.stand_in import StandIn
from dzdesign.verify.integrator.compiled_calls import CompiledDrive
from dzdesign.verify.integrator.edge import edge_of
from dzdesign.verify.integrator.spool import Acting, CvodesSpool, SpoolState
from dzdesign.verify.integrator.switched_coil import SwitchedCoil
from dzdesign.verify.integrator.windows import Course
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary

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
    #: Other pressures whose code is not the native loop's.
    unlike_codes: int


class ReferenceLoop:
    """One plant, one side of a drive, from rest."""

    def __init__(
        self, plant: Plant | StandIn, library: CompiledLibrary, signals: Signals, sign: int, coil: CoilAtSupply | None,
        *, without_dither: bool, drive: float = 1.0,
    ) -> None:  # fmt: skip
        self._parameters, self._signals, self._sign = plant.parameters, signals, sign
        self._drive = CompiledDrive(library, sign)
        self._without_dither = without_dither
        self._coil = SwitchedCoil(coil, library) if coil else None
        self._spool, self._edge = CvodesSpool(plant.parameters), edge_of(plant)
        self._state = SpoolState()
        #: Mean current of the last period, and that which the play holds, A.
        self._mean_A = self._played_A = 0.0
        self._codes_at_border = self._unlike_codes = 0
        #: Times the voltage, or the current of a coil of its own.
        self._ratio = drive
        self._noise = 1

    def run(
        self, course: Course, errors: ReadingErrors, native_codes: np.ndarray, begin: int, end: int
    ) -> ReferenceRun:
        """Run through its periods up to `end`, at rest until `begin`, with the native loop's codes (N, 2) till then."""
        self._noise = errors.seed
        count = end - begin
        position, flow, written = np.empty(count), np.empty(count), np.empty(count)
        supplied, every = None, self._drive.periods_per_sample
        waiting: list[tuple[int, int, int]] = []
        compare = [0]  # before the first period, and in each one that is known
        for k in range(end):
            supply = float(course.supply_MPa[k])
            if supply != supplied:
                self._edge.supplied(self._state.position, supply)
                supplied = supply
            if k % every == 0:
                waiting.append(self._codes(course, k, errors, native_codes[k], at_rest=k < begin))
                if k + every > begin:  # until then all codes are known, and the core is called once
                    compare += self._drive.compare_values(np.array(waiting), without_dither=self._without_dither)
                    waiting.clear()
            if k >= begin:
                in_force, new = compare[k], compare[k + 1]
                self._period(in_force, new, supply, float(course.added_V[k]))
                position[k - begin], flow[k - begin] = self._state.position, self._edge.q_L_min
                written[k - begin] = new
        return ReferenceRun(
            position_mm=position, q_L_min=flow, compare=written, impacts=self._state.impacts,
            codes_at_border=self._codes_at_border, unlike_codes=self._unlike_codes,
        )  # fmt: skip

    def _codes(
        self, course: Course, k: int, errors: ReadingErrors, native: np.ndarray, *, at_rest: bool
    ) -> tuple[int, int, int]:  # fmt: skip
        """Return the codes of command, sensor A and sensor B, rounded down as converters do."""
        signals, back = self._signals, float(course.back_MPa[k])
        span = signals.command.direction(self._sign) * signals.command.span(self._sign)
        # A span of n codes has n + 1 of them, of one width.
        exact = signals.command.zero_code + float(course.command[k]) * (span + (1 if span > 0 else -1))
        command = self._limited(floor(self._misread(exact, errors, 0)))
        ahead = back + self._edge.dp_MPa
        pressures = (back, ahead) if self._sign < 0 and signals.swapped else (ahead, back)
        codes = []
        for place, sensor in enumerate((signals.pressure_a, signals.pressure_b)):
            shown, other = int(course.shown[k, place]), int(native[place])
            if shown >= 0:
                codes.append(shown)
                self._unlike_codes += shown != other
                continue
            exact = sensor.zero_code + pressures[place] * (sensor.full_code - sensor.zero_code + 1) / float(
                sensor.span_MPa
            )
            code = self._pressure_code(self._misread(exact, errors, 1 + place), other, at_rest=at_rest)
            codes.append(code)
        return command, codes[0], codes[1]

    def _misread(self, code: float, errors: ReadingErrors, channel: int) -> float:
        """Return what the converter reads in place of a code, not rounded: the gain's error grows to its largest."""
        gain, offset = errors.gain_codes[channel] / self._signals.code_max, errors.offset_codes[channel]
        return code * (1 + gain) + offset + self._drawn(errors.noise_codes[channel])

    def _drawn(self, peak: int) -> int:
        """Draw a whole number from -peak to peak by Marsaglia's xorshift of 32 bits (13, 17, 5)."""
        if not peak:
            return 0
        for shift in (13, -17, 5):
            moved = self._noise << shift if shift > 0 else self._noise >> -shift
            self._noise = (self._noise ^ moved) & 0xFFFFFFFF
        return self._noise % (2 * peak + 1) - peak

    def _pressure_code(self, value: float, native: int, *, at_rest: bool) -> int:
        code = self._limited(floor(value))
        if at_rest:
            return native
        if code != native and native - AT_BORDER <= value <= native + 1 + AT_BORDER:
            self._codes_at_border += 1
            return native
        self._unlike_codes += code != native
        return code

    def _limited(self, code: int) -> int:
        return min(max(code, 0), self._signals.code_max)

    def _period(self, in_force: int, written: int, supply_MPa: float, added_V: float) -> None:
        """Move through a period of the PWM: on until the switching instant, then off."""
        parameters, state = self._parameters, self._state
        half_A = parameters.hysteresis_V / 2 * self._spool.N_per_V / parameters.K_i_N_A
        self._played_A = min(max(self._played_A, self._mean_A - half_A), self._mean_A + half_A)
        push_N = parameters.K_i_N_A * (self._played_A - self._mean_A) + added_V * self._spool.N_per_V
        held = self._coil is not None
        if self._coil:
            state.current = self._coil.period(written) * self._spool.full_A * self._ratio
        on_ms = PERIOD_MS if held else PERIOD_MS * min(in_force / self._signals.compare_max, 1.0)
        before, middle, now, state.charge = state.position, state.position, 0.0, 0.0
        instants = {on_ms, PERIOD_MS} | ({PERIOD_MS / 2} if self._edge.of_mean else set())
        for until in sorted(instants):
            acting = Acting(
                volts=parameters.u_max_V * self._ratio if until <= on_ms else 0.0,
                push_N=push_N, supply_MPa=supply_MPa, current_held=held,
            )  # fmt: skip
            if not self._spool.stays(state, acting):
                self._spool.phase(state, acting, until - now)
            now = until
            middle = state.position if until <= PERIOD_MS / 2 else middle
        self._mean_A = state.charge / PERIOD_MS
        at = (before + 2 * middle + state.position) / 4 if self._edge.of_mean else state.position
        self._edge.at(at, supply_MPa)
