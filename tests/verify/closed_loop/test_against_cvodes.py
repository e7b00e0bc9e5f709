"""The native plant beside CasADi's CVODES: they agree for every kind of plant, and each wrong native plant is seen."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.verify.closed_loop import against_cvodes
from dzdesign.verify.closed_loop import loop as native_loop
from dzdesign.verify.closed_loop.against_cvodes import Window, compare, compare_with_cvodes, native_plant_check
from dzdesign.verify.closed_loop.loop import ClosedLoop
from dzdesign.verify.closed_loop.plant import COIL_RAD, LARGEST_DP_MPA, PWM_PERIOD_S, Plant
from dzdesign.verify.closed_loop.scene import scenes_of
from dzdesign.verify.toolchain.compiled_library import CompiledLibrary
from tests.support.designs import CURRENT
from tests.support.synthetic import needs_compiler
from tests.verify.closed_loop.test_current_in_loop import scenes_at_ends

SHORT_S = 0.3


@pytest.fixture(scope="module")
def scene(plant_scenes):
    """The example with the plant of equations, compiled once."""
    return plant_scenes[0]


#: What is other than in the example's plant.
PLANTS = {
    "the example": {},
    "coil of 2 ms": {"L_c_H": 0.08},
    "coil of 100 ms": {"L_c_H": 4.0},
    "coil of 0.2 ms": {"L_c_H": 0.008},
    "ten times the flow force": {"flow_force_N_mm_MPa": 15.0},
    "ten times the flow force at a hard stop": {"flow_force_N_mm_MPa": 15.0, "stroke_mm": 0.6},
    "a play that lags": {"hysteresis_lag_s": 0.02},
    "hard stop": {"stroke_mm": 1.2, "B_e_N_s_m": 3.0},
    # What a step is off by stays: the stop, and the edge, passed to and fro.
    "no damping": {"B_e_N_s_m": 0.0, "stroke_mm": 1.5},
    # The ripple lifts it off the stop in every period.
    "thrown at the far stop": {"overlap_mm": 0.9, "stroke_mm": 1.0},
    "strong": {"K_i_N_A": 120.0, "B_e_N_s_m": 10.0, "stroke_mm": 0.8},
    "light spool": {"m_e_kg": 5e-4, "B_e_N_s_m": 2.0},
    "heavy spool": {"m_e_kg": 1.0},
    "droop 50 times": {"droop_MPa_L_min2": 0.02},
    # With a stroke of 2.2 mm it comes within 1e-8 mm of the stop: any integrator's last digits tell whether it touches.
    "pressure holds it open": {"overlap_mm": 0.0, "preload_N": 0.0, "stroke_mm": 2.1},
    "leaves a stop at an open edge": {
        "m_e_kg": 0.0095, "B_e_N_s_m": 4.1, "overlap_mm": 0.0, "L_c_H": 0.019, "K_i_N_A": 200.0,
        "flow_force_N_mm_MPa": 5.0, "preload_N": 0.0, "stroke_mm": 0.1,
    },
    "the edge at the stop": {
        "overlap_mm": 0.0, "pressure_force_N_MPa": 3.0, "K_et_N_m": 8500.0, "B_e_N_s_m": 0.0, "C_d_W_mm": 17.0,
    },
    # Past it for a part of a step only; and twice in a period.
    "turns back at the far stop": {
        "m_e_kg": 0.01, "B_e_N_s_m": 0.0, "L_c_H": 0.012, "flow_force_N_mm_MPa": 0.0, "stroke_mm": 4.111,
    },
    "turns twice": {
        "m_e_kg": 0.005, "B_e_N_s_m": 0.0, "L_c_H": 0.012, "flow_force_N_mm_MPa": 0.0, "stroke_mm": 3.734,
    },
}  # fmt: skip


@needs_compiler
@pytest.mark.parametrize("name", PLANTS)
def test_every_kind_of_plant_agrees(name, scene):
    found = compare(Window.of(scene, SHORT_S, **PLANTS[name]))
    assert native_plant_check([found]).holds and found.q_largest_L_min > 1
    assert max(found.position_difference, found.flow_difference) < 5e-6


@needs_compiler
def test_the_stand_in_agrees(scenes):
    found = compare(Window.of(scenes[0], SHORT_S))
    assert found.q_largest_L_min > 1 and max(found.position_difference, found.flow_difference) < 5e-6


@needs_compiler
@pytest.mark.parametrize("given", [False, True], ids=["stand-in", "plant of equations"])
def test_a_drive_by_current_agrees(given, example_valve, plant, tmp_path):
    found = compare(Window.of(scenes_at_ends(example_valve, CURRENT, tmp_path, plant if given else None)[0], SHORT_S))
    assert found.q_largest_L_min > 1 and max(found.position_difference, found.flow_difference) < 5e-6


@needs_compiler
def test_the_step_is_of_the_fourth_order(scene, monkeypatch):
    """Twice the step, sixteen times the error, stops and edge included."""
    window, errors = Window.of(scene, SHORT_S / 2), []
    for step_s in (200e-6, 100e-6):
        monkeypatch.setattr(Plant, "step_s", lambda _, dp_MPa, step_s=step_s: step_s)
        errors.append(compare(window).position_difference)
    assert 10 < errors[0] / errors[1] < 40


def test_the_step_follows_from_the_fastest_time_constant():
    plant, slow = Plant(), replace(Plant(), L_c_H=4.0)
    assert plant.step_s(1.0) < PWM_PERIOD_S / 2 and plant.step_s(LARGEST_DP_MPA) < plant.step_s(1.0)
    assert replace(plant, L_c_H=0.004).step_s(1.0) == pytest.approx(COIL_RAD / 10_000)
    assert replace(slow, B_e_N_s_m=0.0).step_s(1.0) < slow.step_s(1.0) / 2


@needs_compiler
def test_an_integrator_that_gives_up_has_compared_nothing(scenes, monkeypatch):
    monkeypatch.setitem(against_cvodes.OPTIONS, "max_num_steps", 2)
    check = compare_with_cvodes(scenes, lambda _: None)
    assert check.holds is None and "TOO_MUCH_WORK" in check.text


def other_plant(**factors):
    """Let the native plant alone have other parameters."""

    def fault(monkeypatch):
        right = native_loop.numbers_of

        def wrong(plant, *more):
            other = replace(plant)
            for name, factor in factors.items():
                object.__setattr__(other, name, getattr(plant, name) * factor)  # a wrong sign, too
            return right(other, *more)

        monkeypatch.setattr(native_loop, "numbers_of", wrong)

    return fault


def undriven(monkeypatch):
    """Let the native plant alone have no other drive."""
    right = native_loop.numbers_of
    monkeypatch.setattr(native_loop, "numbers_of", lambda plant, dp_MPa, _: right(plant, dp_MPa))


def text(name, right, wrong):
    """Change the native plant's C."""

    def fault(monkeypatch):
        load = native_loop.CompiledLibrary

        def changed(sources, *more):
            assert sources[name].count(right) == 1
            return load({**sources, name: sources[name].replace(right, wrong)}, *more)

        monkeypatch.setattr(native_loop, "CompiledLibrary", changed)

    return fault


