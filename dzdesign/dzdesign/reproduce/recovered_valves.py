"""The valves of the paper: plant parameters recovered by a constrained fit from the figures that it prints.

Table 1 is an image, so its values are not in the text. What the text prints of a valve without compensator (dead zones
and largest flows at both pressure drops; of the simulated one also how far its spool moves at the reference; of the
first one where its flow stops growing there) determines its parameters at rest, as many figures as parameters; all
else that is printed is then a prediction. Nothing printed determines the dynamics, nor the scale of the forces: both
are those of the default plant. The paper shows no closing branch: no hysteresis is recovered.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.derivation.account.published import (
    DP0_MPA,
    DP1_MPA,
    FIRST,
    METER_FLOOR_L_MIN,
    SATURATED_FROM_V,
    SECOND,
    SIMULATION,
    U_MAX_V,
    PublishedValve,
)
from dzdesign.reproduce.artefact import FittedFigure, Parameter
from dzdesign.verify.closed_loop.plant import L_MIN, MPA, Plant

if TYPE_CHECKING:
    import casadi

#: At least this much overlap, mm: less than what the ripple of the PWM, which the paper's simulation lacks, would
#: open at zero command.
LEAST_OVERLAP_MM = 0.005
#: Of a valve without a visible stop: no displacement comes near it.
NO_STOP_MM = 10.0
#: Digits of the recovered parameters: more than any solver's tolerance, so that the same fit gives the same bytes.
DIGITS = 7
#: A parameter as close as this to its bound, over its scale, is held by it.
AT_BOUND = 1e-6
#: Half digits by which a fit may miss a figure: there are as many parameters as figures.
LARGEST_MISFIT = 1e-3
#: Parameter -> size to scale it by, least value.
RECOVERED: Mapping[str, tuple[float, float]] = {
    "preload_N": (30.0, 0.0),
    "pressure_force_N_MPa": (0.3, 0.0),
    "flow_force_N_mm_MPa": (1.5, 0.0),
    "C_d_W_mm": (3.0, 1e-3),
    "K_et_N_m": (15000.0, 100.0),
    "overlap_mm": (0.5, LEAST_OVERLAP_MM),
    "stroke_mm": (2.0, 2 * LEAST_OVERLAP_MM),
}
SILENT: Mapping[str, int | str] = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False}
SOLVER: Mapping[str, int | float | str] = {**SILENT, "ipopt.tol": 1e-12, "ipopt.bound_relax_factor": 0.0}
#: What the displacement's dead zone of Fig. 6 is a share of: with overlap the travel that opens nothing, of the largest
#: displacement (T6e of the derivation); with preload the command that moves nothing, of full command. The flow, and so
#: all else that is printed, is the same in both; the valves that are run have preload, the other is taken at rest.
Reading = Literal["overlap", "preload"]
#: Parameters of the simulated valve in each reading.
OF_READING: Mapping[Reading, tuple[str, ...]] = {
    "overlap": tuple(name for name in RECOVERED if name != "stroke_mm"),
    "preload": tuple(name for name in RECOVERED if name not in ("stroke_mm", "overlap_mm")),
}
#: What only the simulated valve's displacement tells; the tested ones are "identical" (section 2.1), so they take it.
FROM_DISPLACEMENT = ("K_et_N_m", "overlap_mm")
OF_TESTED = tuple(name for name in OF_READING["preload"] if name not in FROM_DISPLACEMENT)
STOPPED = "first valve with a stop"
NOT_PRINTED = ("hysteresis_V", "droop_MPa_L_min2", "stroke_mm")


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


class Printed(NamedTuple):
    """A printed figure: what it is, its unit, as printed, and what the plant at rest has for it, in its parameters."""

    name: str
    unit: str
    published: str
    at_rest: "casadi.SX"

    @property
    def middle_and_half(self) -> tuple[float, float]:
        """The number and half a unit of its last digit; of a printed range its middle and half its width."""
        low, _, high = self.published.partition("-")
        if high:
            return (float(low) + float(high)) / 2, (float(high) - float(low)) / 2
        return float(low), half_digit(low)


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoveredValve:
    """A valve of the paper as a plant."""

    published: PublishedValve
    plant: Plant
    #: Recovered parameter -> by how much it may be off for the rounding of the printed figures; the plant's other
    #: parameters are the default plant's or of another valve.
    rounding: Mapping[str, float]
    #: What went into the fit.
    figures: tuple[FittedFigure, ...]
    #: Parameters that a bound of the fit holds.
    at_bound: tuple[str, ...]
    #: Flow from which the paper sees flow: its meter's floor, zero in its simulation.
    level_L_min: float

    def parameters(self) -> dict[str, Parameter]:
        """Return the parameters of the plant, each marked as recovered or not."""
        return {
            name: Parameter(
                value=getattr(self.plant, name), recovered=name in self.rounding, origin=self._origin(name),
                rounding=self.rounding.get(name),
            )
            for name in (field.name for field in fields(Plant))
        }  # fmt: skip

    def with_hysteresis(self, hysteresis_V: float) -> "RecoveredValve":
        """Return the valve with an assumed play of its magnetic force; opening, it behaves as without."""
        # A rising force lags by half the play: so much less preload opens the edge at the same command.
        preload_N = self.plant.preload_N - self.plant.force_per_volt * hysteresis_V / 2
        return replace(self, plant=replace(self.plant, hysteresis_V=hysteresis_V, preload_N=preload_N))

    def _origin(self, name: str) -> str:
        if name == "hysteresis_V" and self.plant.hysteresis_V:
            return "assumed: no closing branch is printed"
        if name in self.rounding:
            return "fit to the printed figures" + (", held by its bound" if name in self.at_bound else "")
        if name in FROM_DISPLACEMENT:
            return f"of the {SIMULATION.name}'s fit"
        return "assumed: none is printed" if name in NOT_PRINTED else "default plant"


def half_digit(published: str) -> float:
    """Return half a unit of the last printed digit.

    Examples
    --------
    >>> half_digit("53.5"), half_digit("15")
    (0.05, 0.5)
    """
    return 0.5 * 10.0 ** -len(published.partition(".")[2])


@cache
def recover_valves() -> tuple[RecoveredValve, ...]:
    """Recover the simulated valve, then both tested ones with its spring and its edge."""
    tested = (_recover(valve, _spring_and_edge(), OF_TESTED, float(METER_FLOOR_L_MIN)) for valve in (FIRST, SECOND))
    return (recover_simulated("preload"), *tested)


@cache
def recover_stopped() -> RecoveredValve:
    """Recover the first valve with a stop that the spool meets at the reference, where the paper sees saturation."""
    stopped = replace(FIRST, name=STOPPED, zero_flow_without_beta="")
    saturated = "-".join(SATURATED_FROM_V)
    return _recover(stopped, _spring_and_edge(), (*OF_TESTED, "stroke_mm"), float(METER_FLOOR_L_MIN), saturated)


def _spring_and_edge() -> Plant:
    return recover_simulated("preload").plant


@cache
def recover_simulated(reading: Reading) -> RecoveredValve:
    """Recover the simulated valve in one reading of its displacement's dead zone."""
    base = Plant(
        u_max_V=float(U_MAX_V), hysteresis_V=0.0, droop_MPa_L_min2=0.0, stroke_mm=NO_STOP_MM,
        overlap_mm=LEAST_OVERLAP_MM,
    )  # fmt: skip
    return _recover(SIMULATION, base, OF_READING[reading], 0.0)


