"""8. Valves that scatter from ramp to ramp, or drift through the series: next closings below the offset, false trends.

A family is one valve: its ramps are simulated as knees with the fit's measured error (of one ramp, 1.13 mV at 1 MPa to
0.47 mV at 5 MPa), go through the product's own model of the ramps, trend, bounds and staircase, and then the valve
closes once more at every test, in any state that the series has seen. What the product does in CasADi in between, to
let the knees run one way, is an isotonic regression here.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import isotonic_regression
from scipy.signal import lfilter
from scoreboard import Row, print_rows, say

from dzdesign.identify.fitting.bounds import DEGREES_OF_FREEDOM, find_trend, lower_bounds
from dzdesign.identify.knees.between_ramps import RampKnees, compare_ramps
from dzdesign.identify.valve.staircase import staircase

U_MAX, CONFIDENCE, FLAT_BELOW = 10.0, 0.99, 1e-3
DP_MPa = np.linspace(1, 5, 6)
#: Error of one ramp's knee, V.
NOISE_SE = np.interp(DP_MPa, [1, 5], [1.13e-3, 0.47e-3])
FALLING, FLAT = 4.6 - 0.075 * (DP_MPa - 1), np.full(DP_MPa.size, 4.6)
SCATTERS_mV = (0.0, 5.0, 12.5, 25.0, 50.0)
#: Of 1000 families; ten are expected at 99 %, and nineteen are three standard deviations more.
LIMIT = 19
#: Standard errors of one ramp by which the bound may lie lower than without scatter, where there is none.
PRICE = 3.0

Order = Callable[[np.random.Generator], np.ndarray]
TESTS = np.arange(DP_MPa.size)
ORDERS: dict[str, Order] = {
    "closing repeat": lambda rng: np.append(TESTS, 0),
    "three repeats in random order": lambda rng: rng.permutation(np.repeat(TESTS, 3)),
    "three rounds": lambda rng: np.tile(TESTS, 3),
}

#: Draws by how much ramps of given tests, in the order of taking, stand off their threshold, V.
Scatter = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def normal(sd: float | np.ndarray) -> Scatter:
    """Return the premise, a normal scatter, of that standard deviation at all tests or at each, V (T,)."""
    sds = np.broadcast_to(sd, DP_MPa.shape)
    return lambda test, rng: sds[test] * rng.standard_normal(test.size)


def sticking(test: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a scatter of 4 mV, and one ramp in twenty whose spool sticks and closes 80 mV lower."""
    return 4e-3 * rng.standard_normal(test.size) - 80e-3 * (rng.random(test.size) < 0.05)


