"""The plant's motion over a period of the PWM: CasADi functions for any plant, and the numbers of one plant for them.

Eqs. (19)-(23) are linear but for one acceleration that depends on the spool's position: pressure and flow force. The
linear part is solved exactly, by matrix exponentials that are tabulated over the duty; the acceleration is interpolated
through its values at the start, the middle and the end of the period, which makes an exponential Runge-Kutta step. The
pulse makes a ripple that such a parabola does not follow; so the middle value is taken where the step is exact of an
acceleration that is straight in the position (`balanced` of period_maps.py), and not at the position in the middle.
Where a stop is met or the edge passed within the period, plant_period.h takes it apart and follows `plant_path` from
one to the other.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from dzdesign.verify.closed_loop.period_maps import BALANCE_TERMS, FINE, MAP, balanced, period_map, response_tables
from dzdesign.verify.closed_loop.plant import PWM_PERIOD_S, Plant, derivatives, opening_of, orifice, past_edge

if TYPE_CHECKING:
    import casadi

#: Position to acceleration, both expressions of CasADi.
Acceleration = Callable[[Any], Any]
#: Radians of the fastest motion in a step: what the Taylor series leaves out is below 1e-12 of it.
STEP_RAD = 0.6
ORDER = 12
#: Change of the acceleration that its interpolation does not explain, as a share of the spring's at full stroke, beyond
#: which the period is taken apart.
JUMP_SHARE = 1e-4
#: Numbers of a plant that plant_period.h reads by name, in SI units where none stands.
NAMED = (
    "STROKE_M", "HALF_PLAY_V", "VOLTS_PER_CHARGE", "U_MAX_V", "PERIOD_S", "DECAY", "DRIVE", "PER_SETTLED",
    "PULL", "SPRING", "DAMPING", "PUSH", "OVERLAP_M", "REACH_M", "STEPS", "LINEAR", "JUMP",
    *(f"BALANCE_{term}" for term in range(BALANCE_TERMS)),
)  # fmt: skip


class Equations(NamedTuple):
    """The plant's equations with every parameter a symbol."""

    #: plant -> d rates / d state (3, 3), d rates / d inputs (3, 3), where no pressure acts.
    linear: "casadi.Function"
    #: plant -> what of `nonlinear` depends on the parameters only.
    extracted: "casadi.Function"
    #: (x, supply, plant, extracted) -> acceleration beyond the linear part, m/s²; dP, MPa; Q, L/min; acceleration
    #: of an open edge, continued where it is shut.
    nonlinear: "casadi.Function"


@cache
def equations() -> Equations:
    """Return Eqs. (19)-(24) parted into what is linear and what is not."""
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
    # Without the spring, which is in the linear part; of a mass of 1 kg it is the force, which saves a division.
    beside = [ca.vertcat(0, x, 0), ca.vertcat(0, 0, supply), ca.SX(0), ca.SX(1)]
    parts = [(rates, state, inputs), (open_rates, *same)]
    forces = [ca.substitute([r[2]], [s, u, plant.K_et_N_m, plant.m_e_kg], beside)[0] for r, s, u in parts]
    shut, open_ = (force * (1 / plant.m_e_kg) for force in forces)
    acting = ca.vertcat(shut, *orifice(plant, opening_of(plant, x), supply), open_)
    remaining, found, extracted = ca.extract_parametric(acting, symbols)
    return Equations(
        ca.Function("linear", [symbols], [by_state, by_input]),
        ca.Function("extracted", [symbols], [ca.vertcat(*extracted)]),
        ca.Function("nonlinear", [x, supply, symbols, ca.vertcat(*found)], ca.vertsplit(remaining)),
    )


@dataclass(frozen=True, slots=True)
class Numbers:
    """One plant as plant_period.h takes it."""

    #: `NAMED`, `MAP`, the parameters, and what `Equations.extracted` makes of them.
    flat: np.ndarray
    #: (G, 4): current, position, speed and charge that full voltage makes, from rest, in 0, 1, ... times `FINE` half
    #: counts of the compare value.
    coarse: np.ndarray
    #: (FINE, 12): the same in 0, 1, ... half counts, after the first eight entries of `MAP` for that time, which are
    #: what it does to a state that is there already.
    fine: np.ndarray
    #: The spool's stiffness over its mass, 1/s², of its spring and of its flow force per MPa; the rate of all that
    #: moves faster than these, rad/s.
    stiffness: tuple[float, float]
    beside_rad_s: float

    def up_to(self, dp_MPa: float) -> np.ndarray:
        """Return `flat` with no more steps in a period than pressure drops up to this one need."""
        spring, per_MPa = self.stiffness
        fastest = max(self.beside_rad_s, math.sqrt(spring + per_MPa * dp_MPa))
        flat = self.flat.copy()
        flat[NAMED.index("STEPS")] = max(math.ceil(fastest * PWM_PERIOD_S / STEP_RAD), 1)
        return flat

    def driven(self, ratio: float) -> "Numbers":
        """Return those of the same plant whose PWM has so many times the voltage when it is on."""
        flat, fine = self.flat.copy(), self.fine.copy()
        for name, power in (("U_MAX_V", 1), ("PER_SETTLED", -1), ("REACH_M", 1)):
            flat[NAMED.index(name)] *= ratio**power
        flat[NAMED.index("BALANCE_0") :][:BALANCE_TERMS] *= ratio
        fine[:, 8:] *= ratio
        return replace(self, flat=flat, coarse=self.coarse * ratio, fine=fine)


