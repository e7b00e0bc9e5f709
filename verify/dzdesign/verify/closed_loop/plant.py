"""The plant of Eqs. (19)-(24), with what a real valve's measurements need; and its Runge-Kutta step, by CasADi, in C.

Added to the paper's equations, each of them off where its parameter is zero: preload, overlap, stops, a pressure force
that moves the threshold, flow force, a play in the magnetic force (hysteresis) and its lag, droop of the supply.

A step is taken in one of three states of the spool: open and shut on either side of the metering edge, where the
equations are smooth, and held at a stop, where only the current goes on. plant.h shortens a step to where it meets a
stop or the edge, or where the current lets go of a stop: what a step of the fourth order leaves is then its own error,
and not that of a kink.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, cast

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import quantity
from dzdesign.core.documents import read_bytes, read_toml
from dzdesign.core.errors import InputError, nearest, quoted

if TYPE_CHECKING:
    import casadi

PWM_PERIOD_S = 400e-6
MPA, L_MIN = 1e6, 1e-3 / 60
#: Beyond any plant in the units of the names; an integer of TOML has no end.
LARGEST_PARAMETER = 1e12
#: Characters of a key to which the nearest known one is looked for.
LONGEST_KEY = 80
#: Faster than this is not a valve's spool, and would take the integrator a thousand steps a phase.
FASTEST_RAD_S = 1e6
#: Of a hydraulic system, for the flow force.
LARGEST_DP_MPA = 40.0
#: In a step the spool moves by so many radians of its fastest motion at most, and the coil by so many of its own, whose
#: error the spool feels for a shorter time. An undamped spool keeps what a step is off by: so many times shorter steps,
#: below so much damping, as a share of that at which it no longer swings.
SPOOL_RAD, COIL_RAD = 0.1, 0.12
UNDAMPED, SHORTER = 0.02, 4.0
#: Numbers of a plant that plant.h and the step read by name, in SI units where none stands.
NAMED = (
    "STROKE_M", "OVERLAP_M", "HALF_PLAY_V", "PLAYED", "VOLTS_PER_CHARGE", "U_MAX_V", "PERIOD_S", "FULL_A", "PUSH",
    "STEPS_PER_S", "LINEAR", "DECAY", "DRIVE", "PULL", "SPRING", "DAMPING", "PER_KG",
)  # fmt: skip


def _parameter(unit: str, description: str) -> Meta:
    """Return the annotation of a parameter of the plant."""
    return quantity(unit, description, ge=0, le=LARGEST_PARAMETER)


@dataclass(frozen=True, slots=True, kw_only=True)
class Plant:
    """Parameters of the plant, named as in Eqs. (19)-(24), with the unit at the end of each name."""

    u_max_V: Annotated[float, _parameter("V", "Command at full duty of the PWM (Eq. 19: u_max or 0).")] = 10.0
    K_a: Annotated[float, _parameter("1", "Amplifier gain, K_e of Eq. (19).")] = 4.0
    K_fi_V_A: Annotated[float, _parameter("V/A", "Gain of the current feedback.")] = 9.0
    R_c_ohm: Annotated[float, _parameter("ohm", "Resistance of the coil.")] = 3.5
    r_p_ohm: Annotated[float, _parameter("ohm", "Internal resistance of the amplifier.")] = 0.5
    L_c_H: Annotated[float, _parameter("H", "Inductance of the coil.")] = 0.04
    K_i_N_A: Annotated[float, _parameter("N/A", "Force of the solenoid per current.")] = 60.0
    m_e_kg: Annotated[float, _parameter("kg", "Moving mass.")] = 0.06
    B_e_N_s_m: Annotated[float, _parameter("N s/m", "Damping coefficient.")] = 45.0
    K_et_N_m: Annotated[float, _parameter("N/m", "Stiffness of the spring.")] = 15000.0
    preload_N: Annotated[float, _parameter("N", "Load force f_eL at rest.")] = 27.6
    pressure_force_N_MPa: Annotated[float, _parameter("N/MPa", "Decrease of the load force with dP.")] = 0.32
    flow_force_N_mm_MPa: Annotated[float, _parameter("N/(mm MPa)", "Flow force, by dP and opening.")] = 1.5
    overlap_mm: Annotated[float, _parameter("mm", "Travel before the edge opens.")] = 0.3
    stroke_mm: Annotated[float, _parameter("mm", "Travel to the stop.")] = 2.2
    hysteresis_V: Annotated[float, _parameter("V", "Play between current and force, as command.")] = 0.15
    hysteresis_lag_s: Annotated[float, _parameter("s", "Lag of that play, which widens it with the rate.")] = 0.0
    C_d_W_mm: Annotated[float, _parameter("mm", "Discharge coefficient times area gradient, Eq. (24).")] = 3.2
    rho_kg_m3: Annotated[float, _parameter("kg/m3", "Density of the oil, Eq. (24).")] = 860.0
    droop_MPa_L_min2: Annotated[float, _parameter("MPa/(L/min)^2", "Loss of pressure drop per flow squared.")] = 4e-4

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if type(value) not in (int, float) or not 0 <= value <= LARGEST_PARAMETER:
                raise InputError(
                    f"plant parameter {field.name} is {quoted(value)}, expected a number of zero or more, in "
                    f"the unit that its name ends in, without quotes; write for example {field.name} = {field.default}"
                )
        for name in ("u_max_V", "K_a", "R_c_ohm", "L_c_H", "K_i_N_A", "m_e_kg", "K_et_N_m", "rho_kg_m3", "C_d_W_mm"):
            if getattr(self, name) <= 0:
                raise InputError(f"plant parameter {name} is {getattr(self, name)}, expected a positive number")
        if self.stroke_mm <= self.overlap_mm:
            raise InputError(f"the stroke of {self.stroke_mm} mm ends inside the overlap of {self.overlap_mm} mm")
        for what, rate, keys in (
            ("spool moves", self.fastest_rad_s, "m_e_kg, K_et_N_m or B_e_N_s_m"),
            ("coil follows", self.coil_rad_s, "L_c_H, K_a or K_fi_V_A"),
        ):
            if rate > FASTEST_RAD_S:
                limit = f"expected at most {FASTEST_RAD_S:.3g}"
                raise InputError(f"the plant's {what} at {rate:.3g} rad/s, {limit}; correct {keys}")

    @property
    def parameters(self) -> "Plant":
        """The plant that moves the spool, which is this one."""
        return self

    def with_oil(self, viscosity: float, density: float) -> "Plant":
        """Return the plant with other oil, by factors of viscosity and density; the damping follows the viscosity."""
        return replace(self, B_e_N_s_m=self.B_e_N_s_m * viscosity, rho_kg_m3=self.rho_kg_m3 * density)

    def with_hysteresis(self, share: float) -> "Plant":
        """Return the plant with so many times the hysteresis."""
        return replace(self, hysteresis_V=share * self.hysteresis_V, hysteresis_lag_s=share * self.hysteresis_lag_s)

    def swings_rad_s(self, dp_MPa: float) -> float:
        """Return the rate of the spool's free motion against spring and flow force at a pressure drop."""
        return math.sqrt((self.K_et_N_m + self.flow_force_N_mm_MPa * 1e3 * dp_MPa) / self.m_e_kg)

    @property
    def fastest_rad_s(self) -> float:
        """Rate of the spool's fastest free motion: against spring and flow force, or against its damping."""
        return max(self.swings_rad_s(LARGEST_DP_MPA), self.B_e_N_s_m / self.m_e_kg)

    @property
    def coil_rad_s(self) -> float:
        """Rate at which the current settles, by Eqs. (19)-(21)."""
        return (self.K_a * self.K_fi_V_A + self.R_c_ohm + self.r_p_ohm) / self.L_c_H

    @property
    def force_per_volt(self) -> float:
        """Force per volt of command at rest, N/V, by Eqs. (19)-(22)."""
        return self.K_i_N_A * self.K_a / (self.R_c_ohm + self.r_p_ohm + self.K_a * self.K_fi_V_A)

    def step_s(self, dp_MPa: float) -> float:
        """Return the longest step up to a pressure drop, s: it follows from the plant's fastest time constant."""
        swings, damping = self.swings_rad_s(dp_MPa), self.B_e_N_s_m / self.m_e_kg
        spool_s = SPOOL_RAD / max(swings, damping)
        return min(spool_s / SHORTER if damping < 2 * UNDAMPED * swings else spool_s, COIL_RAD / self.coil_rad_s)


