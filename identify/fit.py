"""The constrained fits in CasADi: knees and slopes of all ramp tests jointly; the offset curve under its bounds."""

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.characteristic import BranchShape

if TYPE_CHECKING:
    import casadi as ca

logger = logging.getLogger(__name__)

#: A constraint is active when its slack is below this share of u_max.
ACTIVE = 1e-7
#: Unknowns and constraints are in standard errors, so nothing is left to scale. Bounds are not relaxed, or knees would
#: run the wrong way. Slack times multiplier is met as tightly as the rest: IPOPT's own 1e-4 leaves knees 1e-5 V off.
IPOPT = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.max_iter": 300,
    "ipopt.tol": 1e-10,
    "ipopt.compl_inf_tol": 1e-10,
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.nlp_scaling_method": "none",
}
#: For a convex problem of a few unknowns in mV: to a millionth of a microvolt, and no bound overstepped.
EXACT = {"ipopt.tol": 1e-12, "ipopt.bound_relax_factor": 0.0, "ipopt.mu_strategy": "adaptive"}
#: Standard deviations from which the normal distribution's tail is a continued fraction, exact to 1e-13 with this many
#: terms.
TAIL_FROM, TAIL_TERMS = 3.0, 30
#: No test outweighs another by more than this, however quiet its meter was.
LARGEST_WEIGHT = 1e4


@dataclass(frozen=True, slots=True, kw_only=True)
class KneeFit:
    """Result of the joint fit; one row a test, columns rising and falling (NaN where a branch is missing).

    Attributes
    ----------
    knee, knee_se : (T, 2) array
        Knees in V and their standard errors (coloured noise counted).
    slope : (T, 2) array
        Slopes at the nominal pressure drop, m³/(s V).
    active : tuple of str
        The monotonicity constraints that hold with equality.
    iterations : int
        Of the solver.
    """

    knee: np.ndarray
    knee_se: np.ndarray
    slope: np.ndarray
    active: tuple[str, ...]
    iterations: int


def fit_knees(
    shapes: list[tuple[BranchShape | None, BranchShape | None]],
    *,
    floor: float,
    u_max: float,
    trend: str,
    ordered: int = 1,
) -> KneeFit:
    """Fit knees and slopes of all ramp tests jointly, the knees monotone in the pressure drop.

    Model, per test and branch: ``y = slope (u - knee)`` inside the knee window, y being the flow brought to the nominal
    pressure drop. A reading below the meter's floor enters by its probability (a Tobit term), not as a zero.

    Parameters
    ----------
    shapes : list of pairs
        Rising and falling branch of each test, in the order of rising pressure drop.
    floor : float
        Meter floor, m³/s.
    u_max : float
        Full command, V.
    trend : {"decreasing", "increasing", "flat"}
        Direction in which the knees must run; "flat" leaves them free.
    ordered : int
        Column of the branch whose knees must run that way (1: falling); the other branch may run otherwise.

    Raises
    ------
    InputError
        If the solver does not converge.
    """
    import casadi as ca

    where = [(row, column) for row, pair in enumerate(shapes) for column, shape in enumerate(pair) if shape]
    position = {place: index for index, place in enumerate(where)}
    slopes, knees = ca.SX.sym("slope", len(where)), ca.SX.sym("knee", len(where))
    scales = [_expected_errors(shapes[row][column]) for row, column in where]
    cost = 0
    for (row, column), index in position.items():
        steeper, later = slopes[index] * scales[index][0], knees[index] * scales[index][1] / u_max
        cost += _branch_cost(shapes[row][column], steeper, later, floor, u_max)
    # Those whose knees must run one way, and in standard errors how far each lies from the next.
    chain = [index for place, index in position.items() if place[1] == ordered and trend != "flat"]
    start, order, unit = np.zeros(2 * len(where)), ca.SX(0, 1), np.zeros(0)
    if len(chain) > 1:
        mine = [shapes[where[index][0]][ordered] for index in chain]
        slope_scale, knee_scale = np.array([scales[index] for index in chain]).T
        steeper, later = _ordered_start(mine, increasing=trend == "increasing")
        start[chain], start[len(where) + np.array(chain)] = steeper / slope_scale, later / knee_scale
        unit = np.maximum(knee_scale[1:], knee_scale[:-1])
        order = ca.DM(np.diff([shape.knee for shape in mine]) / unit)
        order += ca.DM(knee_scale[1:] / unit) * knees[chain[1:]] - ca.DM(knee_scale[:-1] / unit) * knees[chain[:-1]]
        order = order if trend == "increasing" else -order
    variables = ca.vertcat(slopes, knees)
    solver = ca.nlpsol("knees", "ipopt", {"x": variables, "f": cost, "g": order}, IPOPT)
    solution = solver(x0=start, lbg=0.0, ubg=ca.inf)
    _log("knees", solver.stats())
    if not solver.stats()["success"]:
        raise InputError(
            f"the joint fit did not converge ({solver.stats()['return_status']}); "
            "look at the ramp tests, and leave out the one that is unlike the others"
        )
    best, slack = np.asarray(solution["x"]).ravel(), np.asarray(solution["g"]).ravel() * unit
    hessian = _hessian_of_cost(solver, best)
    variance = np.diag(np.linalg.inv(hessian))
    knee, knee_se, slope = (np.full((len(shapes), 2), np.nan) for _ in range(3))
    for (row, column), index in position.items():
        shape, (slope_scale, knee_scale) = shapes[row][column], scales[index]
        last = len(where) + index
        knee[row, column] = shape.knee + best[last] * knee_scale
        knee_se[row, column] = np.sqrt(variance[last] * shape.colour) * knee_scale
        slope[row, column] = (1 + best[index] * slope_scale) * shape.slope
    return KneeFit(
        knee=knee,
        knee_se=knee_se,
        slope=slope,
        active=tuple(
            f"{'falling' if ordered else 'rising'} knee of test {where[index][0] + 1} to {where[following][0] + 1}"
            for (index, following), gap in zip(pairwise(chain), slack, strict=True)
            if gap < ACTIVE * u_max
        ),
        iterations=int(solver.stats()["iter_count"]),
    )


