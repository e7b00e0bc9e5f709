"""The firmware for the f28335 compiles against a stand-in of TI's headers, and what is wrong with it is seen."""

import pytest

from tests.support.c2000ware import check_against_c2000ware
from tests.support.f28335_device import c2000ware_stand_in
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


@pytest.fixture
def ware(firmware_folder, tmp_path):
    return c2000ware_stand_in(tmp_path / "C2000 Ware", firmware_folder / "f28335" / "dzdesign.projectspec")


def seed(path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


@pytest.mark.slow
def test_the_whole_firmware_compiles_against_the_users_headers(firmware_folder, ware):
    assert len(list(firmware_folder.rglob("*.c"))) >= 6, "the core, and five of the hardware"
    assert check_against_c2000ware(firmware_folder, ware) == ""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("dz_hardware.c", "ETPS.bit.SOCAPRD", "ETPS.bit.SOCPRD"),
        ("dz_hardware.c", "&dz_isr", "&dz_state"),
        ("dz_hardware.c", "PIEACK_GROUP3", "PIEACK_GROUP_3"),
        ("main.c", "    InitFlash();", "    InitFlashMemory();"),
        ("main.c", "&RamfuncsRunStart", "RamfuncsRunStart"),
        ("dz_hardware.c", "codes[0] = AdcMirror.ADCRESULT0;", "codes[0] = AdcMirror.ADCRESULT0 * 1.5f;"),
    ],
)
def test_a_seeded_fault_against_the_headers_is_seen(firmware_folder, ware, file, old, new):
    seed(firmware_folder / "f28335" / file, old, new)
    found = check_against_c2000ware(firmware_folder, ware)
    assert file in found and "error" in found


@pytest.mark.slow
def test_a_file_that_the_project_links_and_c2000ware_lacks_is_named(firmware_folder, ware):
    (ware / "device_support" / "f2833x" / "common" / "source" / "DSP2833x_usDelay.asm").unlink()
    assert "common/source/DSP2833x_usDelay.asm" in check_against_c2000ware(firmware_folder, ware)
