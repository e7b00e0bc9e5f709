"""`dzdesign verify --c2000ware`: against a stand-in of TI's headers, and with what it must see."""

import json
import shutil
from functools import partial

import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import MANIFEST_NAME
from dzdesign.core.errors import InputError
from dzdesign.verify import verification
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.compilation import check_against_c2000ware
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


def count_of_sources(firmware_folder) -> int:
    count = len(list(firmware_folder.rglob("*.c")))
    assert count >= 6, "the core, and five of the hardware"
    return count


@pytest.mark.slow
def test_the_whole_firmware_compiles_against_the_users_headers(firmware_folder, ware):
    check = check_against_c2000ware(firmware_folder, ware)
    assert check.holds, check.text
    assert check.text.startswith(f"compiled {count_of_sources(firmware_folder)} files against {ware}")


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
    check = check_against_c2000ware(firmware_folder, ware)
    assert not check.holds and file in check.text and "error" in check.text


@pytest.mark.slow
def test_a_file_that_the_project_links_and_c2000ware_lacks_is_named(firmware_folder, ware):
    (ware / "device_support" / "f2833x" / "common" / "source" / "DSP2833x_usDelay.asm").unlink()
    check = check_against_c2000ware(firmware_folder, ware)
    assert not check.holds and "common/source/DSP2833x_usDelay.asm" in check.text


@pytest.mark.parametrize("gone", ["headers/include", "common/include"])
def test_a_folder_that_is_no_c2000ware_is_bad_input(firmware_folder, ware, gone, capsys):
    shutil.rmtree(ware / "device_support" / "f2833x" / gone)
    assert main(["verify", str(firmware_folder), "--c2000ware", str(ware), "-o", str(ware / "evidence")]) == 2
    said = capsys.readouterr().err
    assert f"has no folder device_support/f2833x/{gone}" in said and said.count("\n") == 1
    assert not (ware / "evidence").exists()


def test_another_targets_firmware_is_bad_input(firmware_folder, ware, wording):
    manifest = json.loads((firmware_folder / MANIFEST_NAME).read_text())
    (firmware_folder / MANIFEST_NAME).write_text(json.dumps({**manifest, "target": "host"}))
    with wording.refusal(InputError):
        check_against_c2000ware(firmware_folder, ware)


@pytest.mark.slow
@pytest.mark.usefixtures("each_core_once")
def test_the_command_reports_it_with_the_other_evidence(firmware_folder, ware, tmp_path, monkeypatch, capsys):
    seed(ware / "device_support" / "f2833x" / "headers" / "include" / "DSP2833x_Device.h", ") ETPS;", ") OTHER;")
    quick = partial(verification.Asked, sequence=RampSequence(rest=0.5, ramp=4.0, top=0.5))
    monkeypatch.setattr(verification, "Asked", quick)
    evidence = tmp_path / "evidence"
    assert main(["verify", str(firmware_folder), "--c2000ware", str(ware), "-o", str(evidence)]) == 1
    assert "DOES NOT HOLD  compiles against C2000Ware: dz_hardware.c" in capsys.readouterr().out
    document = json.loads((evidence / "verification.json").read_text())
    assert not document["holds"] and document["checks"][-1]["name"] == "compiles against C2000Ware"
