"""Valves and plants in plain floating point, from what they are: a threshold, an edge that opens, a stop.

No formula of the account is here. The numbers are in units that keep them near 1. Those that are listed lie on
boundaries: sums of powers of two, so that they do so exactly. Those drawn with a fixed seed are numbers that no scope
and no formula can have been fitted to.
"""

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache


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
    u_max: float = 10.0
    C_d: float = 0.75
    W: float = 1.25
    rho: float = 3.0
    #: The meter shows nothing below this flow.
    Q_floor: float = 0.0625
    #: Travel of the spool that opens nothing.
    x_ov: float = 0.375
    #: Of converter and PWM behind it: codes and volts at full scale; conversion coefficient over what (32) asks for.
    n_adc: float = 4096.0
    V_adc: float = 3.0
    n_full: float = 1024.0
    K_c_share: float = 1.0
    #: Of the other valve that flow alone can't tell from this one.
    scale: float = 1.5

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


#: With a stop, that fixes x_max; without, full command is the limit and k x_max = u_max - u_min0.
VALVES = (
    PlainValve(name="a stop", dP0=1.0, dP1=4.0, k=4.0, x_max=0.75, has_stop=True, u_min0=5.5, fall=0.25),
    PlainValve(name="no stop", dP0=1.0, dP1=4.0, k=4.0, x_max=1.125, has_stop=False, u_min0=5.5, fall=0.25),
    PlainValve(name="a stop, dP1 < dP0", dP0=2.0, dP1=1.0, k=3.0, x_max=1.25, has_stop=True, u_min0=4.5, fall=0.375),
    PlainValve(name="no stop, dP1 < dP0", dP0=4.0, dP1=1.0, k=2.0, x_max=3.0, has_stop=False, u_min0=4.0, fall=0.125),
    PlainValve(name="a stop, one threshold", dP0=1.0, dP1=4.0, k=4.0, x_max=0.75, has_stop=True, u_min0=5.5, fall=0.0),
    PlainValve(name="one threshold", dP0=1.0, dP1=4.0, k=4.0, x_max=1.125, has_stop=False, u_min0=5.5, fall=0.0),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainPlant:
    """Parameters of Eqs. (19)-(24), what they start from, and what acts on them, near 1."""

    K_a: float = 2.0
    K_fi: float = 0.5
    K_i: float = 3.0
    R_c: float = 1.25
    r_p: float = 0.25
    L_c: float = 0.5
    m_e: float = 0.75
    B_e: float = 1.5
    K_et: float = 2.5
    u_step: float = 4.0
    load_step: float = 0.5
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
        columns = [self.rates(*unit, 0.0, 0.0) for unit in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        drive = self.rates(0.0, 0.0, 0.0, self.u_step, self.load_step)
        start = (self.i_init, self.x_init, self.v_init)
        rows = [[(s if n == m else 0.0) - columns[m][n] for m in range(3)] for n in range(3)]
        current, travel, _ = _solve(rows, [start[n] + drive[n] / s for n in range(3)])
        return current, travel


def _solve(rows: list[list[float]], right: list[float]) -> list[float]:
    """Solve linear equations by Gauss's elimination with the largest pivot."""
    size = len(rows)
    table = [[*row, value] for row, value in zip(rows, right, strict=True)]
    for n in range(size):
        pivot = max(range(n, size), key=lambda m: abs(table[m][n]))
        table[n], table[pivot] = table[pivot], table[n]
        for m in range(size):
            if m != n:
                factor = table[m][n] / table[n][n]
                table[m] = [one - factor * other for one, other in zip(table[m], table[n], strict=True)]
    return [table[n][size] / table[n][n] for n in range(size)]


PLANTS = (
    PlainPlant(),
    PlainPlant(load_step=0.0),
    PlainPlant(i_init=0.5, x_init=0.25, v_init=-0.5),
    PlainPlant(load_step=0.0, a=0.25),
)


SEED = 20261123


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
        name=f"drawn numbers, {'a' if has_stop else 'no'} stop, {'two thresholds' if falls else 'one threshold'}",
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
        K_c_share=1.0 if rises else draw.uniform(1.2, 2.0),
        scale=draw.uniform(1.2, 2.0),
    )


def drawn_drops(valve: PlainValve) -> tuple[float, ...]:
    """Return pressure drops below, between and above a valve's two."""
    draw = random.Random(valve.name)
    low, high = sorted((valve.dP0, valve.dP1))
    return draw.uniform(0.4, 0.8) * low, draw.uniform(1.2 * low, 0.8 * high), draw.uniform(1.2, 1.8) * high


def drawn_commands(valve: PlainValve, dP: float) -> Iterator[float]:
    """Yield commands from zero to full: near zero, below the threshold, beyond it, near full."""
    draw = random.Random(f"{valve.name} {dP}")
    top, threshold = valve.u_max, valve.threshold(dP)
    yield top * 10 ** draw.uniform(-4.0, -2.0)
    yield draw.uniform(0.1, 0.9) * threshold
    yield draw.uniform(1.1 * threshold, 0.9 * top)
    yield draw.uniform(0.92, 0.999) * top


@cache
def drawn_plants() -> tuple[tuple[PlainPlant, float], ...]:
    """Return plants, each with the s at which its transforms are taken."""
    draw = random.Random(SEED)

    def plant(**fixed: float) -> PlainPlant:
        names = ("K_a", "K_fi", "K_i", "R_c", "r_p", "L_c", "m_e", "B_e", "K_et", "u_step", "load_step")
        return PlainPlant(**{**{name: draw.uniform(0.3, 3.0) for name in names}, **fixed})

    drawn = (
        plant(),
        plant(load_step=0.0),
        plant(i_init=draw.uniform(0.1, 1), x_init=draw.uniform(0.1, 1), v_init=draw.uniform(-1, -0.1)),
        plant(load_step=0.0, a=draw.uniform(0.1, 0.5)),
        plant(load_step=0.0),
        plant(),
    )
    return tuple((one, draw.uniform(0.5, 3.0)) for one in drawn)
