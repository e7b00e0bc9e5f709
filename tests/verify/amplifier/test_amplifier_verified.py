"""What is wrong with an amplifier's file, or the table and manifest beside it, is found, whoever generated it."""

import json
from dataclasses import replace
from fractions import Fraction

import pytest

from dzdesign import api
from dzdesign.codegen.amplifier.device import device_named
from dzdesign.codegen.amplifier.files import amplifier_file, notes_of
from dzdesign.codegen.amplifier.setting import amplifier_setting
from dzdesign.codegen.other_targets import generate_output, settings_of
from dzdesign.codegen.writing import write_generated
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.design.compensator import Compensator
from dzdesign.design.firmware_manifest import OutputManifest
from dzdesign.design.fixed_offset import dead_zones, fixed_offset
from dzdesign.design.lot_valves import LotSide, LotValve
from dzdesign.verify.outputs import amplifier
from dzdesign.verify.outputs.amplifier import file_checks
from dzdesign.verify.outputs.verification import verify_output
from dzdesign.verify.requirements import DEAD_ZONES, RAMPS, READ_BACK, REPRODUCED, SAFE
from tests.support.golden_firmware import FULL, golden_compensator, golden_valve

DIGEST = "0" * 64


def exported(compensator, device):
    """Return the file for a device, and what is stated of it."""
    setting = amplifier_setting(compensator, device_named(device))
    stated = {
        sign: [(row.dp_MPa, row.fixed) for row in dead_zones(compensator, drives, sign)]
        for sign, drives in setting.characteristics.items()
    }
    return amplifier_file(setting, compensator, DIGEST), stated


def failed_of(device, content, compensator, stated):
    return {check.id for check in file_checks(device, content, compensator, stated) if not check.holds}


@pytest.mark.parametrize(
    ("name", "device", "old", "new", "wrong"),
    [
        ("one", "west", "MIN:A 4891", "MIN:A 4892", SAFE),
        ("one", "west", "MIN:A 4891", "MIN:A 4791", DEAD_ZONES),
        ("one", "west", "MAX:A 9999", "MAX:A 999", DEAD_ZONES),
        ("one", "west", "TRIGGER 47", "TRIGGER 4", DEAD_ZONES),
        ("one", "west", "TRIGGER", "TRIGER", READ_BACK),
        ("one", "west", "TRIGGER 47", "TRIGGER 47\r\nMAX 5", READ_BACK),
        ("one", "west", ":A", ":B", READ_BACK),
        # What reads as the certified law, and is another one in a device that reads otherwise or takes more of it.
        ("one", "west", "MIN:A 4891", "MIN:A 9000\r\nMIN:A 4891", READ_BACK),
        ("one", "west", "MIN:A 4891", "MIN:A 4_891", READ_BACK),
        ("one", "west", "MIN:A 4891\r", "MIN:A 4891\x0b", READ_BACK),
        ("one", "cia408", "ParameterValue=8014", "ParameterValue=0x1F4E", READ_BACK),
        ("one", "cia408", "[6345sub1]", "[6346sub1]\r\nParameterValue=9000\r\n\r\n[6345sub1]", READ_BACK),
        ("one", "cia408", "DefaultValue=1", "DefaultValue=2", READ_BACK),
        ("one", "cia408", "[FileInfo]", "[DEFAULT]\r\nParameterValue=9000\r\n\r\n[FileInfo]", READ_BACK),
        ("one", "beckhoff", "END_VAR", "END_VAR\r\nValveCharacteristicTable[2,2] := 0.9;", READ_BACK),
        ("one", "beckhoff", "END_VAR", "    x : INT := 1;\r\nEND_VAR", READ_BACK),
        ("one", "csv", "0.4640,", "58/125,", READ_BACK),
        ("one", "cia408", "ParameterValue=8014", "ParameterValue=8015", SAFE),
        ("one", "cia408", "ParameterValue=1\r", "ParameterValue=2\r", READ_BACK),
        ("one", "cia408", "[6345sub1]", "[6345]", READ_BACK),
        ("one", "rmc75", "4.891 V", "4.892 V", SAFE),
        ("one", "rmc75", "4.891 V", "4.891 mV", DEAD_ZONES),
        ("one", "rmc75", "4.891 V", "4.891 kV", READ_BACK),
        ("one", "beckhoff", "0.004640, 0.489", "0.004640, 0.490", SAFE),
        ("one", "beckhoff", "0.004640, 0.489", "0.004640, 0.389", DEAD_ZONES),
        ("one", "beckhoff", "190(0.0)", "188(0.0)", READ_BACK),
        ("one", "beckhoff", "1.000000, 0.9", "0.900000, 0.9", READ_BACK),
        ("one", "csv", "0.4640,48.9", "0.4640,49.1", SAFE),
        ("one", "csv", "command_percent", "drive", READ_BACK),
        ("one", "csv", "0.0000,0.0000", "0.0000,1.0000", READ_BACK),
        ("one", "csv", "100.0000,9", "100.0000,109", READ_BACK),
        # Drive for a side that the design has not.
        ("one", "west", "TRIGGER 47", "TRIGGER 47\r\nMIN:B 9000\r\nMAX:B 9999", READ_BACK),
        ("one", "cia408", "ParameterValue=0\r", "ParameterValue=9000\r", READ_BACK),
        ("one", "csv", "0.0000,0.0000", "-100.0000,-99.0000\r\n-0.0100,-98.0000\r\n0.0000,0.0000", READ_BACK),
        ("two", "west", "MIN:B 26", "MIN:B 27", SAFE),
        ("two", "csv", "-", "", READ_BACK),
    ],
)
def test_a_seeded_fault_is_found(designs, name, device, old, new, wrong):
    content, stated = exported(designs[name], device)
    assert old.encode() in content
    assert wrong.id in failed_of(device, content.replace(old.encode(), new.encode()), designs[name], stated)