def _log(name: str, said: Mapping[str, Any]) -> None:
    status, seconds = said["return_status"], said.get("t_wall_total", 0.0)
    logger.debug("%s: %s after %d iterations, %.3f s", name, status, said.get("iter_count", 0), seconds)


def _hessian_of_cost(solver: "ca.Function", at: np.ndarray) -> np.ndarray:
    """Return the second derivatives of a solver's objective, which it has for its own steps: the upper triangle."""
    import casadi as ca

    constraints = solver.size1_out("g")
    upper = np.asarray(ca.DM(solver.get_function("nlp_hess_l")(at, [], 1, np.zeros(constraints))))
    return upper + np.triu(upper, 1).T


def _expected_errors(shape: BranchShape) -> tuple[float, float]:
    """Return rough standard errors of slope (relative) and knee (V): in their units the fit is well scaled."""
    n = max(float(shape.bins.n.sum()), 1.0)
    knee = shape.sigma / (shape.slope * np.sqrt(n))
    return knee * shape.slope / shape.y_max, knee


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


def _branch_cost(shape: BranchShape, steeper: "ca.SX", later: "ca.SX", floor: float, u_max: float) -> "ca.SX":
    """Return the negative log-likelihood of one branch.

    `steeper` is the slope's relative change from its start value, `later` the knee's over u_max. In changes, a quiet
    meter's flow, 1e5 standard deviations large, is not subtracted from itself at every step.
    """
    import casadi as ca

    bins, per_sigma = shape.bins, shape.slope * u_max / shape.sigma
    # The line's change, in standard deviations, is tilt x + shift with x = (u - knee) / u_max.
    tilt, shift = per_sigma * steeper, -per_sigma * later * (1 + steeper)
    x = (bins.u - shape.knee) / u_max
    miss = (bins.y - shape.slope * (bins.u - shape.knee)) / shape.sigma
    # Its sum of squares is quadratic in both, so five sums are all that the solver ever sees: over the bins' means, and
    # inside the bins sum (dy - line du)^2 about them, which only the tilt changes.
    inside_xx = float(bins.c_uu.sum()) / u_max**2
    inside_mx = float(np.sum(bins.c_uy - shape.slope * bins.c_uu)) / (u_max * shape.sigma)
    n, n_x, n_xx, n_m, n_mx = (float(np.sum(bins.n * term)) for term in (np.ones_like(x), x, x * x, miss, miss * x))
    squares, products = ca.DM([[n_xx + inside_xx, n_x], [n_x, n]]), ca.DM([n_mx + inside_mx, n_m])
    change = ca.vertcat(tilt, shift)
    cost = ca.bilin(squares, change, change) / 2 - ca.dot(products, change)
    cut = bins.censored > 0
    if cut.any():
        u = bins.u_censored[cut]
        depth = (floor - shape.slope * (u - shape.knee)) / shape.sigma
        depth = ca.DM(depth) - tilt * ca.DM((u - shape.knee) / u_max) - shift
        cost -= ca.dot(ca.DM(bins.censored[cut]), _log_below().map(depth.numel())(depth.T).T)
    return cost