def long_tailed(test: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a scatter of Student's distribution with 3 degrees of freedom, 10 mV times it."""
    return 10e-3 * rng.standard_t(3, test.size)


def wandering(correlation: float, sd: float = 25e-3) -> Scatter:
    """Return an autoregressive scatter: each ramp is like the one before it, with that correlation."""

    def draw(test: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        steps = rng.standard_normal(test.size)
        steps[1:] *= np.sqrt(1 - correlation**2)
        return sd * lfilter([1.0], [1.0, -correlation], steps)

    return draw


#: Scatter that the premises exclude, the warning that may see it, and whether the bounds hold at 1 % all the same.
UNLIKE: dict[str, tuple[Scatter, str, bool]] = {
    "sd from 5 to 20 mV": (normal(np.linspace(5e-3, 20e-3, DP_MPa.size)), "unequal-scatter", True),
    "sd from 20 to 5 mV": (normal(np.linspace(20e-3, 5e-3, DP_MPa.size)), "unequal-scatter", True),
    "sd 5 mV, at the last test 50 mV": (normal(np.append(np.full(5, 5e-3), 50e-3)), "unequal-scatter", False),
    "Student's scatter": (long_tailed, "outlying-ramp", False),
    "one closing of twenty sticks": (sticking, "outlying-ramp", False),
    "correlation 0.5": (wandering(0.5), "serial-scatter", True),
    "correlation 0.8": (wandering(0.8), "serial-scatter", False),
    "correlation 0.95": (wandering(0.95), "serial-scatter", False),
}


@dataclass(frozen=True, kw_only=True)
class Family:
    """What became of one valve: a next closing below the offset, a trend, and bound less threshold at the tests, V."""

    opened: bool
    trend: bool
    margin: np.ndarray
    #: Codes of what its ramps say against the premises.
    said: tuple[str, ...]


def print_between_ramps(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 8."""
    count = 200 if quick else 1000
    limit = LIMIT * count / 1000 if not quick else 3 + 4 * count / 100
    rows = []
    for scatter in SCATTERS_mV:
        for repeats in (1, 3):
            rng = np.random.default_rng([seed, round(10 * scatter), repeats])
            declared = 1e-3 * scatter if repeats == 1 else None
            test = np.repeat(TESTS, repeats)
            how = "one ramp, declared" if repeats == 1 else f"{repeats} repeats"
            rows += _rows(f"sd {scatter:g} mV, {how}", test, None, 1e-3 * scatter, 0.0, declared, count, limit, rng)
    rows += _against_the_premises(count, limit, seed)
    for name, order in ORDERS.items():
        for drift in (-0.02, 0.02):
            rng = np.random.default_rng([seed, len(name), round(1e3 * (drift + 1))])
            what = f"drift of {100 * drift:+g} %, sd 12.5 mV, {name}"
            declared = 12.5e-3 if name == "closing repeat" else None
            rows += _rows(what, None, order, 12.5e-3, 4.6 * drift, declared, count, limit, rng)
    print_rows(f"8. Next closings below the offset and false trends, of {count} families (seed {seed})", rows)
    return rows


def _against_the_premises(count: int, limit: float, seed: int) -> list[Row]:
    """Return the rows of scatter that is not normal, equal and independent: with a limit where the 1 % is promised."""
    rows = []
    for name, (scatter, code, promised) in UNLIKE.items():
        say(f"between ramps: {name}, {count} families")
        rng, order = np.random.default_rng([seed, len(name)]), ORDERS["three repeats in random order"]
        falling, flat = (
            [simulate(truth, order(rng), scatter, 0.0, None, True, rng) for _ in range(count)]
            for truth in (FALLING, FLAT)
        )
        said = sum(code in family.said for family in falling) / count
        margin = -1e3 * float(np.median([family.margin for family in falling]))
        note = f"of {count}; {code} said of {said:.0%}; bound {margin:.0f} mV under the threshold (median)"
        opened = [float(sum(family.opened for family in families)) for families in (falling, flat)]
        rows.append(Row(what=f"{name}: opened", value=opened[0], limit=limit if promised else None, note=note))
        what = f"{name}: flat valve opened"
        rows.append(Row(what=what, value=opened[1], limit=limit if promised else None))
    return rows


def _rows(
    what: str,
    test: np.ndarray | None,
    order: Order | None,
    scatter: float,
    drift: float,
    declared: float | None,
    count: int,
    limit: float,
    rng: np.random.Generator,
) -> list[Row]:
    """Return the rows of one case: falling valves that open, and flat ones that open or show a trend."""
    say(f"between ramps: {what}, {count} families")

    def families(truth: np.ndarray) -> list[Family]:
        return [
            simulate(truth, test if order is None else order(rng), scatter, drift, declared, order is not None, rng)
            for _ in range(count)
        ]

    falling, flat = families(FALLING), families(FLAT)
    margin = -1e3 * float(np.mean([family.margin for family in falling]))
    note = f"of {count}; bound {margin:.1f} mV under the threshold on average"
    rows = [
        Row(what=f"{what}: opened", value=float(sum(family.opened for family in falling)), limit=limit, note=note),
        Row(what=f"{what}: flat valve opened", value=float(sum(family.opened for family in flat)), limit=limit),
        Row(what=f"{what}: flat valve, trend", value=float(sum(family.trend for family in flat)), limit=limit),
    ]
    if scatter == 0.0:
        from scipy.special import stdtrit

        repeats = 1 if test is None else test.size // DP_MPa.size
        before = stdtrit(DEGREES_OF_FREEDOM, 1 - (1 - CONFIDENCE) / DP_MPa.size) * NOISE_SE / np.sqrt(repeats)
        lower = np.mean((-np.mean([family.margin for family in falling], axis=0) - before) / NOISE_SE)
        rows.append(Row(what=f"{what}: bound lower than by noise alone", value=float(lower), limit=PRICE, unit="s.e."))
    return rows


def simulate(
    truth: np.ndarray,
    test: np.ndarray,
    scatter: float | Scatter,
    drift: float,
    declared: float | None,
    clock: bool,
    rng: np.random.Generator,
) -> Family:
    """Simulate one family; `truth` (T,) in the state of the first ramp, V, and `test` (R,) in the order of taking.

    The scatter is a standard deviation, V, or what draws it for ramps of given tests in the order of taking.
    """
    draw = normal(scatter) if isinstance(scatter, float) else scatter
    state = np.linspace(0, 1, test.size)
    knee = truth[test] + drift * state + draw(test, rng)
    knee += NOISE_SE[test] * rng.standard_normal(test.size)
    counts = np.bincount(test)
    known = RampKnees(
        test=test,
        number=np.array([np.sum(test[:at] == one) for at, one in enumerate(test)]),
        knee=knee,
        noise=NOISE_SE[test] ** 2,
        when=60 * state if clock else np.full(test.size, np.nan),
    )
    between = compare_ramps(known, counts.tolist(), declared=declared, u_max=U_MAX)
    middle = known.knee - (between.drift.change * (state - 0.5) if between.drift else 0.0)
    mean, noise_se = np.bincount(test, weights=middle) / counts, NOISE_SE / np.sqrt(counts)
    degrees = float(between.degrees_of_freedom(noise_se, DEGREES_OF_FREEDOM).min())
    covariance = between.covariance_of_mean(noise_se)
    trend = find_trend(1e6 * DP_MPa, mean, covariance, degrees, U_MAX, FLAT_BELOW * U_MAX).direction
    if trend != "flat":
        mean = isotonic_regression(mean, weights=noise_se**-2, increasing=trend == "increasing").x
    bound = lower_bounds(mean, noise_se, between, CONFIDENCE, np.zeros(mean.size))
    _, offset = staircase(bound, trend)
    lowest = truth + min(drift, 0.0)
    # Each next closing is one of its own, long after the series.
    closing = lowest + [float(draw(np.array([one]), rng)[0]) for one in TESTS]
    codes = (("unequal-scatter", between.checks.largest), ("outlying-ramp", between.checks.outlying))
    said = tuple(code for code, found in (*codes, ("serial-scatter", between.checks.serial)) if found is not None)
    return Family(opened=bool(np.any(closing < offset)), trend=trend != "flat", margin=bound - lowest, said=said)
