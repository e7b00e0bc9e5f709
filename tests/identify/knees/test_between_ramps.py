"""What differs from ramp to ramp: scatter and drift, from recordings whose every ramp has its own true threshold."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import chi2

from dzdesign.core.errors import InputError
from dzdesign.identify.fit import certificate, ramp_model, scatter
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.ramps.splitting import Ramp
from dzdesign.identify.reading.ramp_test import RampTest
from tests.support.synthetic import Truth, synthetic_ramp

PRESSURES = (1.0, 2.0, 3.0, 5.0)
ALL_THRICE = tuple(range(len(PRESSURES))) * 3
EXACT_LAG = {"meter_lag": 0.0, "meter_lag_tolerance": 0.0}


def closes_at(dp: float) -> float:
    """The mean closing threshold in the middle of the series, V."""
    return 5.3 - 0.05 * dp


@dataclass(frozen=True)
class Series:
    """Ramps as they were taken, and where the valve closed in each, V."""

    tests: list[RampTest]
    closings: np.ndarray

    def named(self, name) -> list[RampTest]:
        return [replace(test, source=name(place)) for place, test in enumerate(self.tests)]


def series(order, *, scatter=0.0, drift=0.0, seed=0, dated=True, pressures=PRESSURES) -> Series:
    """Record ramps at `pressures[order[0]]` and so on; the valve drifts by so many V from the first to the last."""
    rng = np.random.default_rng([seed, len(order)])
    state = np.linspace(-0.5, 0.5, len(order))
    closings = np.array([closes_at(pressures[place]) for place in order])
    closings = closings + drift * state + scatter * rng.standard_normal(len(order))
    tests = []
    for place, (row, closing) in enumerate(zip(order, closings, strict=True)):
        dp = pressures[row]
        truth = Truth(knee_rising=float(closing) + 0.1, hysteresis=0.1, slope=4 * math.sqrt(dp), noise=0.05)
        test = synthetic_ramp(dp, truth, seed=1000 * seed + place, rate_Hz=20.0, ramp_s=20.0)
        test = replace(test, source=f"ramp{place:02d}.csv", sha256=f"{place:064d}")
        tests.append(replace(test, started=1e6 + 100.0 * place) if dated else test)
    return Series(tests, closings)


def shuffled(seed, ramps=ALL_THRICE):
    return tuple(int(each) for each in np.random.default_rng(seed).permutation(ramps))


def side_of(tests, **options):
    return identify(tests, IdentifyOptions(**EXACT_LAG | options)).positive


def codes(tests, **options):
    return {warning.code for warning in identify(tests, IdentifyOptions(**EXACT_LAG | options)).warnings}


def found(tests, **options):
    return side_of(tests, **options).certificate.repeatability


def bounds(tests, **options):
    return np.array([test.u_guard_lower_V for test in side_of(tests, **options).tests])


class TestScatter:
    def test_repeats_tell_it_and_the_bound_is_for_the_next_closing(self):
        taken = series(shuffled(1), scatter=0.02, seed=1)
        repeatability = found(taken.tests)
        degrees = repeatability.degrees_of_freedom
        assert repeatability.origin == "repeats" and degrees == len(ALL_THRICE) - len(PRESSURES) - 1
        low, high = chi2.ppf([5e-4, 1 - 5e-4], degrees)
        assert low < degrees * (repeatability.sd_V / 0.02) ** 2 < high
        # At 99 % for four tests at once the next one lies 3 standard deviations and more under the mean.
        assert (bounds(taken.tests) < [closes_at(dp) - 3 * 0.02 for dp in PRESSURES]).all()
        assert not codes(taken.tests) & {"assumed-scatter", "few-repeats", "order", "repeatability"}

    def test_the_knee_is_that_of_all_ramps_however_they_scatter(self):
        taken = series(shuffled(2), scatter=0.05, seed=2)
        for row, test in enumerate(side_of(taken.tests).tests):
            mean = taken.closings[np.array(shuffled(2)) == row].mean()
            assert test.u_knee_falling_V == pytest.approx(mean, abs=0.02)
            # Scatter is no noise of the meter, and no soft edge.
            assert test.noise_L_min == pytest.approx(0.05, rel=0.2)

    @pytest.mark.slow
    def test_a_valve_that_repeats_costs_little(self):
        """On average the bound lies at most three standard errors of one ramp lower than by noise alone."""
        lower, six = [], (1.0, 1.8, 2.6, 3.4, 4.2, 5.0)
        for seed in range(5):
            tests = series(tuple(range(6)) * 3, seed=20 + seed, dated=False, pressures=six).tests
            one_ramp = np.array([test.u_knee_se_V for test in side_of(tests).tests]) * math.sqrt(3)
            lower.append((bounds(tests, repeatability=0.0) - bounds(tests)) / one_ramp)
        assert np.min(lower) >= -1e-6 and np.mean(lower) <= 3

    def test_a_scatter_that_is_ignored_puts_bounds_above_closings(self, monkeypatch):
        """Seeded: of the next closings some lie below the bounds of the fault, none below those of the product."""
        taken = series(shuffled(4), scatter=0.02, seed=4)
        following = np.array([closes_at(dp) for dp in PRESSURES]) - 0.04
        assert (bounds(taken.tests) < following).all()
        monkeypatch.setattr(certificate, "_critical", lambda *given: 0.1)
        assert (bounds(taken.tests) > following).any()


class TestWithoutRepeats:
    def test_a_scatter_is_assumed_and_said(self):
        tests = series(range(4), dated=False).tests
        assumed, declared = found(tests), found(tests, repeatability=1e-3)
        assert (assumed.origin, assumed.sd_V, assumed.degrees_of_freedom) == ("assumed", 0.025, None)
        assert (declared.origin, declared.sd_V) == ("declared", pytest.approx(0.01))
        assert "assumed-scatter" in codes(tests) and "assumed-scatter" not in codes(tests, repeatability=1e-3)
        assert (bounds(tests) < bounds(tests, repeatability=1e-3)).all()
        assert (bounds(tests, repeatability=1e-3) < bounds(tests, repeatability=0.0) - 0.02).all()

    def test_one_repeat_is_believed_only_where_it_shows_more(self):
        """One difference may be small by chance, so a small one raises no bound; a large one can't be by chance."""
        near, other = series((0, 0), dated=False).tests
        far = replace(other, u=other.u + 0.15)
        assert found([near, other]).origin == "assumed" and "assumed-scatter" in codes([near, other])
        assert found([near, far]).sd_V == pytest.approx(0.15 / math.sqrt(2), rel=0.05)
        assert "few-repeats" in codes([near, far]) and "assumed-scatter" not in codes([near, far])

    def test_the_drift_takes_a_difference_and_that_is_said(self, wording):
        """Two pressure drops, two ramps each: enough without the order, too few with it."""
        twice = {"pressures": (1.0, 5.0), "scatter": 1e-3}
        assert found(series((0, 1, 1, 0), dated=False, **twice).tests).origin == "repeats"
        tests = series((0, 1, 1, 0), **twice).tests
        assert found(tests).origin == "assumed" and found(tests).drift_V is not None
        warnings = identify(tests, IdentifyOptions(**EXACT_LAG)).warnings
        (said,) = [each.text for each in warnings if each.code == "assumed-scatter"]
        wording("between ramps: the drift takes a difference", said)

    def test_a_ramp_unlike_its_repeat_is_named_where_no_bound_follows(self, wording):
        *tests, last = series((0, 1, 2, 3, 0), dated=False).tests
        with pytest.raises(InputError) as refused:
            identify([*tests, replace(last, u=last.u + 0.3)], IdentifyOptions(**EXACT_LAG))
        wording("between ramps: one unlike its repeat", str(refused.value))

    def test_few_repeats_are_said(self):
        tests = series((0, 1, 2, 3, 0, 3), scatter=0.005, dated=False).tests
        assert found(tests).degrees_of_freedom == 2 and "few-repeats" in codes(tests)


