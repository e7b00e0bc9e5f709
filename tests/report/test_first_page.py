"""What a stranger reads first is true of this valve and says something; measured curves lead, and can be downloaded."""

import csv
import io
import json
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.assess.assessing import assess
from dzdesign.assess.options import AssessOptions
from dzdesign.assess.readings import Line, gain_of, hysteresis_of, linearity_of
from dzdesign.core.recorded_units import AS_COMPUTED, FlowUnit, RecordedUnits
from dzdesign.design.redesign import without_sensors
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefacts import Chain
from dzdesign.report.figure import PressureHues, figure_style
from dzdesign.report.sections.characteristic import characteristic_figure, characteristic_section
from dzdesign.report.sections.closed_loop import scenarios_table, worst_of_each
from dzdesign.report.sections.quantities import (
    CharacteristicQuantities,
    Found,
    PressureQuantities,
    characteristic_curves,
    characteristic_quantities,
)
from dzdesign.report.sections.valve import RECORDED, certificate_lines, conditions_section
from dzdesign.report.summary import key_figures, sets_in_words, unrequired_flow, valve_name
from dzdesign.report.valve_report import REPORT_NAME
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED
from dzdesign.verify.closed_loop.scene import NO_CORE_CAN_KNOW
from dzdesign.verify.loop_results import ScenarioResult
from tests.support.bench_recordings import AFTER, BEFORE, L_MIN, record
from tests.support.designs import designed
from tests.support.evidence import LOOP, evidence_with, pressure_result, read_evidence
from tests.support.paths import ROOT
from tests.support.synthetic import Truth, needs_compiler, synthetic_ramp

RUN = ScenarioResult(
    name="sensor A is stuck", side="positive", dp_MPa=1.0, back_MPa=0.0, leak_L_min=0.0, allowed_at_zero_L_min=None,
    unseen_below_L_min=None, q_zero_L_min=0.0, q_peak_at_zero_L_min=0.0, must_shut=True, not_required="", figures={},
)  # fmt: skip


def test_a_margin_says_of_what_it_is_and_where_the_reserve_is(example_valve, example_compensator, reported_demo):
    """Seeded: a margin of 0.000110 mA looked like no reserve at all."""
    evidence = read_evidence(reported_demo / "evidence")
    (of_law,) = certificate_lines(example_compensator, None)
    assert "the statistical reserve is in that offset" in of_law
    (of_c,) = certificate_lines(example_compensator, evidence)
    assert "of the C code: rounding alone; the statistical reserve is in the bound" in of_c
    assert evidence.inputs[0].smallest_margin_V < example_compensator.positive.certificate.mean_loss_V
    machine = designed(example_valve, coil_temperature="-20..80 degC", supply="18..32 V")
    (of_machine,) = certificate_lines(machine, evidence)
    assert "of the C code; the statistical reserve is in the bound" in of_machine


def tiles(chain, found):
    return {each.label: each for each in key_figures(chain, found)}


def quantities(dp_MPa=1.0, **values):
    """The quantities at one pressure drop: name -> (without, with)."""
    sets = [{key: Found(pair[at]) for key, pair in values.items()} for at in (0, 1)]
    return PressureQuantities(side="positive", dp_MPa=dp_MPa, reading_flow_L_min=0.6, before=sets[0], after=sets[1])


def of_sets(*pressures):
    return CharacteristicQuantities(pressures=pressures, before="recorded", after="recorded")


