"""A run takes as many steps in a period of the PWM as its own pressure drops need, and the same path."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.verify.closed_loop import motion
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence
from dzdesign.verify.closed_loop.motion import NAMED, numbers_of
from dzdesign.verify.closed_loop.plant import LARGEST_DP_MPA, Plant
from tests.support.synthetic import needs_compiler

STIFF = replace(Plant(), flow_force_N_mm_MPa=3.4)


def test_fewer_steps_serve_a_low_pressure_drop():
    numbers, place = numbers_of(STIFF, 750), NAMED.index("STEPS")
    assert numbers.up_to(LARGEST_DP_MPA)[place] == numbers.flat[place] == 2
    assert numbers.up_to(5.0)[place] == 1
    assert np.delete(numbers.up_to(5.0), place) == pytest.approx(np.delete(numbers.flat, place), rel=0, abs=0)


@needs_compiler
def test_the_path_does_not_depend_on_them(monkeypatch):
    loop, command = ClosedLoop(STIFF), RampSequence(rest=0.1, ramp=1.0, top=0.1).command()
    fewer = loop.run(command, 5.0)
    monkeypatch.setattr(motion.Numbers, "up_to", lambda numbers, dp_MPa: numbers.flat)
    more = loop.run(command, 5.0)
    assert fewer.q_mean_L_min == pytest.approx(more.q_mean_L_min, abs=1e-5 * more.q_mean_L_min.max())
