"""9. Spools with play, and spools that stick and slip: the flow left at zero command after a stop.

Each valve is recorded on a simulated bench, identified with the defaults, and stopped once at every tested pressure
drop from a random command, the drive at the law's offset. The spool is a play or a breakaway in NumPy: no code of the
plant, of the law or of the fit.
"""

from collections.abc import Callable

import numpy as np
from scoreboard import Row, print_rows, say

from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest

L_MIN, MPA = 1e-3 / 60, 1e6
PRESSURES_MPa = (1.0, 2.0, 3.0, 4.0, 5.0)
RATE_Hz, RAMP_S, NOISE_L_min, TOP_V = 50, 100, 0.05, 3.9
#: Of 200 valves.
LIMIT = 2
#: Scatter from ramp to ramp beside what the spool does, V.
SCATTER_V = 5e-3

Spool = Callable[[np.ndarray], np.ndarray]


def spool_with_play(width: float) -> Spool:
    """Return a spool that follows the command inside a play of so many volts."""

    def follow(u: np.ndarray) -> np.ndarray:
        spool, at = np.empty_like(u), float(u[0])
        for index, command in enumerate(u.tolist()):
            at = min(max(at, command - width / 2), command + width / 2)
            spool[index] = at
        return spool

    return follow


def spool_that_sticks(breakaway: float, rng: np.random.Generator) -> Spool:
    """Return a spool that waits until the command is a breakaway (within 20 %) ahead, and then jumps to it."""

    def follow(u: np.ndarray) -> np.ndarray:
        spool, at, next_one = np.empty_like(u), float(u[0]), breakaway
        for index, command in enumerate(u.tolist()):
            if abs(command - at) > next_one:
                at, next_one = command, breakaway * (1 + 0.2 * rng.uniform(-1, 1))
            spool[index] = at
        return spool

    return follow


def print_stops(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 9."""
    count = 20 if quick else 200
    rows = []
    cases = {
        "play of 4 to 6 %": (lambda rng: spool_with_play(rng.uniform(0.4, 0.6)), "hysteresis"),
        "breakaway of 0.15 V": (lambda rng: spool_that_sticks(0.15, rng), "stick-slip"),
    }
    for name, (make, code) in cases.items():
        for repeats in (1, 3):
            say(f"stops: {name}, {repeats} ramp(s) a pressure drop, {count} valves")
            rng = np.random.default_rng([seed, repeats, len(name)])
            results = [_valve(make(rng), code, repeats, rng) for _ in range(count)]
            opened, silent = (sum(result[at] for result in results) for at in (0, 1))
            left = 1e3 * float(np.mean([result[2] for result in results]))
            note = f"of {count}; offset {left:.0f} mV under the closing knee"
            what = f"{name}, {repeats} ramp{'s' if repeats > 1 else ''} a pressure drop"
            rows.append(Row(what=f"{what}: flow above the level", value=opened, limit=LIMIT, note=note))
            rows.append(Row(what=f"{what}: without its warning", value=silent, limit=0))
    print_rows(f"9. Flow above the stated level at zero command, after a stop at each test (seed {seed})", rows)
    return rows


def _valve(spool: Spool, code: str, repeats: int, rng: np.random.Generator) -> tuple[bool, bool, float]:
    """Return whether a valve passed too much at zero command, whether its warning is missing, and the offset's loss."""
    order = rng.permutation(np.repeat(PRESSURES_MPa, repeats))
    tests = [_ramp(dp, spool, f"ramp{at}.csv", 400.0 * at, rng) for at, dp in enumerate(order.tolist())]
    model = identify(tests, IdentifyOptions(meter_lag=0.0))
    side = model.positive
    worst, losses = 0.0, []
    for dp, offset, test in zip(PRESSURES_MPa, side.curve.u_offset_V, side.tests, strict=True):
        top = rng.uniform(offset + 0.3, 10.0)
        stop = spool(np.concatenate([np.linspace(offset, top, 200), np.linspace(top, offset, 400)]))[-1]
        worst = max(worst, _gain(dp) * (stop - _edge(dp, rng)))
        losses.append((test.u_knee_falling_V or np.nan) - offset)
    silent = code not in {warning.code for warning in model.warnings}
    return worst > side.certificate.level_L_min, silent, float(np.mean(losses))


def _edge(dp_MPa: float, rng: np.random.Generator) -> float:
    return 5.2 - 0.06 * (dp_MPa - 1) + SCATTER_V * rng.standard_normal()


def _gain(dp_MPa: float) -> float:
    return 2 * dp_MPa**0.5


def _ramp(dp_MPa: float, spool: Spool, source: str, started: float, rng: np.random.Generator) -> RampTest:
    up = np.linspace(0, 10, RAMP_S * RATE_Hz)
    u = np.concatenate([up, up[::-1]])
    q = np.clip(_gain(dp_MPa) * (spool(u) - _edge(dp_MPa, rng)), 0, _gain(dp_MPa) * TOP_V)
    return RampTest(
        source=source,
        sha256=f"{int(rng.integers(1 << 40)):064x}",
        time=np.arange(u.size) / RATE_Hz,
        u=u,
        q=(q + NOISE_L_min * rng.standard_normal(u.size)) * L_MIN,
        dp=dp_MPa * MPA * (1 + 1e-3 * rng.standard_normal(u.size)),
        started=started,
    )
