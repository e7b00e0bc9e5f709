"""The table of what a design leaves at its tests: every number of the lines in compensator.json, in its units."""

import re
from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign.codegen.project import DEFAULT_TARGET, target_named
from dzdesign.core.recorded_units import FlowUnit, PressureUnit, RecordedUnits
from dzdesign.design.costs import lines_of_tests
from dzdesign.design.costs_at_tests import costs_at_tests
from dzdesign.design.designing import design
from dzdesign.design.fixed_offset import Characteristic, dead_zones
from dzdesign.design.options import DesignOptions, options_of
from dzdesign.terminal.tables import print_compensator

BAR = RecordedUnits(pressure=PressureUnit(unit="bar", factor=10.0), flow=FlowUnit(unit="mL/s", factor=1000 / 60))
NUMBER = re.compile(r"\d+\.\d+")


@pytest.mark.parametrize(
    "options",
    [
        DesignOptions(),
        DesignOptions(output_max=Fraction(8, 10)),
        DesignOptions(transition=Fraction(0), guard="mean"),
    ],
    ids=["default", "largest output", "flow at zero"],
)
@pytest.mark.parametrize("units", [RecordedUnits(), BAR], ids=["MPa", "bar"])
def test_the_table_has_every_number_of_the_lines(example_valve, capsys, options, units):
    made = design(replace(example_valve, recorded_units=units), options)
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
    title = f"and where the flow reaches {level} {units.label('L/min')}"
    assert title in " ".join(printed.split()) and f"dP ({units.label('MPa')})" in printed


def test_the_flow_at_the_transitions_end_is_that_of_the_falling_command(example_valve):
    """It lies above the reading flow just where that flow passes at the transition's end already, with a play too."""
    flows = []
    for hysteresis in ("keep", "play"):
        made = design(example_valve, options_of({"hysteresis": hysteresis}, target_named(DEFAULT_TARGET).inputs()))
        end, costs = made.transition_end / made.signals.command.span(1), costs_at_tests(made, 1)
        assert all((one.at_end_L_min > one.reading_flow_L_min) == (one.read["closing"] < end) for one in costs)
        flows.append([one.at_end_L_min for one in costs])
        # What stands beside a fixed setting is the same flow.
        fixed = Characteristic(rest=Fraction(0), nodes=((Fraction(0), Fraction(1, 2)), (Fraction(1), Fraction(1))))
        assert [row.law_end_L_min for row in dead_zones(made, fixed)] == pytest.approx(flows[-1], rel=1e-12)
    kept, with_play = flows
    assert all(less < 0.5 * more for more, less in zip(kept, with_play, strict=True))
