"""The curves of the first page: measured ones lead, and all that is drawn can be downloaded."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from dzdesign.assess.assessing import assess
from dzdesign.assess.options import AssessOptions
from dzdesign.assess.thinned_curves import Line, gain_of, hysteresis_of, linearity_of
from dzdesign.core.recorded_units import AS_COMPUTED, FlowUnit, RecordedUnits
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.figure import figure_style
from dzdesign.report.sections.characteristic import characteristic_figure, characteristic_section
from dzdesign.report.sections.quantities import characteristic_curves, characteristic_quantities
from dzdesign.report.sections.valve import conditions_section
from dzdesign.report.summary import measured_figures
from tests.support.bench_recordings import AFTER, BEFORE, L_MIN, record
from tests.support.synthetic import Truth, synthetic_ramp

COMMAND = np.array([*range(0, 101, 2), *range(98, -1, -2)], dtype=float)
LOOP = {
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
    loops = {"closed_loop_positive.csv": LOOP}
    assert origins(characteristic_curves(None, None, loops)) == {("after", "simulated")}
    assert origins(characteristic_curves(valve, None, loops)) == {("before", "recorded"), ("after", "simulated")}
    measured = characteristic_curves(valve, assessment, loops)
    assert origins(measured) == {("before", "recorded"), ("after", "recorded")}
    assert all(curve.samples for curve in measured)
    assert characteristic_curves(None, None, {}) == ()


def test_a_negative_side_lies_below_and_left_of_zero():
    curves = characteristic_curves(None, None, {"closed_loop_negative.csv": LOOP, "closed_loop_positive.csv": LOOP})
    for sign, side in ((1, "positive"), (-1, "negative")):
        ends = [curve.end for curve in curves if curve.side == side]
        assert len(ends) == 1 and all(np.sign(value) == sign for end in ends for value in end)


def test_a_branch_of_the_loop_is_cut_at_the_top_and_rises():
    curves = characteristic_curves(None, None, {"closed_loop_positive.csv": LOOP})
    for curve in curves:
        assert list(curve.branches) == ["opening", "closing"]
        for points in curve.branches.values():
            assert np.all(np.diff(points.command) > 0) and points.command[-1] == pytest.approx(1.0)


def test_all_that_is_drawn_stands_in_the_table_behind_the_figure(valve):
    curves = characteristic_curves(valve, None, {"closed_loop_positive.csv": LOOP})
    with figure_style():
        figure = characteristic_figure(curves, AS_COMPUTED)
    rows = list(csv.DictReader(io.StringIO(figure.csv)))
    drawn = sum(points.command.size for curve in curves for points in (*curve.branches.values(), *curve.samples))
    assert len(rows) == drawn
    assert {row["what"] for row in rows} == {"opening", "closing", "sample"}
    assert characteristic_figure((), AS_COMPUTED) is None
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
    labels = [figure.label for figure in measured_figures(limited)]
    assert labels[:2] == ["Dead zone on opening, measured", "Dead zone on closing, measured"]
    assert measured_figures(None) == ()


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
