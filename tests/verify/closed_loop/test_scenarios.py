"""Scenarios: coil, supply, wrong readings, each sensor by itself, dP above the tests; what must be seen is seeded."""

import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.costs import hidden_failures
from dzdesign.design.machine import Machine
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED, coil_and_supply, drive_corners, resistance_ratio
from dzdesign.verify.closed_loop.loop import ClosedLoop, RampSequence, ReadingErrors
from dzdesign.verify.closed_loop.loop_checks import shut_after_scenarios
from dzdesign.verify.closed_loop.plant import read_plant
from dzdesign.verify.closed_loop.scenarios import readings_off, run_scenarios, sensor_failures
from dzdesign.verify.closed_loop.scene import NO_CORE_CAN_KNOW, SETTLE_S, STEP_S, scenes_of
from dzdesign.verify.closed_loop.stand_in import stand_in_of
from dzdesign.verify.requirements import ZERO_FLOW
from tests.support.designs import designed, written
from tests.support.evidence import verify
from tests.support.synthetic import Truth, needs_compiler, synthetic_ramp, with_side

pytestmark = needs_compiler
QUICK = RampSequence(rest=0.5, ramp=4.0, top=0.5)
MACHINE = Machine(
    drive="duty", coil_temperature_C=(-20.0, 80.0), bench_coil_C=25.0, supply_V=(18.0, 32.0), bench_supply_V=24.0,
    pressure_error_a_MPa=0.02, pressure_error_b_MPa=0.02, bench_pressure_error_MPa=0.02, pressure_offset_codes=15,
    pressure_gain_codes=30, pressure_noise_codes=4, oil_error=0.002, ageing_error=0.0, defaults={},
)  # fmt: skip


@pytest.fixture(scope="module")
def results(scenes):
    """Of the stand-in, at the lowest and the highest pressure drop."""
    return [each for scene in (scenes[0], scenes[-1]) for each in run_scenarios(scene)]


@pytest.fixture(scope="module")
def of_plant(plant_scenes):
    """Of the plant of equations at 1 MPa."""
    return {each.name: each for each in run_scenarios(plant_scenes[1])}


def beginning(results, name, dp_MPa=5.0):
    """The one result whose name begins so, at about this pressure drop."""
    (found,) = [each for each in results if each.name.startswith(name) and abs(each.dp_MPa - dp_MPa) < 0.3]
    return found


def scene_of(valve, folder, place=-1, **texts):
    compensator = designed(valve, **texts)
    return scenes_of(written(compensator, folder), compensator, None)[place]


# --- what a core can know, and what it can't ---


def test_the_valve_is_shut_after_everything_that_a_core_can_know(results, of_plant):
    for result in (*results, *of_plant.values()):
        assert result.q_zero_L_min == 0 or not result.must_shut or result.unseen_below_L_min, result.name
    (frozen,) = [result for name, result in of_plant.items() if "readings stuck" in name]
    assert not frozen.must_shut and frozen.q_zero_L_min > 0.3


def test_a_step_without_compensator_gives_no_flow_where_half_command_is_dead(of_plant):
    figures = of_plant["step to half command and back"].figures
    assert figures["direct_flow_L_min"] == 0 and 6 < figures["compensated_flow_L_min"] < 9
    assert 1 < figures["compensated_rise_ms"] < figures["compensated_settling_ms"] < 50


def test_a_load_step_may_open_the_valve_for_a_moment_and_never_for_good(plant_scenes, plant):
    """The pressure's fall of the threshold outruns the sampled sensor by a sample or two.

    The valve closes 20 mV lower than the example's, as at one ramp of many: that much the bound leaves it.
    """
    low = replace(plant, preload_N=plant.preload_N - 0.02 * plant.force_per_volt)
    scene = replace(plant_scenes[1], loop=plant_scenes[1].loop.with_plant(low))
    result = beginning(run_scenarios(scene), "load steps at zero command", 1.0)
    assert result.q_zero_L_min == 0 and 0 < result.q_peak_at_zero_L_min < 0.3
    assert 0 < result.figures["volume_mL"] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("given", [True, False], ids=["plant of equations", "stand-in"])
