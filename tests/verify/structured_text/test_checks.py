"""`verify` of a folder with Structured Text: what it finds, and what it must not overlook. On few inputs."""

import json
from functools import partial
from pathlib import Path

import pytest

from dzdesign.codegen.other_targets import generate_output, write_output
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.verify.firmware.folder import read_compensator
from dzdesign.verify.outputs.folder import read_output_manifest
from dzdesign.verify.structured_text import checks as checks_module
from dzdesign.verify.structured_text.every_pair import ExactTables, TriedBlock
from dzdesign.verify.structured_text.parser import parse
from tests.support.paths import GOLDENS
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
SETTINGS = {"dialect": "twincat", "interface": "codes"}


@pytest.fixture(scope="module")
def output():
    made = read_artefact((GOLDENS / "compensator.json").read_bytes(), Compensator, "compensator.json")
    return generate_output(made, "iec61131", SETTINGS)


@pytest.fixture(scope="module")
def tables(output):
    return ExactTables(output.compensator, "codes")


@pytest.fixture
def folder(output, tmp_path):
    write_output(output, tmp_path / "plc")
    return tmp_path / "plc"


@pytest.fixture
def few(monkeypatch, tables):
    """Let every input be few, compiled quickly, and the exact law be computed once."""
    monkeypatch.setattr(checks_module, "ExactTables", lambda *_: tables)
    monkeypatch.setattr(checks_module, "TriedBlock", partial(TriedBlock, options=["-O0"]))
    pairs, pressures = TriedBlock.every_pair, TriedBlock.every_pressure
    monkeypatch.setattr(TriedBlock, "every_pair", lambda self: pairs(self, range(-20, 3000, 151)))
    monkeypatch.setattr(TriedBlock, "every_pressure", lambda self: pressures(self, range(0, 4096, 511)))


def found_of(folder):
    manifest = read_output_manifest(folder)
    found = checks_module.checks(folder, manifest, read_compensator(folder), lambda _: None)
    return {check.id: check.holds for check in found.checks}


def edited(folder: Path, name, old, new, *, told=False):
    """Change a file, and where `told` its hash in the manifest too."""
    path, manifest = folder / name, folder / "manifest.json"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    if told:
        document = json.loads(manifest.read_text())
        document["files"][name] = sha256_of(path.read_bytes())
        manifest.write_text(json.dumps(document))


def test_a_good_folder_holds(folder, few):
    manifest = read_output_manifest(folder)
    found = checks_module.checks(folder, manifest, read_compensator(folder), lambda _: None)
    assert all(check.holds for check in found.checks), found.checks
    assert all(each.inputs > 100 and each.wrong == 0 for each in found.inputs) and len(found.inputs) == 3
    assert [check.id for check in found.checks] == [
        "st-subset", "st-same-text", "st-two-readings", "exact-law", "st-overflow", "fallback", "st-states",
        "over-compensation",
    ]  # fmt: skip


def test_a_wrong_number_is_seen_though_all_files_have_it(folder, few):
    for name in ("FB_DeadZone.st", "FB_DeadZone.xml", "FB_DeadZone.TcPOU"):
        edited(folder, name, "REVERSE : DINT := ", "REVERSE : DINT := 1", told=True)
    found = found_of(folder)
    assert not found["st-states"]
    assert found["st-same-text"] is False  # the typed declaration has the number that was generated


@pytest.mark.parametrize("name", ["FB_DeadZone.xml", "FB_DeadZone.TcPOU"])
def test_a_file_with_another_text_is_seen(folder, few, name):
    edited(folder, name, "status := status + 2", "status := status + 3", told=True)
    found = found_of(folder)
    assert found["st-same-text"] is False and found["exact-law"]


def test_another_typed_declaration_is_seen(folder, few):
    edited(folder, "FB_DeadZone.xml", '<simpleValue value="64" />', '<simpleValue value="65" />', told=True)
    assert found_of(folder)["st-same-text"] is False


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("END_FOR", "END_WHILE"),
        ("command : DINT", "asked : DINT"),
        ("output_a : DINT", "output : DINT"),
        ("at_rest : BOOL := TRUE", "at_rest : BOOL := FALSE"),
        ("w0 := 0; w1", "w1"),
        ("FB_DeadZone\n", "FB_LiveZone\n"),
        ("status : DINT", "status : UDINT"),
        ("OUTPUT_LIMIT", "TRANSITION"),
    ],
)
def test_a_text_that_is_not_of_the_subset_does_not_hold(folder, old, new):
    edited(folder, "FB_DeadZone.st", old, new)
    found = found_of(folder)
    assert found == {"st-subset": False}


def test_the_command_refuses_what_makes_no_sense(folder, tmp_path, capsys, wording):
    for line in (["--mutate"], ["--plant", "plant.toml"], ["--back-pressure", "1 MPa"]):
        assert main(["verify", str(folder), *line, "-o", str(tmp_path / "evidence")]) == 2
        wording.of_test(capsys.readouterr().err)
    edited(folder, "manifest.json", '"iec61131"', '"iec"')
    assert main(["verify", str(folder), "-o", str(tmp_path / "evidence")]) == 2
    wording.of_test(capsys.readouterr().err)
    assert not (tmp_path / "evidence").exists()


