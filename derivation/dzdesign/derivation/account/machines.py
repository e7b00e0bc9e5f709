"""Valves and plants in plain floating point, from what they are: a threshold, an edge that opens, a stop.

No formula of the account is here. Their numbers, near 1, are drawn with a fixed seed, so that no scope and no formula
can have been fitted to them.
"""

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

SEED = 20261123


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainValve:
    """A valve without a sensor at its spool."""

    name: str
    dP0: float
    dP1: float
    #: Command per opening beyond the threshold, and the opening that the paper calls the largest.
    k: float
    x_max: float
    #: Whether a stop holds the spool at `x_max`; otherwise the command alone limits the opening.
    has_stop: bool
    #: Threshold at dP0, and by how much it falls when the pressure drop doubles.
    u_min0: float
    fall: float
    u_max: float
    C_d: float
    W: float
    rho: float
    #: The meter shows nothing below this flow.
    Q_floor: float
    #: Travel of the spool that opens nothing.
    x_ov: float
    #: Of converter and PWM behind it: codes and volts at full scale; conversion coefficient over what (32) asks for.
    n_adc: float
    V_adc: float
    n_full: float
    K_c_share: float
    #: Of the other valve that flow alone can't tell from this one.
    scale: float

    def threshold(self, dP: float) -> float:
        return self.u_min0 - self.fall * math.log2(dP / self.dP0)

    def opening(self, u: float, dP: float) -> float:
        """Opening of the edge at a command to the valve, the same for both directions."""
        x = max(0.0, (abs(u) - self.threshold(dP)) / self.k)
        return min(x, self.x_max) if self.has_stop else x

    def flow(self, u: float, dP: float) -> float:
        speed = math.sqrt(2 * dP / self.rho)
        return math.copysign(self.C_d * self.W * self.opening(u, dP) * speed, u)

    def command_for(self, flow: float, dP: float) -> float:
        """Least command at which a flow, zero or more, passes."""
        return self.threshold(dP) if flow == 0 else bisect(lambda u: self.flow(u, dP) >= flow, 0.0, 4 * self.u_max)


def bisect(is_reached: Callable[[float], bool], low: float, high: float) -> float:
    """Return the least argument for which something holds that holds for all above."""
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (low, middle) if is_reached(middle) else (middle, high)
    return high


@cache
def drawn_valves() -> tuple[PlainValve, ...]:
    """Return valves with and without a stop, with dP1 above and below dP0, and with one threshold at all drops."""
    draw = random.Random(SEED)
    kinds = (
        (True, True, True), (False, True, True), (True, False, True), (False, False, True), (True, True, False),
        (False, True, False), (True, False, False), (False, False, False),
    )  # fmt: skip
    return tuple(_valve(draw, *kind) for kind in kinds)


def _valve(draw: random.Random, has_stop: bool, rises: bool, falls: bool) -> PlainValve:
    dP0, ratio, u_max = draw.uniform(0.8, 2.5), draw.uniform(1.8, 5.0), draw.uniform(8.0, 12.0)
    u_min0, k = draw.uniform(0.35, 0.55) * u_max, draw.uniform(1.5, 5.0)
    # Without a stop full command is the limit; one fixes the opening at every pressure drop if it is met at each.
    share = draw.uniform(0.5, 0.85) if has_stop else 1.0
    return PlainValve(
        name=f"{'a' if has_stop else 'no'} stop, {'two thresholds' if falls else 'one threshold'}",
        dP0=dP0,
        dP1=dP0 * ratio if rises else dP0 / ratio,
        k=k,
        x_max=share * (u_max - u_min0) / k,
        has_stop=has_stop,
        u_min0=u_min0,
        fall=draw.uniform(0.01, 0.03) * u_max if falls else 0.0,
        u_max=u_max,
        C_d=draw.uniform(0.6, 0.8),
        W=draw.uniform(0.7, 1.6),
        rho=draw.uniform(0.8, 3.5),
        Q_floor=draw.uniform(0.03, 0.09),
        x_ov=draw.uniform(0.1, 0.4) if falls else 0.0,
        n_adc=draw.uniform(900, 5000),
        V_adc=draw.uniform(2.0, 5.0),
        n_full=draw.uniform(900, 5000),
        K_c_share=1.0 if has_stop else draw.uniform(1.2, 2.0),
        scale=draw.uniform(1.2, 2.0),
    )


