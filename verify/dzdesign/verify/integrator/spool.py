"""Coil and spool by Eqs. (19)-(23), integrated by CasADi's CVODES from PWM edge to PWM edge; the stops are events.

Written from the paper once more, as it checks motion.py and the C beside it: nothing of them is used here. Beyond the
paper: preload, the force by which the pressure drop helps to open, and the flow force in the load f_eL; overlap; stops
that swallow the spool's speed; and the play, a force that is constant over a period of the PWM (see `reference_loop`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.verify.closed_loop.plant import Plant
from dzdesign.verify.integrator.cvodes import Cvodes

if TYPE_CHECKING:
    import casadi

#: Rests and flights in one phase; more would be chatter at a stop.
MOST_EVENTS = 20
#: Of a phase, ms: nothing shorter is integrated.
SHORTEST_MS = 1e-12
#: Of an excursion from a stop, mm: a shorter one is none.
NEAR_MM = 1e-12


@dataclass(slots=True)
class SpoolState:
    """Where coil and spool are."""

    #: A.
    current: float = 0.0
    #: Of the current since the period began, A ms.
    charge: float = 0.0
    #: mm.
    position: float = 0.0
    #: m/s.
    speed: float = 0.0
    #: At stops, so far.
    impacts: int = 0

    def take(self, found: np.ndarray) -> None:
        """Become what CVODES found."""
        self.current, self.charge, self.position, self.speed = map(float, found)


@dataclass(frozen=True, slots=True, kw_only=True)
class Acting:
    """What acts through one phase."""

    #: At the amplifier: u_max or nothing.
    volts: float
    #: Force beside the solenoid's: what the play adds, N.
    push_N: float
    #: Pressure drop at no flow, MPa.
    supply_MPa: float
    #: Whether the current stays as it is, as another coil makes it.
    current_held: bool = False


def load_force(plant: Plant, opening_mm: "casadi.SX | float", dp_MPa: "casadi.SX | float") -> "casadi.SX | float":
    """Return f_eL of Eq. (23), N: preload, less what the pressure drop takes off, and the flow force."""
    return (
        plant.preload_N
        - plant.pressure_force_N_MPa * dp_MPa
        + plant.flow_force_N_mm_MPa * opening_mm * dp_MPa
    )  # fmt: skip


def drop_left(plant: Plant, opening_mm: "casadi.SX | float", supply_MPa: "casadi.SX | float") -> "casadi.SX | float":
    """Return the pressure drop in MPa that Eq. (24) leaves of a supply: Q = G sqrt(dP), dP = supply - droop Q^2."""
    conductance_2 = (plant.C_d_W_mm * 1e-3 * opening_mm * 1e-3 * 60_000) ** 2 * 2e6 / plant.rho_kg_m3
    return supply_MPa / (1 + plant.droop_MPa_L_min2 * conductance_2)


class CvodesSpool:
    """Coil and spool of one plant."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._cvodes = _integrator(plant)
        #: Force per volt of command at rest, from Eqs. (19)-(22), N/V: by it a play in V is one in N.
        loop_ohm = plant.R_c_ohm + plant.r_p_ohm + plant.K_a * plant.K_fi_V_A
        self.N_per_V = plant.K_i_N_A * plant.K_a / loop_ohm
        #: At full command and at rest, A.
        self.full_A = plant.u_max_V * plant.K_a / loop_ohm

    def phase(self, state: SpoolState, acting: Acting, milliseconds: float) -> None:
        """Move through one phase, in which the voltage is constant, with every stop that is met in it."""
        left = milliseconds
        for _ in range(MOST_EVENTS):
            if left <= SHORTEST_MS:
                return
            if self._is_held(state, acting):
                left -= self._rest(state, acting, left)
                if left <= SHORTEST_MS:
                    return
            left -= self._fly(state, acting, left)
        # To and fro at a stop, by less and less.
        state.take(self._integrated(state, acting, left, free=False))

    def stays(self, state: SpoolState, acting: Acting) -> bool:
        """Whether nothing moves: no voltage, no current, and a stop that holds the spool."""
        return state.current == 0.0 and (acting.volts == 0.0 or acting.current_held) and self._is_held(state, acting)

    def _pull(self, state: SpoolState, acting: Acting) -> float:
        """Return the force on a spool at rest where it is, N."""
        plant = self._plant
        opening = max(state.position - plant.overlap_mm, 0.0)
        load = load_force(plant, opening, drop_left(plant, opening, acting.supply_MPa))
        return float(
            plant.K_i_N_A * state.current - plant.K_et_N_m * 1e-3 * state.position - load + acting.push_N
        )  # Eqs. (22), (23)

    def _is_held(self, state: SpoolState, acting: Acting) -> bool:
        if state.speed != 0.0 or 0.0 < state.position < self._plant.stroke_mm:
            return False
        return (self._pull(state, acting) > 0.0) == (state.position > 0.0)

    def _integrated(self, state: SpoolState, acting: Acting, milliseconds: float, *, free: bool) -> np.ndarray:
        given = [
            milliseconds, acting.volts, acting.push_N, acting.supply_MPa, float(free), float(not acting.current_held),
        ]  # fmt: skip
        return self._cvodes.end((state.current, state.charge, state.position, state.speed), given)

    def _rest(self, state: SpoolState, acting: Acting, left: float) -> float:
        """Stay at a stop until the current lets go, or to the end; return for how long."""

        def after(milliseconds: float) -> np.ndarray:
            return self._integrated(state, acting, milliseconds, free=False)

        def pull(later: np.ndarray) -> float:
            return self._pull(SpoolState(position=state.position, current=float(later[0])), acting)

        away, taken, end = 1.0 if state.position <= 0.0 else -1.0, left, after(left)
        if away * pull(end) > 0.0:
            taken = _root(lambda ms: pull(after(ms)), 0.0, left)
            end = after(taken)
        state.take(end)
        return taken

    def _reach_mm(self, state: SpoolState, acting: Acting, end: np.ndarray, left: float) -> float:
        """Return how far at most a spool between the stops gets in a phase: every force one way, and no damping.

        In a phase the current goes one way, so that it is largest at an end of it.
        """
        plant = self._plant
        load_N = abs(plant.preload_N) + acting.supply_MPa * (
            abs(plant.pressure_force_N_MPa) + abs(plant.flow_force_N_mm_MPa) * (plant.stroke_mm - plant.overlap_mm)
        )  # Eq. (23), at its largest
        force_N = plant.K_i_N_A * max(abs(state.current), abs(float(end[0]))) + abs(acting.push_N)
        force_N += plant.K_et_N_m * 1e-3 * plant.stroke_mm + load_N
        return abs(state.speed) * left + force_N / plant.m_e_kg * 1e-3 * left**2 / 2

    def _fly(self, state: SpoolState, acting: Acting, left: float) -> float:
        """Move free of the stops until one is met, or to the end; return for how long."""

        def after(milliseconds: float) -> np.ndarray:
            return self._integrated(state, acting, milliseconds, free=True)

        def outside(position: float) -> float:
            return max(-position, position - self._plant.stroke_mm)

        end = after(left)
        reach = self._reach_mm(state, acting, end, left)
        if outside(state.position) < -reach:
            state.take(end)
            return left
        inside, out = 0.0, left
        fastest = self._fastest(state, acting, after, left)
        if state.speed * end[3] < 0.0 or (fastest and state.speed * float(after(fastest)[3]) < 0.0):
            turn = _root(lambda ms: float(after(ms)[3]), 0.0, fastest or left)
            inside, out = (0.0, turn) if outside(float(after(turn)[2])) > 0.0 else (turn, left)
        elif state.speed == 0.0 and outside(float(end[2])) > 0.0:
            inside = self._turn_from_rest(after, left)
        furthest = float((end if out == left else after(out))[2])
        if outside(furthest) <= 0.0:
            state.take(end)
            return left
        stop = 0.0 if furthest < 0.0 else self._plant.stroke_mm
        met = inside
        if outside(float(after(inside)[2]) if inside > 0.0 else state.position) < -NEAR_MM:
            met = _root(lambda ms: float(after(ms)[2]) - stop, inside, out)
        if met > 0.0:
            state.take(after(met))
        state.position, state.speed = stop, 0.0
        state.impacts += 1
        return max(met, SHORTEST_MS)

    def _fastest(self, state: SpoolState, acting: Acting, after: Callable[[float], np.ndarray], left: float) -> float:
        """Return when a spool that is braked first and driven on at last is fastest the other way; 0 of any other.

        It may turn before that and again behind it, so that its speeds at both ends of the phase are of one sign.
        """

        def force(ms: float) -> float:
            current, _, position, speed = map(float, after(ms) if ms > 0.0 else start)
            there = SpoolState(position=position, current=current)
            return self._pull(there, acting) - self._plant.B_e_N_s_m * speed

        start = np.array([state.current, state.charge, state.position, state.speed])
        end_speed = float(after(left)[3])
        if state.speed * end_speed <= 0.0 or state.speed * force(0.0) >= 0.0 or end_speed * force(left) <= 0.0:
            return 0.0
        return _root(force, 0.0, left)

    @staticmethod
    def _turn_from_rest(after: Callable[[float], np.ndarray], left: float) -> float:
        """Return when a spool that left a stop and came back in one phase turned; 0 where that is too soon to tell."""
        at_end, begin = float(after(left)[3]), left / 2
        while begin > SHORTEST_MS and float(after(begin)[3]) * at_end >= 0.0:
            begin /= 2
        return _root(lambda ms: float(after(ms)[3]), begin, left) if begin > SHORTEST_MS else 0.0