def test_a_tile_says_the_worst_of_its_table_and_a_dead_zone_is_read_where_all_are_seen():
    hidden = {"onset_opening": (50.0, None), "dead_zone_opening": (52.0, 3.0)}
    seen = {"onset_opening": (48.0, 1.0), "dead_zone_opening": (53.0, 2.0)}
    one = quantities(largest_flow=(10.0, 9.0), hysteresis=(1.0, 2.0), **hidden)
    other = quantities(2.0, largest_flow=(20.0, 20.0), hysteresis=(1.5, 1.0), **seen)
    found = tiles(Chain(), of_sets(one, other))
    assert found["Dead zone on opening"].value == "53.0 % → 3.0 %"
    assert "at the reading flow" in found["Dead zone on opening"].note
    assert found["Largest flow"].value == "20.0 → 20.0 L/min"
    assert "at least 90.0\u00a0% remains" in found["Largest flow"].note
    assert found["Hysteresis"].value == "1.5 % → 2.0 %"
    assert "Flow at zero command" not in found
    assert "onset" in tiles(Chain(), of_sets(other))["Dead zone on opening"].note


def test_a_fixed_offset_stands_beside_the_dead_zone_that_the_law_leaves(example_compensator):
    found = of_sets(quantities(onset_opening=(50.0, 1.0)))
    fixed = without_sensors(example_compensator).onset
    tile = tiles(Chain(compensator=example_compensator), found)["Dead zone on opening"]
    assert tile.beside == f"fixed MIN offset: {100 * fixed:.1f} %" and fixed > 0.02
    assert tiles(Chain(), found)["Dead zone on opening"].beside == ""


@pytest.mark.parametrize(("flow", "value", "kind"), [(0.0, "none", "text"), (0.7, "0.7 L/min", "bad")])
def test_a_flow_at_zero_command_in_the_loop_is_loud(flow, value, kind):
    loop = pressure_result(dp_MPa=1.0, q_zero_L_min=flow)
    evidence = evidence_with(closed_loop=replace(LOOP, pressures=(loop,)))
    found = CharacteristicQuantities(pressures=(quantities(flow_at_zero=(None, flow)),), before=None, after="simulated")
    tile = tiles(Chain(evidence=evidence), found)["Flow at zero command"]
    assert (tile.value, tile.kind) == (value, kind)
    assert sets_in_words(found, AS_COMPUTED) == (
        "With the compensator (simulated closed loop); at 1.00 MPa, the one pressure drop tested."
    )


def test_the_flow_at_zero_that_was_recorded_stands_before_the_simulated_one(example_valve):
    """Seeded: a dash stood for the meter's noise level, or the leak, of a valve recorded at zero command."""
    leaks = replace(example_valve.sides["positive"].tests[0], leak_L_min=0.2)
    side = replace(example_valve.sides["positive"], tests=(leaks, *example_valve.sides["positive"].tests[1:]))
    valve = replace(example_valve, sides={"positive": side})
    curves = characteristic_curves(valve, None, {})
    leaking, *others = characteristic_quantities(valve, None, (), curves).pressures
    assert leaking.before["flow_at_zero"].value == 0.2
    for each, test in zip(others, side.tests[1:], strict=True):
        assert each.before["flow_at_zero"].value is None
        assert each.before["flow_at_zero"].at_most == test.noise_level_L_min > 0
    away = [replace(each, branches={name: replace(line, command=line.command + 0.02)
                                    for name, line in each.branches.items()}) for each in curves]  # fmt: skip
    assert not any("flow_at_zero" in each.before for each in characteristic_quantities(valve, None, (), away).pressures)


def test_rows_of_one_scenario_say_which_runs_they_are_of():
    """Seeded: one name stood twice, once required and once not."""
    unknown = {"must_shut": False, "not_required": NO_CORE_CAN_KNOW}
    runs = [RUN, *(replace(RUN, dp_MPa=dp, **unknown) for dp in (4.0, 2.0)), replace(RUN, name="load step")]
    found = [(row[0].text, row[0].more) for row in scenarios_table(runs, worst_of_each(runs), AS_COMPUTED).rows]
    assert found == [(RUN.name, "at 1.00 MPa"), (RUN.name, "at 2.00, 4.00 MPa"), ("load step", "")]
    other = [replace(each, side="negative") for each in runs[:2]]
    every = [*runs, *other]
    found = [row[0].more for row in scenarios_table(every, worst_of_each(every), AS_COMPUTED).rows]
    assert found == [
        "positive commands, at 1.00 MPa; negative commands, at 1.00 MPa",
        "positive commands, at 2.00, 4.00 MPa; negative commands, at 4.00 MPa",
        "",
    ]


