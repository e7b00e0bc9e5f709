"""The table of what each way with the hysteresis leaves."""

from fractions import Fraction

import numpy as np
import pytest

from dzdesign.codegen.project import DEFAULT_TARGET, target_named
from dzdesign.design.costs_at_tests import corners_of, remaining_dead_zone
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.design.redesign import hysteresis_choices
from dzdesign.identify.options import IdentifyOptions
from dzdesign.terminal.choices_table import print_choices
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp


def choices(valve, **texts):
    return hysteresis_choices(design(valve, options_of(texts, target_named(DEFAULT_TARGET).inputs())))


def test_a_reading_flow_that_a_test_never_comes_to_leaves_no_worst_of_all_tests(example_valve):
    largest = [test.q_max_L_min for test in example_valve.positive.tests]
    within = choices(example_valve, reading_flow="1 L/min")
    assert all(each.reading is not None for each in within if not each.refused)
    beyond = choices(example_valve, reading_flow=f"{(min(largest) + max(largest)) / 2} L/min")
    made = [each for each in beyond if not each.refused]
    assert made and all(each.reading is None and each.onset is not None for each in made)


def test_what_the_sweeps_cannot_tell_of_a_play_is_said_where_it_is_recommended(example_valve, capsys):
    found = choices(example_valve)
    assert "play" in next(each.given for each in found if each.recommended)
    print_choices(found, "0.60 L/min")
    assert "small command cycles" in capsys.readouterr().out
    print_choices([each for each in found if "play" not in each.given], "0.60 L/min")
    assert "small command cycles" not in capsys.readouterr().out


def test_the_dead_zone_between_the_tests_counts():
    """Three tests: M is large, and between two of them the offset lies lower than at both."""
    ramps = [
        synthetic_ramp(dp, Truth(knee_rising=5.6 - 0.06 * dp + 0.002 * dp**2, slope=4 * dp**0.5, noise=0.02), seed=row)
        for row, dp in enumerate((1.0, 3.0, 5.0))
    ]
    valve = identify(ramps, IdentifyOptions(meter_lag=0.0, curve="smooth"))
    off = choices(valve, transition="off")[0]
    made_off = design(valve, options_of({"transition": "off"}, target_named(DEFAULT_TARGET).inputs()))
    at_tests = max(remaining_dead_zone(made_off, test)["opening"] for test in valve.positive.tests)
    middle = [test.dp_MPa for test in valve.positive.tests]
    knees = [test.u_knee_rising_V for test in valve.positive.tests]
    found = []
    first, last = (round(made_off.signals.dp_code(Fraction(dp))) for dp in (1, 5))
    for code in range(first, last + 1):
        knee = np.interp(float(made_off.signals.dp_MPa(code)), middle, knees) / 10
        found.append(corners_of(made_off, code, 1).command_at(knee))
    assert off.onset == pytest.approx(max(found), abs=1e-3) and off.onset > 1.1 * at_tests