def _recover(
    valve: PublishedValve, base: Plant, free: tuple[str, ...], level_L_min: float, saturated: str = ""
) -> RecoveredValve:
    """Find the free parameters of a base plant from the printed figures: a least-squares problem with bounds, solved
    by IPOPT; of a valve with a stop `saturated` says from which commands on it is met, as printed.
    """
    import casadi as ca

    scale, least = (np.array([RECOVERED[name][column] for name in free]) for column in (0, 1))
    scaled = ca.SX.sym("parameters", len(free))
    values = {field.name: getattr(base, field.name) for field in fields(Plant)}
    values |= {name: scaled[index] * scale[index] for index, name in enumerate(free)}
    printed = _printed_at_rest(valve, values, level_L_min, "overlap_mm" in free, saturated)
    middle, half = np.array([each.middle_and_half for each in printed]).T
    fitted = ca.vertcat(*(each.at_rest for each in printed))
    misfit = (fitted - middle) / half
    solver = ca.nlpsol("recover", "ipopt", {"x": scaled, "f": ca.sumsqr(misfit)}, dict(SOLVER))
    solution = np.asarray(solver(x0=np.maximum(1.0, 2 * least / scale), lbx=least / scale)["x"]).ravel()
    held = solution - least / scale < AT_BOUND
    solution[held] = (least / scale)[held]
    evaluate = ca.Function("fitted", [scaled], [fitted, misfit, ca.jacobian(misfit, scaled)])
    at, misfits, slopes = (np.asarray(value) for value in evaluate(solution))
    if not solver.stats()["success"] or np.abs(misfits).max() > LARGEST_MISFIT:
        raise RequirementError(
            f"the parameters of the {valve.name} can't be recovered: its figures are missed by up to "
            f"{np.abs(misfits).max():.3g} half digits ({solver.stats()['return_status']})"
        )
    spread = np.zeros(len(free))  # every figure off by its half digit, all in the worst direction
    spread[~held] = np.abs(np.linalg.pinv(slopes[:, ~held])).sum(axis=1)
    return RecoveredValve(
        published=valve,
        plant=replace(base, **_with_digits(free, solution * scale, DIGITS)),
        rounding=_with_digits(free, spread * scale, 2),
        figures=tuple(
            FittedFigure(name=each.name, unit=each.unit, published=each.published, fitted=round(float(value), 6),
                         misfit=round(float(miss), 4))
            for each, value, miss in zip(printed, at.ravel(), misfits.ravel(), strict=True)
        ),
        at_bound=tuple(name for name, bound in zip(free, held, strict=True) if bound),
        level_L_min=level_L_min,
    )  # fmt: skip


