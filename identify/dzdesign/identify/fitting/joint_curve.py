"""The joint fit of one side: knees and slopes of all tests, the curve f(dP) of both branches, and k, in one problem.

The unknowns are the slopes, what the knees are made of, and k x_max. Under the premise `line` the knees of a branch are
a straight line over the pressure drop (Eq. 4) and the scatter from ramp to ramp, whose size is known; without it each
test has a knee of its own. k x_max is the command by which the mean slope at dP0 reaches the largest flow (Eq. 11). The
errors of beta (Eq. 5) and of k come from the curvature of the whole cost.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.fitting.casadi_problems import (
    IPOPT,
    KEPT,
    NUMBERS,
    SOLVER_LOCK,
    branch_numbers,
    censored_rows,
    log_shut,
)
from dzdesign.identify.fitting.constrained_fits import KneeFit, expected_errors, hessian_of_cost
from dzdesign.identify.knees.branch_shape import BranchShape
from dzdesign.identify.knees.profile import read_at_top

if TYPE_CHECKING:
    import casadi as ca

#: Samples at this share of the largest command and above give the largest flow.
TOP = 0.98
#: Standard errors from the optimum at which a fit has converged.
NEARLY = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class JointCurve:
    """The identified thresholds of both branches, V (T, 2), NaN where a branch is missing, and k x_max."""

    u: np.ndarray
    #: Covariance of the thresholds of each branch, V² (2, T, T).
    covariance: np.ndarray
    #: Command from the knee to full stroke, V.
    k_x_max: float
    k_x_max_se: float

    def beta(self, column: int, reference: int) -> tuple[np.ndarray, np.ndarray]:
        """Return Eq. (5)'s ratio of a branch's thresholds to that at dP0, and its standard error, (T,)."""
        u, covariance = self.u[:, column], self.covariance[column]
        beta = u / u[reference]
        variance = (
            np.diag(covariance) - 2 * beta * covariance[:, reference] + beta**2 * covariance[reference, reference]
        )
        return beta, np.sqrt(np.maximum(variance, 0.0)) / abs(u[reference])


@dataclass(frozen=True, slots=True)
class _Layout:
    """What the knees are made of: knee[b] = start[b] + parts[b] @ unknown, V, with Gaussian priors of so many sd."""

    start: np.ndarray
    parts: np.ndarray
    prior_sd: np.ndarray
    #: Of each branch: the thresholds that are reported, as parts of the unknowns, and their start (T, P), (T,).
    reported: dict[int, tuple[np.ndarray, np.ndarray]]

    def thresholds(self, unknown: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the thresholds (T, 2), V, and their covariance (2, T, T), V²; NaN where a branch is missing."""
        tests = max(level.size for level, _ in self.reported.values())
        u, of_u = np.full((tests, 2), np.nan), np.full((2, tests, tests), np.nan)
        for column, (level, parts) in self.reported.items():
            u[:, column] = level + parts @ unknown
            of_u[column] = parts @ covariance @ parts.T
        return u, of_u


