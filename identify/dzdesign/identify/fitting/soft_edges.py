"""How far below the knee the flow still exceeds the level, as far as the recordings can tell: the shape of the edge.

An edge may open with a part of its flow gain before it opens with all of it (a notch, a rounded land). Of all edges
whose gain only grows as they open, and that pass a given flow at a given command, the one that is hardest to see opens
in two straight parts: from where it closes, with a share of the gain over a width, and then with all of it. The
recordings of all tests, which one edge has made, say which shares and widths are credible. The meter's lag rounds a
sharp edge too, so each is asked with every lag that the meter may have.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM
from dzdesign.identify.fitting.edge_averages import EdgeAverages, average_about_edge, smallest_flow_shown
from dzdesign.identify.fitting.edge_fits import fit_edges
from dzdesign.identify.knees.branch_shape import BranchShape
from dzdesign.identify.knees.meter_lag import MeterLag

#: Shares of the flow gain, and widths over u_max, that the first part may have.
SHARES, WIDTHS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]), np.geomspace(3e-3, 0.2, 11)
#: Times that the grid is refined about the most credible shape, and points of the finer grid in each direction.
REFINED, FINER = 3, 5
#: A first part whose largest flow is less than this share of the level is as good as none.
HARMLESS = 0.5
#: Neighbouring lags differ by what rounds a sharp edge by this share of the level, but there are no more than these.
LAG_STEP, MOST_LAGS = 0.3, 8


@dataclass(frozen=True, slots=True)
class Softness:
    """How far below each test's knee the flow still exceeds the level, V, (T,): most likely, and at most."""

    likely: np.ndarray
    at_most: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class _Shapes:
    """A grid of edges, (S, W): shares and widths (V) of the first part; and the fits of all tests for each."""

    share: np.ndarray
    width: np.ndarray
    #: Lag of the meter, s.
    seconds: float
    #: Sum of squares of all tests, (S, W), and command at which the flow of each reaches the level, (T, S, W).
    squares: np.ndarray
    at_level: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeShapes:
    """The edges that were fitted to the tests of one branch: what `find_softness` judges."""

    grids: tuple[_Shapes, ...]
    #: Readings beyond the three parameters of each test, and which tests tell an edge, (T,).
    degrees: int
    told: np.ndarray

    @property
    def best(self) -> _Shapes:
        """The grid that has the most credible shape of all."""
        return min(self.grids, key=lambda grid: float(grid.squares.min()))


def fit_edge_shapes(shapes: Sequence[BranchShape], *, level: float, lag: MeterLag, u_max: float) -> EdgeShapes:
    """Fit edges of two straight parts to one branch of all tests, with every lag that the meter may have.

    The level is the flow (m³/s) that is looked for below the knees.
    """
    floor = smallest_flow_shown(shapes, u_max)
    averages = [average_about_edge(shape, floor, u_max) for shape in shapes]
    known = [item for item in averages if item is not None]
    found = EdgeShapes(
        grids=(),
        degrees=max(sum(item.u.size - 3 for item in known), 1),
        told=np.array([item is not None for item in averages]),
    )
    if not known:
        return found
    width = np.concatenate([[0.0], WIDTHS * u_max])
    grids = tuple(_fit(known, SHARES, width, seconds, level, u_max) for seconds in _lags(lag, shapes, known, level))
    found = replace(found, grids=grids)
    for _ in range(REFINED):
        best = found.best
        if best.width[int(np.argmin(best.squares)) % best.width.size] == 0:
            break
        found = replace(found, grids=(*found.grids, _finer(known, best, level, u_max)))
    return found


def find_softness(edges: EdgeShapes, knees: np.ndarray, confidence: float) -> Softness:
    """Find how far below the knees (V, (T,)) of one branch the flow may exceed the level."""
    from scipy.special import stdtrit

    if not edges.grids:
        return Softness(np.zeros(knees.size), np.zeros(knees.size))
    best = edges.best
    least = float(best.squares.min())
    # Where no shape fits as well as the noise allows, all of them are judged by what the best one leaves.
    left = max(least / edges.degrees, 1.0)
    credible = float(stdtrit(DEGREES_OF_FREEDOM, confidence)) ** 2 * left
    likely = best.at_level.reshape(len(best.at_level), -1)[:, int(np.argmin(best.squares))]
    lowest = np.min([likely, *(_lowest_credible(grid, least + credible) for grid in edges.grids)], axis=0)
    found = []
    for command in (likely, lowest):
        below = np.maximum(knees[edges.told] - command, 0.0)
        # One edge has made all tests: one that tells nothing by itself has what the others have.
        every = np.full(knees.size, below.max())
        every[edges.told] = below
        found.append(every)
    return Softness(*found)