@pytest.mark.parametrize(("share", "said"), [("0", True), ("0.001", True), ("0.3", False), (None, False)])
def test_a_threshold_below_the_designs_reading_of_zero_is_said(designs, share, said):
    """Of a command at the design's 0.46 % a table with a threshold of 0.1 % opens the valve: its check must say so."""
    threshold = None if share is None else Fraction(share)
    setting = amplifier_setting(designs["one"], device_named("csv"), threshold=threshold)
    content = amplifier_file(setting, designs["one"], DIGEST)
    _, safe, _ = file_checks("csv", content, designs["one"], {}, threshold)
    assert safe.id == SAFE.id and safe.holds
    assert ("the design declares 0.46%" in safe.text) is said
    assert any("flow at zero command is possible" in note and "--threshold" in note
               for note in notes_of(setting, designs["one"])) is said  # fmt: skip


def test_dead_zones_of_something_else_are_found(designs):
    content, stated = exported(designs["one"], "west")
    [(dp_MPa, shares), *rest] = stated[1]
    for other in (
        {1: rest},
        {1: [(dp_MPa + 1, shares), *rest]},
        {1: [(dp_MPa, shares | {"opening": shares["opening"] + 2e-4}), *rest]},
        {1: [(dp_MPa, {"opening": shares["opening"]}), *rest]},
        {},
    ):
        assert failed_of("west", content, designs["one"], other) == {DEAD_ZONES.id}


def lot_of(compensator, *sides):
    digests = compensator.valve_json_sha256, "0" * 64
    lot = (LotValve(name=f"V{n}", valve_sha256=digests[n], positive=side) for n, side in enumerate(sides))
    return replace(compensator, lot=tuple(lot))


