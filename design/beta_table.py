"""The table of beta in the firmware: the best nodes that lie under the certified offset at every pressure code."""

from bisect import bisect_left
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor

import numpy as np

from dzdesign.core.errors import InputError, RequirementError
from dzdesign.design.signals import Signals
from dzdesign.identify.guard_curve import GuardCurve
from dzdesign.identify.model import SideModel

#: Two floors of a converter each lose up to one code, so a difference of codes is right to within one.
DP_CODE_ERROR = 1
#: Pressure codes between neighbouring nodes: a power of two, so that the firmware finds a node by a shift.
STEP_CODES = 64
#: Nodes are integers over this; beta stays below 2, so a node fits 16 bits.
DENOMINATOR = 1 << 15
#: valve.json has seven decimals, so a sum of two of its numbers is right to this, in V.
DECIMALS = Fraction(1, 10**6)
#: Distance kept from the bounds for the LP solver's tolerance; the exact proof below does not rely on it.
SOLVER_MARGIN = 1e-7


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetCeiling:
    """Largest offset over u_max that the certificate allows, at every difference of pressure codes 0...code_max.

    Attributes
    ----------
    limit : tuple of Fraction
        Limit at each code, exact: the least over the pressures that the code may stand for.
    certified : range
        Codes inside the tested interval of the pressure drop.
    """

    limit: tuple[Fraction, ...]
    certified: range


class CertifiedOffset:
    """The offset curve and its bounds, exactly from the decimal numbers of valve.json.

    Parameters
    ----------
    curve : GuardCurve
        Of the threshold to be guarded, on one side of the valve, tested at one pressure drop or more.
    dp0_MPa : float
        Reference dP0.
    """

    def __init__(self, curve: GuardCurve, dp0_MPa: float) -> None:
        self._nodes = [Fraction(repr(value)) for value in curve.beta_dp_MPa]
        self._beta = [Fraction(repr(value)) for value in curve.beta]
        self._u_min0 = Fraction(repr(curve.u_min0_V))
        self._dp0 = Fraction(repr(dp0_MPa))
        self._steps = [Fraction(repr(step)) for step in curve.certified_steps_V]
        self._lowest = min(Fraction(repr(bound)) for bound in curve.u_lower_V)

    def curve(self, dp_MPa: Fraction) -> Fraction:
        """Return beta(dP) u_min0 in V by the selector of Eq. (7).

        For dP <= dP0 the paper holds beta = 1; where the threshold grows with dP that would over-compensate, so there
        the smaller of the two is taken. Outside the tested interval the nearest node is held.
        """
        nodes, beta = self._nodes, self._beta
        at = min(max(dp_MPa, nodes[0]), nodes[-1])
        right = bisect_left(nodes, at)
        value = beta[right]
        if right and nodes[right] != at:
            share = (at - nodes[right - 1]) / (nodes[right] - nodes[right - 1])
            value = beta[right - 1] + share * (beta[right] - beta[right - 1])
        if dp_MPa <= self._dp0:
            value = min(value, Fraction(1))
        return value * self._u_min0

    def bound(self, dp_MPa: Fraction) -> Fraction | None:
        """Return the lower bound of the guarded threshold at dP in V, or None outside the tested interval."""
        nodes = self._nodes
        if not nodes[0] <= dp_MPa <= nodes[-1]:
            return None
        if not self._steps:
            return self._lowest
        right = bisect_left(nodes, dp_MPa)
        touching = self._steps[max(right - 1, 0) : right + (nodes[right] == dp_MPa)]
        return min(touching)


def offset_ceiling(side: SideModel, guard: str, signals: Signals, u_max_V: Fraction) -> OffsetCeiling:
    """Return the limit of the offset at every pressure code, the converter's error and the rounding counted.

    Parameters
    ----------
    side : SideModel
        One side of the valve, tested at one pressure drop or more.
    guard : str
        The threshold to be guarded, one of `side.guards`.
    signals : Signals
        Scalings of the converter and the PWM.
    u_max_V : Fraction
        Full command, V.

    Raises
    ------
    RequirementError
        If the identified curve itself lies above the staircase somewhere: valve.json contradicts itself.
    """
    first, last = (signals.dp_code(Fraction(repr(end))) for end in (side.beta_dp_MPa[0], side.beta_dp_MPa[-1]))
    if last > signals.pressure_code_max:
        raise InputError(
            f"the sensor's span of {float(signals.pressure_span_MPa):g} MPa ends below the tested pressure drop of "
            f"{side.beta_dp_MPa[-1]:g} MPa; give the real span with --pressure-span"
        )
    half_count = Fraction(1, 2 * signals.compare_max)
    certified = CertifiedOffset(side.guards[guard], side.reference_dp_MPa)
    values = []
    for code in range(-DP_CODE_ERROR, signals.pressure_code_max + DP_CODE_ERROR + 1):
        dp_MPa = signals.dp_MPa(code)
        curve, bound = certified.curve(dp_MPa), certified.bound(dp_MPa)
        if bound is not None and curve > bound + DECIMALS:
            raise RequirementError(
                f"beta u_min0 is {float(curve):.4f} V at {float(dp_MPa):.3f} MPa, above the threshold's lower bound of "
                f"{float(bound):.4f} V; make valve.json again with `dzdesign identify`"
            )
        values.append((curve if bound is None else min(curve, bound)) / u_max_V - half_count)
    span = 2 * DP_CODE_ERROR + 1
    limit = tuple(min(values[code : code + span]) for code in range(signals.pressure_code_max + 1))
    return OffsetCeiling(limit=limit, certified=range(ceil(first), floor(last) + 1))


