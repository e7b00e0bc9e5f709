"""Tables of the report, and that what it says in two places is the same in both."""

import csv
import io
import re
from dataclasses import replace

import pytest
from markupsafe import Markup

from dzdesign.assess.assessing import assess
from dzdesign.assess.options import AssessOptions
from dzdesign.core.recorded_units import AS_COMPUTED, PressureUnit
from dzdesign.design.certificate import not_counted
from dzdesign.design.costs import lines_of_tests
from dzdesign.design.costs_at_tests import costs_at_tests
from dzdesign.identify.options import IdentifyOptions
from dzdesign.report.artefacts import Chain
from dzdesign.report.figure import PressureHues, figure_style
from dzdesign.report.page import Headline, Page, _cell, _finding, _tied, render
from dzdesign.report.sections.characteristic import characteristic_figure, characteristic_section
from dzdesign.report.sections.closed_loop import current_tables
from dzdesign.report.sections.law import budget_section
from dzdesign.report.sections.provenance import other_costs, remaining_section
from dzdesign.report.sections.quantities import characteristic_curves, characteristic_quantities
from dzdesign.report.summary import key_figures, sets_in_words
from dzdesign.verify.current.results import (
    ControllerStates,
    CurrentCorner,
    CurrentLoopResult,
    FaultRun,
)
from tests.support.bench_recordings import AFTER, BEFORE, L_MIN, record
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


def assessed(*, sides=(1,), floor=0.0, before_dp=(1.0, 4.0), after_dp=(1.0, 4.0)):
    """Return an assessment of a valve that is recorded at these pressure drops of these sides."""
    options = AssessOptions(reading=IdentifyOptions(meter_lag=0.0), reading_flow=1.0 * L_MIN)
    sets = [
        [record(replace(valve, floor=floor), dp, seed=seed, sign=sign) for sign in sides for dp in dps]
        for seed, valve, dps in ((1, BEFORE, before_dp), (2, AFTER, after_dp))
    ]
    return assess(*sets, options)


@pytest.fixture(scope="module")
def two_sides():
    return assessed(sides=(1, -1), floor=0.6)


def rows_of(assessment):
    """Return the rows of the characteristic's tables: (side, quantity) -> cells at the pressure drops."""
    found = characteristic_quantities(None, assessment, (), ())
    return {
        (table.caption.split()[0].lower(), row[0].text): [cell.text for cell in row[2:]]
        for table in characteristic_section(found, AS_COMPUTED).tables
        for row in table.rows
    }


def measured_tiles(assessment):
    found = characteristic_quantities(None, assessment, (), ())
    return {each.label: each for each in key_figures(Chain(assessment=assessment), found)}


def test_a_measured_tile_says_the_worst_that_its_table_shows(two_sides):
    figure, name = measured_tiles(two_sides)["Dead zone on opening"], "Dead zone at the reading flow, opening"
    cells = [text for (_, of), row in rows_of(two_sides).items() if of == name for text in row]
    before, after = (max(float(text.split(" → ")[place]) for text in cells) for place in (0, 1))
    assert figure.value == f"{before:.1f} % → {after:.1f} %" and "at the reading flow" in figure.note
    found = characteristic_quantities(None, two_sides, (), ())
    assert "the worst of 2 pressure drops on each side" in sets_in_words(found, AS_COMPUTED)


def test_a_flow_that_the_meter_hides_has_a_tile_with_its_bound(two_sides):
    """Seeded: a card of values alone left out the flow at zero command of every meter with a floor."""
    tile = measured_tiles(two_sides)["Flow at zero command"]
    cells = [text for (_, name), row in rows_of(two_sides).items() if name == "Flow at zero command" for text in row]
    bounds = [text.partition(" → ≤")[2] for text in cells]
    assert len(bounds) == 4 and all(bounds) and tile.value == f"≤ {max(bounds, key=float)} L/min"
    assert "the recordings do not show" in tile.note


