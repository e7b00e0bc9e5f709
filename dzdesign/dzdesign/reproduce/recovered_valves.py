"""The valves of the paper: plant parameters recovered from the figures that it prints.

Table 1 is an image, so its values are not in the text. What the text prints of a valve without compensator (dead zones
and largest flows at both pressure drops; of the simulated one also how far its spool moves at the reference) determines
its parameters at rest, as many figures as parameters; all else that is printed is then a prediction. Nothing printed
determines the dynamics, nor the scale of the forces: both are those of the default plant. The paper shows no closing
branch and, but for its words, no stop: neither is recovered.
"""

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass, fields, replace
from functools import cache
from typing import NamedTuple

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.derivation import plant as equations
from dzdesign.derivation.account.published import (
    DP0_MPA,
    DP1_MPA,
    FIRST,
    METER_FLOOR_L_MIN,
    SECOND,
    SIMULATION,
    U_MAX_V,
    PublishedValve,
)
from dzdesign.derivation.lowering import lower
from dzdesign.reproduce.artefact import Parameter
from dzdesign.reproduce.law_numbers import half_digit
from dzdesign.verify.closed_loop.plant import L_MIN, MPA, Plant

#: At least this much overlap, mm: less than what the ripple of the PWM, which the paper's simulation lacks, would
#: open at zero command.
LEAST_OVERLAP_MM = 0.005
#: Where the meter of section 4.1 starts: at this flow dead zones are read, those of the simulation too.
METER_START_L_MIN = float(METER_FLOOR_L_MIN)
#: Of a valve without a visible stop: no displacement comes near it.
NO_STOP_MM = 10.0
#: Digits of the recovered parameters: more than the print determines, fewer than a machine's last bits reach.
DIGITS = 7
#: The spring follows from the simulated valve's displacement; the tested ones are "identical" (section 2.1).
FROM_DISPLACEMENT = "K_et_N_m"
NOT_PRINTED = ("hysteresis_V", "droop_MPa_L_min2", "stroke_mm", "overlap_mm")


class PrintedAt(NamedTuple):
    """What the paper prints of a valve at one pressure drop, as printed; empty where it prints nothing."""

    dead_zone_percent: str
    flow: str
    flow_with: str
    stroke_mm: str
    displacement_dead_zone_percent: str


def printed_at(valve: PublishedValve, dp_MPa: float) -> PrintedAt:
    """Return what is printed of a valve at the reference dP0, or at dP1."""
    at = "0" if dp_MPa == DP0_MPA else "1"
    names = (f"dead_zone{at}_percent", f"flow{at}", f"flow{at}_with", f"stroke{at}_mm")
    return PrintedAt(*(getattr(valve, name) for name in (*names, f"displacement_dead_zone{at}_percent")))


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveredValve:
    """A valve of the paper as a plant."""

    published: PublishedValve
    plant: Plant
    #: Recovered parameter -> by how much it may be off for the rounding of the printed figures; the plant's other
    #: parameters are the default plant's or of another valve.
    rounding: Mapping[str, float]

    def parameters(self) -> dict[str, Parameter]:
        """Return the parameters of the plant, each marked as recovered or not."""
        return {
            name: Parameter(value=value, origin=self._origin(name), rounding=self.rounding.get(name))
            for name, value in zip((field.name for field in fields(Plant)), astuple(self.plant), strict=True)
        }

    def _origin(self, name: str) -> str:
        if name in self.rounding:
            return "from the printed figures"
        if name == FROM_DISPLACEMENT:
            return f"of the {SIMULATION.name}"
        return "assumed: none is printed" if name in NOT_PRINTED else "default plant"


@cache
def recover_valves() -> tuple[RecoveredValve, ...]:
    """Recover the simulated valve, then both tested ones with its spring and its edge."""
    base = Plant(
        u_max_V=float(U_MAX_V), hysteresis_V=0.0, droop_MPa_L_min2=0.0, stroke_mm=NO_STOP_MM,
        overlap_mm=LEAST_OVERLAP_MM,
    )  # fmt: skip
    simulated = recover(SIMULATION, base)
    return (simulated, *(recover(valve, simulated.plant) for valve in (FIRST, SECOND)))


def recover(valve: PublishedValve, base: Plant) -> RecoveredValve:
    """Find the parameters of a valve that have its printed figures; no valve may have them: a `RequirementError`."""
    texts = [text for dp_MPa in (DP0_MPA, DP1_MPA) for text in printed_at(valve, dp_MPa)[:2]]
    texts += [valve.stroke0_mm] if valve.stroke0_mm else []
    figures, halves = np.array(list(map(float, texts))), np.diag(list(map(half_digit, texts)))
    found = _solved(figures, base)
    if impossible := [name for name, value in found.items() if value < 0]:
        raise RequirementError(
            f"the {valve.name} can't be recovered: {impossible[0]} would be {found[impossible[0]]:.3g}, less than none"
        )
    # Every figure off by its half digit, all in the worst direction.
    moved = [[_solved(figures + sign * each, base) for sign in (1, -1)] for each in halves]
    rounding = {name: sum(abs(more[name] - less[name]) / 2 for more, less in moved) for name in found}
    return RecoveredValve(
        published=valve,
        plant=replace(base, **{name: float(f"{value:.{DIGITS}g}") for name, value in found.items()}),
        rounding={name: float(f"{value:.2g}") for name, value in rounding.items()},
    )