def test_verification_fails_where_a_law_over_compensates(example_compensator, plant, tmp_path, given):
    leaky = with_side(example_compensator, u_min0_over_u_max=Fraction(55, 100))
    found = verify(written(leaky, tmp_path / "fw"), plant if given else None, sequence=QUICK).evidence
    assert {"zero-flow", "zero-flow-after-scenarios"} <= {each.id for each in found.checks if each.holds is False}
    names = [each.name for each in found.scenarios]
    assert sum("load step" in name for name in names) == 2 * 6 and sum("readings stuck" in name for name in names) == 6


@pytest.mark.slow
def test_what_a_plant_file_leaves_out_is_named(tmp_path):
    (tmp_path / "p.toml").write_text("preload_N = 20.0")
    said = []
    assert read_plant(tmp_path / "p.toml", said.append).preload_N == 20.0
    assert "K_et_N_m" in said[0] and "preload_N" not in said[0]


# --- coil and supply ---


def test_the_drive_at_each_corner_is_that_of_the_declared_machine_by_another_formula(example_compensator):
    """`design` has the threshold's least factor, `verify` the drive's ratio at each corner, its reciprocal."""
    compensator = replace(example_compensator, machine=MACHINE)
    found = {each.name: each.voltage_ratio / each.resistance_ratio for each in drive_corners(compensator)}
    assert len(found) == 6 and all(not each.not_required for each in drive_corners(compensator))
    for coil_C, supply_V, name in (
        (-20.0, 24.0, "coil at -20 °C"), (80.0, 24.0, "coil at 80 °C"), (25.0, 18.0, "supply voltage 18 V"),
        (25.0, 32.0, "supply voltage 32 V"), (-20.0, 32.0, "coil at -20 °C, supply voltage 32 V"),
        (80.0, 18.0, "coil at 80 °C, supply voltage 18 V"),
    ):  # fmt: skip
        resistance = (1 + 0.00393 * (coil_C - 20)) / (1 + 0.00393 * (MACHINE.bench_coil_C - 20))
        assert found[name] == pytest.approx(supply_V / (resistance * MACHINE.bench_supply_V), rel=1e-12)
    aged = 1 - MACHINE.oil_error
    assert aged / max(found.values()) == pytest.approx(float(MACHINE.least_factor), rel=1e-12)


def test_a_machine_that_was_not_declared_is_shown_and_not_required(results):
    shown = {each.name: each for each in results if each.not_required == NOT_DECLARED and each.dp_MPa > 4}
    assert shown["coil 40 K colder"].q_zero_L_min > 3, "690 mV of a threshold of 5.0 V"
    assert shown["supply voltage 20% higher"].q_zero_L_min > 3
    opening = "dead_zone_on_opening_percent"
    hot, cold = (shown[f"coil {name}"].figures[opening] for name in ("60 K hotter", "40 K colder"))
    assert cold < 0.1 < 20 < hot


def test_a_stand_in_opens_where_its_threshold_divided_by_the_drive_lies(scenes):
    def opens(loop):
        run = loop.run(np.linspace(0, 1, 4000), scenes[-1].dp_MPa)
        return float(run.command[np.argmax(run.q_mean_L_min > 1.0)])

    loop = scenes[-1].loop
    for ratio in (0.8, 1.25, 0.9 / 0.8):
        assert opens(loop.with_drive(ratio)) == pytest.approx(opens(loop) / ratio, abs=1e-3)


def test_the_amplifier_of_a_plant_of_equations_holds_most_of_it(plant_scenes, plant):
    """By hand: 36 of 40 ohm are the feedback's, so that 40 K of 3.5 ohm are 1.4 % of the threshold and not 16 %."""
    ratio = resistance_ratio(-20.0, 20.0)
    cold = replace(plant, R_c_ohm=plant.R_c_ohm * ratio)
    assert cold.force_per_volt / plant.force_per_volt == pytest.approx(40 / (36 + 0.5 + 3.5 * ratio), rel=1e-12)
    found = {each.name: each for each in coil_and_supply(plant_scenes[-1])}
    assert 0.1 < found["coil 40 K colder"].q_zero_L_min < 0.5


