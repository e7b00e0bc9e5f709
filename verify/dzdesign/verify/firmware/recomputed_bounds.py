"""The lower bounds in a valve, computed again from the thresholds, errors and budgets that stand beside them.

No recording is needed, and nothing of identify's arithmetic is shared: Student's quantile is that of the incomplete
beta function, a line's weights are those of two normal equations, and the angle by which a line's error turns is the
one between its two ends. What the thresholds themselves are worth, only the ramp tests tell.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.identify.valve.bound_errors import BoundErrors
from dzdesign.identify.valve.guard_curve import CertifiedCurve
from dzdesign.identify.valve.side_model import SideModel
from dzdesign.verify.firmware.stated_basis import ROUNDING_V, ROUNDINGS, about_basis, about_errors
from dzdesign.verify.firmware.stated_origin import about_files, about_options, about_units
from dzdesign.verify.requirements import BOUNDS, Check

#: Degrees of freedom of the noise's standard errors, and the least share of it in a variance that counts in others'.
OF_NOISE, LEAST_SHARE = 14.0, 1e-3
#: Shares of the error probability that bounds at the tests leave to a premise, and that bounds above them take.
OF_PREMISE = {"monotone": 0.0, "smooth": 0.25, "line": 0.5}
ABOVE = 0.125
#: Beyond so many degrees of freedom Student's law is the normal one.
MOST_DEGREES = 1e6
#: Errors below this share of full command weigh alike in a line.
FINEST = 1e-5
#: Points of a line's path, and how far beyond the last test the path goes, over its pressure drop and in MPa.
POINTS, FURTHEST, FURTHEST_MPA = 101, 1.05 * 1.1**28, 1e3


def bounds_follow(compensator: Compensator) -> Check:
    """Tell whether every lower bound of the firmware's valve follows from what stands beside it."""
    valve, units = compensator.valve, compensator.valve.recorded_units
    faults = [*about_units(valve), *about_files(valve), *about_options(valve)]
    count, largest = 0, 0.0
    for name, side in valve.sides.items():
        place = f"sides.{name}.certified"
        faults += [f"sides.{name}.certificate.{text}" for text in about_basis(side)]
        for guard, curve in side.certified.items():
            again = RecomputedBounds.of(curve, side, valve.u_max_V)
            faults += [f"{place}.{guard}.errors.{text}" for text in about_errors(curve)]
            for key, stated, found, quantile in (
                ("u_lower_V", curve.u_lower_V, again.lower, again.most),
                ("above.band_V", curve.above.band_V if curve.above else (), again.band, again.most_above),
            ):
                apart = np.abs(np.array(stated) - found)
                count += apart.size
                largest = max(largest, float(apart.max(initial=0.0)))
                if not np.all(apart <= ROUNDINGS * ROUNDING_V * (1 + quantile)):  # one that is no number is no bound
                    row = int(apart.argmax())
                    faults.append(f"{place}.{guard}.{key}[{row}]: {_unlike(units, stated[row], float(found[row]))}")
    if faults:
        more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
        text = f"{faults[0]}{more}; a number of valve.json was edited: make it again with `dzdesign identify`"
        return BOUNDS.check(holds=False, text=text)
    text = f"{count} numbers (the bounds at the tests, and the error bands above the highest test) follow from the "
    text += "thresholds, errors and uncertainty budgets in valve.json; these inputs were not checked here; largest "
    return BOUNDS.check(holds=True, text=f"{text}difference {units.text(1e3 * largest, '.2g mV')}")


def _unlike(units: RecordedUnits, stated_V: float, found_V: float) -> str:
    one, other = (units.text(1e3 * value, ".3f mV") for value in (stated_V, found_V))
    return f"{one} stands there, but {other} follows from the threshold, its errors and the budget"


