"""Coil, supply, wrong readings, each sensor by itself, dP above the tests: what must be seen is seeded, and seen."""

import re
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import InputError
from dzdesign.design.designing import design
from dzdesign.design.machine import Machine
from dzdesign.design.options import options_of
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED, drive_corners, resistance_ratio
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.loop import ClosedLoop, ReadingErrors
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.closed_loop.scenarios import readings_off, run_scenarios, sensor_failures
from dzdesign.verify.closed_loop.stand_in import stand_in_of
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
MACHINE = Machine(
    drive="duty", coil_temperature_C=(-20.0, 80.0), bench_coil_C=25.0, supply_V=(18.0, 32.0), bench_supply_V=24.0,
    pressure_error_a_MPa=0.02, pressure_error_b_MPa=0.02, bench_pressure_error_MPa=0.02, pressure_offset_codes=15,
    pressure_gain_codes=30, pressure_noise_codes=4, oil_error=0.002, ageing_error=0.0, defaults={},
)  # fmt: skip


@pytest.fixture(scope="module")
def firmware(example_compensator, tmp_path_factory):
    folder = tmp_path_factory.mktemp("machine") / "fw"
    made = generate(example_compensator, "f28335")
    write_folder(folder, made.files, made.manifest)
    return folder


@pytest.fixture(scope="module")
def scenes(firmware, example_compensator):
    return scenes_of(firmware, example_compensator, None)


@pytest.fixture(scope="module")
def results(scenes):
    return [each for scene in (scenes[0], scenes[-1]) for each in run_scenarios(scene)]


# --- coil and supply ------------------------------------------------------------------------------------------------


def test_the_drive_at_each_corner_is_that_of_the_declared_machine_by_another_formula(example_compensator):
    """Two rooms, two formulas: `design` has the threshold's factor, `verify` the drive's ratio, its reciprocal."""
    compensator = replace(example_compensator, machine=MACHINE)
    found = {each.name: each.voltage_ratio / each.resistance_ratio for each in drive_corners(compensator)}
    assert len(found) == 6 and all(not each.not_required for each in drive_corners(compensator))
    for coil_C, supply_V, name in (
        (-20.0, 24.0, "coil at -20 °C"), (80.0, 24.0, "coil at 80 °C"), (25.0, 18.0, "supply voltage 18 V"),
        (25.0, 32.0, "supply voltage 32 V"), (-20.0, 32.0, "coil at -20 °C, supply voltage 32 V"),
        (80.0, 18.0, "coil at 80 °C, supply voltage 18 V"),
    ):  # fmt: skip
        assert found[name] == pytest.approx(1 / float(MACHINE.drive_factor(coil_C, supply_V)), rel=1e-12)
    aged = 1 - MACHINE.oil_error
    assert aged / max(found.values()) == pytest.approx(float(MACHINE.least_factor), rel=1e-12)


def test_a_machine_that_was_not_declared_is_shown_and_not_required(results):
    shown = {each.name: each for each in results if each.not_required == NOT_DECLARED and each.dp_MPa > 4}
    assert shown["coil 40 K colder"].q_zero_L_min > 3, "690 mV of a threshold of 5.0 V"
    assert shown["supply voltage 20% higher"].q_zero_L_min > 3
    opening = "dead_zone_on_opening_percent"
    hot, cold = (shown[f"coil {name}"].figures[opening] for name in ("60 K hotter", "40 K colder"))
    assert cold < 0.1 < 20 < hot


def test_a_stand_in_opens_where_its_threshold_divided_by_the_drive_lies(example_valve):
    stand_in = stand_in_of(example_valve.positive, 10.0)
    dp_MPa = example_valve.positive.tests[-1].dp_MPa
    command = np.linspace(0, 1, 4000)

    loop = ClosedLoop(stand_in)

    def opens(loop):
        run = loop.run(command, dp_MPa)
        return float(run.command[np.argmax(run.q_mean_L_min > 1.0)])

    usual = opens(loop)
    for ratio in (0.8, 1.25, 0.9 / 0.8):
        assert opens(loop.with_drive(ratio)) == pytest.approx(usual / ratio, abs=1e-3)


def test_the_amplifier_of_a_plant_of_equations_holds_most_of_it(firmware, example_compensator, example_folder):
    """By hand: 36 of 40 ohm are the feedback's, so that 40 K of 3.5 ohm are 1.4 % of the threshold and not 16 %."""
    plant = read_plant(example_folder / "plant.toml")
    ratio = resistance_ratio(-20.0, 20.0)
    cold = replace(plant, R_c_ohm=plant.R_c_ohm * ratio)
    assert cold.force_per_volt / plant.force_per_volt == pytest.approx(40 / (36 + 0.5 + 3.5 * ratio), rel=1e-12)
    scene = scenes_of(firmware, example_compensator, plant)[-1]
    (result,) = [each for each in run_scenarios(scene) if each.name == "coil 40 K colder"]
    assert 0.1 < result.q_zero_L_min < 0.5


