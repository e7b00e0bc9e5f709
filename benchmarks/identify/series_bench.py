"""A valve on a bench, recorded in the order of a series: made with NumPy alone, no code of the fit."""

from dataclasses import dataclass

import numpy as np
from bench_plant import lagged
from recorded_ramps import L_MIN, MPA

from dzdesign.identify.reading.ramp_test import RampTest


@dataclass(frozen=True, kw_only=True)
class SeriesBench:
    """A valve whose closing threshold falls straight with the pressure drop, and its bench; V, L/min, MPa, s.

    The numbers hold at 1 MPa; flow grows with the root of the pressure drop, and the meter is a first-order filter.
    `scatter` moves the threshold of a whole ramp.
    """

    closing: float = 5.0
    fall_per_MPa: float = 0.05
    hysteresis: float = 0.1
    gain: float = 3.0
    scatter: float = 0.025
    noise: float = 0.15
    lag: float = 0.1
    rate_Hz: float = 100.0
    hold: float = 2.0

    def threshold(self, dp_MPa):
        """Return the closing threshold, V."""
        return self.closing - self.fall_per_MPa * (np.asarray(dp_MPa) - 1)

    def record(self, order_MPa, ramp_s, pause, rng):
        """Return one recording per ramp, each with the time at which it was started."""
        up = np.linspace(0, 10, int(ramp_s * self.rate_Hz))
        rest = np.zeros(int(self.hold * self.rate_Hz))
        u = np.concatenate([rest, up, up[::-1], rest])
        opening = np.arange(u.size) < rest.size + up.size
        tests = []
        for number, dp_MPa in enumerate(order_MPa):
            closing = self.threshold(dp_MPa) + self.scatter * rng.standard_normal()
            flow = self.gain * np.sqrt(dp_MPa) * np.clip(u - closing - self.hysteresis * opening, 0, None)
            read = lagged(flow, self.lag * self.rate_Hz) + self.noise * rng.standard_normal(u.size)
            tests.append(
                RampTest(
                    source=f"ramp_{number:02d}.csv",
                    sha256=f"{number:064d}",
                    time=np.arange(u.size) / self.rate_Hz,
                    u=u.copy(),
                    q=read * L_MIN,
                    dp=np.full(u.size, dp_MPa * MPA),
                    started=number * (2 * ramp_s + pause),
                )
            )
        return tests

    def distance(self, valve):
        """Return the mean distance of the certified offset below the threshold over the tested pressure drops, V."""
        curve = valve.positive.curve
        nodes = np.array(curve.offset_dp_MPa)
        dp = np.linspace(nodes[0], nodes[-1], 201)
        return float(np.mean(self.threshold(dp) - np.interp(dp, nodes, curve.offset_V)))