def fit_joint_curve(
    shapes: Sequence[tuple[BranchShape | None, BranchShape | None]],
    knees: KneeFit,
    scatter: Sequence[np.ndarray | None],
    *,
    dp_MPa: np.ndarray | None,
    reference: int,
    floor: float,
    u_max: float,
) -> JointCurve:
    """Fit the curve of a side.

    Parameters
    ----------
    shapes : sequence of (BranchShape or None, BranchShape or None)
        Rising and falling branch of the T tests, in the order of rising pressure drop.
    knees : KneeFit
        Of the fit without a curve, from which this one starts.
    scatter : sequence of (T, T) array or None
        Covariance of the thresholds of each branch beside the noise of the samples, V².
    dp_MPa : (T,) array or None
        For straight curves of both branches; None leaves each knee free.
    reference : int
        Index of the test at dP0.
    floor, u_max : float
        Of the meter, m³/s; full command, V.

    Raises
    ------
    InputError
        If the solver does not converge.
    """
    placed = [(row, column, shape) for row, pair in enumerate(shapes) for column, shape in enumerate(pair) if shape]
    branches = [shape for _, _, shape in placed]
    scales = [expected_errors(shape) for shape in branches]
    numbers = [branch_numbers(shape, scale, floor, u_max) for shape, scale in zip(branches, scales, strict=True)]
    layout = _layout(placed, knees, scatter, dp_MPa)
    of_dp0 = _largest_flow(placed, reference)
    slope = np.array([knees.slope[row, column] for row, column, _ in placed])
    own_slope = np.array([shape.slope for shape in branches])
    start = (slope / own_slope - 1) / [scale[0] for scale in scales]
    k_x_max = of_dp0.flow / float(of_dp0.weights @ slope)
    rows = censored_rows([censored for _, censored in numbers])
    known = np.concatenate([
        np.array([row for row, _ in numbers]).ravel("F"), *(part.ravel("F") for part in rows),
        (layout.start - [shape.knee for shape in branches]) / u_max, (layout.parts / u_max).ravel("F"),
        layout.prior_sd, [1 / shape.variance_inflation for shape in branches],
        of_dp0.weights * own_slope * u_max / of_dp0.flow, [k_x_max / u_max, of_dp0.flow_se / of_dp0.flow],
    ])  # fmt: skip
    best, covariance = _solve(len(placed), rows[0].shape[0], layout.parts.shape[1], start, known)
    u, of_u = layout.thresholds(best[len(placed) : -1], covariance[len(placed) : -1, len(placed) : -1])
    return JointCurve(
        u=u,
        covariance=of_u,
        k_x_max=float(k_x_max * (1 + best[-1])),
        k_x_max_se=float(k_x_max * np.sqrt(covariance[-1, -1])),
    )


