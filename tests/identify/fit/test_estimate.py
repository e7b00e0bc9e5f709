"""The estimate of both branches: what the data say, in the class, and closing below opening."""

import numpy as np
import pytest

from dzdesign.identify.fit.curve_class import find_class
from dzdesign.identify.fit.estimate import estimate_side
from dzdesign.identify.fit.ramp_model import Ramps
from dzdesign.identify.fit.scatter import measure_scatter

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


def test_both_curves_and_beta_are_the_truth_within_their_errors():
    pair = branches()
    found = estimate_side(pair, find_class(pair[0], curve=None, curvature=None), direction=-1)
    truth = 5.2 - 0.06 * (found.grid_MPa - 1)
    for curve, se, up in zip(found.curves, found.curves_se, (0.0, 0.16), strict=True):
        assert np.all(np.abs(curve - truth - up) < 5 * se)
    beta, u_min0 = found.beta(0, 1.0)
    assert u_min0 == pytest.approx(5.2, abs=5e-3) and beta[0] == 1 and beta[-1] == pytest.approx(4.96 / 5.2, abs=2e-3)


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


def test_the_firmware_s_direction_is_a_row_more():
    pair = branches(sd=1e-3, curve=lambda p: 5 + 0.02 * (p - 3) ** 2)
    curves = find_class(pair[0], curve=None, curvature=None)
    assert np.any(np.diff(estimate_side(pair, curves).curves[0]) > 1e-3)
    assert np.all(np.diff(estimate_side(pair, curves, direction=-1).curves[0]) < 1e-9)
