"""How far below the knee the flow still exceeds the level, as far as the recordings can tell: the shape of the edge.

An edge may open with a part of its flow gain before it opens with all of it (a notch, a rounded land). Of all edges
whose gain only grows as they open, and that pass a given flow at a given command, the one that is hardest to see opens
in two straight parts: from where it closes, with a share of the gain over a width, and then with all of it. The
recordings of all tests, which one edge has made, say which shares and widths are credible. The meter's lag rounds a
sharp edge too, so each is asked with every lag that the meter may have.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM
from dzdesign.identify.knees.branch_shape import BranchShape
from dzdesign.identify.knees.gated_line import GATE
from dzdesign.identify.knees.meter_lag import MeterLag

#: Shares of the flow gain, and widths over u_max, that the first part may have.
SHARES, WIDTHS = np.array([0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]), np.geomspace(3e-3, 0.2, 11)
#: Times that the grid is refined about the most credible shape, and points of the finer grid in each direction.
REFINED, FINER = 3, 5
#: A first part whose largest flow is less than this share of the level is as good as none.
HARMLESS = 0.5
#: Readings are averaged over this share of u_max from so far below the knee to so far above, and over more beyond.
FINE, BELOW, ABOVE, COARSE = 2e-3, 0.06, 0.08, 1e-2
#: How far below the knee they are averaged at all, over u_max.
LOWEST = 0.25
#: Rounds in which base, slope and knee of each test are fitted for a shape; fewest averages for that.
ROUNDS, FEWEST = 3, 8
#: The knee moves by at most this share of u_max in a round.
LARGEST_STEP = 0.03
#: Readings up to this multiple of a meter's floor, from so far below the knee on (over u_max), of which this share
#: lies below the floor's estimate and this share of the floor is noise.
NEAR_FLOOR, FROM, LOWEST_SHARE, PEAKS = 1.2, 0.03, 0.1, 0.3
#: Averages over which the scatter of readings near a floor, some of them zeros, is smoothed.
SMOOTHED = 5
#: Noise of a shut reading over that of a flowing one, at least; and share of an average's width by which the two
#: straight parts miss the mean over it.
QUIETEST, CORNER = 0.3, 0.1


@dataclass(frozen=True, slots=True)
class Softness:
    """How far below each test's knee the flow still exceeds the level, V, (T,): most likely, and at most."""

    likely: np.ndarray
    at_most: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class _Averages:
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


def find_softness(
    shapes: Sequence[BranchShape], knees: np.ndarray, *, level: float, lag: MeterLag, confidence: float, u_max: float
) -> Softness:
    """Find how far below the knees (V, (T,)) of one branch the flow may exceed the level (m³/s)."""
    from scipy.special import stdtrit

    floor = _floor(shapes, u_max)
    averages = [_average(shape, floor, u_max) for shape in shapes]
    known = [item for item in averages if item is not None]
    if not known:
        return Softness(np.zeros(knees.size), np.zeros(knees.size))
    width = np.concatenate([[0.0], WIDTHS * u_max])
    grids = [_fit(known, SHARES, width, seconds, level, u_max) for seconds in _lags(lag, shapes)]
    best = _best(grids)
    for _ in range(REFINED):
        if best.width[np.argmin(best.squares.min(axis=0))] == 0:
            break
        grids.append(_finer(known, best, level, u_max))
        best = _best(grids)
    least = float(best.squares.min())
    # Where no shape fits as well as the noise allows, all of them are judged by what the best one leaves.
    left = max(least / max(sum(item.u.size - 3 for item in known), 1), 1.0)
    credible = float(stdtrit(DEGREES_OF_FREEDOM, confidence)) ** 2 * left
    at = np.unravel_index(int(np.argmin(best.squares)), best.squares.shape)
    likely = best.at_level[(slice(None), *at)]
    lowest = np.min([likely, *(_lowest_credible(grid, least + credible) for grid in grids)], axis=0)
    told = np.array([item is not None for item in averages])
    found = []
    for command in (likely, lowest):
        below = np.maximum(knees[told] - command, 0.0)
        # One edge has made all tests: one that tells nothing by itself has what the others have.
        every = np.full(knees.size, below.max())
        every[told] = below
        found.append(every)
    return Softness(*found)