class TestDeclared:
    def test_one_that_the_repeats_contradict_is_not_taken(self, monkeypatch):
        taken = series(shuffled(5), scatter=0.025, seed=5)
        assert found(taken.tests, repeatability=1e-4).origin == "repeats"
        assert "repeatability" in codes(taken.tests, repeatability=1e-4)
        assert bounds(taken.tests, repeatability=1e-4) == pytest.approx(bounds(taken.tests))
        # Seeded: a check that never contradicts lets 1 mV stand for 25 mV.
        monkeypatch.setattr(scatter, "CONTRADICTED", 0.0)
        assert found(taken.tests, repeatability=1e-4).origin == "declared"
        assert (bounds(taken.tests, repeatability=1e-4) > bounds(taken.tests, repeatability=None) + 0.04).all()

    def test_one_that_they_do_not_is_taken(self):
        taken = series(shuffled(6), scatter=0.01, seed=6)
        assert found(taken.tests, repeatability=1e-3).origin == "declared"
        assert "repeatability" not in codes(taken.tests, repeatability=1e-3)


class TestDrift:
    @pytest.mark.parametrize(
        ("order", "drift"), [(shuffled(7), -0.1), ((0, 1, 2, 3) * 3, 0.1)], ids=["random order", "three rounds"]
    )
    def test_it_is_found_and_the_bounds_hold_in_every_state(self, order, drift):
        taken = series(order, scatter=0.003, drift=drift, seed=7)
        repeatability = found(taken.tests)
        assert repeatability.drift_V == pytest.approx(drift, abs=4 * repeatability.drift_se_V)
        assert repeatability.drift_se_V < 0.01 and repeatability.sd_V < 0.008
        assert "drift" in codes(taken.tests) and "order" not in codes(taken.tests)
        lowest = np.array([closes_at(dp) for dp in PRESSURES]) - abs(drift) / 2
        assert (bounds(taken.tests) < lowest).all() and (bounds(taken.tests) > lowest - 0.05).all()

    def test_a_repeat_of_the_first_at_the_end_is_enough(self):
        ordered, closed = series((0, 1, 2, 3), drift=-0.08), series((0, 1, 2, 3, 0), drift=-0.08)
        assert found(ordered.tests).no_drift == "order of pressure" and "order" in codes(ordered.tests)
        repeatability = found(closed.tests, repeatability=2e-4)
        assert repeatability.drift_V == pytest.approx(-0.08, abs=0.01) and "order" not in codes(closed.tests)
        lowest = np.array([closes_at(dp) for dp in PRESSURES]) - 0.04
        assert (bounds(closed.tests, repeatability=2e-4) < lowest).all()

    def test_one_that_is_ignored_puts_bounds_above_closings(self, monkeypatch):
        """Seeded: the last ramp's state is below the bounds of a series whose order nobody looks at."""
        taken = series((0, 1, 2, 3, 0), drift=-0.08, seed=8)
        lowest = np.array([closes_at(dp) for dp in PRESSURES]) - 0.04
        assert (bounds(taken.tests, repeatability=2e-4) < lowest).all()
        monkeypatch.setattr(ramp_model, "TELLS_DRIFT", 1e9)
        monkeypatch.setattr(scatter, "CONTRADICTED", 0.0)
        assert (bounds(taken.tests, repeatability=2e-4) > lowest).any()

    def test_none_is_said_of_a_valve_that_has_none(self):
        assert "drift" not in codes(series(shuffled(9), scatter=0.005, seed=9).tests)


