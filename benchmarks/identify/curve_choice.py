"""16. The premise that is taken by default: how often its certified offset lies above the true threshold anywhere.

The thresholds at the tests are drawn about a truth as in part 14 and go through identify's own choice of a premise. Of
honest curves, which run one way, it counts too how often the tests are said to show a vertex between two of them.
Parabolas whose vertex lies between two tests break what the staircase rests on; there the offset may fail only where
the errors hide the bend, and a dip that they hide is small beside the margin. And of curves that break the premise that
was asked for, at the tests by three times the margin of the bounds, it counts how often nothing is said.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from curve_premises import PRESSURES, U_MAX, most
from scoreboard import Row, print_rows, say

from dzdesign.core.errors import InputError
from dzdesign.identify.constants import MPA, PREMISES, REFUSED, Premise
from dzdesign.identify.fitting.bounds import find_trend, lower_bounds
from dzdesign.identify.fitting.certifying import Certified, Tested, certify_thresholds
from dzdesign.identify.fitting.guarded_thresholds import GuardedThreshold, lowered
from dzdesign.identify.fitting.guarding import Threshold
from dzdesign.identify.fitting.premises import confidence_at_tests
from dzdesign.identify.knees.between_ramps import BetweenRamps
from dzdesign.identify.knees.scatter_checks import ScatterChecks
from dzdesign.identify.options import IdentifyOptions

#: Standard deviation from ramp to ramp, V, and the ramps at each pressure drop that measure it.
SCATTER, REPEATS = 0.005, 3
#: Curves that run one way, by how they do, and those with their vertex between two tests.
HONEST = ("line", "decay", "concave", "kink")
#: Slope behind a kink over that before it. One that stays nearly level behind it looks like a vertex: no test can tell.
SLOPES_BEHIND = {"kink": (0.4, 1.0), "level": (0.0, 0.4)}
VERTEX = "vertex"
#: Curves that break a premise, by so many times the margin of the bounds; and the share that may pass unsaid.
VISIBLE, UNSAID = 3.0, 0.05
#: M that is declared where it is to be broken, V/MPa².
DECLARED_M = 0.01
Curve = Callable[[np.ndarray], np.ndarray]


def draw_curve(shape: str, dp: np.ndarray, rng: np.random.Generator) -> Curve:
    """Draw a threshold (V over MPa) of a shape; all but that with a vertex fall."""
    fall, low, high = float(rng.uniform(0.05, 0.6)), float(dp[0]), float(dp[-1])
    width = high - low
    if shape == VERTEX:
        left = int(rng.integers(1, dp.size - 1))
        at = float(dp[left] + rng.uniform(0.15, 0.85) * (dp[left + 1] - dp[left]))
        depth = SCATTER * float(np.exp(rng.uniform(np.log(0.3), np.log(30))))
        # So deep below the nearer of the two tests, and at most a volt below the ends.
        bend = min(depth / min(at - dp[left], dp[left + 1] - at) ** 2, 1 / max(at - low, high - at) ** 2)
        return lambda x: 5.0 + bend * (x - at) ** 2
    if shape == "decay":
        # From test to test it falls by a third of the step before, or more.
        reach = float(np.diff(dp).max() / np.log(3) * rng.uniform(1, 5))
        return lambda x: 5.0 + fall * np.exp(-(x - low) / reach)
    if shape in SLOPES_BEHIND:
        place, later = float(rng.uniform(low, high)), float(rng.uniform(*SLOPES_BEHIND[shape]))
        slope = fall / width
        return lambda x: 5.0 - slope * (x - low) + (1 - later) * slope * np.maximum(x - place, 0.0)
    bent = fall if shape == "concave" else 0.0
    return lambda x: 5.5 - (fall - bent) * (x - low) / width - bent * ((x - low) / width) ** 2


def _between(tests: int, sd: float) -> BetweenRamps:
    return BetweenRamps(
        sd=sd, degrees=tests * (REPEATS - 1), origin="repeats", noise=0.0, covariance=np.eye(tests) / REPEATS,
        drift=None, no_drift="order unknown", shifts=(), checks=ScatterChecks(largest=None, outlying=None, serial=None),
    )  # fmt: skip


@dataclass(frozen=True)
class Drawn:
    """What one draw came to."""

    certified: Certified | None
    #: By how much the offset lies above the true threshold at most, V.
    above: float


def certify(curve: Curve, tests: int, rng: np.random.Generator, /, **options: object) -> Drawn:
    """Certify the offset from thresholds that are drawn about a curve; None where that is refused."""
    dp = np.array(PRESSURES[tests])
    degrees = tests * (REPEATS - 1)
    sd = SCATTER * float(np.sqrt(rng.chisquare(degrees) / degrees))
    between = _between(tests, sd)
    value, se = curve(dp) + SCATTER / np.sqrt(REPEATS) * rng.standard_normal(tests), np.zeros(tests)
    chosen = IdentifyOptions(u_max=U_MAX, **options)  # type: ignore[arg-type]
    trend = find_trend(dp, value, between.covariance_of_mean(se), degrees, U_MAX, 1e-3 * U_MAX).direction
    sides = [
        Threshold(value, se, lower_bounds(value, se, between, confidence, np.zeros(tests)), np.zeros(tests))
        for confidence in (confidence_at_tests(chosen.confidence), chosen.confidence)
    ]
    guarded = GuardedThreshold(free=sides[0], ordered=sides[1], between=between, allowance=1e-3 * U_MAX)
    tested = Tested(dp_MPa=dp, reference=0, direction=trend, opens_V=value + 0.1, options=chosen)
    try:
        certified = certify_thresholds({"closing": lowered(guarded, trend, 1e-5 * U_MAX)}, tested)["closing"]
    except InputError:
        return Drawn(certified=None, above=-np.inf)
    found = certified.curve
    fine = np.linspace(dp[0], dp[-1], 401)
    return Drawn(certified, float(np.max(np.interp(fine, found.offset_dp_MPa, found.offset_V) - curve(fine))))


def broken(premise: Premise, dp: np.ndarray, rng: np.random.Generator) -> Curve:
    """Draw a threshold that a premise does not allow: a test lies `VISIBLE` margins beyond what the others let."""
    beyond, slope = VISIBLE * _margin(dp.size), float(rng.uniform(0.1, 0.3))
    at = int(rng.integers(1, dp.size - 1))
    if premise == "monotone":  # it falls, but for one step
        steps = np.append(0.0, np.cumsum(-slope * np.diff(dp)))
        rises = np.where(np.arange(dp.size) >= at, beyond + slope * (dp[at] - dp[at - 1]), 0.0)
        return lambda x: np.interp(x, dp, 5.5 + steps + rises)
    if premise == "line":
        parabola = (dp - dp.mean()) ** 2
        departs = np.abs(parabola - np.polyval(np.polyfit(dp, parabola, 1), dp)).max()
        bend = float(rng.choice([-1, 1])) * beyond / departs
        return lambda x: 5.5 - slope * x + bend * (x - dp.mean()) ** 2
    bend = DECLARED_M / 2 + beyond / ((dp[at] - dp[at - 1]) * (dp[at + 1] - dp[at]))
    return lambda x: 5.5 + bend * (x - dp[-1]) ** 2  # the other tests' chord lies that far above the one between


def _margin(tests: int) -> float:
    """Return how far the bound lies under a threshold of the scatter that is drawn, V."""
    between = _between(tests, SCATTER)
    none = np.zeros(tests)
    return float(-lower_bounds(none, none, between, IdentifyOptions().confidence, none).max())


def unsaid(premise: Premise, tests: int, draws: int, rng: np.random.Generator) -> int:
    """Return how many draws of a broken premise that was asked for are certified under it, and nothing is said."""
    options = {"curve": premise} | ({"curvature": DECLARED_M / MPA**2} if premise == "smooth" else {})
    found = [certify(broken(premise, np.array(PRESSURES[tests]), rng), tests, rng, **options) for _ in range(draws)]
    made = [each.certified for each in found if each.certified]
    return sum(each.vertex is None and each.curve.premise == premise and not _contradicted(each) for each in made)


def _contradicted(certified: Certified) -> bool:
    """Tell whether the premise that is taken is said to be contradicted: a step the wrong way, `not-monotone`."""
    (taken,) = (each for each in certified.curve.premises if each.premise == certified.curve.premise)
    return taken.lack_of_fit_p is not None and taken.lack_of_fit_p < REFUSED


def print_curve_choice(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 16."""
    draws, rows = 100 if quick else 1000, []
    for tests in (3, 4, 6):
        for shape in (*HONEST, "level", VERTEX):
            say(f"the default's premise: {tests} tests, {shape}")
            rng = np.random.default_rng([seed, tests, len(shape)])
            curves = (draw_curve(shape, np.array(PRESSURES[tests]), rng) for _ in range(draws))
            found = [certify(curve, tests, rng) for curve in curves]
            made = [each.certified for each in found if each.certified]
            vertices = sum(each.vertex is not None for each in made) + draws - len(made)
            taken = ", ".join(f"{name} {sum(each.curve.premise == name for each in made)}" for name in PREMISES[1:])
            note = f"of {draws}, 1 % and chance; {taken}, refused {draws - len(made)}"
            above = sum(each.above > 0 for each in found)
            rows.append(Row(what=f"{tests} tests, {shape}: offset above it", value=above, limit=most(draws), note=note))
            if shape in HONEST:
                what = f"{tests} tests, {shape}: said to have a vertex"
                rows.append(Row(what=what, value=vertices, limit=most(draws), note=f"of {draws}, 1 % and chance"))
    for tests in (4, 6):
        for premise in PREMISES:
            passed = unsaid(premise, tests, draws, np.random.default_rng([seed, tests, len(premise), 1]))
            what = f"{tests} tests, {premise} broken by {VISIBLE:g} margins: nothing said"
            rows.append(Row(what=what, value=passed, limit=UNSAID * draws, note=f"of {draws}"))
    print_rows(f"16. The default's certified offset above the true threshold (seed {seed})", rows)
    return rows
