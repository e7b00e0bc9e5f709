"""The law's offset under a certified bound: the problem that chooses it, in CasADi.

The offset is linear between nodes: the tests, and points between them. It comes as near to the identified curve as
the bound allows, and runs the way of the trend. The bound is a constraint at every node and at points between, and what
it lacks between those points is taken off in closed form.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.fitting.casadi_problems import KEPT, QUADRATIC, SOLVER_LOCK
from dzdesign.identify.fitting.constrained_fits import ACTIVE
from dzdesign.identify.valve.certified_bound import CertifiedBound, largest_excess
from dzdesign.identify.valve.staircase import Direction

if TYPE_CHECKING:
    import casadi as ca

#: Parts of the interval between two tests that the offset is straight in, and in each of them the parts at whose ends
#: the bound is a constraint.
PARTS, POINTS = 8, 4
#: valve.json has seven decimals: rounding both offset and bound may bring them nearer by this, V.
ROUNDING_V = 1.5e-7
#: Of a stored number.
HALF_DIGIT = 0.5e-7
#: By how much a curve may run the wrong way for the solver's tolerance, over u_max.
WRONG_WAY = 2 * ACTIVE


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetUnderBound:
    """An offset, linear between its nodes (N,): MPa and V; u_min0 is that at dP0, V."""

    dp_MPa: np.ndarray
    offset: np.ndarray
    u_min0: float
    #: The constraints that hold with equality, in words.
    active: tuple[str, ...]

    @property
    def mean(self) -> float:
        """Mean over the tested interval, V."""
        if self.dp_MPa.size < 2:
            return float(self.offset[0])
        return float(np.trapezoid(self.offset, self.dp_MPa) / np.ptp(self.dp_MPa))


def fit_offset_under(
    bound: CertifiedBound,
    dp_MPa: np.ndarray,
    identified: np.ndarray,
    reference: int,
    *,
    trend: Direction,
    u_max: float,
) -> OffsetUnderBound:
    """Fit the offset that is as near to the identified curve (V, at the T tests) as the bound allows.

    Raises
    ------
    InputError
        If no positive offset meets the bound.
    """
    nodes, points = (_divided(dp_MPa, parts) for parts in (PARTS, PARTS * POINTS))
    ceiling = bound.in_doubles(points)
    lowest = float(ceiling.min())
    if lowest <= 0:
        raise InputError(
            f"the threshold's lower bound is {lowest:.3f} V, not above zero: no dead zone can be compensated without "
            "opening the valve at zero command; check the ramp tests and the meter's zero"
        )
    if trend == "flat":
        found = np.full(nodes.size, lowest)
    else:
        found = _solve(nodes, np.interp(nodes, dp_MPa, identified), ceiling, lowest, trend, u_max)
    slack = ceiling - np.interp(points, nodes, found)
    found = found - max(largest_excess(bound, nodes, found), 0.0) - _rounding_V(dp_MPa)
    return OffsetUnderBound(
        dp_MPa=nodes,
        offset=found,
        u_min0=float(np.interp(dp_MPa[reference], nodes, found)),
        active=tuple(_in_words(points, slack < ACTIVE * u_max)),
    )


def _rounding_V(dp_MPa: np.ndarray) -> float:
    """Return what the offset keeps from the bound, V: M too is stored to a last digit, of which a wide sag has many."""
    widest_MPa = float(np.diff(dp_MPa).max(initial=0.0))
    return ROUNDING_V + HALF_DIGIT * max(widest_MPa**2 / 8 - 1, 0.0)


def _in_words(points: np.ndarray, active: np.ndarray) -> Iterator[str]:
    """Yield the stretches of the interval on which the offset lies on the bound."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], active.astype(int), [0]])))
    for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
        low, high = (f"{points[place]:.3f}" for place in (first, last))
        yield f"offset at {low} MPa" if low == high else f"offset from {low} to {high} MPa"


def _divided(dp_MPa: np.ndarray, parts: int) -> np.ndarray:
    """Return the tests and, between each two, points that divide the way into so many parts."""
    at = np.arange((dp_MPa.size - 1) * parts + 1) / parts
    divided: np.ndarray = np.interp(at, np.arange(dp_MPa.size), dp_MPa)
    return divided


def _solve(
    nodes: np.ndarray, wanted: np.ndarray, ceiling: np.ndarray, lowest: float, trend: Direction, u_max: float
) -> np.ndarray:
    """Solve for the offset at the nodes, V; the bound holds at the points of `ceiling`."""
    length = np.gradient(nodes) / np.ptp(nodes)
    known = np.concatenate([(wanted - lowest) * 1e3, length])
    top = np.concatenate([(ceiling - lowest) * 1e3, np.full(nodes.size - 1, 0.0 if trend == "decreasing" else np.inf)])
    bottom = np.concatenate([np.full(ceiling.size, -np.inf), np.full(nodes.size - 1, -np.inf)])
    if trend == "increasing":
        bottom[ceiling.size :] = 0.0
    with SOLVER_LOCK:
        solver = _offset_solver(nodes.size)
        solution = solver(p=known, lbg=bottom, ubg=top)
        outcome = solver.stats()
        found: np.ndarray = lowest + np.asarray(solution["x"]).ravel() / 1e3
    steps = np.diff(found) * (1 if trend == "decreasing" else -1)
    if not outcome["success"] or np.any(steps > WRONG_WAY * u_max):
        raise InputError(
            f"the law's offset could not be fitted under its bounds ({outcome['unified_return_status']}); "
            "check that the ramp tests belong to one valve"
        )
    # What runs the wrong way by the solver's tolerance is brought down.
    if trend == "decreasing":
        return np.minimum.accumulate(found)
    return np.minimum.accumulate(found[::-1])[::-1]


@lru_cache(maxsize=KEPT)
def _offset_solver(nodes: int) -> "ca.Function":
    """Return the solver for so many nodes.

    The unknowns are the offset at the nodes, mV from any common zero; the parameters the identified curve there and
    the share of the interval that each stands for; the constraints bound the offset at the points, then its steps.
    """
    import casadi as ca

    offset, wanted, length = (ca.SX.sym(name, nodes) for name in ("offset", "wanted", "length"))
    shares = [share / POINTS for share in range(POINTS)]
    between = [offset[part] * (1 - share) + offset[part + 1] * share for part in range(nodes - 1) for share in shares]
    problem = {
        "x": offset,
        "p": ca.vertcat(wanted, length),
        "f": ca.dot(length, (wanted - offset) ** 2),
        "g": ca.vertcat(*between, offset[-1], offset[1:] - offset[:-1]),
    }
    return ca.qpsol("offset_under_bound", "daqp", problem, QUADRATIC)
