"""What differs from ramp to ramp: each ramp's own knee, the scatter that repeats show, and a drift through the series.

The noise of one ramp says how well that ramp's knee is known, and nothing of where the valve closes the next time. The
knees of the single ramps obey the model of `fit.ramp_model`; `fit.scatter` measures their scatter. Here the ramps are
brought to the state in the middle of the series, so that those pooled to one test lie on one line, and held against the
premises of that model: independent, of one population. Each check is exact, or nearly so, for few repeats of
a normal scatter, and none of them sees everything.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dzdesign.identify.constants import REFUSED
from dzdesign.identify.fit.ramp_model import RampModel, Ramps, fit_ramp_model
from dzdesign.identify.fit.scatter import Scatter, measure_scatter
from dzdesign.identify.knees.gated_line import BranchShape, straight_line
from dzdesign.identify.options import IdentifyOptions

#: A ramp tells its own knee with at least so many samples, over this share of the straight part.
RAMP_SAMPLES, RAMP_SPAN = 5, 0.5
#: Decimals of valve.json: the ramps are rounded before they are fitted, so that a reader finds the same bound.
DECIMALS = 7
#: Fewest degrees of freedom in which neighbouring ramps can be told to be alike.
FEWEST_IN_A_ROW = 4
#: Probability of two groups of ramps below which they are no chance, and the fewest ramps of a test that is parted.
PARTED, FEWEST_TO_PART = 1e-3, 3
#: Degrees of freedom below the one, and squares over those of the noise below the other, are rounding.
NO_DEGREES, NOTHING = 1e-6, 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class RampKnees:
    """Knees of the single ramps of one branch, (R,). A test of which no ramp tells its knee counts as one ramp."""

    #: Test of each, and which ramp of it, from 0; -1 where it stands for its test.
    test: np.ndarray
    number: np.ndarray
    #: V, and the standard error that the noise gives it, V.
    knee: np.ndarray
    se: np.ndarray
    #: When it was recorded, s on a clock common to all; NaN where that is not known.
    when: np.ndarray
    #: Its name.
    source: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class TwoGroups:
    """Ramps of two populations: of two sides, two benches, or a valve that closes at two places."""

    #: Distance of their thresholds, V, mean over the tests.
    apart: float
    #: Test and number in it of one ramp of each, in one test, that of the lower threshold first.
    ramps: tuple[tuple[int, int], tuple[int, int]]


@dataclass(frozen=True, slots=True, kw_only=True)
class ScatterChecks:
    """What the ramps of one branch say against the premises; None where they don't."""

    #: Correlation of neighbouring ramps.
    serial: float | None = None
    groups: TwoGroups | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BetweenRamps:
    """What the ramps of one branch show; n ramps, T tests."""

    #: Their knees with the numbers that valve.json will have, the test of each (n,), and their names.
    ramps: Ramps
    test: np.ndarray
    sources: tuple[str, ...]
    scatter: Scatter
    #: By how much each ramp of each test stands off the middle of the series and of its test's ramps, V.
    shifts: tuple[np.ndarray, ...]
    #: What the ramps say against the premises.
    checks: ScatterChecks

    def variance_of_next(self, *, noise: bool = True) -> np.ndarray:
        """Return the variance of the next closing (or opening) less the mean of each test's ramps, V² (T,).

        Without `noise`, less a threshold in whose error that of the ramps is already.
        """
        of_next, count = self.scatter.share * self.scatter.variance, np.bincount(self.test)
        own = self.scatter.model.scatter + np.bincount(self.test, self.ramps.se**2) / count
        found: np.ndarray = of_next + (own if noise else of_next) / count
        return found


def knees_of_ramps(
    shapes: Sequence[BranchShape],
    names: Sequence[tuple[str, ...]],
    when: Sequence[Sequence[float]],
) -> RampKnees:
    """Return the zeros of lines through each ramp's samples of the straight part that the test's line rests on.

    `names` has that of each ramp of each test, `when` the time of its recording, s, on one clock for all.
    """
    rows, sources = list[tuple[float, ...]](), list[str]()
    for test, (shape, times) in enumerate(zip(shapes, when, strict=True)):
        branch, seen, told = shape.prepared.branch, shape.line.kept & ~shape.line.censored, len(rows)
        width = float(np.ptp(branch.u[seen]))
        for number, part in enumerate(branch.ramps):
            u, y = branch.u[part][seen[part]], shape.prepared.y[part][seen[part]]
            if u.size < RAMP_SAMPLES or np.ptp(u) < RAMP_SPAN * width:
                continue
            slope, knee = straight_line(u, y)
            if slope <= 0:
                continue
            lever = 1 / u.size + (u.mean() - knee) ** 2 / float(np.sum((u - u.mean()) ** 2))
            se = shape.sigma / slope * math.sqrt(lever * shape.variance_inflation)
            rows.append((test, number, knee, se, times[number]))
            sources.append(names[test][number])
        if len(rows) == told:
            rows.append((test, -1, shape.knee, shape.line.knee_se, math.nan))
            sources.append(shape.prepared.source)
    columns = np.array(rows).reshape(-1, 5).T
    test_of, numbers = columns[:2].astype(int)
    return RampKnees(
        test=test_of, number=numbers, knee=columns[2], se=columns[3], when=columns[4],
        source=tuple(sources),
    )  # fmt: skip


