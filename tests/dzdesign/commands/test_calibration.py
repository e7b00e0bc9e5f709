"""`dzdesign calibration`: a valve's block as a file, byte for byte again, and back; what it refuses, what it leaves."""

import inspect
import json
import os
import re
import zlib
from dataclasses import replace

import pytest

from dzdesign import api
from dzdesign.codegen.calibration.block import block_of
from dzdesign.codegen.calibration.packing import image_of, pack
from dzdesign.codegen.project import generate, target_named
from dzdesign.command_line.cli import main
from dzdesign.command_line.parser import arguments_of_command
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import sha256_of, to_json
from dzdesign.core.recorded_units import CommandUnit, PressureUnit, RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.design.lot_valves import LotValve
from tests.support.block_reader import hex_memory, members_of
from tests.support.core_variants import variant
from tests.support.paths import ROOT

VALVE = ROOT / "tests" / "goldens" / "valve.json"
#: Without the proof of the compensator's numbers, which takes a second.
UNPROVEN = ("dzdesign.design.redesign.prove_derived", lambda compensator: None)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A folder with compensator.json and its block in each format, as the commands wrote them."""
    folder = tmp_path_factory.mktemp("calibration")
    compensator = folder / "compensator.json"
    api.design(VALVE, output=compensator)
    words = ["calibration", str(compensator), "--serial", "V-7", "-q", "-o"]
    assert main([*words, str(folder / "valve.hex")]) == 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(*UNPROVEN)
        api.calibration(compensator, output=folder / "valve.bin", serial="V-7")
    return folder


@pytest.fixture
def unproven(monkeypatch):
    """Leave out the proof of the compensator's numbers; `written` and the test of a wrong one have it."""
    monkeypatch.setattr(*UNPROVEN)


@pytest.fixture
def block(written):
    """The octets of the block, from what the command wrote."""
    return (written / "valve.bin").read_bytes()


def test_the_formats_hold_the_same_block_at_the_targets_sector(written, block):
    place = 0x33_0000 * 2
    expected = {place + at: octet for at, octet in enumerate(block)}
    assert hex_memory((written / "valve.hex").read_text(), of_words=True) == expected
    members = members_of(block)
    digest = sha256_of((written / "compensator.json").read_bytes())
    assert members == {
        "magic": b"DZC1", "layout": 1, "length": len(block) // 2, "shape": 0, "code_max": 4095, "compare_max": 60000,
        "sample_Hz": 1250, "tick_Hz": 2500, "sha256": bytes.fromhex(digest), "serial": b"V-7", "record": b"",
        "u_max_uV": 10_000_000, "a_span_Pa": 20_000_000, "a_full": 3822, "command_zero": 0,
    }  # fmt: skip


def test_the_same_input_gives_the_same_bytes(written, tmp_path, unproven):
    for name in ("valve.hex", "valve.bin"):
        again = api.calibration(written / "compensator.json", output=tmp_path / name, serial="V-7")
        assert (tmp_path / name).read_bytes() == again.content == (written / name).read_bytes()


