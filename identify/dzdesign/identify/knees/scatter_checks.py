"""Whether the ramps are what the bounds take them for: independent, no copies, of one population.

Each check is exact, or nearly so, for few repeats of a normal scatter, and none of them sees everything. Whether the
scatter is equal everywhere, and which ramps lie off, `fit.scatter` tells.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

#: Probability, under the premise, of what the ramps show, below which the premise is refused.
REFUSED = 0.01
#: Probability with which true repeats are as alike as copies are.
AS_ALIKE = 1e-3
#: Fewest degrees of freedom in which neighbouring ramps can be told to be alike.
FEWEST_IN_A_ROW = 4
#: Probability of two groups of ramps below which they are no chance, and the fewest ramps of a test that is parted.
PARTED, FEWEST_TO_PART = 1e-3, 3
#: Degrees of freedom below the one, and squares over those of the noise below the other, are rounding.
NO_DEGREES, NOTHING = 1e-6, 1e-6


@dataclass(frozen=True, slots=True)
class AlikeRepeats:
    """Repeats that scatter less than the meter's noise makes possible: copies, or one recording twice."""

    #: Test whose repeats are the most alike, from 0, and whether it is that one or all tests together.
    test: int
    everywhere: bool
    #: Standard deviation of the knees, V, and what the noise alone gives them at least.
    sd: float
    of_noise: float


@dataclass(frozen=True, slots=True)
class TwoGroups:
    """Ramps of two populations: of two sides, two benches, or a valve that closes at two places."""

    #: Distance of their thresholds, V, mean over the tests.
    apart: float
    #: Test and number in it of one ramp of each, in one test, that of the lower threshold first.
    ramps: tuple[tuple[int, int], tuple[int, int]]
    #: Column that separates them, and what it says of each; empty where none does.
    column: str = ""
    values: tuple[str, str] = ("", "")


@dataclass(frozen=True, slots=True, kw_only=True)
class ScatterChecks:
    """What the ramps of one branch say against the premises; None where they don't."""

    #: Correlation of neighbouring ramps.
    serial: float | None
    alike: AlikeRepeats | None = None
    groups: "TwoGroups | None" = None


def check_scatter(
    residual: np.ndarray,
    design: np.ndarray,
    noise: np.ndarray,
    when: np.ndarray,
) -> ScatterChecks:
    """Check the residuals, V (R,), of a linear model of the ramps' knees with that design (R, P).

    Parameters
    ----------
    residual, design : array
        Of the model.
    noise : (R,) array
        Variance that the noise gives each knee, V².
    when : (R,) array
        When each was recorded, s; NaN where that is not known.
    """
    if residual.size <= design.shape[1] or residual @ residual <= NOTHING * noise.sum():
        return ScatterChecks(serial=None)
    basis = np.linalg.qr(design)[0]
    return ScatterChecks(serial=_serial_correlation(residual, basis, when) if np.isfinite(when).all() else None)


def find_alike_repeats(
    residual: np.ndarray, design: np.ndarray, test: np.ndarray, least: np.ndarray | None
) -> AlikeRepeats | None:
    """Return repeats whose residuals are smaller than their noise makes likely, at one pressure drop or at all of them.

    Whatever the valve does, the knees of true repeats scatter by their noise at least (R,): the sum of squares over it
    has at least a chi-squared distribution. Of true repeats one series in 1 / `AS_ALIKE` is found, Bonferroni over the
    pressure drops and all together. Where the noise of a ramp is not known nothing is said.
    """
    from scipy.special import gammainc

    if least is None or residual.size <= design.shape[1] or not (least > 0).all():
        return None
    free = 1 - np.sum(np.linalg.qr(design)[0] ** 2, axis=1)
    groups = [np.flatnonzero(test == one) for one in np.unique(test)]
    groups = [group for group in groups if free[group].sum() > 1 - NO_DEGREES]
    found = []
    for group in [*groups, np.arange(test.size)]:
        degrees = float(free[group].sum())
        chance = float(gammainc(degrees / 2, float(np.sum(residual[group] ** 2 / least[group])) / 2))
        sd = math.sqrt(float(residual[group] @ residual[group]) / degrees)
        found.append((chance * (len(groups) + 1), sd, math.sqrt(float(least[group].mean()))))
    if not groups or min(found)[0] > AS_ALIKE:
        return None
    most = min(range(len(groups)), key=lambda place: found[place])
    everywhere = found[-1][0] <= found[most][0]
    return AlikeRepeats(int(test[groups[most][0]]), everywhere, *found[-1 if everywhere else most][1:])


