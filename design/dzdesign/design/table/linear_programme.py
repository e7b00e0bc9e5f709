"""The linear programme of a table of beta, stated once for all valves whose tables have one form."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from dzdesign.core.errors import RequirementError

if TYPE_CHECKING:
    import cvxpy as cp
    from scipy.sparse import csr_array

#: Pressure codes between neighbouring nodes: a power of two, so that the firmware finds a node by a shift.
STEP_CODES = 64
#: Why SciPy's solver gives no nodes, by its status.
NOT_SOLVED = {1: "limit of iterations", 2: "infeasible", 3: "unbounded"}


def best_nodes(limit: np.ndarray, worth: np.ndarray, trend: str | None, last: int, top: float) -> list[float]:
    """Return the nodes of beta that are worth most under a limit at every code.

    Parameters
    ----------
    limit, worth : (codes,) ndarray
        Largest beta at each code, and what beta is worth there.
    trend : str or None
        As in `choose_beta_table`.
    last : int
        Node up to which beta runs the way of the trend; behind it beta falls.
    top : float
        Largest beta of all.

    Raises
    ------
    RequirementError
        If no nodes lie under the limits.
    """
    weights = _node_weights(limit.size)
    gain = weights.T @ worth
    gain[-1] += worth[-1]
    return _programme(limit.size, trend, last, top).solved(limit, gain)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Programme:
    """The programme as cvxpy translates it: ``rows @ x <= most``, the first `equal` rows equal to it."""

    rows: "csr_array"
    equal: int
    #: Largest values; of a limit the rows that have it, one for each code.
    most: np.ndarray
    of_limit: np.ndarray

    def solved(self, limit: np.ndarray, gain: np.ndarray) -> list[float]:
        """Return the best nodes.

        A simplex ends in a vertex: no interior-point fuzz to round away. It starts again: from the last valve's vertex
        it could end in another one, and a table would depend on what was designed before it.
        """
        from scipy.optimize import linprog

        most = self.most.copy()
        most[self.of_limit] = limit
        rows, equal = self.rows, self.equal
        try:
            found = linprog(
                -gain, A_ub=rows[equal:], b_ub=most[equal:], A_eq=rows[:equal] if equal else None,
                b_eq=most[:equal] if equal else None, bounds=(None, None), method="highs-ds",
            )  # fmt: skip
            reason = "" if found.success else NOT_SOLVED.get(found.status, "numerical difficulties")
        except ValueError:  # a limit that is no number
            reason = "model refused"
        if reason:
            raise RequirementError(f"no table of beta lies under the certified offset (solver: {reason})")
        return [float(node) for node in found.x]


@lru_cache(maxsize=16)
def _programme(count: int, trend: str | None, last: int, top: float) -> _Programme:
    """State the programme once for all valves of one form: translating it takes longer than solving it."""
    import cvxpy as cp

    weights = _node_weights(count)
    beta = cp.Variable(weights.shape[1])
    limit = cp.Parameter(count, value=np.zeros(count))
    constraints = [weights @ beta <= limit, beta <= top, *_one_way(beta, trend, last)]
    problem = cp.Problem(cp.Maximize(cp.sum(beta)), constraints)
    most = _translated(problem)["b"]
    limit.value = np.arange(1.0, count + 1.0)
    data = _translated(problem)
    moved = data["b"] - most
    of_limit = np.argsort(moved, kind="stable")[-count:]
    if not np.array_equal(moved[of_limit], limit.value) or np.count_nonzero(moved) != count:
        raise RuntimeError("cvxpy states the limits of the table otherwise than row by row")
    return _Programme(rows=data["A"].tocsr(), equal=data["dims"].zero, most=most, of_limit=of_limit)


def _translated(problem: "cp.Problem") -> dict[str, Any]:
    """Return the cone form of the programme, whose rows are those that SciPy's simplex takes."""
    import cvxpy as cp

    data: dict[str, Any] = problem.get_problem_data(cp.CLARABEL)[0]
    return data


@lru_cache(maxsize=16)
def _node_weights(count: int) -> "csr_array":
    """Return by how much each node counts at each of so many codes, linear between the nodes: (codes, nodes)."""
    from scipy.sparse import csr_array

    codes = np.arange(count)
    index, share = codes // STEP_CODES, (codes % STEP_CODES) / STEP_CODES
    return csr_array(
        (np.concatenate([1 - share, share]), (np.tile(codes, 2), np.concatenate([index, index + 1]))),
        shape=(count, int(index[-1]) + 2),
    )


def _one_way(beta: "cp.Variable", trend: str | None, last: int) -> list["cp.Constraint"]:
    """Return that beta runs the way of the trend up to the node `last`, and falls behind it.

    The tests end between that node and the next, which lies above them: where they rise it may be either way.
    """
    import cvxpy as cp

    steps = cp.diff(beta[: last + 1]) if last else np.zeros(1)
    of_trend = {"decreasing": steps <= 0, "increasing": steps >= 0}.get(trend or "", steps == 0)
    falls_from = last + 1 if trend == "increasing" else last
    found = [of_trend] if last else []
    return [*found, cp.diff(beta[falls_from:]) <= 0] if falls_from + 1 < beta.size else found


def between_nodes(nodes: Sequence[int], count: int, step_codes: int = STEP_CODES) -> np.ndarray:
    """Return a table at so many codes, linear between its nodes, times their distance: whole numbers."""
    index, past = np.divmod(np.arange(count), step_codes)
    table = np.array(nodes, dtype=np.int64)  # at most 2^31 times a step: far from 2^63
    between: np.ndarray = table[index] * (step_codes - past) + table[index + 1] * past
    return between
