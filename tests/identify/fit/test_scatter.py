"""Knots by the pressures alone, equal scatter before outliers, and how large the scatter is."""

import numpy as np
import pytest

from dzdesign.identify.fit.ramp_model import Ramps, find_knots, fit_ramp_model
from dzdesign.identify.fit.scatter import find_unlike_knot, measure_scatter

DP = np.repeat(np.arange(1.0, 6.0), 3)


def scattered(seed, sd=12.5e-3, dp=DP, clock=None):
    rng = np.random.default_rng(seed)
    y = 5.2 - 0.06 * (dp - 1) + np.broadcast_to(sd, dp.shape) * rng.standard_normal(dp.size)
    return Ramps(dp_MPa=dp, y=y, se=np.full(dp.size, 1e-3), clock=clock)


def measured(ramps, declared=None):
    return measure_scatter(ramps, declared=declared, assumed=25e-3)


@pytest.mark.parametrize("by_hand", [0.0, 0.01, 0.03])
def test_pressures_set_by_hand_are_the_knots_that_were_meant(by_hand):
    dp = DP * (1 + by_hand * np.random.default_rng(2).uniform(-1, 1, DP.size))
    knots = find_knots(dp, share=True)
    assert knots.size == 5 and knots[0] == dp.min() and knots[-1] == dp.max()
    assert np.max(np.abs(knots - np.arange(1, 6))) < 5 * by_hand + 1e-9


def test_ramps_that_stand_alone_share_knots_only_where_the_scatter_is_to_come_from_them():
    dp = np.linspace(1, 5, 15)
    assert find_knots(dp, share=True).size < 9 <= find_knots(dp, share=False).size


def test_no_threshold_moves_a_knot():
    first, second = scattered(1), scattered(2)
    np.testing.assert_array_equal(
        fit_ramp_model(first, share_knots=True).knots_MPa, fit_ramp_model(second, share_knots=True).knots_MPa
    )


def test_a_drift_is_told_where_the_order_and_the_pressure_are_told_apart():
    clock = np.linspace(-0.5, 0.5, DP.size)
    assert not fit_ramp_model(scattered(1, clock=clock, dp=np.linspace(1, 5, 15)), share_knots=False).drift
    mixed = np.random.default_rng(5).permutation(DP)
    model = fit_ramp_model(scattered(1, sd=1e-4, clock=clock, dp=mixed), share_knots=False)
    assert model.drift and abs(model.drift_V) < 1e-3
    ramps = scattered(1, sd=1e-4, clock=clock, dp=mixed)
    drifting = Ramps(dp_MPa=mixed, y=ramps.y + 0.1 * clock, se=ramps.se, clock=clock)
    assert fit_ramp_model(drifting, share_knots=False).drift_V == pytest.approx(0.1, abs=1e-3)


def test_scatter_and_degrees_of_freedom():
    found = [measured(scattered(seed)) for seed in range(200)]
    assert all(each.degrees == 10 and each.origin == "repeats" for each in found if not each.set_aside)
    assert np.sqrt(np.mean([each.variance for each in found])) == pytest.approx(12.5e-3, rel=0.05)
    # Of 200 families of a normal scatter 1 % have a ramp set aside, and 0.5 % a knot unlike the others.
    assert sum(bool(each.set_aside) for each in found) <= 8 and sum(each.unlike is not None for each in found) <= 5


def test_a_declared_scatter_counts_unless_the_repeats_contradict_it():
    ramps = scattered(1)
    declared = measured(ramps, declared=12.5e-3)
    assert declared.origin == "declared" and declared.degrees > 1e5
    assert measured(ramps, declared=1e-3).origin == "repeats"
    alone = scattered(1, dp=np.arange(1.0, 6.0))
    assert measured(alone).origin == "assumed" and measured(alone).share > 0.99


