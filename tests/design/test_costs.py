"""What a design leaves, in numbers and words: dead zones at a stated flow, the table at the tests, a machine's cost."""

import math
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from msgspec import UNSET

from dzdesign.codegen.amplifier.device import device_named
from dzdesign.codegen.amplifier.setting import amplifier_setting
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import FlowUnit, PressureUnit, RecordedUnits
from dzdesign.design.costs import lines_of_tests, machine_costs
from dzdesign.design.costs_at_tests import (
    corners_of,
    costs_at_tests,
    last_opening,
    read_dead_zone,
    remaining_dead_zone,
)
from dzdesign.design.fixed_offset import Characteristic, dead_zones
from dzdesign.design.redesign import hysteresis_choices, without_sensors
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.reading_flow import dead_zone_at, default_reading_flow, ideal_line
from dzdesign.terminal.design_tables import print_choices, print_compensator
from tests.support.designs import MACHINES, designed
from tests.support.repeatable_valves import identify
from tests.support.synthetic import Truth, synthetic_ramp

BAR = RecordedUnits(pressure=PressureUnit(unit="bar", factor=10.0), flow=FlowUnit(unit="mL/s", factor=1000 / 60))
NUMBER = re.compile(r"\d+\.\d+")


@pytest.mark.parametrize(
    "texts",
    [{}, {"output_max": "80 %"}, {"transition": "off", "guard": "mean"}],
    ids=["default", "largest output", "flow at zero"],
)
@pytest.mark.parametrize("units", [RecordedUnits(), BAR], ids=["MPa", "bar"])
def test_the_table_has_every_number_of_the_lines(example_valve, capsys, texts, units):
    made = designed(replace(example_valve, recorded_units=units), **texts)
    print_compensator(made)
    printed = capsys.readouterr().out
    lines = lines_of_tests(made, 1)
    assert set(lines) <= set(made.costs) and not any(line in printed for line in lines)
    rows = [line for line in printed.splitlines() if re.match(r" +\d+\.\d+ +\d\.\d{3} +", line)]
    level = NUMBER.search(lines[0].partition("read at ")[2])[0]
    for line, row in zip(lines, rows, strict=True):
        numbers = NUMBER.findall(line)
        numbers.remove(level)
        assert sorted(numbers) == sorted(NUMBER.findall(row)), row
    title = f"read at {level} {units.label('L/min')}"
    assert title in " ".join(printed.split()) and f"dP ({units.label('MPa')})" in printed


def test_the_flow_at_the_transitions_end_is_that_of_the_falling_command(example_valve):
    """It lies above the reading flow just where that flow passes at the transition's end already, with a play too."""
    flows = []
    for hysteresis in ("keep", "play"):
        made = designed(example_valve, hysteresis=hysteresis)
        end, costs = made.transition_end / made.signals.command.span(1), costs_at_tests(made, 1)
        assert all((one.at_end_L_min > one.reading_flow_L_min) == (one.read["closing"] < end) for one in costs)
        flows.append([one.at_end_L_min for one in costs])
        # What stands beside a fixed setting is the same flow.
        fixed = Characteristic(rest=Fraction(0), nodes=((Fraction(0), Fraction(1, 2)), (Fraction(1), Fraction(1))))
        assert [row.law_end_L_min for row in dead_zones(made, fixed)] == pytest.approx(flows[-1], rel=1e-12)
    kept, with_play = flows
    assert all(less < 0.5 * more for more, less in zip(kept, with_play, strict=True))


def test_an_ideal_line_is_read_where_the_paper_says():
    """0.6 L/min of 15.2 and of 26 L/min."""
    assert 100 * ideal_line(0.6, 15.2) == pytest.approx(3.95, abs=0.005)
    assert 100 * ideal_line(0.6, 26.0) == pytest.approx(2.3, abs=0.01)
    assert ideal_line(0.6, 0.5) == 1.0 and ideal_line(0.6, 0.0) == 1.0