def _solve(
    branches: int, room: int, parts: int, start: np.ndarray, known: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the unknowns at the optimum and their covariance; the knees start where the layout has them."""
    with SOLVER_LOCK:
        solver = _curve_solver(branches, room, parts)
        solution = solver(x0=np.concatenate([start, np.zeros(parts + 1)]), p=known)
        outcome = solver.stats()
        best = np.asarray(solution["x"]).ravel()
        hessian = hessian_of_cost(solver, best, known)
        gradient = np.asarray(solver.get_function("nlp_grad_f")(best, known)[1]).ravel()
    covariance = np.linalg.pinv(hessian, hermitian=True)
    # In standard errors, how far the next step would go: a start at the optimum leaves the solver nothing to improve.
    if not gradient @ covariance @ gradient < NEARLY**2:
        raise InputError(
            f"the joint fit of the curve did not converge ({outcome['return_status']}); "
            "look at the ramp tests, and leave out the one that is unlike the others"
        )
    return best, covariance


@dataclass(frozen=True, slots=True)
class _LargestFlow:
    """The largest flow at dP0, of the rising branch where there is one, with its standard error, m³/s.

    Where the meter could not show it, that of another pressure drop.
    `weights` are 1 for that branch, 0 for the others.
    """

    flow: float
    flow_se: float
    weights: np.ndarray


def _largest_flow(placed: Sequence[tuple[int, int, BranchShape]], reference: int) -> _LargestFlow:
    # A test whose meter showed all of its flow knows of a stop; of several such the one of the nearest pressure drop.
    whole = [row for row, _, shape in placed if not shape.prepared.unseen_top]
    teller = min(whole, key=lambda row: (abs(row - reference), row)) if whole else reference
    at_dp0 = [(index, shape) for index, (row, _, shape) in enumerate(placed) if row == teller]
    # The straight line beyond what the meter showed is of the branch by which the valve opens.
    one = 1 if at_dp0[0][1].prepared.unseen_top else read_at_top(at_dp0[0][1].prepared.recorded[0].size)
    readers = at_dp0[:one]
    index, shape = max(readers, key=lambda each: each[1].full_flow)
    return _LargestFlow(flow=shape.full_flow, flow_se=_top_error(shape), weights=np.eye(len(placed))[index])


def _top_error(shape: BranchShape) -> float:
    """Return the standard error of a branch's largest flow, m³/s."""
    u = shape.prepared.branch.u
    count = max(int(np.sum(u >= TOP * u.max())), 1)
    return float(shape.sigma * np.sqrt(max(shape.variance_inflation / count, 0.0)))


def _layout(
    placed: Sequence[tuple[int, int, BranchShape]],
    knees: KneeFit,
    scatter: Sequence[np.ndarray | None],
    dp_MPa: np.ndarray | None,
) -> _Layout:
    """Return what the knees are made of: a line and scatter, or a knee of its own for each and scatter."""
    tests = len(knees.knee)
    start, blocks, sds, reported = np.zeros(len(placed)), [], [], {}
    columns = sorted({column for _, column, _ in placed})
    width = 0
    for column in columns:
        of_column = [index for index, (_, each, _) in enumerate(placed) if each == column]
        knee, se = knees.knee[:, column], knees.knee_se[:, column]
        unit = max(float(np.nanmedian(se)), np.finfo(float).eps)
        spread = scatter[column]
        base = np.eye(tests) * unit if dp_MPa is None else _line_of(dp_MPa) * unit
        level = knee if dp_MPa is None else _line_of(dp_MPa) @ np.linalg.lstsq(_line_of(dp_MPa), knee, rcond=None)[0]
        root = _root(spread) if spread is not None else np.zeros((tests, 0))
        block = np.zeros((len(placed), base.shape[1] + root.shape[1]))
        block[of_column] = np.column_stack([base, root])
        start[of_column] = level
        blocks.append(block)
        sds.append(np.concatenate([np.full(base.shape[1], np.inf), np.ones(root.shape[1])]))
        reported[column] = (level, base, width)
        width += block.shape[1]
    padded = {}
    for column, (level, base, first) in reported.items():
        parts = np.zeros((tests, width))
        parts[:, first : first + base.shape[1]] = base
        padded[column] = (level, parts)
    return _Layout(start, np.hstack(blocks), np.concatenate(sds), padded)


def _line_of(dp_MPa: np.ndarray) -> np.ndarray:
    """Return the columns of a straight line over the pressure drop: its middle, and from there to either end."""
    middle = (dp_MPa[0] + dp_MPa[-1]) / 2
    return np.column_stack([np.ones_like(dp_MPa), (dp_MPa - middle) / (dp_MPa[-1] - middle)])


def _root(covariance: np.ndarray) -> np.ndarray:
    """Return columns whose products make a covariance; none for what is nothing."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > max(float(values.max()), 0.0) * 1e-9
    found: np.ndarray = vectors[:, kept] * np.sqrt(values[kept])
    return found


@lru_cache(maxsize=KEPT)
def _curve_solver(branches: int, room: int, parts: int) -> "ca.Function":
    """Return the solver for one layout; its unknowns are the changes of slopes, the parts of the knees, that of k."""
    import casadi as ca

    unknown = ca.MX.sym("unknown", branches + parts + 1)
    numbers = ca.MX.sym("numbers", branches, NUMBERS)
    count, depth, x = (ca.MX.sym(name, room, branches) for name in ("count", "depth", "x"))
    start, made_of, prior_sd = ca.MX.sym("start", branches), ca.MX.sym("parts", branches, parts), ca.MX.sym("sd", parts)
    weight, at_dp0, top = ca.MX.sym("weight", branches), ca.MX.sym("at_dp0", branches), ca.MX.sym("top", 2)
    slopes, inside, longer = unknown[:branches], unknown[branches : branches + parts], unknown[-1]
    per_sigma, slope_unit, _, n, n_x, n_xx, n_m, n_mx, dropped = ca.horzsplit(numbers)
    steeper, later = slopes * slope_unit, start + made_of @ inside
    tilt, shift = per_sigma * steeper, -per_sigma * later * (1 + steeper)
    each = (n_xx * tilt**2 + 2 * n_x * tilt * shift + n * shift**2) / 2 - n_mx * tilt - n_m * shift
    if room:
        below = depth - x * ca.repmat(tilt.T, room, 1) - ca.repmat(shift.T, room, 1)
        lost = ca.vec(ca.repmat(dropped.T, room, 1))
        shut = log_shut().map(below.numel())(ca.vec(below).T, lost.T).T
        each -= ca.sum1(ca.reshape(ca.vec(count) * shut, room, branches)).T
    cost = ca.dot(weight, each) + ca.sumsqr(inside / prior_sd) / 2
    # Eq. (11): the mean slope at dP0 times k x_max is the largest flow; both over it.
    reached = ca.dot(at_dp0, 1 + steeper) * top[0] * (1 + longer)
    cost += ((reached - 1) / top[1]) ** 2 / 2
    problem = {
        "x": unknown,
        "p": ca.veccat(numbers, count, depth, x, start, made_of, prior_sd, weight, at_dp0, top),
        "f": cost,
    }
    return ca.nlpsol("curve", "ipopt", problem, IPOPT)
