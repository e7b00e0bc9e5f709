"""`verify` of a folder with Structured Text or for MATLAB: what it finds, and must not overlook. On few inputs."""

import json
from functools import partialmethod

import numpy as np
import pytest

from dzdesign.codegen.integers.interface import interface_named
from dzdesign.codegen.other_targets import generate_output
from dzdesign.codegen.writing import write_generated
from dzdesign.command_line.cli import main
from dzdesign.core.errors import RequirementError
from dzdesign.design.signal_text import command_signal, parse_signal
from dzdesign.design.target_inputs import Converter
from dzdesign.verify.folder import read_compensator, read_output_manifest
from dzdesign.verify.outputs import every_cycle, texts
from dzdesign.verify.outputs.every_pair import EveryPair
from dzdesign.verify.outputs.texts import (
    available_octave,
    block_checks,
    function_checks,
    function_in_octave,
    running,
)
from dzdesign.verify.requirements import DEBOUNCE
from tests.support.core_variants import VARIANTS, variant
from tests.support.golden_firmware import FULL, golden_compensator
from tests.support.octave import OCTAVE, needs_octave
from tests.support.synthetic import needs_compiler

SETTINGS = {"iec61131": {"dialect": "twincat", "interface": "codes", "cycle_time": ""}, "matlab": {}}
EXACT = "equals the exactly rounded law"
DESIGNS = ("no transition", "live zero", "inverted", "bipolar, all options")


@pytest.fixture(scope="module")
def outputs():
    made = golden_compensator()
    return {target: generate_output(made, target, settings) for target, settings in SETTINGS.items()}


@pytest.fixture
def folder(outputs, tmp_path):
    for target, output in outputs.items():
        write_generated(output, tmp_path / target)
    return tmp_path


@pytest.fixture(autouse=True)
def few(monkeypatch):
    """Let every input be few."""
    monkeypatch.setattr(EveryPair, "every_command", partialmethod(EveryPair.every_command, drops=range(-40, 3300, 331)))
    monkeypatch.setattr(EveryPair, "every_pressure", partialmethod(EveryPair.every_pressure, step=997))


def checks_of(folder, target):
    manifest, made = read_output_manifest(folder / target), read_compensator(folder / target)
    checks = block_checks if target == "iec61131" else function_checks
    return checks(folder / target, manifest, made, lambda _: None)


def edited(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_a_good_block_holds(folder):
    found = checks_of(folder, "iec61131")
    assert [check.id for check in found.checks] == [
        "exact-law", "fallback", "states", "overflow", "over-compensation"
    ]  # fmt: skip
    assert all(check.holds for check in found.checks), found.checks
    assert all(each.inputs > 10_000 and each.wrong == 0 for each in found.inputs) and len(found.inputs) == 2
    margin = next(check.text for check in found.checks if check.id == "over-compensation")
    assert margin.startswith("0 pressure drops above") and "smallest margin 0." in margin


def without_imported(folder):
    """Take the files for tools away, which are compared with the text before it is evaluated."""
    for name in ("FB_DeadZone.xml", "FB_DeadZone.TcPOU"):
        (folder / "iec61131" / name).unlink()


@pytest.mark.parametrize(
    ("old", "new", "missed"),
    [
        ("REVERSE : DINT := ", "REVERSE : DINT := 1", {"states", "fallback"}),
        ("OUTPUT_LIMIT : DINT := 6", "OUTPUT_LIMIT : DINT := 5", {"exact-law"}),
        ("ahead * SLOPE", "(ahead * 20000) * SLOPE", {"overflow"}),
        ("at_rest : BOOL := TRUE", "at_rest : BOOL := FALSE", {"exact-law"}),
        ("at_rest : BOOL := TRUE", "at_rest : BOOL", {"exact-law"}),
        ("drive := MIN", "IF valid THEN drive := 0; END_IF;\ndrive := MIN", {"exact-law"}),
    ],
)
def test_a_wrong_text_does_not_hold(folder, old, new, missed):
    without_imported(folder)
    edited(folder / "iec61131" / "FB_DeadZone.st", old, new)
    found = checks_of(folder, "iec61131").checks
    assert missed <= {check.id for check in found if check.holds is False}


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        ("FB_DeadZone.xml", "MAX(", "MIN(", "another text"),
        ("FB_DeadZone.TcPOU", "MAX(", "MIN(", "another text"),
        ("FB_DeadZone.xml", '<simpleValue value="', '<simpleValue value="1', "other values"),
    ],
)
def test_a_file_for_a_tool_with_another_block_is_seen(folder, file, old, new, said):
    edited(folder / "iec61131" / file, old, new)
    (check,) = checks_of(folder, "iec61131").checks
    assert check.id == "exact-law" and check.holds is False and file in check.text and said in check.text


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("MIN(valid_commands + 1, FAULT_CYCLES)", "MIN(valid_commands + 2, FAULT_CYCLES)"),
        ("limited <= INTERLOCK", "INTERLOCK <= limited"),
        ("SEL(NOT failed, 0, MIN(valid_pressures", "SEL(failed, 0, MIN(valid_pressures"),
    ],
    ids=["a count of two", "interlock inverted", "valid for invalid"],
)
def test_a_wrong_count_does_not_hold_by_name(tmp_path, monkeypatch, old, new):
    monkeypatch.setattr(every_cycle, "FEWEST_CYCLES", 40)
    settings = {**SETTINGS["iec61131"], "cycle_time": "1 ms"}
    write_generated(generate_output(golden_compensator(), "iec61131", settings), tmp_path / "iec61131")
    without_imported(tmp_path)
    held = {check.id: check.holds for check in checks_of(tmp_path, "iec61131").checks}
    edited(tmp_path / "iec61131" / "FB_DeadZone.st", old, new)
    checks = checks_of(tmp_path, "iec61131").checks
    missed = next(check for check in checks if check.id == "debounce")
    assert held["debounce"] is True and missed.holds is False
    assert missed.name == f"FB_DeadZone.st: {DEBOUNCE.title}"