@dataclass(frozen=True, slots=True, kw_only=True)
class RecomputedBounds:
    """Bounds at the tests, and the band above them, V; and how many standard errors they are from the thresholds."""

    lower: np.ndarray
    band: np.ndarray
    most: float
    #: Times how much an error of one test may count at the furthest node.
    most_above: float

    @classmethod
    def of(cls, curve: CertifiedCurve, side: SideModel, u_max_V: float) -> "RecomputedBounds":
        """Compute the bounds of one guard's curve again."""
        errors = _Errors(curve.errors, u_max_V)
        dp, left = np.array(curve.dp_MPa), 1 - side.certificate.confidence
        at_tests = (1 - OF_PREMISE[curve.premise]) * left
        threshold, tests = np.array(curve.u_threshold_V), len(curve.u_threshold_V)
        if curve.premise == "line":
            weights = errors.line_weights(dp)
            path = weights(np.linspace(dp[0], dp[-1], POINTS))
            taken, most = errors.taken_off(
                weights(dp), path, lambda angle, degrees: _either(angle, degrees, at_tests, tests)
            )
        else:
            taken, most = errors.taken_off_tests(at_tests)
        above = curve.above
        stated = np.array(above.band_V if above else [])
        band, steepest = stated, 0.0
        if above is not None and curve.premise == "monotone":
            band = np.full(stated.size, threshold[-1] - above.u_lower_V[0])
        elif above is not None:
            weights = weights if curve.premise == "line" else _through(dp, above.slope_from_MPa or 0.0)
            end = min(FURTHEST * float(dp[-1]), FURTHEST_MPA)
            path = weights(np.geomspace(dp[-1], end, POINTS))
            band, steepest = errors.taken_off(
                weights(np.array(above.dp_MPa)), path, lambda angle, degrees: _along(angle, degrees, ABOVE * left)
            )
            band[0] = threshold[-1] - above.u_lower_V[0]
        return cls(lower=threshold - taken, band=band, most=most, most_above=steepest * _lever(dp))


def _lever(dp_MPa: np.ndarray) -> float:
    """Return by how much an error at two tests may count at the furthest node."""
    return 1.0 if dp_MPa.size < 2 else float((FURTHEST * dp_MPa[-1] - dp_MPa[0]) / np.diff(dp_MPa).min())


