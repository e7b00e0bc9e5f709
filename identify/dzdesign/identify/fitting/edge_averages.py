"""`EdgeAverages`: the readings about the edge of one test's branch, averaged over short stretches of the command."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.knees.branch_shape import BranchShape
from dzdesign.identify.knees.gated_line import GATE

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
