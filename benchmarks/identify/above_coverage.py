"""17. Above the tests: how often the continued bound lies above the next closing anywhere, of thresholds that the
premise allows at their worst, and of some that it does not.

The thresholds are drawn as in part 16. A line goes on straight; a smooth one bends downwards by its M everywhere, the
worst of its class; an estimated M has a bend that the tests show. What bends by three times M above the tests lies
outside the promise: how often its bound fails stands for comparison.
"""

from collections.abc import Mapping

import numpy as np
from curve_choice import SCATTER, certify
from curve_premises import PRESSURES, most
from scoreboard import Row, print_rows, say

from dzdesign.identify.constants import MPA

#: Declared, V/MPa²; and bends of truths whose M is estimated.
DECLARED_M, BENDS = 0.01, (-0.02, -0.005, 0.005)
POINTS = 400


def truth(slope: float, bend: float, bend_above: float, last: float):
    """Return a threshold over pressure drops, V: it starts at 6 V."""

    def curve(dp: np.ndarray) -> np.ndarray:
        inside, beyond = np.minimum(dp, last), np.maximum(dp - last, 0.0)
        value = 6.0 - slope * inside + bend / 2 * inside**2
        return value + (bend * last - slope) * beyond + bend_above / 2 * beyond**2

    return curve


def failures(tests: int, bend: float, bend_above: float, options: Mapping[str, object], draws: int, seed: list[int]):
    """Return how often the next closing lies below its bound at the tests or above, above alone; of how many."""
    rng, last = np.random.default_rng(seed), PRESSURES[tests][-1]
    failed, above_alone, made = 0, 0, 0
    for _ in range(draws):
        curve = truth(float(rng.uniform(0.02, 0.2)), bend, bend_above, last)
        drawn = certify(curve, tests, rng, **options).certified
        if drawn is None or not drawn.curve.above.certified:
            continue
        made += 1
        next_V = SCATTER * rng.standard_normal()
        at_tests = np.array(drawn.curve.u_lower_V) > curve(np.array(PRESSURES[tests])) + next_V
        bound = drawn.curve.above.bound()
        places = np.linspace(last, drawn.curve.above.dp_MPa[-1], POINTS)
        above = bound.in_doubles(places) > curve(places) + next_V
        failed += bool(at_tests.any() or above.any())
        above_alone += bool(above.any())
    return failed, above_alone, made


def print_above_coverage(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 17."""
    draws, rows = 100 if quick else 1000, []
    smooth: dict[str, object] = {"curve": "smooth", "curvature": DECLARED_M / MPA**2}
    cases = [
        ("line", 0.0, 0.0, {"curve": "line"}, True),
        ("smooth, -M everywhere", -DECLARED_M, -DECLARED_M, smooth, True),
        ("smooth, M everywhere", DECLARED_M, DECLARED_M, smooth, True),
    ]
    cases += [(f"M estimated, {1e3 * bend:g} mV/MPa²", bend, bend, {"curve": "smooth"}, True) for bend in BENDS]
    cases += [("smooth, -3 M above the tests", 0.0, -3 * DECLARED_M, smooth, False)]
    cases += [("line, bent above the tests", 0.0, -DECLARED_M, {"curve": "line"}, False)]
    for tests in (3, 4, 6):
        for place, (name, bend, bend_above, options, promised) in enumerate(cases):
            say(f"above the tests: {tests} tests, {name}")
            failed, above, made = failures(tests, bend, bend_above, options, draws, [seed, tests, place])
            note = f"of {made} certified; above the tests alone {above}" + ("" if promised else "; outside the promise")
            limit = most(max(made, 1)) if promised else None
            rows.append(Row(what=f"{tests} tests, {name}: bound above", value=failed, limit=limit, note=note))
    print_rows(f"17. The continued bound above the next closing (seed {seed})", rows)
    return rows
