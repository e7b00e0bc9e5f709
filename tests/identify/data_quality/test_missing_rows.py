"""Rows that a logger lost where the flow begins, and a meter's zero: what is not known makes no bound safer."""

import dataclasses

import numpy as np
import pytest

from dzdesign.identify.options import IdentifyOptions
from tests.support.bench_recordings import L_MIN, Valve, record
from tests.support.repeatable_valves import identify

PRESSURES = (1.0, 3.0, 5.0)


def without(test, low, high, *, rising):
    """Lose the rows of one branch between two commands."""
    opening = np.arange(test.u.size) < np.argmax(test.u)
    kept = ~((opening == rising) & (test.u > low) & (test.u < high))
    columns = {name: getattr(test, name)[kept] for name in ("time", "u", "q", "dp")}
    return dataclasses.replace(test, **columns)


def bounds(valve):
    return np.array([test.u_guard_lower_V for test in valve.positive.tests])


def warned(valve, code):
    return [warning for warning in valve.warnings if warning.code == code]


@pytest.mark.parametrize("floor", [0.6, 0.0])
def test_lost_rows_are_no_floor_of_the_meter(floor):
    whole = [record(Valve(floor=floor), dp) for dp in PRESSURES]
    holed = [without(test, 5.2, 5.9, rising=True) for test in whole]
    before, after = identify(whole), identify(holed)
    assert after.meter.floor_L_min == pytest.approx(before.meter.floor_L_min, abs=0.05)
    assert bounds(after) == pytest.approx(bounds(before), abs=2e-3)
    assert [warning.source for warning in warned(after, "gap")] == [test.source for test in holed]
    assert not warned(before, "gap")


def test_a_bound_goes_below_the_rows_that_are_lost():
    """What the lost rows hide may be a soft edge: here one passes 0.5 L/min from 5.0 V on."""
    soft = [record(Valve(noise=0.02), dp) for dp in PRESSURES]
    soft = [dataclasses.replace(test, q=test.q + 0.5 * L_MIN * ((test.u > 5.0) & (test.u < 5.3))) for test in soft]
    holed = [without(test, 4.9, 5.35, rising=False) for test in soft]
    found = identify(holed)
    assert (bounds(found) < 4.9).all() and (bounds(found) > 4.8).all()
    assert all("bound is lowered below 4." in warning.text for warning in warned(found, "gap"))
    assert not warned(found, "soft-edge")
    assert all("rows are missing" in test.not_observable["u_onset_falling_V"] for test in found.positive.tests)


def test_lost_rows_elsewhere_are_no_matter():
    whole = [record(Valve(), dp) for dp in PRESSURES]
    holed = [without(without(test, 2.0, 3.0, rising=True), 7.0, 8.0, rising=False) for test in whole]
    assert not warned(identify(holed), "gap")
    assert bounds(identify(holed)) == pytest.approx(bounds(identify(whole)), abs=0.01)


def test_another_ramp_fills_the_gap():
    holed, whole = without(record(Valve()), 4.9, 5.35, rising=False), record(Valve(), seed=2)
    assert warned(identify([holed]), "gap")
    assert not warned(identify([holed, whole]), "gap")


@pytest.mark.slow
def test_the_error_of_a_zero_that_was_taken_off_is_in_the_bound():
    """Some hundred readings at rest tell it; left out, one bound in three lay above the threshold."""
    options, valve = IdentifyOptions(meter_lag=0.0), Valve(noise=0.1)
    above = 0
    for seed in range(30):
        test = record(valve, seed=seed, hold_s=0.5)
        found = identify([dataclasses.replace(test, q=test.q + 0.5 * L_MIN)], options)
        assert warned(found, "meter-zero")
        above += bool((bounds(found) > valve.closing).any())
    assert above <= 2


@pytest.mark.parametrize("rate_Hz", [5.0, 10.0, 50.0])
def test_a_zero_shows_in_few_readings_too(rate_Hz):
    test = record(Valve(noise=0.03), rate_Hz=rate_Hz, hold_s=0.0)
    found = identify([dataclasses.replace(test, q=test.q - 0.3 * L_MIN)])
    assert warned(found, "meter-zero")
    assert (bounds(found) < Valve().closing).all()


def test_a_small_dead_zone_is_not_taken_for_a_zero():
    test = record(Valve(opening=0.4, closing=0.3, noise=0.03), rate_Hz=5.0, hold_s=0.0)
    assert not warned(identify([test]), "meter-zero")
