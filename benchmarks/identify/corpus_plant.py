"""A valve on a bench and the logger beside it, for the corpus: NumPy only, no code shared with the product.

Commands are (seconds, from V, to V) one after the other; a supply is a function of time (s) that gives the pressure
drop over the shut valve (MPa). Both sides of the spool have an edge, the spool has play, the supply sags under flow,
sensors have noise and a converter's steps. A recording is the text that a logger writes, with the truth beside it.
"""

import datetime
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

Supply = Callable[[np.ndarray], np.ndarray]
Segment = tuple[float, float, float]


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
        ends = np.cumsum([0.0, *(segment[0] for segment in self.command)])
        time = np.arange(0.0, ends[-1], 1 / self.rate_Hz)
        corners = np.ravel([(a, b) for a, b in zip(ends, np.nextafter(ends[1:], 0), strict=False)])
        u = np.interp(time, corners, np.ravel([segment[1:] for segment in self.command]))
        nominal = self.supply(time)
        spool = _with_play(u, self.valve.play_V)
        drift = self.valve.knee_V_MPa * (nominal - 1)
        open_ = np.clip(spool - self.valve.knee_V - drift, 0, self.valve.stroke_V)
        open_ -= np.clip(-spool - self.valve.negative_knee_V - drift, 0, self.valve.stroke_V)
        dp = nominal / (1 + self.sag * (open_ / 4) ** 2)
        flow = self.valve.gain * open_ * np.sqrt(np.maximum(dp, 0))
        if self.lag_s > 0:
            flow = _lagged(flow, self.lag_s * self.rate_Hz)
        logged = [
            u + self.command_noise_V * rng.standard_normal(u.size),
            (np.where(u < -0.5, -dp, dp) if self.signed_dp else dp) + self.dp_noise * rng.standard_normal(u.size),
            (flow if self.signed_flow else np.abs(flow)) + self.flow_noise * rng.standard_normal(u.size),
        ]
        if self.bits:
            steps = [span / 2**self.bits for span in (20.0, 10.0, 60.0)]
            logged = [np.round(column / step) * step for column, step in zip(logged, steps, strict=True)]
        return np.array([time, *logged])


def _with_play(u: np.ndarray, play: float) -> np.ndarray:
    """Return where a spool stands that is dragged along by a command with play; it begins in the middle of it."""
    spool, half = [], play / 2
    at = float(u[0]) - half if u[0] > 1 else float(u[0]) + half if u[0] < -1 else float(u[0])
    for value in u.tolist():
        at = min(max(at, value - half), value + half)
        spool.append(at)
    return np.array(spool)


def _lagged(values: np.ndarray, samples: float) -> np.ndarray:
    pole, at, late = float(np.exp(-1 / samples)), float(values[0]), []
    for value in values.tolist():
        at = pole * at + (1 - pole) * value
        late.append(at)
    return np.array(late)


# What the command does, (seconds, from V, to V).


def hold(seconds: float, level: float = 0.0) -> Segment:
    return seconds, level, level


def ramp(
    up_s: float = 40.0, top: float = 10.0, *, before: float = 3.0, at_top: float = 1.0, after: float = 3.0
) -> tuple[Segment, ...]:
    """Hold, up, hold, down, hold."""
    return hold(before), (up_s, 0.0, top), hold(at_top, top), (up_s, top, 0.0), hold(after)


def duration(command: tuple[Segment, ...]) -> float:
    return sum(segment[0] for segment in command)


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


# What loggers write.


def plain(rows: np.ndarray) -> str:
    return "time_s,u_V,dP_MPa,Q_Lmin\n" + _lines(rows, ",", (4, 4, 5, 4))


def semicolons(rows: np.ndarray) -> str:
    time, u, dp, q = rows
    text = "t [s];u [V];dP [bar];Q [l/min]\n" + _lines(np.array([time, u, 10 * dp, q]), ";", (4, 3, 3, 3))
    return text.replace(".", ",")


def stamped(rows: np.ndarray) -> str:
    """Return what a logger with a preamble and date-and-time stamps writes."""
    begin = datetime.datetime(2026, 3, 4, 9, 30)
    lines = ["Logger DL-40;SN 00417", "Channels: 3", "", "time\tu (V)\tdP (MPa)\tQ (L/min)"]
    for time, u, dp, q in rows.T.tolist():
        lines.append(f"{begin + datetime.timedelta(seconds=time):%Y-%m-%d %H:%M:%S.%f}\t{u:.4f}\t{dp:.5f}\t{q:.3f}")
    return "\n".join(lines) + "\n"


def two_ports(rows: np.ndarray) -> str:
    time, u, dp, q = rows
    rows = np.array([1e3 * time, u, 10 * dp + 12.0, np.full(time.size, 12.0), q])
    return "time [ms],u [V],pA [bar],pB [bar],Q [L/min]\n" + _lines(rows, ",", (1, 4, 3, 3, 3))


def _lines(rows: np.ndarray, separator: str, digits: tuple[int, ...]) -> str:
    def line(row: list[float]) -> str:
        return separator.join(f"{value:.{count}f}" for value, count in zip(row, digits, strict=True))

    return "\n".join(line(row) for row in rows.T.tolist()) + "\n"


LOGGERS: tuple[Callable[[np.ndarray], str], ...] = (plain, semicolons, stamped, two_ports)
