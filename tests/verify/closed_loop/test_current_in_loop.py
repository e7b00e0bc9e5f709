"""The valve's closed loop with the current controller and its coil in it."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.codegen.project import generate, target_named
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.example import example_folder
from dzdesign.verify.closed_loop.drive_corners import valve_at_corners, valve_at_corners_check
from dzdesign.verify.closed_loop.firmware_loop import scenes_of
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.plant import read_plant
from tests.codegen.test_current_control import MEASURED, TEXTS
from tests.support.example_coil import COIL
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
#: A machine without errors of its own: the offset lies right below the band, so that nothing hides an overshoot.
ACCURATE = {
    "current_error": "0.01 %", "bench_current": "1 A +- 0.01 %", "oil": "0.01 %", "ageing": "0.01 %",
    "pressure_error": "0.01 %", "bench_pressure_error": "0.001 MPa", "pressure_converter": "0 + 0 + 0 codes",
}  # fmt: skip
QUICK = RampSequence(rest=0.5, ramp=10.0, top=0.5)


def scenes(valve, texts, folder, plant=None, edit=lambda text: text):
    """The scenes at the lowest and the highest pressure drop."""
    compensator = design(valve, options_of(texts, target_named("cortex-m4").inputs()))
    firmware = generate(compensator, "cortex-m4")
    write_folder(folder, firmware.files, firmware.manifest)
    if (source := folder / "core" / "dz_current.c").is_file():
        source.write_text(edit(source.read_text()))
    found = scenes_of(folder, compensator, plant)
    return found[0], found[-1]


@pytest.fixture(scope="module", params=["stand-in", "plant of equations"])
def plant(request):
    return None if request.param == "stand-in" else read_plant(example_folder() / "plant.toml")


def test_at_rest_a_current_does_what_the_drive_did_on_the_bench(example_valve, plant, tmp_path):
    """Full drive is the rated current as it was the amplifier's: the law's output, given directly, makes that flow."""
    for scene in scenes(example_valve, TEXTS, tmp_path / "fw", plant):
        controlled = scene.loop.run(QUICK.command(), scene.dp_MPa, "compensated")
        direct = scene.loop.run(controlled.compare / 60000, scene.dp_MPa)
        largest = direct.q_mean_L_min.max()
        # The coil of 10 ms lags behind the amplifier's of 1 ms, which follows a record of 10 ms too early.
        assert np.abs(controlled.q_mean_L_min - direct.q_mean_L_min).max() < 0.01 * largest
        assert controlled.q_mean_L_min.max() == pytest.approx(largest, rel=2e-3)


def test_coil_and_supply_do_not_move_the_opening(example_valve, plant, tmp_path):
    found = [valve_at_corners(scene, COIL) for scene in scenes(example_valve, TEXTS, tmp_path / "fw", plant)]
    check = valve_at_corners_check(found, AS_COMPUTED)
    assert check.holds, check.text
    assert all(each.runs == 9 for each in found)
    assert max(each.opening_largest - each.opening_least for each in found) <= 0.001


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

    def edit(text: str) -> str:
        assert text.count(right) == 1
        return text.replace(right, wrong)

    found = [valve_at_corners(scene, COIL) for scene in scenes(example_valve, TEXTS, tmp_path / "fw", edit=edit)]
    assert valve_at_corners_check(found, AS_COMPUTED).holds is False


def test_a_controller_that_begins_at_its_integral_opens_the_valve_as_it_is_released(example_valve, tmp_path):
    """From zero the current went past the set point, and past the opening threshold just above it, for 40 ms."""

    def edit(text: str) -> str:
        assert text.count(" - numbers->release;") == 1
        return text.replace(" - numbers->release;", ";")

    right, wrong = (
        valve_at_corners(scenes(example_valve, MEASURED | ACCURATE, tmp_path / name, edit=each)[1], COIL)
        for name, each in (("right", str), ("wrong", edit))
    )
    assert wrong.q_released_L_min > 1e-3 and right.q_released_L_min == wrong.q_zero_L_min == 0
    assert valve_at_corners_check([right], AS_COMPUTED).holds is True
    assert valve_at_corners_check([right, wrong], AS_COMPUTED).holds is False


def test_a_flow_that_no_recording_shows_is_no_zero(example_valve, tmp_path):
    scene = scenes(example_valve, TEXTS, tmp_path / "fw")[0]
    found = valve_at_corners(scene, COIL)
    assert found.unseen_below_L_min > 0.1
    text = valve_at_corners_check([replace(found, q_zero_L_min=0.1)], AS_COMPUTED)
    assert text.holds is False
    assert "below" in valve_at_corners_check([found], AS_COMPUTED).text


def test_a_drive_by_duty_has_no_coil(example_valve, tmp_path):
    scene = scenes(example_valve, {}, tmp_path / "fw")[0]
    assert not scene.loop.controls_current
    with pytest.raises(InputError, match="duty"):
        scene.loop.with_coil(supply_V=18.0)
