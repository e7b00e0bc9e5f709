"""The manifest against the firmware: the law, the target or a hash that is another is named."""

import json

import pytest

from dzdesign.codegen.project import generate, targets
from dzdesign.core.artefact_files import to_json, write_folder
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.errors import InputError
from dzdesign.design.firmware_manifest import FirmwareManifest
from dzdesign.verify.firmware.folder import read_compensator
from dzdesign.verify.firmware.manifest import manifest_follows
from dzdesign.verify.verification import verify
from tests.support.golden_firmware import FULL, FULL_TARGETS, GOLDENS, golden_compensator
from tests.support.synthetic import needs_compiler


def manifest_of(folder):
    return json.loads((folder / "manifest.json").read_text())


def follows(folder, manifest):
    """The check of a folder under another manifest."""
    manifest = read_artefact(to_json(manifest).encode(), FirmwareManifest, "manifest.json")
    return manifest_follows(folder, manifest, read_compensator(folder))


@pytest.mark.parametrize(
    ("root", "target"), [*((GOLDENS, one.name) for one in targets()), *((FULL, name) for name in FULL_TARGETS)]
)
def test_the_manifest_of_every_target_follows(root, target, tmp_path, wording):
    firmware = generate(golden_compensator(target, root), target)
    write_folder(tmp_path / "firmware", firmware.files, firmware.manifest)
    check = follows(tmp_path / "firmware", manifest_of(tmp_path / "firmware"))
    assert check.holds, check.text
    wording.of_test(check.text)


def change(manifest, path, value):
    holder = manifest
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = value


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("law",), "target"),
        (("target",), "cortex-m4"),
        (("target",), "core"),
        (("origin", "compensator_json"), "0" * 64),
        (("origin", "valve_json"), "0" * 64),
        (("origin", "ramp_tests"), []),
        (("made_from",), []),
    ],
)
def test_what_else_is_wrong_is_named(firmware_folder, path, value, wording):
    manifest = manifest_of(firmware_folder)
    change(manifest, path, value)
    check = follows(firmware_folder, manifest)
    assert check.holds is False
    wording.of_test(check.text)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("constants",), None), (("constants",), [{}]), (("origin",), []), (("tool",), None), (("target",), 3),
        (("constants", 0, "value"), True), (("constants", 0, "value"), "64"), (("board",), "f28335/main.c"),
    ],
)  # fmt: skip
def test_a_manifest_of_another_shape_is_refused(firmware_folder, path, value, wording):
    manifest = manifest_of(firmware_folder)
    change(manifest, path, value)
    with wording.refusal(InputError):
        follows(firmware_folder, manifest)
    del manifest[path[0]]
    with wording.refusal(InputError):
        follows(firmware_folder, manifest)


def test_c_of_another_compensator_is_named(firmware_folder):
    path = firmware_folder / "core" / "dz_drive.h"
    path.write_text(path.read_text().replace("Compensator SHA-256: ", "Compensator SHA-256: 0"))
    said = follows(firmware_folder, manifest_of(firmware_folder)).text
    assert "core/dz_drive.h does not name this compensator.json in its first lines" in said


@pytest.mark.slow
@needs_compiler
@pytest.mark.usefixtures("each_core_once")
def test_verify_says_so(firmware_folder):
    manifest = manifest_of(firmware_folder)
    change(manifest, ("law",), "target")
    (firmware_folder / "manifest.json").write_text(json.dumps(manifest))
    found = verify(firmware_folder)
    missed = [check.name for check in found.evidence.checks if not check.holds]
    assert missed == ["the manifest describes the firmware"]
