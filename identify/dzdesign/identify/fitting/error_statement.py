"""What the bounds of a curve are made of, as valve.json states it: errors, and beside them a budget."""

import math

import numpy as np

from dzdesign.identify.constants import Premise
from dzdesign.identify.fitting.bounds import lower_bounds
from dzdesign.identify.fitting.guarded_thresholds import GuardedThreshold
from dzdesign.identify.fitting.premises import confidence_at_tests
from dzdesign.identify.valve.bound_errors import BoundErrors


def budget_of_free(guarded: GuardedThreshold, confidence: float) -> np.ndarray:
    """Return what bounds without a direction have taken off beside noise and scatter, V (T,): none is negative."""
    free, between = guarded.free, guarded.between
    at_tests = confidence_at_tests(confidence)
    statistical = lower_bounds(free.value, free.se, between, at_tests, np.zeros(free.value.size))
    budget: np.ndarray = np.maximum(statistical - free.bound, 0.0)
    return budget


def stated_errors(
    guarded: GuardedThreshold,
    premise: Premise,
    se: np.ndarray,
    value: np.ndarray,
    lower: np.ndarray,
    confidence: float,
) -> BoundErrors:
    """State what bounds (V, (T,)) of thresholds under a premise are made of."""
    between = guarded.between
    if premise == "line":
        budget = budget_of_free(guarded, confidence)
    else:
        at_tests = confidence if premise == "monotone" else confidence_at_tests(confidence)
        budget = lower_bounds(value, se, between, at_tests, np.zeros(value.size)) - lower
    drift = between.drift
    return BoundErrors(
        noise_se_V=tuple(map(float, se)),
        ramp_sd_V=between.sd,
        ramp_noise_V=math.sqrt(between.noise),
        degrees_of_freedom=None if math.isinf(between.degrees) else between.degrees,
        of_largest=between.of_largest,
        covariance=tuple(tuple(map(float, row)) for row in between.covariance),
        drift_V=drift.change if drift else None,
        uneven_V=drift.uneven if drift else 0.0,
        budget_V=tuple(map(float, budget)),
    )
