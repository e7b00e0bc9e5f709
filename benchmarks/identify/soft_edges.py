"""13. Soft edges that noise, a fast ramp or a meter's floor hides: the flow left at zero command.

Each valve is drawn at random (notch or rounded edge, noise, rate, repeats, lag, floor), recorded on a simulated bench,
identified, and closed (or opened) once more at every tested pressure drop: the true flow there at the law's offset is
compared with the stated level. Spool and meter are those of `bench_plant`, which knows nothing of the law or of the
fit. Sharp edges of the same draws tell what the guard against soft ones costs.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from bench_plant import commanded, lagged, ramp, with_play
from recorded_ramps import L_MIN, recorded
from scoreboard import Row, print_rows, say

from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.guard_curve import Guard

PRESSURES_MPa = (1.0, 2.0, 3.0, 4.0, 5.0)
RATE_Hz, HOLD_S, PLAY_V, GAIN = 50, 2, 0.15, 3.2
#: Of 200 valves.
LIMIT = 2


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A valve and its bench; V, L/min, s."""

    #: Flow gain of the notch over that of the edge behind it; NaN rounds the edge instead.
    depth: float
    width: float
    noise: float
    floor: float = 0.0
    ramp_s: float = 20.0
    repeats: int = 3
    lag: float = 0.1
    lag_declared: bool = True
    floor_declared: bool = False
    #: Standard deviation of the edge from ramp to ramp, V.
    scatter: float = 4e-3

    def flow(self, dp_MPa: float, beyond: np.ndarray) -> np.ndarray:
        """Return the flow at commands beyond where the valve closes, L/min."""
        x = np.maximum(beyond, 0)
        if np.isnan(self.depth):
            opened = np.where(x > self.width, x - self.width / 2, x**2 / (2 * self.width or 1))
        else:
            opened = np.where(x < self.width, self.depth * x, x - (1 - self.depth) * self.width)
        flow: np.ndarray = GAIN * dp_MPa**0.5 * opened
        return flow

    @property
    def knee(self) -> float:
        """How far behind where the valve closes its straight part comes to zero, V."""
        return self.width / 2 if np.isnan(self.depth) else (1 - self.depth) * self.width


def notch(rng: np.random.Generator) -> Drawn:
    """Return a valve with a notch at its edge."""
    return Drawn(
        depth=rng.uniform(0.1, 0.5),
        width=_between(rng, 0.1, 1.5),
        noise=_between(rng, 0.05, 0.75),
        ramp_s=float(rng.choice([10.0, 20.0, 40.0, 60.0])),
        repeats=int(rng.integers(1, 5)),
        lag=float(rng.choice([0.0, 0.1])),
    )


def rounded(rng: np.random.Generator) -> Drawn:
    """Return a valve whose flow gain grows from nothing."""
    return replace(notch(rng), depth=float("nan"))


def sharp(rng: np.random.Generator) -> Drawn:
    """Return a valve that opens into a straight line."""
    return replace(notch(rng), width=0.0)


def floored(draw: Callable[[np.random.Generator], Drawn]) -> Callable[[np.random.Generator], Drawn]:
    """Return the same valves with a meter that reads nothing below a floor, often quieter than that."""
    return lambda rng: replace(
        draw(rng), floor=rng.uniform(0.1, 0.6), floor_declared=bool(rng.random() < 0.3), noise=_between(rng, 0.02, 0.3)
    )


def undeclared(draw: Callable[[np.random.Generator], Drawn]) -> Callable[[np.random.Generator], Drawn]:
    """Return the same valves with a meter's lag that nobody declared."""
    return lambda rng: replace(draw(rng), lag=rng.uniform(0, 0.2), lag_declared=False)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def reported(rng: np.random.Generator) -> Drawn:
    """Return a notch too narrow for averages over the dead zone of a fast ramp."""
    return Drawn(depth=0.3, width=0.3, noise=0.2, repeats=int(rng.integers(2, 4)))


