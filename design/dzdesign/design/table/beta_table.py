"""The table of beta in the firmware: the best nodes that lie under the certified offset at every pressure code."""

from fractions import Fraction

import numpy as np

from dzdesign.core.errors import RequirementError
from dzdesign.design.ceiling.exact_row import ExactRow
from dzdesign.design.ceiling.offset_ceiling import OffsetCeiling
from dzdesign.design.offset.above_tests import AboveChoice
from dzdesign.design.table.linear_programme import STEP_CODES, best_nodes
from dzdesign.design.table.table_margins import TableMargins

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
