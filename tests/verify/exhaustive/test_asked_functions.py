"""Numbers of the drive that are not those of the options: what a bug of `design` would make of them."""

from dataclasses import replace

import pytest

from dzdesign.verify.exhaustive.asked_functions import functions_asked_for
from tests.support.designs import designed

ASKED = {
    "ramp_up": "0.5 s / 800 ms", "ramp_down": "0.25 s", "fault_debounce": "4 ms", "interlock": "on",
    "fault_latch": "on", "output_max": "95 %", "dither": "150 Hz 1 %",
}  # fmt: skip
#: Of a design what somebody made of its numbers, and a word of the finding.
SEEDS = {
    "ramp of the tick's rate": ({"ramp_up": lambda made: tuple(step // 2 for step in made.ramp_up)}, "ramp_up"),
    "ramps exchanged": ({"ramp_up": lambda made: made.ramp_down, "ramp_down": lambda made: made.ramp_up}, "ramp_"),
    "debounce of one sample": ({"fault_samples": lambda made: 1}, "over after 1 samples"),
    "no interlock": ({"interlock_codes": lambda made: None}, "interlock is off"),
    "no latch": ({"fault_latch": lambda made: False}, "fault_latch is off"),
    "full drive": ({"compare_limit": lambda made: 60_000}, "largest output"),
    "half the dither's rate": ({"dither_ticks": lambda made: 2 * made.dither_ticks}, "dither"),
    "twice the dither": ({"dither_counts": lambda made: 2 * made.dither_counts}, "dither"),
}


@pytest.fixture(scope="module")
def compensator(example_valve):
    return designed(example_valve, **ASKED)


def test_what_design_makes_is_what_was_asked_for(compensator, example_valve):
    assert functions_asked_for(compensator).holds
    assert functions_asked_for(designed(example_valve)).holds
    assert functions_asked_for(designed(example_valve, interlock="off", fault_debounce="7 samples")).holds


@pytest.mark.parametrize("seed", SEEDS)
def test_another_number_is_named(compensator, seed):
    changes, words = SEEDS[seed]
    made = compensator.drive_functions
    wrong = replace(made, **{name: change(made) for name, change in changes.items()})
    found = functions_asked_for(replace(compensator, drive_functions=wrong))
    assert not found.holds and words in found.text


def test_a_reverse_drop_that_is_no_failure_is_named(compensator):
    found = functions_asked_for(replace(compensator, reverse_codes=20 * compensator.reverse_codes))
    assert not found.holds and "is no failure" in found.text