def test_a_lot_is_safe_for_its_lowest_valve(designs):
    compensator = designs["one"]
    own = LotSide.of(compensator.valve.sides["positive"], compensator.positive.certificate.guard)
    lower = replace(own, u_lower_V=tuple(value - 0.05 for value in own.u_lower_V))
    both = lot_of(compensator, own, lower)
    assert fixed_offset(compensator).share - fixed_offset(both).share == Fraction(5, 1000)
    content, stated = exported(both, "west")
    assert failed_of("west", content, both, stated) == set()
    assert SAFE.id in failed_of("west", exported(compensator, "west")[0], both, stated)


def test_a_bound_that_is_lowest_between_two_tests_counts_there(designs):
    """Of equal bounds at 1 and 5 MPa it may lie 0.2 V lower at 3 MPa."""
    compensator = designs["one"]
    own = LotSide.of(compensator.valve.sides["positive"], compensator.positive.certificate.guard)
    sags = replace(own, trend="flat", dp_MPa=(1.0, 3.0, 5.0), u_lower_V=(4.9, 4.7, 4.9))
    both = lot_of(compensator, own, sags)
    found = fixed_offset(both)
    assert (found.share, found.lowest_at_MPa) == (Fraction(47, 100), Fraction(3))
    content, stated = exported(both, "cia408")
    assert failed_of("cia408", content, both, stated) == set()


def test_a_gauge_that_read_too_little_counts_as_a_higher_pressure_drop():
    valve, budget = golden_valve(), {"amplifier": "1 %"}
    exact, wrong = (
        api.design(valve, bench_pressure_error=error, **budget) for error in ("0 MPa", "0.3 MPa")
    )
    # Both name a pressure drop of the certified interval.
    assert fixed_offset(exact).lowest_at_MPa == fixed_offset(wrong).lowest_at_MPa == 5
    assert fixed_offset(wrong).share < fixed_offset(exact).share
    content, stated = exported(wrong, "west")
    assert failed_of("west", content, wrong, stated) == set()
    content, stated = exported(exact, "west")
    assert failed_of("west", content, wrong, stated) == {SAFE.id}


TABLE, FIRST = "dead_zones.csv", "positive,1.000000,opening,"
#: Design, and the settings of a folder that has seeded faults.
WEST, CSV = ("one", {"device": "west"}), ("one", {"device": "csv", "table_dp": "2 MPa"})
BOTH = ("two", {"device": "west"})


@pytest.fixture(scope="module")
def designs():
    return {"one": api.design(golden_valve()), "two": golden_compensator(root=FULL)}


@pytest.fixture
def written(designs, tmp_path):
    """Return the folder of a design and settings."""

    def write(name, given):
        made = designs[name]
        output = generate_output(made, "amplifier", settings_of("amplifier", given))
        write_generated(output, tmp_path / "amplifier")
        return tmp_path / "amplifier"

    return write


def edited(folder, name, old, new):
    content = (folder / name).read_bytes()
    assert content.count(old.encode()) == 1
    (folder / name).write_bytes(content.replace(old.encode(), new.encode()))


def found_of(folder):
    """Return what this room alone finds, by id; not what comparing the texts tells."""
    manifest = read_artefact((folder / MANIFEST_NAME).read_bytes(), OutputManifest, MANIFEST_NAME)
    compensator = read_artefact((folder / "compensator.json").read_bytes(), Compensator, "compensator.json")
    checks = amplifier.checks(folder, manifest, compensator, lambda _: None).checks
    return {check.id: check for check in checks}


def failed(folder):
    return {name for name, check in found_of(folder).items() if check.holds is not True}