def _with_digits(names: tuple[str, ...], values: np.ndarray, digits: int) -> dict[str, float]:
    return {name: float(f"{value:.{digits}g}") for name, value in zip(names, values, strict=True)}


def _printed_at_rest(
    valve: PublishedValve, values: Mapping[str, Any], level_L_min: float, with_overlap: bool, saturated: str
) -> list[Printed]:
    """Return every figure that the fit uses, for the plant at rest."""
    printed = []
    for dp_MPa in (DP0_MPA, DP1_MPA):
        rest, figures, at = AtRest(values, dp_MPa), printed_at(valve, dp_MPa), f"at {dp_MPa} MPa"
        seen_V = rest.opens_V + level_L_min / rest.flow_per_volt
        stopped = bool(saturated) and dp_MPa == DP0_MPA
        largest = rest.flow_per_volt * ((rest.stops_V if stopped else U_MAX_V) - rest.opens_V)
        printed.append(Printed(f"dead zone {at}", "%", figures.dead_zone_percent, 100 * seen_V / U_MAX_V))
        printed.append(Printed(f"largest flow {at}", "L/min", figures.flow, largest))
        if stopped:
            offset_V = float(figures.dead_zone_percent) / 100 * U_MAX_V
            command_V = (rest.stops_V - offset_V) / (1 - offset_V / U_MAX_V)  # Eq. (14), k x_max = u_max - u_min0
            printed.append(Printed(f"largest flow with, reached {at}", "V", saturated, command_V))
    if valve.stroke0_mm:
        rest, at = AtRest(values, DP0_MPA), f"at {DP0_MPA} MPa"
        travel = rest.position_mm(U_MAX_V)
        printed.append(Printed(f"displacement {at}", "mm", valve.stroke0_mm, travel))
        if with_overlap:
            share, dead = valve.displacement_dead_zone0_percent, 100 * values["overlap_mm"] / travel
            printed.append(Printed(f"spool's dead zone {at}", "%", share, dead))
    return printed


class AtRest:
    """The plant at rest at one pressure drop, Eqs. (19)-(24) with d/dt = 0, between its edge and its stop.

    `values` are parameters by the names of `Plant`, numbers or CasADi expressions; so are `moves_V`, `opens_V` and
    `stops_V`, the commands from which the spool moves, the edge is open and the stop is met, and `flow_per_volt`,
    L/min per V beyond the edge.
    """

    def __init__(self, values: Mapping[str, Any], dp_MPa: float) -> None:
        import casadi as ca

        from dzdesign.derivation import plant as equations
        from dzdesign.derivation.lowering import lower

        current = lower(equations.steady_state_current(), (equations.INPUTS[0], *equations.PARAMETERS))
        electrical = ("K_a", "K_fi_V_A", "K_i_N_A", "R_c_ohm", "r_p_ohm", "L_c_H", "m_e_kg", "B_e_N_s_m", "K_et_N_m")
        amperes_per_volt = current(1.0, *(values[name] for name in electrical))  # Eqs. (19)-(21)
        newtons_per_volt = values["K_i_N_A"] * amperes_per_volt  # Eq. (22)
        stiffness = values["K_et_N_m"] * 1e-3  # N/mm
        # Eq. (23) at rest: K_i i = K_et x + f_eL, the flow force in f_eL growing with the opening.
        load = values["preload_N"] - values["pressure_force_N_MPa"] * dp_MPa
        stiffness_open = stiffness + values["flow_force_N_mm_MPa"] * dp_MPa
        self._mm_per_volt = newtons_per_volt / stiffness_open
        self._overlap_mm = values["overlap_mm"]
        self.moves_V = load / newtons_per_volt
        self.opens_V = (load + stiffness * values["overlap_mm"]) / newtons_per_volt
        self.stops_V = self.opens_V + (values["stroke_mm"] - values["overlap_mm"]) / self._mm_per_volt
        flow = lower(equations.flow(), (equations.STATE[1], *equations.FLOW_PARAMETERS), {"sqrt": ca.sqrt})
        per_mm = flow(1e-3, 1.0, values["C_d_W_mm"] * 1e-3, values["rho_kg_m3"], dp_MPa * MPA) / L_MIN  # Eq. (24)
        self.flow_per_volt = per_mm * self._mm_per_volt

    def position_mm(self, u_V: float) -> Any:
        """Return the displacement at a command beyond the edge, mm."""
        return self._overlap_mm + self._mm_per_volt * (u_V - self.opens_V)


def at_rest(plant: Plant, dp_MPa: float) -> AtRest:
    """Return a plant at rest, as numbers; the supply's droop and the play must be none."""
    return AtRest({field.name: getattr(plant, field.name) for field in fields(Plant)}, dp_MPa)
