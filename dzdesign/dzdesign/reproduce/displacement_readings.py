"""Fig. 6: whether a valve of Eqs. (19)-(24) can have its figures within their printed digits, in either reading."""

from functools import cache

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.derivation.account.published import DP0_MPA, DP1_MPA, SIMULATION, U_MAX_V
from dzdesign.reproduce.recovered_valves import (
    OF_READING,
    RECOVERED,
    SOLVER,
    AtRest,
    Printed,
    Reading,
    printed_at,
    recover_simulated,
)

DISPLACEMENT, DISPLACEMENT_DEAD_ZONE = "largest displacement", "spool's dead zone"


def half_digits_off(reading: Reading, quantity: str, dp_MPa: float) -> float:
    """Return how many half digits a valve misses at best that has one number of the displacement, its numbers at the
    reference, and all of the flow. Above 1 there is no such valve.
    """
    beside = (f"{what} at {DP1_MPA} MPa" for what in (DISPLACEMENT, DISPLACEMENT_DEAD_ZONE))
    return least_misfit(reading, tuple(name for name in beside if name != f"{quantity} at {dp_MPa:g} MPa"))


@cache
def least_misfit(reading: Reading, without: tuple[str, ...] = ()) -> float:
    """Return the fewest half digits within which a valve has all of Fig. 6, but the figures `without`, at once.

    Up to 1 such a valve exists. The largest of the misfits is made as small as it can be, a problem that IPOPT solves
    from the valve that the fit found.
    """
    import casadi as ca

    start = recover_simulated(reading).plant
    free = (*OF_READING["preload"], "overlap_mm")  # in either: an overlap of any size beside any preload
    scale = np.array([RECOVERED[name][0] for name in free])
    scaled, largest = ca.SX.sym("parameters", len(free)), ca.SX.sym("largest")
    values = {name: getattr(start, name) for name in start.__dataclass_fields__}
    values |= {name: scaled[index] * scale[index] for index, name in enumerate(free)}
    used = [each for each in _figures(values, reading) if each.name not in without]
    middle, half = np.array([each.middle_and_half for each in used]).T
    misfit = (ca.vertcat(*(each.at_rest for each in used)) - middle) / half
    problem = {"x": ca.vertcat(scaled, largest), "f": largest, "g": ca.vertcat(largest - misfit, largest + misfit)}
    solver = ca.nlpsol("least_misfit", "ipopt", problem, dict(SOLVER) | {"ipopt.max_iter": 500})
    first = np.append([getattr(start, name) for name in free] / scale, 50.0)
    least = np.append(np.array([1e-3 if name in ("C_d_W_mm", "K_et_N_m") else 0.0 for name in free]), 0.0)
    found = solver(x0=first, lbx=least, lbg=0.0)
    if not solver.stats()["success"]:
        status = solver.stats()["return_status"]
        raise RequirementError(f"the reading of Fig. 6 with {reading} was not decided: {status}")
    return float(found["f"])


def _figures(values: dict[str, object], reading: Reading) -> list[Printed]:
    """Return all that Fig. 6 prints, for the plant at rest."""
    figures = []
    for dp_MPa in (DP0_MPA, DP1_MPA):
        rest, printed, at = AtRest(values, dp_MPa), printed_at(SIMULATION, dp_MPa), f"at {dp_MPa} MPa"
        travel = rest.position_mm(U_MAX_V)
        dead = rest.moves_V / U_MAX_V if reading == "preload" else values["overlap_mm"] / travel
        largest = rest.flow_per_volt * (U_MAX_V - rest.opens_V)
        figures += [
            Printed(f"dead zone {at}", "%", printed.dead_zone_percent, 100 * rest.opens_V / U_MAX_V),
            Printed(f"largest flow {at}", "L/min", printed.flow, largest),
            Printed(f"{DISPLACEMENT} {at}", "mm", printed.stroke_mm, travel),
            Printed(f"{DISPLACEMENT_DEAD_ZONE} {at}", "%", printed.displacement_dead_zone_percent, 100 * dead),
        ]
    return figures
