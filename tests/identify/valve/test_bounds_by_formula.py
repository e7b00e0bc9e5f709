"""The certified offset again from valve.json, by a formula of this file alone: a wrong bound of `identify` is seen.

`verify` computes no bounds: an accidental edit breaks the hash in valve.json, and `verify --ramps` identifies again.
Nothing of identify's arithmetic is used here; the quantile is that of another routine.
"""

import json

import numpy as np
import pytest
from scipy import stats

from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.design.designing import design
from dzdesign.identify.fitting import error_statement
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from tests.support.synthetic import Truth, synthetic_ramp

#: Degrees of freedom of the noise; shares of the error probability that the premises keep for above the tests.
OF_NOISE, KEPT = 14.0, {"monotone": 0.0, "smooth": 0.25}
PRESSURES = (0.5, 1.0, 2.0, 3.0, 5.0)
OPTIONS = (
    {"curve": "monotone"},
    {"curve": "smooth"},
    {"repeatability": 1e-3, "curve": "monotone"},
    {"confidence": 0.9, "curve": "smooth"},
    {"meter_lag": 0.1, "curvature": 2e-14, "curve": "smooth"},
    {"meter_zero": 1e-6, "curve": "monotone"},
)


def recomputed(curve: dict, confidence: float) -> np.ndarray:
    """Return the lower bounds at the tests, V: the threshold less noise, scatter, drift and budget.

    u - max(t(14) e, t sqrt(s² (1 + c) + own ± drift's) ∓ drift) - b, each quantile for all tests at once.
    """
    errors, threshold = curve["errors"], np.array(curve["u_threshold_V"])
    tests, noise = threshold.size, np.array(errors["noise_se_V"])
    left = (1 - KEPT[curve["premise"]]) * (1 - confidence)
    shared = errors["ramp_sd_V"] ** 2 * np.array(errors["covariance"])
    own = np.maximum(noise**2 - errors["ramp_noise_V"] ** 2 * np.diag(errors["covariance"])[:tests], 0)
    of_mean = np.diag(shared)[:tests] + own
    degrees = errors["degrees_of_freedom"] or OF_NOISE / np.maximum(noise**2 / of_mean, 1e-3) ** 2
    tail = left if errors["of_largest"] else left / tests
    taken = [stats.t.isf(left / tests, OF_NOISE) * noise]
    for state in (-0.5, 0.5):
        variance, shift = errors["ramp_sd_V"] ** 2 + of_mean, 0.0
        if errors["drift_V"] is not None:
            variance = variance + 2 * state * shared[:tests, -1] + state**2 * shared[-1, -1]
            shift = state * errors["drift_V"] - errors["uneven_V"]
        taken.append(stats.t.isf(tail, np.minimum(degrees, 1e6)) * np.sqrt(variance) - shift)
    return threshold - np.max(taken, axis=0) - np.array(errors["budget_V"])


def apart_V(valve) -> float:
    """Return by how much the bounds in a valve.json are above those of the formula, at most."""
    document = json.loads(to_json_bytes(valve))
    return max(
        float(np.abs(np.array(curve["u_lower_V"]) - recomputed(curve, side["certificate"]["confidence"])).max())
        for side in document["sides"].values()
        for curve in side["certified"].values()
    )


@pytest.fixture(scope="module")
def ramps(example_tests):
    made = [
        synthetic_ramp(dp, Truth(knee_rising=5.5 - 0.06 * dp, slope=4 * dp**0.5), ramp_s=40.0) for dp in PRESSURES
    ]
    return {"example": example_tests, "made": made}


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("which", ["example", "made"])
def test_the_bounds_are_those_of_the_formula(ramps, which, options):
    assert apart_V(identify(ramps[which], IdentifyOptions(**options))) < 3e-6


def test_the_certified_offset_lies_below_the_formulas_bound(ramps):
    valve = identify(ramps["example"], IdentifyOptions(curve="monotone"))
    document, made = json.loads(to_json_bytes(valve)), design(valve)
    side = document["sides"]["positive"]
    curve = side["certified"][side["certificate"]["guard"]]
    limits = recomputed(curve, side["certificate"]["confidence"])
    for dp, limit in zip(curve["dp_MPa"], limits, strict=True):
        offset = made.beta(int(made.signals.dp_code(dp))) * made.positive.u_min0_over_u_max * made.u_max_V
        assert float(offset) < limit


def test_a_wrong_bound_of_identify_is_seen(ramps, monkeypatch):
    """Seeded: bounds a tenth of a millivolt too high."""
    right = error_statement.lower_bounds
    monkeypatch.setattr(error_statement, "lower_bounds", lambda *given: right(*given) + 1e-4)
    assert apart_V(identify(ramps["example"], IdentifyOptions(curve="monotone"))) > 5e-5