def _root(value: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function of unlike signs at both ends is zero."""
    from scipy.optimize import brentq

    return float(brentq(value, low, high, xtol=1e-13, rtol=1e-14))


def _integrator(plant: Plant) -> Cvodes:
    """Return CVODES over a phase of any length: the time is counted in shares of it."""
    import casadi as ca

    state, given = ca.SX.sym("state", 4), ca.SX.sym("given", 6)
    current, _, position, speed = ca.vertsplit(state)
    milliseconds, volts, push, supply, free, own_current = ca.vertsplit(given)
    opening = ca.fmax(position - plant.overlap_mm, 0)
    load = load_force(plant, opening, drop_left(plant, opening, supply))
    u_e = plant.K_a * (volts - plant.K_fi_V_A * current)  # Eqs. (19), (21)
    by_current = (u_e - (plant.R_c_ohm + plant.r_p_ohm) * current) / plant.L_c_H  # Eq. (20), A/s
    f_e = plant.K_i_N_A * current  # Eq. (22)
    by_speed = (f_e - plant.B_e_N_s_m * speed - plant.K_et_N_m * 1e-3 * position - load + push) / plant.m_e_kg  # (23)
    rates = ca.vertcat(own_current * 1e-3 * by_current, current, free * speed, free * 1e-3 * by_speed)
    return Cvodes(state, given, milliseconds * rates)
