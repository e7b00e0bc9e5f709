"""The class of curves that a threshold over the pressure drop may be: rows of a linear programme on a grid.

No test of the data chooses it. Where nothing is declared, what bends between the tests is bounded by what bends from
test to test: between two neighbouring tests the threshold has at most one kink, or bends smoothly by at most twice the
larger neighbour's bend. A kink changes the slopes of the chords at both ends, by a and b, and lies at most
H a b / (a + b) below its own chord, H wide; a smooth bend H max(a, b) / 4. In an outer interval one change is known:
there the curve lies above the next chord, continued. Declared instead: a straight line, a second difference of at most
M, or a direction alone.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from dzdesign.identify.fit.ramp_model import broken_line
from dzdesign.identify.fit.scatter import Scatter

#: `bends` is estimated, the next three are declared, `points` says nothing between the tests.
Kind = Literal["bends", "line", "smooth", "monotone", "points"]
#: Points of the grid that divide the tested range, beside knots and the ramps' pressures.
GRID = 25
#: Grid points nearer than this share of the range are one.
NEAREST = 0.003
#: Pressures of the grid are rounded to so many decimals, MPa: valve.json's.
DECIMALS = 7
#: Fewest knots that show a bend.
FEWEST_FOR_BENDS = 3
#: From so many degrees of freedom on, Student's law is the normal one.
LARGEST_DEGREES = 1e6


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveClass:
    """Curves g on a grid (N,) with low <= a g <= high, and what they may do between its points."""

    kind: Kind
    #: MPa, rising.
    grid_MPa: np.ndarray
    #: V, or V/MPa.
    a: np.ndarray
    low: np.ndarray
    high: np.ndarray
    #: M in each cell (N - 1,), V/MPa²; infinite where a direction alone is known.
    density: np.ndarray
    #: By how much the curve may fall at once beyond an outer test, V (N,).
    at_ends: np.ndarray
    #: -1 falls, +1 rises, 0 free.
    direction: int = 0
    #: Of `bends`, the change of slope allowed at each inner knot, V/MPa: downwards and upwards (2, K - 2).
    change: np.ndarray | None = None

    def rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return A, low and high of all rows, those of the direction last."""
        if not self.direction:
            return self.a, self.low, self.high
        steps = self.direction * np.diff(np.eye(self.grid_MPa.size), axis=0)
        none, free = np.zeros(len(steps)), np.full(len(steps), np.inf)
        return np.vstack([self.a, steps]), np.append(self.low, none), np.append(self.high, free)

    def under_chords(self, least: np.ndarray) -> np.ndarray:
        """Bring least values at the grid points so far down that no curve passes below the chords between them."""
        known = np.isfinite(self.density)
        sag = np.where(known, self.density, 0.0) * np.diff(self.grid_MPa) ** 2 / 8
        found: np.ndarray = least - np.maximum(np.append(sag, 0.0), np.append(0.0, sag)) - self.at_ends
        if known.all():
            return found
        # Of a direction alone all between two points lies above the lower end.
        next_one = np.append(found[1:], np.inf) if self.direction < 0 else np.append(np.inf, found[:-1])
        lowest: np.ndarray = np.minimum(found, next_one)
        return lowest


def find_class(scatter: Scatter, *, curve: Kind | None, curvature: float | None, direction: int = 0) -> CurveClass:
    """Return the class of a branch's thresholds.

    Parameters
    ----------
    scatter : Scatter
        Of its ramps.
    curve : {"line", "smooth", "monotone"} or None
        What is declared.
    curvature : float or None
        M that is declared, V/MPa², beside `smooth`.
    direction : int
        Which way the threshold is known to run: -1, +1, or 0 where it is not.
    """
    knots = scatter.model.knots_MPa
    if curve is None:
        if knots.size < FEWEST_FOR_BENDS:
            return _nothing_between(knots)
        return _estimated(scatter)
    grid = make_grid(knots, scatter.model.ramps.dp_MPa)
    width = np.diff(grid)
    points = np.eye(grid.size)
    if curve == "monotone":
        free = np.full(width.size, np.inf)
        return CurveClass(kind=curve, grid_MPa=grid, a=np.zeros((0, grid.size)), low=np.zeros(0), high=np.zeros(0),
                          density=free, at_ends=np.zeros(grid.size), direction=direction)  # fmt: skip
    density = np.full(width.size, (curvature or 0.0) if curve == "smooth" else 0.0)
    limit = (density[1:] * width[1:] + density[:-1] * width[:-1]) / 2
    bends = np.diff(np.diff(points, axis=0) / width[:, None], axis=0)
    return CurveClass(kind=curve, grid_MPa=grid, a=bends, low=-limit, high=limit, density=density,
                      at_ends=np.zeros(grid.size))  # fmt: skip


def one_way(curves: CurveClass) -> tuple[CurveClass, ...]:
    """Return the classes whose union it is: of a direction that is not known, that which falls and that which rises."""
    if curves.kind != "monotone" or curves.direction or curves.grid_MPa.size < 2:
        return (curves,)
    return tuple(replace(curves, direction=direction) for direction in (-1, 1))


def make_grid(knots_MPa: np.ndarray, dp_MPa: np.ndarray) -> np.ndarray:
    """Return the knots, the ramps' pressures and points between them, MPa, without near neighbours."""
    kept, span = list(np.round(knots_MPa, DECIMALS)), float(np.ptp(dp_MPa))
    for each in np.round([*np.unique(dp_MPa), *np.linspace(dp_MPa.min(), dp_MPa.max(), GRID)], DECIMALS):
        inside = kept[0] < each < kept[len(knots_MPa) - 1]
        if inside and np.min(np.abs(np.array(kept) - each)) > NEAREST * span:
            kept.append(each)
    return np.sort(kept)