# --- readings -------------------------------------------------------------------------------------------------------


def test_errors_of_the_converter_reach_the_core(firmware, example_compensator):
    """At a held command the drive is that of the codes read: offset and gain by hand, and the noise within its peak."""
    loop = ClosedLoop(stand_in_of(example_compensator.valve.positive, 10.0), firmware, example_compensator)
    # Zero first: the interlock waits for it.
    command, signals = np.repeat([0.0, 0.02], 100), example_compensator.signals
    right = [int(code) for code in loop.channels.pressure_codes(3.0, 1.0)]
    for errors in (
        ReadingErrors(offset_codes=(0.0, 40.0, 0.0)),
        ReadingErrors(gain_codes=(0.0, 0.0, 100.0)),
        ReadingErrors(offset_codes=(15.0, -40.0, 7.0), gain_codes=(0.0, 80.0, 0.0)),
    ):
        wrong = [
            int((code + 0.5) * (1 + gain / signals.code_max) + offset)
            for code, offset, gain in zip(right, errors.offset_codes[1:], errors.gain_codes[1:], strict=True)
        ]
        u_code = int(0.02 * 4096 + errors.offset_codes[0])
        dp_code = signals.difference(*wrong)
        run = loop.run(command, 3.0, "compensated", back_MPa=1.0, errors=errors, periods_per_record=2)
        near = [example_compensator.compare(u_code, dp_code + step) for step in (-1, 0, 1)]
        assert min(near) <= run.compare[-1] <= max(near)
    noisy = loop.run(command, 3.0, "compensated", errors=ReadingErrors(noise_codes=(0, 4, 0)), periods_per_record=2)
    found = {example_compensator.compare(81, signals.difference(*right) + step) for step in range(-5, 6)}
    seen = set(noisy.compare[105:].tolist())
    assert len(seen) > 5 and min(found) <= min(seen) <= max(seen) <= max(found)


def test_wrong_readings_cost_the_threshold_what_the_curve_says(example_compensator, scenes):
    """By how much sooner a valve may close until it flows: less by the certified offset's change over the error."""
    scene, converter = scenes[3], example_compensator.target.converter

    def room_V(place):
        low, high = 0.0, 0.1
        while high - low > 5e-4:
            middle = (low + high) / 2
            moved = replace(scene, loop=scene.loop.with_added_drive(middle))
            tight = list(readings_off(moved))[place].q_zero_L_min == 0.0
            low, high = (middle, high) if tight else (low, middle)
        return low

    signals = example_compensator.signals
    a, b = (int(code) for code in scene.loop.channels.pressure_codes(scene.dp_MPa, 1.0))
    expected = []
    for way in (-1, 1):
        wrong = [
            code + sense * (converter.offset_codes + round(converter.gain_codes * code / signals.code_max))
            for code, sense in ((a, way), (b, -way))
        ]
        offset_V = 10 * example_compensator.compare(0, signals.difference(*wrong)) / signals.compare_max
        expected.append(offset_V)
    assert expected[0] - expected[1] > 0.015
    assert room_V(1) - room_V(0) == pytest.approx(expected[0] - expected[1], abs=0.003)


# --- each sensor by itself, at each pressure behind the edge --------------------------------------------------------


def test_every_sensor_fails_at_every_pressure_behind_the_edge(results):
    broken = {(each.name, each.back_MPa) for each in results if each.name.startswith("sensor ")}
    for sensor in "AB":
        for what in ("breaks: its code is 0", "is shorted: its code is 4095"):
            assert {back for name, back in broken if name == f"sensor {sensor} {what}"} == {0.0, 1.0}
        assert any(name.startswith(f"sensor {sensor} is stuck") for name, _ in broken)


def test_a_broken_sensor_ahead_shows_with_a_live_zero_alone_where_the_port_is_at_the_tank(example_valve, tmp_path):
    """A back pressure of 1 MPa hid it: with the port at the tank the broken sensor reads as no pressure drop."""
    for signal in ("0..10 V x 0.3 = 20 MPa", "4..20 mA on 140 ohm = 20 MPa"):
        given = {"pressure_a": signal, "pressure_b": signal, "accept": "broken-sensor"}
        compensator = design(example_valve, options_of(given, target_named("f28335").inputs()))
        made = generate(compensator, "f28335")
        write_folder(tmp_path / signal[:1] / "fw", made.files, made.manifest)
        scene = scenes_of(tmp_path / signal[:1] / "fw", compensator, None)[-1]
        found = {each.back_MPa: each for each in sensor_failures(scene) if each.name.startswith("sensor A breaks")}
        assert found[1.0].must_shut and found[1.0].q_zero_L_min == 0
        shows = signal.startswith("4")
        assert found[0.0].must_shut == shows and (found[0.0].q_zero_L_min > 0.3) != shows