# --- readings ---


def test_errors_of_the_converter_reach_the_core(scenes, example_compensator):
    """At a held command the drive is that of the codes read: offset and gain by hand, and the noise within its peak."""
    loop = scenes[0].loop
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
        dp_code = signals.pair(1).difference(*wrong)
        run = loop.run(command, 3.0, "compensated", back_MPa=1.0, errors=errors, periods_per_record=2)
        near = [example_compensator.compare(u_code, dp_code + step) for step in (-1, 0, 1)]
        assert min(near) <= run.compare[-1] <= max(near)
    noisy = loop.run(command, 3.0, "compensated", errors=ReadingErrors(noise_codes=(0, 4, 0)), periods_per_record=2)
    found = {example_compensator.compare(81, signals.pair(1).difference(*right) + step) for step in range(-5, 6)}
    seen = set(noisy.compare[105:].tolist())
    assert len(seen) > 5 and min(found) <= min(seen) <= max(seen) <= max(found)


def test_what_the_core_reads_is_what_the_sensors_show(plant_scenes):
    """Codes of both sensors, rounded down, without noise; those of a failing sensor as they are."""
    signals, command = plant_scenes[0].compensator.signals, RampSequence(rest=0.1, ramp=1.0, top=0.1).command()
    shown = np.full((command.size, 2), -1)
    shown[-50:, 0] = 7
    run = plant_scenes[0].loop.run(command, 2.0, "compensated", back_MPa=1.0, shown=shown, periods_per_record=2)
    before = np.concatenate([[2.0], run.dp_MPa])[:-1]
    for sensor, codes, pressure in (
        (signals.pressure_a, run.code_ahead[:-50], 1.0 + before[:-50]),
        (signals.pressure_b, run.code_behind, np.ones(command.size)),
    ):
        span = (sensor.full_code - sensor.zero_code + 1) / float(sensor.span_MPa)
        assert np.array_equal(codes, np.floor(sensor.zero_code + pressure * span + 1e-9))
    assert np.all(run.code_ahead[-50:] == 7)


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
        offset_V = 10 * example_compensator.compare(0, signals.pair(1).difference(*wrong)) / signals.compare_max
        expected.append(offset_V)
    assert expected[0] - expected[1] > 0.015
    assert room_V(1) - room_V(0) == pytest.approx(expected[0] - expected[1], abs=0.003)


# --- each sensor by itself, at each pressure behind the edge ---


def test_every_sensor_fails_at_every_pressure_behind_the_edge(results):
    broken = {(each.name, each.back_MPa) for each in results if each.name.startswith("sensor ")}
    for sensor in "AB":
        for what in ("breaks: its code is 0", "is shorted: its code is 4095"):
            assert {back for name, back in broken if name == f"sensor {sensor} {what}"} == {0.0, 1.0}
        assert any(name.startswith(f"sensor {sensor} is stuck") for name, _ in broken)


@pytest.mark.parametrize(
    ("signal", "shows"), [("0..10 V x 0.3 = 20 MPa", False), ("4..20 mA on 140 ohm = 20 MPa", True)]
)
def test_a_broken_sensor_ahead_shows_with_a_live_zero_alone_where_the_port_is_at_the_tank(
    example_valve, tmp_path, signal, shows
):
    """A back pressure of 1 MPa hid it: with the port at the tank the broken sensor reads as no pressure drop."""
    scene = scene_of(example_valve, tmp_path, pressure_a=signal, pressure_b=signal, accept="broken-sensor")
    found = {each.back_MPa: each for each in sensor_failures(scene) if each.name.startswith("sensor A breaks")}
    assert found[1.0].must_shut and found[1.0].q_zero_L_min == 0
    assert found[0.0].must_shut == shows and (found[0.0].q_zero_L_min > 0.3) != shows