def test_init_names_every_entry_of_the_record_that_a_report_asks_for(example_valve):
    """Seeded: the report missed a filter of which the file that `init` writes knew nothing."""
    template = ROOT / "dzdesign" / "dzdesign" / "stages" / "templates" / "dzdesign.toml.jinja"
    lines = template.read_text(encoding="utf-8").partition("# [record]\n")[2]
    record = tomllib.loads(lines.replace("# ", ""))
    names = {name.replace("-", " ") for name in record}
    assert all(names & set(known) for known in RECORDED.values())
    filled = replace(example_valve, record={name: str(text) for name, text in record.items()})
    assert conditions_section(filled, None).missing == ""
    assert valve_name(filled.record) == f"{record['type']}, serial number {record['serial']}"


# --- the largest flow at zero command that no requirement forbids stands with the verdict ---

COLD = replace(
    RUN, name="coil 40 K colder", dp_MPa=5.0, unseen_below_L_min=0.6, q_zero_L_min=5.02, must_shut=False,
    not_required=NOT_DECLARED,
)  # fmt: skip
BOTH = replace(COLD, name="coil 40 K colder, supply voltage 20% higher", q_zero_L_min=11.52)
STUCK = replace(COLD, name="dP above the tests", q_zero_L_min=0.9, not_required=NO_CORE_CAN_KNOW)


def said(*scenarios: ScenarioResult) -> str:
    return unrequired_flow(replace(evidence_with(), scenarios=scenarios), AS_COMPUTED)


def test_the_largest_flow_leads_with_its_remedy():
    text = said(COLD, BOTH, STUCK)
    assert f"up to 11.5 L/min at zero command ({BOTH.name}; in the runs for 5.00 MPa)" in text
    assert "--coil-temperature" in text and "5.02" not in text


def test_what_no_declaration_changes_has_its_reason():
    assert said(STUCK).endswith(f"Reason: {NO_CORE_CAN_KNOW}.") and "--coil-temperature" not in said(STUCK)


@pytest.mark.parametrize(
    "change",
    [
        {"must_shut": True, "not_required": ""},  # a failure, which the verdict names itself
        {"q_zero_L_min": 0.59},  # hidden by the meter
        {"unseen_below_L_min": None, "q_zero_L_min": 0.0},
        {"leak_L_min": 5.02},  # no compensator can stop it
        {"allowed_at_zero_L_min": 6.0},
        {"figures": {"flow_after_zero_command_L_min": 26.0}},  # of full command at a restart
    ],
)
def test_what_is_no_unrequired_flow_is_not_said(change):
    assert said(replace(COLD, **change)) == ""


@needs_compiler
def test_it_stands_open_with_a_good_verdict_and_follows_from_the_scenarios(reported_demo):
    html = (reported_demo / "evidence" / REPORT_NAME).read_text(encoding="utf-8")
    evidence = json.loads((reported_demo / "evidence" / "verification.json").read_bytes())
    passing = [each["q_zero_L_min"] for each in evidence["scenarios"] if not each["must_shut"]]
    verdict = html[html.index('<div class="verdict good"') :].partition("<details")[0]
    (line,) = re.findall(r'<li class="unrequired">(.*?)</li>', verdict)
    assert f"{max(passing):.3g} L/min" in line and max(passing) > 1


COMMAND = np.array([*range(0, 101, 2), *range(98, -1, -2)], dtype=float)
CURVES_OF_LOOP = {
    "command_percent": COMMAND, "q_without_2.0000_MPa_L_min": np.maximum(0.0, COMMAND - 54),
    "q_with_2.0000_MPa_L_min": 0.5 * COMMAND,
}  # fmt: skip
LIMITS = {"dead_zone_opening": 0.5, "hysteresis": 0.0001}