def _solved(figures: np.ndarray, base: Plant) -> dict[str, float]:
    """Return the parameters at rest that have dead zone (%) and largest flow at dP0 and dP1, and a stroke at dP0, mm.

    `AtRest` solved for them: opening command and flow per volt follow from each pair of figures, and in these the
    equations are linear.
    """
    dp = np.array([DP0_MPA, DP1_MPA], dtype=float)
    seen, largest = figures[:4:2] / 100 * U_MAX_V, figures[1:4:2]
    per_volt = (largest - METER_START_L_MIN) / (U_MAX_V - seen)
    opens = U_MAX_V - largest / per_volt
    rest = [AtRest(replace(base, C_d_W_mm=1.0), each) for each in dp]
    newtons, edge = rest[0].newtons_per_volt, np.array([each.flow_per_mm for each in rest])
    # per_volt (K_et + flow_force dP) = C_d W edge newtons, and by Eq. (23) the stroke (K_et + flow_force dP0).
    rows, right = np.column_stack([per_volt, per_volt * dp, -edge * newtons]), np.zeros(2)
    spring = (1.0, 0.0, 0.0), 1e-3 * base.K_et_N_m
    if figures.size > 4:
        spring = (1.0, dp[0], 0.0), newtons * (U_MAX_V - opens[0]) / (figures[4] - base.overlap_mm)
    stiffness, flow_force, width = np.linalg.solve(np.vstack([rows, spring[0]]), np.append(right, spring[1]))
    load = newtons * opens - stiffness * base.overlap_mm  # preload - pressure_force dP
    pressure_force = (load[0] - load[1]) / (dp[1] - dp[0])
    found = {
        "preload_N": load[0] + pressure_force * dp[0], "pressure_force_N_MPa": pressure_force,
        "flow_force_N_mm_MPa": flow_force, "C_d_W_mm": width,
    }  # fmt: skip
    return found | ({FROM_DISPLACEMENT: 1e3 * stiffness} if figures.size > 4 else {})


class AtRest:
    """The plant at rest at one pressure drop, Eqs. (19)-(24) with d/dt = 0, beyond its edge; without droop and play.

    `moves_V` and `opens_V` are the commands from which the spool moves and the edge is open, `flow_per_volt` L/min per
    V beyond the edge.
    """

    def __init__(self, plant: Plant, dp_MPa: float) -> None:
        values = {field.name: getattr(plant, field.name) for field in fields(Plant)}
        current = lower(equations.steady_state_current(), (equations.INPUTS[0], *equations.PARAMETERS))
        electrical = ("K_a", "K_fi_V_A", "K_i_N_A", "R_c_ohm", "r_p_ohm", "L_c_H", "m_e_kg", "B_e_N_s_m", "K_et_N_m")
        # Eqs. (19)-(22)
        self.newtons_per_volt = float(plant.K_i_N_A * current(1.0, *(values[name] for name in electrical)))
        stiffness = plant.K_et_N_m * 1e-3  # N/mm
        # Eq. (23) at rest: K_i i = K_et x + f_eL, the flow force in f_eL growing with the opening.
        load = plant.preload_N - plant.pressure_force_N_MPa * dp_MPa
        self._mm_per_volt = self.newtons_per_volt / (stiffness + plant.flow_force_N_mm_MPa * dp_MPa)
        self._overlap_mm = plant.overlap_mm
        self.moves_V = load / self.newtons_per_volt
        self.opens_V = (load + stiffness * plant.overlap_mm) / self.newtons_per_volt
        flow = lower(equations.flow(), (equations.STATE[1], *equations.FLOW_PARAMETERS), {"sqrt": math.sqrt})
        self.flow_per_mm = float(flow(1e-3, 1.0, plant.C_d_W_mm * 1e-3, plant.rho_kg_m3, dp_MPa * MPA) / L_MIN)
        self.flow_per_volt = self.flow_per_mm * self._mm_per_volt  # Eq. (24)

    def position_mm(self, u_V: float) -> float:
        """Return the displacement at a command beyond the edge, mm."""
        return self._overlap_mm + self._mm_per_volt * (u_V - self.opens_V)

    def flow_L_min(self, u_V: np.ndarray) -> np.ndarray:
        """Return the flow at commands of one sign."""
        return self.flow_per_volt * np.maximum(u_V - self.opens_V, 0.0)
