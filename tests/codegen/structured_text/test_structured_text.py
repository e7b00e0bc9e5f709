"""Structured Text as it is written: its limits, the files for PLC tools, and what is refused."""

import json
import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from dzdesign.codegen.other_targets import OTHER_TARGETS, generate_output, settings_of
from dzdesign.codegen.structured_text.files import note_of, output_files, structured_text
from dzdesign.codegen.structured_text.interface import interface_named
from dzdesign.codegen.structured_text.law_form import law_form
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from dzdesign.verify.structured_text.parser import WORDS, parse
from dzdesign.verify.structured_text.reserved_words import RESERVED, is_reserved
from tests.support.paths import GOLDENS, GOLDENS_FULL

ROOTS = {"one solenoid": GOLDENS, "two solenoids": GOLDENS_FULL}
DIGEST = "0" * 64


def compensator(root):
    return read_artefact((root / "compensator.json").read_bytes(), Compensator, "compensator.json")


@pytest.fixture(scope="module", params=[(name, kind) for name in ROOTS for kind in ("plc", "codes")], ids=" ".join)
def text(request):
    name, interface = request.param
    return structured_text(compensator(ROOTS[name]), DIGEST, interface)


def test_it_is_short_and_plain_ascii(text):
    lines = text.splitlines()
    assert len(lines) <= 120 and max(map(len, lines)) <= 120
    assert text.isascii() and DIGEST in text and "\t" not in text


def test_it_has_no_type_or_number_of_more_than_32_bits(text):
    code = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)
    types = set(re.findall(r"\b(?:L?REAL|[US]?L?S?INT|U?[DL]INT|WORD|DWORD|LWORD|BOOL)\b", code))
    assert types == {"DINT", "UDINT", "BOOL"}
    assert max(map(int, re.findall(r"\b\d+\b", code))) < 2**31


def test_names_are_others_whatever_the_case(text):
    """A PLC knows no case: LAW_BETA and law_beta would be one."""
    variables = parse(text, "B.st").variables
    assert len(variables) > 50 and set(variables) == {each.name.lower() for each in variables.values()}
    with pytest.raises(InputError, match="twice"):
        parse(text.replace("LAW_NODES", "LAW_BETA"), "B.st")


def test_no_name_is_a_word_of_the_standard_or_of_a_tool(text):
    """Of any of its languages: TRANSITION is a keyword of charts, and tools keep one list for all."""
    assert {"TRANSITION", "STEP", "INDEXOF", "S1", "LIMIT", "DINT"} <= RESERVED and len(RESERVED) > 300
    code = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)
    names = set(re.findall(r"\b[A-Za-z_]\w*\b", code)) - WORDS
    assert not [name for name in names if is_reserved(name)] and len(names) > 50


def output(root, dialect, interface):
    made = compensator(root)
    settings = {"dialect": dialect, "interface": interface}
    return generate_output(made, "iec61131", settings).files


def plcopen_text(content):
    """Return the function block of PLCopen XML, read by element names alone."""
    found = {each.tag.rpartition("}")[2]: each for each in ElementTree.fromstring(content).iter()}
    plain, body = ("".join(found[name].itertext()).strip("\n") for name in ("InterfaceAsPlainText", "body"))
    return f"{plain}\n{body}\nEND_FUNCTION_BLOCK\n"


def test_the_files_of_a_dialect_hold_the_same_text_and_are_the_same_bytes_again():
    files = output(GOLDENS, "twincat", "codes")
    assert list(files) == ["FB_DeadZone.st", "FB_DeadZone.xml", "FB_DeadZone.TcPOU", "compensator.json"]
    assert files == output(GOLDENS, "twincat", "codes")
    assert "FB_DeadZone.TcPOU" not in output(GOLDENS, "codesys", "codes")
    text = files["FB_DeadZone.st"].decode()
    assert plcopen_text(files["FB_DeadZone.xml"]) == text
    pou = ElementTree.fromstring(files["FB_DeadZone.TcPOU"]).find("POU")
    assert pou.get("Id") == f"{{{pou.get('Id')[1:-1]}}}" and len(pou.get("Id")) == 38
    assert pou.findtext("Declaration") + pou.findtext("Implementation/ST") + "END_FUNCTION_BLOCK\n" == text