def test_a_ramp_is_read_going_up_where_a_flow_comes_and_going_down_where_it_ends():
    command = np.concatenate([np.linspace(0, 1, 101), np.linspace(1, 0, 101)])
    flows = np.concatenate([np.maximum(np.linspace(0, 1, 101) - 0.5, 0), np.maximum(np.linspace(1, 0, 101) - 0.3, 0)])
    assert dead_zone_at(0.1, command, flows, rising=True) == pytest.approx(0.61, abs=0.011)
    assert dead_zone_at(0.1, command, flows, rising=False) == pytest.approx(0.41, abs=0.011)
    assert dead_zone_at(0.9, command, flows, rising=True) == 1.0
    with pytest.raises(InputError):
        dead_zone_at(0.1, command, flows[1:], rising=True)


def test_the_default_is_the_meters_floor_and_without_one_what_the_recordings_resolve(example_valve):
    assert default_reading_flow(example_valve) == example_valve.meter.floor_L_min > 0.5
    without = replace(example_valve, meter=replace(example_valve.meter, floor_L_min=0.0))
    levels = [test.noise_level_L_min for test in example_valve.positive.tests]
    assert default_reading_flow(without) == max(levels)


def test_design_takes_it_and_keeps_it(example_valve):
    compensator = designed(example_valve, reading_flow="1.5 L/min")
    assert compensator.reading_flow_L_min == 1.5
    assert all("read at 1.50 L/min" in line for line in compensator.costs if "offset" in line and " MPa: " in line)


@pytest.mark.parametrize(("share", "told"), [(0.5, True), (1.0, False), (2.0, False)])
def test_a_reading_where_nothing_was_recorded_is_said_to_be_none(example_valve, share, told):
    compensator = designed(example_valve, reading_flow=f"{share * default_reading_flow(example_valve):.9f} L/min")
    assert any("not all of the recordings show a flow" in line for line in compensator.costs) == told


def test_a_reading_lies_beyond_the_onset_and_grows_with_the_flow(example_compensator):
    for test in example_compensator.valve.positive.tests:
        found = []
        for flow in (0.7, 1.5, 6.0):
            read = read_dead_zone(replace(example_compensator, reading_flow_L_min=flow), test)
            assert read["closing"] < read["opening"]
            found.append(read["opening"])
        assert remaining_dead_zone(example_compensator, test)["opening"] <= found[0] < found[1] < found[2]
    beyond = replace(example_compensator, reading_flow_L_min=100.0)
    assert read_dead_zone(beyond, example_compensator.valve.positive.tests[0]) == {}


def choices(valve, **texts):
    return hysteresis_choices(designed(valve, **texts))


def test_a_reading_flow_that_a_test_never_comes_to_leaves_no_worst_of_all_tests(example_valve):
    largest = [test.q_max_L_min for test in example_valve.positive.tests]
    within = choices(example_valve, reading_flow="1 L/min")
    assert all(each.reading is not None for each in within if not each.refused)
    beyond = choices(example_valve, reading_flow=f"{(min(largest) + max(largest)) / 2} L/min")
    made = [each for each in beyond if not each.refused]
    assert made and all(each.reading is None and each.onset is not None for each in made)


def test_what_the_sweeps_cannot_tell_of_a_play_is_said_where_it_is_recommended(example_valve, capsys):
    found = choices(with_rates(example_valve, 0.0, 0.001))
    assert "play" in next(each.given for each in found if each.recommended)
    print_choices(found, "0.60 L/min")
    assert "small command cycles" in capsys.readouterr().out
    print_choices([each for each in found if "play" not in each.given], "0.60 L/min")
    assert "small command cycles" not in capsys.readouterr().out


def with_rates(valve, left_s, error_s):
    """The valve with what ramps of two rates show beside the declared lag."""
    return replace(valve, meter=replace(valve.meter, left_by_rates_s=left_s, left_by_rates_se_s=error_s))


@pytest.mark.parametrize(
    ("left_s", "error_s", "why"),
    [(UNSET, UNSET, "ramps of a second rate"), (0.2, 0.001, "narrower"), (-0.2, 0.001, "wider"),
     (0.001, 0.1, "narrower"), (0.01, 0.001, "")],
)  # fmt: skip
def test_a_play_is_recommended_where_two_rates_gave_one_width(example_valve, left_s, error_s, why, capsys):
    found = choices(with_rates(example_valve, left_s, error_s))
    assert found[-1].recommended == (not why) and bool(found[-1].possible) == bool(why)
    print_choices(found, "0.60 L/min")
    printed = " ".join(capsys.readouterr().out.split())
    assert why in printed and ("(possible)" in printed) == bool(why)


