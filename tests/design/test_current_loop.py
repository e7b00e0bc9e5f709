"""The current loop that `design` chooses: its exact transfer function, margins and steps at every corner."""

from dataclasses import replace

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.costs import costs_of, design_warnings
from dzdesign.design.current import drive as current_drive
from dzdesign.design.current.circuit import Corner, CurrentSampling, CurrentSensor
from dzdesign.design.current.drive import (
    LEAST_PHASE_DEG,
    choose_loop,
    design_current_drive,
    gains_of,
    worst_step,
)
from dzdesign.design.current.responses import (
    Gains,
    StepResponse,
    loop_transfer,
    released_overshoot_A,
    run_loop,
    step_responses,
    worst_margins,
)
from dzdesign.verify.exhaustive.zero_command import counted_dither
from tests.support.designs import CURRENT, designed
from tests.support.example_coil import COIL, SAMPLING, SENSORS, asked, example_loop

on_both = pytest.mark.parametrize("name", SENSORS)
RISE_S = {"supply unknown": 10e-3, "supply measured": 5e-3}


@on_both
def test_every_corner_has_its_margins_step_and_little_overshoot(name):
    loop = example_loop(name)
    phase, gain = worst_margins(COIL, SAMPLING, gains_of(loop, COIL))
    assert phase.phase_deg >= LEAST_PHASE_DEG and gain.gain > 2
    steps = step_responses(loop, asked(SENSORS[name]))
    slowest, largest = worst_step(steps)
    assert len(steps) == 27
    assert slowest.rise_s <= RISE_S[name] and largest.overshoot <= 0.10
    assert all(step.rise_s > step.least_s for step in steps)


@on_both
def test_no_corner_overshoots_as_it_is_released_and_none_is_held_down_for_nothing(name):
    """Every fortieth of the rated current: less than a code. Beginning at the integral it is dozens of codes."""
    loop, request = example_loop(name), asked(SENSORS[name])
    corners, code_A = list(COIL.corners()), 1 / (request.sensor.V_per_A * request.codes_per_V)
    for share in np.arange(0.025, 1.01, 0.025):
        means, _ = run_loop(loop, request, corners, [round(share * 60000)] * 300)
        assert means.max() <= share + code_A
    assert released_overshoot_A(replace(loop, release=0), request) > 50 * code_A
    assert released_overshoot_A(replace(loop, release=loop.release // 2), request) > code_A


def test_an_overshoot_that_no_beginning_prevents_is_stated_and_warned_of(example_compensator, wording, monkeypatch):
    """Seeded: with inductances of 0.2 to 3 times the nominal one it was 80 codes, and nothing said so."""
    given = {"step_responses": (), "dither_departure": (0, 0), "released_overshoot_A": 0.0331}
    for name, found in {**given, "choose_loop": example_loop("supply unknown")}.items():
        monkeypatch.setattr(current_drive, name, lambda *_, found=found, **__: found)
    step = StepResponse(corner=COIL.nominal, rise_s=2e-3, least_s=1e-3, overshoot=0.05)
    monkeypatch.setattr(current_drive, "worst_step", lambda _: (step, step))
    drive = design_current_drive(asked(SENSORS["supply unknown"]), 60000)
    assert drive.release_overshoot_A == 0.0331
    warned = replace(example_compensator, current_drive=drive)
    (text,) = design_warnings(warned)
    assert text in costs_of(warned)
    assert not design_warnings(replace(warned, current_drive=replace(drive, release_overshoot_A=0.0)))
    wording("current loop: an overshoot at release", text)


def test_every_delay_is_counted():
    """Sampling once at the period's end and sampling at its begin differ by that time; so does an output put off."""
    gains, corner = Gains(proportional=20.0, integral=0.0, feed_forward=0.0), Corner(4.0, 0.04, 24.0)
    omega = np.array([500.0])
    phase = {
        before: np.angle(
            loop_transfer(
                COIL, corner, CurrentSampling(samples=16, before=before), gains, COIL.duty(corner, 0.5), omega
            )
        )[0]
        for before in (2, 14)
    }
    between_s = (14 - 2) / 16 * SAMPLING.period_s  # the middle of the samples is as much later
    assert phase[14] - phase[2] == pytest.approx(500 * between_s, rel=0.02)


def test_a_wider_supply_costs_speed():
    wide = choose_loop(asked(SENSORS["supply unknown"], replace(COIL, supply_V=(12.0, 40.0))), 60000)
    assert gains_of(wide, COIL).proportional * 24 < gains_of(example_loop("supply unknown"), COIL).proportional * 24


@pytest.mark.parametrize(
    "sensor",
    [
        CurrentSensor(V_per_A=2.6, offset_V=0.15),
        CurrentSensor(V_per_A=2.0, offset_V=0.15, supply_divider=0.1),
        CurrentSensor(V_per_A=2.0),  # an offset below the converter's zero is not seen
        CurrentSensor(V_per_A=2.0, offset_V=0.06),  # nor is all that is calibrated away
    ],
)
def test_a_sensor_beyond_the_converter_is_refused(sensor):
    with pytest.raises(InputError):
        choose_loop(asked(sensor), 60000)


@pytest.mark.parametrize("changed", [{"rated_A": 50.0}, {"supply_V": (1.0, 1000.0)}])
def test_a_current_that_no_supply_drives_in_time_is_refused(changed):
    circuit = replace(COIL, **changed)
    sensor = CurrentSensor(V_per_A=2.0 / circuit.rated_A, offset_V=0.15)
    with pytest.raises(InputError, match=r"carries|reach"):
        design_current_drive(asked(sensor, circuit), 60000)


def test_corners_that_cannot_carry_the_rated_current_are_said():
    """They have no step, so "the slowest" is none of them."""

    def words(rated_A, V_per_A):
        sensor = CurrentSensor(V_per_A=V_per_A, offset_V=0.15)
        return design_current_drive(asked(sensor, replace(COIL, rated_A=rated_A)), 60000).in_words(RecordedUnits())

    assert len(words(1.0, 2.0)) == 2 and "3.44 A" in words(5.0, 0.4)[2]


def test_the_current_overshoots_the_dither_and_the_offset_keeps_that_free(example_valve):
    """`verify` measures the overshoot on the C; here it is what the offset keeps."""
    made = designed(example_valve, "host", **CURRENT, dither="150 Hz 1 %")
    assert made.current_drive.dither_above_counts > 150
    assert made.dither_reserve_counts == 600 + made.current_drive.dither_above_counts == counted_dither(made)
    assert made.positive.budget.line("dither").half_width == made.dither_reserve_counts