def read_plant(path: Path, say: Callable[[str], None] = lambda _: None) -> Plant:
    """Read a plant from a TOML file; an unknown key is refused, with the nearest known one.

    `say` receives a message about the parameters that keep the default plant's values.
    """
    values = read_toml(read_bytes(path, "plant file"), str(path), "lines such as K_a = 4.0")
    known = [field.name for field in fields(Plant)]
    for key in values:
        if key not in known:
            raise InputError(f"'{path}': there is no plant parameter {quoted(key)}{nearest(key[:LONGEST_KEY], known)}")
    try:
        plant = Plant(**values)
    except InputError as error:
        raise InputError(f"'{path}': {error}") from error
    missing = [name for name in known if name not in values]
    if missing:
        say(f"'{path}' leaves {', '.join(missing)} as the default plant has them")
    return plant


class Equations(NamedTuple):
    """The plant's equations with every parameter a symbol."""

    #: plant -> d rates / d state (3, 3), d rates / d (voltage, load force) (3, 2).
    linear: "casadi.Function"
    #: plant -> what of `acting` depends on the parameters only.
    extracted: "casadi.Function"
    #: (x, supply, plant, extracted) -> force beyond the linear part, N; dP, MPa; Q, L/min; force of an open edge,
    #: continued where it is shut.
    acting: "casadi.Function"