def _best(grids: Sequence[_Shapes]) -> _Shapes:
    """Return the grid that has the most credible shape of all."""
    return min(grids, key=lambda grid: float(grid.squares.min()))


def _lags(lag: MeterLag, shapes: Sequence[BranchShape]) -> list[float]:
    """Return the lags, s, that the meter may have: the shortest, the one taken and the longest."""
    shortest = max(lag.seconds - lag.shorter, 0.0)
    # Of ramps of several rates in one test, the slower ones are rounded less.
    paces = [_slowest_pace(shape) for shape in shapes]
    return sorted({shortest * min(paces, default=1.0), lag.seconds, lag.seconds + lag.longer})


def _slowest_pace(shape: BranchShape) -> float:
    """Return the pace of the slowest ramp of a branch over that of the fastest."""
    branch = shape.prepared.branch
    spans = [(np.ptp(branch.u[part]), branch.u[part].size) for part in branch.ramps if branch.u[part].size]
    paces = [float(span) / size for span, size in spans]
    return min(paces) / max(paces) if len(paces) > 1 and min(paces) > 0 else 1.0


def _floor(shapes: Sequence[BranchShape], u_max: float) -> float:
    """Return the smallest flow that the meter shows, m³/s, which is below the floor that is on the safe side; or 0."""
    floor = shapes[0].prepared.floor
    seen = []
    for shape in shapes:
        u, q = shape.prepared.branch.u, shape.prepared.branch.q
        seen.append(q[(u > shape.line.knee - FROM * u_max) & (q > PEAKS * floor) & (q < NEAR_FLOOR * floor)])
    readings = np.concatenate(seen)
    return min(floor, float(np.quantile(readings, LOWEST_SHARE))) if floor > 0 and readings.size >= FEWEST else floor


