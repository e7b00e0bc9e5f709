"""10. Flow meters: a lag declared wrongly, loud ones that hide a notch, leaks that pass for a zero error.

Each valve is recorded on a simulated bench (holds, first-order meter, noise), identified, and the true flow at the
law's offset is computed on the whole interval of pressure drops: the edge, a notch below it, nothing else. No code of
the plant, of the law or of the fit. The scatter from ramp to ramp is declared as none, so that the bounds have no room
for errors but what they allow for.
"""

from dataclasses import dataclass

import numpy as np
from bench_plant import lagged
from recorded_ramps import recorded
from scoreboard import Row, print_rows, say

from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest
from dzdesign.identify.valve.guard_curve import Guard

PRESSURES_MPa = (1.0, 3.0, 5.0)
RATE_Hz, HOLD_S, HYSTERESIS_V = 50, 4, 0.1
#: Of 200 valves.
LIMIT = 2


@dataclass(frozen=True, kw_only=True)
class Case:
    """A valve, its meter and what is declared of it; V, L/min, MPa, s."""

    guard: Guard = "closing"
    warning: str = ""
    lag: float = 0.0
    declared: float | None = 0.0
    ramp_s: float = 100.0
    noise: float = 0.05
    #: Flow gain of the notch over that of the edge, and its width.
    notch: float = 0.0
    width: float = 1.5
    #: L/min per MPa; whether it stops where the valve opens.
    leak: float = 0.0
    stops: bool = False
    zero: float = 0.0


CASES = {
    "lag declared 0.05 s too long, ramps of 100 s": Case(lag=0.05, declared=0.1),
    "lag declared 0.05 s too long, ramps of 20 s": Case(lag=0.05, declared=0.1, ramp_s=20),
    "lag declared 0.05 s too short, ramps of 20 s, opening": Case(lag=0.15, declared=0.1, ramp_s=20, guard="opening"),
    "lag of 0.19 s not declared, ramps of 50 s, opening": Case(
        lag=0.19, declared=None, ramp_s=50, guard="opening", warning="lag-unknown"
    ),
    "lag declared 0.05 s too long, ramps of 20 s, mean": Case(lag=0.05, declared=0.1, ramp_s=20, guard="mean"),
    "noise 0.75 L/min, no notch": Case(noise=0.75),
    "noise 0.75 L/min, notch of 0.1 over 1.5 V": Case(noise=0.75, notch=0.1, warning="soft-edge"),
    "noise 0.75 L/min, notch of 0.2 over 0.5 V": Case(noise=0.75, notch=0.2, width=0.5, warning="soft-edge"),
    "noise 0.15 L/min, notch of 0.05 over 1 V": Case(noise=0.15, notch=0.05, width=1.0, warning="soft-edge"),
    "noise 0.15 L/min, notch of 0.3 over 0.2 V": Case(noise=0.15, notch=0.3, width=0.2, warning="soft-edge"),
    "leak of 0.2 L/min per MPa that stops": Case(leak=0.2, stops=True, warning="leak"),
    "leak of 0.2 L/min per MPa that goes on": Case(leak=0.2, warning="leak"),
    "leak that stops, zero error of -0.5 L/min": Case(leak=0.2, stops=True, zero=-0.5, warning="leak"),
    "leak that stops, noise 0.75 L/min": Case(leak=0.2, stops=True, noise=0.75, warning="leak"),
    "zero error of 0.5 L/min": Case(zero=0.5, warning="meter-zero"),
}


def print_meters(*, quick: bool, seed: int) -> list[Row]:
    """Print and return the rows of part 10."""
    count = 20 if quick else 200
    rows = []
    for number, (name, case) in enumerate(CASES.items()):
        say(f"meters: {name}, {count} valves")
        results = [_valve(case, np.random.default_rng([seed, number, valve])) for valve in range(count)]
        opened, silent = (sum(bool(result[at]) for result in results) for at in (0, 1))
        left, level = (float(np.mean([result[at] for result in results])) for at in (2, 3))
        note = f"of {count}; offset {1e3 * left:.0f} mV under the threshold, noise level {level:.2f} L/min"
        rows.append(Row(what=f"{name}: flow above the level", value=opened, limit=LIMIT, note=note))
        if case.warning:
            rows.append(Row(what=f"{name}: without `{case.warning}`", value=silent, limit=LIMIT))
    print_rows(f"10. Flow above the stated level at zero command (seed {seed})", rows)
    return rows


def _valve(case: Case, rng: np.random.Generator) -> tuple[bool, bool, float, float]:
    """Return whether too much flows at zero, whether its warning is missing, the offset's loss and the level."""
    edge, slope = rng.uniform(3.0, 6.0), rng.uniform(-0.02, 0.02)
    tests = [_ramp(case, dp, edge + slope * (dp - 1), rng) for dp in PRESSURES_MPa]
    model = identify(tests, IdentifyOptions(meter_lag=case.declared, repeatability=0.0, curve="monotone"))
    side = model.positive
    curve, up = side.certified[case.guard], {"closing": 0.0, "mean": 0.5, "opening": 1.0}[case.guard]
    worst, losses = 0.0, []
    for dp in np.linspace(PRESSURES_MPa[0], PRESSURES_MPa[-1], 9).tolist():
        offset = float(np.interp(dp, curve.dp_MPa, curve.u_offset_V))
        threshold = edge + slope * (dp - 1) + up * HYSTERESIS_V
        worst = max(worst, float(_flow(case, dp, np.array(offset - threshold))))
        losses.append(threshold - offset)
    silent = bool(case.warning) and case.warning not in {warning.code for warning in model.warnings}
    level = side.certificate.level_L_min
    return worst > level, silent, float(np.mean(losses)), level


def _flow(case: Case, dp_MPa: float, beyond: np.ndarray) -> np.ndarray:
    """Return the flow at commands beyond the edge, L/min, without the leak."""
    notch = case.notch * np.clip(beyond + case.width, 0, case.width)
    flow: np.ndarray = 4 * dp_MPa**0.5 * (np.clip(beyond, 0, None) + notch)
    return flow


def _ramp(case: Case, dp_MPa: float, edge: float, rng: np.random.Generator) -> RampTest:
    up, rest = np.linspace(0, 10, round(case.ramp_s * RATE_Hz)), np.zeros(HOLD_S * RATE_Hz)
    u = np.concatenate([rest, up, np.full(2 * RATE_Hz, 10.0), up[::-1], rest])
    opening = np.arange(u.size) < rest.size + up.size + RATE_Hz
    main, leak = _flow(case, dp_MPa, u - edge - HYSTERESIS_V * opening), case.leak * dp_MPa
    q = np.maximum(main, leak) if case.stops else main + leak
    if case.lag:
        q = lagged(q, case.lag * RATE_Hz)
    return recorded(f"dP{dp_MPa:g}.csv", u, q + case.zero, dp_MPa, rate_Hz=RATE_Hz, noise=case.noise, rng=rng)