def choose_beta_table(ceiling: OffsetCeiling, u_min0: Fraction, trend: str | None, code_max: int) -> tuple[int, ...]:
    """Choose the nodes of beta that give the largest offset under the ceiling: a linear programme, then integers.

    Parameters
    ----------
    ceiling : OffsetCeiling
        Limits over u_max.
    u_min0 : Fraction
        Reference offset over u_max.
    trend : {"decreasing", "flat", "increasing"} or None
        Direction in which beta must run; flat, or unknown, it is constant.
    code_max : int
        Largest pressure code.

    Returns
    -------
    tuple of int
        Numerators over `DENOMINATOR`, one node every `STEP_CODES` codes; proved exactly to lie under the ceiling.
    """
    import cvxpy as cp
    from scipy.sparse import csr_array

    codes = np.arange(code_max + 1)
    index, share = codes // STEP_CODES, (codes % STEP_CODES) / STEP_CODES
    size = int(index[-1]) + 2
    weights = csr_array(
        (np.concatenate([1 - share, share]), (np.tile(codes, 2), np.concatenate([index, index + 1]))),
        shape=(codes.size, size),
    )
    limit = np.array([float(value / u_min0) for value in ceiling.limit]) - SOLVER_MARGIN
    beta = cp.Variable(size)
    # Only a threshold that grows with the pressure drop needs a beta above 1 (Eq. 7).
    constraints = [weights @ beta <= limit, beta <= (2 - 2 / DENOMINATOR if trend == "increasing" else 1)]
    if trend == "decreasing":
        constraints.append(cp.diff(beta) <= 0)
    elif trend == "increasing":
        constraints.append(cp.diff(beta) >= 0)
    else:
        constraints.append(cp.diff(beta) == 0)
    problem = cp.Problem(cp.Maximize(cp.sum(weights @ beta) + beta[-1]), constraints)
    problem.solve(solver=cp.HIGHS)  # a simplex ends in a vertex: no interior-point fuzz to round away
    if problem.status != cp.OPTIMAL:
        raise RequirementError(f"no table of beta lies under the certified offset (solver: {problem.status})")
    # A thousandth of a count, so that a beta of 1 to within the solver's error stays 1.
    nodes = [int(np.floor(value * DENOMINATOR + 1e-3)) for value in beta.value]
    # Rounding down keeps the direction; a last node above its neighbour by the solver's error is put right.
    for position in range(1, size):
        if trend != "increasing":
            nodes[position] = min(nodes[position], nodes[position - 1])
    return _lower_until_proved(nodes, ceiling, u_min0, trend)


def _lower_until_proved(
    nodes: list[int], ceiling: OffsetCeiling, u_min0: Fraction, trend: str | None
) -> tuple[int, ...]:
    """Lower nodes by single counts until every code is proved, in exact arithmetic, to lie under the ceiling."""
    scale = DENOMINATOR * STEP_CODES
    for code, limit in enumerate(ceiling.limit):
        index, share = divmod(code, STEP_CODES)
        while (nodes[index] * (STEP_CODES - share) + nodes[index + 1] * share) * u_min0 > limit * scale:
            high = index if nodes[index] >= nodes[index + 1] else index + 1
            nodes[high] -= 1
            if nodes[high] <= 0:
                raise RequirementError("no positive offset lies under the certified one; check valve.json")
    order = range(len(nodes) - 1, 0, -1) if trend == "increasing" else range(1, len(nodes))
    for position in order:
        if trend == "increasing":
            nodes[position - 1] = min(nodes[position - 1], nodes[position])
        else:
            nodes[position] = min(nodes[position], nodes[position - 1])
    return tuple(nodes)
