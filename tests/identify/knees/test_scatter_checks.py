"""The premises of the scatter from ramp to ramp: independent, one population; and what they are for."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from dzdesign.identify.fit import scatter
from dzdesign.identify.fit.certificate import certify
from dzdesign.identify.fit.curve_class import find_class
from dzdesign.identify.fit.ramp_model import Ramps
from dzdesign.identify.identification import identify
from dzdesign.identify.knees import between_ramps
from dzdesign.identify.knees.between_ramps import RampKnees, compare_ramps
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.identify.knees.test_between_ramps import (
    EXACT_LAG,
    PRESSURES,
    bounds,
    codes,
    series,
    shuffled,
    side_of,
)
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

TESTS, NOISE_SE = 4, 1e-3


def compared(knees, order, *, dated=True, noise=NOISE_SE):
    """Compare ramps of four tests in the order of taking."""
    number = np.array([np.sum(order[:at] == one) for at, one in enumerate(order)])
    when = np.arange(order.size, dtype=float) if dated else np.full(order.size, np.nan)
    known = RampKnees(
        test=order, number=number, knee=knees, se=np.full(order.size, noise), when=when,
        source=("",) * order.size,
    )  # fmt: skip
    return compare_ramps(known, 1.0 + np.arange(TESTS), np.bincount(order).tolist(), IdentifyOptions())


class TestSize:
    """Under the premises each check refuses one series of a hundred, however few the repeats."""

    @pytest.mark.parametrize("repeats", [2, 6])
    def test_it_refuses_no_more_often_than_it_may(self, repeats):
        rng, count = np.random.default_rng([repeats, 1]), 1000
        refused = 0
        for _ in range(count):
            order = rng.permutation(np.repeat(np.arange(TESTS), repeats))
            checks = compared(5 + 0.01 * rng.standard_normal(order.size), order).checks
            refused += checks.serial is not None
        assert refused <= binom.isf(1e-4, count, between_ramps.REFUSED)

    def test_copies_of_one_recording_refuse_nothing(self):
        order = np.repeat(np.arange(TESTS), 3)
        checks = compared(5.0 + 0.1 * order, order).checks
        assert checks.serial is None


class TestUnequalScatter:
    def test_it_is_found_in_recordings_and_said_where(self):
        rng = np.random.default_rng(13)
        order = shuffled(13)
        taken = series(order, scatter=0.003, seed=13)
        last = [place for place, row in enumerate(order) if PRESSURES[row] == PRESSURES[-1]]
        for place, off in zip(last, (-0.06, 0.07, 0.01), strict=True):
            taken.tests[place] = moved(taken.tests[place], off + 1e-3 * rng.standard_normal())
        unlike = series(order, scatter=0.003, seed=13).tests
        assert "unequal-scatter" in codes(taken.tests) and "unequal-scatter" not in codes(unlike)
        curve = side_of(taken.tests).curve
        assert curve.proof.unlike_knot == len(PRESSURES) - 1 and curve.proof.sd_V < 0.01
        lower = bounds(unlike) - bounds(taken.tests)
        assert lower[-1] > 0.2 and (lower[:-1] < 0.1).all()


def moved(test, by):
    """Return a recording whose valve closes and opens so many V lower."""
    return replace(test, u=test.u - by)


def warned(tests, code):
    return [one for one in identify(tests, IdentifyOptions(**EXACT_LAG)).warnings if one.code == code]


class TestOutlyingRamp:
    ORDER = shuffled(14)

    @staticmethod
    def warned(tests):
        return warned(tests, "outlying-ramp")

    def test_it_is_named_and_set_aside(self, wording):
        taken = series(self.ORDER, scatter=0.003, seed=14)
        assert not self.warned(taken.tests)
        before = side_of(taken.tests)
        taken.tests[4] = moved(taken.tests[4], 0.08)
        (warning,) = self.warned(taken.tests)
        assert warning.source == "ramp04.csv"
        wording("between ramps: outlying", warning.text)
        after = side_of(taken.tests)
        assert sum(len(test.ramps) for test in after.tests) == len(self.ORDER)
        (aside,) = after.curve.proof.set_aside
        assert aside.source == "ramp04.csv" and abs(aside.distance_V) == pytest.approx(0.08, abs=0.02)
        assert after.certificate.repeatability.sd_V < 2 * before.certificate.repeatability.sd_V

    def test_of_two_that_differ_the_lower_one_counts(self):
        order = shuffled(15, tuple(range(len(PRESSURES))) * 2)
        taken = series(order, scatter=0.002, seed=15, dated=False)
        taken.tests[3] = moved(taken.tests[3], 0.1)
        (other,) = [place for place, row in enumerate(order) if row == order[3] and place != 3]
        (warning,) = self.warned(taken.tests)
        assert warning.source == f"ramp{other:02d}.csv"
        assert bounds(taken.tests)[order[3]] < taken.closings[3] - 0.1

    def test_a_check_that_is_off_is_seen(self, monkeypatch):
        monkeypatch.setattr(scatter, "OUTLYING", 0.0)
        taken = series(self.ORDER, scatter=0.003, seed=14)
        taken.tests[4] = moved(taken.tests[4], 0.08)
        assert not self.warned(taken.tests)


class TestSerialScatter:
    def test_a_valve_that_wanders_is_said(self, wording):
        order = shuffled(16, (0, 1) * 8)
        taken = series(order, scatter=0.001, seed=16)
        wave = 0.03 * np.sin(2 * np.pi * np.arange(len(order)) / len(order))
        tests = [moved(test, float(by)) for test, by in zip(taken.tests, wave, strict=True)]
        (warning,) = warned(tests, "serial-scatter")
        wording("between ramps: serial", warning.text)
        # Without an order there are no neighbours.
        assert "serial-scatter" not in codes([replace(test, started=None) for test in tests])

    def test_power_against_a_slow_wander(self):
        rng, seen = np.random.default_rng(17), 0
        for _ in range(300):
            order = rng.permutation(np.repeat(np.arange(TESTS), 6))
            walk = np.cumsum(0.01 * rng.standard_normal(order.size))
            seen += compared(5 + walk, order).checks.serial is not None
        assert seen > 150


class TestTwoGroups:
    """Ramps of two sides, benches or places are said to be two; the normal scatter of one valve is not."""

    @staticmethod
    def knees(repeats, *, scatter, apart=0.0, seed=0, tests=3, swap=False):
        rng = np.random.default_rng([seed, repeats])
        row, number = np.repeat(np.arange(tests), repeats), np.tile(np.arange(repeats), tests)
        second = rng.random(row.size) < 0.5 if swap else number % 2 == 1
        knee = 5.1 - 0.1 * row + scatter * rng.standard_normal(row.size) + apart * second * (1 - 0.1 * row)
        return row, number, knee, second

    def test_a_normal_scatter_makes_none(self):
        """Of 400 families of three to six ramps no more than the checks may say by chance."""
        said = 0
        for seed in range(400):
            row, number, knee, _ = self.knees(3 + seed % 4, scatter=0.01, seed=seed, tests=1 + seed // 4 % 5)
            said += between_ramps.find_two_groups(knee, row, number, np.full(row.size, 1e-8)) is not None
        assert said <= binom.isf(1e-4, 400, between_ramps.PARTED)

    @pytest.mark.parametrize("repeats", [3, 4, 6])
    @pytest.mark.parametrize("apart", [0.5, -0.5, 0.1])
    def test_two_sides_are_two(self, repeats, apart):
        row, number, knee, _ = self.knees(repeats, scatter=1e-3, apart=apart)
        found = between_ramps.find_two_groups(knee, row, number, np.full(row.size, 1e-8))
        assert found.apart == pytest.approx(0.9 * abs(apart), rel=0.05)
        low, high = (knee[(row == test) & (number == ramp)][0] for test, ramp in found.ramps)
        assert high - low > 0.7 * abs(apart)

    @pytest.mark.parametrize(("repeats", "lower"), [(4, 2), (4, 1), (20, 1), (20, 19)])
    def test_the_bounds_are_below_the_lower_group(self, repeats, lower):
        order = np.repeat(np.arange(TESTS), repeats)
        number = np.tile(np.arange(repeats), TESTS)
        knees = 5.1 + 1e-3 * np.random.default_rng(repeats).standard_normal(order.size) + 0.5 * (number >= lower)
        groups = compared(knees, order, dated=False, noise=1e-4).checks.groups
        assert groups
        ramps = Ramps(dp_MPa=1.0 + order, y=knees, se=np.full(order.size, 1e-4))
        found = scatter.measure_scatter(ramps, declared=None, assumed=0.025, least=groups.apart / 2)
        assert not found.set_aside
        assert (certify(found, find_class(found, curve=None, curvature=None)).bound < 5.1).all()

    def test_a_valve_that_closes_at_two_places_by_chance_is_two(self):
        said = 0
        for seed in range(50):
            row, number, knee, _ = self.knees(5, scatter=1e-3, apart=0.2, seed=seed, swap=True)
            said += between_ramps.find_two_groups(knee, row, number, np.full(row.size, 1e-8)) is not None
        assert said >= 45

    @pytest.mark.parametrize("fault", ["outlier", "one pressure", "drift"])
    def test_what_other_warnings_say_is_none(self, fault):
        row, number, knee, _ = self.knees(4, scatter=1e-3)
        if fault == "outlier":
            knee[5] += 0.2
        elif fault == "one pressure":
            knee[row == 1] += np.array([0.0, 0.1, 0.03, 0.07])
        else:
            knee += 0.05 * number
        assert between_ramps.find_two_groups(knee, row, number, np.full(row.size, 1e-8)) is None

    def test_a_direction_bit_beside_flows_without_a_sign_is_seen(self, tmp_path):
        """The direction bit of case 58: both sides have positive flows, and the bounds stay below the lower one."""
        names = []
        for dp in (1.0, 5.0):
            for repeat in range(2):
                sides = [
                    synthetic_ramp(dp, Truth(knee_rising=knee, noise=0.05), seed=repeat, ramp_s=16.0, rate_Hz=25.0)
                    for knee in (5.2 - 0.02 * dp, 5.7 - 0.02 * dp)
                ]
                u, q = (np.concatenate([getattr(side, name) for side in sides]) for name in ("u", "q"))
                bit = np.repeat([1, 0], sides[0].u.size)
                table = np.column_stack([np.arange(u.size) / 25.0, u, bit, np.full(u.size, dp), q / L_MIN])
                names.append(tmp_path / f"r{dp:g}_{repeat}.csv")
                np.savetxt(names[-1], table, "%.4f", ",", header="time_s,u_V,DIR,dP_MPa,Q_Lmin", comments="")
        valve = identify([read_ramp_file(name) for name in names], IdentifyOptions(**EXACT_LAG))
        (warning,) = [each for each in valve.warnings if each.code == "two-groups"]
        assert valve.warnings[0] == warning
        assert all(test.u_guard_lower_V < 5.1 - 0.02 * test.dp_MPa for test in valve.positive.tests)

    def test_repeats_of_one_valve_are_none(self):
        for seed in range(3):
            assert "two-groups" not in codes(series(shuffled(seed), scatter=0.01, seed=seed).tests)
