"""A function block as it is written: by the standard's grammar, its words, the files for PLC tools, what is refused."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from lark import LarkError

from dzdesign.codegen.integers.interface import cycle_time_s, interface_named
from dzdesign.codegen.integers.law import block_form
from dzdesign.codegen.integers.plc import note_of, output_files, structured_text
from dzdesign.codegen.other_targets import OTHER_TARGETS, generate_output, settings_of
from dzdesign.codegen.project import target_named
from dzdesign.core.errors import InputError
from dzdesign.verify.outputs.exact_block import cycles_of
from tests.support.core_variants import VARIANTS, variant
from tests.support.example_coil import SENSORS, with_current
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator
from tests.support.st_grammar import grammar
from tests.support.st_words import RESERVED, is_reserved

ROOTS = {"one solenoid": GOLDENS, "two solenoids": FULL}
DIGEST = "0" * 64
#: With PLC units the block counts cycles, with codes it judges each by itself.
CYCLES = {"plc": "1 ms", "codes": ""}


@pytest.fixture(scope="module", params=[(name, kind) for name in ROOTS for kind in ("plc", "codes")], ids=" ".join)
def text(request):
    name, interface = request.param
    return structured_text(golden_compensator(root=ROOTS[name]), DIGEST, interface, CYCLES[interface])


def code_of(text):
    return re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)


def test_it_is_short_plain_ascii_and_has_no_type_or_number_of_more_than_32_bits(text):
    lines = text.splitlines()
    assert len(lines) <= 180 and max(map(len, lines)) <= 120
    assert text.isascii() and DIGEST in text and "\t" not in text
    assert "Not in it: current control and telemetry" in " ".join(text.split())
    types = re.findall(r"\b(?:L?REAL|[US]?L?S?INT|U?[DL]INT|WORD|DWORD|LWORD|BOOL)\b", code_of(text))
    assert set(types) == {"DINT", "BOOL"}
    assert max(map(int, re.findall(r"\b\d+\b", code_of(text)))) < 2**31


def test_names_are_others_whatever_the_case_and_none_is_a_word_of_the_standard_or_of_a_tool(text):
    """A PLC knows no case, and of its languages TRANSITION is a keyword of charts: tools keep one list for all."""
    assert {"TRANSITION", "STEP", "INDEXOF", "S1", "LIMIT", "DINT"} <= RESERVED and len(RESERVED) > 300
    declared = code_of(text).partition("FB_DeadZone")[2].rpartition("END_VAR")[0]
    names = [name.strip() for found in re.findall(r"([\w,\s]+):(?!=)", declared) for name in found.split(",")]
    names = [name.split()[-1] for name in names]
    assert len(names) > 50 and len({name.lower() for name in names}) == len(names)
    assert not [name for name in names if is_reserved(name)]


@pytest.mark.parametrize("interface", ["plc", "codes"])
@pytest.mark.parametrize("name", ["one solenoid", "two solenoids", *VARIANTS])
def test_it_is_of_the_standards_grammar(name, interface):
    made = golden_compensator(root=ROOTS[name]) if name in ROOTS else variant(name)
    grammar().parse(structured_text(made, DIGEST, interface, CYCLES[interface]))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("sound := NOT (a_failed OR b_failed);", "sound := NOT (a_failed OR b_failed)"),
        ("drive := MIN", "IF valid THEN drive := 0; END_IF\ndrive := MIN"),
        ("drive := MIN", "FOR k := 0 TO 1 DO drive := 0; END_FOR\ndrive := MIN"),
        ("VAR\n", "VAR_TEMP\n"),
        ("END_FUNCTION_BLOCK", ""),
        ("row := code / 64", "row = code / 64"),
        ("row := code / 64", "row := code // 64"),
        ("row := code / 64", "row := (code / 64"),
        ("row := code / 64", "row := code / 16#40"),
        ("TRANS_SPAN", "TRANSITION"),
        ("law_beta_0", "law__beta_0"),
        ("(* The law: ", "(* The (* law: "),
        ("ARRAY[0..52] OF", "ARRAY[0..52]"),
        ("at_rest : BOOL := TRUE;", "at_rest : BOOL := TRUE,"),
    ],
)
def test_a_fault_is_refused_by_the_grammar(old, new):
    text = structured_text(golden_compensator(), DIGEST, "codes")
    assert old in text
    with pytest.raises(LarkError):
        grammar().parse(text.replace(old, new))


def output(root, dialect, interface):
    settings = {"dialect": dialect, "interface": interface, "cycle_time": "1 ms"}
    return generate_output(golden_compensator(root=root), "iec61131", settings).files


def plcopen_text(content):
    """Return the function block of PLCopen XML, read by element names alone."""
    found = {each.tag.rpartition("}")[2]: each for each in ElementTree.fromstring(content).iter()}
    plain, body = ("".join(found[name].itertext()).strip("\n") for name in ("InterfaceAsPlainText", "body"))
    return f"{plain}\n{body}\nEND_FUNCTION_BLOCK\n"


def test_the_files_of_a_dialect_hold_the_same_text_and_are_the_same_bytes_again():
    files = output(GOLDENS, "twincat", "codes")
    assert {"FB_DeadZone.st", "FB_DeadZone.xml", "FB_DeadZone.TcPOU", "compensator.json"} <= set(files)
    assert files == output(GOLDENS, "twincat", "codes")
    assert "FB_DeadZone.TcPOU" not in output(GOLDENS, "codesys", "codes")
    text = files["FB_DeadZone.st"].decode()
    assert plcopen_text(files["FB_DeadZone.xml"]) == text
    pou = ElementTree.fromstring(files["FB_DeadZone.TcPOU"]).find("POU")
    assert pou.get("Id") == f"{{{pou.get('Id')[1:-1]}}}" and len(pou.get("Id")) == 38
    assert pou.findtext("Declaration") + pou.findtext("Implementation/ST") + "END_FUNCTION_BLOCK\n" == text


def test_plcopen_declares_every_variable_with_its_type():
    namespace = "{http://www.plcopen.org/xml/tc6_0200}"
    project = ElementTree.fromstring(output(FULL, "codesys", "plc")["FB_DeadZone.xml"])
    interface = next(project.iter(f"{namespace}interface"))
    sections = [(each.tag.removeprefix(namespace), each.get("constant")) for each in interface]
    assert sections == [("inputVars", None), ("outputVars", None), ("localVars", None), ("localVars", "true")]
    names = [each.get("name") for each in interface.iter(f"{namespace}variable")]
    assert {"command", "enable", "output_b", "side", "valid_commands", "LAW_NODES", "sum_1"} <= set(names)
    assert len(names) == len(set(names))


def test_what_a_block_leaves_out_is_said():
    both = golden_compensator(root=FULL)
    counted = ("debouncing", "interlock")
    assert all(name in note_of(both, {"cycle_time": ""}) for name in ("dither", "ramps", "latching", *counted))
    assert not any(name in note_of(both, {"cycle_time": "1 ms"}) for name in counted)
    assert "dither" in structured_text(both, DIGEST, "plc", "1 ms")


@pytest.mark.parametrize(
    ("asked", "cycle_time", "cycles"),
    [
        ("50 ms", "10 ms", 5), ("50 ms", "0.01 s", 5), ("51 ms", "10 ms", 6), ("99.9 ms", "33.3 ms", 3),
        ("5 samples", "10 ms", 1), ("5 samples", "1 ms", 4), ("5 samples", "800 us", 5), ("5 samples", "", 0),
    ],
)  # fmt: skip
def test_the_debounce_time_is_the_least_whole_number_of_cycles_that_is_not_shorter(asked, cycle_time, cycles):
    """A number of samples is the time that they take at the firmware's rate, 1.25 kHz."""
    made = golden_compensator()
    functions = replace(made.drive_functions, fault_samples=5 if "samples" in asked else 1000)
    target = target_named("f28335").inputs()
    made = replace(made, drive_functions=functions, target=target, options={"fault_debounce": asked})
    assert interface_named("plc", made, cycle_time).fault_cycles == cycles_of(made, cycle_time) == cycles
    text = structured_text(made, DIGEST, "plc", cycle_time)
    assert (f"FAULT_CYCLES : DINT := {cycles};" in text) == ("enable : BOOL;" in text) == (cycles > 0)