def test_a_fixed_offset_leaves_what_an_amplifiers_setting_leaves(example_valve):
    """The device of the finest steps, read at the opening knees."""
    compensator = designed(example_valve)
    setting = amplifier_setting(compensator, device_named("west"))
    left = [each.fixed["opening"] for each in dead_zones(compensator, setting.characteristics[1])]
    found = without_sensors(compensator)
    assert found.onset == pytest.approx(max(left), abs=3e-4) and found.reading > found.onset
    assert found.onset > 5 * choices(example_valve)[1].onset, "the price of no sensors"


def test_the_dead_zone_between_the_tests_counts():
    """Of 100 mV/MPa² the bound lies 50 mV below the chord in the middle of two tests, lower than at both."""
    ramps = [
        synthetic_ramp(dp, Truth(knee_rising=5.6 - 0.06 * dp + 0.002 * dp**2, slope=4 * dp**0.5, noise=0.02), seed=row)
        for row, dp in enumerate((1.0, 3.0, 5.0))
    ]
    valve = identify(ramps, IdentifyOptions(meter_lag=0.0, curvature=1e-13))
    off = choices(valve, transition="off")[0]
    made_off = designed(valve, transition="off")
    at_tests = max(remaining_dead_zone(made_off, test)["opening"] for test in valve.positive.tests)
    middle = [test.dp_MPa for test in valve.positive.tests]
    knees = [test.u_knee_rising_V for test in valve.positive.tests]
    found = []
    first, last = (round(made_off.signals.pair(1).dp_code(Fraction(dp))) for dp in (1, 5))
    for code in range(first, last + 1):
        knee = np.interp(float(made_off.signals.pair(1).dp_MPa(code)), middle, knees) / 10
        found.append(corners_of(made_off, code, 1).command_at(knee))
    assert off.onset == pytest.approx(max(found), abs=1e-3) and off.onset > 1.1 * at_tests


@pytest.mark.parametrize("declared", [MACHINES["duty"], MACHINES["amplifier"]])
def test_the_dead_zone_at_the_other_end_of_the_machine_is_that_of_the_law(
    example_valve, declared, capsys, monkeypatch
):  # fmt: skip
    """Code by code: where the drive reaches the opening knee of the last machine."""
    made = designed(example_valve, **declared)
    factor, span = made.machine.largest_factor, made.signals.command.span(1)
    first = []
    for test in made.valve.positive.tests:
        dp_code = round(made.signals.pair(1).dp_code(Fraction(repr(test.dp_MPa))))
        knee = factor * Fraction(repr(test.u_knee_rising_V)) / made.u_max_V
        drives = (made.drive(made.signals.command.zero_code + code, dp_code, 1) for code in range(span + 1))
        first.append(next((code for code, drive in enumerate(drives) if drive >= knee), None))
    line = next(line for line in machine_costs(made, 1) if "other end" in line)
    assert None not in first
    assert float(re.search(r"up to ([\d.]+)% of command", line)[1]) == pytest.approx(100 * max(first) / span, abs=0.03)
    monkeypatch.setenv("COLUMNS", "160")
    print_compensator(made)
    printed = capsys.readouterr().out
    rows = [row.split() for row in printed.splitlines() if re.match(r" +\d\.\d\d +\d\.\d{3} +", row)]
    assert [float(row[4].rstrip("%")) for row in rows] == pytest.approx([100 * each / span for each in first], abs=0.03)
    assert "Uncertainty budget" in printed and re.search(r"^ +component +.*half-width ", printed, re.MULTILINE)


def test_a_machine_whose_valve_never_opens_is_told_from_one_with_a_long_dead_zone(example_valve):
    """Less than full drive leaves no command that opens the valve where the coil is hot and the supply low."""
    limited = designed(example_valve, **MACHINES["duty"], output_max="80 %")
    assert any("does not open at any command" in line for line in machine_costs(limited, 1))
    assert last_opening(limited, limited.valve.positive.tests[0], 1) == math.inf
