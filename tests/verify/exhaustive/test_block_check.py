"""The block in a firmware's folder and those of other valves: what is right holds; another number or law is seen."""

import shutil
from dataclasses import replace

import pytest

from dzdesign.block_checks import given_blocks
from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import SourceFile
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.verify.exhaustive.block_check import BlockFirmware, own_block_accepted
from dzdesign.verify.folder import read_firmware_manifest
from dzdesign.verify.toolchain import compiled_library, host_compiler
from tests.support.block_cores import block_folder
from tests.support.core_variants import variant
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler

SOURCE = SourceFile(source="compensator.json", sha256="0" * 64)
FORMAT_AND_CRC, FIRMWARE = 0b10, 0b100


@pytest.fixture(scope="module")
def lot(tmp_path_factory):
    """A firmware folder in block form, and folders with block and compensator.json of two valves of its kind."""
    folder = tmp_path_factory.mktemp("lot")
    first = variant("default")
    other = variant("no transition")
    for name, compensator in {"one": first, "other": other}.items():
        block_folder(compensator, folder / name)
    firmware = generate(first, "f28335", "block")
    write_folder(folder / "fw", firmware.contents, firmware.manifest)
    return folder, {"one": first, "other": other}


def block_in(folder, name):
    return (folder / name / "calibration.bin").read_bytes()


def changed(octets, **numbers):
    return pack(replace(unpack(octets), **numbers))


@pytest.mark.slow
def test_each_block_is_tried_on_every_input_and_the_core_is_compiled_once(lot, monkeypatch):
    folder, compensators = lot
    commands, run = [], host_compiler.run_compiler
    monkeypatch.setattr(host_compiler, "run_compiler", lambda *given: commands.append(given[0]) or run(*given))
    earlier = set(host_compiler.build_folder().glob("*.bin"))
    firmware = BlockFirmware(folder / "fw")
    found = {"one": firmware.check(block_in(folder, "one"), compensators["one"], SOURCE)}
    first = len(commands)
    found["other"] = firmware.check(block_in(folder, "other"), compensators["other"], SOURCE)
    assert all(each.holds and each.inputs[0].inputs > 20_000_000 for each in found.values())
    assert len({each.inputs[0].outputs_hash for each in found.values()}) == 2
    assert len({each.inputs[0].object_sha256 for each in found.values()}) == 1
    assert sum("dz_comp.c" in command for command in commands) <= 1
    assert not any(each in command for command in commands[first:] for each in ("every_input.c", "other_codes.c"))
    assert set(host_compiler.build_folder().glob("*.bin")) <= earlier  # others may take theirs away meanwhile


def test_the_block_of_another_valve_is_seen(lot):
    folder, compensators = lot
    found = BlockFirmware(folder / "fw").check(block_in(folder, "one"), compensators["other"], SOURCE)
    check = found.requirement("one", compensators["other"])
    assert not found.holds and found.inputs[0].wrong and check.holds is False and "one" in check.name


