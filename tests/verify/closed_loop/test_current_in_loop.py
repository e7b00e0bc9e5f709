"""The valve's closed loop with the current controller and its coil in it."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.project import generate
from dzdesign.codegen.writing import write_generated
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.verify.closed_loop.drive_corners import RELEASED, coil_and_supply
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.loop_checks import opens_with_any_coil
from dzdesign.verify.closed_loop.scene import scenes_of
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
