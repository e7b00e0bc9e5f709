"""Part 9 of the benchmark, in small, and that it sees a product that is blind to steps behind a meter's floor."""

from functools import partial

import numpy as np
import pytest
from bench_plant import that_sticks, with_play
from stops import BEHIND_A_FLOOR, RARE_PEAKS, _valve

from dzdesign.identify.knees import spool_ripple

pytestmark = pytest.mark.slow


def sticking(seed):
    rng = np.random.default_rng(seed)
    return _valve(partial(that_sticks, breakaway=0.15, rng=rng), "stick-slip", 1, BEHIND_A_FLOOR, rng)


def test_steps_behind_a_floor_are_said_and_open_nothing(monkeypatch):
    opened, silent, left = sticking(1)
    assert not opened and not silent
    monkeypatch.setattr(spool_ripple, "SKEWED", np.inf)  # seeded
    _, silent, of_blind = sticking(1)
    assert silent and of_blind < left - 0.03


def test_rare_peaks_above_a_floor_are_no_steps():
    rng = np.random.default_rng(2)
    assert all(_valve(partial(with_play, play=0.2), "stick-slip", 1, RARE_PEAKS, rng)[1] for _ in range(3))