def test_without_an_interlock_a_new_block_follows_at_once():
    made = golden_compensator()
    made = replace(made, drive_functions=replace(made.drive_functions, interlock_codes=None))
    text = structured_text(made, DIGEST, "plc", "1 ms")
    assert "valid_commands : DINT := 4;" in text and "enable" not in text and "INTERLOCK" not in text


@pytest.mark.parametrize("text", ["10", "2 s", "1 us", "0 ms", "10 bar"])
def test_no_cycle_time_of_a_plc_is_refused(text, wording):
    with wording.refusal(InputError):
        cycle_time_s(text)


def test_current_control_is_refused(wording):
    made = with_current(golden_compensator(), target_named("f28335"), SENSORS["supply unknown"])
    with wording.refusal(InputError):
        output_files(made, None, settings_of("iec61131", {}))


def test_a_law_that_needs_more_than_32_bits_is_refused(wording):
    made = golden_compensator()
    signals = replace(made.signals, compare_max=65521)
    with wording.refusal(InputError):
        block_form(replace(made, signals=signals, beta_denominator=2**23), "codes")


def test_settings_are_the_defaults_where_none_were_given():
    known = OTHER_TARGETS["iec61131"].options
    assert settings_of("iec61131", {}) == {name: (values or ("",))[0] for name, values in known.items()}
    assert settings_of("f28335", {"dialect": None}) == {}
