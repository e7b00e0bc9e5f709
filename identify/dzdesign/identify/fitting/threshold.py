"""`Threshold`: a threshold that a certificate may guard, at each test."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Threshold:
    """A guarded threshold, its standard errors and simultaneous lower bounds (V), all (T,)."""

    value: np.ndarray
    se: np.ndarray
    bound: np.ndarray
    #: By how much the bounds were lowered for the tolerance of the meter's lag, V, (T,).
    lag_budget: np.ndarray
