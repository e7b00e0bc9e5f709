"""Files of amplifiers: largest safe setting, rounding, refusals, notes; their folder, and what is printed.

tests/verify/amplifier reads each file back by a reader that shares no code with the writers, and seeds faults into it.
"""

import csv
import io
import json
import re
from dataclasses import replace
from fractions import Fraction

import canopen
import pytest

from dzdesign import api
from dzdesign.codegen.amplifier.device import DEVICE_NAMES, device_named
from dzdesign.codegen.amplifier.files import amplifier_file, notes_of
from dzdesign.codegen.amplifier.setting import amplifier_setting
from dzdesign.codegen.other_targets import generate_output, settings_of
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import PressureUnit, RecordedUnits
from dzdesign.design.fixed_offset import dead_zones
from dzdesign.verify.outputs.amplifier import file_checks
from dzdesign.verify.requirements import SAFE
from tests.support.golden_firmware import FULL, GOLDENS, golden_compensator, golden_valve

DIGEST = "0123456789abcdef" * 4
#: The RMC100 takes no 5 V.
OF_ONE = tuple(name for name in DEVICE_NAMES if name != "rmc")
#: By how much an amplifier may be off, and the oil may move the threshold, in the third design.
BUDGET = {"amplifier": "5 %", "oil": "2 %", "ageing": "0 %"}


def unlimited(compensator):
    """Return a compensator that allows full drive."""
    functions = replace(compensator.drive_functions, compare_limit=compensator.signals.compare_max)
    return replace(compensator, drive_functions=functions)


@pytest.fixture(scope="session")
def designs():
    """The designs, by name."""
    one, two = (golden_compensator(root=root) for root in (GOLDENS, FULL))
    return {
        "one solenoid": one,
        "two solenoids": unlimited(two),
        "two, limited": two,
        "a budget": api.design(golden_valve(), bench_pressure_error="0 MPa", **BUDGET),
    }


def found(compensator, device, change=lambda text: text):
    """Return what `verify` finds wrong in the file for a device."""
    setting = amplifier_setting(compensator, device_named(device))
    stated = {
        sign: [(row.dp_MPa, row.fixed) for row in dead_zones(compensator, drives, sign)]
        for sign, drives in setting.characteristics.items()
    }
    text = amplifier_file(setting, compensator, DIGEST).decode()
    read = file_checks(device, change(text).encode(), compensator, stated)
    return {check.id for check in read if not check.holds}


@pytest.mark.parametrize(
    ("name", "device"),
    [(name, device) for name in ("one solenoid", "two solenoids", "a budget") for device in OF_ONE
     if device_named(device).offset and (name, device) != ("two solenoids", "west-pam190")],
)  # fmt: skip
def test_a_setting_is_safe_and_one_count_more_is_not(designs, name, device):
    stated = device_named(device).offset
    counts = amplifier_setting(designs[name], device_named(device)).parameters[stated.positive]

    def one_more(text):
        if device == "rmc75":
            assert f"{counts / 1000:.3f}" in text
            return text.replace(f"{counts / 1000:.3f}", f"{(counts + 1) / 1000:.3f}")
        separator = "=" if device == "cia408" else " "
        assert f"{separator}{counts}" in text
        return text.replace(f"{separator}{counts}", f"{separator}{counts + 1}")

    assert found(designs[name], device) == set()
    # Of two solenoids the RMC75 has one value, which is far from the other side's bound.
    assert (SAFE.id in found(designs[name], device, one_more)) or (name, device) == ("two solenoids", "rmc75")


def test_a_dcf_is_one_that_canopen_reads(designs, tmp_path):
    setting = amplifier_setting(designs["two solenoids"], device_named("cia408"))
    (tmp_path / "valve.dcf").write_bytes(amplifier_file(setting, designs["two solenoids"], DIGEST))
    dictionary = canopen.import_od(str(tmp_path / "valve.dcf"))
    assert dictionary[0x6342].value == 1
    read = {entry.name: entry.value for entry in (dictionary[index][1] for index in (0x6343, 0x6344, 0x6345))}
    assert read == setting.parameters
    kinds = {dictionary[index][1].data_type for index in (0x6343, 0x6344, 0x6345)}
    assert kinds == {canopen.objectdictionary.INTEGER16}


def test_a_table_is_the_law_beyond_the_transition_and_rises(designs):
    for name, device in (("one solenoid", "beckhoff"), ("two solenoids", "csv"), ("two, limited", "beckhoff")):
        compensator = designs[name]
        setting = amplifier_setting(compensator, device_named(device))
        at = compensator.valve.sides["positive"].reference.dp_MPa
        dp_code = round(compensator.signals.pair(1).dp_code(Fraction(repr(at))))
        command = compensator.signals.command
        limit = Fraction(compensator.drive_functions.compare_limit, compensator.signals.compare_max)
        for sign, characteristic in setting.characteristics.items():
            for one in zip(*characteristic.nodes, strict=True):
                assert list(one) == sorted(set(one))
            for code in range(compensator.transition_end, command.span(sign), 97):
                exact = compensator.drive(command.zero_code + command.direction(sign) * code, dp_code, sign)
                assert abs(characteristic.drive(Fraction(code, command.span(sign))) - min(exact, limit)) < 1e-4


