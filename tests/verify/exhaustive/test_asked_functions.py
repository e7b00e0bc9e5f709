"""Numbers of drive and signals that are not those of the options: what a bug of `design` would make of them."""

from dataclasses import replace

import pytest

from dzdesign.verify.exhaustive.asked_functions import functions_asked_for
from tests.support.designs import designed
from tests.support.golden_firmware import FULL, golden_valve

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


#: Signals as they are, and what was asked for instead, with a word of the finding.
SIGNALS = {
    "command_signal": "-10..10 V x 0.12 + 1.5 V",
    "pressure_a": "4..20 mA on 140 ohm = 25 MPa",
    "pressure_b": "4..20 mA on 140 ohm = 250 bar",
}
OTHER_SIGNALS = {
    "span": ({"pressure_a": "4..20 mA on 140 ohm = 20 MPa"}, "pressure_a spans 25 MPa"),
    "unit of the span": ({"pressure_b": "4..20 mA on 140 ohm = 250 MPa"}, "pressure_b spans 25 MPa"),
    "span of both": ({"pressure_a": "4..20 mA on 140 ohm"}, "asked for were 20 MPa"),
    "shunt": ({"pressure_a": "4..20 mA on 130 ohm = 25 MPa"}, "pressure_a has a code of 3822"),
    "live zero": ({"pressure_b": "0..20 mA on 140 ohm = 25 MPa"}, "pressure_b has a code of 764"),
    "zero": ({"command_signal": "-10..10 V x 0.12 + 1.6 V"}, "command_signal has a code of 2048"),
    "polarity": ({"polarity": "inverted"}, "command_signal has a code of 3686"),
    "one sign": ({"command_signal": "0..10 V x 0.12 + 1.5 V"}, "command_signal has a code of 409"),
}


@pytest.fixture(scope="module")
def both_signs():
    made = designed(golden_valve(FULL), **SIGNALS)
    assert functions_asked_for(made).holds
    return made


@pytest.mark.parametrize("seed", OTHER_SIGNALS)
def test_another_signal_is_named(both_signs, seed):
    asked, words = OTHER_SIGNALS[seed]
    found = functions_asked_for(replace(both_signs, options=both_signs.options | asked))
    assert not found.holds and words in found.text


@pytest.mark.parametrize("polarity", ["normal", "inverted"])
@pytest.mark.parametrize("command", ["0..10 V x 0.3", "4..20 mA on 140 ohm = 0..10 V", "4..20 mA on 140 ohm = 100 %"])
def test_signals_as_they_were_asked_for_hold(example_valve, command, polarity):
    assert functions_asked_for(designed(example_valve, command_signal=command, polarity=polarity)).holds


def test_a_reverse_drop_that_is_no_failure_is_named(compensator):
    found = functions_asked_for(replace(compensator, reverse_codes=20 * compensator.reverse_codes))
    assert not found.holds and "is no failure" in found.text