@cache
def equations() -> Equations:
    """Return Eqs. (19)-(24), lowered from SymPy: what is linear, and what depends on the spool's position."""
    import casadi as ca

    from dzdesign.derivation import plant as paper
    from dzdesign.derivation.lowering import lower

    names = [field.name for field in fields(Plant)]
    symbols = ca.SX.sym("plant", len(names))
    # Not a `Plant`, whose parameters are checked to be numbers, but with the same names.
    plant = cast(Plant, SimpleNamespace(**dict(zip(names, ca.vertsplit(symbols), strict=True))))
    parameters = (
        plant.K_a, plant.K_fi_V_A, plant.K_i_N_A, plant.R_c_ohm, plant.r_p_ohm, plant.L_c_H, plant.m_e_kg,
        plant.B_e_N_s_m, plant.K_et_N_m,
    )  # fmt: skip
    state, given = ca.SX.sym("state", 3), ca.SX.sym("given", 2)
    rates_of = lower(list(paper.state_derivatives()), (*paper.STATE, *paper.INPUTS, *paper.PARAMETERS))
    rates = ca.vertcat(*rates_of(*ca.vertsplit(state), *ca.vertsplit(given), *parameters))
    flow = lower(paper.flow(), (paper.STATE[1], *paper.FLOW_PARAMETERS), {"sqrt": ca.sqrt})
    x, supply = ca.SX.sym("x"), ca.SX.sym("supply")
    past = x - plant.overlap_mm * 1e-3
    # L/min at 1 MPa; Eq. (24) is linear in the opening, and of one metre it is a number.
    per_metre = flow(1.0, 1.0, plant.C_d_W_mm * 1e-3, plant.rho_kg_m3, MPA) / L_MIN

    def through(opening_m: Any) -> tuple[Any, Any, Any]:
        # Eq. (24) is Q = G sqrt(dP); with dP = supply - droop Q^2 that gives dP = supply / (1 + droop G^2).
        dp_MPa = supply / (1 + plant.droop_MPa_L_min2 * (opening_m * per_metre) ** 2)
        flow_force = plant.flow_force_N_mm_MPa * 1e3 * dp_MPa * opening_m
        force = plant.pressure_force_N_MPa * dp_MPa - plant.preload_N - flow_force
        return force, dp_MPa, opening_m * per_metre * ca.sqrt(dp_MPa)

    # fmax would be a call of the C library.
    acting = ca.vertcat(*through(ca.if_else(past > 0, past, 0)), through(past)[0])
    remaining, found, extracted = ca.extract_parametric(acting, symbols)
    return Equations(
        ca.Function("linear", [symbols], [ca.jacobian(rates, state), ca.jacobian(rates, given)]),
        ca.Function("extracted", [symbols], [ca.vertcat(*extracted)]),
        ca.Function("acting", [x, supply, symbols, ca.vertcat(*found)], ca.vertsplit(remaining)),
    )