CASES: dict[str, tuple[Callable[[np.random.Generator], Drawn], Guard]] = {
    "notch of 0.3 over 0.3 V, noise 0.2 L/min, 20 s": (reported, "closing"),
    "notches": (notch, "closing"),
    "notches, opening": (notch, "opening"),
    "notches, lag not declared": (undeclared(notch), "closing"),
    "rounded edges": (rounded, "closing"),
    "notches and a floor": (floored(notch), "closing"),
    "rounded edges and a floor": (floored(rounded), "closing"),
    "sharp edges": (sharp, "closing"),
    "sharp edges, lag not declared": (undeclared(sharp), "closing"),
    "sharp edges and a floor": (floored(sharp), "closing"),
}


def print_soft_edges(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 13."""
    count = 20 if quick else 200
    rows = []
    for number, (name, (draw, guard)) in enumerate(CASES.items()):
        say(f"soft edges: {name}, {count} valves")
        results, refused = [], []
        for valve in range(count):
            rng = np.random.default_rng([seed, number, valve])
            try:
                results.append(examine(draw(rng), guard, rng))
            except InputError as error:
                refused.append(f"valve {valve}: {error}")
        opened, below = (sum(result[at] for result in results) for at in (0, 1))
        left, level = (float(np.mean([result[at] for result in results])) for at in (2, 3))
        note = f"of {count}; offset {1e3 * left:.0f} mV under the knee, level {level:.2f} L/min"
        rows.append(Row(what=f"{name}: flow above the level", value=opened, limit=LIMIT, note=note))
        if "floor" in name:
            rows.append(Row(what=f"{name}: level below the meter's floor", value=below, limit=LIMIT))
        if refused:
            rows.append(Row(what=f"{name}: refused", value=len(refused), limit=LIMIT, note=refused[0]))
    print_rows(f"13. Flow above the stated level at zero command, soft edges (seed {seed})", rows)
    return rows


def examine(valve: Drawn, guard: Guard, rng: np.random.Generator) -> tuple[bool, bool, float, float]:
    """Return whether too much flows at zero, whether the level is below the floor, the offset's loss and the level."""
    order = rng.permutation(np.repeat(PRESSURES_MPa, valve.repeats))
    tests = [_ramp(valve, dp, f"ramp{at}.csv", 200.0 * at, rng) for at, dp in enumerate(order.tolist())]
    options = IdentifyOptions(
        meter_lag=valve.lag if valve.lag_declared else None,
        meter_floor=valve.floor * L_MIN if valve.floor_declared else None,
        # One ramp does not tell it.
        repeatability=valve.scatter / 10 if valve.repeats == 1 else None,
    )
    side = identify(tests, options).positive
    curve, up = side.certified[guard], PLAY_V if guard == "opening" else 0.0
    level = side.certificate.level_L_min
    flows, losses = [], []
    for dp, offset in zip(PRESSURES_MPa, curve.u_offset_V, strict=True):
        edge = _edge(dp) + up
        flows.append(float(valve.flow(dp, np.array(offset - edge - valve.scatter * rng.standard_normal()))))
        losses.append(edge + valve.knee - offset)
    # The level is printed to 0.01 L/min.
    return max(flows) > level, level < 0.95 * valve.floor, float(np.mean(losses)), level


def _edge(dp_MPa: float) -> float:
    return 5.2 - 0.05 * (dp_MPa - 1)


def _ramp(valve: Drawn, dp_MPa: float, source: str, started: float, rng: np.random.Generator) -> RampTest:
    _, u = commanded(ramp(valve.ramp_s, before=HOLD_S, at_top=0.0, after=HOLD_S), RATE_Hz)
    closes = _edge(dp_MPa) + valve.scatter * rng.standard_normal()
    q = valve.flow(dp_MPa, with_play(u, PLAY_V) - PLAY_V / 2 - closes)
    if valve.lag:
        q = lagged(q, valve.lag * RATE_Hz)
    test = recorded(
        source,
        u + 2e-3 * rng.standard_normal(u.size),
        q,
        dp_MPa,
        rate_Hz=RATE_Hz,
        noise=valve.noise,
        rng=rng,
        started=started,
    )
    return replace(test, q=np.where(np.abs(test.q) < valve.floor * L_MIN, 0.0, test.q))
