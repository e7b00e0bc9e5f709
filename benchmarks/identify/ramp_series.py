"""8b. The families of part 8 through raw recordings: a hundred of each, read, fitted and bounded by the product."""

from collections.abc import Callable

import numpy as np
from recorded_ramps import recorded
from scipy.stats import binom
from scoreboard import Row, print_rows, say

from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest

U_MAX, CONFIDENCE = 10.0, 0.99
DP_MPa = np.linspace(1, 5, 6)
FALLING, FLAT = 4.6 - 0.075 * (DP_MPa - 1), np.full(DP_MPa.size, 4.6)
SCATTERS_mV = (0.0, 5.0, 12.5, 25.0, 50.0)
TESTS = np.arange(DP_MPa.size)
ORDERS: dict[str, Callable[[np.random.Generator], np.ndarray]] = {
    "closing repeat": lambda rng: np.append(TESTS, 0),
    "three repeats in random order": lambda rng: rng.permutation(np.repeat(TESTS, 3)),
    "three rounds": lambda rng: np.tile(TESTS, 3),
}

RATE_Hz, RAMP_S, NOISE_L_min, TOP_V, HYSTERESIS_V = 20, 100, 0.1, 3.9, 0.1


def print_ramp_series(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 8b."""
    count = 10 if quick else 100
    # One in a thousand benchmarks of a product that keeps its word shows more.
    limit = float(binom.isf(1e-3, count, 1 - CONFIDENCE))
    rows = []
    cases = [(f"sd {sd:g} mV, {how}", how, sd, 0.0) for sd in SCATTERS_mV for how in ("one ramp", "three repeats")]
    cases += [(f"drift of {100 * drift:+g} %, {how}", how, 12.5, drift) for how in ORDERS for drift in (-0.02, 0.02)]
    for what, how, scatter_mV, drift in cases:
        say(f"ramp series: {what}, {count} families")
        rng = np.random.default_rng([seed, round(10 * scatter_mV), len(how), round(1e3 * (1 + drift))])
        opened = [_family(FALLING, how, scatter_mV / 1e3, drift, rng)[0] for _ in range(count)]
        flat = [_family(FLAT, how, scatter_mV / 1e3, drift, rng) for _ in range(count)]
        rows.append(Row(what=f"{what}: opened", value=float(sum(opened)), limit=limit, note=f"of {count}"))
        rows.append(Row(what=f"{what}: flat, opened", value=float(sum(one[0] for one in flat)), limit=limit))
        rows.append(Row(what=f"{what}: flat, trend", value=float(sum(one[1] for one in flat)), limit=limit))
    print_rows(f"8b. Next closings below the offset and false trends, through raw recordings (seed {seed})", rows)
    return rows


def _family(
    truth: np.ndarray, how: str, scatter: float, drift: float, rng: np.random.Generator
) -> tuple[bool, bool]:
    """Return whether a next closing lay below the offset, and whether a trend was found."""
    tests = np.arange(DP_MPa.size)
    in_order = {"one ramp": tests, "three repeats": np.repeat(tests, 3)}
    order = in_order[how] if how in in_order else ORDERS[how](rng)
    declared = scatter / U_MAX if how in ("one ramp", "closing repeat") else None
    state = np.linspace(0, 1, order.size)
    change = drift * truth.mean()
    closes = truth[order] + change * state + scatter * rng.standard_normal(order.size)
    dated = how not in in_order
    recordings = [_ramp(at, int(test), closes[at], dated, rng) for at, test in enumerate(order)]
    side = identify(
        recordings,
        IdentifyOptions(meter_lag=0.0, meter_lag_tolerance=0.0, repeatability=declared, curve="monotone"),
    ).positive
    offset = np.array(side.curve.u_offset_V)
    closing = truth + min(change, 0.0) + scatter * rng.standard_normal(truth.size)
    return bool(np.any(closing < offset)), side.trend != "flat"


def _ramp(number: int, test: int, closes: float, dated: bool, rng: np.random.Generator) -> RampTest:
    up = np.linspace(0, 10, RAMP_S * RATE_Hz)
    u = np.concatenate([up, up[::-1]])
    edge = closes + HYSTERESIS_V * (np.arange(u.size) < up.size)
    gain = 2 * DP_MPa[test] ** 0.5
    flow = np.clip(gain * (u - edge), 0, gain * TOP_V)
    started = 400.0 * number if dated else None
    return recorded(
        f"ramp{number}.csv", u, flow, DP_MPa[test], rate_Hz=RATE_Hz, noise=NOISE_L_min, rng=rng, started=started
    )
