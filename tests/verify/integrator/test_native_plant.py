"""The native plant beside CasADi's integrator: they agree, and each wrong native plant is seen."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.artefact_files import write_folder
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.verify.closed_loop import loop as native_loop
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.motion import NAMED, Numbers
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.integrator import comparison, cvodes
from dzdesign.verify.integrator.compiled_calls import compiled_core
from dzdesign.verify.integrator.spool import CvodesSpool
from dzdesign.verify.integrator.switched_coil import SwitchedCoil
from dzdesign.verify.integrator.windows import windows_of
from tests.support.synthetic import needs_compiler
from tests.verify.closed_loop.test_current_in_loop import TEXTS, scenes

SHORT_S = 0.1
ENTRY = {name: place for place, name in enumerate(NAMED)}


@pytest.fixture(scope="module")
def example_plant(example_folder):
    return read_plant(example_folder / "plant.toml")


@pytest.fixture(scope="module")
def core_folder(example_firmware, tmp_path_factory):
    folder = tmp_path_factory.mktemp("native_plant") / "firmware"
    write_folder(folder, example_firmware.files, example_firmware.manifest)
    return folder


@pytest.fixture(scope="module")
def made(core_folder, example_compensator, example_plant):
    """The example's scenes with the plant of equations, compiled once."""
    return scenes_of(core_folder, example_compensator, example_plant)


@pytest.fixture(scope="module")
def core(core_folder):
    return compiled_core(core_folder, None)


def short(scenes_found, kind, seconds=SHORT_S):
    """The window of a kind, shorter than `verify` has it."""
    return replace(next(each for each in windows_of(scenes_found) if each.kind == kind), seconds=seconds)


def compared(folder, compensator, plant, kind="step", seconds=SHORT_S):
    window = short(scenes_of(folder, compensator, plant), kind, seconds)
    return comparison.compare(window, compiled_core(folder, window.scene.loop.coil))


def holds(found, *, is_stand_in=False):
    return comparison.native_plant_check([found], AS_COMPUTED, is_stand_in=is_stand_in, by_current=False).holds


@needs_compiler
@pytest.mark.parametrize("kind", ["ramp", "step", "load step", "disturbances"])
def test_the_plant_of_equations_is_within_a_tenth_of_what_is_allowed(kind, made, core):
    """Seeded: a parabola through the ripple, as the native step had it, was off by 0.9e-5 of the stroke at 5 MPa."""
    found = comparison.compare(short(made, kind), core)
    assert holds(found) and found.q_largest_L_min > 1 and found.impacts >= 1
    assert found.position_difference < 2e-6 and found.flow_difference < 5e-6 and found.unlike_compare_values == 0


def other_scenes(made, **changes):
    """The same scenes with other parameters of the plant; nothing is compiled again."""
    for scene in made:
        plant = replace(scene.plant, **changes)
        yield replace(scene, plant=plant, loop=scene.loop.with_plant(plant))


#: Name -> kind of the window, its time in s, what is other than in the example's plant.
ENDS = {
    # 0.1 mH: what is left of its current when it is switched off is none of a number's digits.
    "fast coil": ("ramp", 0.02, {"L_c_H": 1e-4}),
    # What a step is off by stays: the stop, left 5 times, and the edge, passed to and fro.
    "no damping": ("step", 0.2, {"B_e_N_s_m": 0.0, "stroke_mm": 1.5}),
    # The ripple lifts it off the stop in every period.
    "thrown at the far stop": ("load step", 0.05, {"overlap_mm": 0.9, "stroke_mm": 1.0}),
    "strong": ("step", 0.1, {"K_i_N_A": 120.0, "B_e_N_s_m": 10.0, "stroke_mm": 0.8}),
    "light spool": ("ramp", 0.03, {"m_e_kg": 5e-4, "B_e_N_s_m": 2.0}),
    "pressure holds it open": ("step", 0.1, {"overlap_mm": 0.0, "preload_N": 0.0}),
    "leaves a stop at an open edge": ("step", 0.1, {
        "m_e_kg": 0.0095, "B_e_N_s_m": 4.1, "overlap_mm": 0.0, "L_c_H": 0.019, "K_i_N_A": 200.0,
        "flow_force_N_mm_MPa": 5.0, "preload_N": 0.0, "stroke_mm": 0.1,
    }),
    "comes to a stop at an open edge": ("step", 0.1, {
        "m_e_kg": 0.042, "B_e_N_s_m": 2.0, "overlap_mm": 0.0, "L_c_H": 0.028, "K_i_N_A": 200.0,
        "flow_force_N_mm_MPa": 5.0, "preload_N": 0.0, "stroke_mm": 0.05,
    }),
    # Past it for a part of a piece only.
    "turns back at the far stop": ("step", 0.05, {
        "m_e_kg": 0.01, "B_e_N_s_m": 0.0, "L_c_H": 0.012, "flow_force_N_mm_MPa": 0.0, "stroke_mm": 4.111,
    }),
}  # fmt: skip


