"""Stick and slip behind a meter's floor, and what looks like it: recordings with a spool and a meter in NumPy alone."""

import numpy as np
import pytest
from scipy.signal import lfilter

from dzdesign.identify.identification import identify
from dzdesign.identify.knees import spool_ripple
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.reading.ramp_test import RampTest

L_MIN, MPA, RATE_Hz, RAMP_S, FLOOR_L_min = 1e-3 / 60, 1e6, 50, 40, 0.6


def sticking(u, breakaway, rng):
    """Wait until the command is a breakaway ahead, within 20 %, and jump to it."""
    spool, at, ahead = [], float(u[0]), breakaway
    for value in u.tolist():
        if abs(value - at) > ahead:
            at, ahead = value, breakaway * rng.uniform(0.8, 1.2)
        spool.append(at)
    return np.array(spool)


def recordings(breakaway=0.0, gain=12.0, floor=FLOOR_L_min, meter=lambda flow, rng: flow, noise=0.1, seed=1):
    """Record two pressure drops, twice each; `meter` turns the flow, L/min, into what it shows above its floor."""
    rng, tests = np.random.default_rng(seed), []
    up = np.linspace(0, 10, RAMP_S * RATE_Hz)
    u = np.concatenate([up, up[::-1]])
    for place, dp in enumerate((1.0, 4.0, 4.0, 1.0)):
        spool = sticking(u, breakaway, rng) if breakaway else u
        flow = gain * dp**0.5 * np.clip(spool - 5.3 + 0.05 * dp, 0, 4.0)
        read = meter(flow, rng) + noise * rng.standard_normal(u.size)
        tests.append(
            RampTest(
                source=f"ramp{place}.csv",
                sha256=f"{place:064d}",
                time=np.arange(u.size) / RATE_Hz,
                u=u + 2e-3 * rng.standard_normal(u.size),
                q=np.where(np.abs(read) < floor, 0.0, read) * L_MIN,
                dp=dp * MPA * (1 + 1e-3 * rng.standard_normal(u.size)),
                started=200.0 * place,
            )
        )
    return tests


def ripples(tests):
    """Return the ripple of each test, V, and whether it is said."""
    model = identify(tests, IdentifyOptions(meter_lag=0.0, repeatability=1e-3))
    said = "stick-slip" in {warning.code for warning in model.warnings}
    found = [test.spool_ripple_V for test in model.positive.tests]
    assert said == any(found)
    return found, model


@pytest.mark.parametrize(("breakaway", "gain"), [(0.15, 12.0), (0.25, 12.0), (0.25, 4.0)])
@pytest.mark.parametrize("floor", [0.0, FLOOR_L_min], ids=["no floor", "behind a floor"])
def test_a_spool_that_sticks_is_seen_whatever_the_dead_zone_shows(breakaway, gain, floor):
    found, model = ripples(recordings(breakaway, gain, floor))
    # Steps of one height stand off their mean course by the height over the root of twelve; a few widths of an average.
    assert found == pytest.approx([breakaway / 12**0.5] * 2, rel=0.3)
    lowest = [5.3 - 0.05 * dp for dp in (1.0, 4.0)]
    offsets = np.array(model.positive.beta.beta) * model.positive.reference.u_min_V
    assert (offsets < lowest).all()


def slow(correlation, sd):
    """A meter whose noise is slow."""

    def read(flow, rng):
        noise, steps = [0.0], rng.standard_normal(flow.size)
        for step in steps[1:].tolist():
            noise.append(correlation * noise[-1] + sd * (1 - correlation**2) ** 0.5 * step)
        return flow + np.array(noise)

    return read


