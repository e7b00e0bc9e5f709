"""The curves of the first page: measured ones lead, and all that is drawn can be downloaded."""

import csv
import io

import numpy as np
import pytest

from dzdesign.assess.assessing import assess
from dzdesign.assess.options import AssessOptions
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.identify.identification import identify
from dzdesign.report.characteristic.curves import characteristic_curves
from dzdesign.report.figures.characteristic import characteristic_figure
from dzdesign.report.figures.figure import figure_style
from tests.support.bench_recordings import AFTER, BEFORE, record
from tests.support.synthetic import Truth, synthetic_ramp

LOOP = "time_s,command_percent,q_without_2.0000_MPa_L_min,q_with_2.0000_MPa_L_min\n" + "".join(
    f"{i},{share},{max(0, share - 54)},{0.5 * share}\n"
    for i, share in enumerate([*range(0, 101, 2), *range(98, -1, -2)])
)


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
    assert origins(characteristic_curves(None, None, loops)) == {("before", "simulated"), ("after", "simulated")}
    assert origins(characteristic_curves(valve, None, loops)) == {("before", "recorded"), ("after", "simulated")}
    measured = characteristic_curves(valve, assessment, loops)
    assert origins(measured) == {("before", "recorded"), ("after", "recorded")}
    assert all(curve.samples for curve in measured)
    assert characteristic_curves(None, None, {}) == ()


def test_a_negative_side_lies_below_and_left_of_zero():
    curves = characteristic_curves(None, None, {"closed_loop_negative.csv": LOOP, "closed_loop_positive.csv": LOOP})
    for sign, side in ((1, "positive"), (-1, "negative")):
        ends = [curve.end for curve in curves if curve.side == side]
        assert len(ends) == 2 and all(np.sign(value) == sign for end in ends for value in end)


def test_a_branch_of_the_loop_is_cut_at_the_top_and_rises():
    curves = characteristic_curves(None, None, {"closed_loop_positive.csv": LOOP})
    for curve in curves:
        assert list(curve.branches) == ["opening", "closing"]
        for points in curve.branches.values():
            assert np.all(np.diff(points.command) > 0) and points.command[-1] == pytest.approx(1.0)


@pytest.mark.parametrize("text", ["a,b\n1,2\n", LOOP.replace("q_with_2.0000", "q_with_two"), "no table"])
def test_a_file_that_is_no_table_of_ramps_is_refused(text):
    with pytest.raises(InputError, match="closed_loop_positive"):
        characteristic_curves(None, None, {"closed_loop_positive.csv": text})


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
