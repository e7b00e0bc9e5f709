"""Which files a report is of: where the commands write them, each of the hash that is stated; else there is none."""

import json
import re
import shutil
from dataclasses import replace

import pytest

from dzdesign.assess.assessing import assess
from dzdesign.assess.assessment import Recording
from dzdesign.assess.options import AssessOptions
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.errors import InputError
from dzdesign.identify.options import IdentifyOptions
from dzdesign.identify.valve.model import ValveModel
from dzdesign.report.artefacts import read_chain
from dzdesign.report.summary import headline
from dzdesign.report.valve_report import REPORT_NAME, report_of_folder
from tests.support.attacked_firmware import add
from tests.support.bench_recordings import AFTER, BEFORE, record
from tests.support.reported import change_evidence, change_json
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


@pytest.fixture
def copied(reported_demo, tmp_path):
    return shutil.copytree(reported_demo, tmp_path / "demo")


def test_every_folder_of_a_valve_leads_to_the_same_artefacts(copied):
    chain = read_chain(copied)
    assert chain.missing == () and len(chain.curves) == 2
    assert chain.places == read_chain(copied / "evidence").places == read_chain(copied / "firmware").places
    files = {"evidence": "evidence/verification.json", "firmware": f"firmware/{MANIFEST_NAME}",
             "compensator": "firmware/compensator.json", "valve": "valve.json"}  # fmt: skip
    assert {role: place.name for role, place in chain.places.items()} == files
    assert all(place.sha256 == sha256_of((copied / place.name).read_bytes()) for place in chain.places.values())


@pytest.mark.slow
def test_same_input_same_bytes_and_the_manifest_of_the_evidence_follows(copied, capsys):
    page = copied / "evidence" / REPORT_NAME
    assert page.read_bytes() == report_of_folder(copied).html.encode()
    change_evidence(copied, lambda evidence: evidence["checks"][0].update(text="17 files, seen again"))
    assert main(["report", str(copied)]) == 0
    assert "seen again" in page.read_text(encoding="utf-8")
    listed = json.loads((copied / "evidence" / MANIFEST_NAME).read_bytes())["files"]
    assert listed[REPORT_NAME] == sha256_of(page.read_bytes())
    assert main(["report", str(copied / "evidence"), "-o", str(copied / "other.html"), "--json"]) == 0
    out = capsys.readouterr().out
    assert json.loads(out[out.index("{") :])["holds"] is True
    assert (copied / "other.html").read_bytes() == page.read_bytes()


@pytest.mark.slow
def test_evidence_that_lies_elsewhere_is_told_its_firmware(copied, tmp_path, capsys):
    """`verify a/firmware -o b/evidence`; and the valve of a lot whose firmware stands beside all valves."""
    alone = shutil.copytree(copied / "evidence", tmp_path / "elsewhere" / "evidence")
    chain = read_chain(alone)
    assert headline(chain).kind == "good" and "the firmware that was verified is not here" in headline(chain).basis
    assert [line.partition(":")[0] for line in chain.missing] == ["firmware", "compensator", "valve"]
    shutil.copy(copied / "compensator.json", alone.parent)
    assert read_chain(alone).valve is not None
    assert main(["report", str(alone), "--firmware", str(copied / "evidence")]) == 2
    assert main(["report", str(alone), "--firmware", str(copied / "firmware")]) == 0
    assert "Dead-zone compensator for f28335" in (alone / REPORT_NAME).read_text(encoding="utf-8")
    shutil.copytree(copied / "firmware", copied / "firmware_b")
    change_json(copied / "firmware_b" / MANIFEST_NAME, lambda manifest: manifest.update(note="another"))
    assert main(["report", str(copied / "evidence"), "--firmware", str(copied / "firmware_b")]) == 2


def test_two_evidences_side_by_side_each_have_their_firmware(copied):
    for stage in ("firmware", "evidence"):
        shutil.copytree(copied / stage, copied / f"{stage}_b")
    manifest = change_json(copied / "firmware_b" / MANIFEST_NAME, lambda each: each.update(note="another"))
    source = {"source": f"firmware_b/{MANIFEST_NAME}", "sha256": sha256_of(manifest)}
    content = change_json(copied / "evidence_b" / "verification.json", lambda each: each["made_from"][0].update(source))
    listed = {"verification.json": sha256_of(content)}
    change_json(copied / "evidence_b" / MANIFEST_NAME, lambda each: each["files"].update(listed))
    assert read_chain(copied / "evidence_b").places["firmware"].sha256 == sha256_of(manifest)
    assert read_chain(copied / "evidence").places["firmware"].name == f"firmware/{MANIFEST_NAME}"


def spoil(path):
    path.write_bytes(path.read_bytes().replace(b"5", b"6", 1))


