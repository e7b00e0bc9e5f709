"""The constrained fits in CasADi: knees and slopes of all ramp tests jointly; the offset curve under its bounds."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import worded
from dzdesign.identify.fitting.casadi_problems import SOLVER_LOCK, branch_numbers, offset_solver, solver_with_numbers
from dzdesign.identify.knees.branch_shape import BranchShape
from dzdesign.identify.valve.staircase import Direction

if TYPE_CHECKING:
    import casadi as ca

logger = logging.getLogger(__name__)

#: A constraint is active when its slack is below this share of u_max.
ACTIVE = 1e-7
#: No test outweighs another by more than this, however quiet its meter was.
LARGEST_WEIGHT = 1e4


@dataclass(frozen=True, slots=True, kw_only=True)
class KneeFit:
    """Result of the joint fit; arrays (T, 2), columns rising and falling (NaN where a branch is missing)."""

    #: Knees in V and their standard errors, coloured noise counted.
    knee: np.ndarray
    knee_se: np.ndarray
    #: At the nominal pressure drop, m³/(s V).
    slope: np.ndarray
    #: The monotonicity constraints that hold with equality.
    active: tuple[str, ...]

    def with_other_branch(self, fit: "KneeFit", column: int) -> "KneeFit":
        """Return this fit with the numbers of one branch (0 rising, 1 falling) from another fit."""
        knee, knee_se, slope = self.knee.copy(), self.knee_se.copy(), self.slope.copy()
        for own, other in ((knee, fit.knee), (knee_se, fit.knee_se), (slope, fit.slope)):
            own[:, column] = other[:, column]
        return replace(self, knee=knee, knee_se=knee_se, slope=slope)


def fit_knees(
    shapes: Sequence[tuple[BranchShape | None, BranchShape | None]],
    *,
    floor: float,
    u_max: float,
    trend: Direction,
    ordered: int = 1,
) -> KneeFit:
    """Fit knees and slopes of all ramp tests jointly, the knees monotone in the pressure drop.

    Model, per test and branch: ``y = slope (u - knee)`` inside the knee window, y being the flow brought to the nominal
    pressure drop. A reading below the meter's `floor` (m³/s) enters by its probability (a Tobit term), not as a zero.
    The tests come in the order of rising pressure drop, each with its rising and its falling branch. The knees of the
    branch `ordered` (0 rising, 1 falling) must run the way of the trend, of which "flat" leaves them free; those of the
    other branch may run otherwise.

    Raises
    ------
    InputError
        If the solver does not converge.
    """
    placed = [(row, column, shape) for row, pair in enumerate(shapes) for column, shape in enumerate(pair) if shape]
    branches = [shape for _, _, shape in placed]
    scales = [expected_errors(shape) for shape in branches]
    numbers = [branch_numbers(shape, scale, floor, u_max) for shape, scale in zip(branches, scales, strict=True)]
    chain = tuple(index for index, (_, column, _) in enumerate(placed) if column == ordered and trend != "flat")
    order = _order_knees(branches, scales, chain if len(chain) > 1 else (), increasing=trend == "increasing")
    with SOLVER_LOCK:
        solver, known = solver_with_numbers(numbers, order.chain, order.steps)
        solution = solver(x0=order.start, p=known, lbg=0.0, ubg=np.inf)
        outcome = solver.stats()
        best, slack = np.asarray(solution["x"]).ravel(), np.asarray(solution["g"]).ravel() * order.unit
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
    return KneeFit(
        knee=knee,
        knee_se=knee_se,
        slope=slope,
        active=tuple(
            f"{'falling' if ordered else 'rising'} knee of test {placed[index][0] + 1} to {placed[following][0] + 1}"
            for (index, following), gap in zip(pairwise(order.chain), slack, strict=True)
            if gap < ACTIVE * u_max
        ),
    )


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


@dataclass(frozen=True, slots=True)
class _Order:
    """Which knees must run one way; as `solver_with_numbers` takes it.

    `chain` has their branches, `start` the unknowns (2B,) at which they do. Per step of the chain `unit` is in V what
    its distance is measured in, and `steps` (S, 3) that distance where the lines have their zeros and by how much the
    next knee and the one before add to it.
    """

    chain: tuple[int, ...]
    start: np.ndarray
    unit: np.ndarray
    steps: np.ndarray


def _order_knees(
    shapes: list[BranchShape], scales: list[tuple[float, float]], chain: tuple[int, ...], *, increasing: bool
) -> _Order:
    start = np.zeros(2 * len(shapes))
    if not chain:
        return _Order(chain, start, np.zeros(0), np.zeros((0, 3)))
    chained, slots = [shapes[index] for index in chain], np.array(chain)
    slope_scale, knee_scale = np.array([scales[index] for index in chain]).T
    steeper, later = _ordered_start(chained, increasing=increasing)
    start[slots], start[len(shapes) + slots] = steeper / slope_scale, later / knee_scale
    unit = np.maximum(knee_scale[1:], knee_scale[:-1])  # a standard error, of the worse of the two
    steps = np.array([np.diff([shape.knee for shape in chained]), knee_scale[1:], -knee_scale[:-1]]) / unit
    return _Order(chain, start, unit, (steps if increasing else -steps).T)


def _ordered_start(shapes: list[BranchShape], *, increasing: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return relative changes of slopes, and changes of knees in V, after which the knees run one way.

    The zeros of the lines are brought in order by their errors, and each line is turned about its new zero. From a
    start that breaks the order by thousands of standard errors, as a quiet meter gives it, IPOPT finds no way back and
    reports an infeasible problem.
    """
    from scipy.optimize import isotonic_regression

    weights = []
    for shape in shapes:
        bins, centre = shape.bins, np.average(shape.bins.u, weights=shape.bins.n)
        spread = np.sum(bins.n * (bins.u - centre) ** 2 + bins.c_uu)
        lever = 1 / bins.n.sum() + (centre - shape.knee) ** 2 / spread
        weights.append((shape.slope / shape.sigma) ** 2 / lever)
    knees = np.array([shape.knee for shape in shapes])
    ordered = isotonic_regression(knees, weights=weights, increasing=increasing).x
    steeper = []
    for shape, knee in zip(shapes, ordered, strict=True):
        bins = shape.bins
        rise = np.sum(bins.n * bins.y * (bins.u - knee) + bins.c_uy)
        steeper.append(rise / np.sum(bins.n * (bins.u - knee) ** 2 + bins.c_uu) / shape.slope - 1)
    return np.array(steeper), ordered - knees


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetFit:
    """The law's offset over the pressure drop: u_min0 in V, beta (T,) at the tests, and the active bounds (T,) bool."""

    u_min0: float
    beta: np.ndarray
    active: np.ndarray


