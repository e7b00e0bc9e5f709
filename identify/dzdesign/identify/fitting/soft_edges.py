"""How far below the knee the flow still exceeds the level, as far as the recordings can tell: the shape of the edge.

An edge may open with a part of its flow gain before it opens with all of it (a notch, a rounded land). Of all edges
whose gain only grows as they open, and that pass a given flow at a given command, the one that is hardest to see opens
in two straight parts: from where it closes, with a share of the gain over a width, and then with all of it. The
recordings of all tests, which one edge has made, say which shares and widths are credible. The meter's lag rounds a
sharp edge too, so each is asked with every lag that the meter may have.

Readings about the edge are averaged over short stretches of the command, and base, slope and knee of each such edge are
fitted to them: what a slow meter with a floor would show of it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.identify.knees.gated_line import GATE, BranchShape
from dzdesign.identify.knees.line_fitting import DEGREES_OF_FREEDOM
from dzdesign.identify.knees.meter import MeterLag

#: Shares of the flow gain, and widths over u_max, that the first part may have.
SHARES, WIDTHS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]), np.geomspace(3e-3, 0.2, 11)
#: Times that the grid is refined about the most credible shape, and points of the finer grid in each direction.
REFINED, FINER = 3, 5
#: A first part whose largest flow is less than this share of the level is as good as none.
HARMLESS = 0.5
#: Neighbouring lags differ by what rounds a sharp edge by this share of the level, but there are no more than these.
LAG_STEP, MOST_LAGS = 0.3, 8

#: Readings are averaged over this share of u_max from so far below the knee to so far above, and over more beyond.
FINE, BELOW, ABOVE, COARSE = 2e-3, 0.06, 0.08, 1e-2
#: How far below the knee they are averaged at all, over u_max.
LOWEST = 0.25
#: Fewest averages, or readings, that tell an edge.
FEWEST = 8
#: Readings up to this multiple of a meter's floor, from so far below the knee on (over u_max): this share of them lies
#: below its estimate, and what is below this share of the floor is noise.
NEAR_FLOOR, FROM, LOWEST_SHARE, PEAKS = 1.2, 0.03, 0.1, 0.3
#: Noise below this share of a floor makes no difference.
FINEST = 1e-3
#: Averages over which the scatter of readings near a floor, some of them zeros, is smoothed.
SMOOTHED = 5
#: Noise of a shut reading over that of a flowing one, at least; and share of an average's width by which straight parts
#: that meet inside it miss the mean over it.
QUIETEST, CORNER = 0.3, 0.1

#: Rounds in which base, slope and knee are fitted, and share of u_max by which the knee moves at most in one.
ROUNDS, LARGEST_STEP = 3, 0.03
#: The slope may be that of the straight part divided or multiplied by this.
OTHER_SLOPE = 2.0
#: Added to the scaled normal equations, so that columns that are alike can be told apart.
RIDGE = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeAverages:
    """Averages of one test's branch; commands in V, flows in m³/s, weights in s²/m⁶, each (B,)."""

    u: np.ndarray
    y: np.ndarray
    weight: np.ndarray
    #: Where the fits start from, V and m³/(s V).
    knee: float
    slope: float
    #: The meter's floor, 0 if it has none: then what it reads while the valve is shut is fitted too; its noise, m³/s.
    floor: float
    noise: float
    #: Whether the meter shows negative flows beyond its floor.
    signed: bool
    rising: bool
    #: Pace of the command, V/s.
    rate: float


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


# ---------------------------------------------------------------------------------------------- averages about the edge
def smallest_flow_shown(shapes: Sequence[BranchShape], u_max: float) -> float:
    """Return the smallest flow that the meter shows, m³/s, which is below the floor that is on the safe side; or 0."""
    floor = shapes[0].prepared.floor
    seen = []
    for shape in shapes:
        u, q = shape.prepared.branch.u, shape.prepared.branch.q
        seen.append(q[(u > shape.line.knee - FROM * u_max) & (q > PEAKS * floor) & (q < NEAR_FLOOR * floor)])
    readings = np.concatenate(seen)
    return min(floor, float(np.quantile(readings, LOWEST_SHARE))) if floor > 0 and readings.size >= FEWEST else floor


