"""The linear model of one branch's ramps: a broken line over the pressure drop, a drift, and what is left as scatter.

    y[i] = f(p[i]) + d clock[i] + b[i] + e[i]

has the threshold y of ramp i with its own standard error (e), the curve f, straight between knots, the clock from
-1/2 at the first ramp of the series to 1/2 at the last, and the scatter b from ramp to ramp. A ramp weighs by the
scatter and its own error, so that a badly measured one moves the curve little. Knots follow from the pressures alone,
never from a threshold, so that ramps whose pressures were set by hand keep their degrees of freedom.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

#: Pressures within this share of themselves, and of the tested range, belong to one knot.
OF_PRESSURE, OF_RANGE = 0.12, 0.15
#: Where most ramps stand alone, from so many ramps on, this many share a knot, so that their scatter can be measured.
RAMPS_TO_SHARE, RAMPS_PER_KNOT = 7, 3
#: Squares of the clock that the curve can't explain from which a drift is told: two standard deviations of a ramp.
TELLS_DRIFT = 1 / 4
#: Smallest standard deviation of a ramp, V: an exact table has no error.
SMALLEST_SD = 1e-5


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramps:
    """Thresholds of the single ramps of one branch, all (n,)."""

    #: Pressure drop, MPa.
    dp_MPa: np.ndarray
    #: Threshold and its standard error by the ramp's own line, V.
    y: np.ndarray
    se: np.ndarray
    #: Place in the series, from -1/2 to 1/2; None where the order is unknown.
    clock: np.ndarray | None = None
    #: What systematic errors may move each threshold by, either way, V; None: by nothing.
    budget: np.ndarray | None = None
    #: What they may move all thresholds by together, V: the meter's lag does.
    shared: float = 0.0

    @property
    def budgets(self) -> np.ndarray:
        """What systematic errors may move each threshold by, either way, V (n,)."""
        return np.zeros(self.y.size) if self.budget is None else self.budget

    def only(self, kept: np.ndarray) -> "Ramps":
        """Return those ramps alone, of a mask (n,)."""
        parts = {name: getattr(self, name) for name in ("dp_MPa", "y", "se", "clock", "budget")}
        return replace(self, **{name: part[kept] for name, part in parts.items() if part is not None})


@dataclass(frozen=True, slots=True, kw_only=True)
class RampModel:
    """Least squares of the model; K knots, n ramps."""

    ramps: Ramps
    #: MPa (K,).
    knots_MPa: np.ndarray
    #: Whether the order of the ramps tells a drift.
    drift: bool
    #: Knot that each ramp is nearest to, (n,).
    knot: np.ndarray
    #: Variance from ramp to ramp, V²; beside an infinite one the ramps' own errors are nothing, and all weigh alike.
    scatter: float = np.inf

    @property
    def variances(self) -> np.ndarray:
        """Variance of each ramp by the scatter and its own error, V² (n,); 1 beside an infinite scatter."""
        if np.isinf(self.scatter):
            return np.ones(self.ramps.y.size)
        return np.maximum(self.scatter + self.ramps.se**2, SMALLEST_SD**2)

    @property
    def weights(self) -> np.ndarray:
        """Weights of the ramps in the curve at the knots, and after them in the drift (K [+ 1], n)."""
        return self.weigh(self._basis)

    @property
    def projector(self) -> np.ndarray:
        """What takes thresholds to their residuals (n, n)."""
        found: np.ndarray = np.eye(self.ramps.y.size) - self._basis @ self.weights
        return found

    @property
    def _basis(self) -> np.ndarray:
        return self.with_clock(broken_line(self.ramps.dp_MPa, self.knots_MPa))

    def with_clock(self, basis: np.ndarray) -> np.ndarray:
        """Return a basis (n, C) with a column for the drift, if there is one."""
        return np.column_stack([basis, self.ramps.clock]) if self.drift and self.ramps.clock is not None else basis

    def weigh(self, basis: np.ndarray) -> np.ndarray:
        """Return the weights (C, n) of the ramps in the coefficients of a basis (n, C), by least squares."""
        sd = np.sqrt(self.variances / self.variances.mean())
        found: np.ndarray = np.linalg.pinv(basis / sd[:, None]) / sd
        return found

    @property
    def residual(self) -> np.ndarray:
        """What the curve and the drift leave of the thresholds, V (n,)."""
        found: np.ndarray = self.projector @ self.ramps.y
        return found

    @property
    def free(self) -> np.ndarray:
        """Degrees of freedom of each residual (n,): its variance over that of the ramp."""
        return np.diag(self.projector)

    def at_knots(self, state: float = 0.0) -> np.ndarray:
        """Return the weights of the ramps in the curve at the knots (K, n), at a place in the series."""
        weights, count = self.weights, self.knots_MPa.size
        found: np.ndarray = weights[:count] + (state * weights[count] if self.drift else 0.0)
        return found

    @property
    def drift_V(self) -> float | None:
        """Change of the threshold over the series, V; None where the order does not tell it."""
        return float(self.weights[-1] @ self.ramps.y) if self.drift else None


def fit_ramp_model(ramps: Ramps, *, share_knots: bool) -> RampModel:
    """Fit the model, all ramps alike; `share_knots` lets ramps that stand alone share knots, to tell their scatter."""
    knots = find_knots(ramps.dp_MPa, share=share_knots and ramps.y.size >= RAMPS_TO_SHARE)
    basis = broken_line(ramps.dp_MPa, knots)
    drift = False
    if ramps.clock is not None:
        left = ramps.clock - basis @ np.linalg.lstsq(basis, ramps.clock, rcond=None)[0]
        drift = float(left @ left) > TELLS_DRIFT
    nearest = np.argmin(np.abs(ramps.dp_MPa[:, None] - knots), axis=1)
    return RampModel(ramps=ramps, knots_MPa=knots, drift=drift, knot=nearest)


def find_knots(dp_MPa: np.ndarray, *, share: bool) -> np.ndarray:
    """Return the knots, MPa: centres of pressures that belong together, the outer ones at the extremes.

    Pressures are gathered, the nearest first, while a group spans little. Where most then stand alone, `share` goes
    on to groups of three.
    """
    groups, span = [[each] for each in np.unique(dp_MPa)], max(float(np.ptp(dp_MPa)), 1e-9)
    fewest = dp_MPa.size
    while len(groups) > 1:
        spans = [
            (above[-1] - below[0]) / min(OF_PRESSURE * above[-1], OF_RANGE * span) for below, above in pairwise(groups)
        ]
        nearest = int(np.argmin(spans))
        if spans[nearest] > 1:
            if share and len(groups) > dp_MPa.size / 2:
                fewest = max(3, dp_MPa.size // RAMPS_PER_KNOT)
            if len(groups) <= fewest:
                break
        groups[nearest : nearest + 2] = [groups[nearest] + groups[nearest + 1]]
    inner = [float(np.mean(dp_MPa[(dp_MPa >= each[0]) & (dp_MPa <= each[-1])])) for each in groups[1:-1]]
    return np.array([dp_MPa.min(), *inner, dp_MPa.max()][: len(groups)])


def broken_line(dp_MPa: np.ndarray, knots_MPa: np.ndarray) -> np.ndarray:
    """Return the basis (n, K) of curves that are straight between the knots, and beyond the outer ones."""
    if knots_MPa.size == 1:
        return np.ones((dp_MPa.size, 1))
    left = np.clip(np.searchsorted(knots_MPa, dp_MPa) - 1, 0, knots_MPa.size - 2)
    share = (dp_MPa - knots_MPa[left]) / (knots_MPa[left + 1] - knots_MPa[left])
    basis, rows = np.zeros((dp_MPa.size, knots_MPa.size)), np.arange(dp_MPa.size)
    basis[rows, left], basis[rows, left + 1] = 1 - share, share
    return basis
