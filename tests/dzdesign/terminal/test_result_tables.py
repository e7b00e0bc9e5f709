"""Tables of results on a terminal: rows that fit, and what they say."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.report.lot.summary import FailedValve, LotSummary
from dzdesign.terminal.page import new_console
from dzdesign.terminal.verification_tables import print_scenarios
from dzdesign.verify.loop_results import ScenarioResult

FIGURES = {
    "compensated_flow_L_min": 12.9, "compensated_rise_ms": 4.0, "compensated_settling_ms": 9.6,
    "compensated_overshoot_percent": 6.31, "direct_flow_L_min": 0.0,
}  # fmt: skip


def scenario(name, **figures):
    return ScenarioResult(
        name=name, side="positive", dp_MPa=5.0, back_MPa=1.0, leak_L_min=0.0, q_zero_L_min=0.0,
        q_peak_at_zero_L_min=0.0, allowed_at_zero_L_min=None, unseen_below_L_min=None, must_shut=True,
        not_required="", figures=figures,
    )  # fmt: skip


@pytest.mark.parametrize("width", [80, 100, 140])
def test_scenarios_are_a_table_of_short_rows_and_lines(monkeypatch, capsys, width):
    monkeypatch.setenv("COLUMNS", str(width))
    names = ("step to half command and back", "sensor ahead shows full, or the one behind breaks")
    print_scenarios([scenario(names[0], **FIGURES), scenario(names[1])], new_console())
    table, _, lines = capsys.readouterr().out.partition(f"{names[0]}: ")
    rows = re.split("─{40,}", table)[1].splitlines()
    assert len([row for row in rows if row.strip()]) <= 3, "a row fills at most two lines"
    assert max(map(len, table.splitlines())) <= width and "further columns" not in table
    assert lines == (
        "with the compensator flow 12.9 L/min, rise 4 ms, settling 9.6 ms, overshoot 6.31 %; without it flow 0 L/min\n"
    )


def test_a_flow_that_the_recordings_can_not_show_is_no_zero(capsys):
    hidden = replace(scenario("step", **FIGURES), unseen_below_L_min=0.63, q_peak_at_zero_L_min=0.7)
    print_scenarios([hidden], new_console())
    out = capsys.readouterr().out
    assert re.search(r"5\.00 +1\.00 +below 0\.63 +0\.70", out) and "without it flow below 0.63 L/min" in out


def test_the_headline_of_a_batch_counts_calibrated_valves(capsys):
    from dzdesign.batch.printing import print_lot

    summary = LotSummary(
        tool=THIS_TOOL,
        made_from=(),
        valves=4,
        failed=(FailedValve(name="V4", status="failed", reason="no flow"),),
        verified=False,
        quantiles={},
        files={},
        lot_setting=None,
        why_no_lot_setting="none",
        anomalies=("two share a recording",),
        warnings={"onset-hidden": ("V1", "V2", "V3", "V4"), "pressure-stuck": ("V3",)},
    )
    print_lot(summary, Path("out"))
    said = capsys.readouterr().out
    assert "3 calibrated valves of 4" in said and "odd: two share a recording" in said
    assert "warnings: pressure-stuck 1 (V3), onset-hidden 4" in said