def test_a_core_that_takes_a_failed_sensor_for_sound_fails(example_compensator, tmp_path):
    """The seeded fault: every code is valid, and a difference far below zero is taken for no pressure drop."""

    def seeded(text):
        for limit, code in (("reverse", 5000 << 12), ("low", 0), ("high", 4095)):
            text, count = re.subn(rf"(\.{limit} =) [\w(]+\)?,", rf"\1 {code}u,", text)
            assert count
        return text

    folder = written(example_compensator, tmp_path / "fw", edit=seeded, of="core/dz_valve.h")
    scene = scenes_of(folder, example_compensator, None)[-1]
    failed = [each for each in sensor_failures(scene) if each.must_shut and each.q_zero_L_min > 0]
    assert {"sensor A breaks: its code is 0", "sensor B is shorted: its code is 4095"} <= {each.name for each in failed}


def test_a_pressure_behind_the_edge_beyond_the_sensors_is_refused_and_a_usual_one_lowered(
    example_valve, tmp_path, wording
):
    scene = scene_of(example_valve, tmp_path / "fw", 0, pressure_span="5.4 MPa")
    assert scene.back_MPa == pytest.approx(0.4, abs=1e-3)
    with wording.refusal(InputError):
        scenes_of(tmp_path / "fw", scene.compensator, None, [1.0])


#: Two signals that hide a failure each, and one that shows both: 21 mA is 2.94 V of 3.
NO_LIVE_ZERO, NO_ROOM, BOTH = "0..10 V x 0.28 = 20 MPa", "4..20 mA on 150 ohm = 20 MPa", "4..20 mA on 140 ohm = 20 MPa"


@pytest.fixture(scope="module", params=[0.1, -0.1], ids=["rising", "falling"])
def trended(request):
    """A valve whose threshold grows, or falls, with the pressure drop."""
    ramps = [
        synthetic_ramp(dp, Truth(knee_rising=5.0 + request.param * dp), seed=seed)
        for seed, dp in enumerate((1.0, 3.0, 5.0))
    ]
    found = identify(ramps, IdentifyOptions(meter_lag=0.0))
    assert found.positive.trend == ("increasing" if request.param > 0 else "decreasing")
    return found


@pytest.mark.parametrize("signal", [NO_LIVE_ZERO, NO_ROOM, BOTH])
def test_a_failure_is_required_to_be_harmless_where_the_core_can_know_of_it(trended, signal, tmp_path):
    texts = {"pressure_a": signal, "pressure_b": signal, "accept": "broken-sensor", "above": "hold"}
    compensator = designed(trended, **texts)
    rising = trended.positive.trend == "increasing"
    everything = []
    for scene in scenes_of(written(compensator, tmp_path / "fw"), compensator, None):
        results = list(sensor_failures(scene))
        everything += results
        for result in results:
            assert result.q_zero_L_min == 0 or not result.must_shut, result
            assert result.must_shut or result.not_required == NO_CORE_CAN_KNOW
        unknown = {each.name.partition(":")[0] for each in results if not each.must_shut}
        # Each sensor by itself. With the port open to the tank B breaks and reads what it reads.
        opens = {"sensor B breaks"} if rising and signal == NO_LIVE_ZERO else set()
        opens |= {"sensor A is shorted"} if rising and signal == NO_ROOM else set()
        opens |= {"sensor A breaks"} if not rising and signal == NO_LIVE_ZERO else set()
        assert {name for name in unknown if "stuck" not in name} == opens
    # A reading at the converter's end is one of 20 MPa, where the signal has no room above.
    most = max(each.q_zero_L_min for each in everything if "A is shorted" in each.name)
    assert (most > 0.5) == (rising and signal == NO_ROOM)
    check = shut_after_scenarios(results, ZERO_FLOW.check(holds=True, text=""), AS_COMPUTED, plant_given=False)
    assert check.holds is True, check.text
    told = [line.partition(",")[0] for line in hidden_failures(compensator) if "pressure signal" in line or "," in line]
    hides = signal != BOTH if rising else signal == NO_LIVE_ZERO
    assert hides == bool(opens) == ("accepted" in told) == ("live zero" in "".join(check.not_required))