FAULTS = {
    "spring": other_plant(K_et_N_m=1.0001),
    "damping": other_plant(B_e_N_s_m=1.001),
    "inductance": other_plant(L_c_H=1.001),
    "preload": other_plant(preload_N=1.0001),
    "flow force": other_plant(flow_force_N_mm_MPa=1.001),
    "the flow force's sign": other_plant(flow_force_N_mm_MPa=-1.0),
    "droop of the supply": other_plant(droop_MPa_L_min2=1.001),
    "density": other_plant(rho_kg_m3=1.001),
    "overlap": other_plant(overlap_mm=1.0005),
    "a far stop 0.1 % too near": other_plant(stroke_mm=0.999),
    "half the play": other_plant(hysteresis_V=0.5),
    "the play on the wrong side": text("plant_period.h", "(plant->play - plant->mean", "(plant->mean - plant->play"),
    "the play's lag": other_plant(hysteresis_lag_s=0.9),
    "the play of this period's current": text(
        "plant_period.h", "= plant->charge * p[PLANT_VOLTS_PER_CHARGE]", "= plant->state[CURRENT] * 6.0 / 6.6667"
    ),
    "a stop that throws back": text("plant.h", "end[SPEED] = 0.0;", "end[SPEED] *= -0.3;"),
    "a stop that is ignored": text("plant.h", "} else if (end[POSITION] > high) {", "} else if (0) {"),
    "a stop that is met at the step's end": text(
        "plant.h", "shorten(plant, flight, h, voltage, MEETS, to, from, end)", "h"
    ),
    "a stop that lets go at the step's end": text(
        "plant.h", "shorten(plant, HELD, h, voltage, LEAVES, x, away, end)", "h"
    ),
    "the edge no event": text("plant.h", "plant->open = from > 0.0;", ""),
    "a pulse at the period's end": text(
        "plant_period.h", "if (compare > 0) {", "if (compare > 0) { phase(plant, 1e-5, 0.0);"
    ),
    "a compare value at once": text(
        "loop.c", "(in_force < plant->counts) ? in_force", "((int32_t)compare < plant->counts) ? (int32_t)compare"
    ),
    "no drive is added": text("loop.c", "plant->bias = task->bias_V[k];", "plant->bias = 0.0;"),
    "another drive is none": undriven,
    "no flow in the mean of a record": text("loop.c", "= sum / (double)task->every", "= 0.0 * sum"),
    "no largest flow of a record": text("loop.c", "= largest;", "= 0.0 * largest;"),
}  # fmt: skip


@pytest.fixture(scope="module")
def at_the_stop(plant_scenes, plant):
    """A plant whose spool meets the far stop at full command, and whose play lags."""
    stopped = replace(plant, stroke_mm=1.5, hysteresis_lag_s=0.02)
    return replace(plant_scenes[0], loop=plant_scenes[0].loop.with_plant(stopped))


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_wrong_native_plant_is_seen(fault, at_the_stop, firmware, monkeypatch):
    scene = at_the_stop
    fault(monkeypatch)
    if native_loop.CompiledLibrary is not CompiledLibrary:  # the C is another
        monkeypatch.setattr(native_loop, "FLOATING", ("-O1", "-ffp-contract=off"))  # which compiles in less time
        scene = scenes_of(firmware, scene.compensator, scene.loop.plant)[0]
    assert native_plant_check([compare(Window.of(scene, SHORT_S))]).holds is False


@needs_compiler
def test_the_window_shows_what_the_faults_need(at_the_stop):
    """Without a fault the same plant holds, and meets the far stop."""
    found = compare(Window.of(at_the_stop, SHORT_S))
    assert native_plant_check([found]).holds and found.impacts >= 1


@needs_compiler
def test_a_direct_command_has_the_wave_of_the_recordings_about_it():
    """It begins with its upper half; there is none about a command of zero, and none past the PWM's range."""
    command = np.concatenate([np.zeros(40), np.full(40, 0.5), np.full(40, 0.9999)])
    run = ClosedLoop(Plant(), dither=(600, 8)).run(command, 1.0, periods_per_record=1)
    wave = np.where(np.arange(command.size) % 16 < 8, 600, -600)
    direct = np.floor(command * 60000 + 0.5)
    assert np.array_equal(run.compare, np.where(direct > 0, np.clip(direct + wave, 0, 60000), 0))
