"""The largest gain of a position loop that does not hunt, against a simulation in small steps."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.design.design_choices import read_position_loop
from dzdesign.design.position_loop import GAINS, in_words, largest_gain, largest_gains
from tests.support.designs import designed
from tests.support.hunting import drawn, hunts, swinging


@pytest.mark.parametrize("seed", range(4))
def test_no_cycle_just_below_the_limit_and_one_above(seed):
    """Two hundred draws: benchmarks/verify/hunting.py."""
    of = drawn(np.random.default_rng(seed))
    loop = swinging(replace(of, lag_s=min(of.lag_s, 0.02), delay_s=min(of.delay_s, 0.008)))
    of = replace(of, lag_s=loop.lag_s, delay_s=loop.delay_s)
    gain, seconds = largest_gain(loop), 40 * 2 * np.pi / loop.swing_rad_s
    assert 0 < gain < GAINS[-1] * loop.linear_gain
    assert not hunts(of, 0.95 * gain, seconds) and hunts(of, 1.15 * gain, seconds)


def test_over_compensation_hunts_at_every_gain():
    of = drawn(np.random.default_rng(0))
    above = swinging(replace(of, offset=of.opens + 0.002, at_end=of.opens + 0.004))
    assert not above.rests(GAINS * above.linear_gain).any() and largest_gain(above) == 0.0
    assert hunts(replace(of, offset=of.opens + 0.002, at_end=of.opens + 0.004), 0.5 * above.linear_gain, 3.0)


def test_design_says_it_of_each_side_and_a_slower_valve_bears_less(example_valve):
    compensator = designed(example_valve)
    (fast,), (slow,) = largest_gains(compensator, 0.01, 0.002), largest_gains(compensator, 0.05, 0.01)
    assert fast.side == slow.side == "positive" and fast.gain > 2 * slow.gain
    (line,) = in_words(designed(example_valve, position_loop="50 ms, 10 ms"))
    stated = float(line.split("velocity gain of ")[1].split("/s")[0])
    assert "lag 50 ms, delay 10 ms" in line and 0.9 * slow.gain <= stated <= slow.gain


@pytest.mark.parametrize("text", ["20 ms", "20 ms, 2 ms, 1 ms", "0 s, 1 ms", "20 ms, 5 s", "20, 2"])
def test_what_is_no_lag_and_delay_is_refused(text):
    with pytest.raises(InputError, match="--position-loop"):
        read_position_loop(text, "--position-loop")