def compare_ramps(
    known: RampKnees, dp_MPa: np.ndarray, counts: Sequence[int], options: IdentifyOptions
) -> BetweenRamps:
    """Compare the ramps of one branch of T tests, at pressure drops (T,), with so many ramps each."""
    dated = dp_MPa.size > 1 and bool(np.isfinite(known.when).all()) and np.ptp(known.when) > 0
    ramps = Ramps(
        dp_MPa=np.round(dp_MPa, DECIMALS)[known.test],
        y=np.round(known.knee, DECIMALS),
        se=np.round(known.se, DECIMALS),
        clock=np.round((known.when - known.when.min()) / np.ptp(known.when) - 0.5, DECIMALS) if dated else None,
    )
    declared, assumed = options.scatter_V
    shifts, checks = tuple(np.zeros(ramps_of_test) for ramps_of_test in counts), ScatterChecks()
    told = known.number >= 0
    if told.any():
        model, test, number = fit_ramp_model(ramps.only(told), share_knots=False), known.test[told], known.number[told]
        for row, at, shift in zip(test, number, _shifts(model, test), strict=True):
            shifts[row][at] = shift
        checks = ScatterChecks(
            serial=find_serial_correlation(model, known.when[told]),
            groups=find_two_groups(known.knee[told], test, number, known.se[told] ** 2),
        )
    return BetweenRamps(
        ramps=ramps, test=known.test, sources=known.source,
        scatter=measure_scatter(ramps, declared=declared, assumed=assumed), shifts=shifts, checks=checks,
    )  # fmt: skip


def _shifts(model: RampModel, test: np.ndarray) -> np.ndarray:
    """Return by how much each ramp stands off the middle of the series and of its test's ramps, V (n,).

    Only what exceeds the noise is scatter of the valve: to move ramps by their noise would blur the edge.
    """
    ramps, residual = model.ramps, model.projector @ model.ramps.y
    count = np.bincount(test)
    within = residual - (np.bincount(test, residual) / np.maximum(count, 1))[test]
    squares, degrees = float(within @ within), test.size - np.count_nonzero(count) - model.drift
    kept = max(1 - float(np.mean(ramps.se**2)) * degrees / squares, 0.0) if degrees > 0 and squares > 0 else 0.0
    drifted = 0.0 if model.drift_V is None or ramps.clock is None else model.drift_V * ramps.clock
    found: np.ndarray = kept * within + drifted
    return found


# ------------------------------------------------------------------------------------------- the premises of the model
def find_two_groups(knee: np.ndarray, test: np.ndarray, number: np.ndarray, noise: np.ndarray) -> TwoGroups | None:
    """Return the two groups in which the ramps' knees, V (R,), lie, if a normal scatter does not make such ones.

    Each test is parted where that leaves the least squares, and the F test of it is Bonferroni's over all ways to part.
    """
    from scipy.special import fdtrc

    groups = [rows for one in np.unique(test) if (rows := np.flatnonzero(test == one)).size >= FEWEST_TO_PART]
    parted = []
    for rows in groups:
        rows = rows[np.argsort(knee[rows], kind="stable")]
        left = [
            sum(float(np.sum((knee[part] - knee[part].mean()) ** 2)) for part in np.split(rows, [at]))
            for at in range(1, rows.size)
        ]
        low, high = np.split(rows, [int(np.argmin(left)) + 1])
        parted.append((min(left), float(knee[high].mean() - knee[low].mean()), low, high))
    degrees = sum(rows.size - 2 for rows in groups)
    if not groups:
        return None
    every = sum(float(np.sum((knee[rows] - knee[rows].mean()) ** 2)) for rows in groups)
    within = max(sum(each[0] for each in parted), degrees * float(noise.mean()), np.finfo(float).tiny)
    ratio = max(every - within, 0.0) / len(groups) / (within / degrees)
    ways = sum((rows.size - 1) * math.log(2) for rows in groups)
    gaps = np.array([each[1] for each in parted])
    wide = gaps >= gaps.max() / 2
    # One ramp that lies off is an outlier; and a gap at one pressure drop of several is a larger scatter there.
    alone = len(groups) == 1 and min(parted[0][2].size, parted[0][3].size) < 2
    chance = float(fdtrc(len(groups), degrees, ratio))
    if alone or 3 * wide.sum() < 2 * wide.size or math.log(max(chance, np.finfo(float).tiny)) + ways > math.log(PARTED):
        return None
    _, _, low, high = parted[int(np.argmax(gaps))]
    ends = [(int(test[part[0]]), int(number[part[0]])) for part in (low, high)]
    return TwoGroups(float(gaps[wide].mean()), (ends[0], ends[1]))


def find_serial_correlation(model: RampModel, when: np.ndarray) -> float | None:
    """Return the correlation of neighbouring ramps where they are more alike than chance makes them, else None.

    The test of Durbin and Watson, with the beta distribution that has the mean and the variance of their ratio for this
    model. `when` (n,) is when each was recorded, s; NaN where that is not known.
    """
    from scipy.special import betainc

    order = np.argsort(when, kind="stable")
    free, residual = model.projector[np.ix_(order, order)], (model.projector @ model.ramps.y)[order]
    degrees, squares = float(np.trace(free)), float(residual @ residual)
    if degrees < FEWEST_IN_A_ROW - NO_DEGREES or not np.isfinite(when).all() or not np.ptp(when) > 0:
        return None
    if squares <= NOTHING * float(np.sum(model.ramps.se**2)):
        return None
    steps, difference = np.diff(residual), np.diff(np.eye(residual.size), axis=0)
    of_steps = free @ (difference.T @ difference)
    first, second = float(np.trace(of_steps)), float(np.sum(of_steps * of_steps.T))
    mean = first / degrees
    variance = 2 * (second - first * mean) / (degrees * (degrees + 2))
    if not variance > 0:
        return None
    ratio, both = float(steps @ steps) / squares, mean * (4 - mean) / variance - 1
    chance = betainc(both * mean / 4, both * (1 - mean / 4), min(ratio / 4, 1.0))
    return float(1 - ratio / mean) if chance < REFUSED else None
