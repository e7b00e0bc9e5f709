"""Synthetic ramp tests with a known truth, and where the shared measurements lie."""

import os
import shutil
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from dzdesign.design.signals import PressureSignal, Signals
from dzdesign.identify.reading.ramp_test import RampTest

L_MIN, MPA = 1e-3 / 60, 1e6
SHARED = Path(os.environ.get("DZDESIGN_SHARED_DATA", Path(__file__).parents[3] / "shared" / "data"))

needs_compiler = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler (cc, gcc, clang) on the path"
)


@dataclass(frozen=True, kw_only=True)
class Truth:
    """A valve that is a straight line beyond its threshold: V, L/min, MPa."""

    knee_rising: float = 5.4
    hysteresis: float = 0.1
    slope: float = 4.0
    saturation: float = 100.0
    noise: float = 0.08
    floor: float = 0.0
    sag: float = 0.0


def synthetic_ramp(
    dp_MPa: float,
    truth: Truth,
    *,
    seed: int = 0,
    rate_Hz: float = 50.0,
    ramp_s: float = 100.0,
    falling: bool = True,
    source: str | None = None,
) -> RampTest:
    """Return a ramp test of a straight-line valve, made with NumPy alone: no code of the plant or of the fit."""
    up = np.linspace(0, 10, int(ramp_s * rate_Hz))
    u = np.concatenate([up, up[::-1]]) if falling else up
    rising = np.arange(u.size) < up.size
    knee = np.where(rising, truth.knee_rising, truth.knee_rising - truth.hysteresis)
    noise = np.random.default_rng([seed, round(1000 * dp_MPa)]).standard_normal(u.size)
    at_nominal = np.clip(truth.slope * (u - knee), 0, truth.saturation)
    dp = dp_MPa * (1 - truth.sag * (at_nominal / max(at_nominal.max(), 1e-12)) ** 2)
    q = at_nominal * np.sqrt(dp / dp_MPa)
    read = np.where(q < truth.floor, 0.0, q) + truth.noise * noise
    return RampTest(
        source=source or f"synthetic_{dp_MPa:g}.csv",
        sha256="0" * 64,
        time=np.arange(u.size) / rate_Hz,
        u=u.copy(),
        q=read * L_MIN,
        dp=dp * MPA,
    )


def with_side(compensator, **changes):
    """Return the compensator with other fields of its positive side."""
    positive = replace(compensator.positive, **changes)
    return replace(compensator, sides=replace(compensator.sides, positive=positive))


def signals_with_span(span_MPa: Fraction) -> Signals:
    """Return the default signals with both sensors of another span."""
    error = span_MPa / 4096
    sensor = PressureSignal(span_MPa=span_MPa, error_MPa=(-error, error))
    return Signals(pressure_a=sensor, pressure_b=sensor)
