"""A meter that is away for a moment amid flow: said with file and seconds, and left out of the recorded curve."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.identify.data_quality.meter_faults import without_drop_outs
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from tests.support.synthetic import L_MIN, Truth, synthetic_ramp

RATE, SECONDS = 50.0, 20.0


def ramp(seed=0, dp_MPa=2.0, **truth):
    truth = {"slope": 4 * dp_MPa**0.5, **truth}
    return synthetic_ramp(
        dp_MPa, Truth(**truth), seed=seed, rate_Hz=RATE, ramp_s=SECONDS, source=f"ramp{dp_MPa:g}_{seed}.csv"
    )


def away(test, start, end, flow=0.0):
    """Return a recording whose flow reads that for some seconds; None: what it read at the beginning of them."""
    rows = (test.time >= start) & (test.time <= end)
    q = np.where(rows, test.q[rows][0] if flow is None else flow * L_MIN, test.q)
    return replace(test, q=q)


def every_20th(test):
    """Return a recording with few rows on a ramp, as of a quick one."""
    return test.part(slice(None, None, 20))


def series(spoil):
    """Return three ramps at each of two pressure drops, one of them with a drop-out."""
    tests = [ramp(seed, dp_MPa) for dp_MPa in (1.0, 4.0) for seed in range(3)]
    return [spoil(tests[0]), *tests[1:]]


@pytest.mark.parametrize("flow", [0.0, -0.5, None], ids=["zero", "below zero", "stuck"])
def test_it_is_said_where_and_when_and_those_rows_are_left_out(flow, wording):
    test = away(ramp(), 17.0, 17.5, flow)
    (kept,), (finding,) = without_drop_outs([test])
    lost = np.setdiff1d(test.time, kept.time)
    assert (lost.min(), lost.max()) == pytest.approx((17.0, 17.5), abs=1.5 / RATE)
    valve = identify([test], IdentifyOptions(meter_lag=0.0))
    (warning,) = (each for each in valve.warnings if each.code == finding.code == "flow-drop-out")
    assert warning.source == test.source
    if flow != -0.5:
        wording(f"flow meter: a drop-out, {'stuck' if flow is None else 'zero'}", warning.text)


def test_the_recorded_curve_is_that_of_the_other_ramps():
    """One of three ramps reads zero for half a second: two thirds of the flow would stand there."""
    options = IdentifyOptions(meter_lag=0.0)
    clean, spoilt = (
        identify(series(spoil), options).positive.tests[0].recorded.rising
        for spoil in (lambda test: test, lambda test: away(test, 17.0, 17.5))
    )
    u = np.linspace(6.0, 10.0, 400)
    assert np.abs(spoilt.flow_at(u) - clean.flow_at(u)).max() < 0.01 * max(clean.q_L_min)


def test_the_dent_is_seen_without_it(monkeypatch):
    monkeypatch.setattr("dzdesign.identify.identification.without_drop_outs", lambda tests: (list(tests), ()))
    spoilt = identify(series(lambda test: away(test, 17.0, 17.5)), IdentifyOptions(meter_lag=0.0))
    recorded = spoilt.positive.tests[0].recorded.rising
    line = recorded.flow_at(np.array([8.0, 8.6, 9.4]))
    assert line[1] < 0.9 * (line[0] + line[2]) / 2


def test_what_may_be_the_valve_stays():
    held = ramp()
    square = np.where((held.time % 4.0) < 2.0, 9.0, 0.0)
    supply = away(ramp(), 17.0, 17.5)
    gone = np.where((supply.time >= 17.0) & (supply.time <= 17.5), 0.01e6, supply.dp)
    stays = {
        "clean": ramp(),
        "a floor of half of the largest flow": ramp(floor=12.0, noise=0.5),
        "noise of a tenth": ramp(noise=2.0),
        "steps of the flow": replace(ramp(noise=0.0), q=np.round(ramp(noise=0.0).q / L_MIN) * L_MIN),
        "no noise": ramp(noise=0.0),
        "saturation": ramp(noise=0.0, saturation=8.0),
        "saturation on a quick ramp": every_20th(ramp(noise=0.0, saturation=8.0)),
        "a square wave": replace(held, u=square, q=np.where(square > 5, 20.0, 0.0) * L_MIN),
        "a supply that is away": replace(supply, dp=gone),
        "two rows": away(ramp(), 17.001, 17.05),
        "near the edge": away(ramp(), 11.0, 11.5),
    }
    for name, test in stays.items():
        (kept,), found = without_drop_outs([test])
        assert kept is test and not found, name


def test_only_the_first_of_many_are_listed(wording):
    test = ramp()
    for start in (14.0, 15.0, 16.0, 17.0, 18.0):
        test = away(test, start, start + 0.2)
    _, (finding,) = without_drop_outs([test])
    valve = identify([test], IdentifyOptions(meter_lag=0.0))
    wording("flow meter: five drop-outs", next(w.text for w in valve.warnings if w.code == finding.code))
