"""The native plant beside CasADi's CVODES, over one window of a scenario's motions a side of the valve.

CVODES is driven by what the native loop recorded: the compare value, or the coil's mean current, of every period of the
PWM, and the pressure drop and drive that it was given. The equations are written from the paper once more: nothing of
the native step is used. The rules that both keep: a compare value acts from the next period on, the first part of which
is on; the play follows the mean current of the last period within half the play to either side, and what it differs by
is a constant force over the next one; a stop swallows the spool's speed, and holds it until the force leads away.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dzdesign.verify.closed_loop.loop import PERIODS_PER_RECORD, RECORD_S, LoopRun
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.scene import Scene, rounded_up
from dzdesign.verify.requirements import NATIVE_PLANT, Check

if TYPE_CHECKING:
    import casadi

#: Largest differences: of the position over the stroke, and of the flow over the largest one of the window.
MOST_APART = 1e-5
#: What is told of a difference that is no number.
NO_NUMBER = 1e6
#: Of all sides' windows together; and from a window's first pulse for how long at most, where slow ramps stretch it.
WINDOW_S, LONGEST_S = 1.0, 4.0
#: Zero command before it, beyond what an interlock waits for, s.
REST_S = 0.01
#: Over the share of the window that has passed: command, a ramp, steps up and down, and a last opening; pressure drop,
#: as a share of the way from the lowest test to the highest; drive that is added, share of full command.
COMMAND = (
    (0.0, 0.03, 0.25, 0.35, 0.35, 0.5, 0.5, 0.6, 0.6, 0.7, 0.85, 1.0), (0, 0, 0.3, 0, 1, 1, 0.5, 0.5, 0, 0, 0.6, 0),
)  # fmt: skip
SUPPLY, ADDED = ((0.0, 0.2, 0.45, 0.8), (0.0, 1.0, 0.4, 0.0)), ((0.0, 0.15, 0.65), (0.0, 0.02, -0.01))
#: Times the drive, the oil's viscosity and its density.
DRIVE, VISCOSITY, DENSITY = 1.03, 0.5, 0.97
#: CVODES takes Adams' formulas, for states in A, A ms, mm, mm ms and m/s; against the same at 1e-14 a position is off
#: by 5e-12 mm. It shows a phase at so many places.
OPTIONS: dict[str, Any] = {
    "linear_multistep_method": "adams", "nonlinear_solver_iteration": "functional",
    "reltol": 1e-12, "abstol": 1e-14, "max_num_steps": 1_000_000,
}  # fmt: skip
PLACES = 8
#: Rests and flights in one phase; more would be chatter at a stop. Nothing shorter than this is integrated, ms.
MOST_EVENTS, SHORTEST_MS = 40, 1e-12
PERIOD_MS = 1e3 * PWM_PERIOD_S


class PlantComparison(NamedTuple):
    """One window; a difference is an upper limit, of positions over the stroke, of flows over the largest."""

    seconds: float
    position_difference: float
    flow_difference: float
    #: By CVODES: the largest flow, and how often the spool met a stop.
    q_largest_L_min: float
    impacts: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """A scene, and what happens to it, a value for each record."""

    scene: Scene
    command: np.ndarray
    supply_MPa: np.ndarray
    added_V: np.ndarray
    seconds: float

    @classmethod
    def of(cls, scene: Scene, seconds: float = WINDOW_S, **parameters: float) -> "Window":
        """Return the window of a side, whose plant has other `parameters` where these are given."""
        given = scene.loop.plant
        given = replace(given, **parameters) if parameters and isinstance(given, Plant) else given
        loop = scene.loop.with_plant(given.with_oil(VISCOSITY, DENSITY)).with_drive(DRIVE)
        before = int(np.ceil((loop.waits_s + REST_S) / RECORD_S))
        count = round((seconds + 2 * loop.slowest_ramp_s) / RECORD_S)
        passed = np.concatenate([np.zeros(before), np.arange(count) / count])
        low, high = scene.tested_MPa or (scene.dp_MPa, scene.dp_MPa)
        supply, added = (
            np.array(levels)[np.searchsorted(begins, passed, side="right") - 1] for begins, levels in (SUPPLY, ADDED)
        )
        return cls(
            scene=replace(scene, loop=loop),
            command=np.interp(passed, *COMMAND),
            supply_MPa=low + (high - low) * supply,
            added_V=loop.u_max_V * added,
            seconds=seconds,
        )

    def run(self, periods_per_record: int) -> LoopRun:
        """Run the native loop through it."""
        every = PERIODS_PER_RECORD // periods_per_record
        command, supply, added = (np.repeat(each, every) for each in (self.command, self.supply_MPa, self.added_V))
        loop = self.scene.loop
        return loop.run(
            command, supply, "compensated", back_MPa=loop.back_within_span(self.scene.back_MPa, supply.max()),
            added_V=added, periods_per_record=periods_per_record,
        )  # fmt: skip


def compare_with_cvodes(scenes: Sequence[Scene], say: Callable[[str], None]) -> Check:
    """Run the window of every side in both, and tell whether what is between them is little enough."""
    say("comparing the plant with CasADi's CVODES")
    of_sides = list({scene.side: scene for scene in reversed(scenes)}.values())[::-1]
    try:
        return native_plant_check([compare(Window.of(scene, WINDOW_S / len(of_sides))) for scene in of_sides])
    except RuntimeError as error:  # of CasADi, of an integrator that gives up
        reason = next((line for line in reversed(str(error).splitlines()) if line.strip()), "no reason given")
        text = f"CVODES gave up ({reason.strip()[:100]}): correct mass, spring, damping or coil in --plant"
        return NATIVE_PLANT.check(holds=None, text=text)


def compare(window: Window) -> PlantComparison:
    """Run one window in both, and return what is between them; a difference is rounded up, as it is an upper limit.

    The native loop runs twice: with a record for each period, and as the ramps of the closed loop have it.
    """
    native, coarse, loop = window.run(1), window.run(PERIODS_PER_RECORD), window.scene.loop
    moved = np.flatnonzero((native.compare > 0) | (native.mean_V > 0))
    flows = np.flatnonzero(native.q_L_min > native.q_L_min[0])
    begin = (int(moved[0]) if moved.size else 0) // PERIODS_PER_RECORD * PERIODS_PER_RECORD
    count = round(window.seconds / PWM_PERIOD_S)
    late = int(flows[0]) + count // 2 if flows.size else 0  # behind a slow ramp
    end = min(max(begin + count, late), begin + round(LONGEST_S / PWM_PERIOD_S), native.compare.size)
    end -= end % PERIODS_PER_RECORD
    part, records = slice(begin, end), slice(begin // PERIODS_PER_RECORD, end // PERIODS_PER_RECORD)
    spool = CvodesSpool(loop.plant.parameters, loop.drive)
    in_force = np.concatenate([[0.0], native.compare])[part] / window.scene.compensator.signals.compare_max
    means = native.mean_V[part] if loop.coil else [None] * (end - begin)
    supply, added = (np.repeat(each, PERIODS_PER_RECORD)[part] for each in (window.supply_MPa, window.added_V))
    path = np.array([spool.period(*given) for given in zip(in_force, supply, added, means, strict=True)])
    position_mm, travel_mm = path.T
    if loop.stand_in:
        reference = loop.flow_at(travel_mm, supply)
    else:
        reference = np.array([flow_L_min(spool.plant, *each) for each in zip(position_mm, supply, strict=True)])
    of_record = reference.reshape(-1, PERIODS_PER_RECORD)
    flows_apart = (
        native.q_L_min[part] - reference, coarse.q_L_min[records] - of_record[:, -1],
        coarse.q_mean_L_min[records] - of_record.mean(axis=1), coarse.q_largest_L_min[records] - of_record.max(axis=1),
    )  # fmt: skip
    largest = float(reference.max())
    position, *of_flow = (float(np.abs(each).max()) for each in (native.position_mm[part] - position_mm, *flows_apart))
    apart = (position / spool.plant.stroke_mm, max(of_flow) / (largest if largest > 0 else 1.0))
    position, flow = (rounded_up(each) if each < NO_NUMBER else NO_NUMBER for each in apart)
    return PlantComparison((end - begin) * PWM_PERIOD_S, position, flow, largest, spool.impacts)


def native_plant_check(found: Sequence[PlantComparison]) -> Check:
    """Tell whether the native plant is as near to CVODES as it must be."""
    position, flow = (max(getattr(each, f"{name}_difference") for each in found) for name in ("position", "flow"))
    text = (
        f"over {sum(each.seconds for each in found):.2g} s of ramp, steps and load steps, spool and flow differ from "
        f"CasADi's CVODES by at most {position:.1e} of the stroke and {flow:.1e} of the largest flow; allowed: "
        f"{MOST_APART:.0e}; stops met: {sum(each.impacts for each in found)}"
    )
    within = position <= MOST_APART and flow <= MOST_APART
    shut = [each for each in found if each.q_largest_L_min <= 0]
    if within and shut:
        text += f"; the valve did not open in {len(shut)} of {len(found)} windows"
    return NATIVE_PLANT.check(holds=None if within and shut else within, text=text)


def drop_left(plant: Plant, opening_mm: "casadi.SX | float", supply_MPa: "casadi.SX | float") -> "casadi.SX | float":
    """Return the pressure drop in MPa that Eq. (24) leaves of a supply: Q = G sqrt(dP), dP = supply - droop Q^2."""
    conductance_2 = (plant.C_d_W_mm * 1e-3 * opening_mm * 1e-3 * 60_000) ** 2 * 2e6 / plant.rho_kg_m3
    return supply_MPa / (1 + plant.droop_MPa_L_min2 * conductance_2)


def load_force(plant: Plant, opening_mm: "casadi.SX | float", supply_MPa: "casadi.SX | float") -> "casadi.SX | float":
    """Return f_eL of Eq. (23), N: preload, less what the pressure drop takes off, and the flow force."""
    dp_MPa = drop_left(plant, opening_mm, supply_MPa)
    return plant.preload_N - plant.pressure_force_N_MPa * dp_MPa + plant.flow_force_N_mm_MPa * opening_mm * dp_MPa


def flow_L_min(plant: Plant, position_mm: float, supply_MPa: float) -> float:
    """Return the flow of Eq. (24), past the overlap."""
    opening_mm = max(position_mm - plant.overlap_mm, 0.0)
    dp_Pa = 1e6 * float(drop_left(plant, opening_mm, supply_MPa))
    return plant.C_d_W_mm * 1e-3 * opening_mm * 1e-3 * float(np.sqrt(2 * dp_Pa / plant.rho_kg_m3)) * 60_000


@dataclass(slots=True)
class CvodesSpool:
    """Coil and spool of one plant, Eqs. (19)-(23), by CVODES from PWM edge to PWM edge; the stops are events."""

    plant: Plant
    #: Times the voltage, or the current of a coil of its own.
    drive: float = 1.0
    #: Current (A), its integral (A ms), position (mm), its integral (mm ms), speed (m/s).
    state: np.ndarray = field(default_factory=lambda: np.zeros(5))
    #: Mean current of the last period, and that which the play holds, A.
    mean_A: float = 0.0
    played_A: float = 0.0
    #: How often the spool met a stop.
    impacts: int = 0
    #: Through one phase: volts at the amplifier, force beside the solenoid's (N), pressure drop at no flow (MPa),
    #: whether the current is that of its own coil.
    _acting: tuple[float, ...] = ()
    _cvodes: Any = None

    def __post_init__(self) -> None:
        self._cvodes = _integrator(self.plant)

    def period(self, duty: float, supply_MPa: float, added_V: float, mean_V: float | None) -> tuple[float, float]:
        """Move through a period, on and then off; return position at its end and its mean, mm.

        Of a drive by current `mean_V` is the coil's mean current, in V of command.
        """
        plant = self.plant
        A_per_V = plant.K_a / (plant.R_c_ohm + plant.r_p_ohm + plant.K_a * plant.K_fi_V_A)  # Eqs. (19)-(21) at rest
        half_A = plant.hysteresis_V / 2 * A_per_V
        within_A = min(max(self.played_A, self.mean_A - half_A), self.mean_A + half_A)
        late = math.exp(-1e-3 * PERIOD_MS / plant.hysteresis_lag_s) if plant.hysteresis_lag_s else 0.0
        self.played_A = late * self.played_A + (1 - late) * within_A
        push_N = plant.K_i_N_A * (self.played_A - self.mean_A + added_V * A_per_V)
        self.state[[1, 3]] = 0.0
        if mean_V is not None:
            duty, self.state[0] = 0.0, mean_V * A_per_V
        for volts, share in ((plant.u_max_V * self.drive, duty), (0.0, 1.0 - duty)):
            self._acting = (volts, push_N, supply_MPa, float(mean_V is None))
            self._phase(share * PERIOD_MS)
        self.mean_A = float(self.state[1]) / PERIOD_MS
        return float(self.state[2]), float(self.state[3]) / PERIOD_MS

    def _phase(self, left: float) -> None:
        for _ in range(MOST_EVENTS):
            if left <= SHORTEST_MS:
                return
            at_stop = self.state[4] == 0.0 and not 0.0 < self.state[2] < self.plant.stroke_mm
            away = 1.0 if self.state[2] <= 0.0 else -1.0
            held = at_stop and away * self._pull(float(self.state[0])) <= 0.0
            left -= self._rest(left, away) if held else self._fly(left)
        self.state = self._path(left, free=False)[-1]  # to and fro at a stop, by less and less

    def _path(self, milliseconds: float, *, free: bool) -> np.ndarray:
        """Return the states at `PLACES` places in a time, its end the last."""
        p = [max(milliseconds, SHORTEST_MS), *self._acting, float(free)]
        return np.array(self._cvodes(x0=self.state, p=p)["xf"]).T

    def _pull(self, current: float) -> float:
        """Return the force on a spool at rest where it is, N: Eqs. (22), (23)."""
        plant, position = self.plant, float(self.state[2])
        _, push_N, supply_MPa, _ = self._acting
        load = float(load_force(plant, max(position - plant.overlap_mm, 0.0), supply_MPa))
        return plant.K_i_N_A * current - plant.K_et_N_m * 1e-3 * position - load + push_N

    def _rest(self, left: float, away: float) -> float:
        """Stay at a stop until the current lets go, or to the end; return for how long."""

        def pull(milliseconds: float) -> float:
            return away * self._pull(float(self._path(milliseconds, free=False)[-1, 0]))

        taken = _root(pull, 0.0, left) if pull(left) > 0.0 else left
        self.state = self._path(taken, free=False)[-1]
        if taken < left:  # by a root's last digits it may not be free yet
            self.state[4] = away * 1e-15
        return max(taken, SHORTEST_MS)

    def _fly(self, left: float) -> float:
        """Move free of the stops until one is met, or to the end; return for how long."""
        places, stroke_mm = np.vstack([self.state, self._path(left, free=True)]), self.plant.stroke_mm
        times, speed = np.linspace(0.0, left, PLACES + 1), places[:, 4]
        outside = np.maximum(-places[:, 2], places[:, 2] - stroke_mm)
        turns = speed[1:] * speed[:-1] < 0.0
        reach = np.abs(np.diff(speed)) * (left / PLACES)
        for cell in np.flatnonzero((outside[1:] > 0.0) | (turns & (outside[1:] + reach > 0.0))):
            begin, out = times[cell], times[cell + 1]
            if turns[cell] and outside[cell + 1] <= 0.0:  # it may have been there and back
                out = _root(lambda ms: float(self._path(ms, free=True)[-1, 4]), begin, out)
            furthest = float(self._path(out, free=True)[-1, 2])
            if 0.0 <= furthest <= stroke_mm:
                continue
            stop = 0.0 if furthest < 0.0 else stroke_mm
            met = begin
            if outside[cell] < 0.0:
                met = _root(lambda ms, at=stop: float(self._path(ms, free=True)[-1, 2]) - at, begin, out)  # type: ignore[misc]
            self.state = self._path(met, free=True)[-1]
            self.state[2], self.state[4] = stop, 0.0
            self.impacts += 1
            return max(float(met), SHORTEST_MS)
        self.state = places[-1]
        return left


def _root(value: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function is zero: of like signs at both ends, where it begins."""
    from scipy.optimize import brentq

    if value(low) * value(high) >= 0.0:
        return low
    return float(brentq(value, low, high, xtol=1e-13, rtol=1e-14))


