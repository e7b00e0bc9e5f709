"""The curvature M that the premise `smooth` takes from the tests where none is declared: the rule, of numbers alone.

`identify` applies it to what it found, and a reader of valve.json to the thresholds that stand there: an estimated M is
no choice.
"""

from collections.abc import Sequence

import numpy as np

#: A curvature that is estimated: so many times the largest second divided difference at the tests. A kink half way
#: between two tests shows as half of its change of slope at each, and over the distance of two tests instead of one.
INNER_FACTOR = 4.0
#: In the first and the last interval only one test shows a kink, and of one near the end but a small part; with three
#: tests that one is the only one there is.
END_FACTOR, END_FACTOR_OF_THREE = 32.0, 64.0
#: Up to so many tests a second difference counts whatever its sign: a bend down at a test hides one up beside it. Of
#: 200 falling curves with two kinks 13 (three tests) and 2 (four) had an offset above them somewhere; so 1 and none
#: has, and of six tests none either way.
FEW_TESTS = 4
#: Fewest tests from which a curvature can be estimated.
FEWEST_FOR_CURVATURE = 3


def second_differences(dp_MPa: np.ndarray) -> np.ndarray:
    """Return the weights (T - 2, T) of 2 f[a, b, c] at each inner test: the second derivative of a parabola."""
    weights = np.zeros((max(dp_MPa.size - 2, 0), dp_MPa.size))
    for row, (a, b, c) in enumerate(zip(dp_MPa, dp_MPa[1:], dp_MPa[2:], strict=False)):
        weights[row, row : row + 3] = 2 / ((a - b) * (a - c)), 2 / ((b - a) * (b - c)), 2 / ((c - a) * (c - b))
    return weights


def estimated_curvature(found: np.ndarray) -> np.ndarray:
    """Return M between neighbouring tests (T - 1,), V/MPa², from the second differences (T - 2,) at the inner ones.

    It is four times the largest that bends upwards; in the first and the last interval at least 32 times that of the
    one test that tells of it (64 with three tests). Of three or four tests a bend counts whatever its sign.
    """
    tests = found.size + 2
    end = END_FACTOR_OF_THREE if tests == FEWEST_FOR_CURVATURE else END_FACTOR
    upwards = np.abs(found) if tests <= FEW_TESTS else np.maximum(found, 0.0)
    allowed = np.full(found.size + 1, INNER_FACTOR * float(upwards.max()))
    allowed[0] = max(allowed[0], end * float(upwards[0]))
    allowed[-1] = max(allowed[-1], end * float(upwards[-1]))
    return allowed


def bends_of(dp_MPa: Sequence[float], threshold_V: Sequence[float], rounding: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the second differences of rounded thresholds at the inner tests, V/MPa², and what rounding makes of each.

    A pressure drop that is rounded moves the threshold by the curve's slope.
    """
    dp, threshold = np.array(dp_MPa), np.array(threshold_V)
    weights = second_differences(dp)
    steepest = float(np.abs(np.diff(threshold) / np.diff(dp)).max(initial=0.0))
    return weights @ threshold, np.abs(weights).sum(axis=1) * rounding * (1 + steepest)


def curvature_above(found: np.ndarray) -> float:
    """Return M above the last test, V/MPa², from the second differences (T - 2,) at the inner tests.

    The rule of the last interval, with bends of either sign: above the tests a threshold that bends down is the lower
    one, and no test shows a kink there.
    """
    tests, both = found.size + 2, np.abs(found)
    end = END_FACTOR_OF_THREE if tests == FEWEST_FOR_CURVATURE else END_FACTOR
    return float(max(INNER_FACTOR * both.max(), end * both[-1]))