def at_end(made, core, name):
    kind, seconds, changes = ENDS[name]
    return comparison.compare(short(list(other_scenes(made, **changes)), kind, seconds), core)


@needs_compiler
@pytest.mark.parametrize("name", ENDS)
def test_plants_at_the_ends_of_what_is_allowed(name, made, core):
    found = at_end(made, core, name)
    assert found.q_largest_L_min > 1 and found.unlike_compare_values == 0
    assert found.position_difference < 2e-6 and found.flow_difference < 8e-6


@needs_compiler
def test_a_spool_that_turns_twice_in_a_phase_meets_the_stop_between(made, core, monkeypatch):
    """Its speeds at both ends are of one sign. Seeded: the reference passed the stop, and was off by 2e-3."""
    changes = {"m_e_kg": 0.005, "B_e_N_s_m": 0.0, "L_c_H": 0.012, "flow_force_N_mm_MPa": 0.0, "stroke_mm": 3.734}
    window = short(list(other_scenes(made, **changes)), "step", 0.1)
    assert holds(comparison.compare(window, core))
    monkeypatch.setattr(CvodesSpool, "_fastest", lambda *_: 0.0)
    assert holds(comparison.compare(window, core)) is False


@needs_compiler
@pytest.mark.parametrize("kind", ["step", "load step", "disturbances"])
def test_the_stand_in_is_within_rounding(kind, firmware_folder, example_compensator):
    """Seeded: until the period's end the core was shown a new supply as if nothing flowed."""
    found = compared(firmware_folder, example_compensator, None, kind)
    assert found.q_largest_L_min > 1
    assert found.position_difference < 1e-10 and found.flow_difference < 1e-10 and found.unlike_compare_values == 0


@needs_compiler
@pytest.mark.parametrize("given", [False, True], ids=["stand-in", "plant of equations"])
def test_a_drive_by_current_is_compared_with_its_coil(given, example_valve, example_plant, tmp_path):
    found_scenes = scenes(example_valve, TEXTS, tmp_path, example_plant if given else None)
    window = short(found_scenes, "step", 0.06)
    library = compiled_core(tmp_path, window.scene.loop.coil)
    found = comparison.compare(window, library)
    assert found.q_largest_L_min > 1 and found.unlike_compare_values == 0
    assert max(found.position_difference, found.flow_difference) < 5e-6
    assert_its_coil_is_that_of_the_closed_form(SwitchedCoil(window.scene.loop.coil, library))


def assert_its_coil_is_that_of_the_closed_form(coil):
    """On, off, and off until the diode blocks, at every span of a phase; on over the whole period is one span more."""
    ohm, henry = coil._corner.resistance_ohm, coil._corner.inductance_H
    for volts, on, begin_A, longest_ms in (
        (coil._corner.supply_V, True, 0.1, 0.4), (-coil._circuit.freewheel_V, False, 0.5, 0.4),
        (-coil._circuit.freewheel_V, False, 0.02, 100.0),
    ):  # fmt: skip
        spans = np.linspace(0.0, longest_ms, coil._sampling.samples + 2).tolist()
        end_A, coil._current = volts / ohm, begin_A
        blocks_ms = np.inf if on else 1e3 * henry / ohm * np.log1p(-begin_A / end_A)
        assert (blocks_ms < longest_ms) == (longest_ms == 100.0)
        currents, charge = coil._passed(spans, on=on)
        flows_ms = np.minimum(spans, blocks_ms)
        expected = end_A + (begin_A - end_A) * np.exp(-1e-3 * ohm / henry * flows_ms)
        np.testing.assert_allclose(currents, expected, rtol=0, atol=1e-10)
        passed = end_A * flows_ms[-1] + 1e3 * henry / ohm * (begin_A - expected[-1])
        assert charge == pytest.approx(passed, abs=1e-9)