def _lags(lag: MeterLag, shapes: Sequence[BranchShape], known: Sequence[EdgeAverages], level: float) -> np.ndarray:
    """Return lags, s, from the shortest to the longest that the meter may have, so near that none hides the level."""
    # Of ramps of several rates in one test, the slower ones are rounded less.
    slowest = min(_slowest_pace(shape) for shape in shapes)
    ends = max(lag.seconds - lag.shorter, 0.0) * slowest, lag.longest
    if ends[1] - ends[0] <= 0 or not any(item.rate > 0 for item in known):
        return np.array(ends[:1])
    # A filter of so many seconds shows so much flow where a sharp edge has none.
    shown = (ends[1] - ends[0]) * max(item.rate * item.slope for item in known) / math.e
    return np.linspace(*ends, int(np.clip(math.ceil(shown / (LAG_STEP * level)) + 1, 2, MOST_LAGS)))


def _slowest_pace(shape: BranchShape) -> float:
    """Return the pace of the slowest ramp of a branch over that of the fastest."""
    branch = shape.prepared.branch
    spans = [(np.ptp(branch.u[part]), branch.u[part].size) for part in branch.ramps if branch.u[part].size]
    paces = [float(span) / size for span, size in spans]
    return min(paces) / max(paces) if len(paces) > 1 and min(paces) > 0 else 1.0


def _fit(
    tests: Sequence[EdgeAverages],
    share: np.ndarray,
    width: np.ndarray,
    seconds: float,
    level: float,
    u_max: float,
) -> _Shapes:
    """Fit base, slope and knee of each test to every shape of a grid."""
    shares, widths = np.meshgrid(share, width, indexing="ij")
    squares = np.full(shares.shape, np.inf)
    at_level = np.zeros((len(tests), *shares.shape))
    largest = max(test.slope for test in tests) * shares * (1 - shares) * widths
    asked = largest > HARMLESS * level
    asked[0, 0] |= width[0] == 0  # a sharp edge, whatever its first part's share
    squares[asked] = 0.0
    for test, at in zip(tests, at_level, strict=True):
        left, knee, slope = fit_edges(test, shares[asked], widths[asked], seconds=seconds, u_max=u_max)
        squares[asked] += left
        of_first = level / (shares[asked] * slope)
        first = knee - (1 - shares[asked]) * widths[asked] + of_first
        at[asked] = np.where(of_first < widths[asked], first, knee + level / slope)
    return _Shapes(share=share, width=width, seconds=seconds, squares=squares, at_level=at_level)


def _finer(tests: Sequence[EdgeAverages], grid: _Shapes, level: float, u_max: float) -> _Shapes:
    """Return the shapes between the neighbours of the most credible one of a grid."""
    row, column = divmod(int(np.argmin(grid.squares)), grid.width.size)
    share, width = (
        np.linspace(axis[max(at - 1, 0)], axis[min(at + 1, axis.size - 1)], FINER)
        for axis, at in ((grid.share, row), (grid.width, column))
    )
    return _fit(tests, share, width, grid.seconds, level, u_max)


def _lowest_credible(grid: _Shapes, limit: float) -> np.ndarray:
    """Return the lowest commands at which the flow of each test reaches the level, V, (T,), of credible shapes.

    Credible are those whose sum of squares is within the limit; between two widths both run straight.
    """
    inside = grid.squares <= limit
    every = np.where(inside, grid.at_level, np.inf)
    lowest: np.ndarray = every.min(axis=(1, 2))
    for one, other in ((slice(None, -1), slice(1, None)), (slice(1, None), slice(None, -1))):
        ends = inside[:, one] & ~inside[:, other]
        if ends.any():
            squares = [grid.squares[:, part][ends] for part in (one, other)]
            part = (limit - squares[0]) / (squares[1] - squares[0])
            at = [grid.at_level[:, :, side][:, ends] for side in (one, other)]
            lowest = np.minimum(lowest, (at[0] + part * (at[1] - at[0])).min(axis=1))
    return lowest