def test_an_offset_that_is_lowered_above_the_tests_shuts_at_a_reading_of_the_converters_end(trended, tmp_path):
    """20 MPa is four times the highest test: of a threshold that grows nothing is left of the offset there."""
    texts = {"pressure_a": NO_ROOM, "pressure_b": NO_ROOM, "accept": "broken-sensor", "above": "lower"}
    compensator = designed(trended, **texts)
    for scene in scenes_of(written(compensator, tmp_path / "fw"), compensator, None):
        shorted = [each for each in sensor_failures(scene) if "A is shorted" in each.name]
        assert len(shorted) == len(scene.backs_MPa)
        assert all(each.must_shut and each.q_zero_L_min == 0 for each in shorted)


# --- above the tests, after a reset, and what is waited for ---


def test_above_the_tests_the_stand_in_goes_straight_on(example_valve):
    """The command where the flow begins, of a plant with one pressure drop after another."""
    loop = ClosedLoop(stand_in_of(example_valve.positive, 10.0))
    begins = [(test.dp_MPa, test.recorded.falling.u_V[1]) for test in example_valve.positive.tests]
    slope = np.polyfit(*np.array(begins).T, 1)[0]
    command = np.concatenate([np.linspace(0, 1, 200), np.linspace(1, 0.3, 6000)])

    def closes(dp_MPa):
        run = loop.run(command, dp_MPa)
        return 10 * float(run.command[np.flatnonzero(run.q_mean_L_min > 1e-9)[-1]])

    last = begins[-1][0]
    assert closes(last) == pytest.approx(begins[-1][1], abs=0.01)
    for beyond in (1.0, 3.0, 5.0):
        assert closes(last + beyond) == pytest.approx(begins[-1][1] + slope * beyond, abs=0.02)


@pytest.mark.parametrize("above", ["hold", "lower", "release"])
def test_twice_the_tested_pressure_drop_is_required_unless_the_offset_is_held_there(example_valve, above, tmp_path):
    scene = scene_of(example_valve, tmp_path / "fw", above=above)
    found = beginning(run_scenarios(scene), "dP above the tests, up to 10.00 MPa")
    assert found.must_shut == (above != "hold") and (found.q_zero_L_min > 0.5) == (above == "hold")


def test_a_reset_at_full_command_waits_for_zero_with_the_interlock_alone(example_valve, results, tmp_path):
    waits = beginning(results, "restart")
    assert waits.must_shut and waits.q_zero_L_min == 0 and waits.figures["flow_after_zero_command_L_min"] > 20
    follows = beginning(run_scenarios(scene_of(example_valve, tmp_path / "fw", interlock="off")), "restart")
    assert not follows.must_shut and follows.q_zero_L_min > 20


def test_ramps_of_the_firmware_are_waited_for(scenes):
    loop = scenes[0].loop.with_drive(1.0)
    loop.slowest_ramp_s = 3.0
    assert replace(scenes[0], loop=loop).held(0).size == round((3.0 + SETTLE_S) / STEP_S)


@pytest.mark.parametrize(("debounce", "waited"), [("5 samples", 0), ("2 s", 2490)])
def test_scenarios_open_after_a_long_debounce(example_valve, debounce, waited, tmp_path):
    """A debounce that outlasts the start of a ramp: the closed loop waits with the interlock, and then opens."""
    scene = scene_of(example_valve, tmp_path / "fw", 0, fault_debounce=debounce)
    samples = scene.compensator.drive_functions.fault_samples
    assert scene.waited().size == pytest.approx(waited, abs=5) and scene.loop.waits_s == samples / 1250
    run = scene.run(scene.opened_and_closed())
    assert run.q_mean_L_min.max() > 5.0, "it opens"
    sequence = RampSequence(rest=0.5, ramp=2.0, top=0.5).for_drive(scene.loop)
    assert sequence.rest == max(0.5, samples / 1250)
    # Seeded: without the wait the drive never follows.
    if waited:
        early = scene.run(np.concatenate([np.linspace(0, 1, 2500), scene.held(1)]))
        assert early.q_mean_L_min.max() == 0.0