def numbers_of(plant: Plant, compare_max: int) -> Numbers:
    """Return the numbers of one plant, for a PWM of so many counts."""
    parameters = np.array([getattr(plant, field.name) for field in fields(Plant)], dtype=float)
    by_state, by_input = (np.array(part) for part in equations().linear(parameters))
    rates, drive = np.zeros((4, 4)), np.zeros(4)
    rates[:3, :3], rates[3, 0], drive[:3] = by_state, 1.0, plant.u_max_V * by_input[:, 0]
    fastest = max(plant.fastest_rad_s, float(np.abs(np.linalg.eigvals(by_state)).max()))
    steps = max(math.ceil(fastest * PWM_PERIOD_S / STEP_RAD), 1)
    linear = plant.flow_force_N_mm_MPa == 0 and plant.droop_MPa_L_min2 == 0
    stroke = plant.stroke_mm * 1e-3
    named = (
        stroke, plant.hysteresis_V / 2, plant.K_i_N_A / plant.force_per_volt / PWM_PERIOD_S, plant.u_max_V,
        PWM_PERIOD_S, -by_state[0, 0], by_input[0, 0], -by_state[0, 0] / drive[0],
        by_state[2, 0], -by_state[2, 1], -by_state[2, 2], by_input[2, 1] * plant.force_per_volt,
        plant.overlap_mm * 1e-3, by_state[2, 0] * drive[0] / -by_state[0, 0] * PWM_PERIOD_S**2, steps, linear,
        JUMP_SHARE * -by_state[2, 1] * stroke,
    )  # fmt: skip
    extracted = np.array(equations().extracted(parameters)).ravel()
    entries, series = period_map(rates), np.zeros(BALANCE_TERMS)
    if not linear:
        entries, series = balanced(rates, drive, entries)
    flat = np.concatenate([named, series, entries, parameters, extracted])
    stiffness = plant.K_et_N_m / plant.m_e_kg, plant.flow_force_N_mm_MPa * 1e3 / plant.m_e_kg
    beside_rad_s = max(plant.B_e_N_s_m / plant.m_e_kg, float(np.abs(np.linalg.eigvals(by_state)).max()))
    return Numbers(flat, *response_tables(rates, drive, 2 * compare_max), stiffness, beside_rad_s)


@cache
def motion_header() -> str:
    """Return the C code of the functions that plant_period.h calls; the same for every plant.

    ``plant_step(i, x, v, response[5], acts, push, supply_MPa, p) -> (i, x, v, charge, middle, acts, excess)``
        moves over a period that touches neither a stop nor the edge. `response`: what the voltage adds to current,
        position, speed, charge and the middle's position; `push`: the play's acceleration; `acts`: what else depends on
        nothing but the position, at the start and at the end; `excess`: how far it departs from a straight line.
    ``plant_step_linear(i, x, v, response[5], acts, push, p) -> (i, x, v, charge, middle)``
        does where `acts` is constant.
    ``plant_path(state[3], voltage, h, push, supply_MPa, p) -> (i, x, v, charge)[ORDER + 1]``
        gives the path past the edge over any short time h as powers of the share of it that has passed.
    ``plant_path_linear(state[3], voltage, h, acts, push, p) -> (i, x, v, charge)[ORDER + 1]``
        does where `acts` is constant.
    ``plant_acting(x, supply_MPa, p) -> (acts in m/s², dp_MPa, Q_L_min)``

    p: `Numbers.flat`.
    """
    import casadi as ca

    parameters = len(fields(Plant))
    extracted = equations().extracted.size1_out(0)
    p = ca.SX.sym("p", len(NAMED) + len(MAP) + parameters + extracted)
    parts = ca.vertsplit(p, list(np.cumsum([0, len(NAMED), len(MAP), parameters, extracted])))
    named = SimpleNamespace(**dict(zip(NAMED, ca.vertsplit(parts[0]), strict=True)))
    through = SimpleNamespace(**dict(zip(MAP, ca.vertsplit(parts[1]), strict=True)))
    i, x, v, voltage, h, push, supply, acts = (
        ca.SX.sym(name) for name in ("i", "x", "v", "voltage", "h", "push", "supply", "acts")
    )
    response, state = ca.SX.sym("response", 5), ca.SX.sym("state", 3)

    def acting(position: Any) -> Any:
        return equations().nonlinear(position, supply, *parts[2:])

    def acceleration(position: Any) -> Any:
        return acting(position)[0] + push

    def acceleration_past_edge(position: Any) -> Any:
        return acting(position)[3] + push

    whole, fixed = [i, x, v, response, acts, push], acts + push
    generator = ca.CodeGenerator("plant_motion.c")
    for name, inputs, outputs in (
        ("plant_step", [*whole, supply, p], _step(through, (i, x, v), response, fixed, acceleration)),
        ("plant_step_linear", [*whole, p], _step(through, (i, x, v), response, fixed, lambda _: fixed)[:5]),
        ("plant_path", [state, voltage, h, push, supply, p], _path(named, state, voltage, h, acceleration_past_edge)),
        ("plant_path_linear", [state, voltage, h, acts, push, p], _straight_path(named, state, voltage, h, fixed)),
        ("plant_acting", [x, supply, p], acting(x)[:3]),
    ):
        generator.add(ca.Function(name, inputs, outputs))
    names = ", ".join(f"PLANT_{name.upper()}" for name in (*NAMED, *MAP))
    sizes = f"#define PLANT_TERMS {ORDER + 1}\n#define PLANT_FINE {FINE}\n#define BALANCE_TERMS {BALANCE_TERMS}\n"
    return f"enum {{ {names} }};\n{sizes}{generator.dump()}"