@pytest.fixture(scope="module")
def valve():
    return identify([synthetic_ramp(2.0, Truth())])


@pytest.fixture(scope="module")
def assessment():
    return assess([record(BEFORE, seed=1)], [record(AFTER, seed=2)], AssessOptions())


def origins(curves):
    return {(curve.set, curve.origin) for curve in curves}


def test_measured_curves_lead_over_those_of_the_valve_and_of_the_loop(valve, assessment):
    loops = {"closed_loop_positive.csv": CURVES_OF_LOOP}
    assert origins(characteristic_curves(None, None, loops)) == {("after", "simulated")}
    assert origins(characteristic_curves(valve, None, loops)) == {("before", "recorded"), ("after", "simulated")}
    measured = characteristic_curves(valve, assessment, loops)
    assert origins(measured) == {("before", "recorded"), ("after", "recorded")}
    assert all(curve.samples for curve in measured)
    assert characteristic_curves(None, None, {}) == ()


def test_a_negative_side_lies_below_and_left_of_zero():
    loops = {f"closed_loop_{side}.csv": CURVES_OF_LOOP for side in ("negative", "positive")}
    curves = characteristic_curves(None, None, loops)
    for sign, side in ((1, "positive"), (-1, "negative")):
        ends = [curve.end for curve in curves if curve.side == side]
        assert len(ends) == 1 and all(np.sign(value) == sign for end in ends for value in end)


def test_a_branch_of_the_loop_is_cut_at_the_top_and_rises():
    curves = characteristic_curves(None, None, {"closed_loop_positive.csv": CURVES_OF_LOOP})
    for curve in curves:
        assert list(curve.branches) == ["opening", "closing"]
        for points in curve.branches.values():
            assert np.all(np.diff(points.command) > 0) and points.command[-1] == pytest.approx(1.0)


def test_all_that_is_drawn_stands_in_the_table_behind_the_figure(valve):
    curves = characteristic_curves(valve, None, {"closed_loop_positive.csv": CURVES_OF_LOOP})
    with figure_style():
        figure = characteristic_figure(curves, AS_COMPUTED, PressureHues(()))
    rows = list(csv.DictReader(io.StringIO(figure.csv)))
    drawn = sum(points.command.size for curve in curves for points in (*curve.branches.values(), *curve.samples))
    assert len(rows) == drawn
    assert {row["what"] for row in rows} == {"opening", "closing", "sample"}
    assert characteristic_figure((), AS_COMPUTED, PressureHues(())) is None
    assert "No negative commands were tested" in figure.caption


# --- the quantities: a straight valve, whose every quantity follows by algebra ---


@pytest.fixture(scope="module")
def straight_valve() -> ValveModel:
    record = {"serial": "4711", "Oil": "HLP 46", "oil-temperature": "40 °C"}
    return identify([synthetic_ramp(dp, Truth()) for dp in (1.0, 4.0)], IdentifyOptions(meter_lag=0.0), record=record)


@pytest.fixture(scope="module")
def limited():
    options = AssessOptions(reading=IdentifyOptions(meter_lag=0.0), reading_flow=1.0 * L_MIN, limits=LIMITS)
    return assess([record(BEFORE, seed=1)], [record(AFTER, seed=2)], options)


def test_a_straight_valve_reads_what_it_is(straight_valve):
    """Knee 5.4 V opening and 5.3 V closing, 4 L/min/V: by algebra."""
    found = characteristic_quantities(straight_valve, None, (), characteristic_curves(straight_valve, None, {}))
    assert (found.before, found.after) == ("recorded", None)
    for each in found.pressures:
        value = {key: one.value for key, one in each.before.items()}
        assert value["onset_opening"] == pytest.approx(54.0, abs=0.3)
        assert value["onset_closing"] == pytest.approx(53.0, abs=0.3)
        level = 10 * each.reading_flow_L_min / 4.0  # of a straight line
        assert value["dead_zone_opening"] == pytest.approx(54.0 + level, abs=0.4)
        assert value["hysteresis"] == pytest.approx(1.0, abs=0.25)
        assert value["gain"] == pytest.approx(4.0, rel=0.01)
        assert value["largest_flow"] == pytest.approx(4.0 * (10 - 5.35), rel=0.02)
        assert each.after == {}


