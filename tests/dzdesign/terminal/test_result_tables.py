"""Tables of results on a terminal: rows that fit, and what they say."""

import io
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from dzdesign.codegen.project import target_named
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.design.designing import design
from dzdesign.design.options import options_of
from dzdesign.report.lot.summary import FailedValve, LotSummary
from dzdesign.terminal.design_tables import print_compensator
from dzdesign.terminal.evidence_tables import print_loop
from dzdesign.terminal.page import new_console
from dzdesign.terminal.tables import gains_most, print_valve
from dzdesign.verify.loop_results import ScenarioResult
from tests.support.evidence import pressure_result

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


def evidence_of(*scenarios):
    """Evidence without ramps."""
    return SimpleNamespace(closed_loop=SimpleNamespace(pressures=()), scenarios=scenarios)


@pytest.mark.parametrize("both", [False, True])
def test_no_line_is_wider_than_a_terminal_of_80_columns(example_valve, both):
    """Seeded once: headers of long words made the closed loop's table 114 columns wide."""
    result = pressure_result(unseen_below_L_min=0.63, q_max_direct_L_min=135.7, q_max_L_min=135.7)
    evidence = evidence_of(scenario("sensor ahead shows full, or the one behind breaks", **FIGURES))
    loop = SimpleNamespace(pressures=[result, *[replace(result, side="negative")] * both], back_MPa=(0.0, 1.0))
    evidence.closed_loop = SimpleNamespace(**vars(loop), plant_source="a plant")
    page = Console(width=80, force_terminal=True, file=io.StringIO(), highlight=False)
    print_valve(example_valve, page)
    print_compensator(design(example_valve, options_of({}, target_named("f28335").inputs())), page)
    print_loop(evidence, page)
    lines = re.sub(r"\x1b\[[0-9;]*m", "", page.file.getvalue()).splitlines()
    assert len(lines) > 60 and max(map(len, lines)) <= 80


@pytest.mark.parametrize("width", [80, 100, 140])
def test_scenarios_are_a_table_of_short_rows_and_lines(monkeypatch, capsys, width):
    monkeypatch.setenv("COLUMNS", str(width))
    names = ("step to half command and back", "sensor ahead shows full, or the one behind breaks")
    print_loop(evidence_of(scenario(names[0], **FIGURES), scenario(names[1])), new_console())
    table, _, lines = capsys.readouterr().out.partition(f"{names[0]}: ")
    rows = re.split("─{40,}", table)[1].splitlines()
    assert len([row for row in rows if row.strip()]) <= 3, "a row fills at most two lines"
    assert max(map(len, table.splitlines())) <= width and "further columns" not in table
    assert lines == (
        "with the compensator flow 12.9 L/min, rise 4 ms, settling 9.6 ms, overshoot 6.31 %; without it flow 0 L/min\n"
    )


def test_a_flow_that_the_recordings_can_not_show_is_no_zero(capsys):
    hidden = replace(scenario("step", **FIGURES), unseen_below_L_min=0.63, q_peak_at_zero_L_min=0.7)
    print_loop(evidence_of(hidden), new_console())
    out = capsys.readouterr().out
    assert re.search(r"5\.00 +1\.00 +below 0\.63 +0\.70", out) and "without it flow below 0.63 L/min" in out


def test_the_headline_of_a_batch_counts_calibrated_valves(capsys):
    from dzdesign.batch.printing import lines_of_lot, print_quantiles

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
    print_quantiles(summary)
    said = "\n".join([capsys.readouterr().out, *lines_of_lot(summary, Path("out"))])
    assert "3 calibrated valves of 4" in said and "odd: two share a recording" in said
    assert "warnings: pressure-stuck 1 (V3), onset-hidden 4" in said


@pytest.mark.parametrize(
    ("bound", "offset", "budget", "origin", "scatter", "most"),
    [
        ([4.9, 4.7], [4.5, 4.5], 0.09, "repeats", 0.02, "More pressure drops"),
        ([4.9, 4.7], [4.88, 4.7], 0.09, "repeats", 0.02, "Slower ramps, or lag and zero"),
        ([4.9, 4.7], [4.88, 4.7], 0.01, "assumed", 0.02, "Repeated ramps"),
        ([4.9, 4.7], [4.88, 4.7], 0.01, "repeats", 0.02, "More ramps at each pressure drop"),
        ([4.9, 4.7], [4.88, 4.7], 0.01, "repeats", 0.005, "Slower ramps or a quieter meter"),
    ],
)
def test_identify_says_what_would_raise_the_offset_most(bound, offset, budget, origin, scatter, most):
    curve = SimpleNamespace(
        dp_MPa=(1.0, 5.0), u_threshold_V=(5.0, 4.8), u_lower_V=bound, offset_dp_MPa=(1.0, 5.0), offset_V=offset,
        proof=SimpleNamespace(shared_budget_V=0.0, ramps=[SimpleNamespace(budget_V=budget)] * 2),
    )  # fmt: skip
    basis = SimpleNamespace(repeatability=SimpleNamespace(origin=origin, sd_V=scatter))
    tests = [SimpleNamespace(u_knee_se_V=0.01)] * 2
    side = SimpleNamespace(curve=curve, valid_dp_MPa=(1.0, 5.0), certificate=basis, tests=tests)
    words = gains_most(side, AS_COMPUTED)
    between = 1e3 * (sum(bound) - sum(offset)) / 2
    assert "lies 100.0 mV below the threshold at the tests" in words and f"{between:.1f} mV more between" in words
    assert most in words and words.endswith("would gain most")
