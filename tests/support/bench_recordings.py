"""Recordings of a valve whose every quantity is known: made with NumPy alone, written as a bench writes them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from dzdesign.identify.reading.ramp_test import RampTest

L_MIN, MPA = 1e-3 / 60, 1e6


@dataclass(frozen=True, kw_only=True)
class Valve:
    """Flow gain (u - edge) beyond an edge on either branch, bent by a parabola; V, L/min, MPa, s.

    `bow` is what the parabola adds to the flow in the middle of 0 to 10 V, on the closing branch `bow_back` times that;
    `leak` flows at every command, `bump` adds flow between 5.5 and 6.5 V; `gain` holds at 1 MPa and grows as sqrt(dP),
    on the closing branch it is `gain_back` times that; `memory` is the correlation of two samples' noise.
    """

    opening: float = 5.4
    closing: float = 5.2
    gain: float = 4.0
    gain_back: float = 1.0
    bow: float = 0.0
    bow_back: float = 1.0
    leak: float = 0.0
    bump: float = 0.0
    noise: float = 0.05
    memory: float = 0.0
    floor: float = 0.0
    lag: float = 0.0
    bits: int = 0
    spikes: float = 0.0


BEFORE = Valve()
AFTER = Valve(opening=0.5, closing=0.2, gain=1.9)


def record(
    valve: Valve,
    dp_MPa: float = 1.0,
    *,
    seed: int = 1,
    source: str = "",
    rate_Hz: float = 50.0,
    hold_s: float = 4.0,
    falling: bool = True,
    top: float = 10.0,
    sign: int = 1,
) -> RampTest:
    """Return one ramp from zero to `top` in 100 s and back, with holds."""
    ramp = np.linspace(0, top, int(100 * rate_Hz))
    hold, peak = np.zeros(int(hold_s * rate_Hz)), np.full(int(2 * rate_Hz), top)
    u = np.concatenate([hold, ramp, peak, *([ramp[::-1], hold] if falling else [])])
    opening = np.arange(u.size) < hold.size + ramp.size + peak.size
    factor = np.sqrt(dp_MPa)
    edge = np.where(opening, valve.opening, valve.closing)
    gain, bow = (np.where(opening, 1.0, back) for back in (valve.gain_back, valve.bow_back))
    q = factor * valve.gain * gain * np.clip(u - edge, 0, None) + valve.leak
    q += valve.bow * bow * 4 * (u / 10) * (1 - u / 10) * (u > edge) + valve.bump * ((u > 5.5) & (u < 6.5))
    if valve.lag:
        share = 1 - np.exp(-1 / (rate_Hz * valve.lag))
        q = lfilter([share], [1, share - 1], q)
    random = np.random.default_rng([seed, round(1000 * dp_MPa), sign + 1])
    noise = lfilter([np.sqrt(1 - valve.memory**2)], [1, -valve.memory], random.standard_normal(u.size))
    read = np.where(q < valve.floor, 0.0, q) + valve.noise * noise
    if valve.spikes:
        struck = random.random(u.size) < valve.spikes
        read = np.where(struck, random.choice([-20.0, 0.0, 80.0], u.size), read)
    if valve.bits:  # of 0 to 10 V, and of 0 to 50 L/min
        u, read = (np.round(x / full * 2**valve.bits) / 2**valve.bits * full for x, full in ((u, 10), (read, 50)))
    return RampTest(
        source=source or f"{'p' if sign > 0 else 'n'}_{dp_MPa:g}_{seed}.csv",
        sha256=f"{seed:032x}{round(1000 * dp_MPa):031x}{sign + 1}",
        time=np.arange(u.size) / rate_Hz,
        u=sign * u,
        q=sign * read * L_MIN,
        dp=np.full(u.size, dp_MPa * MPA),
    )


def write(path: Path, test: RampTest, *, per_cent: bool = False, header: str = "", extra=None) -> str:
    """Write a recording as CSV and return its name."""
    u = test.u * (10 if per_cent else 1)
    columns = [test.time, u, test.dp / MPA, test.q / L_MIN, *([] if extra is None else [extra])]
    labels = header or f"time_s,{'u_%' if per_cent else 'u_V'},dP_MPa,Q_Lmin"
    np.savetxt(path, np.column_stack(columns), fmt="%.5f", delimiter=",", header=labels, comments="")
    return str(path)