@needs_compiler
def test_no_stop_is_looked_for_where_none_can_be_reached(firmware_folder, example_compensator, example_plant,
                                                         monkeypatch):  # fmt: skip
    """Looked for in every phase, the same is found; by a reach that is too short, another flight."""
    plant = replace(example_plant, stroke_mm=1.5)
    found = compared(firmware_folder, example_compensator, plant, seconds=0.03)
    reach, runs = CvodesSpool._reach_mm, []
    for factor in (1e9, 1e-3):
        monkeypatch.setattr(CvodesSpool, "_reach_mm", lambda *given, by=factor: by * reach(*given))
        runs.append(compared(firmware_folder, example_compensator, plant, seconds=0.03))
    assert found.impacts >= 2 and runs[0] == found and runs[1] != found


@needs_compiler
def test_an_integrator_that_gives_up_has_compared_nothing(firmware_folder, example_compensator, monkeypatch):
    monkeypatch.setitem(cvodes.OPTIONS, "max_num_steps", 2)
    found_scenes = scenes_of(firmware_folder, example_compensator, None)
    found, check = comparison.compare_with_integrator(firmware_folder, found_scenes, lambda _: None)
    assert found == () and check.holds is None and "TOO_MUCH_WORK" in check.text


def test_verify_compares_two_seconds(whole_windows, firmware_folder, example_compensator):
    """Other tests take less of it: see `short_windows_beside_casadi`."""
    windows = windows_of(scenes_of(firmware_folder, example_compensator, None))
    assert {each.kind for each in windows} == {"ramp", "step", "load step", "disturbances"}
    assert sum(each.seconds for each in windows) == pytest.approx(2.0)


def number(name, factor):
    """Multiply one number of the native plant."""

    def fault(monkeypatch):
        right = native_loop.numbers_of

        def wrong(plant, counts):
            numbers = right(plant, counts)
            numbers.flat[ENTRY[name]] *= factor
            return numbers

        monkeypatch.setattr(native_loop, "numbers_of", wrong)

    return fault


def other_plant(**factors):
    """Let the native plant alone have other parameters."""

    def fault(monkeypatch):
        right = native_loop.numbers_of

        def wrong(plant, counts):
            changed = {name: getattr(plant, name) * factor for name, factor in factors.items()}
            return right(replace(plant, **changed), counts)

        monkeypatch.setattr(native_loop, "numbers_of", wrong)

    return fault


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
    "droop of the supply": other_plant(droop_MPa_L_min2=1.001),
    "density": other_plant(rho_kg_m3=1.001),
    "overlap": other_plant(overlap_mm=1.0005),
    "half the play": number("HALF_PLAY_V", 0.5),
    "the play on the wrong side": text("plant_period.h", "(plant->play - plant->mean", "(plant->mean - plant->play"),
    "the play of this period's current": text(
        "plant_period.h", "plant->mean = charge * p[PLANT_VOLTS_PER_CHARGE]", "plant->mean = plant->i * 6.0 / 6.6667"
    ),
    "a far stop 0.1 % too near": number("STROKE_M", 0.999),
    "a stop that throws back": text("plant_stops.h", "plant->v = 0.0;", "plant->v *= -0.3;"),
    "no stop at rest": text("plant_stops.h", "return fmax(-position, ", "return fmax(0.0 * position, "),
    "a pulse at the period's end": text("plant_period.h", "2 * (plant->counts - compare)", "2 * compare"),
    "a middle value elsewhere": text("plant_period.h", "= balance(plant, 1.0) -", "= 0.9 * balance(plant, 1.0) -"),
    "the edge passed as if it were smooth": text("plant_period.h", "if (!linear && ((fabs(", "if (0 && ((fabs("),
    "a compare value at once": text(
        "loop.c", "(in_force < plant->counts) ? in_force", "((int32_t)compare < plant->counts) ? (int32_t)compare"
    ),
    "a pressure of another code": text("loop.c", "? 1.0 : -1.0)) / span", "? 0.0 : -1.0)) / span"),
}


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_a_wrong_native_plant_is_seen(fault, firmware_folder, example_compensator, example_plant, monkeypatch):
    """Of a plant whose spool meets the far stop at full command."""
    plant = replace(example_plant, stroke_mm=1.5)
    assert holds(compared(firmware_folder, example_compensator, plant))
    fault(monkeypatch)
    assert holds(compared(firmware_folder, example_compensator, plant)) is False