def _average(shape: BranchShape, floor: float, u_max: float) -> _Averages | None:
    """Average the readings about the knee; None where too few are left."""
    read, line = shape.prepared, shape.line
    u, y = read.branch.u, read.y
    top = float(u[line.kept].max())
    noise = max(shape.noise, QUIETEST * shape.sigma)
    furthest = max(GATE * max(noise, shape.sigma), NEAR_FLOOR * floor) + COARSE * u_max * shape.slope
    near = np.abs(y - np.interp(u, *read.profile)) <= furthest
    ends = [line.knee + share * u_max for share in (-LOWEST, -BELOW, ABOVE)] + [top + COARSE * u_max]
    edges = np.concatenate(
        [np.arange(*ends[at : at + 2], width * u_max) for at, width in enumerate((COARSE, FINE, COARSE))]
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
    return _Averages(
        u=u_mean,
        y=y_mean,
        weight=1 / (of_noise + (CORNER * FINE * u_max * shape.slope) ** 2),
        knee=line.knee,
        slope=shape.slope,
        floor=floor,
        noise=max(shape.sigma, np.finfo(float).tiny),
        signed=bool(np.any(y < -PEAKS * floor)),
        rising=read.branch.rising,
        rate=read.branch.rate if math.isfinite(read.branch.rate) else 0.0,
    )


def _fit(
    tests: Sequence[_Averages],
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
        left, knee, slope = _fit_test(test, shares[asked], widths[asked], seconds, LARGEST_STEP * u_max)
        squares[asked] += left
        of_first = level / (shares[asked] * slope)
        first = knee - (1 - shares[asked]) * widths[asked] + of_first
        at[asked] = np.where(of_first < widths[asked], first, knee + level / slope)
    return _Shapes(share=share, width=width, seconds=seconds, squares=squares, at_level=at_level)


def _fit_test(
    test: _Averages, share: np.ndarray, width: np.ndarray, seconds: float, largest: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return sum of squares, knee (V) and slope of one test's fits to H shapes, each (H,)."""
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
        flow = share[:, None] * _reading(x + first[:, None], shift, rising=test.rising)
        gain = share[:, None] * _reading_gain(x + first[:, None], shift, rising=test.rising)
        flow += (1 - share)[:, None] * _reading(x - second[:, None], shift, rising=test.rising)
        gain += (1 - share)[:, None] * _reading_gain(x - second[:, None], shift, rising=test.rising)
        shown, part = _above_floor(test, slope[:, None] * flow)
        columns = [part * flow * root, -part * slope[:, None] * gain * root]
        if test.floor == 0:
            columns.append(np.broadcast_to(root, x.shape))
        missed = (test.y - shown - base[:, None]) * root
        design = np.stack(columns, axis=1)  # (H, P, B)
        right = (design @ missed[:, :, None])[:, :, 0]
        normal = design @ design.transpose(0, 2, 1)
        scale = np.sqrt(np.maximum(np.einsum("hpp->hp", normal), np.finfo(float).tiny))
        normal = normal / scale[:, :, None] / scale[:, None, :] + 1e-12 * np.eye(len(columns))
        step = np.linalg.solve(normal, (right / scale)[:, :, None])[:, :, 0] / scale
        squares = np.einsum("hb,hb->h", missed, missed) - np.einsum("hp,hp->h", step, right)
        slope = np.clip(slope + step[:, 0], 0.5 * test.slope, 2 * test.slope)
        knee = knee + np.clip(step[:, 1], -largest, largest)
        base = base + step[:, 2] if test.floor == 0 else base
    return np.maximum(squares, 0.0), knee, slope


def _above_floor(test: _Averages, flow: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
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


def _reading(x: np.ndarray, shift: float, *, rising: bool) -> np.ndarray:
    """Return what a first-order meter shows of a flow of unit slope from x = 0 on; `shift` is rate times lag, V."""
    if shift <= 0:
        return np.maximum(x, 0.0)
    if rising:
        ahead = np.maximum(x, 0.0)
        return ahead + shift * np.expm1(-ahead / shift)
    return np.maximum(x, 0.0) + shift * np.exp(np.minimum(x, 0.0) / shift)


def _reading_gain(x: np.ndarray, shift: float, *, rising: bool) -> np.ndarray:
    """Return its derivative."""
    if shift <= 0:
        return (x > 0).astype(float)
    if rising:
        return -np.expm1(-np.maximum(x, 0.0) / shift)
    return np.exp(np.minimum(x, 0.0) / shift)


def _finer(tests: Sequence[_Averages], grid: _Shapes, level: float, u_max: float) -> _Shapes:
    """Return the shapes between the neighbours of the most credible one of a grid."""
    axes = [
        np.linspace(axis[max(at - 1, 0)], axis[min(at + 1, axis.size - 1)], FINER)
        for axis, at in zip(
            (grid.share, grid.width), np.unravel_index(int(np.argmin(grid.squares)), grid.squares.shape), strict=True
        )
    ]
    return _fit(tests, axes[0], axes[1], grid.seconds, level, u_max)


def _lowest_credible(grid: _Shapes, limit: float) -> np.ndarray:
    """Return the lowest commands at which the flow of each test reaches the level, V, (T,), of credible shapes.

    Credible are those whose sum of squares is within the limit; between two widths both run straight.
    """
    inside = grid.squares <= limit
    every = np.where(inside, grid.at_level, np.inf)
    lowest = every.min(axis=(1, 2))
    for one, other in ((slice(None, -1), slice(1, None)), (slice(1, None), slice(None, -1))):
        ends = inside[:, one] & ~inside[:, other]
        if ends.any():
            squares = [grid.squares[:, part][ends] for part in (one, other)]
            part = (limit - squares[0]) / (squares[1] - squares[0])
            at = [grid.at_level[:, :, side][:, ends] for side in (one, other)]
            lowest = np.minimum(lowest, (at[0] + part * (at[1] - at[0])).min(axis=1))
    return lowest