def test_a_lower_bound_that_is_exceeded_is_seen(folder):
    without_imported(folder)
    path = folder / "iec61131" / "FB_DeadZone.st"
    text = path.read_text()
    begin, end = text.index("ZERO_NODES : "), text.index("LAW_LEAST")
    table = text[begin:end]
    first = table.index("[", 20)
    nodes = [str(int(node) + 200) for node in table[first + 1 : table.index("]", first)].split(",")]
    path.write_text(
        text[:begin] + table[:first] + "[" + ", ".join(nodes) + table[table.index("]", first) :] + text[end:]
    )
    found = {check.id: check for check in checks_of(folder, "iec61131").checks}
    assert found["over-compensation"].holds is False and "-" in found["over-compensation"].text


@needs_octave
@needs_compiler
def test_a_good_function_holds_in_octave(folder):
    found = checks_of(folder, "matlab")
    assert all(check.holds for check in found.checks), [check for check in found.checks if not check.holds]
    assert {"exact-law", "fallback", "states", "over-compensation"} <= {check.id for check in found.checks}
    assert {f"core/dz_comp.c: {EXACT}", f"dz_comp.m in Octave: {EXACT}"} <= {check.name for check in found.checks}
    assert len(found.inputs) == 3 and "octave" in found.versions


@needs_octave
@pytest.mark.slow
@pytest.mark.parametrize("name", DESIGNS)
def test_the_functions_of_another_design_hold_in_octave(name, tmp_path):
    made = variant(name)
    write_generated(generate_output(made, "matlab", {}), tmp_path / "matlab")
    for sign in made.signals.signs:
        found = function_in_octave(tmp_path / "matlab", sign, made, available_octave())
        assert all(check.holds for check in found.checks)


@needs_compiler
def test_without_octave_the_function_is_not_checked(folder, monkeypatch):
    monkeypatch.setattr(texts, "find_program", lambda _: None)
    found = {check.name: check for check in checks_of(folder, "matlab").checks}
    check = found[f"dz_comp.m in Octave: {EXACT}"]
    assert check.holds is None and "apt install octave" in check.text and found[f"core/dz_comp.c: {EXACT}"].holds


