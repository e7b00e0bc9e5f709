"""The closed loop with drive functions: what its residual and its flow at zero command mean then."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from dzdesign.design.designing import design
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.ramps import compare_at_pressure
from dzdesign.verify.closed_loop.scene import scenes_of
from tests.support.designs import written
from tests.support.golden_firmware import FULL, full_options, golden_valve
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
QUICK = RampSequence(rest=1.0, ramp=20.0, top=0.5)
NO_RAMPS = {"ramp_up_s": (0.0, 0.0), "ramp_down_s": (0.0, 0.0)}
NO_DITHER = {"dither_Hz": 0.0, "dither_peak": Fraction(0)}


def compared(folder, side: int = 1, change=lambda compensator: compensator, **options):
    """The scene and its comparison at 3 MPa, of a compensator with these options instead of everything."""
    compensator = change(design(golden_valve(FULL), full_options(**options)))
    scenes = scenes_of(written(compensator, folder), compensator, None, [1.0])
    (scene,) = [each for each in scenes if each.sign == side and abs(each.dp_MPa - 3) < 0.1]
    return scene, compare_at_pressure(scene, QUICK)


@pytest.mark.slow
@pytest.mark.parametrize("side", [1, -1])
def test_ramps_far_slower_than_the_command_change_none_of_the_results(tmp_path, side):
    """60 s ramps, a command of 20 s: it waits for them, and residual and zero flow stay what they were."""
    _, plain = compared(tmp_path / "plain", side, **NO_RAMPS)
    scene, slow = compared(tmp_path / "slow", side, ramp_up_s=(60.0, 60.0), ramp_down_s=(60.0, 60.0))
    assert 60 <= scene.loop.slowest_ramp_s <= 70
    assert slow.result.q_zero_L_min == plain.result.q_zero_L_min == 0
    assert slow.result.q_max_L_min == pytest.approx(plain.result.q_max_L_min, rel=1e-3)
    for name in ("residual_opening", "residual_closing"):
        # The quicker command lags by the coil and the mass: some thousandths of it.
        assert getattr(slow.result, name) == pytest.approx(getattr(plain.result, name), abs=4e-3)
    # Without waiting the ramps' lag would be read as dead zone.
    scene.loop.slowest_ramp_s = 0.0
    hasty = compare_at_pressure(scene, QUICK)
    assert hasty.result.q_max_L_min < 0.7 * slow.result.q_max_L_min
    assert hasty.result.residual_opening > slow.result.residual_opening + 0.005
    assert hasty.result.q_zero_L_min > 0.5, "zero command, and the ramp is still on its way there"


@pytest.mark.slow
def test_a_dither_that_the_certificate_does_not_count_is_seen_at_the_waves_top(tmp_path):
    """Seeded: ten per cent of dither on an offset that was certified without. Flow passes at the wave's top only."""

    def uncounted(compensator):
        functions = replace(compensator.drive_functions, dither_counts=6000, dither_ticks=12)
        return replace(compensator, drive_functions=functions)

    _, counted = compared(tmp_path / "counted", dither_Hz=104.0, dither_peak=Fraction(10, 100))
    assert counted.result.q_zero_L_min == 0
    _, leaking = compared(tmp_path / "leaking", change=uncounted, **NO_DITHER)
    assert leaking.result.q_zero_L_min > 1e-3
    ends = leaking.compensated.q_L_min[-25:]
    assert leaking.result.q_zero_L_min >= ends.max() - 1e-9  # stored to nine decimals


@pytest.mark.slow
def test_a_record_holds_a_whole_wave_of_any_dither(tmp_path):
    """The mean and the largest of a record settle, whatever the wave's place at the record's end."""
    loop = compared(tmp_path / "dither", dither_Hz=104.0)[0].loop
    # Zero command first, for which the interlock waits.
    run = loop.run(np.concatenate([np.zeros(50), np.full(400, 0.5)]), 3.0, "compensated")
    settled = slice(350, None)
    assert loop.waits_s < 0.5 and run.q_mean_L_min[-1] > 1
    assert np.ptp(run.q_mean_L_min[settled]) < 0.02 * run.q_mean_L_min[-1]
    assert np.all(run.q_largest_L_min[settled] >= run.q_mean_L_min[settled])
