"""What differs from ramp to ramp: the scatter that repeats show, and a drift through the series.

The noise of one ramp says how well that ramp's knee is known, and nothing of where the valve closes the next time. The
knees of the single ramps obey one linear model for each branch,

    knee[j] = threshold at the pressure drop of ramp j + drift * when[j] + scatter[j],

with `when` from -1/2 at the first ramp of the series to 1/2 at the last. Least squares gives the drift, if order and
pressure drop can be told apart, and the residuals, pooled over all pressure drops, the scatter. The ramps are then
brought to the state in the middle of the series, so that those pooled to one test lie on one line; `fitting.bounds`
allows for the next closing at any state that the series has seen.

The premise is a normal scatter, as large at all pressure drops and independent from ramp to ramp.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dzdesign.identify.knees.branch_shape import BranchShape
from dzdesign.identify.knees.gated_line import fit_line
from dzdesign.identify.knees.least_noise import least_noise, least_step
from dzdesign.identify.knees.scatter_checks import ScatterChecks, check_scatter, find_alike_repeats, find_two_groups
from dzdesign.identify.valve.repeatability import NoDrift, Origin

#: Standard deviation of the thresholds from ramp to ramp, over u_max, taken where nothing tells it: data sheets of
#: valves without a position sensor state a repeatability of about 1 %, as a band of two standard deviations each way.
ASSUMED_REPEATABILITY = 2.5e-3
#: Fewest degrees of freedom of a small scatter that is believed: the one difference of two ramps may be so by chance.
FEWEST_DEGREES = 2
#: With fewer degrees of freedom the scatter is known so badly that repeats pay twice.
FEW_DEGREES = 4
#: A ramp tells its own knee with at least so many samples, over this share of the straight part.
RAMP_SAMPLES, RAMP_SPAN = 5, 0.5
#: A term of the model is told apart where its standard error is at most so many times the scatter of one ramp.
TOLD_APART = 2.0
#: Squares of a term, over those of a clock from -1/2 to 1/2, that are rounding.
NOTHING = 1e-9
#: Probability of a scatter as large as the repeats', if the declared one were true, below which it is not believed.
CONTRADICTED = 1e-3
#: Smallest share of the noise in a variance that is counted in its degrees of freedom.
SMALLEST_SHARE = 1e-3
#: Scatter over u_max below which pressure drops don't differ in it.
FINEST = 1e-5
#: Share of itself by which a drift that flattens out, as of oil that warms up, departs from a straight one at most.
UNEVEN = 0.4


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """Change of the thresholds of one branch from the first ramp of the series to the last."""

    #: It and its standard error, V.
    change: float
    change_se: float
    #: Largest departure from a straight drift that the recordings can't show, V.
    uneven: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BetweenRamps:
    """What one branch shows, or is taken to show, from ramp to ramp; T tests."""

    #: Standard deviation from ramp to ramp, V, and its degrees of freedom (infinite where it was not measured).
    sd: float
    degrees: float
    origin: Origin
    #: Variance in `sd` that is the noise of one ramp, V²; 0 where it was not measured.
    noise: float
    #: Covariance of the tests' thresholds, and after them of the drift where it is in the model, over sd² (P, P).
    covariance: np.ndarray
    drift: Drift | None
    #: Why there is no drift in the model; empty where there is.
    no_drift: NoDrift
    #: What the ramps tell, each by itself.
    known: "RampKnees"
    #: By how much each ramp of each test stands off the middle of the series and of its test's ramps, V.
    shifts: tuple[np.ndarray, ...]
    #: What the repeats say against the premises.
    checks: ScatterChecks

    def covariance_of_mean(self, noise_se: np.ndarray) -> np.ndarray:
        """Return the covariance of the thresholds in the middle of the series, V² (T, T).

        `noise_se` (T,) is what the noise alone leaves of each.
        """
        tests = noise_se.size
        return self.sd**2 * self.covariance[:tests, :tests] + np.diag(self._noise(noise_se))

    def variance_of_next(self, noise_se: np.ndarray, state: float) -> np.ndarray:
        """Return the variance of the next closing (or opening) less each test's threshold, V² (T,).

        The valve is in a state that the series has seen, from -1/2 (the first ramp's) to 1/2 (the last one's).
        """
        tests = noise_se.size
        lever = np.diag(self.covariance)[:tests]
        if self.drift is not None:
            lever = lever + 2 * state * self.covariance[:tests, tests] + state**2 * self.covariance[tests, tests]
        variance: np.ndarray = self.sd**2 * (1 + lever) + self._noise(noise_se)
        return variance

    def degrees_of_freedom(self, noise_se: np.ndarray, of_noise: float) -> np.ndarray:
        """Return the effective degrees of freedom of these variances (T,) (Welch and Satterthwaite)."""
        if self.origin == "repeats":
            return np.full(noise_se.shape, self.degrees)
        every = np.diag(self.covariance_of_mean(noise_se))
        share = noise_se**2 / np.maximum(every, np.finfo(float).tiny)
        degrees: np.ndarray = of_noise / np.maximum(share, SMALLEST_SHARE) ** 2
        return degrees

    def _noise(self, noise_se: np.ndarray) -> np.ndarray:
        """Return what the noise adds, V²: all of it, or what exceeds the average ramp's where `sd` has that in it."""
        own = np.diag(self.covariance)[: noise_se.size]
        added: np.ndarray = np.maximum(noise_se**2 - self.noise * own, 0.0)
        return added


