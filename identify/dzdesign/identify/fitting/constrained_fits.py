"""The joint fit in CasADi: knees and slopes of all ramp tests, each a line through its branch's straight part."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.fitting.casadi_problems import SOLVER_LOCK, branch_numbers, solver_with_numbers
from dzdesign.identify.knees.branch_shape import BranchShape

if TYPE_CHECKING:
    import casadi as ca

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class KneeFit:
    """Result of the joint fit; arrays (T, 2), columns rising and falling (NaN where a branch is missing)."""

    #: Knees in V and their standard errors, coloured noise counted.
    knee: np.ndarray
    knee_se: np.ndarray
    #: At the nominal pressure drop, m³/(s V).
    slope: np.ndarray


def fit_knees(
    shapes: Sequence[tuple[BranchShape | None, BranchShape | None]],
    *,
    floor: float,
    u_max: float,
) -> KneeFit:
    """Fit knees and slopes of all ramp tests.

    Model, per test and branch: ``y = slope (u - knee)`` inside the knee window, y being the flow brought to the nominal
    pressure drop. A reading below the meter's `floor` (m³/s) enters by its probability (a Tobit term), not as a zero.
    The tests come in the order of rising pressure drop, each with its rising and its falling branch.

    Raises
    ------
    InputError
        If the solver does not converge.
    """
    placed = [(row, column, shape) for row, pair in enumerate(shapes) for column, shape in enumerate(pair) if shape]
    branches = [shape for _, _, shape in placed]
    scales = [expected_errors(shape) for shape in branches]
    numbers = [branch_numbers(shape, scale, floor, u_max) for shape, scale in zip(branches, scales, strict=True)]
    with SOLVER_LOCK:
        solver, known = solver_with_numbers(numbers)
        solution = solver(x0=np.zeros(2 * len(placed)), p=known)
        outcome = solver.stats()
        best = np.asarray(solution["x"]).ravel()
        hessian = hessian_of_cost(solver, best, known)
    _log("knees", outcome)
    if not outcome["success"]:
        raise InputError(
            f"the joint fit did not converge ({outcome['return_status']}); "
            "look at the ramp tests, and leave out the one that is unlike the others"
        )
    variance = np.diag(np.linalg.inv(hessian))
    knee, knee_se, slope = (np.full((len(shapes), 2), np.nan) for _ in range(3))
    for index, ((row, column, shape), (slope_scale, knee_scale)) in enumerate(zip(placed, scales, strict=True)):
        last = len(placed) + index
        knee[row, column] = shape.knee + best[last] * knee_scale
        knee_se[row, column] = np.sqrt(variance[last] * shape.variance_inflation) * knee_scale
        slope[row, column] = (1 + best[index] * slope_scale) * shape.slope
    return KneeFit(knee=knee, knee_se=knee_se, slope=slope)


def _log(name: str, outcome: Mapping[str, Any]) -> None:
    count, status = outcome.get("iter_count", -1), outcome["return_status"]
    status = status if isinstance(status, str) else f"solver's status {status}"
    steps = f" after {count} iterations" if count >= 0 else ""  # of an active-set method -1
    logger.debug("%s: %s%s, %.3f s", name, status, steps, outcome.get("t_wall_total", 0.0))


def hessian_of_cost(solver: "ca.Function", at: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return the second derivatives of a solver's objective, which it has for its own steps: the upper triangle."""
    import casadi as ca

    constraints = solver.size1_out("g")
    upper = np.asarray(ca.DM(solver.get_function("nlp_hess_l")(at, known, 1, np.zeros(constraints))))
    return upper + np.triu(upper, 1).T


def expected_errors(shape: BranchShape) -> tuple[float, float]:
    """Return rough standard errors of slope (relative) and knee (V): in their units the fit is well scaled."""
    n = max(float(shape.bins.n.sum()), 1.0)
    knee = shape.sigma / (shape.slope * np.sqrt(n))
    return knee * shape.slope / shape.y_max, knee
