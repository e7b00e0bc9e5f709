"""What evidence says of itself, and that every requirement is declared once."""

import json
from dataclasses import replace
from types import SimpleNamespace

from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.display import DOES_NOT_HOLD, NOT_CHECKED
from dzdesign.core.documents import to_json
from dzdesign.core.errors import InputError
from dzdesign.verify import requirements
from dzdesign.verify.evidence import Evidence
from dzdesign.verify.outputs import verification as outputs
from dzdesign.verify.requirements import AS_STATED, RAMPS, Requirement
from dzdesign.verify.verification import not_tried, untried_requirements
from tests.support.evidence import ALWAYS, DECLARED, EVIDENCE, read_evidence, with_checks
from tests.support.synthetic import needs_compiler

OPTIONAL = [requirements.RAMPS, requirements.MACHINE_CODE]


def test_every_requirement_has_its_id_its_title_and_a_way_to_have_it_checked():
    stated = [each for each in vars(requirements).values() if isinstance(each, Requirement)]
    of_outputs = {each for row in outputs.REQUIREMENTS for each in row.requirements}
    assert {*stated} == {*DECLARED} | of_outputs and len(DECLARED) == len({*DECLARED}) > 20
    assert {*DECLARED} >= {*ALWAYS, *OPTIONAL} and {*ALWAYS} == {*requirements.ALWAYS}
    for values in ({each.id for each in stated}, {each.title for each in stated}):
        assert len(values) == len(stated)
    assert all("`verify" in each.how for each in stated)


@needs_compiler
def test_every_check_of_a_firmware_is_of_a_declared_requirement(reported_demo):
    found = read_evidence(reported_demo / "evidence")
    declared = {each.id: each.title for each in DECLARED}
    assert all(check.name == declared[check.id] for check in found.checks)  # of one sign of command
    assert {each.id for each in ALWAYS} <= {check.id for check in found.checks}
    order = [each.id for each in DECLARED]
    assert [check.id for check in found.checks] == sorted((check.id for check in found.checks), key=order.index)


@needs_compiler
def test_findings_that_are_not_required_stand_beside_the_scenarios_alone(reported_demo):
    found = read_evidence(reported_demo / "evidence")
    counts = {check.id: len(check.not_required) for check in found.checks if check.not_required}
    assert counts == {requirements.ZERO_FLOW_AFTER_SCENARIOS.id: 2}


def test_of_a_lot_setting_the_recordings_of_one_valve_leave_the_others_as_stated():
    compared = with_checks(EVIDENCE, RAMPS.check(holds=True, text="every number the same"))
    assert EVIDENCE.reservation == AS_STATED and compared.reservation == ""
    lot = replace(compared, inputs=(SimpleNamespace(lot=SimpleNamespace(valves=7)), SimpleNamespace(lot=None)))
    assert lot.reservation == f"of the lot's other 6 valves {AS_STATED}"


def test_what_holds_follows_from_the_checks():
    passed, failed, unknown = (
        replace(EVIDENCE.checks[0], name=name, holds=holds) for name, holds in (("a", True), ("b", False), ("c", None))
    )
    assert EVIDENCE.holds and EVIDENCE.verdict == "Every requirement holds."
    assert with_checks(EVIDENCE, unknown).verdict == f"{NOT_CHECKED}: c"
    both = with_checks(EVIDENCE, unknown, failed, passed)
    assert not both.holds and both.verdict == f"{DOES_NOT_HOLD}: b; {NOT_CHECKED}: c"
    short = replace(EVIDENCE, checks=EVIDENCE.checks[1:])
    assert not short.holds and short.verdict == f"{NOT_CHECKED}: {EVIDENCE.checks[0].name}"


def test_evidence_is_read_as_it_was_written_and_not_where_it_contradicts_itself(wording):
    failed = with_checks(EVIDENCE, replace(EVIDENCE.checks[0], holds=False))
    assert read_artefact(to_json_bytes(failed), Evidence, "verification.json") == failed
    document = json.loads(to_json_bytes(failed))
    with wording.refusal(InputError, "evidence: said to hold, and does not"):
        read_artefact(to_json({**document, "holds": True}).encode(), Evidence, "verification.json")


def test_a_requirement_is_not_tried_until_a_check_of_it_is_there():
    for requirement in (*ALWAYS, *OPTIONAL):
        bare = replace(EVIDENCE, checks=(EVIDENCE.checks[0],))
        assert (requirement in untried_requirements(bare)) == (requirement.id != EVIDENCE.checks[0].id)
        tried = with_checks(bare, requirement.check(holds=None, text="not run"))
        assert requirement not in untried_requirements(tried)
        assert f"{requirement.title}: {requirement.how}" not in not_tried(tried)