@dataclass(frozen=True, slots=True)
class RampKnees:
    """Knees of the single ramps that tell one, (R,), of one branch."""

    #: Test of each, and which ramp of it, from 0.
    test: np.ndarray
    number: np.ndarray
    #: V, and the variance that the noise gives it, V².
    knee: np.ndarray
    noise: np.ndarray
    #: When it was recorded, s on a clock common to all; NaN where that is not known.
    when: np.ndarray
    #: Variance that the noise gives each knee at least, V²; 0, or no array, where it is not known.
    least: np.ndarray | None = None
    #: What the recording's columns of two values say of each; nothing where there are none.
    switched: Sequence[Mapping[str, str]] = ()


def pool_scatter(known: RampKnees, counts: Sequence[int], *, declared: float | None, u_max: float) -> BetweenRamps:
    """Compare the ramps of one branch, on the premise that they scatter alike.

    Parameters
    ----------
    known : RampKnees
        What the ramps tell, each by itself.
    counts : sequence of int
        Ramps of each of the T tests.
    declared : float or None
        Standard deviation from ramp to ramp, V; None measures it where ramps were repeated, and assumes it elsewhere.
        A declared or assumed one that the repeats contradict is not taken.
    u_max : float
        Full command, V.
    """
    count = len(counts)
    clock, no_drift = _series_clock(known, count)
    design = (known.test[:, None] == np.arange(count)).astype(float)
    told = design.any(axis=0)
    design = design[:, told] if no_drift else np.column_stack([design, clock])
    found = np.linalg.lstsq(design, known.knee, rcond=None)[0]
    residual = known.knee - design @ found
    degrees = residual.size - design.shape[1]
    squares, noise = float(residual @ residual), float(known.noise.mean()) if residual.size else 0.0
    origin = _origin(squares, noise, degrees, declared, u_max)
    measured = origin == "repeats"
    least = known.noise + (FINEST * u_max) ** 2
    checks = check_scatter(residual, design, least, known.when)
    checks = replace(
        checks,
        alike=find_alike_repeats(residual, design, known.test, known.least),
        groups=find_two_groups(known.knee, known.test, known.number, known.noise, known.switched),
    )
    sd = math.sqrt(squares / degrees) if measured else ASSUMED_REPEATABILITY * u_max if declared is None else declared
    rows = told if no_drift else np.ones(count + 1, dtype=bool)
    # A test without a ramp that tells its knee counts as one ramp.
    covariance = np.eye(rows.size)
    covariance[np.ix_(rows, rows)] = np.linalg.inv(design.T @ design)
    drift = None
    if not no_drift:
        # Where a bend of the drift would show, it is in the scatter already.
        shows = measured and _error_of_last(np.column_stack([design, (2 * clock) ** 2])) <= TOLD_APART
        error = math.sqrt((sd**2 + noise * (not measured)) * covariance[-1, -1])
        drift = Drift(change=float(found[-1]), change_se=error, uneven=0.0 if shows else UNEVEN * abs(float(found[-1])))
    # Only what exceeds the noise is scatter of the valve: to move ramps by their noise would blur the edge.
    kept = max(1 - noise * degrees / squares, 0.0) if degrees > 0 and squares > 0 else 0.0
    moved = kept * residual + (drift.change * clock if drift else 0.0)
    shifts = tuple(np.zeros(ramps) for ramps in counts)
    for row, number, shift in zip(known.test, known.number, moved, strict=True):
        shifts[row][number] = shift
    return BetweenRamps(
        sd=sd,
        degrees=float(degrees) if measured else math.inf,
        origin=origin,
        noise=noise if measured else 0.0,
        covariance=covariance,
        drift=drift,
        no_drift=no_drift,
        known=known,
        shifts=shifts,
        checks=checks,
    )


