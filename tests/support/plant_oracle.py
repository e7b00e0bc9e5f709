"""The plant by SciPy's DOP853 to eleven digits, its stops as events: shares no code with the closed loop's motion.

Written from Eqs. (19)-(24) and the plant's own words: a stop swallows the spool's speed and holds it until the net
force leads away from it.
"""

import math

import numpy as np
from scipy.integrate import solve_ivp

from dzdesign.verify.closed_loop.plant import Plant

PERIOD_S = 400e-6
TIGHT = {"method": "DOP853", "rtol": 1e-11}
#: Net force over mass, m/s², below which a spool at a stop counts as held.
HELD = 1e-9


class Oracle:
    """State of one plant: current (A), position (m), speed (m/s); play and mean current in V of command."""

    def __init__(self, plant: Plant, supply_MPa: float) -> None:
        self.plant, self.supply = plant, supply_MPa
        self.current = self.position = self.speed = self.play = self.mean = self.play_N = 0.0

    def periods(self, duties: np.ndarray) -> np.ndarray:
        """Return the position in mm after each PWM period."""
        return np.array([self._period(duty) for duty in duties])

    def _period(self, duty: float) -> float:
        plant = self.plant
        half = plant.hysteresis_V / 2
        self.play = min(max(self.play, self.mean - half), self.mean + half)
        self.play_N = (self.play - self.mean) * plant.force_per_volt
        charge = self._phase(plant.u_max_V, duty * PERIOD_S) + self._phase(0.0, (1 - duty) * PERIOD_S)
        self.mean = charge / PERIOD_S * plant.K_i_N_A / plant.force_per_volt
        return 1e3 * self.position

    def _current_rate(self, current: float, voltage: float) -> float:
        p = self.plant  # Eqs. (19)-(21)
        return (p.K_a * (voltage - p.K_fi_V_A * current) - (p.R_c_ohm + p.r_p_ohm) * current) / p.L_c_H

    def _acceleration(self, current: float, position: float, speed: float) -> float:
        p = self.plant
        opening = max(position - p.overlap_mm * 1e-3, 0.0)
        conductance = p.C_d_W_mm * 1e-3 * opening * math.sqrt(2e6 / p.rho_kg_m3) * 6e4  # Eq. (24), L/min at 1 MPa
        dp = self.supply / (1 + p.droop_MPa_L_min2 * conductance**2)
        load = p.preload_N - p.pressure_force_N_MPa * dp + p.flow_force_N_mm_MPa * 1e3 * dp * opening - self.play_N
        # Eqs. (22), (23)
        return (p.K_i_N_A * current - p.B_e_N_s_m * speed - p.K_et_N_m * position - load) / p.m_e_kg

    def _phase(self, voltage: float, seconds: float) -> float:
        charge, time, stroke = 0.0, 0.0, self.plant.stroke_mm * 1e-3
        while seconds - time > 1e-12 * PERIOD_S:
            stop = 0.0 if self.position <= 0 else stroke if self.position >= stroke else None
            away = 0.0 if stop is None else self._acceleration(self.current, stop, 0.0) * (1 if stop == 0 else -1)
            if stop is not None and self.speed == 0 and away <= HELD:
                time, charge = self._rest(stop, voltage, time, seconds, charge)
            else:
                time, charge = self._move(stroke, voltage, time, seconds, charge)
        return charge

    def _rest(self, stop: float, voltage: float, time: float, seconds: float, charge: float) -> tuple[float, float]:
        sign = 1 if stop == 0 else -1

        def let_go(_time, state):
            return sign * self._acceleration(state[0], stop, 0.0) - 2 * HELD

        let_go.terminal, let_go.direction = True, 1
        found = solve_ivp(
            lambda _time, state: [self._current_rate(state[0], voltage), state[0]],
            (time, seconds), [self.current, charge], atol=1e-14, events=let_go, **TIGHT,
        )  # fmt: skip
        self.current = found.y[0, -1]
        return found.t[-1], found.y[1, -1]

    def _move(self, stroke: float, voltage: float, time: float, seconds: float, charge: float) -> tuple[float, float]:
        def low(_time, state):
            return state[1]

        def high(_time, state):
            return state[1] - stroke

        low.terminal = high.terminal = True
        low.direction, high.direction = -1, 1
        found = solve_ivp(
            lambda _time, state: [
                self._current_rate(state[0], voltage), state[2], self._acceleration(*state[:3]), state[0],
            ],
            (time, seconds), [self.current, self.position, self.speed, charge],
            atol=[1e-13, 1e-15, 1e-13, 1e-16], events=[low, high], **TIGHT,
        )  # fmt: skip
        self.current, self.position, self.speed, charge = found.y[:, -1]
        if found.status == 1:
            self.position, self.speed = (0.0 if found.t_events[0].size else stroke), 0.0
        return found.t[-1], charge
