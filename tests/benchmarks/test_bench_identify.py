"""The benchmark's own machinery: its bound against brute force, its seeds, and that it sees a wrong estimator."""

import dataclasses

import numpy as np
import pytest
from bench_model import Bench, readings
from cramer_rao import beta_bound, cramer_rao, tobit_share
from replicates import options_for, run_replicates
from rivals import branches_of
from scipy.integrate import quad
from scipy.optimize import minimize
from scipy.special import log_ndtr, ndtr
from scipy.stats import norm
from scoreboard import Row, share_interval

from dzdesign.identify.identification import identify

SMALL = Bench(rate_Hz=10.0, pressures_MPa=(1.0, 3.0), lag_s=0.0)


class TestBound:
    def test_it_is_the_one_of_the_identification_study(self):
        """The numbers of IDENTIFICATION.md, to the digits that it gives."""
        cases = [(floor, dp) for floor in (0.0, 0.6) for dp in (1.0, 5.0)]
        at = {(floor, dp): cramer_rao(Bench(floor_L_min=floor), dp).middle_V for floor, dp in cases}
        assert 1e3 * at[0.6, 1.0] == pytest.approx(1.13, abs=0.005)
        assert 1e3 * at[0.6, 5.0] == pytest.approx(0.47, abs=0.005)
        assert 1e3 * at[0.0, 1.0] == pytest.approx(1.05, abs=0.006)
        assert 1e3 * at[0.0, 5.0] == pytest.approx(0.46, abs=0.005)
        assert beta_bound(Bench(), 5.0) == pytest.approx(2.2e-4, abs=0.05e-4)

    @pytest.mark.parametrize("z", [-5.0, -1.0, 0.0, 0.7, 3.0])
    def test_a_censored_reading_holds_its_mean_squared_score(self, z):
        seen = quad(lambda x: x**2 * norm.pdf(x), z, np.inf)[0]
        hidden = norm.pdf(z) ** 2 / ndtr(z)
        assert tobit_share(np.array(z)) == pytest.approx(seen + hidden, rel=1e-8)

    @pytest.mark.slow
    @pytest.mark.parametrize("saturation_V", [10.0, 3.0], ids=["no saturation", "saturation"])
    def test_maximum_likelihood_reaches_it(self, saturation_V):
        bench = SMALL.with_changes(saturation_V=saturation_V, pressures_MPa=(1.0,), floor_L_min=1.5, noise_L_min=0.4)
        start = [bench.opening_V(1.0), bench.closing_V(1.0), bench.slope_at(1.0)]
        start += [bench.slope_at(1.0) * saturation_V] if saturation_V < 4 else []
        found = []
        for (test,) in readings(bench, 150, 8):
            data = branches_of(test, 0.0)
            found.append(minimize(_tobit_cost, start, args=(data, bench), method="Nelder-Mead",
                                  options={"xatol": 1e-5, "fatol": 1e-6, "maxfev": 600}).x)  # fmt: skip
        middle = np.mean(np.array(found)[:, :2], axis=1)
        # 150 replicates know a standard deviation to 6 %.
        assert middle.std() == pytest.approx(cramer_rao(bench, 1.0).middle_V, rel=0.2)
        assert abs(middle.mean() - bench.threshold_V(1.0)) < 4 * middle.std() / np.sqrt(150)

    def test_coloured_noise_costs_what_a_long_average_costs(self):
        ratio = cramer_rao(Bench(ar=0.9), 1.0).middle_V / cramer_rao(Bench(), 1.0).middle_V
        assert ratio == pytest.approx(np.sqrt(1.9 / 0.1), rel=0.05)


def _tobit_cost(parameters, data, bench):
    saturated = parameters[3] if len(parameters) == 4 else np.inf
    cost = 0.0
    for knee, (u, q) in zip(parameters[:2], data, strict=True):
        mean = np.minimum(parameters[2] * np.clip(u - knee, 0, None), saturated)
        seen = q > 0
        cost += np.sum((q[seen] - mean[seen]) ** 2) / (2 * bench.noise_L_min**2)
        cost -= np.sum(log_ndtr((bench.floor_L_min - mean[~seen]) / bench.noise_L_min))
    return cost


def test_a_seed_gives_the_same_readings_however_many_are_asked_for():
    bench = SMALL.with_changes(ar=0.9, outliers=0.01, drop_outs=0.01, lost=0.02)
    few, many = list(readings(bench, 2, 5)), list(readings(bench, 4, 5))
    for left, right in zip(few[1], many[1], strict=True):
        assert np.array_equal(left.q, right.q) and np.array_equal(left.u, right.u)
    assert not np.array_equal(many[0][0].q[:100], many[2][0].q[:100]) or not many[0][0].q[:100].any()


def test_correlated_noise_is_stationary_and_as_correlated_as_said():
    bench = Bench(slope_L_min_V=0.0, floor_L_min=0.0, ar=0.9, lag_s=0.0, noise_L_min=1.0)
    q = np.concatenate([test.q for test in next(readings(bench, 1, 3))]) * 6e4
    assert q.std() == pytest.approx(1.0, abs=0.05)
    assert np.corrcoef(q[1:], q[:-1])[0, 1] == pytest.approx(0.9, abs=0.01)


def test_a_wrong_estimator_is_flagged():
    """Seeded: one that takes every command for 80 mV more than it was."""

    def reads_high(tests, options):
        return identify([dataclasses.replace(test, u=test.u + 0.08) for test in tests], options)

    bench = SMALL.with_changes(rate_Hz=50.0)
    right, wrong = (run_replicates(bench, 3, 1, options_for(bench), estimator) for estimator in (identify, reads_high))
    assert np.all(right.bound_excess < 0) and np.all(right.offset_excess < 0)
    assert np.all(wrong.bound_excess > 0)
    assert np.all(np.abs(right.middle) < 0.03) and np.all(wrong.middle > 0.05)
    failures = 100 * np.mean(wrong.bound_excess > 0)
    assert Row(what="bound above the truth", value=failures, limit=1.0).verdict == "MISSES"


def test_a_number_that_is_none_misses_and_intervals_hold_the_share():
    assert Row(what="x", value=float("nan"), limit=1.0).verdict == "MISSES"
    assert Row(what="x", value=1.0, limit=1.0).verdict == "holds"
    assert "0.00-0.12 %" in share_interval(0, 3000)


class TestDropOuts:
    """Readings that drop out just above the knee look like flow that was not there: they must not lift the bounds."""

    singly = Bench(rate_Hz=100.0, pressures_MPa=(1.0, 2.0, 3.0), lag_s=0.0, drop_outs=0.2, run=1)
    #: Few runs: most branches have none where flow is plain, and their share of drop-outs is not known.
    in_long_runs = Bench(rate_Hz=100.0, noise_L_min=0.3, drop_outs=0.01, run=50)

    @staticmethod
    def outcome(bench, count):
        outcome = run_replicates(bench, count, 7, options_for(bench))
        assert not outcome.refusals
        return outcome

    def mean_error_mV(self):
        """Of the closing knee at 1 MPa; that of one replicate is 2 mV."""
        return 1e3 * self.outcome(self.singly, 24).closing[:, 0].mean()

    def failed(self):
        return int((self.outcome(self.in_long_runs, 40).bound_excess > 0).sum())

    @pytest.mark.slow
    def test_single_ones_move_no_knee(self):
        assert abs(self.mean_error_mV()) < 1.2

    @pytest.mark.slow
    def test_bounds_hold_with_long_runs(self):
        assert self.failed() == 0
