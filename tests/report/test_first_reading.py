"""What a stranger reads first is true of this valve and says something: warnings, cards, counts, names, numbers."""

import json
import re
import tomllib
from dataclasses import replace

import pytest

from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.report.artefacts import Chain, standing_warnings
from dzdesign.report.sections.closed_loop import scenarios_table
from dzdesign.report.sections.provenance import warnings_section
from dzdesign.report.sections.quantities import characteristic_curves, characteristic_quantities
from dzdesign.report.sections.valve import RECORDED, conditions_section
from dzdesign.report.summary import key_figures, unrequired_flow, valve_name
from dzdesign.report.valve_report import REPORT_NAME
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED
from dzdesign.verify.closed_loop.scene import NO_CORE_CAN_KNOW
from dzdesign.verify.loop_results import ScenarioResult
from tests.support.designs import BOTH_SIGNS, designed
from tests.support.evidence import LOOP, evidence_with, pressure_result, read_evidence
from tests.support.golden_firmware import FULL, golden_valve
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

RUN = ScenarioResult(
    name="sensor A is stuck", side="positive", dp_MPa=1.0, back_MPa=0.0, leak_L_min=0.0, allowed_at_zero_L_min=None,
    unseen_below_L_min=None, q_zero_L_min=0.0, q_peak_at_zero_L_min=0.0, must_shut=True, not_required="", figures={},
)  # fmt: skip


def test_a_side_that_is_driven_is_not_said_to_be_left_out():
    """Seeded: the report of a firmware for commands of both signs warned that it drives one side."""
    both_sides = golden_valve(FULL)
    one, both = designed(both_sides), designed(both_sides, command_signal=BOTH_SIGNS)
    for compensator, said in ((one, True), (both, False), (None, True)):
        ((_, lines), *_) = warnings_section(both_sides, compensator).groups
        assert any(line.startswith("[two-sides]") for line in lines) is said
        assert ("two-sides" in {each.code for each in standing_warnings(both_sides, compensator)}) is said
        others = [each for each in standing_warnings(both_sides, compensator) if each.code != "two-sides"]
        assert others == [each for each in both_sides.warnings if each.code != "two-sides"]


def card(label, pressures, compensator=None, *inputs):
    evidence = evidence_with(closed_loop=replace(LOOP, pressures=pressures), inputs=inputs)
    chain = Chain(evidence=evidence, compensator=compensator)
    (found,) = [each for each in key_figures(chain, characteristic_quantities(None, None, pressures, ()))
                if each.label.startswith(label)]  # fmt: skip
    return found


def test_the_card_of_the_flow_at_zero_speaks_of_beta_only_where_beta_changes_it():
    unseen = pressure_result(dp_MPa=1.0, unseen_below_L_min=0.6, q_zero_without_beta_L_min=0.3)
    assert "β" not in card("Flow at zero", (unseen,)).note
    assert "(β) it would be 0.84 L/min" in card("Flow at zero", (replace(unseen, q_zero_without_beta_L_min=0.84),)).note


@needs_compiler
def test_a_small_margin_says_where_the_reserve_is(example_valve, example_compensator, reported_demo):
    """Seeded: a margin of 0.000110 mA on the first page looked like no reserve at all."""
    loops, (inputs,) = (pressure_result(dp_MPa=1.0),), read_evidence(reported_demo / "evidence").inputs
    of_law = card("Certificate", loops, example_compensator)
    assert "the statistical reserve is in that offset" in of_law.note
    of_c = card("Certificate", loops, example_compensator, inputs)
    assert "C code's output: rounding alone; the statistical reserve is in the bound" in of_c.note
    assert inputs.smallest_margin_V < example_compensator.positive.certificate.mean_loss_V
    machine = designed(example_valve, coil_temperature="-20..80 degC", supply="18..32 V")
    assert "lower bound; the statistical reserve is in the bound" in card("Certificate", loops, machine, inputs).note


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
    found = [(row[0].text, row[0].more) for row in scenarios_table(runs, AS_COMPUTED).rows]
    assert found == [(RUN.name, "at 1.00 MPa"), (RUN.name, "at 2.00, 4.00 MPa"), ("load step", "")]
    other = [replace(each, side="negative") for each in runs[:2]]
    found = [row[0].more for row in scenarios_table([*runs, *other], AS_COMPUTED).rows]
    assert found == [
        "positive commands, at 1.00 MPa; negative commands, at 1.00 MPa",
        "positive commands, at 2.00, 4.00 MPa; negative commands, at 4.00 MPa",
        "",
    ]


def test_init_names_every_entry_of_the_record_that_a_report_asks_for(example_valve):
    """Seeded: the report missed a filter of which the file that `init` writes knew nothing."""
    template = ROOT / "dzdesign" / "dzdesign" / "initial_options" / "templates" / "dzdesign.toml.jinja"
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
