"""14. Bounds under a premise: how often they lie above the true threshold anywhere on the interval.

The thresholds at the tests are drawn about a truth (straight, convex, concave, kinked within M; falling and rising)
with errors and degrees of freedom as ramp tests give them, and go through identify's own bounds and premises. A draw
fails where the bound exceeds the threshold at the next closing anywhere on the interval. Each bend is drawn from a
third to a hundred times the errors.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scoreboard import Row, print_rows, say

from dzdesign.identify.fitting.bounds import lower_bounds
from dzdesign.identify.fitting.premises import bound_line, confidence_at_tests, find_curvature
from dzdesign.identify.knees.between_ramps import BetweenRamps
from dzdesign.identify.knees.scatter_checks import ScatterChecks
from dzdesign.identify.valve.certified_bound import CertifiedBound

CONFIDENCE, U_MAX, GRID = 0.99, 10.0, 401
PRESSURES = {2: (1.0, 5.0), 3: (1.0, 3.0, 5.0), 4: (1.0, 2.0, 3.5, 5.0), 6: (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)}
SHAPES = ("line", "convex", "concave", "kink")
#: Errors of the noise and of the scatter from ramp to ramp, V: a quiet meter, a coarse one, and the bundled example.
ERRORS = ((0.001, 0.0), (0.006, 0.0), (0.0012, 0.005))


@dataclass(frozen=True)
class Truth:
    """A threshold: its slope, and one bend upwards (negative: down); V and MPa."""

    slope: float
    bend: float
    #: Where the kink stands; None for a parabola.
    kink: float | None

    def at(self, dp: np.ndarray) -> np.ndarray:
        """Return the threshold, V."""
        bent = dp**2 / 2 if self.kink is None else np.maximum(dp - self.kink, 0.0)
        found: np.ndarray = 5.0 + self.slope * dp + self.bend * bent
        return found

    def curvature(self, dp: np.ndarray) -> float:
        """Return the least M of the class that has it: of a kink twice its change of slope over the interval."""
        if self.kink is None:
            return max(self.bend, 0.0)
        row = int(np.clip(np.searchsorted(dp, self.kink) - 1, 0, dp.size - 2))
        return max(2 * self.bend / (dp[row + 1] - dp[row]), 0.0)


def draw_truth(shape: str, dp: np.ndarray, error: float, rng: np.random.Generator) -> Truth:
    """Draw a threshold of a shape."""
    slope = rng.choice([-1, 1]) * rng.uniform(0.02, 0.1)
    size = error * float(np.exp(rng.uniform(np.log(0.3), np.log(100))))
    if shape == "kink":
        return Truth(slope, size, float(rng.uniform(dp[0], dp[-1])))
    return Truth(slope, {"line": 0.0, "convex": size, "concave": -size}[shape], None)


def failures(
    premise: str, shape: str, tests: int, errors: tuple[float, float], draws: int, *, declared: bool, seed: int
) -> tuple[int, int]:
    """Return how many draws fail, and how many are refused."""
    rng = np.random.default_rng([seed, tests, SHAPES.index(shape), declared])
    dp, (noise, scatter) = np.array(PRESSURES[tests]), errors
    between = BetweenRamps(
        sd=scatter, degrees=np.inf, origin="declared", noise=0.0, covariance=np.eye(tests), drift=None,
        no_drift="order unknown", shifts=(), checks=ScatterChecks(largest=None, outlying=None, serial=None),
    )  # fmt: skip
    grid = np.linspace(dp[0], dp[-1], GRID)
    failed = refused = 0
    for _ in range(draws):
        truth = draw_truth(shape, dp, float(np.hypot(*errors)), rng)
        se = noise * np.sqrt(rng.chisquare(14, tests) / 14)
        threshold = truth.at(dp) + np.hypot(noise, scatter) * rng.standard_normal(tests)
        confidence = confidence_at_tests(CONFIDENCE)
        if premise == "line":
            line = bound_line(dp, threshold, se, np.zeros(tests), between, confidence=CONFIDENCE, u_max=U_MAX)
            lower, bends, p_value = line.bound, np.zeros(tests - 1), line.p_value
        else:
            lower = lower_bounds(threshold, se, between, confidence, np.zeros(tests))
            known = truth.curvature(dp) if declared else None
            covariance = between.covariance_of_mean(se) + 1e-8 * np.eye(tests)
            found = find_curvature(dp, threshold, covariance, 14.0, known)
            bends, p_value = found.allowed, found.p_value
        if p_value is not None and p_value < 0.01:
            refused += 1
            continue
        bound = CertifiedBound.of("smooth", dp.tolist(), lower.tolist(), bends.tolist(), "decreasing")
        next_one = truth.at(grid) + scatter * rng.standard_normal()
        failed += bool(np.any(bound.in_doubles(grid) > next_one))
    return failed, refused


def kinds() -> Iterator[tuple[str, bool, int, str]]:
    """Yield premise, whether M is declared, the number of tests and the shape."""
    for tests in PRESSURES:
        yield "line", False, tests, "line"
        for shape in SHAPES:
            yield "smooth", True, tests, shape
            if tests > 2:
                yield "smooth", False, tests, shape


def most(draws: int) -> float:
    """Return how many of so many draws may fail by chance if one in a hundred does (99.9 %)."""
    from scipy.stats import binom

    return float(binom.ppf(0.999, draws, 1 - CONFIDENCE))


def print_curve_premises(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 14."""
    draws, rows = 300 if quick else 3000, []
    for errors in ERRORS[:1] if quick else ERRORS:
        say(f"premises: noise {1e3 * errors[0]:.1f} mV, scatter {1e3 * errors[1]:.1f} mV")
        for premise, declared, tests, shape in kinds():
            failed, refused = failures(premise, shape, tests, errors, draws, declared=declared, seed=seed)
            how = ", M declared" if declared else ""
            what = f"{premise}{how}, {tests} tests, {shape}, {1e3 * errors[0]:.1f} and {1e3 * errors[1]:.1f} mV"
            note = f"of {draws}, 1 % and chance; refused {100 * refused / draws:.2f} %"
            rows.append(Row(what=what, value=failed, limit=most(draws), note=note))
    print_rows(f"14. Bounds above the true threshold, by premise (seed {seed})", rows)
    return rows
