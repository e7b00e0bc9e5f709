"""Knees of all tests: zeros of least-squares lines by NumPy on the raw samples, and the errors that they scatter by."""

import numpy as np
import pytest

from dzdesign.identify.knees.described_tests import Knees
from dzdesign.identify.knees.prepared_tests import describe_tests
from dzdesign.identify.options import IdentifyOptions
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

KNEES_V = {0.5: 5.45, 1.0: 5.42, 4.0: 5.3}


def described(seed, noise_L_min=0.15):
    rng, tests = np.random.default_rng([20261121, seed]), []
    for dp, knee in KNEES_V.items():
        test = synthetic_ramp(dp, Truth(knee_rising=knee, slope=3 * dp**0.5, noise=0.0), ramp_s=40.0)
        q = test.q + noise_L_min * L_MIN * rng.standard_normal(test.q.size)
        tests.append(type(test)(source=test.source, sha256=test.sha256, time=test.time, u=test.u, q=q, dp=test.dp))
    return describe_tests(tests, IdentifyOptions(meter_floor=0.0, meter_lag=0.0))


def knees_of(group):
    return Knees.of([item.shapes for item in group.tests])


def test_a_knee_is_the_zero_of_the_least_squares_line():
    group = described(0)
    found = knees_of(group)
    for row, item in enumerate(group.tests):
        for column, shape in enumerate(item.shapes):
            kept = shape.line.kept
            slope, height = np.polyfit(shape.prepared.branch.u[kept], shape.prepared.y[kept], 1)
            assert found.knee[row, column] == pytest.approx(-height / slope, abs=1e-8)
            assert found.slope[row, column] == pytest.approx(slope, rel=1e-8)


def test_its_error_is_what_it_scatters_by():
    found = [knees_of(described(seed)) for seed in range(60)]
    scatter = np.std([each.knee for each in found], axis=0)
    claimed = np.mean([each.knee_se for each in found], axis=0)
    # Of 60 draws a standard deviation is known to 9 %; six of them within 30 %.
    np.testing.assert_allclose(claimed / scatter, 1, atol=0.3)


def test_a_missing_branch_is_no_number():
    shapes = [(item.shapes[0], None) for item in described(0).tests]
    found = Knees.of(shapes)
    assert np.isnan(found.knee[:, 1]).all() and np.isfinite(found.knee[:, 0]).all()