def test_measured_values_lead_and_limits_stand_beside_what_they_limit(straight_valve, limited):
    found = characteristic_quantities(straight_valve, limited, (), ())
    (each,) = found.pressures
    item = limited.pressures[0]
    for key in ("dead_zone_opening", "hysteresis", "linearity", "gain"):
        both = item.quantities[key]
        assert (each.before[key].value, each.after[key].value) == (both.before.value, both.after.value)
    assert {key: limit.holds for key, limit in each.limits.items()} == {"dead_zone_opening": True, "hysteresis": False}
    (table,) = characteristic_section(found, AS_COMPUTED).tables
    rows = {row[0].text: row for row in table.rows}
    assert rows["Hysteresis"][-1].text == "✗ fail" and rows["Hysteresis"][2].kind == "bad"
    assert rows["Dead zone at the reading flow, opening"][-1].text == "✓ pass"
    assert rows["Linearity"][-1].text == ""
    said = sets_in_words(found, AS_COMPUTED)
    assert said.startswith("Without → with the compensator (recorded → recorded); at 1.00 MPa")
    assert key_figures(Chain(), characteristic_quantities(None, None, (), ())) == ()


def test_flows_stand_in_the_units_of_the_recordings(straight_valve):
    found = characteristic_quantities(straight_valve, None, (), characteristic_curves(straight_valve, None, {}))
    units = RecordedUnits(flow=FlowUnit(unit="L/h", factor=60.0))
    tables = [characteristic_section(found, each).tables[0] for each in (AS_COMPUTED, units)]
    rows = [{row[0].text: row for row in table.rows}["Largest flow"] for table in tables]
    assert [row[1].text for row in rows] == ["L/min", "L/h"]
    assert float(rows[1][2].text) == pytest.approx(60 * float(rows[0][2].text), rel=1e-3)


def test_conditions_are_those_of_the_recordings_and_what_lacks_is_said(straight_valve, limited):
    (table,) = conditions_section(straight_valve, None).tables
    rows = {row[0].text: row[1].text for row in table.rows}
    assert rows["Oil"] == "HLP 46" and rows["Oil temperature"] == "40 °C" and rows["Filter"] == "not recorded"
    assert rows["Ramp rate"] == "0.1 V/s" and rows["Sampling"] == "50 Hz"
    assert "filter" in conditions_section(straight_valve, None).missing
    filled = replace(straight_valve, record={**straight_valve.record, "filter": "none"})
    assert conditions_section(filled, None).missing == ""
    (table,) = conditions_section(straight_valve, limited).tables
    assert table.columns == ("", "without the compensator", "with the compensator")
    assert conditions_section(None, None).tables == ()


def test_a_thinned_curve_comes_to_what_the_whole_does():
    """Hysteresis, gain and linearity of a line by algebra; a bend adds half its rise to the linearity at most."""
    u = np.linspace(0, 1, 201)
    up, down = Line(u, 20 * np.maximum(u - 0.12, 0)), Line(u, 20 * np.maximum(u - 0.1, 0))
    assert hysteresis_of(up, down) == pytest.approx(0.02, abs=1e-6)
    assert gain_of((up, down)) == pytest.approx(20.0, rel=1e-6)
    assert linearity_of((Line(u, 20 * u),), 20.0) == pytest.approx(0.0, abs=1e-9)
    bent = Line(u, 20 * u**2)
    assert 0.05 < linearity_of((bent,), 20.0) < 0.15
    assert hysteresis_of(up, down, floor=19.0) is None  # of a meter that shows next to nothing
    assert linearity_of((Line(u[50:], u[50:]),), 20.0) is None and gain_of(()) is None
    assert np.isnan(up.command_at(100.0))
