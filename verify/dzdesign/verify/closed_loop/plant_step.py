"""The plant's step: CasADi's Runge-Kutta step of Eqs. (19)-(23), as C for any plant, and the numbers of one plant.

A step is taken in one of three states of the spool: open and shut on either side of the metering edge, where the
equations are smooth, and held at a stop, where only the current goes on. plant.h shortens a step to where it meets a
stop or the edge, or where the current lets go of a stop: what a step of the fourth order leaves is then its own error,
and not that of a kink.
"""

import math
from dataclasses import dataclass, fields, replace
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant, derivatives, opening_of, orifice, past_edge

if TYPE_CHECKING:
    import casadi

#: In a step the spool moves by so many radians of its fastest motion at most, and the coil by so many of its own, whose
#: error the spool feels for a shorter time. An undamped spool keeps what a step is off by: so many times shorter steps,
#: below so much damping, as a share of that at which it no longer swings.
SPOOL_RAD, COIL_RAD = 0.1, 0.12
UNDAMPED, SHORTER = 0.02, 4.0
#: Numbers of a plant that plant.h and the step read by name, in SI units where none stands.
NAMED = (
    "STROKE_M", "OVERLAP_M", "HALF_PLAY_V", "VOLTS_PER_CHARGE", "U_MAX_V", "PERIOD_S", "FULL_A", "PUSH", "STEPS_PER_S",
    "LINEAR", "DECAY", "DRIVE", "PULL", "SPRING", "DAMPING", "PER_KG",
)  # fmt: skip


class Equations(NamedTuple):
    """The plant's equations with every parameter a symbol."""

    #: plant -> d rates / d state (3, 3), d rates / d inputs (3, 3), where no pressure acts.
    linear: "casadi.Function"
    #: plant -> what of `acting` depends on the parameters only.
    extracted: "casadi.Function"
    #: (x, supply, plant, extracted) -> force beyond the linear part, N; dP, MPa; Q, L/min; force of an open edge,
    #: continued where it is shut.
    acting: "casadi.Function"


@cache
def equations() -> Equations:
    """Return Eqs. (19)-(24) parted into what is linear and what depends on the spool's position."""
    import casadi as ca

    names = [field.name for field in fields(Plant)]
    symbols = ca.SX.sym("plant", len(names))
    # Not a `Plant`, whose parameters are checked to be numbers, but with the same names.
    plant = cast(Plant, SimpleNamespace(**dict(zip(names, ca.vertsplit(symbols), strict=True))))
    state, inputs, rates = derivatives(plant)
    *same, open_rates = derivatives(plant, past_edge)
    nothing = [ca.SX.zeros(3), ca.SX.zeros(3)]
    jacobians = [ca.jacobian(rates, state), ca.jacobian(rates, inputs)]
    by_state, by_input = ca.substitute(jacobians, [state, inputs], nothing)
    x, supply = ca.SX.sym("x"), ca.SX.sym("supply")
    # Without the spring, which is in the linear part; the acceleration of a mass of 1 kg is the force.
    beside = [ca.vertcat(0, x, 0), ca.vertcat(0, 0, supply), ca.SX(0), ca.SX(1)]
    parts = [(rates, state, inputs), (open_rates, *same)]
    either, open_ = (ca.substitute([r[2]], [s, u, plant.K_et_N_m, plant.m_e_kg], beside)[0] for r, s, u in parts)
    acting = ca.vertcat(either, *orifice(plant, opening_of(plant, x), supply), open_)
    remaining, found, extracted = ca.extract_parametric(acting, symbols)
    return Equations(
        ca.Function("linear", [symbols], [by_state, by_input]),
        ca.Function("extracted", [symbols], [ca.vertcat(*extracted)]),
        ca.Function("acting", [x, supply, symbols, ca.vertcat(*found)], ca.vertsplit(remaining)),
    )


@dataclass(frozen=True, slots=True)
class Numbers:
    """One plant as plant.h takes it."""

    #: `NAMED`, the parameters, and what `Equations.extracted` makes of them.
    flat: np.ndarray
    #: The stiffness of the flow force over the spool's mass, 1/s² per MPa.
    flow_stiffness: float

    def step_s(self, dp_MPa: float) -> float:
        """Return the longest step up to a pressure drop, s: it follows from the plant's fastest time constant."""
        spring, damping, decay = (float(self.flat[NAMED.index(name)]) for name in ("SPRING", "DAMPING", "DECAY"))
        swings_rad_s = math.sqrt(spring + self.flow_stiffness * dp_MPa)
        spool_s = SPOOL_RAD / max(swings_rad_s, damping)
        return min(spool_s / SHORTER if damping < 2 * UNDAMPED * swings_rad_s else spool_s, COIL_RAD / decay)

    def up_to(self, dp_MPa: float) -> np.ndarray:
        """Return `flat` with the steps of runs up to a pressure drop."""
        flat = self.flat.copy()
        flat[NAMED.index("STEPS_PER_S")] = 1 / self.step_s(dp_MPa)
        return flat

    def driven(self, ratio: float) -> "Numbers":
        """Return those of the same plant whose PWM, or whose coil's control, drives it so many times as much."""
        flat = self.flat.copy()
        flat[[NAMED.index("U_MAX_V"), NAMED.index("FULL_A")]] *= ratio
        return replace(self, flat=flat)


def numbers_of(plant: Plant) -> Numbers:
    """Return the numbers of one plant."""
    parameters = np.array([getattr(plant, field.name) for field in fields(Plant)], dtype=float)
    by_state, by_input = (np.array(part) for part in equations().linear(parameters))
    decay, drive = -by_state[0, 0], by_input[0, 0]
    linear = plant.flow_force_N_mm_MPa == 0 and plant.droop_MPa_L_min2 == 0
    named = (
        plant.stroke_mm * 1e-3, plant.overlap_mm * 1e-3, plant.hysteresis_V / 2,
        plant.K_i_N_A / plant.force_per_volt / PWM_PERIOD_S, plant.u_max_V, PWM_PERIOD_S, drive * plant.u_max_V / decay,
        by_input[2, 1] * plant.force_per_volt, 0.0, linear, decay, drive, by_state[2, 0], -by_state[2, 1],
        -by_state[2, 2], 1 / plant.m_e_kg,
    )  # fmt: skip
    extracted = np.array(equations().extracted(parameters)).ravel()
    flow_stiffness = plant.flow_force_N_mm_MPa * 1e3 / plant.m_e_kg
    return Numbers(np.concatenate([named, parameters, extracted]), flow_stiffness)


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

    p: `Numbers.flat`.
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