class TestOrder:
    ORDER = shuffled(10)

    def test_no_order_is_said(self):
        undated = series(self.ORDER, drift=0.05, dated=False).tests
        assert found(undated).no_drift == "order unknown" and "order" in codes(undated)
        some = [replace(undated[0], started=1e6), *undated[1:]]
        assert found(some).no_drift == "order unknown"

    def test_at_one_pressure_there_is_nothing_to_tell_apart(self):
        tests = series((0, 0, 0), dated=False).tests
        assert found(tests).no_drift == "one pressure drop" and "order" not in codes(tests)

    def test_names_do_not_matter(self):
        taken = series(self.ORDER, scatter=0.003, drift=0.08, seed=10)
        before = found(taken.tests)
        after = found(taken.named(lambda place: f"{7 * place % 12:02d}.csv")[::-1])
        assert after.drift_V == pytest.approx(before.drift_V, abs=1e-4)
        undated = [replace(test, started=None) for test in taken.named(lambda place: f"{place:02d}.csv")]
        assert found(undated).drift_V is None

    def test_an_order_that_is_taken_from_names_is_seen(self, monkeypatch):
        """Seeded: the check above sees it."""
        taken = series(self.ORDER, scatter=0.003, drift=0.08, seed=10)
        monkeypatch.setattr(Ramp, "when", property(lambda ramp: float(ramp.test.source[-6:-4])))
        before, after = found(taken.tests), found(taken.named(lambda place: f"x{7 * place % 12:02d}.csv"))
        assert abs(after.drift_V - before.drift_V) > 0.01
        undated = [replace(test, started=None) for test in taken.tests]
        assert found(undated).drift_V is not None

    def test_one_recording_has_its_own_clock(self):
        """Ramps of one file follow one another on its clock, whether it is dated or not."""
        taken = series(self.ORDER, scatter=0.003, drift=0.08, seed=11).tests
        ends = np.cumsum([0.0, *(float(test.time[-1]) + 1.0 for test in taken)])
        joined = {name: np.concatenate([getattr(test, name) for test in taken]) for name in ("u", "q", "dp")}
        time = np.concatenate([test.time + end for test, end in zip(taken, ends[:-1], strict=True)])
        whole = replace(taken[0], source="all.csv", started=None, time=time, **joined)
        repeatability = found([whole])
        assert repeatability.drift_V == pytest.approx(0.08, abs=4 * repeatability.drift_se_V)
        assert repeatability.degrees_of_freedom == len(ALL_THRICE) - len(PRESSURES) - 1
