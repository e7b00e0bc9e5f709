"""The plant's motion over one phase of the PWM, in CasADi: what is compiled into the closed loop.

The current does not feel the spool (Eqs. 19-21), so it is solved exactly; the spool's motion under it is one or a few
Runge-Kutta steps, the stops apart (see plant_period.h).
"""

import math
from typing import TYPE_CHECKING

from dzdesign.verify.plant import PWM_PERIOD_S, Plant, derivatives, orifice

if TYPE_CHECKING:
    import casadi

#: Radians of the fastest free motion in a Runge-Kutta step: its error stays below 1e-5 of the stroke.
STEP_RAD = 0.6


def motion_sources(plant: Plant) -> dict[str, str]:
    """Return the C of the plant's motion and of its constants, for plant_period.h."""
    import casadi as ca

    generator = ca.CodeGenerator("plant_motion.c")
    for function in motion(plant):
        generator.add(function)
    constants = {
        "PERIOD_S": PWM_PERIOD_S,
        "U_MAX_V": plant.u_max_V,
        "STROKE_M": plant.stroke_mm * 1e-3,
        "HALF_PLAY_V": plant.hysteresis_V / 2,
        "FORCE_PER_VOLT": plant.force_per_volt,
        "VOLTS_PER_AMPERE": plant.K_i_N_A / plant.force_per_volt,
    }
    lines = [f"#define PLANT_{name} {float(value)!r}" for name, value in constants.items()]
    return {"plant_motion.h": generator.dump(), "plant_constants.h": "\n".join([*lines, ""])}


def motion(plant: Plant) -> list["casadi.Function"]:
    """Return the functions that plant_period.h calls.

    Returns
    -------
    list of casadi.Function
        ``plant_coil(i, voltage, h) -> (i, charge)``;
        ``plant_move(state[3], voltage, h, play_N, supply_MPa) -> (state[3], charge)``, free of the stops, state as in
        `derivatives`; ``plant_release(x, play_N, supply_MPa) -> i``, the current at which nothing moves a spool that
        rests at x; ``plant_time(i, target, voltage) -> s`` until the current is `target`, which it must come to;
        ``plant_flow(x, supply_MPa) -> (dp_MPa, Q_L_min)``. SI units where none stands.
    """
    import casadi as ca

    state, inputs, rates = derivatives(plant)
    rate = ca.Function("rate", [state, inputs], [rates])
    i, x, voltage, h, play, supply, target = (
        ca.SX.sym(name) for name in ("i", "x", "voltage", "h", "play", "supply", "target")
    )

    def rates_at(current, position, speed, volts):
        return rate(ca.vertcat(current, position, speed), ca.vertcat(volts, play, supply))

    # Eqs. (19)-(21): di/dt = decay (settled - i), the same wherever the spool is.
    decay = -float(ca.Function("decay", [], [rates_at(1, 0, 0, 0)[0] - rates_at(0, 0, 0, 0)[0]])()["o0"])
    settled = rates_at(0, 0, 0, voltage)[0] / decay
    steps = _steps(plant)
    half = ca.exp(-decay * h / (2 * steps))
    coil = settled + (i - settled) * half ** (2 * steps)
    charge = settled * h + (i - coil) / decay
    position, speed, away = state[1], state[2], i - settled
    for _ in range(steps):  # classical Runge-Kutta, order 4, in position and speed
        mid, end = away * half, away * half**2
        position, speed = _runge_kutta(
            lambda current, at, v: rates_at(settled + current, at, v, voltage)[1:], (away, mid, end), position, speed,
            h / steps,
        )  # fmt: skip
        away = end
    start = ca.vertcat(i, state[1:])
    at_rest = [rates_at(current, x, 0, 0)[2] for current in (0, 1)]
    dp_MPa, flow = orifice(plant, ca.fmax(x - plant.overlap_mm * 1e-3, 0), supply)
    return [
        ca.Function("plant_coil", [i, voltage, h], [coil, charge]),
        ca.Function("plant_move", [start, voltage, h, play, supply], [ca.vertcat(coil, position, speed), charge]),
        ca.Function("plant_release", [x, play, supply], [at_rest[0] / (at_rest[0] - at_rest[1])]),
        ca.Function("plant_time", [i, target, voltage], [ca.log((i - settled) / (target - settled)) / decay]),
        ca.Function("plant_flow", [x, supply], [dp_MPa, flow]),
    ]


def _runge_kutta(rate, currents, position, speed, h):
    """Return position and speed after a step; `currents` at its start, middle and end."""
    k1 = rate(currents[0], position, speed)
    k2 = rate(currents[1], position + h / 2 * k1[0], speed + h / 2 * k1[1])
    k3 = rate(currents[1], position + h / 2 * k2[0], speed + h / 2 * k2[1])
    k4 = rate(currents[2], position + h * k3[0], speed + h * k3[1])
    return (
        position + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]),
        speed + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]),
    )


def _steps(plant: Plant) -> int:
    """Return how many steps a phase takes, so that none is longer than `STEP_RAD` of the fastest motion."""
    return max(math.ceil(plant.fastest_rad_s * PWM_PERIOD_S / STEP_RAD), 1)