def numbers_of(plant: Plant, dp_MPa: float, drive: float = 1.0) -> np.ndarray:
    """Return a plant as plant.h takes it: `NAMED`, the parameters, and what `Equations.extracted` makes of them.

    Its steps are those of runs up to a pressure drop; its PWM, or its coil's control, drives it so many times as much.
    """
    parameters = np.array([getattr(plant, field.name) for field in fields(Plant)], dtype=float)
    by_state, by_given = (np.array(part) for part in equations().linear(parameters))
    decay, per_V = -by_state[0, 0], by_given[0, 0]
    linear = plant.flow_force_N_mm_MPa == 0 and plant.droop_MPa_L_min2 == 0
    full_A = per_V * plant.u_max_V / decay
    named = (
        plant.stroke_mm * 1e-3, plant.overlap_mm * 1e-3, plant.hysteresis_V / 2,
        1 - math.exp(-PWM_PERIOD_S / plant.hysteresis_lag_s) if plant.hysteresis_lag_s else 1.0,
        plant.K_i_N_A / plant.force_per_volt / PWM_PERIOD_S, drive * plant.u_max_V, PWM_PERIOD_S, drive * full_A,
        plant.force_per_volt / plant.m_e_kg, 1 / plant.step_s(dp_MPa), linear, decay, per_V, by_state[2, 0],
        -by_state[2, 1], -by_state[2, 2], -by_given[2, 1],
    )  # fmt: skip
    return np.concatenate([named, parameters, np.array(equations().extracted(parameters)).ravel()])


@cache
def step_header() -> str:
    """Return the C code of the functions that plant.h calls; the same for every plant.

    ``plant_open(state[4], h, voltage, push, supply_MPa, p) -> state[4]``
        is CasADi's Runge-Kutta step of the fourth order past the edge. The state is current, position, speed, and the
        integral of the position; `push` is the acceleration by the play and by drive that is added.
    ``plant_shut``
        is that before the edge, where `push` has all that acts; ``plant_held`` is that at a stop.
    ``plant_acting(x, supply_MPa, p) -> (acts in m/s², dp_MPa, Q_L_min)``
        is what depends on the position.

    p: `numbers_of`.
    """
    import casadi as ca

    sizes = (len(NAMED), len(fields(Plant)), equations().extracted.size1_out(0))
    p = ca.SX.sym("p", sum(sizes))
    parts = ca.vertsplit(p, [0, *np.cumsum(sizes).tolist()])
    named = SimpleNamespace(**dict(zip(NAMED, ca.vertsplit(parts[0]), strict=True)))
    state, given, supply = ca.SX.sym("state", 4), ca.SX.sym("given", 2), ca.SX.sym("supply")
    current, x, v = state[0], state[1], state[2]
    h, position = ca.SX.sym("h"), ca.SX.sym("x")
    # All that the time step multiplies, once: a stage then waits for one product less of the stage before it.
    stepped = [h * each for each in (
        named.DRIVE * given[0], given[1], named.DECAY, named.PULL, named.SPRING, named.DAMPING, named.PER_KG, 1.0,
    )]  # fmt: skip
    drive, push, decay, pull, spring, damping, per_kg, time = ca.vertsplit(ca.SX.sym("stepped", len(stepped)))

    def step(name: str, speed: Any, acceleration: Any) -> "casadi.Function":
        rates = ca.vertcat(drive - decay * current, speed, acceleration, time * x)
        of_all = ca.vertcat(drive, push, decay, pull, spring, damping, per_kg, time, supply, p)
        runge_kutta = ca.simpleRK(ca.Function(name, [state, of_all], [rates]), 1, 4).expand()
        end = runge_kutta(state, ca.vertcat(*stepped, supply, p), 1)
        return ca.Function(name, [state, h, *ca.vertsplit(given), supply, p], [end])

    # In this order the spool's own terms, which each stage waits for, come last.
    shut = (pull * current + push) - (spring * x + damping * v)
    open_ = (pull * current + push + per_kg * equations().acting(x, supply, *parts[1:])[3]) - (spring * x + damping * v)
    generator = ca.CodeGenerator("plant_step.c")
    generator.add(step("plant_open", time * v, open_))
    generator.add(step("plant_shut", time * v, shut))
    generator.add(step("plant_held", 0, 0))
    force, dp_MPa, flow, _ = equations().acting(position, supply, *parts[1:])
    acting = [named.PER_KG * force, dp_MPa, flow]
    generator.add(ca.Function("plant_acting", [position, supply, p], acting))
    names = ", ".join(f"PLANT_{name}" for name in NAMED)
    return f"enum {{ {names} }};\n{generator.dump()}"