def knees_of_ramps(
    shapes: Sequence[BranchShape],
    when: Sequence[Sequence[float]],
    switched: Sequence[Sequence[Mapping[str, str]]],
) -> RampKnees:
    """Return the zeros of lines through each ramp's samples of the straight part that the test's line rests on.

    `when` has for each ramp of each test when it was recorded, s, on one clock for all; `switched` what the
    recording's columns of two values say of it.
    """
    told: list[tuple[float, ...]] = []
    for test, (shape, times) in enumerate(zip(shapes, when, strict=True)):
        branch, seen = shape.prepared.branch, shape.line.kept & ~shape.line.censored
        width, step = float(np.ptp(branch.u[seen])), least_step(branch.q)
        for number, part in enumerate(branch.ramps):
            u, y = branch.u[part][seen[part]], shape.prepared.y[part][seen[part]]
            if u.size < RAMP_SAMPLES or np.ptp(u) < RAMP_SPAN * width:
                continue
            slope, knee = fit_line(u, y)
            if slope <= 0:
                continue
            lever = 1 / u.size + (u.mean() - knee) ** 2 / float(np.sum((u - u.mean()) ** 2))
            noise = (shape.sigma / slope) ** 2 * lever * shape.variance_inflation
            at_least = least_noise(branch.q[part][seen[part]], step) / slope**2 * lever
            told.append((test, number, knee, noise, times[number], at_least))
    columns = np.array(told).reshape(-1, 6).T
    test, number = columns[:2].astype(int)
    marks = [switched[row][ramp] for row, ramp in zip(test, number, strict=True)]
    return RampKnees(
        test=test, number=number, knee=columns[2], noise=columns[3], when=columns[4], least=columns[5], switched=marks
    )


def _series_clock(known: RampKnees, count: int) -> tuple[np.ndarray, NoDrift]:
    """Return when each ramp was recorded, from -1/2 to 1/2, and why it tells no drift; empty where it does."""
    clock = np.zeros(known.test.size)
    if count < 2:
        return clock, "one pressure drop"
    if np.unique(known.test).size < count or not np.ptp(known.when) > 0:
        return clock, "order unknown"
    clock = (known.when - known.when.min()) / np.ptp(known.when) - 0.5
    error = _error_of_last(np.column_stack([known.test[:, None] == np.arange(count), clock]))
    return clock, "" if error <= TOLD_APART else "order of pressure"


def _error_of_last(design: np.ndarray) -> float:
    """Return the standard error of a model's last parameter over the scatter; infinite where it can't be told."""
    rest, last = design[:, :-1].astype(float), design[:, -1].astype(float)
    left = last - rest @ np.linalg.lstsq(rest, last, rcond=None)[0]
    squares = float(left @ left)
    return 1 / math.sqrt(squares) if squares > NOTHING else math.inf


def _origin(squares: float, noise: float, degrees: int, declared: float | None, u_max: float) -> Origin:
    """Return where the scatter is from: what is declared or assumed counts, unless the repeats contradict it."""
    from scipy.special import chdtrc

    if declared is None and degrees >= FEWEST_DEGREES:
        return "repeats"
    taken = ASSUMED_REPEATABILITY * u_max if declared is None else declared
    expected = max(taken**2 + noise, np.finfo(float).tiny)
    if degrees > 0 and chdtrc(degrees, squares / expected) < CONTRADICTED:
        return "repeats"
    return "assumed" if declared is None else "declared"