@pytest.mark.slow
def test_the_command_writes_the_evidence(example_compensator, monkeypatch, tmp_path, capsys):
    folder, evidence = tmp_path / "plc", tmp_path / "evidence"
    write_output(generate_output(example_compensator, "iec61131", SETTINGS), folder)
    pairs = TriedBlock.every_pair
    monkeypatch.setattr(TriedBlock, "every_pair", lambda self: pairs(self, range(-20, 3000, 151)))
    assert main(["verify", str(folder), "-o", str(evidence)]) == 0
    printed = capsys.readouterr().out
    assert "HOLDS  equals the exactly rounded law" in printed and "evidence.json" in printed
    document = json.loads((evidence / "evidence.json").read_text())
    assert document["holds"] and document["schema"] == "dzdesign.output-evidence/1"
    assert any(check["id"] == "reproduced" and check["holds"] for check in document["checks"])


BODY = "<body><ST><xhtml xmlns='http://www.w3.org/1999/xhtml'>x</xhtml></ST></body>"
ACTION = f"<actions><action name='A'>{BODY}</action></actions>"
METHOD = "<data name='http://www.3s-software.com/plcopenxml/method' handleUnknown='implementation'><Method /></data>"
GLOBAL = "<configuration name='c'><globalVars><variable name='g' /></globalVars></configuration>"
INSIDE = "<Declaration/><Implementation><ST/></Implementation>"


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("xml", "</pou>", "</pou><pou name='FB_Other' pouType='functionBlock'/>"),
        ("xml", "<pou name=", "<pou name='FB_Other' pouType='functionBlock'/><pou name="),
        ("xml", "</body>", f"</body>{BODY}"),
        ("xml", "<body>", f"{ACTION}<body>"),
        ("xml", "</addData>", f"{METHOD}</addData>"),
        ("xml", "<dataTypes />", "<dataTypes><dataType name='DINT'><baseType><INT/></baseType></dataType></dataTypes>"),
        ("xml", "<configurations />", f"<configurations>{GLOBAL}</configurations>"),
        ("xml", 'name="FB_DeadZone" pouType="functionBlock"', 'name="FB_DeadZone" pouType="program"'),
        ("xml", "status := 0;", "status := <b xmlns=''>1</b>;"),
        ("xml", "status := 0;", "status := <?x 1?>0;"),
        ("xml", "status := 0;", "status := <![CDATA[0]]>;"),
        ("xml", "status := 0;", "status := <!-- 1 -->0;"),
        ("xml", '<tempVars>', '<tempVars retain="true">'),
        ("xml", "</ST>", "x</ST>"),
        ("TcPOU", "</POU>", f"<Method Name='M' Id='{{0}}'>{INSIDE}</Method></POU>"),
        ("TcPOU", "</POU>", "<Action Name='A' Id='{0}'><Implementation><ST>x</ST></Implementation></Action></POU>"),
        ("TcPOU", "</Implementation>", "</Implementation><Implementation><ST>x</ST></Implementation>"),
        ("TcPOU", "</POU>", "</POU><POU Name='FB_Other' Id='{0}' SpecialFunc='None'/>"),
        ("TcPOU", 'Name="FB_DeadZone"', 'Name="FB_Other"'),
        ("TcPOU", "encoding='utf-8'", "encoding='utf-7'"),
    ],
)  # fmt: skip
def test_what_stands_beside_the_block_in_a_tools_file_is_seen(folder, name, old, new):
    edited(folder, f"FB_DeadZone.{name}", old, new, told=True)
    assert same_text_of(folder).holds is False


def same_text_of(folder):
    text = (folder / "FB_DeadZone.st").read_text()
    return checks_module._same_text(folder, text, parse(text, "FB_DeadZone.st"), "twincat")


def test_the_cut_between_declaration_and_body_is_that_of_the_tools(folder):
    assert same_text_of(folder).holds
    path = folder / "FB_DeadZone.TcPOU"
    declaration, body = (path.read_text().partition("</Declaration>")[0], path.read_text().partition("<ST>")[2])
    moved = body[: body.index("\n") + 1]
    path.write_text(f"{declaration}{moved}</Declaration><Implementation><ST>{body.removeprefix(moved)}")
    assert same_text_of(folder).holds is False


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig"])
def test_a_document_type_of_its_own_is_refused_in_any_encoding(folder, encoding):
    path = folder / "FB_DeadZone.xml"
    text = path.read_text().replace("utf-8", encoding.removesuffix("-sig"))
    path.write_bytes(text.replace("<project", "<!DOCTYPE x [<!ENTITY a 'b'>]><project", 1).encode(encoding))
    with pytest.raises(InputError, match="does not begin as generated"):
        checks_module.read_xml(path)


def test_a_document_type_of_its_own_is_refused(folder):
    path = folder / "FB_DeadZone.xml"
    path.write_text(path.read_text().replace("<project", "<!DOCTYPE x [<!ENTITY a 'b'>]><project", 1))
    with pytest.raises(InputError, match="document type"):
        checks_module.read_xml(path)
