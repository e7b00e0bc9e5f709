"""The linear programme of a table of beta, stated once for all valves whose tables have one form."""

from collections.abc import Sequence
from functools import lru_cache
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.errors import RequirementError

if TYPE_CHECKING:
    import cvxpy as cp
    from scipy.sparse import csr_array

#: Pressure codes between neighbouring nodes: a power of two, so that the firmware finds a node by a shift.
STEP_CODES = 64
#: A programme is solved by whoever has written its numbers into it.
SOLVING = Lock()


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
    import cvxpy as cp

    weights = _node_weights(limit.size)
    gain = weights.T @ worth
    gain[-1] += worth[-1]
    with SOLVING:
        problem = _programme(limit.size, trend, last, top)
        values = {"limit": limit, "gain": gain}
        for parameter in problem.parameters():
            parameter.value = values[parameter.name()]
        # A simplex ends in a vertex: no interior-point fuzz to round away. A start at the last valve's solution could
        # end in another vertex, so that a table would depend on what was designed before it.
        problem.solve(solver=cp.HIGHS, warm_start=False)
        if problem.status != cp.OPTIMAL:
            raise RequirementError(f"no table of beta lies under the certified offset (solver: {problem.status})")
        nodes: list[float] = problem.variables()[0].value.tolist()
    return nodes


@lru_cache(maxsize=16)
def _programme(count: int, trend: str | None, last: int, top: float) -> "cp.Problem":
    """Return the programme, its numbers left open: cvxpy then translates it for the solver once, not for each valve."""
    import cvxpy as cp

    weights = _node_weights(count)
    beta = cp.Variable(weights.shape[1])
    limit, gain = cp.Parameter(count, name="limit"), cp.Parameter(weights.shape[1], name="gain")
    return cp.Problem(cp.Maximize(gain @ beta), [weights @ beta <= limit, beta <= top, *_one_way(beta, trend, last)])


@lru_cache(maxsize=16)
def _node_weights(count: int) -> "csr_array":
    """Return by how much each node counts at each of so many codes, straight between the nodes: (codes, nodes)."""
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
    """Return a table at so many codes, straight between its nodes, times their distance: whole numbers."""
    index, past = np.divmod(np.arange(count), step_codes)
    table = np.array(nodes, dtype=np.int64)  # at most 2^31 times a step: far from 2^63
    between: np.ndarray = table[index] * (step_codes - past) + table[index + 1] * past
    return between