def test_the_same_design_gives_the_same_bytes_with_its_hash(designs):
    compensator = designs["one solenoid"]
    for name in OF_ONE:
        device = device_named(name)
        first, second = (amplifier_file(amplifier_setting(compensator, device), compensator, DIGEST) for _ in range(2))
        assert first == second and first.isascii()
        naming = [line for line in first.decode().splitlines() if DIGEST in line]
        assert ["compensator.json" in line for line in naming] == [True] * (device.format != "commands")


def test_every_device_states_its_source_its_range_and_a_law_that_is_drawn_up():
    for name in DEVICE_NAMES:
        device = device_named(name)
        assert device.sources and all(len(source) > 20 for source in device.sources)
        assert (device.offset is None) == (device.law == "table")
        for parameter in (device.offset, device.full, device.threshold):
            assert parameter is None or 0 <= parameter.least < parameter.most <= device.counts_of_full
        texts = (device.title, device.description, device.unconfirmed, device.hint, device.instead)
        text = "".join((*texts, *device.sources))
        assert text.isascii() and "*)" not in text and "\n" not in text and "http" not in text


@pytest.mark.parametrize(
    ("name", "device", "options"),
    [
        ("one solenoid", "rmc", {}),
        ("two solenoids", "west-pam190", {}),
        ("one solenoid", "west", {"dp_MPa": Fraction(2)}),
        ("one solenoid", "csv", {"dp_MPa": Fraction(8)}),
        ("one solenoid", "rmc75", {"threshold": Fraction(1, 100)}),
        ("limited", "cia408", {}),
        ("limited low", "west", {}),
        ("one solenoid", "none", {}),
    ],
)
def test_what_a_device_does_not_hold_is_refused(designs, name, device, options, wording):
    compensator = designs["one solenoid"]
    if name.startswith("limited"):
        limit = 45_000 if name == "limited" else 29_000
        functions = replace(compensator.drive_functions, compare_limit=limit)
        compensator = replace(compensator, drive_functions=functions)
    if name == "two solenoids":
        compensator = designs[name]
    with wording.refusal(InputError, f"amplifier files: {device}, {name}, {' '.join(options) or 'as it is'}"):
        amplifier_setting(compensator, device_named(device), **options)


def test_a_threshold_is_rounded_up_and_an_offset_down(designs):
    setting = amplifier_setting(designs["one solenoid"], device_named("west"), threshold=Fraction(1, 3000))
    assert setting.parameters["TRIGGER"] == 4
    drives = setting.characteristics[1]
    assert drives.drive(Fraction(1, 3000)) == drives.drive(Fraction(4, 10_000)) == 0
    assert drives.drive(Fraction(4, 10_000) + Fraction(1, 10**9)) >= Fraction(setting.parameters["MIN:A"], 10_000)
    offset, counts = setting.offsets[1].share, setting.parameters["MIN:A"]
    assert counts <= offset * 10_000 < counts + 1


def test_full_command_is_the_drive_that_opens_the_valve_fully_at_every_test(designs, monkeypatch):
    drives = iter([Fraction(70, 100), Fraction(85, 100), Fraction(60, 100)])
    monkeypatch.setattr("dzdesign.codegen.amplifier.setting.full_drive", lambda *_: next(drives))
    assert amplifier_setting(designs["one solenoid"], device_named("west")).parameters["MAX:A"] == 8500


def test_notes_say_what_is_not_certified(designs):
    notes = {
        name: " ".join(notes_of(amplifier_setting(compensator, device_named("west")), compensator))
        for name, compensator in designs.items()
    }
    assert "above 5.00 MPa" in notes["one solenoid"] and "only the valve as recorded" in notes["one solenoid"]
    assert "below 1.00 MPa" in notes["two solenoids"] and "dither" in notes["two solenoids"]
    assert "only the valve as recorded" not in notes["a budget"]


BESIDE = {".gitattributes", "dead_zones.csv", "compensator.json"}


@pytest.fixture(scope="module")
def compensator():
    return api.design(golden_valve())