@pytest.mark.parametrize("off", [0.15, -0.15])
@pytest.mark.parametrize("ramp", [0, 7, 14])
def test_one_ramp_off_is_set_aside_and_named(ramp, off):
    found = []
    for seed in range(20):
        ramps = scattered(seed)
        ramps.y[ramp] += off
        found.append(measured(ramps))
    # Where the other two of its knot happen to differ, all three may be taken for a wider scatter.
    told = [one for one in found if one.unlike is None]
    assert len(told) >= 18 and all([each.ramp for each in one.set_aside][:1] == [ramp] for one in told)
    assert all(np.sign(one.set_aside[0].distance) == np.sign(off) for one in told)
    assert all(not one.kept[ramp] and one.kept.sum() == 15 - len(one.set_aside) for one in told)


def test_of_two_ramps_that_differ_the_lower_one_stays():
    dp = np.repeat(np.arange(1.0, 9.0), 2)
    ramps = scattered(3, sd=2e-3, dp=dp)
    ramps.y[4:6] = 5.2, 5.0
    found = measured(ramps)
    assert [each.ramp for each in found.set_aside] == [4]


def test_a_knot_that_scatters_more_keeps_a_variance_of_its_own():
    sd = np.where(DP == 1, 60e-3, 3e-3)
    found = [measured(scattered(seed, sd)) for seed in range(100)]
    told = [each for each in found if each.unlike]
    assert len(told) >= 40 and all(each.unlike.knot == 0 and each.unlike.degrees == 2 for each in told)
    assert all(each.variance < (6e-3) ** 2 < each.unlike.variance for each in told)
    # Else one of the three explains it, for the other two are alike; a scatter that is small by chance is left.
    assert sum(bool(each.set_aside) for each in found if not each.unlike) >= 95 - len(told)


def test_noise_that_is_known_to_differ_is_no_scatter():
    se = np.where(DP == 1, 20e-3, 1e-3)
    rng, found = np.random.default_rng(4), 0
    for _ in range(100):
        y = 5 + se * rng.standard_normal(DP.size)
        found += find_unlike_knot(fit_ramp_model(Ramps(dp_MPa=DP, y=y, se=se), share_knots=False)) is not None
    assert found <= 3


def test_ramps_of_two_groups_all_count():
    """None is set aside, and the scatter reaches from group to group."""
    dp = np.repeat(np.arange(1.0, 6.0), 7)
    ramps = scattered(1, sd=1e-3, dp=dp)
    ramps.y[0] -= 0.5
    assert measured(ramps).set_aside
    found = measure_scatter(ramps, declared=None, assumed=25e-3, least=0.25)
    assert not found.set_aside and found.variance >= 0.25**2


def test_a_badly_measured_ramp_neither_hides_nor_feigns_scatter():
    """Every third ramp has an error of 39 mV, the others 2 mV; what the errors alone make is next to no scatter."""
    se = np.tile([2e-3, 2e-3, 39e-3], 5)
    for scatter in (12.5e-3, 0.0):
        found = []
        for seed in range(100):
            of_valve = scattered(seed, sd=np.hypot(scatter, se))
            found.append(measured(Ramps(dp_MPa=DP, y=of_valve.y, se=se)))
        shown = np.mean([each.model.scatter for each in found])
        assert np.sqrt(shown) == pytest.approx(scatter, rel=0.1, abs=4e-3)
        np.testing.assert_allclose(found[0].of_ramps, found[0].model.scatter + se**2)
        assert sum(bool(each.set_aside) or each.unlike is not None for each in found) <= 4


def test_a_badly_measured_ramp_hardly_moves_the_curve():
    se = np.tile([2e-3, 2e-3, 39e-3], 5)
    ramps = Ramps(dp_MPa=DP, y=5.2 - 0.06 * (DP - 1) + 39e-3 * (se > 0.03), se=se)
    found = measured(ramps, declared=2e-3).model
    assert np.max(np.abs(found.at_knots() @ ramps.y - (5.2 - 0.06 * (found.knots_MPa - 1)))) < 0.2e-3