#: What the windows at tested pressures, undisturbed, did not show.
OF_SCENARIOS = {
    "no drive is added": text("loop.c", "plant->bias = task->bias_V[k];", "plant->bias = 0.0;"),
    "another drive is none": lambda monkeypatch: monkeypatch.setattr(Numbers, "driven", lambda numbers, _: numbers),
    "other oil is none": text("plant_curve.h", "plant->q_max *= table[CURVE_SCALE];", ""),
    "a sensor that fails does not": text("loop.c", "(shown < 0) ?", "(shown < 9999) ?"),
    "the pressure behind the edge stays": text("loop.c", "task->back_MPa[k]", "task->back_MPa[0]"),
    "no noise": text("loop.c", "if (channel->noise > 0.0)", "if (channel->noise > 1e9)"),
    "no errors of the converter": text("loop.c", " * channel->gain + channel->offset", ""),
    "no flow in the mean of a record": text("loop.c", "= sum / (double)task->every", "= 0.0 * sum"),
    "no largest flow of a record": text("loop.c", "= largest;", "= 0.0 * largest;"),
    "another threshold between the tests": text("plant_curve.h", "entry[BRANCH_SEEN_V] + beyond * room", "u"),
    "the last threshold beyond the tests": text(
        "plant_curve.h", "plant->beyond_MPa * plant->curve", "0.0 * plant->curve"
    ),
    "the last flow beyond the tests": text("plant_curve.h", "sqrt(dp / fmin(fmax(dp, low), high))", "1.0"),
}

#: Faults that the example's plant does not show, each with one that does.
AT_ENDS = {
    "held by the current at its end": ("fast coil", "plant_period.h", "plant->i + plant->on * (", "after + 0.0 * ("),
    # 2.3e-5, 1.0e-4 and 2.7e-3 of the stroke, where the right ones are off by 5e-7, 2e-7 and 3e-8.
    "one piece from a stop": ("leaves a stop at an open edge", "plant_period.h", "(edge_at_stop ? PIECES : 1)", "1"),
    "one piece to a stop": ("comes to a stop at an open edge", "plant_period.h", "? PIECES : 1;", "? 1 : 1;"),
    "a turn told to half a piece": ("turns back at the far stop", "plant_stops.h", "TURN_STEPS 27", "TURN_STEPS 1"),
    "the edge no event": ("no damping", "plant_stops.h", "(shut ? past : -past)", "-1.0"),
}


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("fault", OF_SCENARIOS.values(), ids=OF_SCENARIOS)
def test_a_loop_that_ignores_what_a_scenario_gives_it_is_seen(
    fault, firmware_folder, example_compensator, monkeypatch
):  # fmt: skip
    """Seeded: with each of them machines, failing sensors and noise changed nothing, so that nothing flowed at zero."""
    fault(monkeypatch)
    found = compared(firmware_folder, example_compensator, None, "disturbances")
    assert holds(found, is_stand_in=True) is False


@needs_compiler
@pytest.mark.slow
@pytest.mark.parametrize("fault", AT_ENDS)
def test_a_wrong_native_plant_is_seen_at_the_ends(fault, core_folder, example_compensator, example_plant, core,
                                                  monkeypatch):  # fmt: skip
    name, *change = AT_ENDS[fault]
    text(*change)(monkeypatch)
    found = at_end(scenes_of(core_folder, example_compensator, example_plant), core, name)
    assert found.position_difference > 2e-6