@pytest.mark.parametrize("name", ["valve.hex", "valve.bin"])
def test_a_file_is_read_back(written, name, capsys):
    assert main(["calibration", "--read", str(written / name), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    digest = sha256_of((written / "compensator.json").read_bytes())
    assert (said["serial"], said["compensator_sha256"], said["belongs"]) == ("V-7", digest, None)
    assert main(["calibration", "--read", str(written / name), str(written / "compensator.json")]) == 0
    page = capsys.readouterr().out
    assert "V-7" in page and digest in page and "Is the block of" in page


@pytest.mark.parametrize(
    ("name", "words", "placed"),
    [
        ("a.hex", [], "word 0x330000, where f28335"),
        ("a.hex", ["--address", "0x300000"], "word 0x300000, WHERE NO"),
        ("a.hex", ["--target", "host", "--address", "0x660000"], "octet 0x660000, WHERE NO"),
        ("a.bin", [], None),
    ],
)
def test_a_file_says_where_a_programmer_writes_the_block(written, tmp_path, unproven, capsys, name, words, placed):
    file = str(tmp_path / name)
    assert main(["calibration", str(written / "compensator.json"), "-o", file, *words]) == 0
    assert ("NOT 0x330000" in capsys.readouterr().out) is ("0x300000" in words)
    assert main(["calibration", "--read", file, str(written), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)["placed"]
    assert said is None if placed is None else said.startswith(placed)


def test_a_firmware_folder_stands_for_its_compensator(written, tmp_path, capsys):
    (tmp_path / "compensator.json").write_bytes((written / "compensator.json").read_bytes())
    assert main(["calibration", "--read", str(written / "valve.hex"), str(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["belongs"] is True


def test_another_compensator_and_a_changed_number_are_found(written, tmp_path, block, capsys):
    other = tmp_path / "compensator.json"
    text = (written / "compensator.json").read_bytes()
    other.write_bytes(text.replace(b"\n", b"\r\n") + b"\r\n")  # of the same content
    assert main(["calibration", "--read", str(written / "valve.hex"), str(other)]) == 0
    assert "Is the block of" in capsys.readouterr().out
    document = json.loads(text)
    document["made_from"][0]["sha256"] = "0" * 64
    other.write_bytes(to_json(document).encode())
    assert main(["calibration", "--read", str(written / "valve.hex"), str(other)]) == 1
    assert "IS NOT THE BLOCK" in capsys.readouterr().out
    # A number changed on the way, and the CRC made right: what the SHA-256 alone would not show.
    wrong = bytearray(block)
    wrong[2 * 82] ^= 1
    (tmp_path / "valve.bin").write_bytes(wrong[:-4] + zlib.crc32(wrong[:-4]).to_bytes(4, "little"))
    words = ["calibration", "--read", str(tmp_path / "valve.bin"), str(written / "compensator.json"), "--json"]
    assert main(words) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["belongs"] is False and said["difference"].endswith(": reverse")


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (lambda octets: b"", "DZC1"),
        (lambda octets: octets[:-2], "cut"),
        (lambda octets: octets + octets, "something follows the block"),
        (lambda octets: octets[:4] + b"\2\0" + octets[6:], "layout 2"),
        (lambda octets: octets[:700] + bytes([octets[700] ^ 4]) + octets[701:], "CRC-32"),
        (lambda octets: b'{"schema": "dzdesign.valve/1"}', "DZC1"),
    ],
)
@pytest.mark.parametrize("form", ["hex", "bin"])
def test_a_damaged_block_is_one_sentence(block, tmp_path, form, damage, named, capsys):
    file = tmp_path / f"valve.{form}"
    octets = damage(block)
    file.write_bytes(image_of(octets, form, target_named("f28335").block_place))
    assert main(["calibration", "--read", str(file)]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    assert named in said.err or (not octets and "none of its rows" in said.err)


@pytest.mark.parametrize("rows", [lambda rows: rows[:4] + rows[5:], lambda rows: rows[:4] + rows[3:]])
def test_a_row_of_intel_hex_that_is_lost_or_twice_is_said(block, tmp_path, rows, capsys):
    found = image_of(block, "hex", target_named("f28335").block_place).decode().splitlines()
    (tmp_path / "valve.hex").write_text("\n".join(rows(found)))
    assert main(["calibration", "--read", str(tmp_path / "valve.hex")]) == 2
    assert "do not follow each other" in capsys.readouterr().err


def test_a_serial_number_that_steers_a_terminal_is_shown_as_blanks(written, block, tmp_path, capsys):
    wrong = bytearray(block)
    wrong[52:64] = b"\x1b[2Jx\n\xff\xfey\0zz"
    (tmp_path / "valve.bin").write_bytes(wrong[:-4] + zlib.crc32(wrong[:-4]).to_bytes(4, "little"))
    assert main(["calibration", "--read", str(tmp_path / "valve.bin"), str(written)]) == 0
    out = capsys.readouterr().out
    assert "\x1b" not in out and "[2Jx" in out.splitlines()[0]


@pytest.mark.parametrize(
    "words",
    [
        ["valve.hex"],
        ["-o", "valve.hex"],
        ["compensator.json"],
        ["compensator.json", "-o", "valve.s19"],
        ["compensator.json", "-o", "valve"],
        ["compensator.json", "-o", "new.bin", "--address", "0x330000"],
        ["compensator.json", "-o", "new.hex", "--address", "sector B"],
        ["compensator.json", "-o", "new.hex", "--address", "0x330001"],
        ["compensator.json", "-o", "new.hex", "--address", "0x80000000"],
        ["compensator.json", "-o", "new.hex", "--address", "-4"],
        ["compensator.json", "-o", "new.hex", "--target", "f280049c"],
        ["compensator.json", "-o", "new.hex", "--target", "f28334"],
        ["compensator.json", "-o", "nowhere/new.hex"],
        ["compensator.json", "-o", ""],
        ["--read", ""],
        ["valve.hex", "-o", "new.hex"],
        ["--read", "valve.hex", "-o", "new.hex"],
        ["--read", "valve.hex", "--serial", "8"],
        ["--read", "valve.hex", "--target", "f28335"],
        ["--read", "."],
        ["compensator.json", "-o", "new.hex", "--serial", "  "],
        ["--read", "nothing.hex"],
        ["--read", "compensator.json"],
        ["--read", "valve.hex", "valve.bin"],
    ],
    ids=" ".join,
)
def test_bad_usage_is_one_sentence_and_writes_nothing(written, words, monkeypatch, capsys, unproven, wording):
    monkeypatch.chdir(written)
    before = sorted(os.listdir())
    assert main(["calibration", *words]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1 and sorted(os.listdir()) == before
    wording(f"calibration: {' '.join(words)}", said.err)


def test_only_a_block_is_written_over(written, tmp_path, monkeypatch, capsys, unproven):
    monkeypatch.chdir(tmp_path)
    words = ["calibration", str(written / "compensator.json"), "-q"]
    for name, content in (("ramp.hex", b"time_s\tu_V\n0\t0\n"), ("tool.bin", b"\x7fELF"), ("other.hex", b"")):
        (tmp_path / name).write_bytes(content)
        assert main([*words, "-o", name]) == (0 if content == b"" else 2)  # an empty file is nobody's
        assert content == b"" or (tmp_path / name).read_bytes() == content
    (tmp_path / "folder.hex").mkdir()
    os.mkfifo(tmp_path / "pipe.hex")
    for name in ("folder.hex", "pipe.hex"):
        assert main([*words, "-o", name]) == 2
    first = (tmp_path / "other.hex").read_bytes()
    assert main([*words, "-o", "other.hex", "--serial", "8"]) == 0 and (tmp_path / "other.hex").read_bytes() != first
    # A link is replaced by the file, and what it led to stays: as of every artefact that is one file.
    (tmp_path / "link.hex").symlink_to("other.hex")
    kept = (tmp_path / "other.hex").read_bytes()
    assert main([*words, "-o", "link.hex"]) == 0 and (tmp_path / "other.hex").read_bytes() == kept
    assert not (tmp_path / "link.hex").is_symlink() and (tmp_path / "link.hex").read_bytes() == first
    assert not [name for name in os.listdir() if name.startswith(".")]
    capsys.readouterr()


def test_address_and_target_can_be_chosen(written, tmp_path, capsys, unproven):
    words = ["calibration", str(written / "compensator.json"), "--json"]
    for given, address in ((["--address", "0x320000"], 0x32_0000 * 2), (["--target", "host"], 0)):
        assert main([*words, "-o", str(tmp_path / "a.hex"), *given]) == 0
        assert min(hex_memory((tmp_path / "a.hex").read_text(), of_words=address > 0)) == address
        assert json.loads(capsys.readouterr().out)["address"] == (hex(address // 2) if address else "0x0")


def test_an_options_file_for_all_commands_is_taken(written, tmp_path, capsys, unproven):
    """Its [record] is the table of `identify`, and no text of a block."""
    options = tmp_path / "dzdesign.toml"
    options.write_text('target = "f28335"\naddress = 0x320000\n[record]\nserial = "4711"\n')
    words = [str(written / "compensator.json"), "-o", str(tmp_path / "valve.hex"), "--json", "--config", str(options)]
    assert main(["calibration", *words]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["address"], said["serial"], said["record"]) == ("0x320000", "", "")


def test_serial_and_record_come_from_the_test_record_unless_given(unproven, tmp_path):
    compensator = variant("default")
    record = {"Serial": "4711 №", "record": "lot 12", "oil": "HLP 46"}
    compensator = replace(compensator, valve=replace(compensator.valve, record=record))
    by_record, given, none = (
        members_of(pack(api.calibration(compensator, **words).block))
        for words in ({}, {"serial": "4711 №", "record": "shelf 3"}, {"serial": "", "record": ""})
    )
    assert (by_record["serial"], by_record["record"]) == ("4711 №".encode(), b"lot 12")
    assert (given["serial"], given["record"]) == ("4711 №".encode(), b"shelf 3")
    assert (none["serial"], none["record"]) == (b"", b"")
    # Another number would make this valve's law pass for that of another valve.
    with pytest.raises(api.InputError, match=r"'8'.*'4711 №'"):
        api.calibration(compensator, serial="8")
    document = to_json_bytes(compensator)
    (tmp_path / "valve.bin").write_bytes(pack(block_of(compensator, sha256_of(document), serial="8")))
    (tmp_path / "compensator.json").write_bytes(document)
    found = api.read_calibration(tmp_path / "valve.bin", tmp_path)
    assert found.belongs is False and "'8'" in found.difference
    # One setting for a lot is designed from one valve, whose number is not that of the others.
    sides = {1: compensator.valve.sides["positive"]}
    lot = tuple(LotValve.of(name, "0" * 64, sides, {1: "closing"}) for name in ("V-1", "V-2"))
    of_lot = members_of(pack(api.calibration(replace(compensator, lot=lot)).block))
    assert (of_lot["serial"], of_lot["record"]) == (b"", b"")
    with pytest.raises(api.InputError, match="at most 24; shorten it"):
        api.calibration(variant("default"), serial="x" * 25)


def test_the_page_is_in_the_units_of_the_recordings_where_the_compensator_is_known(tmp_path, capsys):
    units = RecordedUnits(
        command=CommandUnit(unit="mA", at_zero=4.0, factor=1.6), pressure=PressureUnit(unit="bar", factor=10.0)
    )
    compensator = variant("default")
    compensator = replace(compensator, valve=replace(compensator.valve, recorded_units=units))
    (tmp_path / "compensator.json").write_bytes(to_json_bytes(compensator))
    octets = pack(block_of(compensator, sha256_of(to_json_bytes(compensator))))
    (tmp_path / "valve.bin").write_bytes(octets)
    words = ["calibration", "--read", str(tmp_path / "valve.bin")]
    assert main([*words, str(tmp_path)]) == 0
    page = capsys.readouterr().out
    assert "20 mA" in page and "200 bar at code 3822" in page and "dP (bar)" in page
    assert main(words) == 0
    page = capsys.readouterr().out
    assert "10 V" in page and "20 MPa at code 3822" in page and "mA" not in page


def test_the_api_takes_the_options_of_the_command():
    options = {each.name for each in arguments_of_command("calibration")} - {"read"}
    assert set(inspect.signature(api.calibration).parameters) == {*options, "config"}
    assert set(inspect.signature(api.read_calibration).parameters) == {"file", "compensator"}
    for function in (api.calibration, api.read_calibration):
        assert re.search(r"\n\n *Raises\n *------\n", function.__doc__)


def test_the_api_takes_the_result_of_the_stage_before(written, unproven):
    compensator = read_artefact((written / "compensator.json").read_bytes(), Compensator, "compensator.json")
    found = api.read_calibration(written / "valve.hex", compensator)
    assert found.belongs is True and found.reading.serial == "V-7" and found.difference == ""
    made = api.calibration(compensator, serial="V-7")
    assert (made.format, made.address) == ("bin", None) and made.content == (written / "valve.bin").read_bytes()


def test_the_firmware_holds_the_same_block(written, unproven):
    content = (written / "compensator.json").read_bytes()
    compensator = read_artefact(content, Compensator, "compensator.json")
    firmware = generate(compensator, "f28335", "block")
    assert firmware.contents["calibration.bin"] == api.calibration(written / "compensator.json").content


def test_a_number_that_does_not_follow_from_the_valve_is_refused(written, tmp_path, capsys):
    document = json.loads((written / "compensator.json").read_text())
    document["zero_band_codes"] += 1
    (tmp_path / "compensator.json").write_text(json.dumps(document))
    assert main(["calibration", str(tmp_path / "compensator.json"), "-o", str(tmp_path / "valve.hex")]) == 2
    assert "compensator.json" in capsys.readouterr().err and not (tmp_path / "valve.hex").exists()
