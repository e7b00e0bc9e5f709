"""The problem of the joint fit as CasADi sees it, and its solver: built once per layout, then fed numbers.

To build a solver takes ten times as long as to solve, for derivatives of the cost are taken symbolically. What a layout
is, how many branches and censored bins, the valves of a lot share; all else is a parameter.
"""

from collections.abc import Sequence
from functools import lru_cache
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.identify.knees.branch_shape import BranchShape

if TYPE_CHECKING:
    import casadi as ca

#: Held while a solver is built or used: one that is kept serves all threads, and CasADi does not expect two at once.
SOLVER_LOCK = Lock()
#: Unknowns and constraints are in standard errors, so nothing is left to scale. Bounds are not relaxed, or knees would
#: run the wrong way. Slack times multiplier is met as tightly as the rest: IPOPT's own 1e-4 leaves knees 1e-5 V off.
Settings = dict[str, bool | int | float | str]
IPOPT: Settings = {
    "print_time": False,
    "ipopt.print_level": 0,
    "ipopt.sb": "yes",
    "ipopt.option_file_name": "",
    "ipopt.max_iter": 300,
    "ipopt.tol": 1e-10,
    "ipopt.compl_inf_tol": 1e-10,
    "ipopt.bound_relax_factor": 0.0,
    "ipopt.nlp_scaling_method": "none",
}
#: Numbers of a branch beside its censored bins: see `branch_numbers`.
NUMBERS = 9
#: Standard deviations from which the normal distribution's tail is a continued fraction, exact to 1e-13 with this many
#: terms.
TAIL_FROM, TAIL_TERMS = 3.0, 30
#: Logarithm of the rarest reading that is told from a drop-out: a larger one would overflow.
MOST = 500.0
#: Layouts whose solvers are kept, some hundred kilobytes each.
KEPT = 32
#: Fewest bins with censored samples for which a solver has room.
ROOM = 4