def test_what_was_recorded_without_the_compensator_alone_has_a_dash_for_with():
    rows = rows_of(assessed(after_dp=(1.0,)))
    one, other = rows["positive", "Hysteresis"][:2]
    assert " → " in one and not one.endswith("–") and other.endswith(" → –")


def test_what_a_design_leaves_stands_in_a_table_and_nowhere_twice(example_compensator):
    compensator = example_compensator
    (table,) = remaining_section(compensator).tables
    costs = costs_at_tests(compensator, 1)
    assert len(table.rows) == len(costs) == len(lines_of_tests(compensator, 1))
    for row, cost in zip(table.rows, costs, strict=True):
        shown = dict(zip(table.columns, (cell.text for cell in row), strict=True))
        assert float(shown["onset, opening (%)"]) == pytest.approx(100 * cost.onset["opening"], abs=0.006)
        assert float(shown["read, closing (%)"]) == pytest.approx(100 * cost.read["closing"], abs=0.006)
        assert float(shown["drive at full command (%)"]) == pytest.approx(100 * cost.full, abs=0.006)
    others = other_costs(compensator)
    assert {*others, *lines_of_tests(compensator, 1)} == set(compensator.costs)
    assert not any("dead zone that remains on opening" in line for line in others)


def page_with(verdict):
    return render(
        Page(title="V", verdict=verdict, figures=(), template="valve.html.jinja", sections={}, missing=())
    )


REASONS, CAUTIONS = tuple(f"reason {i}" for i in range(5)), tuple(f"caution {i}" for i in range(4))


@pytest.mark.parametrize(
    ("kind", "reasons", "seen"),
    [
        ("good", (), CAUTIONS),
        ("bad", REASONS, REASONS[:2]),
        ("bad", REASONS[:1], (REASONS[0], CAUTIONS[0])),
        ("open", REASONS, (*REASONS[:2], CAUTIONS[0])),
    ],
)  # fmt: skip
def test_few_lines_of_a_verdict_stand_open_and_none_is_lost(kind, reasons, seen):
    """All that qualifies a good verdict stands open; nothing pushes the figure off the first screen."""
    html = page_with(Headline(kind=kind, text="It.", reasons=reasons, cautions=CAUTIONS))
    verdict = html[html.index('<div class="verdict') :]
    verdict = verdict[: verdict.index("</div>")]
    opened, _, folded = verdict.partition("<details>")
    items = [re.findall("<li[^>]*>(.*?)</li>", part) for part in (opened, folded)]
    assert tuple(items[0]) == seen
    assert sorted(items[0] + items[1]) == sorted((*reasons, *CAUTIONS))
    assert not items[1] or f"<summary>{len(items[1])} more</summary>" in verdict


def test_options_are_not_broken_and_commands_in_a_cell_are_commands():
    assert _tied("Declare --coil-temperature & go") == Markup(
        'Declare <span class="tied">--coil-temperature</span> &amp; go'
    )
    assert _finding("as `identify` writes it <b>") == Markup("as <code>identify</code> writes it &lt;b&gt;")
    assert "<code>" not in _finding("`<i>` `x")
    assert _cell("over-compensation") == "over-compensation"
    assert "breaks" in _cell("x" * 19) and "breaks" in _cell("ramp_dP1_1.csv.gz_and_more")


def label_places(svg):
    """Return where the pressure drops stand: x of each text ``4.00``, and of the tick ``−100``."""
    texts = re.findall(r'<text[^>]*?(?:x="(-?[\d.]+)"|translate\((-?[\d.]+)[^>]*)[^>]*>([^<]*)<', svg)
    return [(float(x or t), text) for x, t, text in texts]


def test_the_pressure_drops_of_negative_commands_stand_outside_the_curves(two_sides):
    """Left of the tick of -100 %, where every curve ends."""
    with figure_style():
        figure = characteristic_figure(characteristic_curves(None, two_sides, {}), AS_COMPUTED, PressureHues(()))
    places = label_places(figure.svg)
    end = next(x for x, text in places if text == "−100")
    labels = [x for x, text in places if text == "4.00"]
    assert len(labels) == 2 and min(labels) < end < max(labels)
