"""What the outputs say, in words that an engineer has, each of them in the glossary."""

import itertools
import re
from dataclasses import replace
from pathlib import Path

import pytest

from dzdesign.codegen.project import target_named
from dzdesign.core.artefact_types import THIS_TOOL
from dzdesign.design.designing import design as design_valve
from dzdesign.design.options import options_of
from dzdesign.report.lot.summary import FailedValve, LotSummary
from dzdesign.terminal.notebook import html_of
from dzdesign.terminal.page import new_console
from dzdesign.terminal.tables import print_compensator, print_valve
from dzdesign.terminal.verification_tables import print_scenarios
from dzdesign.verify.loop_results import ScenarioResult
from tests.support.paths import ROOMS, ROOT

GLOSSARY = (ROOT / "docs/concepts/glossary.md").read_text("utf-8")
FIRMWARE = (ROOT / "docs/reference/firmware.md").read_text("utf-8")
MOST_ENTRIES = 40
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


def test_numbers_of_the_law_are_put_into_words(example_valve, capsys):
    print_valve(example_valve)
    valve = capsys.readouterr().out
    number = r"0\.\d{4} ± 0\.\d{4}"
    valves_range = rf"drive range of the valve \(knee to full stroke\): k x_max/u_max = {number} of full command"
    assert re.search(f"{valves_range}, from largest flow and slope at dP0", valve)
    hiding = {"pressure_a": "0..3 V", "accept": "broken-sensor"}
    example_compensator = design_valve(example_valve, options_of(hiding, target_named("f28335").inputs()))
    print_compensator(example_compensator)
    design = capsys.readouterr().out
    # What the signals hide is no cost among others: it comes first.
    first = design.index("warning: of sensor A a broken wire")
    assert first < design.index("law: 'paper', Eq. (18)") < design.index("note: ") and "note: of sensor" not in design
    travel = r"at dP0 \(the opening threshold plus three standard errors\), drive range of the law k x_max/u_max = "
    travel += r"\d+/\d+ = 0\.\d{5} \(from there to"
    assert re.search(travel, design)
    nodes = len(example_compensator.positive.beta)
    tables = f"beta tables: {nodes} nodes each, for the line and for the offset, linear between them, resolution "
    assert f"{tables}1/32768" in design
    assert re.search(valves_range, html_of(example_valve))


def test_no_output_calls_a_code_sound():
    """The word stays in the code, where its meaning stands beside it; a reader of an output has no such place."""
    printed = ("codegen/**/*.jinja", "*/dzdesign/**/schemas/*.json", "tests/goldens*/*/core/*")
    files = [path for pattern in printed for path in ROOT.glob(pattern) if path.is_file()]
    assert len(files) > 60
    for path in files:
        assert not re.search(r"\b(un)?sound", path.read_text("utf-8")), path
    outputs = sorted(path for room in ("verify", "design", "codegen") for path in (ROOT / room).rglob("*.py"))
    assert len(outputs) > 60
    for path in outputs:
        strings = re.findall(r'f?"[^"\n]*"', re.sub(r'"""(?s:.*?)"""', "", path.read_text("utf-8")))
        texts = [re.sub(r"{.*?}", "", text) for text in strings if " " in text]  # one word alone is a field's name
        assert [text for text in texts if re.search(r"\b(un)?sound\b", text)] == [], path


def test_every_word_of_the_outputs_is_in_the_glossary():
    terms = [
        re.sub(r"\[(.*)\]\(.*\)", r"\1", line)
        for line, after in itertools.pairwise(GLOSSARY.splitlines())
        if after.startswith(": ")
    ]
    assert len(terms) <= MOST_ENTRIES, "a glossary that is read has few entries"
    assert re.findall(r"^## (.*)", GLOSSARY, re.MULTILINE) == ["Valve", "Law", "Firmware", "Files and verdicts"]
    words = [word for term in terms for word in term.split(", ")]
    said = {
        "command", "u", "drive", "pressure drop", "dP", "opening", "closing", "dead zone", "knee", "onset", "threshold",
        "tail", "noise level", "meter's floor", "dP0", "u_min0", "offset", "beta", "drive range", "k x_max/u_max",
        "trend", "bound", "premise", "certificate", "guard", "budget", "over-compensation", "residual dead zone",
        "zero band", "transition", "play", "code", "valid range", "compare value", "exactly rounded law", "every input",
        "closed loop", "plant", "scenario", "mutant", "artefact", "HOLDS", "DOES NOT HOLD", "NOT CHECKED",
        "NOT RUN (optional)", "lot setting",
    }  # fmt: skip
    assert said <= set(words), said - set(words)
    assert len(words) == len(set(words)), "a word stands there twice"


def test_every_word_of_a_verdict_is_in_one_table():
    """Each as the outputs print it; a word that none prints any more is not kept."""
    table = FIRMWARE.partition("\n## Words of a verdict\n")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([^|]+) \| ([^|]+\.) \|$", table, re.MULTILINE)
    words = [word for row, _ in rows for word in row.split(", ")]
    assert words == [
        "HOLDS", "DOES NOT HOLD", "NOT CHECKED", "NOT RUN (optional)", "NOT REQUIRED", "NOT VERIFIED", "CHANGED",
        "SIMULATED", "ACCEPTED", "EXCEEDED", "OVER-COMPENSATED",
        "not required: the firmware cannot detect it", "agrees", "MISSED",
    ]  # fmt: skip
    sources = [path for room in ROOMS for path in (ROOT / room).rglob("*") if path.suffix in {".py", ".jinja"}]
    printed = " ".join(" ".join(path.read_text("utf-8") for path in sources).split())
    assert [word for word in words if word.rpartition(": ")[2] not in printed] == []


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
