"""The estimate of both branches: what the data say, in the class, and closing below opening."""

import numpy as np
import pytest

from dzdesign.identify.fit.curve_class import find_class
from dzdesign.identify.fit.estimate import covariance_of_curve, estimate_side
from dzdesign.identify.fit.ramp_model import Ramps
from dzdesign.identify.fit.scatter import measure_scatter
from dzdesign.identify.fitting.identifying import ratio_to

DP = np.repeat(np.arange(1.0, 6.0), 3)


def branches(gap=0.16, sd=2e-3, seed=1, curve=lambda p: 5.2 - 0.06 * (p - 1)):
    rng = np.random.default_rng(seed)
    return [
        measure_scatter(
            Ramps(dp_MPa=DP, y=curve(DP) + up + sd * rng.standard_normal(DP.size), se=np.full(DP.size, 1e-3)),
            declared=None, assumed=25e-3,
        )
        for up in (0.0, gap)
    ]  # fmt: skip


def test_both_curves_are_the_truth_within_their_errors():
    pair = branches()
    found = estimate_side(pair, find_class(pair[0], curve=None, curvature=None))
    truth = 5.2 - 0.06 * (found.grid_MPa - 1)
    for curve, scatter, up in zip(found.curves, pair, (0.0, 0.16), strict=True):
        error = np.sqrt(np.diag(covariance_of_curve(scatter, found.grid_MPa, straight=False)))
        assert np.all(np.abs(curve - truth - up) < 5 * error)


@pytest.mark.parametrize("straight", [False, True])
def test_beta_s_error_is_what_it_scatters_by(straight):
    """Eq. (5) at 5 MPa of 400 valves, against the error that is claimed."""
    at, found, claimed = np.array([1.0, 5.0]), [], []
    for seed in range(400):
        scatter = branches(sd=5e-3, seed=seed)[0]
        curves = find_class(scatter, curve="line" if straight else None, curvature=None)
        u = np.interp(at, curves.grid_MPa, estimate_side([scatter], curves).curves[0])
        beta, error = ratio_to(0, u, covariance_of_curve(scatter, at, straight=straight))
        found.append(beta[1])
        claimed.append(error[1])
    assert np.std(found) == pytest.approx(np.sqrt(np.mean(np.square(claimed))), rel=0.15)
    assert np.mean(found) == pytest.approx(4.96 / 5.2, abs=3e-4)


def test_closing_never_lies_above_opening():
    pair = branches(gap=-2e-3, sd=10e-3)
    found = estimate_side(pair, find_class(pair[0], curve=None, curvature=None))
    assert np.all(found.curves[0] <= found.curves[1] + 1e-9)
    apart = [estimate_side([each], find_class(pair[0], curve=None, curvature=None)).curves[0] for each in pair]
    assert np.any(apart[0] > apart[1])  # the data alone say otherwise, so that the constraint is what holds


def test_a_straight_class_gives_the_weighted_straight_line():
    pair = branches(sd=10e-3)[:1]
    found = estimate_side(pair, find_class(pair[0], curve="line", curvature=None))
    line = np.polyfit(DP, pair[0].model.ramps.y, 1)
    np.testing.assert_allclose(found.curves[0], np.polyval(line, found.grid_MPa), atol=2e-6)
