"""A firmware whose own hashes all fit, and which is not what `codegen` makes of its compensator.json."""

import json
from functools import partial

import pytest

from dzdesign import api
from dzdesign.codegen.project import generate, write_firmware
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import MANIFEST_NAME, sha256_of, to_json
from dzdesign.regeneration import regenerated
from dzdesign.verify import verification
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.requirements import REGENERATED, untried_of
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
PROJECT = "f28335/dzdesign.projectspec"


def seal(folder, change=lambda manifest: None):
    """Make the manifest's hashes those of the files as they are."""
    path = folder / MANIFEST_NAME
    manifest = json.loads(path.read_text())
    change(manifest)
    manifest["files"] = {
        name: digest if name in manifest["board"] else sha256_of((folder / name).read_bytes())
        for name, digest in manifest["files"].items()
    }
    path.write_text(to_json(manifest))


def test_what_codegen_wrote_is_what_it_writes(example_compensator, firmware_folder, tmp_path):
    assert regenerated(firmware_folder).holds
    for target in ("cortex-m4", "host"):
        write_firmware(generate(example_compensator, target), tmp_path / target)
        assert regenerated(tmp_path / target).holds


def edit(folder, name, old, new):
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("f28335/dz_isr.c", "{", "{ /* another */"),
        ("core/dz_comp.c", "#include", "#ifdef __TMS320C28XX__\n#define other 1\n#endif\n#include"),
        ("core/dz_drive.h", "#endif", "#define dz_drive_tick(drive) another(drive)\n#endif"),
        ("f28335/README.md", "4.7 kOhm", "47 kOhm"),
        ("f28335/Makefile", "-O2", "-O2 -DOTHER"),
    ],
)
def test_a_file_edited_together_with_its_hash_is_found(firmware_folder, name, old, new):
    edit(firmware_folder, name, old, new)
    seal(firmware_folder)
    check = regenerated(firmware_folder)
    assert check.holds is False and check.text.startswith(f"otherwise than generated now: {name}, files of manifest")


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("constants", lambda manifest: manifest["constants"][0].update(engineering="u_min0 = 9 V")),
        ("board", lambda manifest: manifest["board"].append("f28335/dz_isr.c")),
        ("files", lambda manifest: manifest["files"].update({PROJECT: "0" * 64})),
        ("files", lambda manifest: manifest["files"].pop("f28335/dz_isr.c")),
        ("core", lambda manifest: manifest["core"].pop()),
    ],
)
def test_a_manifest_that_says_something_else_is_found(firmware_folder, key, change):
    seal(firmware_folder, change)
    check = regenerated(firmware_folder)
    assert check.holds is False and f"{key} of manifest.json" in check.text


def test_what_is_the_users_to_fill_in_may_be_anything(firmware_folder):
    edit(firmware_folder, PROJECT, "C:/ti", "D:/ti")
    assert regenerated(firmware_folder).holds


@pytest.mark.parametrize("change", [{"tool": {"name": "dzdesign", "version": "0.0.9"}}, {"target": "mychip"}])
def test_of_another_version_or_target_nobody_can_tell(firmware_folder, change):
    seal(firmware_folder, lambda manifest: manifest.update(change))
    assert regenerated(firmware_folder) is None
    evidence = {"checks": [], "closed_loop": {}, "monte_carlo": None}
    (said,) = [line for line in untried_of(evidence) if line.startswith(REGENERATED)]
    assert "with the version of dzdesign that generated it" in said


def test_the_command_and_the_function_say_so(firmware_folder, tmp_path, monkeypatch, capsys):
    quick = partial(verification.verify, sequence=RampSequence(rest=0.5, ramp=4.0, top=0.5))
    monkeypatch.setattr(verification, "verify", quick)
    edit(firmware_folder, "f28335/dz_isr.c", "{", "{ /* another */")
    seal(firmware_folder)
    assert main(["verify", str(firmware_folder), "-o", str(tmp_path / "evidence")]) == 1
    out = capsys.readouterr().out
    assert f"FAILS  {REGENERATED}: otherwise than generated now: f28335/dz_isr.c" in out
    assert out.splitlines()[-2] == f"DOES NOT HOLD: {REGENERATED}"  # every other check passes it
    html = (tmp_path / "evidence/report.html").read_text(encoding="utf-8")
    assert 'class="verdict bad"' in html and "DOES NOT HOLD: 1 of" in html
    assert api.verify(firmware_folder).holds is False