@needs_octave
@pytest.mark.parametrize(
    ("old", "new", "missed", "words"),
    [
        ("HALF = int64(", "HALF = int64(2 * ", "exact-law", ""),
        ("law_beta(failed) = LAW_LEAST", "law_beta(failed) = LAW_LEAST + 4096", "fallback", ""),
        ("int64(b_failed) .* 4", "int64(b_failed) .* 2", "states", ""),
        ("BETA_FACTOR = int64(", "BETA_FACTOR = int64(9", "states", ""),
        # One that fails.
        ("uint16(compare), shape", "uint32(compare), shape", "exact-law", "uint32"),
        ("LAW_NODES(row + 1)", "LAW_NODES(row)", "exact-law", "LAW_NODES"),
        ("    code = ", "    cod = ", "exact-law", "code"),
        ("    % ---- the law ----", "    exit(0);", "exact-law", "ended before"),
    ],
)
def test_a_wrong_function_is_seen_in_octave(folder, old, new, missed, words):
    edited(folder / "matlab" / "dz_comp.m", old, new)
    checks = function_in_octave(folder / "matlab", 1, golden_compensator(), available_octave()).checks
    (check,) = [check for check in checks if check.id == missed]
    assert check.holds is False and words in check.text


@needs_octave
def test_octave_that_hangs_is_ended_and_runs_nothing_of_the_users(tmp_path, monkeypatch):
    (tmp_path / ".octaverc").write_text("error('the user''s settings were run');\n")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setattr(texts, "TIMEOUT_S", 1.5)
    with running(OCTAVE, "waits", b"function [c, s, t] = waits(u, a, b)\n  pause(60);\nend\n") as function:
        codes = {name: np.zeros(3) for name in ("command", "pressure_a", "pressure_b")}
        with pytest.raises(RequirementError, match="did not end"):
            function(codes)


def test_an_octave_that_does_not_run_is_not_there(tmp_path, monkeypatch):
    for name in ("true", str(tmp_path)):
        monkeypatch.setattr(texts, "find_program", lambda _, name=name: name)
        octave = texts.available_octave()
        assert not octave.path and octave.missing and not octave.version


def test_the_command_refuses_what_makes_no_sense(folder, tmp_path, capsys, wording):
    block = (folder / "iec61131").rename(folder / "plc")
    for line in (["--machine-code"], ["--plant", "plant.toml"], ["--back-pressure", "1 MPa"]):
        assert main(["verify", str(block), *line, "-o", str(tmp_path / "evidence")]) == 2
        wording.of_test(capsys.readouterr().err)
    edited(block / "manifest.json", '"iec61131"', '"iec"')
    assert main(["verify", str(block), "-o", str(tmp_path / "evidence")]) == 2
    wording.of_test(capsys.readouterr().err)
    assert not (tmp_path / "evidence").exists()


def test_the_command_writes_the_evidence(example_compensator, tmp_path, capsys):
    folder, evidence = tmp_path / "plc", tmp_path / "evidence"
    write_generated(generate_output(example_compensator, "iec61131", SETTINGS["iec61131"]), folder)
    assert main(["verify", str(folder), "-o", str(evidence)]) == 0
    printed = capsys.readouterr().out
    assert f"HOLDS  FB_DeadZone.st: {EXACT}" in printed and "evidence.json" in printed
    document = json.loads((evidence / "evidence.json").read_text())
    assert document["holds"] and document["schema"] == "dzdesign.output-evidence/1"


def test_a_block_of_two_solenoids_keeps_the_bounds_of_both(tmp_path):
    made = golden_compensator(root=FULL)
    settings = {"dialect": "codesys", "interface": "plc", "cycle_time": "1 ms"}
    write_generated(generate_output(made, "iec61131", settings), tmp_path / "iec61131")
    found = checks_of(tmp_path, "iec61131")
    assert all(check.holds for check in found.checks)
    assert [check.id for check in found.checks].count("over-compensation") == 2


def test_each_side_of_a_block_is_compared_with_its_own_end_of_zero(tmp_path, monkeypatch):
    command = command_signal(parse_signal("-10..10 V x 0.12 + 1.5 V", "--command-signal"), Converter())
    monkeypatch.setitem(VARIANTS, "unlike sides", {"signals": {"command": command}})
    made = variant("unlike sides")
    sides = interface_named("plc", made).sides
    assert sides[1].leave_zero != sides[-1].leave_zero
    settings = {"dialect": "codesys", "interface": "plc", "cycle_time": ""}
    write_generated(generate_output(made, "iec61131", settings), tmp_path / "iec61131")
    found = checks_of(tmp_path, "iec61131").checks
    assert all(check.holds for check in found), [check.text for check in found if not check.holds]
