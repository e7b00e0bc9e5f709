"""The table of beta in the firmware: the best nodes that lie under the certified offset at every pressure code."""

from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.core.worded import worded
from dzdesign.design.machine.allowance import Allowance
from dzdesign.design.offset.above_tests import AboveChoice, OffsetAbove
from dzdesign.design.signals import Signals
from dzdesign.identify.valve.certified_bound import CertifiedBound, NEAR_MPa

if TYPE_CHECKING:
    import cvxpy as cp
    from scipy.sparse import csr_array

#: Pressure codes between neighbouring nodes: a power of two, so that the firmware finds a node by a shift.
STEP_CODES = 64
#: valve.json has seven decimals, so a sum of two of its numbers is right to this, in V.
DECIMALS = Fraction(1, 10**6)
#: Distance kept from the bounds for the LP solver's tolerance; the exact proof below does not rely on it.
SOLVER_MARGIN = 1e-7
#: Worth of a code above the tests beside one of a tested pressure drop.
WORTH_ABOVE = 0.01


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetCeiling:
    """Largest offset over u_max that the certificate allows, at every difference of pressure codes 0...code_max."""

    #: Limit at each code, exact: the least over the pressures that the code may stand for.
    limit: tuple[Fraction, ...]
    #: Codes inside the tested interval of the pressure drop.
    certified: range


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetCurve:
    """An offset over the pressure drop and the bounds that hold it, exactly from the decimal numbers of valve.json."""

    #: Nodes, from the first tested pressure drop to the last, rising.
    dp_MPa: tuple[Fraction, ...]
    #: Offset at each; straight between them.
    offset_V: tuple[Fraction, ...]
    #: Lower bound of the guarded threshold on that interval; None of an offset that nothing has to bound.
    certified: CertifiedBound | None
    #: Up to this dP0 the offset is at most the one there, as Eq. (7) holds beta = 1; None follows the tests.
    hold_below_MPa: Fraction | None
    #: How it goes on above the tests; None: the last offset is held, and nothing is certified.
    above: OffsetAbove | None = None

    def at(self, dp_MPa: Fraction) -> Fraction:
        """Return the offset in V by the selector of Eq. (7).

        For dP <= dP0 the paper holds beta = 1; where the threshold grows with dP that would over-compensate, so there
        the smaller of the two is taken. Below the tested interval the first node is held.
        """
        if self.above is not None and dp_MPa > self.dp_MPa[-1]:
            return self.above.at(dp_MPa)
        value = self._straight(dp_MPa)
        if self.hold_below_MPa is not None and dp_MPa <= self.hold_below_MPa:
            value = min(value, self._straight(self.hold_below_MPa))
        return value

    def _straight(self, dp_MPa: Fraction) -> Fraction:
        nodes, offset = self.dp_MPa, self.offset_V
        if dp_MPa >= nodes[-1]:
            return offset[-1]
        if dp_MPa <= nodes[0]:
            return offset[0]
        right = bisect_left(nodes, dp_MPa)
        share = (dp_MPa - nodes[right - 1]) / (nodes[right] - nodes[right - 1])
        return offset[right - 1] + share * (offset[right] - offset[right - 1])

    def bound(self, dp_MPa: Fraction) -> Fraction | None:
        """Return the lower bound of the guarded threshold at dP in V, or None where nothing is certified."""
        if self.above is not None and dp_MPa > self.dp_MPa[-1]:
            return self.above.bound_at(dp_MPa)
        return None if self.certified is None else self.certified.at(dp_MPa)

    def in_doubles(self, dp_MPa: np.ndarray) -> np.ndarray:
        """Return the offset in double precision, V, and where a bound is certified the lower of both.

        The pressure drops rise.
        """
        nodes, offset = (np.array([float(value) for value in values]) for values in (self.dp_MPa, self.offset_V))
        value: np.ndarray = np.interp(dp_MPa, nodes, offset)
        if self.above is not None:
            value = np.where(dp_MPa > nodes[-1], self.above.in_doubles(dp_MPa), value)
        if self.hold_below_MPa is not None:
            hold = float(self.hold_below_MPa)
            value = np.where(dp_MPa <= hold + NEAR_MPa, np.minimum(value, np.interp(hold, nodes, offset)), value)
        return value if self.certified is None else np.minimum(value, self.certified.in_doubles(dp_MPa))


@lru_cache(maxsize=8)
def pressures_MPa(signals: Signals, first: int, last: int) -> tuple[Fraction, ...]:
    """Return the pressure drops of differences of codes, MPa, exactly; kept, for a batch of valves has one scaling."""
    return tuple(signals.dp_MPa(code) for code in range(first, last + 1))


def offset_ceiling(curve: OffsetCurve, u_max_V: Fraction, allowance: Allowance) -> OffsetCeiling:
    """Return the limit of the offset at every pressure code.

    It is the least certified offset over all pressure drops that the code may stand for, on the machine that moves the
    threshold furthest, less what rounding and the dither add to the drive. A curve that lies above its bound somewhere
    is refused: valve.json contradicts itself.
    """
    signals = allowance.signals
    first, last = (signals.dp_code(end) for end in (curve.dp_MPa[0], curve.dp_MPa[-1]))
    code_max = signals.largest_difference(allowance.sign)
    if last > code_max:
        raise InputError(
            worded(
                "the sensor's span of {span:g MPa} ends below the tested pressure drop of {tested:g MPa}; give the "
                "real span with --pressure-span",
                span=float(signals.pressure_a.span_MPa),
                tested=float(curve.dp_MPa[-1]),
            )
        )
    low, high = allowance.window
    factor, kept = allowance.factor / u_max_V, allowance.kept
    values = _certified_at(curve, signals, low, code_max + high)
    limit = tuple(value * factor - kept for value in _least_of_windows(values, high - low + 1))
    return OffsetCeiling(limit=limit, certified=range(ceil(first), floor(last) + 1))