@lru_cache(maxsize=1)
def _log_below() -> "ca.Function":
    """Return the logarithm of the normal distribution function, as a function of one number.

    ``1 + erf`` has lost half of its digits at -6, where a drop-out may lie, and all of them at -8.3; the tail is the
    continued fraction of Mills' ratio (Abramowitz and Stegun 26.2.14).
    """
    import casadi as ca

    depth = ca.SX.sym("depth")
    middle = ca.log((1 + ca.erf(ca.fmax(depth, -TAIL_FROM) / np.sqrt(2))) / 2)
    away = ca.fmax(-depth, TAIL_FROM)
    return ca.Function("log_below", [depth], [middle + _log_tail(away) - _log_tail(TAIL_FROM)])


def _log_tail(away: "ca.SX | float") -> "ca.SX | float":
    """Return the logarithm of the probability beyond `away` standard deviations, but for a constant."""
    import casadi as ca

    fraction = away
    for term in range(TAIL_TERMS, 0, -1):
        fraction = away + term / fraction
    return -(away**2) / 2 - ca.log(fraction)


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
    already is the lower of the bounds on both sides (see `bounds.staircase`).

    Parameters
    ----------
    guard, guard_se : (T,) array
        Guarded thresholds and standard errors, V, in the order of rising pressure drop.
    ceiling : (T,) array
        Largest offset that the certificate allows at each test, V.
    reference : int
        Index of the test at dP0.
    u_max : float
        Full command, V.
    trend : {"decreasing", "increasing", "flat"}
        "flat" makes beta 1 everywhere.

    Raises
    ------
    InputError
        If no positive offset meets the bounds.
    """
    import casadi as ca

    if ceiling.min() <= 0:
        raise InputError(
            f"the threshold's lower bound is {ceiling.min():.3f} V, not above zero: no dead zone can be compensated "
            "without opening the valve at zero command; check the ramp tests and the meter's zero"
        )
    size = guard.size
    # In the offset itself, o = beta u_min0, the problem is a convex quadratic programme; beta(dP0) = 1 then makes
    # u_min0 the offset at the reference. The unknown is what the offset gives up under its ceiling, in mV.
    lowest = float(ceiling.min())
    given_up = ca.MX.sym("given_up", size)
    offset = ca.DM((ceiling - lowest) * 1e3) - given_up
    largest = max(float(guard_se.max()), np.finfo(float).tiny)  # an exact table has no errors
    weight = (largest / np.maximum(guard_se, largest / np.sqrt(LARGEST_WEIGHT))) ** 2
    cost = ca.sum1(ca.DM(weight / weight.max()) * (ca.DM((guard - lowest) * 1e3) - offset) ** 2)
    step = offset[1:] - offset[:-1] if size > 1 else ca.MX(0, 1)
    low, high = {"decreasing": (-np.inf, 0.0), "increasing": (0.0, np.inf), "flat": (0.0, 0.0)}[trend]
    # Not CasADi's qrqp: where ceilings are equal, it may call a curve solved that runs both ways.
    solver = ca.nlpsol("offset", "ipopt", {"x": given_up, "f": cost, "g": step}, IPOPT | EXACT)
    solution = solver(x0=0.1, lbx=0.0, lbg=low, ubg=high)
    _log("offset", solver.stats())
    slack = np.maximum(np.asarray(solution["x"]).ravel(), 0.0) / 1e3
    found = ceiling - slack
    wrong_way = {"decreasing": np.diff(found), "increasing": -np.diff(found), "flat": np.abs(np.diff(found))}[trend]
    if not solver.stats()["success"] or np.any(wrong_way > 2 * ACTIVE * u_max):
        raise InputError(
            f"beta(dP) could not be fitted under its bounds ({solver.stats()['return_status']}); "
            "check that the ramp tests belong to one valve"
        )
    return OffsetFit(u_min0=float(found[reference]), beta=found / found[reference], active=slack < ACTIVE * u_max)
