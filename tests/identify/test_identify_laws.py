"""Laws of `identify` beside those of splitting and pooling: what must not matter does not, what must scale scales."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dzdesign.core.errors import InputError
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from tests.support.repeatable_valves import identify_sides
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

RATE_HZ = 20
laws = settings(max_examples=6, deadline=None, derandomize=True)
seeds = st.integers(0, 10**6)


def ramp(dp=1.0, seed=0, **keywords):
    truth = {"knee_rising": 5.5 - 0.06 * dp, "slope": 4 * dp**0.5, **keywords}
    return synthetic_ramp(dp, Truth(**truth), seed=seed, rate_Hz=RATE_HZ, ramp_s=60)


def valve(seed, **keywords):
    return [ramp(dp, seed, **keywords) for dp in (1.0, 3.0)]


def thresholds(tests, options=None):
    """Return knees and their standard errors, both (T, 2), V, as the fit has them: valve.json rounds them."""
    fit = identify_sides(tests, options).sides["positive"].knees
    return fit.knee, fit.knee_se


@pytest.mark.slow
@laws
@given(seed=seeds, factor=st.floats(0.1, 2.4))
def test_thresholds_scale_with_the_command(seed, factor):
    tests = valve(seed)
    scaled = [dataclasses.replace(test, u=factor * test.u) for test in tests]
    knee, se = thresholds(tests)
    knee_scaled, se_scaled = thresholds(scaled, IdentifyOptions(u_max=10 * factor))
    np.testing.assert_allclose(knee_scaled, factor * knee, rtol=1e-9)
    np.testing.assert_allclose(se_scaled, factor * se, rtol=1e-6)


@pytest.mark.slow
@laws
@given(seed=seeds, factor=st.floats(0.1, 100))
def test_the_size_of_the_valve_does_not_matter(seed, factor):
    tests = valve(seed)
    larger = [dataclasses.replace(test, q=factor * test.q) for test in tests]
    np.testing.assert_allclose(thresholds(larger), thresholds(tests), rtol=1e-9)


@pytest.mark.slow
@laws
@given(seed=seeds, longest=st.integers(2, 8))
def test_lingering_in_the_dead_zone_does_not_move_a_quiet_meters_knees(seed, longest):
    """Of a meter whose noise is below the flow that counts; a louder one is known better for it, see the other law."""
    test, rng = ramp(1.0, seed, noise=0.02), np.random.default_rng(seed)
    held = np.where(test.u < 4, rng.integers(1, longest + 1, test.u.size), 1)
    index = np.repeat(np.arange(test.u.size), held)
    again = np.concatenate([[False], np.diff(index) == 0])
    longer = dataclasses.replace(
        test,
        time=np.arange(index.size) / RATE_HZ,
        u=test.u[index],
        q=np.where(again, rng.normal(0, 0.02 * L_MIN, index.size), test.q[index]),
        dp=test.dp[index],
    )
    assert longer.u.size > 1.1 * test.u.size
    np.testing.assert_allclose(thresholds([longer])[0], thresholds([test])[0], rtol=0, atol=1e-9)


@pytest.mark.slow
@laws
@given(seed=seeds)
def test_which_branch_comes_first_does_not_matter(seed):
    """But for one sample: that at the turning point is counted to the sweep that it starts."""

    def falling_first(test):
        half = test.u.size // 2
        order = np.concatenate([np.arange(half, test.u.size), np.arange(half)])
        return dataclasses.replace(test, u=test.u[order], q=test.q[order], dp=test.dp[order])

    knee, se = thresholds(valve(seed))
    swapped, _ = thresholds([falling_first(test) for test in valve(seed)])
    assert np.all(np.abs(swapped - knee) < se)


@pytest.mark.slow
def test_a_repeated_test_shrinks_the_error_by_the_root_of_two():
    ratios, moves = [], []
    for seed in range(8):
        again = [dataclasses.replace(test, source="again " + test.source) for test in valve(seed + 100)]
        knee, se = thresholds(valve(seed))
        pooled, pooled_se = thresholds(valve(seed) + again)
        ratios.append(pooled_se / se)
        moves.append((pooled - knee) / se)
    # How far the straight part reaches may change with the data, and the error with it: the law is of the average.
    assert np.exp(np.mean(np.log(ratios))) == pytest.approx(2**-0.5, rel=0.1)
    # The mean of two differs from the first by half of their difference: 0.7 standard errors.
    assert np.sqrt(np.mean(np.square(moves))) == pytest.approx(2**-0.5, rel=0.35)


def by_hand(seed, nominal, repeats, off, gap=0.0, swing=0.0):
    """Return ramps at pressures that a hand set: off by a share of each, `gap` MPa apart, or swinging with a pump."""
    random = np.random.default_rng(seed)
    drops = np.repeat(nominal, repeats) * (1 + off * random.uniform(-1, 1, len(nominal) * repeats))
    ramps = []
    for number, dp in enumerate(np.round(drops + gap * np.arange(drops.size), 6).tolist()):
        truth = Truth(knee_rising=5.5 - 0.03 * dp, slope=4 * dp**0.5)
        test = synthetic_ramp(dp, truth, seed=seed + number, rate_Hz=10, ramp_s=40, source=f"{number}.csv")
        swings = 1 + swing * np.sin(2 * np.pi * 0.7 * test.time + seed)
        ramps.append(dataclasses.replace(test, q=test.q * swings**0.5, dp=test.dp * swings, sha256=f"{number:064x}"))
    return ramps


def excess_of(tests, options=None):
    """Return by how much the bounds of a valve of `by_hand` lie above its thresholds at most, V."""
    side, excess = identify(tests, options).positive, [-np.inf]
    for guard, curve in side.certified.items():
        ceilings = [curve.bound()]
        if curve.above is not None and curve.above.certified:
            ceilings.append(curve.above.bound())
        below = {"closing": 0.1, "mean": 0.05, "opening": 0.0}[guard]
        for bound in ceilings:
            ends = [float(end) for piece in bound.pieces for end in (piece.from_MPa, piece.to_MPa)]
            at = np.union1d(np.linspace(*map(float, bound.dp_MPa), 101), ends)
            known = np.isfinite(bound.in_doubles(at))  # of two pressure drops with nothing declared the tests alone
            excess.append(np.max(bound.in_doubles(at)[known] - (5.5 - 0.03 * at[known] - below)))
    return max(excess)


@pytest.mark.parametrize("seed", range(8))
def test_pressures_set_by_hand_end_in_no_internal_error(seed):
    assert excess_of(by_hand(seed, (1, 3, 5, 8, 12)[: 4 + seed % 2], 3 + seed // 4, off=0.03)) < 0


@settings(max_examples=12, deadline=None, derandomize=True)
@given(
    seed=seeds,
    nominal=st.lists(st.floats(0.5, 12), min_size=2, max_size=5),
    repeats=st.integers(1, 3),
    off=st.sampled_from([0.0, 0.03]),
    gap=st.sampled_from([0.0, 1e-6, 1e-4, 0.02]),
    swing=st.sampled_from([0.0, 0.1]),
    curve=st.sampled_from([None, "line", "monotone"]),
)
def test_pressures_that_nearly_coincide_swing_or_repeat(seed, nominal, repeats, off, gap, swing, curve):
    try:
        excess = excess_of(by_hand(seed, nominal, repeats, off, gap, swing), IdentifyOptions(curve=curve))
    except InputError:  # such as a line that few pressures do not support
        return
    assert excess < 0
