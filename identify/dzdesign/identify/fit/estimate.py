"""The estimate of a side: both branches' curves over the pressure drop, and their drift, in one CasADi problem.

    minimise  sum (y - f - d clock)² / (tau² + s²)  over both branches,  f in the class,  closing below opening,

a quadratic programme. Its curves are what the data say, each at its most likely; the bounds are the certificate's.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.fit.curve_class import CurveClass
from dzdesign.identify.fit.ramp_model import broken_line
from dzdesign.identify.fit.scatter import Scatter

if TYPE_CHECKING:
    import casadi as ca

logger = logging.getLogger(__name__)
#: Held while a solver is built or used: one that is kept serves all threads, and CasADi does not expect two at once.
SOLVER_LOCK = Lock()
#: Weights of what the data leave open: bends between the tests, V/MPa² and a drift that the order does not tell.
STRAIGHT, NO_DRIFT = 1e-6, 1e-9
#: Layouts whose solvers are kept.
KEPT = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class SideEstimate:
    """Curves of the branches on the class's grid, V (N,), in the order that they were given in."""

    grid_MPa: np.ndarray
    curves: tuple[np.ndarray, ...]
    #: Change over the series, V; 0 where the order of the ramps does not tell it.
    drift_V: tuple[float, ...]


def estimate_side(branches: Sequence[Scatter], curves: CurveClass) -> SideEstimate:
    """Estimate the curves of the closing branch and, behind it, of the opening one.

    Raises
    ------
    InputError
        If the solver does not converge.
    """
    import casadi as ca

    grid = curves.grid_MPa
    base = float(np.mean(branches[0].model.ramps.y))
    a, low, high = curves.rows()
    cost, lower, upper = [], [], []
    for scatter in branches:
        ramps = scatter.model.ramps
        clock = ramps.clock if scatter.model.drift and ramps.clock is not None else np.zeros(ramps.y.size)
        design = np.column_stack([broken_line(ramps.dp_MPa, grid), clock])
        weight = 1e-6 / scatter.of_ramps
        cost.append((design.T @ (weight[:, None] * design), design.T @ (weight * 1e3 * (ramps.y - base))))
        lower.append(1e3 * low)
        upper.append(1e3 * high)
    if len(branches) > 1:
        lower.append(np.zeros(grid.size))
        upper.append(np.full(grid.size, np.inf))
    with SOLVER_LOCK:
        solver = _solver(len(branches), grid.size, len(a))
        known = [np.concatenate([part.ravel("F") for part in (*each,)]) for each in cost]
        bends = _bends(grid)
        solved = solver(
            p=np.concatenate([*known, a.ravel("F"), bends.ravel("F")]), lbg=np.concatenate(lower),
            ubg=np.concatenate(upper),
        )  # fmt: skip
        outcome = solver.stats()
        found = np.asarray(ca.DM(solved["x"])).ravel().reshape(len(branches), -1)
    logger.debug("curves: %s, %.3f s", outcome["unified_return_status"], outcome.get("t_wall_total", 0.0))
    if not outcome["success"]:
        raise InputError(
            f"the curves of the side could not be fitted ({outcome['unified_return_status']}); look at the ramp tests, "
            "and leave out the one that is unlike the others"
        )
    return SideEstimate(
        grid_MPa=grid,
        curves=tuple(base + row[:-1] / 1e3 for row in found),
        drift_V=tuple(float(row[-1]) / 1e3 for row in found),
    )


def covariance_of_curve(scatter: Scatter, dp_MPa: np.ndarray, *, straight: bool) -> np.ndarray:
    """Return the covariance of a branch's curve at pressure drops (T,), V² (T, T), by what each ramp weighs there.

    Of a `straight` curve that is the line's weights, else those of the knots.
    """
    model = scatter.model
    knots = model.knots_MPa[[0, -1]] if straight and model.knots_MPa.size > 1 else model.knots_MPa
    weights = model.weigh(model.with_clock(broken_line(model.ramps.dp_MPa, knots)))[: knots.size]
    at = broken_line(dp_MPa, knots) @ weights
    found: np.ndarray = (at * scatter.of_ramps) @ at.T
    return found


def _bends(grid_MPa: np.ndarray) -> np.ndarray:
    """Return the second differences (N - 2, N) on the grid; none of fewer than three points."""
    if grid_MPa.size < 3:
        return np.zeros((0, grid_MPa.size))
    return np.diff(np.diff(np.eye(grid_MPa.size), axis=0) / np.diff(grid_MPa)[:, None], axis=0)


@lru_cache(maxsize=KEPT)
def _solver(branches: int, points: int, rows: int) -> "ca.Function":
    """Return the solver of one layout: per branch the curve on the grid, mV from a common zero, and the drift."""
    import casadi as ca

    unknown = ca.MX.sym("unknown", points + 1, branches)
    squares = [ca.MX.sym(f"squares_{each}", points + 1, points + 1) for each in range(branches)]
    sums = [ca.MX.sym(f"sums_{each}", points + 1) for each in range(branches)]
    a, bends = ca.MX.sym("a", rows, points), ca.MX.sym("bends", max(points - 2, 0), points)
    cost, constraints = ca.MX(0), list[ca.MX]()
    for each in range(branches):
        x = unknown[:, each]
        cost += ca.dot(x, squares[each] @ x) / 2 - ca.dot(sums[each], x) + NO_DRIFT * x[points] ** 2 / 2
        if points > 2:
            bend = bends @ x[:points]
            cost += STRAIGHT * ca.dot(bend, bend) / 2
        if rows:
            constraints.append(a @ x[:points])
    if branches > 1:
        constraints.append(unknown[:points, 1] - unknown[:points, 0])
    known = [part for pair in zip(squares, sums, strict=True) for part in pair]
    problem: dict[str, ca.MX] = {
        "x": ca.vec(unknown),
        "p": ca.veccat(*known, a, bends),
        "f": cost,
        "g": ca.vertcat(*constraints) if constraints else ca.MX(0, 1),
    }
    return ca.qpsol("curves", "daqp", problem, {"print_time": False, "error_on_fail": False})
