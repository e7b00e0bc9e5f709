"""Zero band, inverse play, ramps and dither in the closed loop: what they promise, and what a residual means then."""

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from dzdesign.design.designing import design
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.ramps import compare_at_pressure
from dzdesign.verify.closed_loop.scenarios import converter_off_at_zero, run_scenarios
from dzdesign.verify.closed_loop.scene import scenes_of
from tests.support.designs import designed, replaced, written
from tests.support.golden_firmware import FULL, full_options, golden_valve
from tests.support.synthetic import needs_compiler

pytestmark = [needs_compiler, pytest.mark.slow]

#: Loops within loops: full, half, and small ones, back to zero at the end.
CORNERS = (0, 1, 0, 0.5, 0.4, 0.5, 0.3, 0.35, 0.1, 0.2, 0)
RECORDS = 10_000  # of a ramp over the whole command


@pytest.fixture(scope="module")
def made(example_valve, plant, tmp_path_factory):
    """Compensator and scenes of the hysteresis that is kept, and of the play."""
    found = {}
    for name in ("keep", "play"):
        compensator = designed(example_valve, hysteresis=name)
        folder = written(compensator, tmp_path_factory.mktemp("play") / name)
        found[name] = compensator, scenes_of(folder, compensator, plant)
    return found


def widest(scene, corners=CORNERS):
    """The largest distance of neighbouring branches over the command, from 5 % to 100 % of flow, and the last flow."""
    parts = [np.linspace(a, b, round(abs(b - a) * RECORDS)) for a, b in pairwise(corners)]
    run = scene.loop.run(np.concatenate([*parts, np.zeros(100)]), scene.dp_MPa, "compensated")
    ends = np.cumsum([0, *(part.size for part in parts)])
    branches = [(run.command[a:b], run.q_mean_L_min[a:b]) for a, b in pairwise(ends)]
    found = []
    for (u, q), (other_u, other_q) in pairwise(branches):
        low = max(q.min(), other_q.min(), 0.05 * run.q_mean_L_min.max())
        flows = np.linspace(low, min(q.max(), other_q.max()), 400)[1:-1]
        if flows[-1] > flows[0]:
            at, other_at = (np.interp(flows, *sorted_by_flow(each)) for each in ((u, q), (other_u, other_q)))
            found.append(np.abs(at - other_at).max())
    return max(found), run.q_largest_L_min[-1]


def sorted_by_flow(branch):
    u, q = branch
    order = np.argsort(q, kind="stable")
    return q[order], u[order]


def test_the_play_takes_the_hysteresis_out_and_nothing_flows_at_zero(made):
    for name, least, most in (("keep", 0.03, 0.05), ("play", 0.0, 0.005)):
        for scene in made[name][1]:
            width, last = widest(scene)
            assert least <= width <= most and last == 0.0, (name, scene.dp_MPa, width)


def test_a_valve_of_less_hysteresis_at_a_slower_ramp_is_inverted_too_far(made):
    for scene in made["play"][1]:
        found = next(each for each in run_scenarios(scene) if "of which the play takes out all" in each.name)
        assert -0.025 < found.figures["hysteresis_percent"] / 100 < -0.01 and found.q_zero_L_min == 0.0


@pytest.mark.parametrize("times", [0.5, 2.0])
def test_a_wrong_play_makes_no_flow_at_zero(made, plant, tmp_path, times):
    """Half and double of the width that the firmware counts on, in what it has and in the valve that it drives."""
    right, _ = made["play"]
    nodes = tuple(round(times * count) for count in right.drive_functions.play_counts[0])
    wrong = replace(right, drive_functions=replace(right.drive_functions, play_counts=(nodes, ())))
    scenes = scenes_of(written(wrong, tmp_path / "wrong"), wrong, plant)
    for scene in scenes:
        assert widest(scene)[1] == 0.0
    for scene in (scenes[0], scenes[-1]):
        for result in run_scenarios(scene):
            assert not result.must_shut or result.q_zero_L_min == 0.0, result.name


def test_noise_on_a_standing_command_does_not_chatter(made):
    rng = np.random.default_rng(3)
    for code in (60, 300, 1500, 3000):
        for before in (0.0, 1.0):  # come from below, and from above
            # Zero command first, for which the interlock waits.
            ends = np.concatenate([np.zeros(500), np.linspace(4095 * before, code, 2000).round()])
            codes = np.concatenate([ends, code + rng.integers(-4, 5, 6000)])
            rms = {}
            for name in made:
                scene = made[name][1][3]
                command = scene.loop.channels.command_of_codes(codes)
                run = scene.loop.run(command, scene.dp_MPa, "compensated", periods_per_record=2)
                rms[name] = run.compare[4500:].std()
            assert 0 < rms["play"] <= 2 * rms["keep"], (code, before, rms)


def test_a_core_without_its_zero_band_is_seen_by_the_zero_command_that_is_read_too_high(made, plant, tmp_path):
    """The seeded fault: the band is one code wide, and the drive leaves its rest at once."""
    compensator, right = made["keep"]
    edit = replaced(
        (".zero_band = 19u", ".zero_band = 1u"), (".leave_zero = 24u", ".leave_zero = 2u"),
        (".band_end = 19u", ".band_end = 1u"),
    )  # fmt: skip
    wrong = scenes_of(written(compensator, tmp_path, edit=edit, of="core/dz_valve.h"), compensator, plant)
    leaks = []
    for scenes in (right, wrong):
        results = [each for scene in scenes for each in converter_off_at_zero(scene) if "codes too high" in each.name]
        assert len(results) == len(scenes) and all(each.must_shut for each in results)
        leaks.append(max(each.q_zero_L_min for each in results))
    assert leaks[0] == 0.0 < leaks[1]


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