class _Errors:
    """The stated errors as arrays, and what they take off."""

    def __init__(self, stated: BoundErrors, u_max_V: float) -> None:
        self.se, self.budget = np.array(stated.noise_se_V), np.array(stated.budget_V)
        self.tests = self.se.size
        self.between = stated.ramp_sd_V**2 * np.array(stated.covariance)
        own = np.diag(np.array(stated.covariance))[: self.tests]
        self.next = stated.ramp_sd_V**2
        self.added = np.maximum(self.se**2 - stated.ramp_noise_V**2 * own, 0.0)
        self.measured, self.of_largest = stated.degrees_of_freedom, stated.of_largest
        self.drift, self.uneven = stated.drift_V, stated.uneven_V
        self.rounding = (FINEST * u_max_V) ** 2
        self.of_means = self.between[: self.tests, : self.tests] + np.diag(self.added)

    def taken_off_tests(self, left: float) -> tuple[np.ndarray, float]:
        """Return what is taken off each test's threshold, V, and the largest quantile."""
        alone = student(OF_NOISE, left / self.tests)
        found = [alone * self.se]
        share = self.se**2 / np.maximum(np.diag(self.of_means), np.finfo(float).tiny)
        welch = OF_NOISE / np.maximum(share, LEAST_SHARE) ** 2
        tail = left if self.of_largest else left / self.tests
        quantiles = np.array([student(self.measured or each, tail) for each in welch])
        for state in (-0.5, 0.5):
            variance = self.next + np.diag(self.of_means) + self._of_drift(state)
            found.append(quantiles * np.sqrt(variance) - self._shift(state))
        return np.max(found, axis=0) + self.budget, max(alone, float(quantiles.max()))

    def _of_drift(self, state: float) -> np.ndarray:
        if self.drift is None:
            return np.zeros(self.tests)
        of_drift: np.ndarray = 2 * state * self.between[: self.tests, -1] + state**2 * self.between[-1, -1]
        return of_drift

    def _shift(self, state: float | None) -> float:
        return 0.0 if state is None or self.drift is None else state * self.drift - self.uneven

    def line_weights(self, dp_MPa: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
        """Return what gives the weights (N, T) of the tests in the line: those of the normal equations."""
        precision = np.linalg.inv(self.of_means + self.rounding * np.eye(self.tests))
        middle = float(precision.sum(axis=0) @ dp_MPa / precision.sum())
        apart = dp_MPa - middle
        level = precision.sum(axis=0) / precision.sum()
        slope = apart @ precision / (apart @ precision @ apart)
        return lambda at: level + np.outer(at - middle, slope)

    def taken_off(
        self, weights: np.ndarray, path: np.ndarray, quantile: Callable[[float, float], float]
    ) -> tuple[np.ndarray, float]:
        """Return what is taken off weighted sums (N, T) of the tests, V, and the largest quantile.

        `quantile` is of the angle that the error turns by from the first row of `path` to the last, and the degrees.
        """
        found, most = [], 0.0
        for state in (None, -0.5, 0.5):
            ends = self._covariance(path[[0, -1]], state)
            angle = math.acos(min(1.0, max(-1.0, ends[0, 1] / math.sqrt(ends[0, 0] * ends[1, 1]))))
            critical = quantile(angle, self._degrees(path, state))
            error = np.sqrt([self._covariance(row[None], state)[0, 0] for row in weights])
            found.append(critical * error - self._shift(state))
            most = max(most, critical)
        return np.max(found, axis=0) + np.abs(weights) @ np.maximum(self.budget, 0.0), most

    def _covariance(self, rows: np.ndarray, state: float | None) -> np.ndarray:
        """Return the covariance of the next closing (or opening) less sums of the thresholds; of the noise alone."""
        if state is None:
            alone: np.ndarray = rows @ np.diag(self.se**2) @ rows.T
            return alone
        with_drift = rows if self.drift is None else np.column_stack([rows, np.full(len(rows), state)])
        found: np.ndarray = with_drift @ self.between @ with_drift.T + rows @ np.diag(self.added) @ rows.T + self.next
        return found

    def _degrees(self, path: np.ndarray, state: float | None) -> float:
        if self.measured and state is not None:
            return self.measured
        noise = path**2 @ np.diag(self.se**2)
        whole = noise.sum(axis=1) if state is None else np.array([row @ self.of_means @ row for row in path])
        share = np.linalg.norm(noise, axis=1) / np.maximum(whole, np.finfo(float).tiny)
        return float(OF_NOISE / np.max(np.maximum(share, LEAST_SHARE)) ** 2)


def _through(dp_MPa: np.ndarray, start_MPa: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return what gives the weights (N, T) of the tests in the straight line through one test and the last."""
    row = int(np.abs(dp_MPa[:-1] - start_MPa).argmin())

    def weights(at: np.ndarray) -> np.ndarray:
        found = np.zeros((at.size, dp_MPa.size))
        found[:, row] = (dp_MPa[-1] - at) / (dp_MPa[-1] - dp_MPa[row])
        found[:, -1] = (at - dp_MPa[row]) / (dp_MPa[-1] - dp_MPa[row])
        return found

    return weights


def student(degrees: float, tail: float) -> float:
    """Return what Student's variable exceeds with the probability `tail`, below one half.

    Examples
    --------
    >>> round(student(14, 0.005), 4), round(student(math.inf, 0.005), 4)
    (2.9768, 2.5758)
    """
    from scipy.special import betaincinv, ndtri

    if degrees > MOST_DEGREES:
        return -float(ndtri(tail))
    # P(|t| < x) is the regularised incomplete beta function of x²/(nu + x²).
    share = float(betaincinv(0.5, degrees / 2, 1 - 2 * tail))
    return math.sqrt(degrees * share / (1 - share))


def _along(angle: float, degrees: float, tail: float) -> float:
    """Return what an error that turns by an angle exceeds anywhere on its way with the probability `tail` at most."""
    from scipy.special import stdtr

    degrees = min(degrees, MOST_DEGREES)
    low, high = 0.0, 1e6
    for _ in range(200):
        middle = (low + high) / 2
        of_angle = (1 + middle**2 / degrees) ** (-degrees / 2)
        if angle / (2 * math.pi) * of_angle + float(stdtr(degrees, -middle)) > tail:
            low = middle
        else:
            high = middle
    return high


def _either(angle: float, degrees: float, tail: float, tests: int) -> float:
    """Return the smaller of Bonferroni's quantile over the tests and that of the whole path."""
    return min(student(min(degrees, MOST_DEGREES), tail / tests), _along(angle, degrees, tail))
