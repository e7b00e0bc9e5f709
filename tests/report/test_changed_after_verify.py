"""A firmware folder that is no longer what was verified: the report says so, names the file, and no verdict stands."""

import pytest

from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of
from dzdesign.core.artefact_types import THIS_TOOL, SourceFile, to_json_bytes
from dzdesign.core.folder_contents import digest_of
from dzdesign.design.firmware_manifest import FirmwareManifest, FirmwareOrigin
from dzdesign.report import artefact_folder
from dzdesign.report.artefact_chain import chain_of
from dzdesign.report.artefact_folder import read_artefact_folder
from dzdesign.report.summary import headline
from dzdesign.verify.firmware.folder import read_firmware_manifest
from dzdesign.verify.firmware.reproduced import changed_board_files, user_files
from tests.support.attacked_firmware import add, edit
from tests.support.evidence import evidence_with

FILES = {"core/dz_comp.c": "int dz_comp;\n", "f28335/dzdesign.projectspec": "<as-generated/>\n", "f28335/main.c": ";\n"}
NOT_HERE = "0" * 64
PROJECT, OWN = "f28335/dzdesign.projectspec", "board/adc.c"


def put_evidence(root, **changes):
    """Write what `verify` would of a firmware whose requirements all hold."""
    content = (root / "firmware" / MANIFEST_NAME).read_bytes()
    folder, manifest = root / "firmware", read_firmware_manifest(root / "firmware")
    names = (*changed_board_files(folder, manifest), *user_files(folder, manifest.files))
    found = {name: digest_of(folder / name) for name in names}
    made_from = (SourceFile(source=f"firmware/{MANIFEST_NAME}", sha256=sha256_of(content)),)
    evidence = evidence_with(**{"made_from": made_from, "differing_files": found, **changes})
    add(root, "evidence/verification.json", to_json_bytes(evidence).decode())


@pytest.fixture
def verified(tmp_path):
    """A firmware whose user set the project's folder and added a file, verified so; without its compensator."""
    for name, text in FILES.items():
        add(tmp_path / "firmware", name, text)
    listed = {name: sha256_of(text.encode()) for name, text in FILES.items()}
    manifest = FirmwareManifest(
        tool=THIS_TOOL, made_from=(SourceFile(source="compensator.json", sha256=NOT_HERE),),
        target="f28335", law="paper", calibration="fixed", vectors=0, core=("core/dz_comp.c",), board=(PROJECT,),
        origin=FirmwareOrigin(compensator_json=NOT_HERE, valve_json=NOT_HERE, ramp_tests=()),
        constants=(), files=listed,
    )  # fmt: skip
    add(tmp_path / "firmware", MANIFEST_NAME, to_json_bytes(manifest).decode())
    add(tmp_path / "firmware", PROJECT, "<mine/>\n")
    add(tmp_path / "firmware", OWN, "int adc;\n")
    put_evidence(tmp_path)
    return tmp_path


def faults_of(root):
    chain = chain_of(read_artefact_folder(root))
    assert (headline(chain).text == "THE FILES DO NOT BELONG TOGETHER. No verdict stands.") == bool(chain.faults)
    return chain.faults


def test_the_files_that_were_verified_fit_changed_before_or_not(verified):
    assert faults_of(verified) == faults_of(verified / "firmware") == faults_of(verified / "evidence") == ()
    assert not [line for line in chain_of(read_artefact_folder(verified)).missing if "projectspec" in line]


CHANGES = {
    "the project file": (lambda f: edit(f, PROJECT, "mine", "another"), f"{PROJECT} was changed"),
    "back to what was generated": (lambda f: add(f, PROJECT, FILES[PROJECT]), f"{PROJECT} was changed"),
    "the project file gone": (lambda f: (f / PROJECT).unlink(), f"{PROJECT} is gone"),
    "a file of the user's": (lambda f: edit(f, OWN, "int", "long"), f"{OWN} was changed"),
    "a file of the user's gone": (lambda f: (f / OWN).unlink(), f"{OWN} is gone"),
    "one more of the user's": (lambda f: add(f, "board/more.c"), "board/more.c was added"),
    "a header that hides one": (lambda f: add(f, "f28335/dz_comp.h"), "f28335/dz_comp.h was added"),
    "source in the core": (lambda f: add(f, "core/more.c"), "core/more.c was added"),
    "another build": (lambda f: add(f, "Makefile"), "Makefile was added"),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_was_changed_since_is_named_and_no_verdict_stands(verified, change):
    do, named = CHANGES[change]
    do(verified / "firmware")
    (fault,) = faults_of(verified)
    assert fault.startswith("this folder is not what was verified: firmware/") and named in fault
    assert fault.endswith("run `dzdesign verify` on it again")


def test_of_any_number_and_size_of_files_none_is_taken_as_gone(verified, monkeypatch):
    monkeypatch.setattr(artefact_folder, "LARGEST", 2**12)
    add(verified / "firmware", "board/tables.c", "/**/" * 2**12)
    for number in range(artefact_folder.MOST):
        add(verified / "firmware", f"board/more_{number}.h")
    put_evidence(verified)
    assert not [fault for fault in faults_of(verified) if "is gone" in fault]


def test_generated_c_that_was_changed_is_named_as_ever(verified):
    edit(verified / "firmware", "f28335/main.c", ";", ";;")
    (fault,) = faults_of(verified)
    assert "f28335/main.c was changed since it was generated" in fault


def test_evidence_of_another_target_does_not_fit(verified):
    put_evidence(verified, target="host")
    (fault,) = faults_of(verified)
    assert "for host" in fault and "for f28335" in fault


def test_a_verdict_on_a_firmware_that_is_not_here_says_so(verified):
    assert "not here" not in headline(chain_of(read_artefact_folder(verified))).text
    away = verified / "away"
    away.mkdir()
    (verified / "evidence").rename(away / "evidence")
    shown = headline(chain_of(read_artefact_folder(away)))
    assert shown.kind == "good" and "the firmware that was verified is not here" in shown.text
