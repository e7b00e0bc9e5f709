"""The words of what a declared machine costs: the dead zone at its other end, by search through the law itself."""

import math
import re
from fractions import Fraction

import pytest

from dzdesign.codegen.project import target_named
from dzdesign.design.costs import machine_costs
from dzdesign.design.costs_at_tests import last_opening
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.terminal.tables import print_compensator

TARGET = target_named("f28335").inputs()
DUTY = {"coil_temperature": "-20..80 degC", "supply": "18..32 V"}


@pytest.mark.parametrize("declared", [DUTY, {"amplifier": "1 %"}])
def test_the_dead_zone_at_the_other_end_of_the_machine_is_that_of_the_law(
    example_valve, declared, capsys, monkeypatch
):  # fmt: skip
    """Code by code: where the drive reaches the opening knee of the last machine."""
    designed = design(example_valve, options_of(declared, TARGET))
    factor, span = designed.machine.largest_factor, designed.signals.command.span(1)
    first = []
    for test in designed.valve.positive.tests:
        dp_code = round(designed.signals.dp_code(Fraction(repr(test.dp_MPa))))
        knee = factor * Fraction(repr(test.u_knee_rising_V)) / designed.u_max_V
        drives = (designed.drive(designed.signals.command.zero_code + code, dp_code, 1) for code in range(span + 1))
        first.append(next((code for code, drive in enumerate(drives) if drive >= knee), None))
    line = next(line for line in machine_costs(designed, 1) if "other end" in line)
    assert None not in first
    assert float(re.search(r"up to ([\d.]+)% of command", line)[1]) == pytest.approx(100 * max(first) / span, abs=0.03)
    monkeypatch.setenv("COLUMNS", "160")
    print_compensator(designed)
    printed = capsys.readouterr().out
    rows = [row.split() for row in printed.splitlines() if re.match(r" +\d\.\d\d +\d\.\d{3} +", row)]
    assert [float(row[4].rstrip("%")) for row in rows] == pytest.approx([100 * each / span for each in first], abs=0.03)
    header = next(line for line in printed.splitlines() if line.startswith("  component "))
    assert header.endswith("price") and "largest sensitivity (per unit)" in header  # not folded


def test_a_machine_whose_valve_never_opens_is_told_from_one_with_a_long_dead_zone(example_valve):
    """Less than full drive leaves no command that opens the valve where the coil is hot and the supply low."""
    limited = design(example_valve, options_of(DUTY | {"output_max": "80 %"}, TARGET))
    assert any("does not open at any command" in line for line in machine_costs(limited, 1))
    assert last_opening(limited, limited.valve.positive.tests[0], 1) == math.inf