@lru_cache(maxsize=8)
def _certified_at(curve: OffsetCurve, signals: Signals, first: int, last: int) -> tuple[Fraction, ...]:
    """Return what is certified at each of the codes, V; kept, for a valve is designed in several ways, and proved."""
    return tuple(certified_V(curve, dp_MPa) for dp_MPa in pressures_MPa(signals, first, last))


def certified_V(curve: OffsetCurve, dp_MPa: Fraction) -> Fraction:
    """Return the offset that is certified at a pressure drop, V; a curve above its bound is refused."""
    offset, bound = curve.at(dp_MPa), curve.bound(dp_MPa)
    if bound is None:
        return offset
    if offset > bound + DECIMALS:
        raise RequirementError(
            worded(
                "beta u_min0 is {offset:.4f V} at {dp:.3f MPa}, above the threshold's lower bound of {bound:.4f V}; "
                "make valve.json again with `dzdesign identify`",
                offset=float(offset),
                dp=float(dp_MPa),
                bound=float(bound),
            )
        )
    return min(offset, bound)


def _least_of_windows(values: Sequence[Fraction], width: int) -> list[Fraction]:
    """Return the least of each `width` neighbouring values."""
    found, rising = [], deque[int]()  # places of values that rise, the first of them the least of the window
    for place, value in enumerate(values):
        while rising and values[rising[-1]] >= value:
            rising.pop()
        rising.append(place)
        if rising[0] <= place - width:
            rising.popleft()
        if place >= width - 1:
            found.append(values[rising[0]])
    return found


def _with_release(ceiling: OffsetCeiling, least: Fraction, above: AboveChoice) -> OffsetCeiling:
    """Return a ceiling that above the tests leaves room for the least offset, and for no other where it is let go."""
    limit, released_from = list(ceiling.limit), above.released_from(ceiling.certified)
    for code in range(ceiling.certified.stop, len(limit)):
        limit[code] = least if released_from is not None and code >= released_from else max(limit[code], least)
    return OffsetCeiling(limit=tuple(limit), certified=ceiling.certified)


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
    import cvxpy as cp

    if above is not None:
        ceiling = _with_release(ceiling, u_min0 / denominator, above)
    weights = _node_weights(len(ceiling.limit))
    count, size = weights.shape
    limit = np.array([float(value / u_min0) for value in ceiling.limit]) - SOLVER_MARGIN
    beta = cp.Variable(size)
    constraints = [weights @ beta <= limit, beta <= (2 - 2 / denominator if above_one else 1)]
    last, worth = size - 1, np.ones(count)
    if above is not None:
        last = min((ceiling.certified.stop - 1) // STEP_CODES, size - 1)
        worth[ceiling.certified.stop :] = WORTH_ABOVE
    constraints += _one_way(beta, trend, last)
    problem = cp.Problem(cp.Maximize(worth @ (weights @ beta) + worth[-1] * beta[-1]), constraints)
    problem.solve(solver=cp.HIGHS)  # a simplex ends in a vertex: no interior-point fuzz to round away
    if problem.status != cp.OPTIMAL:
        raise RequirementError(f"no table of beta lies under the certified offset (solver: {problem.status})")
    # A thousandth of a count, so that a beta of 1 to within the solver's error stays 1.
    nodes = [max(int(np.floor(value * denominator + 1e-3)), 1) for value in beta.value]
    # Rounding down keeps the direction; a last node above its neighbour by the solver's error is put right.
    for position in range(1, size):
        if trend != "increasing" or position > last + 1:
            nodes[position] = min(nodes[position], nodes[position - 1])
    return _lower_until_proved(nodes, ceiling, u_min0, trend, denominator, last)


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


def _lower_until_proved(
    nodes: list[int], ceiling: OffsetCeiling, u_min0: Fraction, trend: str | None, denominator: int, last: int
) -> tuple[int, ...]:
    """Lower nodes by single counts until every code is proved, in exact arithmetic, to lie under the ceiling."""
    scale = denominator * STEP_CODES
    for code, limit in enumerate(ceiling.limit):
        index, share = divmod(code, STEP_CODES)
        while (nodes[index] * (STEP_CODES - share) + nodes[index + 1] * share) * u_min0 > limit * scale:
            high = index if nodes[index] >= nodes[index + 1] else index + 1
            nodes[high] -= 1
            if nodes[high] <= 0:
                raise RequirementError("no positive offset lies under the certified one; check valve.json")
    for position in range(last, 0, -1) if trend == "increasing" else ():
        nodes[position - 1] = min(nodes[position - 1], nodes[position])
    for position in range(last + 2 if trend == "increasing" else 1, len(nodes)):
        nodes[position] = min(nodes[position], nodes[position - 1])
    return tuple(nodes)