@pytest.fixture
def here(tmp_path, monkeypatch, compensator):
    """A folder with a compensator.json."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "compensator.json").write_bytes(to_json_bytes(compensator))
    return tmp_path


def output_of(compensator, **given):
    return generate_output(compensator, "amplifier", settings_of("amplifier", given))


def run(*words):
    return main(["codegen", "compensator.json", "--target", *words])


def test_the_folder_has_the_file_and_is_the_same_again(here, capsys):
    for options in (
        ("--device", "west", "--threshold", "1 %"),
        ("--device", "csv", "--table-dp", "20 bar"),
    ):
        assert run("amplifier", *options, "-o", "made", "-q") == 0
        [name] = {path.name for path in (here / "made").iterdir()} - BESIDE - {"manifest.json"}
        before = {path.name: path.read_bytes() for path in (here / "made").iterdir()}
        assert run("amplifier", *options, "-o", "made", "-q") == 0
        assert before == {path.name: path.read_bytes() for path in (here / "made").iterdir()}
        assert name == {"west": "west.txt", "csv": "csv.csv"}[options[1]]
    manifest = json.loads(before["manifest.json"])
    assert manifest["settings"] == {"device": "csv", "table_dp": "20 bar", "threshold": ""}
    assert set(manifest["files"]) == {"csv.csv"} | BESIDE
    assert "device csv, table-dp 20 bar" in capsys.readouterr().out


@pytest.mark.parametrize("device", ["west", "rmc75", "csv"])
def test_what_is_printed_is_in_the_table(device, compensator):
    output = output_of(compensator, device=device)
    rows = list(csv.DictReader(io.StringIO(output.files["dead_zones.csv"].decode("ascii"))))
    printed = printed_shares(str(output))
    assert len(rows) == 6 and len(printed) == 3
    for row in rows:
        (shares,) = (each for dp_MPa, *each in printed if abs(dp_MPa - float(row["dp_MPa"])) < 0.006)
        place = ("opening", "closing").index(row["branch"])
        for share, column in ((shares[place], "dead_zone_fixed"), (shares[2 + place], "dead_zone_law")):
            assert share == pytest.approx(float(row[column]), abs=1.1e-4)


def printed_shares(text):
    """Return the rows of the printed table: pressure drop and the shares behind it, of command."""
    rows = re.findall(r"^ +(\d+\.\d\d)((?: +\d+\.\d\d%)+)", text, flags=re.MULTILINE)
    return [[float(dp), *(float(share) / 100 for share in re.findall(r"[\d.]+(?=%)", rest))] for dp, rest in rows]


def test_a_larger_threshold_and_another_pressure_change_the_file(compensator):
    law = {text: output_of(compensator, device="csv", table_dp=text).files["csv.csv"] for text in ("1 MPa", "30 bar")}
    assert law["1 MPa"] != law["30 bar"] == output_of(compensator, device="csv", table_dp="3 MPa").files["csv.csv"]
    near, at = (output_of(compensator, device="csv", table_dp=text).files for text in ("5.04 MPa", "5 MPa"))
    assert near["csv.csv"] == at["csv.csv"]
    assert "TRIGGER 200" in output_of(compensator, device="west", threshold="2 %").files["west.txt"].decode()


def test_what_is_said_is_in_the_units_of_the_recordings(compensator):
    units = RecordedUnits(pressure=PressureUnit(unit="bar", factor=10.0))
    in_bar = replace(compensator, valve=replace(compensator.valve, recorded_units=units))
    with pytest.raises(InputError, match="is 80 bar, outside the tests from 10 bar to 50 bar"):
        output_of(in_bar, device="csv", table_dp="80 bar")
    output = output_of(in_bar, device="csv")
    assert "above 50.0 bar" in output.note
    assert "from 10.0 to 50.0 bar" in str(output) and "dP (bar)" in str(output)


def test_both_sides_stand_in_the_table():
    both = golden_compensator(root=FULL)
    table = output_of(both, device="west").files["dead_zones.csv"].decode("ascii")
    counts = [2 * len(both.valve.sides[side].tests) for side in ("positive", "negative")]
    expected = ["positive"] * counts[0] + ["negative"] * counts[1]
    assert [line.partition(",")[0] for line in table.splitlines()[1:]] == expected and min(counts)


@pytest.mark.parametrize(
    "words",
    [
        ("amplifier",),
        ("amplifier", "--device", "wset"),
        ("amplifier", "--device", "rmc"),
        ("amplifier", "--device", "west", "--table-dp", "1 MPa"),
        ("amplifier", "--device", "csv", "--table-dp", "2"),
        ("amplifier", "--device", "csv", "--table-dp", "0.2 MPa"),
        ("amplifier", "--device", "west", "--threshold", "0.01"),
        ("amplifier", "--device", "west", "--threshold", "31 %"),
        ("matlab", "--device", "west"),
        ("f28335", "--threshold", "1 %"),
        ("iec61131", "--interface", "bar"),
        ("iec61131", "--vectors", "4000"),
        ("iec61130",),
    ],
    ids=" ".join,
)
def test_bad_input_is_one_sentence_and_nothing_is_written(words, here, capsys, wording):
    assert run(*words, "-o", "made") == 2
    printed = capsys.readouterr()
    assert not printed.out and printed.err.count("\n") == 1
    assert [path.name for path in here.iterdir()] == ["compensator.json"]
    wording(f"amplifier output: {' '.join(words)}", printed.err)


def test_a_compensator_whose_numbers_do_not_follow_is_refused(here, capsys, wording):
    document = json.loads((here / "compensator.json").read_text())
    document["sides"]["positive"]["beta"][3] += 40
    (here / "compensator.json").write_text(json.dumps(document))
    assert run("amplifier", "--device", "west", "-o", "made") == 2 and not (here / "made").exists()
    wording("amplifier output: a changed beta", capsys.readouterr().err)


def test_another_option_is_named_where_it_chose_the_output():
    with pytest.raises(InputError, match="--outputs amplifier needs --device"):
        settings_of("amplifier", {}, "--outputs")
