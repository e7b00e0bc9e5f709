"""Valves and plants drawn with a fixed seed: numbers that no scope and no formula can have been fitted to.

Those of `valve.py` and `plain_plant.py` lie on boundaries, and have round numbers that may be equal by chance; what
holds of these only is no law.
"""

import random
from collections.abc import Iterator
from functools import cache

from dzdesign.derivation.account.referee.plain_plant import PlainPlant
from dzdesign.derivation.account.referee.valve import PlainValve

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
