"""`RampConditions`: how a ramp test was recorded, as a test report states it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Meta

from dzdesign.core.artefact_types import quantity

#: Significant digits of a rate: a recording's clock tells no more.
DIGITS = 4
LARGEST = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class RampConditions:
    """Pace and sampling of the ramps of one test."""

    rate_V_s: Annotated[float, quantity("V/s", ge=0, le=LARGEST)] | None
    """Rate of the command ramp, the fastest if there are several; null if unknown."""
    sampling_Hz: Annotated[float, quantity("Hz", ge=0, le=LARGEST)] | None
    """Number of samples used per second. If several rows of a file became one sample, their medians count. Null: no
    time was recorded."""
    samples: Annotated[int, Meta(ge=0, le=10**12)]
    """Number of samples used, over all ramps."""


def conditions_of(rates_V_s: Sequence[float], time_s: np.ndarray) -> RampConditions:
    """Return the conditions of a test from the paces of its branches and the times (N,) of its samples.

    A pace that is not known is NaN; where the time falls, another ramp begins.

    Examples
    --------
    >>> conditions_of([0.5, float("nan")], np.array([0.0, 0.01, 0.02, 0.0, 0.01]))
    RampConditions(rate_V_s=0.5, sampling_Hz=100.0, samples=5)
    """
    known = [rate for rate in rates_V_s if math.isfinite(rate) and rate > 0]
    steps = np.diff(time_s)
    steps = steps[steps > 0]
    interval = float(np.median(steps)) if steps.size else 0.0
    return RampConditions(
        rate_V_s=_significant(max(known)) if known else None,
        sampling_Hz=_significant(1 / interval) if interval > 1 / LARGEST else None,
        samples=int(time_s.size),
    )


def _significant(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