#: What was changed since -> how, and the file that the refusal names. In folders of evidence, firmware and board files.
CHANGES = {
    "the evidence": (lambda demo: spoil(demo / "evidence/verification.json"), "verification.json"),
    "a curve": (lambda demo: spoil(demo / "evidence/closed_loop_positive.csv"), "closed_loop_positive.csv"),
    "a curve gone": (lambda demo: (demo / "evidence/zero_command_positive.csv").unlink(), "zero_command_positive.csv"),
    "its manifest gone": (lambda demo: (demo / "evidence" / MANIFEST_NAME).unlink(), MANIFEST_NAME),
    "the firmware's manifest": (lambda demo: spoil(demo / "firmware" / MANIFEST_NAME), MANIFEST_NAME),
    "generated C": (lambda demo: spoil(demo / "firmware/core/dz_comp.c"), "dz_comp.c"),
    "a board file": (lambda demo: spoil(demo / "firmware/f28335/dzdesign.projectspec"), "dzdesign.projectspec"),
    "a file gone": (lambda demo: (demo / "firmware/core/dz_drive.c").unlink(), "dz_drive.c"),
    "one more of the user's": (lambda demo: add(demo / "firmware", "board/more.c"), "more.c"),
    "source in the core": (lambda demo: add(demo / "firmware", "core/more.c"), "more.c"),
    "another target": (lambda demo: change_evidence(demo, lambda each: each.update(target="host")), "for host"),
}  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
def test_of_what_was_changed_since_no_report_is_made(copied, change):
    do, named = CHANGES[change]
    do(copied)
    with pytest.raises(InputError, match=re.escape(named)):
        read_chain(copied)


def test_the_refusal_says_what_to_do(copied, wording):
    spoil(copied / "firmware/core/dz_comp.c")
    with wording.refusal(InputError):
        read_chain(copied)


def test_a_firmware_that_was_not_verified_is_as_generated_but_for_board_files(copied):
    shutil.rmtree(copied / "evidence")
    spoil(copied / "firmware/f28335/dzdesign.projectspec")
    add(copied / "firmware", "board/adc.c")
    assert read_chain(copied / "firmware").evidence is None
    spoil(copied / "firmware/core/dz_comp.c")
    with pytest.raises(InputError, match=r"dz_comp\.c"):
        read_chain(copied / "firmware")


def test_another_valve_beside_is_a_remark_and_the_compensator_holds_its_own(copied):
    change_json(copied / "valve.json", lambda valve: valve.update(u_max_V=11.0))
    chain = read_chain(copied)
    assert chain.valve.u_max_V == 10.0 and "key “valve”" in chain.places["valve"].name
    assert any("valve.json is another valve by now" in line for line in chain.missing)
    (copied / "valve.json").unlink()
    assert read_chain(copied).missing == ()


@pytest.mark.slow
def test_a_valve_alone_is_reported_and_what_is_missing_said(copied, tmp_path):
    folder = tmp_path / "valve only"
    folder.mkdir()
    shutil.copy(copied / "valve.json", folder)
    report = report_of_folder(folder)
    assert report.kind == "open" and "only an identified valve" in report.verdict
    assert [line.partition(":")[0] for line in report.missing] == ["evidence", "firmware", "compensator"]
    assert report.html.count("<figure") == 2
    shutil.copy(copied / "compensator.json", folder)
    report = report_of_folder(folder)
    assert report.html.count("<figure") == 3 and "only a design" in report.verdict
    assert main(["report", str(folder)]) == 1
    assert (folder / REPORT_NAME).read_text(encoding="utf-8") == report.html


def test_a_folder_without_artefacts_is_refused(tmp_path, wording):
    with wording.refusal(InputError):
        report_of_folder(tmp_path)
    with wording.refusal(InputError):
        report_of_folder(tmp_path / "missing")
    assert main(["report", str(tmp_path)]) == 2
    (tmp_path / "valve.json").write_text('{"schema": "dzdesign.valve/1"}')
    assert main(["report", str(tmp_path)]) == 2
    assert not (tmp_path / REPORT_NAME).exists()


def test_a_manifest_reaches_no_file_outside_its_folder(copied, tmp_path):
    (tmp_path / "secret.txt").write_text("secret")
    change_json(copied / "firmware" / MANIFEST_NAME, lambda each: each["files"].update({"../../secret.txt": "0"}))
    assert read_chain(copied).firmware is None  # as if it were none


@pytest.mark.slow
def test_a_missed_limit_of_recordings_does_not_hold_and_a_strangers_assessment_is_not_shown(copied):
    valve = read_artefact((copied / "valve.json").read_bytes(), ValveModel, "valve.json")
    options = AssessOptions(reading=IdentifyOptions(meter_lag=0.0), limits={"hysteresis": 0.0001})
    assessment = replace(
        assess([record(BEFORE, seed=1)], [record(AFTER, seed=2)], options),
        made_from=tuple(Recording(source=each.source, sha256=each.sha256, set="before") for each in valve.made_from),
    )
    (copied / "assessment.json").write_bytes(to_json_bytes(assessment))
    judged = headline(read_chain(copied))
    assert judged.kind == "bad" and "more than the limit of 0.01 %" in judged.reasons[0]
    other = replace(assessment, made_from=(Recording(source="other.csv", sha256="0" * 64, set="before"),))
    (copied / "assessment.json").write_text(to_json(json.loads(to_json_bytes(other))))
    chain = read_chain(copied)
    assert any("compares others, so it is not shown" in line for line in chain.missing)
    assert chain.assessment is None and headline(chain).kind == "good"