@pytest.mark.parametrize(
    ("name", "given"),
    [WEST, CSV, BOTH, ("one", {"device": "west", "threshold": "2 %"})]
    + [("one", {"device": device}) for device in ("beckhoff", "cia408", "rmc75")],
    ids=str,
)
def test_what_was_generated_holds(written, name, given):
    found = found_of(written(name, given))
    assert set(found) == {READ_BACK.id, SAFE.id, DEAD_ZONES.id}
    assert all(check.holds for check in found.values())


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("positive,1.000000,opening", "positive,2.000000,opening"),
        ("positive,1.000000,opening", "negative,1.000000,opening"),
        ("positive,1.000000,opening", "positive,1.000000,closing"),
        ("positive,1.000000,opening", "Infinity,1.000000,opening"),
        (f"{FIRST}0.0", f"{FIRST}0.1"),
        (f"{FIRST}0.0", f"{FIRST}nan,0.0"),  # of which no difference is too large
        ("dead_zone_fixed", "dead_zone"),
    ],
)
def test_a_wrong_table_is_found(written, old, new):
    folder = written(*WEST)
    edited(folder, TABLE, old, new)
    assert DEAD_ZONES.id in failed(folder)


@pytest.mark.parametrize("lines", [slice(0, 5), slice(0, 0)], ids=str)
def test_a_table_without_its_last_lines_is_found(written, lines):
    folder = written(*WEST)
    text = (folder / TABLE).read_text()
    kept = "".join(text.splitlines(keepends=True)[lines])
    (folder / TABLE).write_text(kept)
    assert DEAD_ZONES.id in failed(folder)


def test_the_file_of_another_device_or_a_second_one_is_found(written):
    folder = written(*WEST)
    path = folder / MANIFEST_NAME
    document = json.loads(path.read_text())
    for settings, more in (
        ({"device": "cia408"}, {}),
        ({"device": "west-pam190"}, {}),
        ({}, {}),
        ({"threshold": "1 MPa"}, {}),
        ({}, {"west.old": "0" * 64}),
    ):
        given = {**document["settings"], **settings} if settings or more else {}
        path.write_text(json.dumps({**document, "settings": given, "files": {**document["files"], **more}}))
        assert failed(folder) == {READ_BACK.id}


def test_a_larger_threshold_than_the_files_is_found(written):
    """`verify` takes the threshold that counts as zero from the settings: of a jump behind it the file is unsafe."""
    folder = written(*WEST)
    path = folder / MANIFEST_NAME
    document = json.loads(path.read_text())
    document["settings"]["threshold"] = "5 %"
    path.write_text(json.dumps(document))
    assert SAFE.id in failed(folder)


def test_the_command_says_what_does_not_hold(written, tmp_path, monkeypatch, capsys):
    folder = written(*WEST)
    monkeypatch.chdir(tmp_path)
    assert main(["verify", str(folder), "-q"]) == 0
    assert "Every requirement holds" in capsys.readouterr().out
    edited(folder, "west.txt", "MIN:A 4891", "MIN:A 4901")
    assert main(["verify", str(folder), "-q"]) == 1
    (missed, _) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("DOES NOT HOLD")]
    assert REPRODUCED.title in missed and "west.txt, line" in missed


def test_the_recordings_that_are_given_are_compared_though_no_law_runs(written):
    asked = []

    def compared(runs):
        asked.append(runs)
        return [RAMPS.check(holds=True, text="every number is the same")]

    verified = verify_output(written(*WEST), ramps=compared)
    assert asked == [False], "an amplifier's file has no pressure inputs"
    assert RAMPS.id in {check.id for check in verified.evidence.checks} and "recordings" not in verified.verdict


def test_the_evidence_names_the_settings(written):
    evidence = verify_output(written(*CSV)).evidence
    assert evidence.settings == {"device": "csv", "table_dp": "2 MPa", "threshold": ""}
    assert [check.id for check in evidence.checks if not check.holds] == [REPRODUCED.id]  # nothing was generated again
    assert evidence.target == "amplifier"


def test_an_option_of_other_outputs_is_refused_by_name(written, capsys, wording):
    folder = written(*WEST)
    assert main(["verify", str(folder), "--machine-code"]) == 2
    wording("amplifier folder: --machine-code", capsys.readouterr().err.replace(str(folder), "amplifier"))