def average_about_edge(shape: BranchShape, floor: float, u_max: float) -> EdgeAverages | None:
    """Average the readings about the knee; None where too few are left."""
    read, line = shape.prepared, shape.line
    u, y = read.branch.u, read.y
    top = float(u[line.kept].max())
    noise = max(shape.noise, QUIETEST * shape.sigma)
    furthest = max(GATE * max(noise, shape.sigma), NEAR_FLOOR * floor) + COARSE * u_max * shape.slope
    near = np.abs(y - np.interp(u, *read.profile)) <= furthest
    ends = [line.knee + share * u_max for share in (-LOWEST, -BELOW, ABOVE)] + [top + COARSE * u_max]
    edges = np.concatenate(
        [np.arange(ends[at], ends[at + 1], width * u_max) for at, width in enumerate((COARSE, FINE, COARSE))]
    )
    rows = (u >= edges[0]) & (u <= top) & near
    if rows.sum() < FEWEST or edges.size < FEWEST:
        return None
    index = np.searchsorted(edges, u[rows], side="right")
    count = np.bincount(index)
    filled = count > 0
    u_mean, y_mean = (np.bincount(index, weights=values[rows])[filled] / count[filled] for values in (u, y))
    if u_mean.size < FEWEST:
        return None
    variance = np.where(u_mean < line.knee, noise, shape.sigma) ** 2
    if floor > 0:
        scatter = np.bincount(index, weights=y[rows] ** 2)[filled] / count[filled] - y_mean**2
        variance = np.maximum(variance, np.convolve(scatter, np.full(SMOOTHED, 1 / SMOOTHED), "same"))
    of_noise = variance * shape.variance_inflation / count[filled]
    return EdgeAverages(
        u=u_mean,
        y=y_mean,
        weight=1 / (of_noise + (CORNER * FINE * u_max * shape.slope) ** 2),
        knee=line.knee,
        slope=shape.slope,
        floor=floor,
        noise=max(shape.sigma, FINEST * floor),
        signed=bool(np.any(y < -PEAKS * floor)),
        rising=read.branch.rising,
        rate=read.branch.rate if math.isfinite(read.branch.rate) else 0.0,
    )


# ----------------------------------------------------------------------------------------------- the edges' fits
def fit_edges(
    test: EdgeAverages, share: np.ndarray, width: np.ndarray, *, seconds: float, u_max: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return sum of squares, knee (V) and slope (m³/(s V)) of the fits of H edges to one test, each (H,).

    An edge opens with a `share` (H,) of its flow gain over a `width` (H,), V, and then with all of it; the knee is
    where its last part comes to zero. The meter has a lag of so many seconds.
    """
    knee, slope = np.full(share.size, test.knee), np.full(share.size, test.slope)
    shift = seconds * test.rate
    # The knee is that of readings put right for this lag, as the other knees are for theirs: how the two differ is in
    # the bounds already.
    u = test.u + (shift if test.rising else -shift)
    first, second = (1 - share) * width, share * width
    base = np.zeros(share.size)
    root = np.sqrt(test.weight)
    for _ in range(ROUNDS):
        x = u - knee[:, None]
        before, gain_before = _reading(x + first[:, None], shift, rising=test.rising)
        beyond, gain_beyond = _reading(x - second[:, None], shift, rising=test.rising)
        flow = share[:, None] * before + (1 - share)[:, None] * beyond
        gain = share[:, None] * gain_before + (1 - share)[:, None] * gain_beyond
        shown, part = _above_floor(test, slope[:, None] * flow)
        columns = [part * flow * root, -part * slope[:, None] * gain * root]
        if test.floor == 0:
            columns.append(np.broadcast_to(root, x.shape))
        missed = (test.y - shown - base[:, None]) * root
        design = np.stack(columns, axis=1)  # (H, P, B)
        right = (design @ missed[:, :, None])[:, :, 0]
        normal = design @ design.transpose(0, 2, 1)
        scale = np.sqrt(np.maximum(np.einsum("hpp->hp", normal), np.finfo(float).tiny))
        normal = normal / scale[:, :, None] / scale[:, None, :] + RIDGE * np.eye(len(columns))
        step = np.linalg.solve(normal, (right / scale)[:, :, None])[:, :, 0] / scale
        squares = np.einsum("hb,hb->h", missed, missed) - np.einsum("hp,hp->h", step, right)
        slope = np.clip(slope + step[:, 0], test.slope / OTHER_SLOPE, OTHER_SLOPE * test.slope)
        knee = knee + np.clip(step[:, 1], -LARGEST_STEP * u_max, LARGEST_STEP * u_max)
        base = base + step[:, 2] if test.floor == 0 else base
    return np.maximum(squares, 0.0), knee, slope


def _above_floor(test: EdgeAverages, flow: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
    """Return what a meter shows of a flow on average that reads zero below its floor, and its derivative."""
    if test.floor == 0:
        return flow, 1.0
    from scipy.special import ndtr

    above, below = (flow - test.floor) / test.noise, (-flow - test.floor) / test.noise
    seen, edge = ndtr(above), np.exp(-(above**2) / 2)
    other, other_edge = (ndtr(below), np.exp(-(below**2) / 2)) if test.signed else (0.0, 0.0)
    density = 1 / math.sqrt(2 * math.pi)
    shown = flow * (seen + other) + test.noise * density * (edge - other_edge)
    return shown, seen + other + test.floor / test.noise * density * (edge + other_edge)


def _reading(x: np.ndarray, shift: float, *, rising: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return what a first-order meter shows of a flow of unit slope from x = 0 on, and its derivative.

    `shift` is the rate times the lag, V.
    """
    ahead = np.maximum(x, 0.0)
    if shift <= 0:
        return ahead, (x > 0).astype(float)
    if rising:
        gain = 1 - np.exp(-ahead / shift)
        return ahead - shift * gain, gain
    gain = np.exp(np.minimum(x, 0.0) / shift)
    return ahead + shift * gain, gain