def _step(
    through: SimpleNamespace, state: tuple[Any, Any, Any], response: Any, start: Any, acceleration: Acceleration
) -> list[Any]:
    """Return what `plant_step` does, accelerations with the play's."""
    i, x, v = state
    middle = through.mid_i * i + through.mid_x * x + through.mid_v * v + response[4]
    middle += through.mid_start * start
    at_middle = acceleration(middle)
    free_x = through.x_i * i + through.x_x * x + through.x_v * v + response[1]
    free_v = through.v_i * i + through.v_x * x + through.v_v * v + response[2]
    # An acceleration that runs straight on from the start through the middle.
    at_end = acceleration(free_x + through.ahead_start * start + through.ahead_slope * (at_middle - start))
    return [
        through.i_i * i + response[0],
        free_x + through.x_start * start + through.x_mid * at_middle + through.x_end * at_end,
        free_v + through.v_start * start + through.v_mid * at_middle + through.v_end * at_end,
        through.q_i * i + response[3],
        middle,
        at_end,
        at_middle - (start + at_end) / 2,
    ]


def _straight_path(named: SimpleNamespace, state: Any, voltage: Any, h: Any, acceleration: Any) -> list[Any]:
    """Return the path at a constant voltage and acceleration as powers of the share of h: Taylor's series."""
    import casadi as ca

    terms = _taylor(named, ca.vertsplit(state), voltage, h, (acceleration,))
    return [ca.vertcat(*part) for part in zip(*terms, strict=True)]


def _path(named: SimpleNamespace, state: Any, voltage: Any, h: Any, acceleration: Acceleration) -> list[Any]:
    """Return the path at a constant voltage as powers of the share of h: the same step, its linear part by Taylor."""
    import casadi as ca

    start = acceleration(state[1])
    free = list(_taylor(named, ca.vertsplit(state), voltage, h, (start,)))
    # What an acceleration of s/h and one of (s/h)^2 add.
    slope, curve = (list(_taylor(named, (0, 0, 0), 0, h, unit)) for unit in ((0, 1), (0, 0, 1)))
    at_middle = acceleration(sum(term[1] / 2**order for order, term in enumerate(free)))
    ahead = sum(term[1] + 2 * (at_middle - start) * more[1] for term, more in zip(free, slope, strict=True))
    at_end = acceleration(ahead)
    first, second = -3 * start + 4 * at_middle - at_end, 2 * start - 4 * at_middle + 2 * at_end
    terms = [
        [base + first * one + second * two for base, one, two in zip(*parts, strict=True)]
        for parts in zip(free, slope, curve, strict=True)
    ]
    return [ca.vertcat(*part) for part in zip(*terms, strict=True)]


def _taylor(
    named: SimpleNamespace, state: Sequence[Any], voltage: Any, h: Any, acceleration: tuple[Any, ...]
) -> Iterator[list[Any]]:
    """Yield the terms of current, position, speed and charge after h, under an acceleration sum a_j (s/h)^j."""
    term = [*state, 0]
    yield term
    for order in range(ORDER):
        i, x, v, _ = term
        driven = (named.DRIVE * voltage if order == 0 else 0) - named.DECAY * i
        pulled = named.PULL * i - named.SPRING * x - named.DAMPING * v
        pulled += acceleration[order] if order < len(acceleration) else 0
        term = [h / (order + 1) * rate for rate in (driven, v, pulled, i)]
        yield term
