"""The closed loop of a worn valve: judged by what was declared as allowed at zero command, a leak included."""

from dataclasses import replace

import pytest

from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.design.designing import design
from dzdesign.identify.identification import identify
from dzdesign.identify.options import IdentifyOptions
from dzdesign.report.sections.closed_loop import scenarios_table
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.closed_loop.loop_checks import no_flow_at_zero
from tests.identify.fitting.test_zero_flow import L_MIN, WORN, recordings
from tests.support.evidence import verify

QUICK = RampSequence(rest=1.0, ramp=10.0, top=0.5)


@pytest.fixture(scope="module")
def compensator():
    worn = replace(WORN, repeats=1)
    options = IdentifyOptions(meter_lag=0.0, zero_flow=0.35 * L_MIN, repeatability=5e-4)
    return design(identify(recordings(worn, pressures=(1.0, 3.0, 5.0)), options))


@pytest.fixture(scope="module")
def verified(compensator, tmp_path_factory):
    folder = tmp_path_factory.mktemp("worn") / "fw"
    made = generate(compensator, "host")
    write_folder(folder, made.files, made.manifest)
    return verify(folder, sequence=QUICK), made


def test_what_was_declared_is_required_and_said(verified, compensator):
    found, made = verified
    results = [loop.result for loop in found.loops]
    assert all(each.allowed_at_zero_L_min == pytest.approx(0.35) for each in results)
    # The worn edge does leak there: without the declaration this is a failure.
    assert max(each.q_zero_L_min for each in results) > 0.18
    for name in ("zero-flow", "zero-flow-after-scenarios"):
        (check,) = [check for check in found.evidence.checks if check.id == name]
        assert check.holds and "0.35 L/min" in check.text and "declared" in check.name
    # A worn edge leaks the more the higher the pressure; of a threshold that is taken as monotone alone nothing bounds
    # that above the tests, and the certificate ends with them.
    above = [each for each in found.evidence.scenarios if "above the tests" in each.name]
    assert {each.not_required for each in above} == {"not certified above 5.00 MPa"}
    assert any(found.startswith("not certified above 5.00 MPa: ") for found in check.not_required)
    header = " ".join(made.files["core/dz_valve.h"].replace(" * ", " ").split())
    assert "up to 0.35 L/min may flow, a leak included: the declared zero flow" in header
    assert compensator.positive.certificate.zero_flow_L_min == pytest.approx(0.35)


@pytest.mark.parametrize(("flow", "allowed", "leak", "holds"), [
    (0.35, 0.35, 0.0, True),
    (0.36, 0.35, 0.0, False),
    (0.36, 0.35, 0.36, True),  # what no compensator can stop is no failure of it
    (0.36, 0.35, 0.30, False),
    (0.10, None, 0.0, False),
    (0.10, None, 0.10, True),
])  # fmt: skip
def test_the_flow_at_zero_is_judged_by_what_is_allowed(verified, compensator, flow, allowed, leak, holds):
    result = replace(
        verified[0].loops[0].result, q_zero_L_min=flow, allowed_at_zero_L_min=allowed, leak_L_min=leak,
        unseen_below_L_min=None,
    )  # fmt: skip
    check = no_flow_at_zero([result], compensator, plant_given=True)
    assert check.holds is holds
    assert ("declared" in check.name) == (allowed is not None)


def test_the_report_says_what_is_allowed_in_place_of_shut(verified):
    table = scenarios_table(verified[0].evidence.scenarios, RecordedUnits())
    required = {row[-1].text for row in table.rows if not row[-1].text.endswith(": not required")}
    assert required == {"0.35 L/min at most"}
    bare = [replace(each, allowed_at_zero_L_min=None) for each in verified[0].evidence.scenarios]
    assert "shut" in {row[-1].text for row in scenarios_table(bare, RecordedUnits()).rows}
