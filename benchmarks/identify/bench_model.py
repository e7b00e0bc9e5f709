"""The bench on paper: valves whose truth is a straight line beyond a sharp threshold, and what a meter reads of them.

Per test and branch ``Q = min(s max(u - u_min, 0), Q_sat)``, so knee, onset and u_min are one threshold. The command
runs 0-10 V in 100 s and back; the meter lags by 0.1 s (first order), adds noise and reads 0 below its floor.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import exp, sqrt

import numpy as np

from dzdesign.identify.reading.ramp_test import RampTest

L_MIN, MPA = 1e-3 / 60, 1e6
U_MAX_V = 10.0
#: The six pressure drops of the study, MPa.
PRESSURES_MPa = (0.5, 1.0, 2.0, 3.0, 4.0, 5.0)


def falling_threshold_V(dp_MPa: np.ndarray | float) -> np.ndarray | float:
    """Return the middle threshold of the paper's valve: 53.9 % at 1 MPa, 51.7 % at 5 MPa, a straight line."""
    return 5.445 - 0.055 * dp_MPa


#: Five ways in which a threshold may run with the pressure drop; the certificate assumes no more than one direction.
SHAPES: dict[str, Callable] = {
    "straight": falling_threshold_V,
    "convex": lambda dp: 5.17 + 0.27 * np.exp(-(dp - 0.5) / 0.8),
    "concave": lambda dp: 5.42 - 0.25 * ((dp - 0.5) / 4.5) ** 3,
    "step": lambda dp: 5.30 - 0.12 * np.tanh((dp - 2.4) / 0.15),
    "rising": lambda dp: 5.17 + 0.12 * np.sqrt(dp - 0.4999),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A valve, a meter and a schedule.

    Attributes
    ----------
    threshold_V : callable
        Middle of the opening and the closing threshold, V, at a pressure drop in MPa.
    hysteresis_V : float
        Opening less closing threshold, V.
    slope_L_min_V : float
        At 1 MPa; it grows as sqrt(dP). 2.96 is the slope at which the Cramér-Rao bound is IDENTIFICATION.md's.
    saturation_V : float
        Travel of the command beyond the threshold at which the flow saturates, V; beyond the ramp's end by default.
    noise_L_min, ar : float
        Standard deviation of a reading, and its correlation with the next one.
    floor_L_min, lag_s, zero_L_min : float
        Of the meter: floor, lag, zero error.
    rate_Hz, ramp_s : float
        Sampling rate, and duration of each branch.
    outliers, drop_outs, lost : float
        Shares of readings that are anything, that are zero (in runs), and that are missing.
    run : int
        How many readings drop out in a row.
    pressures_MPa : tuple of float
        One ramp test each.
    top_first : bool
        Whether the ramp starts at full command.
    """

    threshold_V: Callable = falling_threshold_V
    hysteresis_V: float = 0.1
    slope_L_min_V: float = 2.96
    saturation_V: float = 10.0
    noise_L_min: float = 0.15
    ar: float = 0.0
    floor_L_min: float = 0.6
    lag_s: float = 0.1
    zero_L_min: float = 0.0
    rate_Hz: float = 100.0
    ramp_s: float = 100.0
    outliers: float = 0.0
    drop_outs: float = 0.0
    lost: float = 0.0
    run: int = 10
    pressures_MPa: tuple[float, ...] = PRESSURES_MPa
    top_first: bool = False

    def opening_V(self, dp_MPa: np.ndarray | float) -> np.ndarray | float:
        """Return the true opening threshold, V."""
        return self.threshold_V(dp_MPa) + self.hysteresis_V / 2

    def closing_V(self, dp_MPa: np.ndarray | float) -> np.ndarray | float:
        """Return the true closing threshold, V."""
        return self.threshold_V(dp_MPa) - self.hysteresis_V / 2

    def slope_at(self, dp_MPa: float) -> float:
        """Return the slope at a pressure drop, L/min/V."""
        return self.slope_L_min_V * sqrt(dp_MPa)

    def with_changes(self, **changes: object) -> "Bench":
        """Return the same bench but for some of its numbers."""
        return replace(self, **changes)


def readings(bench: Bench, count: int, seed: int, first: int = 0) -> Iterator[list[RampTest]]:
    """Yield `count` replicates of all ramp tests; the true flow is computed once, the noise anew.

    Parameters
    ----------
    bench : Bench
        What is measured.
    count : int
        Replicates.
    seed : int
        Of the random numbers; replicate r draws from ``default_rng([seed, r])``, whatever `count` is.
    first : int
        The replicate to begin with.
    """
    quarter = np.linspace(0.0, U_MAX_V, round(bench.ramp_s * bench.rate_Hz))
    up_down = [quarter[::-1], quarter] if bench.top_first else [quarter, quarter[::-1]]
    u = np.concatenate(up_down)
    rising = np.repeat([not bench.top_first, bench.top_first], quarter.size)
    time = np.arange(u.size) / bench.rate_Hz
    truth = np.array([_delayed(_true_flow(bench, dp, u, rising), bench) for dp in bench.pressures_MPa])
    for replicate in range(first, first + count):
        rng = np.random.default_rng([seed, replicate])
        q = truth + bench.zero_L_min + bench.noise_L_min * _noise(rng, truth.shape, bench.ar)
        q[q < bench.floor_L_min] = 0.0 if bench.floor_L_min > 0 else q[q < bench.floor_L_min]
        _spoil(q, bench, rng)
        keep = rng.random(q.shape) >= bench.lost if bench.lost else None
        yield [_ramp_test(dp, row, time, u, None if keep is None else keep[index])
               for index, (dp, row) in enumerate(zip(bench.pressures_MPa, q, strict=True))]  # fmt: skip


def _true_flow(bench: Bench, dp_MPa: float, u: np.ndarray, rising: np.ndarray) -> np.ndarray:
    threshold = np.where(rising, bench.opening_V(dp_MPa), bench.closing_V(dp_MPa))
    return bench.slope_at(dp_MPa) * np.clip(u - threshold, 0.0, bench.saturation_V)


def _delayed(flow: np.ndarray, bench: Bench) -> np.ndarray:
    """Return what a first-order meter shows of a flow that is a straight line between samples (exact)."""
    from scipy.signal import lfilter

    if bench.lag_s == 0:
        return flow
    ratio = bench.lag_s * bench.rate_Hz
    pole = exp(-1 / ratio)
    now, before = 1 - ratio * (1 - pole), ratio * (1 - pole) - pole
    return lfilter([now, before], [1.0, -pole], flow - flow[0]) + flow[0]


def _noise(rng: np.random.Generator, shape: tuple[int, int], ar: float) -> np.ndarray:
    """Return stationary AR(1) noise of unit variance along the rows."""
    white = rng.standard_normal(shape)
    if ar == 0:
        return white
    from scipy.signal import lfilter

    white[:, 1:] *= sqrt(1 - ar**2)
    return lfilter([1.0], [1.0, -ar], white, axis=1)


def _spoil(q: np.ndarray, bench: Bench, rng: np.random.Generator) -> None:
    """Put outliers and drop-outs into the readings, in place."""
    if bench.outliers:
        hit = rng.random(q.shape) < bench.outliers
        q[hit] = rng.uniform(0.0, 1.5 * q.max(), hit.sum())
    if bench.drop_outs:
        starts = np.argwhere(rng.random(q.shape) < bench.drop_outs / bench.run)
        for row, start in starts:
            q[row, start : start + bench.run] = 0.0


def _ramp_test(dp_MPa: float, q: np.ndarray, time: np.ndarray, u: np.ndarray, keep: np.ndarray | None) -> RampTest:
    if keep is None:
        keep = slice(None)
    return RampTest(
        source=f"bench_dP{dp_MPa:g}",
        sha256="0" * 64,
        time=time[keep],
        u=u[keep],
        q=q[keep] * L_MIN,
        dp=np.full(u.size, dp_MPa * MPA)[keep],
    )