def branch_numbers(
    shape: BranchShape, scale: tuple[float, float], floor: float, u_max: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return all that the likelihood of one branch needs to know of it.

    Its sum of squares is quadratic in the line's changes of tilt and shift, so five sums are all that the solver ever
    sees: over the bins' means, and inside the bins sum (dy - line du)^2 about them, which only the tilt changes.

    The fit starts from the branch's line; `scale` has the units of its unknowns, of the slope's relative change and of
    the knee's in V; `floor` is the meter's, m³/s.

    Returns
    -------
    numbers : (NUMBERS,) array
        Slope times u_max over sigma; the two units, the knee's over u_max; the sums of 1, x, x x, and of m, m x, with
        ``x = (u - knee) / u_max`` and m a sample's distance from the line in standard deviations; the share of samples
        that drop out.
    censored : (3, C) array
        Per bin with samples below the floor their number, the floor's distance from the line in standard deviations,
        and x.
    """
    bins, per_sigma = shape.bins, shape.slope * u_max / shape.sigma
    x = (bins.u - shape.knee) / u_max
    miss = (bins.y - shape.slope * (bins.u - shape.knee)) / shape.sigma
    inside_xx = float(bins.c_uu.sum()) / u_max**2
    inside_mx = float(np.sum(bins.c_uy - shape.slope * bins.c_uu)) / (u_max * shape.sigma)
    n, n_x, n_xx, n_m, n_mx = (float(np.sum(bins.n * term)) for term in (np.ones_like(x), x, x * x, miss, miss * x))
    sums = (n, n_x, n_xx + inside_xx, n_m, n_mx + inside_mx)
    numbers = np.array([per_sigma, scale[0], scale[1] / u_max, *sums, shape.dropped])
    cut = bins.censored > 0
    above = bins.u_censored[cut] - shape.knee
    return numbers, np.array([bins.censored[cut], (floor - shape.slope * above) / shape.sigma, above / u_max])


def solver_with_numbers(
    branches: Sequence[tuple[np.ndarray, np.ndarray]],
) -> tuple["ca.Function", np.ndarray]:
    """Return the solver of a joint fit and the parameters to call it with, of the `branch_numbers` of all branches."""
    rows = censored_rows([censored for _, censored in branches])
    known = [np.array([numbers for numbers, _ in branches]), *rows]
    # CasADi stores matrices by column.
    return _knee_solver(len(branches), rows[0].shape[0]), np.concatenate([part.ravel("F") for part in known])


def censored_rows(censored: Sequence[np.ndarray]) -> tuple[np.ndarray, ...]:
    """Return numbers, depths and places of the bins with samples below the floor, each (room, B).

    The room is a power of two, filled up by bins with no samples, so that few layouts differ in it.
    """
    most = max(each.shape[1] for each in censored)
    room = max(ROOM, 1 << (most - 1).bit_length()) if most else 0
    rows = [np.pad(each, ((0, 0), (0, room - each.shape[1]))) for each in censored]
    return tuple(np.array(rows).transpose(1, 2, 0))


@lru_cache(maxsize=KEPT)
def _knee_solver(branches: int, room: int) -> "ca.Function":
    """Return the solver for one layout; its unknowns are the changes of all slopes, then of all knees, in their units.

    In changes, a quiet meter's flow, 1e5 standard deviations large, is not subtracted from itself at every step.
    """
    import casadi as ca

    unknown = ca.MX.sym("unknown", 2 * branches)
    numbers = ca.MX.sym("numbers", branches, NUMBERS)
    count, depth, x = (ca.MX.sym(name, room, branches) for name in ("count", "depth", "x"))
    slopes, knees = unknown[:branches], unknown[branches:]
    per_sigma, slope_unit, knee_unit, n, n_x, n_xx, n_m, n_mx, dropped = ca.horzsplit(numbers)
    steeper, later = slopes * slope_unit, knees * knee_unit
    # The line's change, in standard deviations, is tilt x + shift with x = (u - knee) / u_max.
    tilt, shift = per_sigma * steeper, -per_sigma * later * (1 + steeper)
    cost = ca.sum1((n_xx * tilt**2 + 2 * n_x * tilt * shift + n * shift**2) / 2 - n_mx * tilt - n_m * shift)
    if room:
        below = depth - x * ca.repmat(tilt.T, room, 1) - ca.repmat(shift.T, room, 1)
        lost = ca.vec(ca.repmat(dropped.T, room, 1))
        cost -= ca.dot(ca.vec(count), log_shut().map(below.numel())(ca.vec(below).T, lost.T).T)
    problem = {"x": unknown, "p": ca.veccat(numbers, count, depth, x), "f": cost}
    return ca.nlpsol("knees", "ipopt", problem, IPOPT)


@lru_cache(maxsize=1)
def log_below() -> "ca.Function":
    """Return the logarithm of the normal distribution function, as a function of one number.

    ``1 + erf`` has lost half of its digits at -6, where a drop-out may lie, and all of them at -8.3; the tail is the
    continued fraction of Mills' ratio (Abramowitz and Stegun 26.2.14).
    """
    import casadi as ca

    depth = ca.SX.sym("depth")
    middle = ca.log((1 + ca.erf(ca.fmax(depth, -TAIL_FROM) / np.sqrt(2))) / 2)
    away = ca.fmax(-depth, TAIL_FROM)
    return ca.Function("log_below", [depth], [middle + _log_tail(away) - _log_tail(TAIL_FROM)])


@lru_cache(maxsize=1)
def log_shut() -> "ca.Function":
    """Return the logarithm of the probability to read below the floor: of little flow, or because a sample dropped out.

    Of a meter that drops out for a share p of its samples, p + (1 - p) Phi. Without p a drop-out just above the knee
    counts as a flow that was not there, and lifts the knee: the unsafe way.
    """
    import casadi as ca

    depth, dropped = ca.SX.sym("depth"), ca.SX.sym("dropped")
    below = log_below()(depth)
    more = dropped * (ca.exp(ca.fmin(-below, MOST)) - 1)
    return ca.Function("log_shut", [depth, dropped], [below + ca.log(1 + more)])


def _log_tail(away: "ca.SX | float") -> "ca.SX | float":
    """Return the logarithm of the probability beyond `away` standard deviations, but for a constant."""
    import casadi as ca

    fraction = away
    for term in range(TAIL_TERMS, 0, -1):
        fraction = away + term / fraction
    return -(away**2) / 2 - ca.log(fraction)
