"""Soft edges that noise, a fast ramp or a meter's floor hides: benchmarks/identify/soft_edges.py in small, its faults,
and the fit of an edge against readings that another filter made."""

from dataclasses import replace

import numpy as np
import pytest
import soft_edges as bench
from bench_plant import commanded, lagged, ramp

from dzdesign.identify.fitting import guarded_thresholds, soft_edges
from dzdesign.identify.fitting.soft_edges import EdgeAverages, Softness, fit_edges
from dzdesign.identify.identification import identify
from dzdesign.identify.knees import meter
from dzdesign.identify.options import IdentifyOptions

COUNTS = {
    "notch of 0.3 over 0.3 V, noise 0.2 L/min, 20 s": 8,
    "notches, lag not declared": 6,
    "notches, opening": 4,
    "notches and a floor": 8,
    "rounded edges and a floor": 4,
}


def examined(name, count, seed=3):
    draw, guard = bench.CASES[name]
    for valve in range(count):
        rng = np.random.default_rng([seed, len(name), valve])
        yield bench.examine(draw(rng), guard, rng)


def no_softness(edges, knees, confidence):
    return Softness(0 * knees, 0 * knees)


@pytest.mark.slow
@pytest.mark.parametrize("name", COUNTS)
def test_no_more_than_the_level_flows_and_the_meter_can_show_it(name):
    for opened, below_floor, *_ in examined(name, COUNTS[name]):
        assert not opened
        assert not below_floor


def test_without_the_shape_of_the_edge_the_notch_opens(monkeypatch):
    monkeypatch.setattr(guarded_thresholds, "find_softness", no_softness)
    name = next(iter(COUNTS))
    assert sum(result[0] for result in examined(name, COUNTS[name])) > COUNTS[name] / 2


@pytest.mark.slow
def test_the_lag_in_steps_too_wide_opens(monkeypatch):
    """Of a lag that is not known the shortest and the longest are not enough: between them the notch is credible."""
    valve = bench.Drawn(
        depth=0.31, width=0.2, noise=0.12, lag=0.051, lag_declared=False, repeats=3, ramp_s=20.0, scatter=0.0
    )

    def opened():
        return sum(bench.examine(valve, "closing", np.random.default_rng(seed))[0] for seed in range(12))

    assert opened() == 0
    monkeypatch.setattr(soft_edges, "MOST_LAGS", 2)
    assert opened() > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["sharp edges", "sharp edges and a floor"])
def test_sharp_edges_pay_next_to_nothing(name, monkeypatch):
    with_it = np.array([result[2] for result in examined(name, 5)])
    monkeypatch.setattr(guarded_thresholds, "find_softness", no_softness)
    without = np.array([result[2] for result in examined(name, 5)])
    assert np.all(with_it >= without - 1e-9)
    assert np.median(with_it - without) < 1e-3
    assert np.mean(with_it - without) < 10e-3


class TestFloorOfAllRamps:
    VALVE = bench.Drawn(depth=float("nan"), width=0.4, noise=0.08, floor=0.3, ramp_s=20.0, repeats=1)

    def identified(self, **other):
        rng, valve = np.random.default_rng(4), replace(self.VALVE, **other)
        recordings = [bench._ramp(valve, dp, f"{dp:g}.csv", 0.0, rng) for dp in bench.PRESSURES_MPa]
        return identify(recordings, IdentifyOptions(meter_lag=0.1, repeatability=4e-4))

    def test_a_soft_edge_does_not_hide_it(self):
        valve = self.identified()
        assert valve.meter.floor_L_min == pytest.approx(0.3, abs=0.06)
        assert valve.positive.certificate.level_L_min >= 0.3

    def test_ramps_one_by_one_do_not_show_it(self, monkeypatch):
        gap = meter._gap
        monkeypatch.setattr(meter, "_gap", lambda parts, u_max: gap(parts, u_max) if len(parts) < 2 else 0.0)
        assert self.identified().positive.certificate.level_L_min < 0.3

    def test_a_meter_without_a_floor_has_none(self):
        assert self.identified(floor=0.0).meter.floor_L_min == 0


class TestFit:
    SHARE, WIDTH, KNEE, SLOPE = 0.3, 0.4, 5.0, 4.0

    def averages(self, lag, *, rising, floor=0.0, noise=1e-6):
        rate_Hz = 1000.0
        time, u = commanded(ramp(20.0, before=2.0, at_top=2.0), rate_Hz)
        x = u - (self.KNEE - (1 - self.SHARE) * self.WIDTH)
        flow = self.SLOPE * np.where(x < self.WIDTH, self.SHARE * np.maximum(x, 0), x - (1 - self.SHARE) * self.WIDTH)
        q = lagged(flow, lag * rate_Hz) if lag else flow
        if floor:
            q = q + noise * np.random.default_rng(1).standard_normal(q.size)
            q[q < floor] = 0.0
        rows = (time > 2) & (time < 22) if rising else (time > 24) & (time < 44)
        # A delay by the lag, which the readings are put right for, moves the straight part to where it belongs.
        moved = u[rows] + (-1 if rising else 1) * 0.5 * lag
        near = (moved > self.KNEE - 2) & (moved < self.KNEE + 2)
        count = int(near.sum()) // 20 * 20
        u_mean, y_mean = (part[rows][near][:count].reshape(-1, 20).mean(axis=1) for part in (u, q))
        u_mean = u_mean + (-1 if rising else 1) * 0.5 * lag
        return EdgeAverages(
            u=u_mean,
            y=y_mean,
            weight=np.full(u_mean.size, 1.0),
            knee=self.KNEE + 0.01,
            slope=1.02 * self.SLOPE,
            floor=floor,
            noise=noise,
            signed=False,
            rising=rising,
            rate=0.5,
        )

    @pytest.mark.parametrize("rising", [True, False])
    @pytest.mark.parametrize("lag", [0.0, 0.1, 0.2])
    def test_the_true_edge_leaves_nothing_and_others_do(self, lag, rising):
        test = self.averages(lag, rising=rising)
        share, width = np.array([0.3, 0.3, 0.4, 0.05]), np.array([0.4, 0.3, 0.4, 0.0])
        left, knee, slope = fit_edges(test, share, width, seconds=lag, u_max=10.0)
        assert left[0] < 2e-3 < 1e-2 < left[1:].min()
        assert knee[0] == pytest.approx(self.KNEE, abs=1e-3)
        assert slope[0] == pytest.approx(self.SLOPE, rel=1e-3)

    def test_a_filter_of_another_lag_leaves_something(self):
        test = self.averages(0.2, rising=False)
        left = [
            fit_edges(test, np.array([0.3]), np.array([0.4]), seconds=seconds, u_max=10.0)[0][0]
            for seconds in (0.0, 0.2)
        ]
        assert left[1] < 0.1 * left[0]

    @pytest.mark.parametrize("noise", [0.02, 0.1])
    def test_what_a_floor_cuts_off_is_no_softness(self, noise):
        test = self.averages(0.0, rising=False, floor=0.25, noise=noise)
        left, knee, _ = fit_edges(test, np.array([0.3, 0.05]), np.array([0.4, 0.0]), seconds=0.0, u_max=10.0)
        assert left[0] < 0.2 * left[1]
        assert knee[0] == pytest.approx(self.KNEE, abs=0.02)
