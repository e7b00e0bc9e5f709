"""Tables of the uncertainty budget, and of a drive by current."""

import csv
import io
from dataclasses import replace

import pytest

from dzdesign.core.recorded_units import AS_COMPUTED, PressureUnit
from dzdesign.design.certificate import not_counted
from dzdesign.report.sections.closed_loop import current_tables
from dzdesign.report.sections.law import budget_section
from dzdesign.verify.current.results import (
    ControllerStates,
    CurrentCorner,
    CurrentLoopResult,
    FaultRun,
)
from tests.support.designs import designed

DECLARED = {"coil_temperature": "-20..80 degC", "supply": "18..32 V", "oil": "0.4 %"}


@pytest.fixture(scope="module")
def machine(example_valve):
    return designed(example_valve, **DECLARED)


@pytest.fixture(scope="module")
def section(machine):
    return budget_section(machine)


def test_every_component_stands_in_the_table_with_its_origin(machine, section):
    table, budget = section.tables[0], machine.positive.budget
    *components, together = table.rows
    assert [row[0].text for row in components] == [line.component for line in budget.lines]
    assert [cell.text for cell in together[3:-1]] == [f"{value:.2f}" for value in budget.combined_mV]
    known = {row[0].text: row[0].more for row in components}
    assert known["oil"].startswith("declared: --oil") and known["ageing"].startswith("default: ")
    assert "default: default" not in "".join(known.values()) and known["recording"].startswith("measured: ")
    for row, line in zip(components, budget.lines, strict=True):
        shown = [cell.text for cell in row[3:-1]]
        assert shown == [f"{value:.2f}" for value in line.contribution_mV]
        assert float(row[-1].text) == pytest.approx(100 * line.price, abs=6e-4)
    rows = list(csv.DictReader(io.StringIO(table.csv)))
    assert len(rows) == len(budget.lines) * len(budget.dp_MPa)


def test_a_sensitivity_times_its_half_width_is_the_contribution_in_any_units(machine, example_valve):
    """Seeded: of a half-width that is shown in bar the sensitivity per MPa would be ten times too large."""
    chosen = replace(AS_COMPUTED, pressure=PressureUnit(unit="bar", factor=10.0))
    of_bar = designed(replace(example_valve, recorded_units=chosen), **DECLARED)
    for compensator, unit in ((machine, "MPa"), (of_bar, "bar")):
        table = budget_section(compensator).tables[0]
        row = next(row for row in table.rows if row[0].text == "pressure sensor A")
        half_width, _, shown_unit = row[1].text.partition(" ")
        largest = max(float(cell.text) for cell in row[3:-1])
        steepest = float(row[2].text.rpartition(" to ")[2])
        assert shown_unit == unit and float(half_width) * steepest == pytest.approx(largest, rel=0.02)


def test_without_a_machine_the_budget_is_that_of_the_recording(example_compensator):
    section = budget_section(example_compensator)
    assert "no machine was declared" in section.lines[0]
    known = [row[0].text for row in section.tables[0].rows]
    assert "recording" in known and not {"coil temperature", "supply", "pressure sensor A", "oil"} & set(known)
    assert any("machine" in line for line in not_counted(example_compensator))
    assert not_counted(None) == not_counted(example_compensator)


# --- a drive by current ---

CORNER = CurrentCorner(
    resistance_ohm=4.0, inductance_H=0.04, supply_V=24.0, phase_margin_deg=55.0, gain_margin=2.8, limit_cycle_codes=0.3,
    steady_error_codes=0.02, current_error_codes=0.6, release_overshoot_codes=0.2,
    rise_s=0.006, least_rise_s=0.0028, overshoot=0.05, faults=0,
)  # fmt: skip
RESULT = CurrentLoopResult(
    states=ControllerStates(states=1000, seed=1, wrong=0, first_wrong=None),
    seconds=10.0, shares=(0.5, 1.0), not_carried=1,
    corners=(CORNER, replace(CORNER, rise_s=None, least_rise_s=None, overshoot=None)),
    offset_codes=(), offset_error_codes=0.0, dither_above_counts=0.0, dither_below_counts=0.0,
    faults=(FaultRun(name="the wire breaks", expected="OPEN", seen_after_s=None, limit_s=0.04, latched=False),),
)  # fmt: skip


def texts(table) -> list[list[str]]:
    return [[getattr(cell, "text", cell) for cell in row] for row in table.rows]


def test_every_corner_and_fault_has_a_row_and_by_duty_there_is_nothing():
    corners, faults = current_tables(RESULT)
    assert [row[-3:] for row in texts(corners)] == [["6.0", "2.8", "5.0"], ["not carried"] * 3]
    assert texts(faults)[0][1:3] == ["DZ_CURRENT_OPEN", "not seen"] and texts(faults)[0][-1] == "no"
    assert current_tables(None) == ()
