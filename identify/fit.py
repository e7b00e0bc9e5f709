"""The constrained fits in CasADi: knees and slopes of all ramp tests jointly; the offset curve under its bounds."""

from dataclasses import dataclass

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.characteristic import BranchShape

#: A constraint is active when its slack is below this share of u_max.
ACTIVE = 1e-7
IPOPT = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.tol": 1e-9, "ipopt.max_iter": 300}


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
    shapes: list[tuple[BranchShape | None, BranchShape | None]], *, floor: float, u_max: float, trend: str
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

    Raises
    ------
    InputError
        If the solver does not converge.
    """
    import casadi as ca

    where = [(row, column) for row, pair in enumerate(shapes) for column, shape in enumerate(pair) if shape]
    position = {place: index for index, place in enumerate(where)}
    slopes, knees = ca.MX.sym("slope", len(where)), ca.MX.sym("knee", len(where))
    cost = 0
    start = np.empty(2 * len(where))
    for index, (row, column) in enumerate(where):
        shape = shapes[row][column]
        start[index], start[len(where) + index] = 1.0, shape.knee / u_max
        cost += _branch_cost(shape, slopes[index], knees[index], floor, u_max)
    constraints, names = [], []
    for (row, column), index in position.items():
        above = position.get((row + 1, column))
        if above is not None and trend != "flat":
            step = knees[above] - knees[index]
            constraints.append(step if trend == "increasing" else -step)
            names.append(f"{'falling' if column else 'rising'} knee of test {row + 1} to {row + 2}")
    variables = ca.vertcat(slopes, knees)
    samples = sum(float(shapes[row][column].bins.n.sum()) for row, column in where)
    # Per sample, so that the solver's tolerance means the same for long and short recordings.
    problem = {"x": variables, "f": cost / samples, "g": ca.vertcat(*constraints)}
    solver = ca.nlpsol("knees", "ipopt", problem, IPOPT)
    solution = solver(x0=start, lbg=0.0, ubg=ca.inf)
    if not solver.stats()["success"]:
        raise InputError(
            f"the joint fit did not converge ({solver.stats()['return_status']}); "
            "look at the ramp tests with --plots, or leave out the one that is unlike the others"
        )
    best = np.asarray(solution["x"]).ravel()
    slack = np.asarray(solution["g"]).ravel()
    hessian, _ = ca.hessian(cost, variables)
    covariance = np.linalg.inv(np.asarray(ca.Function("h", [variables], [hessian])(best)))
    knee, knee_se, slope = (np.full((len(shapes), 2), np.nan) for _ in range(3))
    for index, (row, column) in enumerate(where):
        shape = shapes[row][column]
        variance = covariance[len(where) + index, len(where) + index] * shape.colour
        knee[row, column] = best[len(where) + index] * u_max
        knee_se[row, column] = np.sqrt(variance) * u_max
        slope[row, column] = best[index] * shape.slope
    return KneeFit(
        knee=knee,
        knee_se=knee_se,
        slope=slope,
        active=tuple(name for name, gap in zip(names, slack, strict=True) if gap < ACTIVE),
        iterations=int(solver.stats()["iter_count"]),
    )


def _branch_cost(shape: BranchShape, slope: "object", knee: "object", floor: float, u_max: float) -> "object":
    """Return the negative log-likelihood of one branch; slope in units of the start value, knee over u_max."""
    import casadi as ca

    bins, per_sigma = shape.bins, shape.slope * u_max / shape.sigma
    line = per_sigma * slope
    u, y = bins.u / u_max, bins.y / shape.sigma
    spread = ca.DM(bins.c_yy / shape.sigma**2), ca.DM(bins.c_uy / (u_max * shape.sigma)), ca.DM(bins.c_uu / u_max**2)
    miss = ca.DM(y) - line * (ca.DM(u) - knee)
    squares = ca.DM(bins.n) * miss**2 + spread[0] - 2 * line * spread[1] + line**2 * spread[2]
    cost = ca.sum1(squares) / 2
    cut = bins.censored > 0
    if cut.any():
        depth = floor / shape.sigma - line * (ca.DM(bins.u_all[cut] / u_max) - knee)
        below = (1 + ca.erf(depth / np.sqrt(2))) / 2
        cost -= ca.sum1(ca.DM(bins.censored[cut]) * ca.log(ca.fmax(below, 1e-300)))
    return cost


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
    u_min0, beta = ca.MX.sym("u_min0"), ca.MX.sym("beta", size)
    weight = (guard_se.max() / guard_se) ** 2
    cost = ca.sum1(ca.DM(weight) * (ca.DM(guard / u_max) - u_min0 * beta) ** 2)
    step = beta[1:] - beta[:-1] if size > 1 else ca.MX(0, 1)
    low, high = {"decreasing": (-np.inf, 0.0), "increasing": (0.0, np.inf), "flat": (0.0, 0.0)}[trend]
    problem = {
        "x": ca.vertcat(u_min0, beta),
        "f": cost,
        "g": ca.vertcat(u_min0 * beta - ca.DM(ceiling / u_max), step, beta[reference] - 1),
    }
    solver = ca.nlpsol("offset", "ipopt", problem, {**IPOPT, "ipopt.bound_relax_factor": 0.0})
    lower = np.concatenate([np.full(size, -np.inf), np.full(size - 1, low), [0.0]])
    upper = np.concatenate([np.zeros(size), np.full(size - 1, high), [0.0]])
    start = np.concatenate([[ceiling.min() / u_max], np.ones(size)])
    solution = solver(x0=start, lbx=0.0, lbg=lower, ubg=upper)
    if not solver.stats()["success"]:
        raise InputError(
            f"beta(dP) could not be fitted under its bounds ({solver.stats()['return_status']}); "
            "check that the ramp tests belong to one valve"
        )
    best = np.asarray(solution["x"]).ravel()
    slack = -np.asarray(solution["g"]).ravel()[:size]
    return OffsetFit(u_min0=float(best[0] * u_max), beta=best[1:], active=slack < ACTIVE)