def _nothing_between(knots_MPa: np.ndarray) -> CurveClass:
    """Return the class of one test, or of two between which nothing is declared: it is known at the tests alone."""
    count = knots_MPa.size
    return CurveClass(kind="points", grid_MPa=np.round(knots_MPa, DECIMALS), a=np.zeros((0, count)), low=np.zeros(0),
                      high=np.zeros(0), density=np.zeros(count - 1), at_ends=np.zeros(count))  # fmt: skip


def _estimated(scatter: Scatter) -> CurveClass:
    """Return the class that the bends from test to test give; a change is the fitted one and half its error, or one."""
    model = scatter.model
    gap = np.diff(model.knots_MPa)
    weights = np.diff(np.diff(model.at_knots(), axis=0) / gap[:, None], axis=0)
    found = weights @ model.ramps.y
    error = np.sqrt(np.sum(weights**2 * scatter.of_ramps, axis=1))
    # Slopes of the chords that change downwards and upwards by at most so much, V/MPa.
    change = np.array([np.maximum(sign * found + error / 2, error) for sign in (-1, 1)])
    return class_of_bends(model.knots_MPa, make_grid(model.knots_MPa, model.ramps.dp_MPa), change)


def class_of_bends(knots_MPa: np.ndarray, grid_MPa: np.ndarray, change: np.ndarray) -> CurveClass:
    """Return the class in which the slopes of the chords change at the inner knots by at most `change` (2, K - 2).

    What the grid's points may lie off the chords of their knots by, and the changes at the knots, are rows.
    """
    knots = np.round(knots_MPa, DECIMALS)
    gap, count, points = np.diff(knots), knots.size, np.eye(grid_MPa.size)
    cell = np.clip(np.searchsorted(knots, grid_MPa) - 1, 0, count - 2)
    place = (grid_MPa - knots[cell]) / gap[cell]
    at = points[np.searchsorted(grid_MPa, knots)]
    outer, from_end = (cell == 0) | (cell == count - 2), np.where(cell == 0, place, 1 - place)
    off_chord = []
    for bend in change:
        left, right = bend[:-1], bend[1:]
        between = np.maximum(4 * left * right / (left + right), np.maximum(left, right))
        most = np.concatenate([[bend[0]], between, [bend[-1]]]) * gap
        shape = np.where(outer, (1 - from_end) * np.maximum(1, 2 * from_end), place * (1 - place))
        off_chord.append(most[cell] * shape)
    density = ((2 * most / gap**2)[cell] * np.where(outer, 2, 1))[1:]
    inside, ends = ~np.isin(grid_MPa, knots), np.isin(grid_MPa, knots[[0, -1]])
    above, below = off_chord
    second = np.diff(np.diff(at, axis=0) / gap[:, None], axis=0)
    chords = (points - broken_line(grid_MPa, knots) @ at)[inside]
    return CurveClass(
        kind="bends",
        grid_MPa=grid_MPa,
        a=np.vstack([chords, second]),
        low=np.append(-below[inside], -change[0]),
        high=np.append(above[inside], change[1]),
        density=density,
        at_ends=np.where(ends, below, 0.0),
        change=change,
    )


def lack_of_fit(scatter: Scatter, *, curve: Kind, curvature: float | None, direction: int = 0) -> float | None:
    """Return the probability of tests as unlike a declared premise as these if it were true; None: they can't tell.

    `line`: an F test of the knots about the line. `smooth`: the largest change of slope beyond M. `monotone`: the
    largest step against the direction, of one that is not known the likelier. The latter two with Bonferroni.
    """
    from scipy.special import fdtrc, stdtr

    model = scatter.model
    knots, weights = model.knots_MPa, model.at_knots()
    if knots.size < FEWEST_FOR_BENDS:
        return None
    values, degrees = weights @ model.ramps.y, min(scatter.degrees, LARGEST_DEGREES)
    covariance = (weights * scatter.of_ramps) @ weights.T
    if curve == "line":
        line = np.column_stack([np.ones(knots.size), knots])
        inverse = np.linalg.inv(covariance)
        left = values - line @ np.linalg.solve(line.T @ inverse @ line, line.T @ inverse @ values)
        return float(fdtrc(knots.size - 2, degrees, float(left @ inverse @ left) / (knots.size - 2)))
    if curve == "smooth":
        rows = 2 * np.diff(np.diff(np.eye(knots.size), axis=0) / np.diff(knots)[:, None], axis=0)
        rows /= (knots[2:] - knots[:-2])[:, None]
        beyond = rows @ values - (curvature or 0.0)
    else:
        pairs = np.triu_indices(knots.size, 1)
        rows = np.eye(knots.size)[pairs[1]] - np.eye(knots.size)[pairs[0]]
        if not direction:
            each = [lack_of_fit(scatter, curve=curve, curvature=None, direction=way) for way in (-1, 1)]
            return max(p_value for p_value in each if p_value is not None)
        beyond = -direction * (rows @ values)
    error = np.sqrt(np.einsum("ni,ij,nj->n", rows, covariance, rows))
    largest = float(np.max(beyond / np.maximum(error, np.finfo(float).tiny)))
    return float(min(1.0, len(rows) * stdtr(degrees, -largest)))
