"""The table of beta: the largest that a linear programme finds under the ceiling, and its margins, exactly."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.design.ceiling import OffsetCeiling
from dzdesign.design.design_choices import Above
from dzdesign.design.exact_row import ExactRow

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
    from scipy.optimize import linprog
    from scipy.sparse import csr_array, vstack

    codes = np.arange(limit.size)
    index, share = codes // STEP_CODES, (codes % STEP_CODES) / STEP_CODES
    entries = np.concatenate([1 - share, share]), (np.tile(codes, 2), np.concatenate([index, index + 1]))
    weights = csr_array(entries, shape=(limit.size, int(index[-1]) + 2))
    gain = weights.T @ worth
    gain[-1] += worth[-1]
    nodes = np.eye(gain.size)
    steps, way = np.diff(nodes, axis=0), {"decreasing": 1, "increasing": -1}.get(trend or "", 0)
    # The tests end between the node `last` and the next, which lies above them: where they rise it may be either way.
    falling = steps[last + 1 if trend == "increasing" else last :]
    one_way, constant = (way * steps[:last], None) if way else (steps[:0], csr_array(steps[:last]))
    most = np.concatenate([limit, np.full(gain.size, top), np.zeros(len(one_way) + len(falling))])
    rows = csr_array(vstack([weights, csr_array(np.concatenate([nodes, one_way, falling]))]))
    try:
        # A simplex ends in a vertex: no interior-point fuzz to round away. It starts again: from the last valve's
        # vertex it could end in another one, and a table would depend on what was designed before it.
        found = linprog(
            -gain, A_ub=rows, b_ub=most, A_eq=constant, b_eq=None if constant is None else np.zeros(last),
            bounds=(None, None), method="highs-ds",
        )  # fmt: skip
        reason = "" if found.success else NOT_SOLVED.get(found.status, "numerical difficulties")
    except ValueError:  # a limit that is no number
        reason = "model refused"
    if reason:
        raise RequirementError(f"no table of beta lies under the certified offset (solver: {reason})")
    return [float(node) for node in found.x]


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
#: Segments of the table in which an offset that is released comes down, beside that in which the tests end: a table is
#: linear between its nodes, and the tests keep their offset.
RELEASE_SEGMENTS = 1


def released_from(above: Above, tested: range) -> int | None:
    """Return the code from which an offset is released that was tested at codes in a range; None: it is not.

    It is that of a node of the table: the offset comes down in the segment before it, under the continued bound.
    """
    if above != "release":
        return None
    return ((tested.stop - 1) // STEP_CODES + 1 + RELEASE_SEGMENTS) * STEP_CODES


def _with_release(ceiling: OffsetCeiling, least: Fraction, above: Above) -> OffsetCeiling:
    """Return a ceiling that above the tests leaves room for the least offset, and for no other where it is released."""
    count, tested = len(ceiling.limit), ceiling.certified.stop
    end = min(released_from(above, ceiling.certified) or count, count)
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
    above: Above | None = None,
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
    above : {"lower", "release"}, optional
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
    # Lowered nodes, and one above its neighbour by the solver's error, go the table's way again.
    for position in range(last, 0, -1) if trend == "increasing" else ():
        nodes[position - 1] = min(nodes[position - 1], nodes[position])
    for position in range(last + 2 if trend == "increasing" else 1, len(nodes)):
        nodes[position] = min(nodes[position], nodes[position - 1])
    return tuple(nodes)