def fit_offset(
    guard: np.ndarray, guard_se: np.ndarray, ceiling: np.ndarray, reference: int, *, u_max: float, trend: str
) -> OffsetFit:
    """Fit u_min0 and beta(dP) so that beta u_min0 is as near to the guarded thresholds as its bounds allow.

    The weights are the information of the joint fit about each threshold, so this is that fit's likelihood to second
    order, with the other parameters at their best. beta is monotone, 1 at the reference (Eqs. 5, 7), and
    ``beta u_min0 <= ceiling`` at every node; between nodes the chord lies under the ceiling because `ceiling[i]`
    already is the lower of the bounds on both sides (see `staircase`). The thresholds, their standard errors and the
    ceilings are (T,), in V, in the order of rising pressure drop; `reference` is the index of the test at dP0. A trend
    that is "flat" makes beta 1 everywhere.

    Raises
    ------
    InputError
        If no positive offset meets the bounds.
    """
    if ceiling.min() <= 0:
        raise InputError(
            worded(
                "the threshold's lower bound is {bound:.3f V}, not above zero: no dead zone can be compensated without "
                "opening the valve at zero command; check the ramp tests and the meter's zero",
                bound=ceiling.min(),
            )
        )
    lowest = float(ceiling.min())
    largest = max(float(guard_se.max()), np.finfo(float).tiny)  # an exact table has no errors
    weight = (largest / np.maximum(guard_se, largest / np.sqrt(LARGEST_WEIGHT))) ** 2
    known = np.concatenate([(guard - lowest) * 1e3, (ceiling - lowest) * 1e3, weight / weight.max()])
    low, high = {"decreasing": (-np.inf, 0.0), "increasing": (0.0, np.inf), "flat": (0.0, 0.0)}[trend]
    with SOLVER_LOCK:
        solver = offset_solver(guard.size)
        solution = solver(p=known, lbx=0.0, lbg=low, ubg=high)
        outcome = solver.stats()
        slack = np.maximum(np.asarray(solution["x"]).ravel(), 0.0) / 1e3
    _log("offset", outcome)
    found = ceiling - slack
    wrong_way = {"decreasing": np.diff(found), "increasing": -np.diff(found), "flat": np.abs(np.diff(found))}[trend]
    if not outcome["success"] or np.any(wrong_way > 2 * ACTIVE * u_max):
        raise InputError(
            f"beta(dP) could not be fitted under its bounds ({outcome['unified_return_status']}); "
            "check that the ramp tests belong to one valve"
        )
    return OffsetFit(u_min0=float(found[reference]), beta=found / found[reference], active=slack < ACTIVE * u_max)
