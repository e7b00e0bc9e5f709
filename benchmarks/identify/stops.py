"""9. Spools with play, and spools that stick and slip: the flow left at zero command after a stop.

Each valve is recorded on a simulated bench, identified with the defaults, and stopped once at every tested pressure
drop from a random command, the drive at the law's offset. The spool is one of `bench_plant`, which knows nothing of the
law or of the fit. A meter that reads zero below a floor shows no noise in the dead zone, and rare peaks of it above the
floor are no stick-slip.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from bench_plant import that_sticks, with_play
from recorded_ramps import recorded
from scoreboard import Row, print_rows, say

from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest

PRESSURES_MPa = (1.0, 2.0, 3.0, 4.0, 5.0)
RATE_Hz, RAMP_S, TOP_V = 50, 100, 3.9
#: Of 200 valves.
LIMIT = 2
#: Scatter from ramp to ramp beside what the spool does, V.
SCATTER_V = 5e-3

Spool = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Bench:
    """A valve's flow gain at 1 MPa, L/min/V, and its meter, L/min."""

    gain: float = 2.0
    noise: float = 0.05
    floor: float = 0.0


BENCH, BEHIND_A_FLOOR = Bench(), Bench(gain=12.0, noise=0.1, floor=0.6)
#: The floor is three standard deviations of the noise, so a dead zone shows a peak or two.
RARE_PEAKS = Bench(gain=3.2, noise=0.1, floor=0.3)


def print_stops(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 9."""
    count = 20 if quick else 200
    rows = []
    cases = {
        "play of 4 to 6 %": (lambda rng: partial(with_play, play=rng.uniform(0.4, 0.6)), "hysteresis", BENCH),
        "breakaway of 0.15 V": (lambda rng: partial(that_sticks, breakaway=0.15, rng=rng), "stick-slip", BENCH),
        "breakaway of 0.15 V behind a floor": (
            lambda rng: partial(that_sticks, breakaway=0.15, rng=rng),
            "stick-slip",
            BEHIND_A_FLOOR,
        ),
    }
    for name, (make, code, bench) in cases.items():
        for repeats in (1, 3):
            say(f"stops: {name}, {repeats} ramp(s) a pressure drop, {count} valves")
            rng = np.random.default_rng([seed, repeats, len(name)])
            results = [_valve(make(rng), code, repeats, bench, rng) for _ in range(count)]
            opened, silent = (sum(result[at] for result in results) for at in (0, 1))
            left = 1e3 * float(np.mean([result[2] for result in results]))
            note = f"of {count}; offset {left:.0f} mV under the closing knee"
            what = f"{name}, {repeats} ramp{'s' if repeats > 1 else ''} a pressure drop"
            rows.append(Row(what=f"{what}: flow above the level", value=opened, limit=LIMIT, note=note))
            rows.append(Row(what=f"{what}: without its warning", value=silent, limit=0))
    say(f"stops: rare peaks of noise above a floor, {count} valves")
    rng = np.random.default_rng([seed, count])
    told = sum(not _valve(partial(with_play, play=0.2), "stick-slip", 1, RARE_PEAKS, rng)[1] for _ in range(count))
    rows.append(Row(what="rare peaks of noise above a floor: told to be stick-slip", value=told, limit=0))
    print_rows(f"9. Flow above the stated level at zero command, after a stop at each test (seed {seed})", rows)
    return rows


def _valve(
    spool: Spool, code: str, repeats: int, bench: Bench, rng: np.random.Generator
) -> tuple[bool, bool, float]:
    """Return whether a valve passed too much at zero command, whether its warning is missing, and the offset's loss."""
    order = rng.permutation(np.repeat(PRESSURES_MPa, repeats))
    tests = [_ramp(dp, spool, f"ramp{at}.csv", 400.0 * at, bench, rng) for at, dp in enumerate(order.tolist())]
    model = identify(tests, IdentifyOptions(meter_lag=0.0))
    side = model.positive
    worst, losses = 0.0, []
    for dp, offset, test in zip(PRESSURES_MPa, side.curve.u_offset_V, side.tests, strict=True):
        top = rng.uniform(offset + 0.3, 10.0)
        stop = spool(np.concatenate([np.linspace(offset, top, 200), np.linspace(top, offset, 400)]))[-1]
        worst = max(worst, bench.gain * dp**0.5 * (stop - _edge(dp, rng)))
        losses.append((test.u_knee_falling_V or np.nan) - offset)
    silent = code not in {warning.code for warning in model.warnings}
    return worst > side.certificate.level_L_min, silent, float(np.mean(losses))


def _edge(dp_MPa: float, rng: np.random.Generator) -> float:
    return 5.2 - 0.06 * (dp_MPa - 1) + SCATTER_V * rng.standard_normal()


def _ramp(
    dp_MPa: float, spool: Spool, source: str, started: float, bench: Bench, rng: np.random.Generator
) -> RampTest:
    up = np.linspace(0, 10, RAMP_S * RATE_Hz)
    u = np.concatenate([up, up[::-1]])
    flow = bench.gain * dp_MPa**0.5 * np.clip(spool(u) - _edge(dp_MPa, rng), 0, TOP_V)
    meter = {"noise": bench.noise, "floor": bench.floor}
    return recorded(source, u, flow, dp_MPa, rate_Hz=RATE_Hz, rng=rng, started=started, **meter)
