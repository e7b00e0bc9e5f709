"""The largest flow at zero command that no requirement forbids stands with the verdict, as the scenarios have it."""

import json
import re
from dataclasses import replace

import pytest

from dzdesign.core.recorded_units import AS_COMPUTED
from dzdesign.report.summary import unrequired_flow
from dzdesign.report.valve_report import report_of_folder
from dzdesign.verify.closed_loop.drive_corners import NOT_DECLARED
from dzdesign.verify.closed_loop.scene import NO_CORE_CAN_KNOW
from dzdesign.verify.loop_results import ScenarioResult
from tests.support.evidence import evidence_with
from tests.support.synthetic import needs_compiler

COLD = ScenarioResult(
    name="coil 40 K colder", side="positive", dp_MPa=5.0, back_MPa=0.0, leak_L_min=0.0, allowed_at_zero_L_min=None,
    unseen_below_L_min=0.6, q_zero_L_min=5.02, q_peak_at_zero_L_min=5.1, must_shut=False, not_required=NOT_DECLARED,
    figures={},
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
    html = report_of_folder(reported_demo).html
    evidence = json.loads((reported_demo / "evidence" / "verification.json").read_bytes())
    passing = [each["q_zero_L_min"] for each in evidence["scenarios"] if not each["must_shut"]]
    verdict = html[html.index('<div class="verdict good"') :].partition("<details")[0]
    (line,) = re.findall(r'<li class="unrequired">(.*?)</li>', verdict)
    assert f"{max(passing):.3g} L/min" in line and max(passing) > 1