def find_two_groups(
    knee: np.ndarray, test: np.ndarray, number: np.ndarray, noise: np.ndarray, switched: Sequence[Mapping[str, str]]
) -> TwoGroups | None:
    """Return the two groups in which the ramps' knees, V (R,), lie, if a normal scatter does not make such ones.

    Where a column of two values parts the ramps, one effect common to all tests is tested (Student). Elsewhere each
    test is parted where that leaves the least squares, and the F test of it is Bonferroni's over all ways to part.
    """
    labels = [label for label in (switched[0] if switched else ()) if all(label in each for each in switched)]
    for label in labels:
        if found := _parted_by(label, [each[label] for each in switched], knee, test, number, noise, len(labels)):
            return found
    return _parted_best(knee, test, number, noise)


def _parted_by(
    label: str,
    said: Sequence[str],
    knee: np.ndarray,
    test: np.ndarray,
    number: np.ndarray,
    noise: np.ndarray,
    tried: int,
) -> TwoGroups | None:
    from scipy.special import stdtr

    values = sorted(set(said))
    if len(values) != 2:
        return None
    second = np.array([value == values[1] for value in said])
    of_tests = test[:, None] == np.unique(test)
    both = [one for one in np.unique(test) if 0 < np.count_nonzero(second[test == one]) < np.count_nonzero(test == one)]
    degrees = knee.size - of_tests.shape[1] - 1
    if not both or degrees < 1:
        return None
    mean = of_tests @ ((of_tests.T @ np.column_stack([second, knee])) / of_tests.sum(axis=0)[:, None])
    away, rise = second - mean[:, 0], knee - mean[:, 1]
    lever = float(away @ away)
    effect = float(away @ rise) / lever
    squares = max(float(np.sum((rise - effect * away) ** 2)), degrees * float(noise.mean()), np.finfo(float).tiny)
    if 2 * tried * stdtr(degrees, -abs(effect) / math.sqrt(squares / degrees / lever)) > REFUSED:
        return None
    high = second if effect > 0 else ~second
    ramps = [(int(both[0]), int(number[(test == both[0]) & each][0])) for each in (~high, high)]
    lower, upper = values if effect > 0 else values[::-1]
    return TwoGroups(abs(effect), (ramps[0], ramps[1]), label, (lower, upper))


def _parted_best(knee: np.ndarray, test: np.ndarray, number: np.ndarray, noise: np.ndarray) -> TwoGroups | None:
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


def _serial_correlation(residual: np.ndarray, basis: np.ndarray, when: np.ndarray) -> float | None:
    """Return the correlation of neighbouring ramps where they are more alike than chance makes them, else None.

    The test of Durbin and Watson, with the beta distribution that has the mean and the variance of their ratio for a
    design of that orthonormal basis (R, P).
    """
    from scipy.special import betainc

    degrees = residual.size - basis.shape[1]
    if degrees < FEWEST_IN_A_ROW or not np.ptp(when) > 0 or not residual.any():
        return None
    order = np.argsort(when, kind="stable")
    steps = np.diff(residual[order])
    ratio = float(steps @ steps) / float(residual @ residual)
    difference = np.diff(np.eye(residual.size), axis=0)
    of_steps = difference.T @ difference
    of_steps = of_steps - basis[order] @ (basis[order].T @ of_steps)
    first, second = float(np.trace(of_steps)), float(np.sum(of_steps * of_steps.T))
    mean = first / degrees
    variance = 2 * (second - first * mean) / (degrees * (degrees + 2))
    if not variance > 0:
        return None
    both = mean * (4 - mean) / variance - 1
    chance = betainc(both * mean / 4, both * (1 - mean / 4), min(ratio / 4, 1.0))
    return float(1 - ratio / mean) if chance < REFUSED else None
