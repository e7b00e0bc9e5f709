"""The valve's closed loop with the current controller and its coil, and with all tolerances of a machine at once."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.project import generate
from dzdesign.codegen.writing import write_generated
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.verify.closed_loop import declared_machine
from dzdesign.verify.closed_loop.declared_machine import all_at_the_worst, closing_V
from dzdesign.verify.closed_loop.drive_corners import RELEASED, coil_and_supply
from dzdesign.verify.closed_loop.loop import NO_FLOW_L_MIN, RampSequence
from dzdesign.verify.closed_loop.loop_checks import opens_with_any_coil
from dzdesign.verify.closed_loop.scenarios import run_scenarios
from dzdesign.verify.closed_loop.scene import scenes_of
from dzdesign.verify.exhaustive.zero_command import bound_at, guarded_bounds
from tests.support.designs import CURRENT, MEASURED, designed, replaced, written
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler

#: A machine without errors of its own: the offset lies right below the band, so that nothing hides an overshoot.
ACCURATE = {
    "current_error": "0.01 %", "bench_current": "1 A +- 0.01 %", "oil": "0.01 %", "ageing": "0.01 %",
    "pressure_error": "0.01 %", "bench_pressure_error": "0.001 MPa", "pressure_converter": "0 + 0 + 0 codes",
}  # fmt: skip
QUICK = RampSequence(rest=0.5, ramp=10.0, top=0.5)


def scenes_at_ends(valve, texts, folder, plant=None, edit=str):
    """The scenes at the lowest and the highest pressure drop."""
    compensator = designed(valve, "cortex-m4", **texts)
    of = "core/dz_current.c" if "drive" in texts else ""
    found = scenes_of(written(compensator, folder, "cortex-m4", edit, of), compensator, plant)
    return found[0], found[-1]


@pytest.fixture(scope="module", params=["stand-in", "plant of equations"])
def controlled(request, example_valve, plant, tmp_path_factory):
    given = plant if request.param == "plant of equations" else None
    return scenes_at_ends(example_valve, CURRENT, tmp_path_factory.mktemp("current") / "fw", given)


def test_at_rest_a_current_does_what_the_drive_did_on_the_bench(controlled):
    """Full drive is the rated current as it was the amplifier's: the law's output, given directly, makes that flow."""
    for scene in controlled:
        run = scene.loop.run(QUICK.command(), scene.dp_MPa, "compensated")
        direct = scene.loop.run(run.compare / 60000, scene.dp_MPa)
        largest = direct.q_mean_L_min.max()
        # The coil of 10 ms lags behind the amplifier's of 1 ms, which follows a record of 10 ms too early.
        assert np.abs(run.q_mean_L_min - direct.q_mean_L_min).max() < 0.01 * largest
        assert run.q_mean_L_min.max() == pytest.approx(largest, rel=2e-3)


def at_every_coil(scenes):
    found = [each for scene in scenes for each in coil_and_supply(scene) if RELEASED in each.figures]
    return found, opens_with_any_coil(found, AS_COMPUTED)


def test_coil_and_supply_do_not_move_the_opening(controlled):
    found, check = at_every_coil(controlled)
    assert check.holds, check.text
    assert len(found) == 2 * 9
    for dp_MPa in {each.dp_MPa for each in found}:
        openings = [each.figures["dead_zone_on_opening_percent"] for each in found if each.dp_MPa == dp_MPa]
        assert np.ptp(openings) <= 0.1
    if controlled[0].loop.stand_in:  # a flow that no recording shows is no zero
        assert found[0].unseen_below_L_min > 0.1 and "below" in check.text
        flows = [replace(found[0], q_zero_L_min=0.1), replace(found[0], figures=found[0].figures | {RELEASED: 0.1})]
        assert all(opens_with_any_coil([each, *found], AS_COMPUTED).holds is False for each in flows)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("* numbers->integral)", "* 0u)"),
        ("current = ((above * numbers->current_gain)", "current = ((above * (numbers->current_gain - 2700u))"),
    ],
    ids=["no integral", "a current read 6 % too low"],
)
def test_a_controller_that_lets_the_current_go_is_seen(right, wrong, example_valve, tmp_path):
    """Without an integral the opening moves with the coil; with too low a reading the valve stays open at zero."""
    faulty = scenes_at_ends(example_valve, CURRENT, tmp_path / "fw", edit=replaced((right, wrong)))
    assert at_every_coil(faulty)[1].holds is False


def test_a_controller_that_begins_at_its_integral_opens_the_valve_as_it_is_released(example_valve, tmp_path):
    """From zero the current went past the set point, and past the opening threshold just above it, for 40 ms."""
    right, wrong = (
        at_every_coil(scenes_at_ends(example_valve, MEASURED | ACCURATE, tmp_path / name, edit=each)[1:])
        for name, each in (("right", str), ("wrong", replaced((" - numbers->release;", ";"))))
    )
    flows = [max(each.figures[RELEASED] for each in found) for found, _ in (right, wrong)]
    assert flows[0] == 0.0 and flows[1] > 1e-3
    assert right[1].holds is True and wrong[1].holds is False


def test_the_loop_of_a_block_is_that_of_fixed_numbers(example_valve, tmp_path):
    """Of a controller in block form the same ramp is driven."""
    compensator, drives = designed(example_valve, "cortex-m4", **MEASURED), []
    for form in ("fixed", "block"):
        write_generated(generate(compensator, "cortex-m4", form), tmp_path / form)
        scene = scenes_of(tmp_path / form, compensator, None)[0]
        drives.append(scene.loop.run(QUICK.command(), scene.dp_MPa, "compensated").compare)
    assert np.array_equal(*drives) and drives[0].any()


def test_a_drive_by_duty_has_no_coil(scenes):
    assert scenes[0].loop.coil is None
    with pytest.raises(InputError, match="duty"):
        scenes[0].loop.with_coil(supply_V=18.0)


#: A coil on the bench at 20 °C and a supply of 24 V; and an amplifier, with nothing else than what a case is about.
DUTY = {"coil_temperature": "-20..80 degC", "supply": "18..32 V", "bench_supply": "24 V"}
LITTLE = {
    "amplifier": "1 %", "pressure_error": "0 %", "bench_pressure_error": "0 MPa", "oil": "0 %", "ageing": "0 %",
    "pressure_converter": "0 + 0 + 1 codes",
}  # fmt: skip
#: Component -> what is declared, and a tenth of it. Sensors and converter are declared so coarse that a tenth of them
#: shows beside what the table of beta leaves unused, some millivolts.
TOO_SMALL = {
    "coil temperature": (DUTY, {"coil_temperature": "16..26 degC"}),
    "supply": (DUTY, {"supply": "23.4..24.8 V"}),
    "current": (LITTLE, {"amplifier": "0.1 %"}),
    "pressure sensor A": (LITTLE | {"pressure_error": "2 % / 0 %"}, {"pressure_error": "0.2 % / 0 %"}),
    "pressure sensor B": (LITTLE | {"pressure_error": "0 % / 2 %"}, {"pressure_error": "0 % / 0.2 %"}),
    "bench pressure drop": (LITTLE | {"bench_pressure_error": "0.4 MPa"}, {"bench_pressure_error": "0.04 MPa"}),
    "offset of the converter": (
        LITTLE | {"pressure_converter": "60 + 0 + 1 codes"}, {"pressure_converter": "6 + 0 + 1 codes"},
    ),
    "gain of the converter": (
        LITTLE | {"pressure_converter": "0 + 300 + 1 codes"}, {"pressure_converter": "0 + 30 + 1 codes"},
    ),
    "oil": (LITTLE | {"oil": "1 %"}, {"oil": "0.1 %"}),
    "ageing": (LITTLE | {"ageing": "1 %"}, {"ageing": "0.1 %"}),
}  # fmt: skip


def largest(scenes):
    """The largest flow at zero command of all scenes beyond what is allowed."""
    found = [each for scene in scenes for each in all_at_the_worst(scene)]
    assert len(found) == len(scenes) and all(each.must_shut for each in found)
    assert min(each.figures["largest_flow_L_min"] for each in found) > 1, "it opens"
    return max(each.q_beyond_L_min for each in found)


def right_and_wrong(valve, folder, true, wrong, plant=None, change=lambda valve: valve):
    """The machine of the true budget with its firmware, and with one that was designed for a wrong budget."""
    right, short = designed(valve, **true), designed(change(valve), **(true | wrong))
    # What is tried, and what the thresholds are bounded by, is that of the true budget.
    laws = {"true": right, "wrong": replace(short, machine=right.machine, valve=right.valve)}
    firmware = {"true": right, "wrong": short}
    return [largest(scenes_of(written(firmware[name], folder / name), law, plant)) for name, law in laws.items()]


@pytest.mark.slow
@pytest.mark.parametrize("component", TOO_SMALL)
def test_a_component_ten_times_too_small_is_caught(example_valve, tmp_path, component):
    right, wrong = right_and_wrong(example_valve, tmp_path, *TOO_SMALL[component])
    assert right <= NO_FLOW_L_MIN < wrong


def called_ten_times_better(valve):
    """Return a valve whose certified bound is moved up by nine tenths of its least distance to the threshold."""
    curve = valve.positive.certified["closing"]
    by = 0.9 * min(u - low for u, low in zip(curve.u_threshold_V, curve.u_lower_V, strict=True))
    above = curve.above and replace(curve.above, u_lower_V=tuple(low + by for low in curve.above.u_lower_V))
    proof = replace(curve.proof, ramps=tuple(replace(ramp, u_V=ramp.u_V + by) for ramp in curve.proof.ramps))
    moved = replace(
        curve, above=above, proof=proof, u_lower_V=tuple(low + by for low in curve.u_lower_V),
        bound_V=tuple(low + by for low in curve.bound_V), offset_V=tuple(low + by for low in curve.offset_V),
        u_min0_V=curve.u_min0_V + by,
    )  # fmt: skip
    certified = {**valve.positive.certified, "closing": moved}
    tests = tuple(replace(each, u_guard_lower_V=each.u_guard_lower_V + by) for each in valve.positive.tests)
    return replace(valve, sides={"positive": replace(valve.positive, certified=certified, tests=tests)})


def test_a_recording_that_is_called_ten_times_too_good_is_caught(example_valve, tmp_path):
    right, wrong = right_and_wrong(example_valve, tmp_path, LITTLE, {}, change=called_ten_times_better)
    assert right <= NO_FLOW_L_MIN < wrong


def test_a_plant_of_equations_is_taken_to_its_bound_too(example_valve, plant, tmp_path):
    right, wrong = right_and_wrong(
        example_valve, tmp_path, LITTLE | {"amplifier": "2 %"}, {"amplifier": "0.2 %"}, plant
    )
    assert right <= NO_FLOW_L_MIN < wrong


def test_a_current_that_the_firmware_controls_stays_shut_at_its_worst(example_valve, tmp_path):
    compensator = designed(example_valve, "cortex-m4", **CURRENT)
    assert largest(scenes_of(written(compensator, tmp_path, "cortex-m4"), compensator, None)[:1]) <= NO_FLOW_L_MIN


def test_the_worst_is_near_the_edge(example_valve, tmp_path, monkeypatch):
    """25 mV of the valve more than the budget has, and it flows."""
    compensator = designed(example_valve, **LITTLE | {"amplifier": "1 %"})
    scene = scenes_of(written(compensator, tmp_path), compensator, None)[-1]
    assert largest([scene]) <= NO_FLOW_L_MIN
    monkeypatch.setattr(declared_machine, "bound_at", lambda *given: bound_at(*given) - 0.025)
    assert largest([scene]) > NO_FLOW_L_MIN


def test_the_thresholds_are_those_of_the_valve(scenes):
    for scene, test, bound in zip(
        scenes, scenes[0].identified.tests, scenes[0].identified.certified["closing"].u_lower_V, strict=True
    ):
        assert bound_at(guarded_bounds(scene.compensator, 1), scene.dp_MPa) == pytest.approx(bound, abs=1e-9)
        assert bound < closing_V(scene) == pytest.approx(test.recorded.falling.u_V[1], abs=2e-3)


def test_a_machine_that_was_not_declared_has_no_worst(scenes):
    assert scenes[0].compensator.machine is None and list(all_at_the_worst(scenes[0])) == []


def test_it_is_a_required_scenario(example_valve, tmp_path):
    compensator = designed(example_valve, **DUTY)
    scene = scenes_of(written(compensator, tmp_path), compensator, None)[-1]
    (found,) = [each for each in run_scenarios(scene) if each.name.startswith("all tolerances")]
    assert found.must_shut and found.q_beyond_L_min <= NO_FLOW_L_MIN


def test_a_drive_is_that_of_a_plant_with_another_voltage(scenes, plant_scenes, plant):
    """The numbers of a plant multiplied, against those made of another plant."""
    command = RampSequence(rest=0.2, ramp=3.0, top=0.3).command()
    for loop in (plant_scenes[0].loop, scenes[0].loop):
        scaled = loop.with_drive(1.21).run(command, 2.0)
        if not loop.stand_in:
            made = loop.with_plant(replace(plant, u_max_V=12.1)).run(command, 2.0)
            assert np.abs(scaled.q_L_min - made.q_L_min).max() < 1e-9
        usual = loop.run(np.minimum(1.21 * command, 1.0), 2.0)
        assert np.abs(scaled.q_mean_L_min - usual.q_mean_L_min)[command < 0.8].max() < 0.05
