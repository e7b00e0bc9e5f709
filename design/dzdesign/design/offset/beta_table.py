"""The table of beta: the largest that a linear programme finds under the ceiling, and its margins, exactly."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.design.offset.above_tests import AboveChoice
from dzdesign.design.offset.exact_row import ExactRow
from dzdesign.design.offset.offset_ceiling import OffsetCeiling

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


#: Share of the largest number that no margin in doubles is wrong by: four roundings of 2^-53 each, and to spare.
NEAR = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class TableMargins:
    """Ceiling and table at every difference of pressure codes."""

    limit: ExactRow
    nodes: Sequence[int]
    #: Offset over u_max of a beta whose numerator between the nodes is one, see `between_nodes`.
    unit: Fraction
    #: Numerators of the table at every code.
    numerators: np.ndarray = field(init=False)
    #: The margins in doubles, and by how much each of them may be wrong.
    doubles: np.ndarray = field(init=False)
    error: float = field(init=False)

    def __post_init__(self) -> None:
        numerators = between_nodes(self.nodes, len(self.limit))
        offset = numerators * float(self.unit)
        largest = max(float(np.abs(self.limit.doubles).max()), float(np.abs(offset).max()))
        for name, value in (
            ("numerators", numerators), ("doubles", self.limit.doubles - offset), ("error", NEAR * largest)
        ):  # fmt: skip
            object.__setattr__(self, name, value)

    def at(self, code: int) -> Fraction:
        """Return the margin at a code, exactly; negative where the offset lies above the ceiling."""
        return self.limit[code] - int(self.numerators[code]) * self.unit

    def least(self, codes: np.ndarray) -> Fraction:
        """Return the least margin at some codes, of which there is one at least, exactly."""
        doubles = self.doubles[codes]
        near = codes[doubles <= doubles.min() + 2 * self.error].tolist()
        different = {
            (self.limit.numerators[code], self.limit.denominators[code], int(self.numerators[code])): code
            for code in near
        }
        return min(map(self.at, different.values()))

    def exceeded(self) -> list[int]:
        """Return the codes, rising, at which the offset lies above the ceiling."""
        up, unit = self.unit.numerator, self.unit.denominator
        numerators, denominators = self.limit.numerators, self.limit.denominators
        return [
            code
            for code in np.flatnonzero(self.doubles <= self.error).tolist()
            if numerators[code] * unit < int(self.numerators[code]) * up * denominators[code]
        ]


#: Distance kept from the bounds for the LP solver's tolerance; the exact proof below does not rely on it.
SOLVER_MARGIN = 1e-7
#: Worth of a code above the tests beside one of a tested pressure drop.
WORTH_ABOVE = 0.01


def _with_release(ceiling: OffsetCeiling, least: Fraction, above: AboveChoice) -> OffsetCeiling:
    """Return a ceiling that above the tests leaves room for the least offset, and for no other where it is released."""
    count, tested = len(ceiling.limit), ceiling.certified.stop
    released_from = above.released_from(ceiling.certified)
    end = count if released_from is None else min(released_from, count)
    limit = ceiling.limit[:tested].followed_by(ceiling.limit[tested:end].at_least(least))
    let_go = ExactRow.joined([([least.numerator] * (count - end), least.denominator)])
    return OffsetCeiling(limit=limit.followed_by(let_go), certified=ceiling.certified)


def choose_beta_table(
    ceiling: OffsetCeiling,
    u_min0: Fraction,
    trend: str | None,
    *,
    denominator: int,
    above_one: bool,
    above: AboveChoice | None = None,
) -> tuple[int, ...]:
    """Choose the nodes of beta that give the largest offset under the ceiling: a linear programme, then integers.

    Parameters
    ----------
    ceiling : OffsetCeiling
        Limits over u_max.
    u_min0 : Fraction
        Reference offset over u_max.
    trend : {"decreasing", "flat", "increasing"} or None
        Direction in which beta must run; flat, or unknown, it is constant.
    denominator : int
        Of the nodes.
    above_one : bool
        Whether beta may exceed 1: where the threshold grows with dP, or the tests below dP0 are followed.
    above : AboveChoice, optional
        What is to happen above the tests: there beta falls, whatever the trend, and what it has at the tests comes
        first. Without it the trend goes on to the last code.

    Returns
    -------
    tuple of int
        Numerators, one node every `STEP_CODES` codes; proved exactly to lie under the ceiling.
    """
    if above is not None:
        ceiling = _with_release(ceiling, u_min0 / denominator, above)
    limit = ceiling.limit.line(1 / u_min0).doubles - SOLVER_MARGIN
    last, worth = (limit.size - 1) // STEP_CODES + 1, np.ones(limit.size)
    if above is not None:
        last = min((ceiling.certified.stop - 1) // STEP_CODES, last)
        worth[ceiling.certified.stop :] = WORTH_ABOVE
    best = best_nodes(limit, worth, trend, last, 2 - 2 / denominator if above_one else 1.0)
    # A thousandth of a count, so that a beta of 1 to within the solver's error stays 1.
    nodes = [max(int(np.floor(value * denominator + 1e-3)), 1) for value in best]
    # Rounding down keeps the direction; a last node above its neighbour by the solver's error is put right.
    for position in range(1, len(nodes)):
        if trend != "increasing" or position > last + 1:
            nodes[position] = min(nodes[position], nodes[position - 1])
    return _lower_until_proved(nodes, ceiling, u_min0, trend, denominator, last)


def _lower_until_proved(
    nodes: list[int], ceiling: OffsetCeiling, u_min0: Fraction, trend: str | None, denominator: int, last: int
) -> tuple[int, ...]:
    """Lower nodes by single counts until every code is proved, in exact arithmetic, to lie under the ceiling."""
    unit = u_min0 / (denominator * STEP_CODES)
    for code in TableMargins(limit=ceiling.limit, nodes=nodes, unit=unit).exceeded():  # lower nodes exceed no other
        index, share = divmod(code, STEP_CODES)
        while (nodes[index] * (STEP_CODES - share) + nodes[index + 1] * share) * unit > ceiling.limit[code]:
            high = index if nodes[index] >= nodes[index + 1] else index + 1
            nodes[high] -= 1
            if nodes[high] <= 0:
                raise RequirementError("no positive offset lies under the certified one; check valve.json")
    for position in range(last, 0, -1) if trend == "increasing" else ():
        nodes[position - 1] = min(nodes[position - 1], nodes[position])
    for position in range(last + 2 if trend == "increasing" else 1, len(nodes)):
        nodes[position] = min(nodes[position], nodes[position - 1])
    return tuple(nodes)