def test_what_the_firmware_refuses_is_not_tried(lot):
    folder, compensators = lot
    firmware, octets = BlockFirmware(folder / "fw"), block_in(folder, "one")
    damaged = firmware.check(octets[:99] + bytes([octets[99] ^ 1]) + octets[100:], compensators["one"], SOURCE)
    other_rate = firmware.check(changed(octets, tick_Hz=unpack(octets).tick_Hz // 2), compensators["one"], SOURCE)
    assert damaged.refused & FORMAT_AND_CRC and other_rate.refused == FIRMWARE
    assert not damaged.holds and not other_rate.holds and not damaged.inputs + other_rate.inputs
    with pytest.raises(RequirementError, match="octets"):
        firmware.check(octets[:-2], compensators["one"], SOURCE)


def test_what_can_not_be_tried_is_refused_before_anything_runs(lot, tmp_path):
    folder, compensators = lot
    lonely = tmp_path / "valve.bin"
    lonely.write_bytes(block_in(folder, "one"))
    with pytest.raises(InputError, match="beside"):
        given_blocks(folder / "fw", [lonely])
    fixed = generate(compensators["one"], "f28335")
    write_folder(tmp_path / "fixed", fixed.contents, fixed.manifest)
    with pytest.raises(InputError, match="block form"):
        given_blocks(tmp_path / "fixed", [folder / "one" / "calibration.bin"])


CHECK, LINKED, BLOCK = "core/dz_calibration.c", "f28335/dz_block.c", "calibration.bin"
HEADER = ("magic", "layout", "length", "shape", "code_max", "compare_max", "sample_Hz", "tick_Hz", "beta_step")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    compensator = variant("bipolar, all options")
    firmware = generate(compensator, "f28335", "block")
    folder = tmp_path_factory.mktemp("made") / "fw"
    write_folder(folder, firmware.contents, firmware.manifest)
    return folder


@pytest.fixture
def firmware(made, tmp_path):
    return shutil.copytree(made, tmp_path / "fw")


def checked(folder):
    (check,) = own_block_accepted(folder, read_firmware_manifest(folder))
    assert check.id == "block-accepted"
    return check


def edit(folder, name, old, new):
    text = (folder / name).read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    (folder / name).write_text(text.replace(old, new), encoding="utf-8")


def test_a_firmware_accepts_its_block_and_refuses_it_damaged(made):
    check = checked(made)
    assert check.holds and "2680 octets" in check.text and f"{4 * (len(HEADER) + 1)} changed headers" in check.text


def test_a_core_with_the_numbers_of_its_valve_has_no_block(made):
    manifest = replace(read_firmware_manifest(made), calibration="fixed")
    assert own_block_accepted(made, manifest) == ()


def test_without_its_block_nothing_is_accepted(firmware):
    (firmware / BLOCK).unlink()
    check = checked(firmware)
    assert check.holds is False and BLOCK in check.text and "codegen --calibration block" in check.text


@pytest.mark.parametrize("size", [0, 2661])
def test_a_block_of_another_size_is_refused(firmware, size):
    (firmware / BLOCK).write_bytes(((firmware / BLOCK).read_bytes() + b"\0")[:size])
    check = checked(firmware)
    assert check.holds is False and f"{BLOCK} has {size} octets" in check.text


@pytest.mark.parametrize(
    ("change", "found"),
    [
        ({"sample_Hz": 1000}, "refuses calibration.bin (0x0004)"),
        ({"compare_limit": 1}, "refuses calibration.bin"),
        ({"serial": tuple(range(1, 13))}, "of dz_block.c are not those of calibration.bin"),
    ],
)
def test_a_block_that_is_not_the_linked_one_is_found(firmware, change, found):
    block = unpack((firmware / BLOCK).read_bytes())
    (firmware / BLOCK).write_bytes(pack(replace(block, **change)))
    check = checked(firmware)
    assert check.holds is False and found in check.text


def test_the_block_of_another_compensator_is_found(firmware):
    """Both files are of one block, and the firmware accepts it: only the hash that it names tells."""
    document = firmware / "compensator.json"
    document.write_bytes(document.read_bytes().replace(b"1.0.0", b"1.0.1", 1))
    check = checked(firmware)
    assert check.holds is False and "another compensator.json" in check.text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "found"),
    [
        ("differs(block->crc32, crc_of(block))", "differs(crc_of(block), crc_of(block))", "with one bit changed"),
        ("differs(block->magic, DZ_CALIBRATION_MAGIC) | ", "", "changed headers"),
        ("bit_of(format_wrong(block), DZ_CALIBRATION_FORMAT)", "bit_of(format_wrong(block), 0u)", "changed headers"),
        *(
            (f"differs(block->{name}, DZ_{macro})", f"differs(block->{name}, block->{name})", "changed headers")
            for name, macro in (("layout", "CALIBRATION_LAYOUT"), ("code_max", "ADC_CODE_MAX"), ("tick_Hz", "TICK_HZ"))
        ),
        ("found = (uint16_t)(bit_of(f", "found = (uint16_t)(1u | bit_of(f", "refuses calibration.bin (0x0001)"),
        ("return ~crc;", "return ~crc + 1u;", "refuses calibration.bin (0x0002)"),
    ],
)  # fmt: skip
def test_a_check_that_is_wrong_is_found(firmware, old, new, found):
    edit(firmware, CHECK, old, new)
    check = checked(firmware)
    assert check.holds is False and found in check.text


def test_a_check_that_hangs_is_found(firmware, monkeypatch):
    edit(firmware, CHECK, "return ~crc;", "for (;;) {\n    }")
    monkeypatch.setattr(compiled_library, "CALL_S", 0.3)
    check = checked(firmware)
    assert check.holds is False and "did not end" in check.text


def test_a_folder_without_the_files_of_block_form_is_told(firmware):
    (firmware / LINKED).unlink()
    assert checked(firmware).holds is False
    (firmware / "core" / "dz_calibration.h").unlink()
    assert checked(firmware).holds is False