def test_plcopen_declares_every_variable_with_its_type():
    namespace = "{http://www.plcopen.org/xml/tc6_0200}"
    project = ElementTree.fromstring(output(GOLDENS_FULL, "codesys", "plc")["FB_DeadZone.xml"])
    interface = next(project.iter(f"{namespace}interface"))
    sections = [(each.tag.removeprefix(namespace), each.get("constant")) for each in interface]
    assert sections == [("inputVars", None), ("outputVars", None), ("localVars", None), ("localVars", "true"),
                        ("tempVars", None)]  # fmt: skip
    names = [each.get("name") for each in interface.iter(f"{namespace}variable")]
    assert {"command", "output_b", "side", "LAW_NODES", "weights"} <= set(names) and len(names) == len(set(names))


def test_what_a_block_leaves_out_is_said(text):
    assert "Not in it: current control and telemetry" in " ".join(text.split())
    both = compensator(GOLDENS_FULL)
    assert all(name in note_of(both, {}) for name in ("dither", "ramps", "debouncing", "latching", "interlock"))
    assert "dither" in structured_text(both, DIGEST, "plc")


def test_current_control_is_refused(wording):
    from dzdesign.codegen.project import target_named
    from tests.support.example_coil import SENSORS, with_current

    made = with_current(compensator(GOLDENS), target_named("f28335"), SENSORS["supply unknown"])
    with wording.refusal(InputError):
        output_files(made, None, {"dialect": "codesys", "interface": "plc"})


def test_a_law_that_needs_more_than_32_bits_is_refused(wording):
    made = compensator(GOLDENS)
    interface = interface_named("codes", made)
    side = replace(interface.sides[1], span=4093, transition=4091)
    with wording.refusal(InputError):
        law_form(made, replace(interface, full=65521, sides={1: side}), 1)


@pytest.mark.parametrize(
    "options",
    [
        "--target iec61131 --dialect siemens",
        "--target iec61131 --interface bar",
        "--target iec61131 --calibration block",
        "--target iec61131 --vectors 4000",
        "--target f28335 --dialect twincat",
        "--interface codes",
        "--target iec61130",
    ],
)
def test_a_wrong_option_writes_nothing(options, example_compensator_file, tmp_path, capsys, wording):
    assert main(["codegen", str(example_compensator_file), *options.split(), "-o", str(tmp_path / "plc")]) == 2
    wording.of_test(capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def example_compensator_file(example_compensator, tmp_path_factory):
    path = tmp_path_factory.mktemp("compensator") / "compensator.json"
    path.write_bytes(to_json_bytes(example_compensator))
    return path


def test_the_command_writes_a_folder_and_refuses_one_of_another_kind(example_compensator_file, tmp_path, capsys):
    source, folder = str(example_compensator_file), tmp_path / "plc"
    assert main(["codegen", source, "--target", "iec61131", "--dialect", "twincat", "-o", str(folder)]) == 0
    assert "dialect twincat, interface plc" in capsys.readouterr().out
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["schema"] == "dzdesign.output/1"
    assert manifest["settings"] == {"dialect": "twincat", "interface": "plc"}
    assert sorted(manifest["files"]) == sorted(each.name for each in folder.iterdir() if each.name != "manifest.json")
    assert main(["codegen", source, "--target", "f28335", "-o", str(folder)]) == 2
    assert "dzdesign.output/1" in capsys.readouterr().err
    (folder / "FB_DeadZone.st").write_text("mine")
    assert main(["codegen", source, "--target", "iec61131", "-o", str(folder)]) == 2
    assert (folder / "FB_DeadZone.st").read_text() == "mine"


def test_settings_are_the_defaults_where_none_were_given():
    known = OTHER_TARGETS["iec61131"].options
    assert settings_of("iec61131", {}) == {name: values[0] for name, values in known.items()}
    assert settings_of("f28335", {"dialect": None}) == {}
