"""What `verify` says and what its report says: one verdict, whatever else lies beside; and whose valve.json it is."""

import json
import shutil
from collections import Counter
from dataclasses import replace

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core import artefact_reading
from dzdesign.core.artefact_files import MANIFEST_NAME, TOOL, sha256_of, to_json, write_folder
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.report.valve_report import REPORT_NAME, report_of_folder, with_report
from dzdesign.verify.firmware.folder import read_compensator
from dzdesign.verify.untried import not_tried
from dzdesign.verify.verification import SCHEMA
from tests.support.attacked_firmware import sealed
from tests.support.evidence import evidence_with
from tests.support.synthetic import needs_compiler

pytestmark = [pytest.mark.slow, needs_compiler]


@pytest.fixture
def copied(reported_demo, tmp_path):
    return shutil.copytree(reported_demo, tmp_path / "demo")


def evidence_again(folder, output=None, change=lambda document: None):
    """The evidence folder written again as `verify` does, from what it found; its verdict, and its report's."""
    old = folder / "evidence"
    files = {path.name: path.read_bytes() for path in old.iterdir() if path.name not in (MANIFEST_NAME, REPORT_NAME)}
    document = json.loads(files["verification.json"])
    document["made_from"][0]["sha256"] = sha256_of((folder / "firmware" / MANIFEST_NAME).read_bytes())
    change(document)
    files["verification.json"] = to_json(document).encode()
    output = output or folder / "evidence"
    made = with_report(files, folder / "firmware", output)
    write_folder(output, made, {"schema": SCHEMA, "tool": TOOL, "made_from": document["made_from"]})
    return document["holds"], made[REPORT_NAME]


def strangers(folder):
    """Change or add what lies around a firmware, one way after another."""
    valve = json.loads((folder / "valve.json").read_bytes())
    (folder / "valve.json").write_text(to_json(sealed({**valve, "u_max_V": 11.0})))
    yield "valve.json"
    compensator = json.loads((folder / "compensator.json").read_bytes())
    (folder / "compensator.json").write_text(to_json({**compensator, "costs": []}))
    yield "compensator.json"
    shutil.copytree(folder / "firmware", folder / "a firmware")
    (folder / "a firmware/core/dz_comp.c").write_text("int edited;\n")
    yield "a copy of the firmware"
    limits = [{"quantity": "x", "place": "1 MPa", "limit": 1.0, "unit": "%", "holds": False, "text": "too much"}]
    (folder / "assessment.json").write_text(
        to_json({
            "schema": "dzdesign.assessment/1", "tool": valve["tool"], "made_from": valve["made_from"], "holds": False,
            "quantities": {}, "pressures": [], "limits": limits, "notes": [],
        })
    )  # fmt: skip
    yield "assessment.json"
    (folder / "more.json").write_text('{"schema": "dzdesign.valve/1"}')
    yield "no valve"
    shutil.copytree(folder / "evidence", folder / "an older evidence")
    yield "evidence"


def test_its_report_says_what_verify_says_whatever_lies_beside(copied):
    for name in strangers(copied):
        holds, html = evidence_again(copied)
        assert holds and 'class="verdict good"' in html and "DO NOT BELONG" not in html, name


def test_a_strangers_valve_beside_is_a_remark_and_inside_a_fault(copied):
    next(strangers(copied))
    evidence_again(copied)
    report = report_of_folder(copied / "evidence")
    assert report.kind == "good"
    assert any("as it lies beside these files and is not one of them" in line for line in report.missing)
    assert main(["report", str(copied / "evidence")]) == 0 and main(["report", str(copied)]) == 1
    assert "DO NOT BELONG TOGETHER" in report_of_folder(copied).verdict


def test_of_two_copies_of_a_firmware_the_one_that_fits_is_taken_or_the_one_that_is_named(copied):
    shutil.copytree(copied / "firmware", copied / "a copy")
    (copied / "a copy/core/dz_comp.c").write_text("int edited;\n")
    for named in (copied, copied / "evidence", copied / "firmware"):
        assert report_of_folder(named).kind == "good"
    report = report_of_folder(copied / "a copy")
    assert report.kind == "bad" and any("a copy/core/dz_comp.c was changed" in fault for fault in report.faults)


def test_files_that_verify_calls_changed_have_its_verdict_and_no_other(copied):
    (copied / "firmware/f28335/main.c").write_text("int main;\n")

    def found(document):
        document["holds"] = document["checks"][0]["holds"] = False

    holds, html = evidence_again(copied, change=found)
    assert not holds and "DOES NOT HOLD: 1 of" in html and "DO NOT BELONG" not in html
    assert "firmware/f28335/main.c was changed since it was generated" in html
    head = html[html.index('class="verdict bad"') : html.index('<dl class="numbers">')]
    assert "Optional checks not run" in head and "--plant" in head  # of a red verdict, too


def test_folders_of_one_name_are_kept_apart(copied, tmp_path):
    """`verify a/firmware -o b/firmware`."""
    holds, html = evidence_again(copied, tmp_path / "b" / "firmware")
    assert holds and 'class="verdict good"' in html and "firmware: made by" not in html
    assert "Dead-zone compensator for f28335" in html


def test_a_firmware_among_many_folders_is_found(copied):
    for number in range(510):
        (copied / f"a{number}").mkdir()
    assert "Dead-zone compensator for f28335" in evidence_again(copied)[1]


# ---- valve.json ----


def test_a_valve_file_that_was_replaced_is_said_first(copied):
    """The file of the name comes before others; which one was used its content tells, and not its spacing."""
    compensator = read_compensator(copied / "firmware")
    other = replace(compensator.valve, record={"serial": "another"})
    for name in ("again.json", "valve.json"):
        (copied / name).write_bytes(to_json_bytes(other))
    digest = sha256_of((copied / "valve.json").read_bytes())
    shutil.rmtree(copied / "evidence")
    report = report_of_folder(copied / "firmware")
    assert any(line.startswith(f"valve.json has the SHA-256 {digest}, but the compen") for line in report.missing)
    (copied / "a.json").write_text(json.dumps(json.loads(to_json_bytes(compensator.valve))))
    report = report_of_folder(copied / "firmware")
    said = "valve.json is another valve by now; the compensator was made from a.json: used"
    assert said in report.missing and not report.faults


def test_a_copy_of_the_valve_under_another_name_makes_no_other_valve(copied):
    shutil.copy(copied / "valve.json", copied / "a.json")
    assert not any("another valve" in line for line in report_of_folder(copied).missing)


# ---- what was not tried ----


@pytest.mark.parametrize(("target", "said"), [("f28335", True), ("cortex-m4", False), ("host", False)])
def test_the_headers_of_ti_are_named_where_they_make_sense(target, said):
    assert any("--c2000ware" in line for line in not_tried(evidence_with(target=target))) is said


# ---- read once ----


def test_verify_reads_every_artefact_once(copied, tmp_path, monkeypatch):
    """Also compensator.json, of all checks and of the report."""
    read = Counter()
    convert = artefact_reading.convert
    monkeypatch.setattr(
        artefact_reading,
        "convert",
        lambda document, kind, **how: read.update([kind.__name__]) or convert(document, kind, **how),
    )
    assert main(["verify", str(copied / "firmware"), "-o", str(tmp_path / "evidence")]) == 0
    assert read["ValveModel"] == 1 and read["Compensator"] == 1 and read["Evidence"] == 1