#: What ripples and is no stick-slip, behind a floor.
OTHERS = {
    "white noise": {},
    "no noise": {"noise": 0.0},
    "slow noise": {"meter": slow(0.9, 0.4), "noise": 0.0},
    "slower noise": {"meter": slow(0.98, 0.4), "noise": 0.0},
    "pulsation of 2 Hz": {"meter": lambda flow, rng: flow * (1 + 0.05 * np.sin(12.6 * np.arange(flow.size) / RATE_Hz))},
    "coarse steps": {"meter": lambda flow, rng: np.round(flow), "noise": 0.0},
    "held for a fifth of a second": {"meter": lambda flow, rng: flow[np.arange(flow.size) // 10 * 10], "noise": 0.0},
    # Three standard deviations of the noise: a dead zone shows a peak or two, which are no noise to compare with.
    "rare peaks": {"floor": 0.3},
}


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("seed", [1, 2])
def test_what_else_ripples_is_not_taken_for_it(name, seed):
    assert ripples(recordings(gain=3.2, seed=seed, **OTHERS[name]))[0] == [0.0, 0.0]


def swinging(frequency, lag=0.1, share=0.1, breakaway=0.0, seed=1):
    """Record three pressure drops that swing with the pump; the flow follows at once, the meter's filter late."""
    rng, tests = np.random.default_rng(seed), []
    up, hold = np.linspace(0, 10, RAMP_S * RATE_Hz), np.zeros(3 * RATE_Hz)
    u = np.concatenate([hold, up, up[::-1], hold])
    time = np.arange(u.size) / RATE_Hz
    for dp in (1.0, 3.0, 5.0):
        spool = sticking(u, breakaway, rng) if breakaway else u
        opening = np.clip(spool - 5.3 + 0.05 * dp, 0, None)
        swing = share * np.sin(2 * np.pi * frequency * time + rng.uniform(0, 2 * np.pi))
        now = dp * (1 + swing)
        flow = 3.2 * now**0.5 * opening
        if lag:
            pole = np.exp(-1 / (lag * RATE_Hz))
            flow = lfilter([1 - pole], [1, -pole], flow)
        tests.append(
            RampTest(
                source=f"swing{dp:g}.csv",
                sha256=f"{round(dp):064d}",
                time=time,
                u=u + 2e-3 * rng.standard_normal(u.size),
                q=(flow + 0.05 * rng.standard_normal(u.size)) * L_MIN,
                dp=now * MPA * (1 + 4e-3 * rng.standard_normal(u.size)),
            )
        )
    return tests


class TestSwingingSupply:
    """A pressure drop that swings: its level is the mean, the flow follows, and the spool stands still."""

    @pytest.mark.parametrize("lag", [0.0, 0.1])
    @pytest.mark.parametrize("frequency", [0.2, 0.5, 1.3, 3.0, 7.0, 12.5, 20.0])
    def test_the_level_is_found_and_no_bound_is_above_the_threshold(self, frequency, lag, wording):
        options = IdentifyOptions(meter_lag=lag, meter_lag_tolerance=0.0, repeatability=0.0)
        model = identify(swinging(frequency, lag), options)
        codes = [warning.code for warning in model.warnings]
        assert "stick-slip" not in codes and "pressure-swings" in codes
        assert [test.dp_MPa for test in model.positive.tests] == pytest.approx([1.0, 3.0, 5.0], rel=0.01)
        for test, dp in zip(model.positive.tests, (1.0, 3.0, 5.0), strict=True):
            assert test.u_guard_lower_V < 5.3 - 0.05 * dp
            assert test.u_knee_falling_V == pytest.approx(5.3 - 0.05 * dp, abs=0.015)
        if (frequency, lag) == (3.0, 0.1):
            (said,) = [warning.text for warning in model.warnings if warning.code == "pressure-swings"]
            wording("spool ripple: a supply that swings", said)

    def test_a_spool_that_sticks_under_a_swinging_supply_is_still_seen(self):
        model = identify(swinging(3.0, breakaway=0.3), IdentifyOptions(meter_lag=0.1))
        assert {"stick-slip", "pressure-swings"} <= {warning.code for warning in model.warnings}
        ripple = [test.spool_ripple_V for test in model.positive.tests]
        assert ripple == pytest.approx([0.3 / 12**0.5] * 3, rel=0.4)

    def test_a_steady_supply_is_not_said_to_swing(self):
        model = identify(swinging(3.0, share=0.0), IdentifyOptions(meter_lag=0.1))
        assert "pressure-swings" not in {warning.code for warning in model.warnings}

    def test_seeded_without_the_swings_it_passes_for_stick_slip(self, monkeypatch):
        monkeypatch.setattr(spool_ripple, "SWINGS", np.inf)
        model = identify(swinging(3.0), IdentifyOptions(meter_lag=0.1))
        assert "stick-slip" in {warning.code for warning in model.warnings}


class TestSeeded:
    """Each fault is seen by the checks above."""

    def test_slow_noise_that_no_jumps_confirm(self, monkeypatch):
        monkeypatch.setattr(spool_ripple, "SKEWED", -np.inf)
        assert any(ripples(recordings(gain=3.2, **OTHERS["slow noise"]))[0])

    def test_rare_peaks_as_a_reference(self, monkeypatch):
        monkeypatch.setattr(spool_ripple, "ONE_NUMBER", 1.0)
        found = [ripples(recordings(gain=3.2, seed=seed, **OTHERS["rare peaks"]))[0] for seed in range(1, 7)]
        assert np.any(found)

    def test_no_reference_behind_a_floor(self, monkeypatch):
        monkeypatch.setattr(spool_ripple, "SKEWED", np.inf)
        assert ripples(recordings(0.25))[0] == [0.0, 0.0]
