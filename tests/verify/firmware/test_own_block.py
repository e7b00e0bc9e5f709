"""The calibration block in a firmware's folder, asked of the folder's own C: every fault is in that C or the block."""

import shutil
from dataclasses import replace

import pytest

from dzdesign.codegen.calibration.packing import pack, unpack
from dzdesign.codegen.project import generate
from dzdesign.core.artefact_files import write_folder
from dzdesign.verify.exhaustive.block_check import own_block_accepted
from dzdesign.verify.folder import read_firmware_manifest
from dzdesign.verify.toolchain import compiled_library
from tests.support.core_variants import variant
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
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
    assert check.holds and "2660 octets" in check.text and f"{4 * (len(HEADER) + 1)} changed headers" in check.text


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