def drawn_drops(valve: PlainValve) -> tuple[float, ...]:
    """Return a valve's two pressure drops, and one below, one between and one above them."""
    draw = random.Random(f"{valve.name} {valve.dP0}")
    low, high = sorted((valve.dP0, valve.dP1))
    others = draw.uniform(0.4, 0.8) * low, draw.uniform(1.2 * low, 0.8 * high), draw.uniform(1.2, 1.8) * high
    return valve.dP0, valve.dP1, *others


def drawn_commands(valve: PlainValve, dP: float) -> Iterator[float]:
    """Yield commands from zero to full: near zero, below the threshold, beyond it, near full."""
    draw = random.Random(f"{valve.name} {dP}")
    top, threshold = valve.u_max, valve.threshold(dP)
    yield top * 10 ** draw.uniform(-4.0, -2.0)
    yield draw.uniform(0.1, 0.9) * threshold
    yield draw.uniform(1.1 * threshold, 0.9 * top)
    yield draw.uniform(0.92, 0.999) * top


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainPlant:
    """Parameters of Eqs. (19)-(24), what they start from, and what acts on them, near 1."""

    K_a: float
    K_fi: float
    K_i: float
    R_c: float
    r_p: float
    L_c: float
    m_e: float
    B_e: float
    K_et: float
    u_step: float
    load_step: float
    i_init: float = 0.0
    x_init: float = 0.0
    v_init: float = 0.0
    #: The pressure drop falls as exp(-2 a t).
    a: float = 0.0

    def rates(self, i: float, x: float, v: float, u: float, load: float) -> tuple[float, float, float]:
        """Rates of current, travel and speed."""
        voltage = self.K_a * (u - self.K_fi * i) - (self.R_c + self.r_p) * i
        return voltage / self.L_c, v, (self.K_i * i - load - self.B_e * v - self.K_et * x) / self.m_e

    def transforms(self, s: float) -> tuple[float, float]:
        """Transforms of current and travel at one s, after steps of command and load: (s - A) z = z(0) + b/s."""
        matrix = np.transpose([self.rates(i, x, v, 0.0, 0.0) for i, x, v in np.eye(3)])
        drive = np.array(self.rates(0.0, 0.0, 0.0, self.u_step, self.load_step))
        start = (self.i_init, self.x_init, self.v_init)
        current, travel, _ = np.linalg.solve(s * np.eye(3) - matrix, start + drive / s)
        return float(current), float(travel)


@cache
def drawn_plants() -> tuple[tuple[PlainPlant, float], ...]:
    """Return plants, each with the s at which its transforms are taken: one at rest and unloaded, and what differs."""
    draw = random.Random(SEED)

    def plant(**fixed: float) -> PlainPlant:
        names = ("K_a", "K_fi", "K_i", "R_c", "r_p", "L_c", "m_e", "B_e", "K_et", "u_step", "load_step")
        return PlainPlant(**{**{name: draw.uniform(0.3, 3.0) for name in names}, **fixed})

    drawn = (
        plant(),
        plant(load_step=0.0),
        plant(i_init=draw.uniform(0.1, 1), x_init=draw.uniform(0.1, 1), v_init=draw.uniform(-1, -0.1)),
        plant(load_step=0.0, a=draw.uniform(0.1, 0.5)),
    )
    return tuple((one, draw.uniform(0.5, 3.0)) for one in drawn)
