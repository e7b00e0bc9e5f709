"""A valve on a bench with its supply, for the corpus: no code shared with the product.

A supply is a function of time (s) that gives the pressure drop over the shut valve (MPa). Both sides of the spool have
an edge, the spool has play, the supply sags under flow, sensors have noise and a converter's steps.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from bench_plant import Segment, commanded, lagged, with_play

Supply = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Valve:
    """Edges of a valve: flow Q = gain sqrt(dP) (x - knee), x the command less play, up to the stroke's end."""

    knee_V: float = 4.6
    knee_V_MPa: float = -0.04
    negative_knee_V: float = 3.2
    play_V: float = 0.12
    gain: float = 3.5
    stroke_V: float = 4.6

    def knees(self, dp_MPa: float, side: str) -> tuple[float, float]:
        """Return the commands at which a side opens and closes, V, as positive numbers."""
        middle = (self.knee_V if side == "positive" else self.negative_knee_V) + self.knee_V_MPa * (dp_MPa - 1)
        return middle + self.play_V / 2, middle - self.play_V / 2


@dataclass(frozen=True, kw_only=True)
class Bench:
    """What is run and how it is recorded."""

    command: tuple[Segment, ...]
    supply: Supply
    valve: Valve = Valve()
    rate_Hz: float = 50.0
    #: Standard deviations of a reading: command (V), flow (L/min), pressure drop (MPa).
    command_noise_V: float = 0.004
    flow_noise: float = 0.12
    dp_noise: float = 0.004
    #: Share of the pressure drop that is lost at an opening of 4 V.
    sag: float = 0.04
    lag_s: float = 0.0
    #: Bits of the converter over +-10 V, 60 L/min and 10 MPa; 0 for none.
    bits: int = 0
    #: Whether the meter and the sensors tell the direction of a bipolar valve's flow.
    signed_flow: bool = True
    signed_dp: bool = False

    def readings(self, seed: int) -> np.ndarray:
        """Return time (s), command (V), pressure drop (MPa) and flow (L/min) as they are logged (4, N)."""
        rng = np.random.default_rng([seed, 20])
        time, u = commanded(self.command, self.rate_Hz)
        nominal = self.supply(time)
        spool = with_play(u, self.valve.play_V, _at_rest(float(u[0]), self.valve.play_V / 2))
        drift = self.valve.knee_V_MPa * (nominal - 1)
        open_ = np.clip(spool - self.valve.knee_V - drift, 0, self.valve.stroke_V)
        open_ -= np.clip(-spool - self.valve.negative_knee_V - drift, 0, self.valve.stroke_V)
        dp = nominal / (1 + self.sag * (open_ / 4) ** 2)
        flow = self.valve.gain * open_ * np.sqrt(np.maximum(dp, 0))
        if self.lag_s > 0:
            flow = lagged(flow, self.lag_s * self.rate_Hz)
        logged = [
            u + self.command_noise_V * rng.standard_normal(u.size),
            (np.where(u < -0.5, -dp, dp) if self.signed_dp else dp) + self.dp_noise * rng.standard_normal(u.size),
            (flow if self.signed_flow else np.abs(flow)) + self.flow_noise * rng.standard_normal(u.size),
        ]
        if self.bits:
            steps = [span / 2**self.bits for span in (20.0, 10.0, 60.0)]
            logged = [np.round(column / step) * step for column, step in zip(logged, steps, strict=True)]
        return np.array([time, *logged])


def _at_rest(u: float, half: float) -> float:
    """Return where the spool stands under a command that has been on for long: pushed out, or in the middle."""
    return u - half if u > 1 else u + half if u < -1 else u


# What the supply does.


def steady(dp: float = 1.0) -> Supply:
    return lambda time: np.full(time.size, dp)


def pump_on(at_s: float, dp: float = 1.0, settles_s: float = 0.3) -> Supply:
    return lambda time: np.where(time < at_s, 0.0, dp * (1 - np.exp(-np.maximum(time - at_s, 0) / settles_s)))


def pump_off(at_s: float, dp: float = 1.0, settles_s: float = 0.5) -> Supply:
    return lambda time: dp * np.exp(-np.maximum(time - at_s, 0) / settles_s)


def drifting(share: float, over_s: float, dp: float = 1.0) -> Supply:
    return lambda time: dp * (1 + share * time / over_s)


def levels(*at: tuple[float, float], settles_s: float = 0.4) -> Supply:
    """Return a supply that goes to each level (time s, MPa) at its time."""

    def supply(time: np.ndarray) -> np.ndarray:
        dp = np.full(time.size, at[0][1])
        for (_, before), (start, level) in pairwise(at):
            dp += (level - before) * (1 - np.exp(-np.maximum(time - start, 0) / settles_s))
        return dp

    return supply


def with_dip(supply: Supply, at_s: float, to: float, seconds: float = 0.5) -> Supply:
    """Return a supply that dips to a share of itself for a while."""
    return lambda time: supply(time) * np.where((time >= at_s) & (time < at_s + seconds), to, 1.0)
