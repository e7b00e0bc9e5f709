"""The plant of Eqs. (19)-(24), with what a real valve's measurements need.

Added to the paper's equations, each of them off where its parameter is zero: preload, overlap, stops, a pressure force
that moves the threshold, flow force, a play in the magnetic force (hysteresis), droop of the supply.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from msgspec import Meta

from dzdesign.core.artefact_files import read_bytes
from dzdesign.core.artefact_types import quantity
from dzdesign.core.errors import InputError, nearest, quoted
from dzdesign.core.toml_documents import read_toml

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

    @property
    def fastest_rad_s(self) -> float:
        """Rate of the spool's fastest free motion: against spring and flow force, or against its damping."""
        stiffest = self.K_et_N_m + self.flow_force_N_mm_MPa * 1e3 * LARGEST_DP_MPA
        return max(math.sqrt(stiffest / self.m_e_kg), self.B_e_N_s_m / self.m_e_kg)

    @property
    def coil_rad_s(self) -> float:
        """Rate at which the current settles, by Eqs. (19)-(21)."""
        return (self.K_a * self.K_fi_V_A + self.R_c_ohm + self.r_p_ohm) / self.L_c_H

    @property
    def force_per_volt(self) -> float:
        """Force per volt of command at rest, N/V, by Eqs. (19)-(22)."""
        return self.K_i_N_A * self.K_a / (self.R_c_ohm + self.r_p_ohm + self.K_a * self.K_fi_V_A)


def read_plant(path: Path, say: Callable[[str], None] = lambda _: None) -> Plant:
    """Read a plant from a TOML file; an unknown key is refused, with the nearest known one.

    `say` receives a message about the parameters that keep the default plant's values.
    """
    values = read_parameters(path, "plant file")
    try:
        plant = Plant(**values)
    except InputError as error:
        raise InputError(f"'{path}': {error}") from error
    missing = [field.name for field in fields(Plant) if field.name not in values]
    if missing:
        say(f"'{path}' leaves {', '.join(missing)} as the default plant has them")
    return plant


def read_parameters(path: Path, what: str, others: Sequence[str] = ()) -> dict[str, Any]:
    """Read TOML whose keys are parameters of `Plant`, or `others`; of any other the `InputError` names the nearest."""
    content = read_bytes(path, what)
    values = read_toml(content, str(path), "lines such as K_a = 4.0")
    known = [*(field.name for field in fields(Plant)), *others]
    for key in values:
        if key not in known:
            raise InputError(f"'{path}': there is no plant parameter {quoted(key)}{nearest(key[:LONGEST_KEY], known)}")
    return values


def opening_of(plant: Plant, position: Any) -> Any:
    """Return how far the edge is open, m."""
    import casadi as ca

    past = past_edge(plant, position)
    return ca.if_else(past > 0, past, 0)  # fmax would be a call of the C library


def past_edge(plant: Plant, position: Any) -> Any:
    """Return how far the spool is past the edge, m; below zero where that is shut."""
    return position - plant.overlap_mm * 1e-3


def derivatives(
    plant: Plant, opening_at: Callable[[Plant, Any], Any] = opening_of
) -> tuple["casadi.SX", "casadi.SX", "casadi.SX"]:
    """Return state, inputs and their derivatives of Eqs. (19)-(24), lowered from SymPy to CasADi, free of the stops.

    The state is (i in A, x_e in m, v in m/s); the inputs are (amplifier voltage in V, force offset of the play in N,
    supply pressure drop in MPa). With `past_edge` as its opening the equations of the open edge go smoothly on beyond.
    """
    import casadi as ca

    from dzdesign.derivation import plant as equations
    from dzdesign.derivation.lowering import lower

    state, inputs = ca.SX.sym("state", 3), ca.SX.sym("inputs", 3)
    current, position, speed = (state[index] for index in range(3))
    voltage, play_force, supply = (inputs[index] for index in range(3))
    opening = opening_at(plant, position)
    dp_MPa, _ = orifice(plant, opening, supply)
    load = (
        plant.preload_N
        - plant.pressure_force_N_MPa * dp_MPa
        + plant.flow_force_N_mm_MPa * 1e3 * dp_MPa * opening
        - play_force
    )
    parameters = (
        plant.K_a, plant.K_fi_V_A, plant.K_i_N_A, plant.R_c_ohm, plant.r_p_ohm, plant.L_c_H, plant.m_e_kg,
        plant.B_e_N_s_m, plant.K_et_N_m,
    )  # fmt: skip
    names = (*equations.STATE, *equations.INPUTS, *equations.PARAMETERS)
    lowered = lower(list(equations.state_derivatives()), names)
    return state, inputs, ca.vertcat(*lowered(current, position, speed, voltage, load, *parameters))


def orifice(plant: Plant, opening_m: Any, supply_MPa: Any) -> tuple[Any, Any]:
    """Return pressure drop (MPa) and flow (L/min) across the edge, the supply's droop solved for in closed form.

    Eq. (24) is Q = G sqrt(dP); with dP = supply - droop Q^2 that gives dP = supply / (1 + droop G^2).
    """
    import casadi as ca

    from dzdesign.derivation import plant as equations
    from dzdesign.derivation.lowering import lower

    flow = lower(equations.flow(), (equations.STATE[1], *equations.FLOW_PARAMETERS), {"sqrt": ca.sqrt})
    # L/min at 1 MPa; Eq. (24) is linear in the opening, and of one metre it is a number.
    conductance = opening_m * (flow(1.0, 1.0, plant.C_d_W_mm * 1e-3, plant.rho_kg_m3, MPA) / L_MIN)
    dp_MPa = supply_MPa / (1 + plant.droop_MPa_L_min2 * conductance**2)
    return dp_MPa, conductance * ca.sqrt(dp_MPa)
