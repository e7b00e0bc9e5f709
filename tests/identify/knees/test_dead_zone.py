"""What averages over the dead zone resolve: a notch that no single reading shows is seen, or stays below the level."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest

L_MIN, MPA = 1e-3 / 60, 1e6
EDGE, GAIN = 4.6, 4.0
PRESSURES = (1.0, 4.0)


def flow(u, dp, notch=0.0, width=1.5):
    return GAIN * dp**0.5 * (np.clip(u - EDGE, 0, None) + notch * np.clip(u - EDGE + width, 0, width))


def ramp(dp, seed, *, noise=0.75, memory=0.0, floor=None, **edge):
    rng = np.random.default_rng([seed, round(10 * dp)])
    up = np.linspace(0, 10, 5000)
    u = np.concatenate([np.zeros(200), up, up[::-1], np.zeros(200)])
    scatter = rng.standard_normal(u.size)
    if memory:
        from scipy.signal import lfilter

        scatter = lfilter([np.sqrt(1 - memory**2)], [1, -memory], scatter)
    q = flow(u, dp, **edge) + noise * scatter
    return RampTest(
        source=f"dP{dp:g}.csv",
        sha256=f"{seed:064x}",
        time=np.arange(u.size) / 50,
        u=u,
        q=(q if floor is None else np.where(q < floor, 0.0, q)) * L_MIN,
        dp=np.full(u.size, dp * MPA),
    )


def identified(seed, *, noise_level=None, **bench):
    options = IdentifyOptions(
        meter_lag=0.0, repeatability=0.0, noise_level=None if noise_level is None else noise_level * L_MIN
    )
    return identify([ramp(dp, seed, **bench) for dp in PRESSURES], options)


def level(valve):
    return valve.positive.certificate.level_L_min


def passed(valve, **edge):
    """The largest true flow at the law's offset, L/min."""
    curve = valve.positive.curve
    return max(float(flow(u, dp, **edge)) for u, dp in zip(curve.u_offset_V, PRESSURES, strict=True))


def codes(valve):
    return {warning.code for warning in valve.warnings}


class TestNotch:
    @pytest.mark.parametrize("seed", range(4))
    @pytest.mark.parametrize(
        ("notch", "width", "noise"), [(0.1, 1.5, 0.75), (0.2, 0.5, 0.75), (0.05, 1.0, 0.15), (0.3, 0.2, 0.15)]
    )
    def test_a_notch_below_the_knee_is_seen_and_said(self, notch, width, noise, seed):
        edge = {"notch": notch, "width": width}
        valve = identified(seed, noise=noise, **edge)
        assert passed(valve, **edge) < level(valve)
        assert "soft-edge" in codes(valve)

    def test_what_averages_show_at_one_pressure_holds_at_all(self):
        tests = [ramp(1.0, 1), ramp(4.0, 1, notch=0.1)]
        curve = identify(tests, IdentifyOptions(meter_lag=0.0, repeatability=0.0)).positive.curve
        assert max(curve.u_lower_V) < EDGE - 0.5

    @pytest.mark.parametrize("seed", range(6))
    @pytest.mark.parametrize(
        "bench",
        [{}, {"noise": 0.05}, {"noise": 0.3, "memory": 0.95}, {"floor": 0.6, "noise": 0.1}, {"floor": 0.0}],
        ids=["loud", "quiet", "slow", "floor", "shows nothing below zero"],
    )
    def test_a_sharp_edge_pays_nothing(self, seed, bench):
        valve = identified(seed, **bench)
        assert "soft-edge" not in codes(valve)
        assert passed(valve) == 0.0

    def test_outliers_below_the_knee_are_no_flow(self):
        tests = []
        for dp in PRESSURES:
            test = ramp(dp, 3, noise=0.1)
            struck = np.random.default_rng(5).random(test.u.size) < 0.04
            tests.append(replace(test, q=np.where(struck & (np.abs(test.u - EDGE + 0.2) < 0.19), 15 * L_MIN, test.q)))
        assert "soft-edge" not in codes(identify(tests, IdentifyOptions(meter_lag=0.0)))


class TestLevel:
    def test_it_is_what_averages_resolve_and_no_multiple_of_one_readings_noise(self):
        loud, quiet = (identified(1, noise=noise) for noise in (0.75, 0.01))
        assert 0.2 < level(loud) < 0.8 < 3 * 0.75
        largest = max(test.q_max_L_min for test in quiet.positive.tests)
        assert level(quiet) == pytest.approx(0.005 * largest, rel=0.02)
        assert level(loud) == pytest.approx(max(test.noise_level_L_min for test in loud.positive.tests))

    def test_twice_the_readings_resolve_a_root_of_two_more(self):
        once = [ramp(1.0, 1)]
        twice = [*once, replace(ramp(1.0, 2), source="again.csv")]
        options = IdentifyOptions(meter_lag=0.0)
        first, second = (identify(tests, options).positive.certificate.level_L_min for tests in (once, twice))
        assert first / second == pytest.approx(2**0.5, rel=0.1)

    def test_slow_noise_resolves_less(self):
        white, slow = (level(identified(1, noise=0.3, memory=memory)) for memory in (0.0, 0.9))
        assert slow > 2.5 * white

    def test_a_floor_is_the_least(self):
        assert level(identified(1, noise=0.02, floor=0.6)) >= 0.55

    def test_a_declared_one_counts_if_it_is_resolved(self):
        coarse, fine, too_fine = (identified(1, noise=0.1, noise_level=flow) for flow in (0.5, 0.1, 0.01))
        assert level(coarse) == pytest.approx(0.5)
        assert level(fine) == pytest.approx(0.1)
        assert level(too_fine) > 0.01
        assert ["noise-level" in codes(valve) for valve in (coarse, fine, too_fine)] == [False, False, True]

    def test_a_table_of_few_levels_has_that_of_its_readings(self):
        test = ramp(1.0, 1, noise=0.02)
        table = test.part(np.arange(0, test.u.size, 125))
        assert level(identify([table], IdentifyOptions(meter_lag=0.0))) > 0
