"""The first flows that count: a sharp edge under a meter's floor is not called soft, and a soft one still is."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.identify.knees.characteristic import _with_censored
from dzdesign.identify.knees.gated_line import straight_line
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.side import identify_side
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

PRESSURES_MPa = (1.0, 2.0, 3.0, 4.0, 5.0)


def identified(seed: int, noise: float, floor: float):
    """Identify ramp tests of a sharp edge; the meter's floor cuts off what it reads, noise and all."""
    tests = []
    for dp in PRESSURES_MPa:
        test = synthetic_ramp(dp, Truth(slope=4 * dp**0.5, noise=noise), seed=seed, rate_Hz=100.0)
        tests.append(replace(test, q=np.where(test.q < floor * L_MIN, 0.0, test.q)))
    return identify_side(tests, IdentifyOptions(meter_lag=0.0, meter_floor=floor * L_MIN, repeatability=0.0))


@pytest.mark.slow
def test_a_sharp_edge_under_a_floor_is_not_called_soft():
    """Without the censored samples the tail leaned to lower commands by one standard error, a test and a branch."""
    gaps, soft = [], 0
    for seed in range(16):
        side = identified(seed, noise=0.15, floor=0.6)
        for row, item in enumerate(side.described.tests):
            for column, shape in enumerate(item.shapes):
                gaps.append((side.knees.knee[row, column] - shape.tail.zero) / shape.tail.zero_se)
        soft += any(test.u_guard_V < test.u_knee_falling_V for test in side.model.tests)
    assert abs(np.mean(gaps)) < 0.35 and np.std(gaps) == pytest.approx(1, abs=0.35)
    assert soft <= 1


@pytest.mark.parametrize("floor", [0.0, 0.4, 0.8])
def test_the_line_of_a_tail_is_the_one_of_all_its_samples(floor):
    """Samples of a known line, cut off below a floor: filled in, the line is the true one; the bare one is not."""
    rng, sigma = np.random.default_rng(7), 0.3
    u = np.linspace(5 + floor / 2, 5 + 1.5 * floor if floor else 6.0, 4000)  # from the floor to three times that
    y = 2.0 * (u - 5.0) + sigma * rng.standard_normal(u.size)
    seen = y >= floor if floor else np.ones(u.size, dtype=bool)
    slope, zero = straight_line(*_with_censored(u[seen], y[seen], u[~seen], floor, sigma))
    assert slope == pytest.approx(2.0, abs=0.15) and zero == pytest.approx(5.0, abs=0.03)
    if floor:
        assert abs(straight_line(u[seen], y[seen])[1] - 5.0) > 0.06


def test_a_drop_out_far_above_the_floor_is_not_filled_in():
    u = np.linspace(1.0, 3.0, 50)
    u_all, _ = _with_censored(u, u, np.array([2.9]), 0.5, 0.01)
    assert u_all.size == u.size
