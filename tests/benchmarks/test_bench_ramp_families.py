"""Part 8c of the benchmark, in small, and that it sees a product that ignores scatter or a drift."""

import numpy as np
import pytest
from ramp_families import SCATTER, SHAPES, TARGETED, Design, simulate
from ramp_series import FALLING, FLAT
from ramp_series import _family as family_through_recordings

from dzdesign.identify.fit import certificate, ramp_model

COUNT = 12


def below(shape, design, scatter=SCATTER, seed=1):
    """Return how often, on average, the next closing of a family lies below its offset."""
    rng = np.random.default_rng([seed, len(shape)])
    return float(np.mean([simulate(SHAPES[shape], design, scatter, rng).below for _ in range(COUNT)]))


@pytest.mark.parametrize("shape", [name for name in SHAPES if name != "step"])
def test_the_next_closings_stay_above_the_offset(shape):
    assert below(shape, Design()) < 0.06


@pytest.mark.parametrize("what", [what for what in TARGETED if "drift" in what or "off by" in what])
def test_so_they_do_with_a_drift_and_with_one_ramp_off(what):
    shape, design, _ = TARGETED[what]
    assert below(shape, design) < 0.06


def test_a_critical_value_that_is_left_out_is_seen(monkeypatch):
    monkeypatch.setattr(certificate, "_critical", lambda *given: 0.1)
    assert below("line", Design()) > 0.3


def test_a_drift_that_is_left_out_is_seen(monkeypatch):
    """Its change is then a scatter, and the offset pays for it: three times and more."""
    _, design, _ = TARGETED["line, drift of 2 %, single ramps and a closing repeat"]

    def paid():
        rng = np.random.default_rng(1)
        return float(np.mean([simulate(SHAPES["line"], design, SCATTER, rng).paid for _ in range(COUNT)]))

    told = paid()
    monkeypatch.setattr(ramp_model, "TELLS_DRIFT", 1e9)
    assert paid() > 3 * told


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "scatter_mV", "drift"),
    [("one ramp", 12.5, 0.0), ("three repeats", 25.0, 0.0), ("three repeats in random order", 12.5, -0.02)],
)
def test_four_families_through_raw_recordings(how, scatter_mV, drift):
    """Read from the samples of every ramp; two of four is once in two thousand of them."""
    rng = np.random.default_rng([20261122, round(scatter_mV), len(how)])
    falling, flat = (
        [family_through_recordings(truth, how, 1e-3 * scatter_mV, drift, rng) for _ in range(4)]
        for truth in (FALLING, FLAT)
    )
    assert sum(opened for opened, _ in falling) <= 1
    assert sum(opened for opened, _ in flat) <= 1 and sum(trend for _, trend in flat) <= 1
