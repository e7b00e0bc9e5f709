"""Simulated readings as the product takes them from a file, without the file."""

import numpy as np

from dzdesign.identify.reading.ramp_test import RampTest

L_MIN, MPA = 1e-3 / 60, 1e6


def recorded(
    source: str,
    u: np.ndarray,
    flow: np.ndarray,
    dp_MPa: float,
    *,
    rate_Hz: float,
    noise: float,
    rng: np.random.Generator,
    started: float | None = None,
    floor: float = 0.0,
) -> RampTest:
    """Return a recording of a flow (L/min) with the meter's noise (L/min) and a pressure drop that is 0.1 % off.

    Below its floor (L/min) the meter reads zero.
    """
    read = flow + noise * rng.standard_normal(u.size)
    return RampTest(
        q=np.where(np.abs(read) < floor, 0.0, read) * L_MIN,
        source=source,
        sha256=f"{int(rng.integers(1 << 40)):064x}",
        time=np.arange(u.size) / rate_Hz,
        u=u,
        dp=dp_MPa * MPA * (1 + 1e-3 * rng.standard_normal(u.size)),
        started=started,
    )
