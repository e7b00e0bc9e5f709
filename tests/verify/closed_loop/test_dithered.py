"""Ramps recorded under a dither: the loop of the plant that feels it in time, and what stands in for the valve."""

from dataclasses import replace
from pathlib import Path

import dithered_valve
import numpy as np
import pytest
from dithered_valve import VALVES, driven, driven_loop, library, ramp_recording, widest
from msgspec import UNSET

from dzdesign.api import identify
from dzdesign.core.dither import Dither
from dzdesign.core.errors import InputError
from dzdesign.design.costs_at_tests import LEVELS
from dzdesign.design.redesign import hysteresis_choices, hysteresis_left
from dzdesign.verify.closed_loop.loop import ClosedLoop
from dzdesign.verify.closed_loop.plant import Plant, read_plant
from dzdesign.verify.closed_loop.scenarios import run_scenarios
from dzdesign.verify.closed_loop.scene import scenes_of
from dzdesign.verify.closed_loop.simulated_recordings import Bench, simulated_files
from tests.support.designs import designed, written
from tests.support.synthetic import needs_compiler

pytestmark = [needs_compiler, pytest.mark.slow]
PRESSURES = (1.0, 3.0, 5.0)
#: The dither that takes a valve's hysteresis out, and what is given beside it where some is left.
DITHERS = {"example": ("150 Hz 1 %", {}), "A": ("150 Hz 2 %", {}), "E": ("150 Hz 1 %", {"hysteresis": "play"})}


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Valves as identified from ramps of the independent plant, with and without a dither; each made once."""
    folder, known = tmp_path_factory.mktemp("bench"), {}
    plant = library(folder)

    def made(name, dither=None):
        if (name, dither) not in known:
            files = []
            for dp in PRESSURES:
                peak = 0.1 * float(dither.split()[-2]) if dither else 0.0
                files.append(folder / f"{name}_{peak}_{dp}.csv")
                dithered_valve.written(
                    ramp_recording(plant, VALVES[name], dp, round(dp), peak_V=peak, frequency_Hz=150, ramp_s=30),
                    files[-1],
                )
            given = {"dithered": dither} if dither else {}
            known[name, dither] = identify(files, meter_lag="0.1 s", repeatability="0.05 %", **given)
        return known[name, dither]

    return made


def loops(compensator, name, folder):
    plant = library(folder.parent, written(compensator, folder))
    return [driven_loop(plant, VALVES[name], dp) for dp in PRESSURES]


@pytest.mark.parametrize("name", DITHERS)
def test_the_dither_takes_the_hysteresis_out_and_nothing_flows_at_zero(bench, tmp_path, name):
    """Small loops included, from 5 to 100 % of flow, in a plant that shares no code with the product."""
    kept = loops(designed(bench(name)), name, tmp_path / "kept")
    assert all(widest(loop)[0] > 0.025 for loop in kept)
    dither, beside = DITHERS[name]
    for loop in loops(designed(bench(name, dither), dither=dither, **beside), name, tmp_path / "dithered"):
        assert widest(loop)[0] <= 0.005
        # At the wave's top; what a meter with a floor lets pass is far below what it shows.
        assert loop.largest[-50:].max() <= 0.01 * VALVES[name].floor_L_min


@pytest.mark.parametrize("name", ["example", "A"])
def test_thresholds_under_a_dither_let_flow_pass_without_it_so_the_design_is_refused(bench, tmp_path, name, wording):
    """The seeded fault: the same valve.json, which forgets that it was recorded under a dither."""
    valve = bench(name, DITHERS[name][0])
    with wording.refusal(InputError):
        designed(valve)
    forgotten = loops(designed(replace(valve, dithered=UNSET)), name, tmp_path / "forgotten")
    assert max(loop.largest[-50:].max() for loop in forgotten) > 0.05


@pytest.mark.parametrize("times", [0.5, 2.0])
def test_a_wrong_play_beside_the_dither_makes_no_flow_at_zero(bench, tmp_path, times):
    right = designed(bench("A", "150 Hz 1 %"), dither="150 Hz 1 %", hysteresis="play")
    nodes = tuple(round(times * count) for count in right.drive_functions.play_counts[0])
    wrong = replace(right, drive_functions=replace(right.drive_functions, play_counts=(nodes, ())))
    assert all(loop.largest[-50:].max() == 0.0 for loop in loops(wrong, "A", tmp_path / "wrong"))


def test_noise_on_a_standing_command_does_not_chatter_under_a_dither(bench, tmp_path):
    rng, valve = np.random.default_rng(3), bench("A", "150 Hz 1 %")
    noise = rng.integers(-4, 5, 4000)
    rms = {}
    for hysteresis in ("keep", "play"):
        made = designed(valve, dither="150 Hz 1 %", hysteresis=hysteresis)
        plant = library(tmp_path, written(made, tmp_path / hysteresis))
        for level in (0.1, 0.4, 0.8):
            codes = np.concatenate([np.linspace(0, 4095 * level, 2000), 4095 * level + noise])
            rms[hysteresis, level] = driven(plant, VALVES["A"], 3.0, codes.round(), every=2)[-3000:, 3].std()
    for level in (0.1, 0.4, 0.8):
        assert 0 < rms["play", level] <= 2 * rms["keep", level]


def test_the_stand_in_of_a_dithered_recording_is_not_dithered_twice(bench, tmp_path, monkeypatch):
    made = designed(bench("A", "150 Hz 1 %"), dither="150 Hz 1 %")
    folder = written(made, tmp_path / "fw")
    command = np.concatenate([np.linspace(0, 1, 5000), np.linspace(1, 0, 5000)])

    def width(scene):
        run = scene.loop.run(command, scene.dp_MPa, "compensated")
        half = 0.5 * run.q_mean_L_min.max()
        opened = run.command[np.argmax(run.q_mean_L_min >= half)]
        return opened - run.command[len(command) - 1 - np.argmax(run.q_mean_L_min[::-1] >= half)]

    for scene, test in zip(scenes_of(folder, made, None), made.valve.positive.tests, strict=True):
        expected = hysteresis_left(made, test)[LEVELS.index(0.5)]  # from the recorded branches
        assert width(scene) == pytest.approx(expected, abs=5e-4)
        assert all(not each.must_shut or each.q_zero_L_min == 0 for each in run_scenarios(scene))
    monkeypatch.setattr(ClosedLoop, "wave", property(lambda _: (0, 1, False)))
    twice = scenes_of(folder, made, None)[1]
    assert width(twice) < 0.8 * expected


def test_a_plant_that_is_given_feels_the_dither_of_the_recordings_without_the_compensator_too(
    example_folder, tmp_path, monkeypatch
):
    from dzdesign.api import simulate

    plant_file = example_folder / "plant.toml"
    simulate(plant=plant_file, dither="150 Hz 1 %", dp=["1 MPa", "3 MPa"], ramp_time="25 s", output=tmp_path / "ramps")
    valve = identify(str(tmp_path / "ramps" / "*.gz"), meter_lag="0.1 s", dithered="150 Hz 1 %", curve="line")
    test = valve.positive.tests[0]
    assert test.u_knee_rising_V - test.u_knee_falling_V < 0.03
    made, plant = designed(valve, dither="150 Hz 1 %"), read_plant(plant_file)
    folder = written(made, tmp_path / "fw")

    def width_V():
        scene = scenes_of(folder, made, plant)[0]
        run = scene.loop.run(np.concatenate([np.linspace(0, 1, 4000), np.linspace(1, 0, 4000)]), scene.dp_MPa)
        half = 0.5 * run.q_mean_L_min.max()
        opened = run.command[np.argmax(run.q_mean_L_min >= half)]
        return 10 * (opened - run.command[7999 - np.argmax(run.q_mean_L_min[::-1] >= half)])

    assert abs(width_V()) < 0.03
    monkeypatch.setattr(ClosedLoop, "wave", property(lambda _: (0, 1, False)))  # the seeded fault
    assert width_V() > 0.12


def test_a_firmware_is_not_simulated_with_a_second_dither(tmp_path, wording):
    with wording.refusal(InputError):
        simulated_files(
            Plant(), [1.0], 25.0, Bench(), lambda _: None, tmp_path, dither=Dither(frequency_Hz=150.0, peak=0.01)
        )


def test_the_table_of_choices_recommends_what_leaves_least(bench):
    def recommended(valve, **texts):
        valve = replace(valve, meter=replace(valve.meter, left_by_rates_s=0.0, left_by_rates_se_s=0.001))
        choices = hysteresis_choices(designed(valve, **texts))
        assert all(choice.hysteresis <= choice.largest for choice in choices)
        return next(choice.given for choice in choices if choice.recommended), choices

    assert recommended(bench("A"))[0] == "--hysteresis play"
    given, choices = recommended(bench("A", "150 Hz 1 %"), dither="150 Hz 1 %")
    assert given == '--dither "150 Hz 1 %" --hysteresis play' and len(choices) == 3
    given, choices = recommended(bench("A", "150 Hz 2 %"), dither="150 Hz 2 %")
    assert given == '--dither "150 Hz 2 %" --transition auto' and choices[1].largest <= 0.005
    # A dither of ramps that had none: its thresholds are not known, and neither is what it leaves.
    assert hysteresis_choices(designed(bench("A"), dither="150 Hz 1 %")) == ()


def test_the_plant_shares_no_code_with_the_product():
    assert "dzdesign" not in Path(dithered_valve.__file__).read_text(encoding="utf-8")
