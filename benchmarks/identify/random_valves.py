"""4. Random valves without a start value, and without the meter's floor declared."""

import re
from collections import Counter

import numpy as np
from bench_model import U_MAX_V, Bench, readings
from cramer_rao import cramer_rao
from scoreboard import Row, print_rows, say

from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions

#: A knee wrong by more than this share of u_max is a gross failure.
GROSS = 0.01
#: No estimator is blamed where the Cramér-Rao bound of a branch exceeds this share of u_max: the noise hides the knee.
HIDDEN = GROSS / 8


def random_bench(number: int, seed: int) -> Bench:
    """Return a random valve on a random bench: dead zone 1-70 %, either trend, either branch order, 2-12 pressures."""
    rng = np.random.default_rng([seed, number, 1])
    dead_zone = rng.uniform(0.1, 7.0)
    pressures = rng.uniform(0.3, 1.0) * rng.uniform(1.15, 1.5) ** np.arange(rng.integers(2, 13))
    drift = rng.uniform(-0.3, 0.3) * min(dead_zone, 1.0) / pressures[-1] * (rng.random() < 0.85)
    slope = rng.uniform(0.5, 20.0)
    full = slope * (U_MAX_V - dead_zone)
    return Bench(
        threshold_V=lambda dp: dead_zone + drift * dp,
        hysteresis_V=rng.uniform(0.0, 0.3) * min(1.0, dead_zone / 2),
        slope_L_min_V=slope,
        saturation_V=(U_MAX_V - dead_zone) * rng.choice([2.0, 0.7]),
        noise_L_min=rng.choice([0.0, 0.003, 0.01]) * full,
        ar=rng.choice([0.0, 0.9]),
        floor_L_min=rng.choice([0.0, 0.03]) * full,
        lag_s=0.0,
        rate_Hz=float(rng.choice([10, 50, 100])),
        pressures_MPa=tuple(float(dp) for dp in pressures),
        top_first=bool(rng.random() < 0.5),
    )


def print_random_valves(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 4."""
    count = 100 if quick else 1000
    say(f"random valves: {count}")
    gross, hidden, wrong_side, refusals = [], [], [], Counter()
    for number in range(count):
        bench = random_bench(number, seed)
        (tests,) = readings(bench, 1, seed + number)
        try:
            side = identify(tests, IdentifyOptions(repeatability=0.0, curve="monotone")).positive
        except InputError as error:
            refusals[re.sub(r"'[^']*'|[-+]?\d[\d.e-]*", "#", str(error))[:90]] += 1
            continue
        except Exception as error:  # the study counts crashes, whatever they are
            gross.append(f"valve {number}: {type(error).__name__}: {error}")
            continue
        errors = [
            abs(found - truth(test.dp_MPa))
            for test in side.tests
            for found, truth in ((test.u_knee_rising_V, bench.opening_V), (test.u_knee_falling_V, bench.closing_V))
        ]
        if not max(errors) <= GROSS * U_MAX_V:
            bound = max(cramer_rao(bench, dp).branch_V for dp in bench.pressures_MPa) if bench.noise_L_min else 0.0
            text = (
                f"valve {number}: {1e3 * max(errors):.0f} mV of {bench.threshold_V(1.0):.2f} V, CRB {1e3 * bound:.0f}"
            )
            (hidden if bound > HIDDEN * U_MAX_V else gross).append(text)
        dp = np.linspace(*side.valid_dp_MPa, 100)
        if np.any(np.interp(dp, side.curve.offset_dp_MPa, side.curve.offset_V) > bench.closing_V(dp)):
            wrong_side.append(number)
    rows = [
        Row(what="gross failures", value=len(gross), limit=0, note="; ".join(gross[:6])),
        Row(what="as wrong, but the noise hides the knee", value=len(hidden), note="; ".join(hidden[:6])),
        Row(what="over-compensated", value=len(wrong_side), note=f"of {count}; valves {wrong_side[:12]}"),
        Row(what="refused", value=refusals.total(), note="counted apart"),
        *(Row(what="  of which", value=times, note=reason) for reason, times in refusals.most_common()),
    ]
    print_rows(f"4. {count} random valves without a start value (seed {seed})", rows)
    return rows