def _integrator(plant: Plant) -> "casadi.Function":
    """Return CVODES over a phase of any length: the time is counted in shares of it."""
    import casadi as ca

    state, given = ca.SX.sym("state", 5), ca.SX.sym("given", 6)
    current, _, position, _, speed = ca.vertsplit(state)
    milliseconds, volts, push, supply, own_current, free = ca.vertsplit(given)
    u_e = plant.K_a * (volts - plant.K_fi_V_A * current)  # Eqs. (19), (21)
    by_current = (u_e - (plant.R_c_ohm + plant.r_p_ohm) * current) / plant.L_c_H  # Eq. (20), A/s
    f_e = plant.K_i_N_A * current  # Eq. (22)
    load = load_force(plant, ca.fmax(position - plant.overlap_mm, 0), supply)
    by_speed = (f_e - plant.B_e_N_s_m * speed - plant.K_et_N_m * 1e-3 * position - load + push) / plant.m_e_kg  # (23)
    rates = ca.vertcat(own_current * 1e-3 * by_current, current, free * speed, position, free * 1e-3 * by_speed)
    system = {"x": state, "p": given, "ode": milliseconds * rates}
    return ca.integrator("phase", "cvodes", system, 0, np.linspace(0, 1, PLACES + 1)[1:].tolist(), OPTIONS)
