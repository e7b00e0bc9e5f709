"""The uncertainty budget as a person meets it: report, C, README; and what is said where there is no machine."""

import csv
import io
import re
from dataclasses import replace

import pytest

from dzdesign.codegen.project import target_named
from dzdesign.core.chosen_units import read_units
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.certificate import not_counted
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.report.figure import figure_style
from dzdesign.report.sections.budget import budget_section

DECLARED = {"coil_temperature": "-20..80 degC", "supply": "18..32 V", "oil": "0.4 %"}


def designed(valve, texts, target="f28335"):
    return design(valve, options_of(texts, target_named(target).inputs()))


@pytest.fixture(scope="module")
def machine(example_valve):
    return designed(example_valve, DECLARED)


@pytest.fixture(scope="module")
def section(machine):
    with figure_style():
        return budget_section(machine)


def test_every_component_stands_in_the_table_with_its_origin(machine, section):
    table, budget = section.tables[0], machine.positive.budget
    assert [row[0].text for row in table.rows] == [line.component for line in budget.lines]
    known = {row[0].text: row[0].more for row in table.rows}
    assert known["oil"].startswith("declared: --oil") and known["ageing"].startswith("default: ")
    assert "default: default" not in "".join(known.values()) and known["recording"].startswith("measured: ")
    for row, line in zip(table.rows, budget.lines, strict=True):
        shown = [cell.text for cell in row[3:-1]]
        assert shown == [f"{value:.2f}" for value in line.contribution_mV]
        assert float(row[-1].text) == pytest.approx(100 * line.price, abs=6e-4)
    rows = list(csv.DictReader(io.StringIO(table.csv)))
    assert len(rows) == len(budget.lines) * len(budget.dp_MPa)


def test_a_sensitivity_times_its_half_width_is_the_contribution_in_any_units(machine, example_valve):
    """Seeded: of a half-width that is shown in bar the sensitivity per MPa would be ten times too large."""
    chosen = read_units("bar", "--units").over(AS_COMPUTED, 10.0)
    of_bar = designed(replace(example_valve, recorded_units=chosen), DECLARED)
    for compensator, unit in ((machine, "MPa"), (of_bar, "bar")):
        with figure_style():
            table = budget_section(compensator).tables[0]
        row = next(row for row in table.rows if row[0].text == "pressure sensor A")
        half_width, _, shown_unit = row[1].text.partition(" ")
        largest = max(float(cell.text) for cell in row[3:-1])
        steepest = float(row[2].text.rpartition(" to ")[2])
        assert shown_unit == unit and float(half_width) * steepest == pytest.approx(largest, rel=0.02)


def test_the_bars_are_the_contributions_and_the_line_is_their_sum_as_certified(machine, section):
    figure, budget = section.figures[0], machine.positive.budget
    rows = list(csv.reader(io.StringIO(figure.csv)))
    assert [float(row[-1]) for row in rows[1:]] == pytest.approx(budget.combined_mV)
    parts = re.findall(r">([^<>]+ \((?:measured|declared|default)\))<", figure.svg)
    assert {"coil temperature (default)", "supply (default)", "recording (measured)"} <= set(parts)
    assert ">taken off the threshold (mV)<" in figure.svg and "smaller ones, in the table<" in figure.svg


def test_without_a_machine_the_budget_is_that_of_the_recording(example_compensator):
    with figure_style():
        section = budget_section(example_compensator)
    assert "no machine was declared" in section.lines[0]
    known = [row[0].text for row in section.tables[0].rows]
    assert "recording" in known and not {"coil temperature", "supply", "pressure sensor A", "oil"} & set(known)
    assert any("machine" in line for line in not_counted(example_compensator))
    assert not_counted(None) == not_counted(example_compensator)