def test_a_core_that_takes_a_failed_sensor_for_sound_fails(firmware, example_compensator, tmp_path):
    """The seeded fault: every code is valid, and a difference far below zero is taken for no pressure drop."""
    core = tmp_path / "fw" / "core"
    core.mkdir(parents=True)
    for path in (firmware / "core").iterdir():
        text, seeded = path.read_text(), 0
        for limit, code in (("reverse", 5000 << 12), ("[ab]_low", 0), ("[ab]_high", 4095)):
            text, count = re.subn(rf"(\.{limit} =) [\w(]+\)?,", rf"\1 {code}u,", text)
            seeded += count
        assert (seeded > 2) == (path.name == "dz_valve.h")
        (core / path.name).write_text(text)
    scene = scenes_of(core.parent, example_compensator, None)[-1]
    failed = [each for each in sensor_failures(scene) if each.must_shut and each.q_zero_L_min > 0]
    assert {"sensor A breaks: its code is 0", "sensor B is shorted: its code is 4095"} <= {each.name for each in failed}


def test_a_pressure_behind_the_edge_beyond_the_sensors_is_refused_and_a_usual_one_lowered(
    example_valve, tmp_path, wording
):
    compensator = design(example_valve, options_of({"pressure_span": "5.4 MPa"}, target_named("f28335").inputs()))
    made = generate(compensator, "f28335")
    write_folder(tmp_path / "fw", made.files, made.manifest)
    with wording.refusal(InputError):
        scenes_of(tmp_path / "fw", compensator, None, [1.0])
    scene = scenes_of(tmp_path / "fw", compensator, None)[0]
    assert scene.back_MPa == pytest.approx(0.4, abs=1e-3)


# --- above the tests ------------------------------------------------------------------------------------------------


def test_above_the_tests_the_stand_in_goes_straight_on(example_valve):
    """The command where the flow begins, of a plant with one pressure drop after another."""
    stand_in = stand_in_of(example_valve.positive, 10.0)
    begins = [(test.dp_MPa, test.recorded.falling.u_V[1]) for test in example_valve.positive.tests]
    slope = np.polyfit(*np.array(begins).T, 1)[0]
    command = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, 0.3, 6000)])

    def closes(dp_MPa):
        run = ClosedLoop(stand_in).run(command, dp_MPa)
        return 10 * float(run.command[np.flatnonzero(run.q_mean_L_min > 1e-9)[-1]])

    last = begins[-1][0]
    assert closes(last) == pytest.approx(begins[-1][1], abs=0.01)
    for beyond in (1.0, 3.0, 5.0):
        assert closes(last + beyond) == pytest.approx(begins[-1][1] + slope * beyond, abs=0.02)


@pytest.mark.parametrize("above", ["hold", "lower", "release"])
def test_twice_the_tested_pressure_drop_is_required_unless_the_offset_is_held_there(example_valve, above, tmp_path):
    compensator = design(example_valve, options_of({"above": above}, target_named("f28335").inputs()))
    made = generate(compensator, "f28335")
    write_folder(tmp_path / "fw", made.files, made.manifest)
    scene = scenes_of(tmp_path / "fw", compensator, None)[-1]
    (found,) = [each for each in run_scenarios(scene) if each.name.startswith("dP above the tests, up to 10.00 MPa")]
    assert found.must_shut == (above != "hold") and (found.q_zero_L_min > 0.5) == (above == "hold")


def test_a_reset_at_full_command_waits_for_zero_with_the_interlock_alone(example_valve, results, tmp_path):
    (waits,) = [each for each in results if each.name.startswith("restart") and each.dp_MPa > 4]
    assert waits.must_shut and waits.q_zero_L_min == 0 and waits.figures["flow_after_zero_command_L_min"] > 20
    compensator = design(example_valve, options_of({"interlock": "off"}, target_named("f28335").inputs()))
    made = generate(compensator, "f28335")
    write_folder(tmp_path / "fw", made.files, made.manifest)
    scene = scenes_of(tmp_path / "fw", compensator, None)[-1]
    (follows,) = [each for each in run_scenarios(scene) if each.name.startswith("restart")]
    assert not follows.must_shut and follows.q_zero_L_min > 20
