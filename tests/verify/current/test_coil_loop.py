"""The controller's C in a loop with the coil, the PWM resolved."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.design.current.circuit import Corner
from dzdesign.design.current.responses import run_loop
from dzdesign.verify.current.coil import CoilLoop, CoilSimulation
from dzdesign.verify.current.controller_states import OPEN, OVER, SHORT
from tests.support.current_loops import current_texts
from tests.support.example_coil import COIL, CONVERTER, SAMPLING, SENSORS, asked, example_loop
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
STEP = [6000] * 300 + [54000] * 200 + [30000] * 200


def simulation(name: str, edit=lambda text: text, **changed) -> CoilSimulation:
    loop = replace(example_loop(name), **changed)
    core = {file: edit(text) for file, text in current_texts(loop).items()}
    around = CoilLoop(loop=loop, circuit=COIL, sensor=SENSORS[name], converter=CONVERTER, sampling=SAMPLING)
    return CoilSimulation(around, core)


@pytest.mark.parametrize("name", SENSORS)
def test_what_design_reckons_with_is_what_the_c_does(name):
    """Every compare value of every corner over steps up and down, from rest on; the current to a nanoampere."""
    simulated, corners = simulation(name), list(COIL.corners())
    means, compares = run_loop(simulated.around.loop, asked(SENSORS[name]), corners, STEP)
    for place, corner in enumerate(corners):
        found = simulated.run(corner, STEP)
        assert not found["faults"].any()
        assert np.array_equal(found["compare"], compares[:, place])
        assert found["mean_A"] == pytest.approx(means[:, place], abs=1e-9)


@pytest.mark.parametrize(
    ("corner", "fault"),
    [(Corner(1e5, 0.04, 24.0), OPEN), (Corner(0.2, 5e-5, 24.0), SHORT), (Corner(0.5, 0.4, 24.0), 0)],
)
def test_an_open_and_a_shorted_coil_are_seen_and_a_slow_one_is_not(corner, fault):
    found = simulation("supply unknown").run(corner, [30000] * 400)
    assert found["faults"][-1] == fault
    assert not fault or found["compare"][-1] == 0


def test_too_high_a_current_is_seen():
    """A coil that lost most of its turns: the loop holds it, until a limit below the set point says otherwise."""
    name = "supply unknown"
    below = example_loop(name).over_sum // 2
    found = simulation(name, over_sum=below).run(COIL.nominal, [45000] * 400)
    assert found["faults"][-1] == OVER and found["compare"][-1] == 0


def overshoot(simulated: CoilSimulation, corner: Corner) -> float:
    found = simulated.run(corner, [6000] * 300 + [54000] * 150)
    return float((found["mean_A"][300:].max() - 0.9) / 0.8)


SEEDED = {
    "no anti-windup": (lambda text: text.replace(" & ~past_end", ""), {}),
    "no rate": (lambda text: text, {"rate": 60000}),
    "an integral ten times as fast": (lambda text: text, {"integral": 1200}),
}


@pytest.mark.parametrize("fault", SEEDED)
def test_a_loop_that_overshoots_is_seen(fault):
    """The output is held at 60 % here, so that a step is at the limit for long."""
    edit, changed = SEEDED[fault]
    corner, low = Corner(5.225, 0.06, 18.0), Corner(3.125, 0.02, 32.0)
    common = {"compare_limit": 19000} if fault == "no anti-windup" else {}
    wrong, right = simulation("supply unknown", edit, **common, **changed), simulation("supply unknown", **common)
    right_most, worst = (max(overshoot(each, at) for at in (corner, low)) for each in (right, wrong))
    assert right_most <= 0.10 < worst
