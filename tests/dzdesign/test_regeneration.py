"""A firmware whose own hashes all fit, and which is not what `codegen` makes of its compensator.json."""

from functools import partial

import pytest

from dzdesign import api
from dzdesign.codegen.project import generate, write_firmware
from dzdesign.command_line.cli import main
from dzdesign.regeneration import regenerated
from dzdesign.verify import verification
from dzdesign.verify.closed_loop.loop import RampSequence
from dzdesign.verify.requirements import REGENERATED
from tests.support.attacked_firmware import edit, seal
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
PROJECT = "f28335/dzdesign.projectspec"
QUICK = RampSequence(rest=0.5, ramp=4.0, top=0.5)


def test_what_codegen_wrote_is_what_it_writes(example_compensator, firmware_folder, tmp_path):
    assert regenerated(firmware_folder).holds
    for target in ("cortex-m4", "host"):
        write_firmware(generate(example_compensator, target), tmp_path / target)
        assert regenerated(tmp_path / target).holds


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


def always_60000(folder):
    """Let the interrupt write another compare value than the law's, as nothing on the host sees."""
    edit(folder, "f28335/dz_isr.c", "CMPA.half.CMPA = compare;", "CMPA.half.CMPA = 60000u;")


def rename_target(manifest, folder):
    """Call the target something unknown, folder and all."""
    (folder / "f28335").rename(folder / "mychip")
    for key in ("files", "board"):
        renamed = [name.replace("f28335/", "mychip/") for name in manifest[key]]
        manifest[key] = dict(zip(renamed, manifest[key].values(), strict=True)) if key == "files" else renamed
    manifest["target"] = "mychip"


#: What takes a firmware out of reach of this version's generator, and what the message names.
UNKNOWN_ORIGINS = {
    "another version": (lambda manifest, _: manifest["tool"].update(version="0.0.9"), "dzdesign 0.0.9"),
    "another name": (lambda manifest, _: manifest["tool"].update(name="mydesign"), "mydesign"),
    "another target": (rename_target, "mychip"),
}


@pytest.mark.parametrize(
    ("key", "change"),
    [
        ("tool", lambda manifest: manifest.pop("tool")),
        ("tool.version", lambda manifest: manifest["tool"].pop("version")),
        ("tool", lambda manifest: manifest.update(tool=["dzdesign", 1])),
        ("target", lambda manifest: manifest.pop("target")),
    ],
)
def test_a_manifest_that_does_not_name_its_origin_is_refused(firmware_folder, tmp_path, capsys, key, change):
    seal(firmware_folder, change)
    assert main(["verify", str(firmware_folder), "-o", str(tmp_path / "evidence")]) == 2
    assert f"'{key}'" in capsys.readouterr().err and not (tmp_path / "evidence").exists()


@pytest.mark.parametrize("origin", UNKNOWN_ORIGINS)
def test_what_this_version_can_not_generate_again_is_not_checked(firmware_folder, origin):
    change, named = UNKNOWN_ORIGINS[origin]
    seal(firmware_folder, lambda manifest: change(manifest, firmware_folder))
    check = regenerated(firmware_folder)
    assert check.id == REGENERATED.id and check.holds is None
    assert named in check.text and "`dzdesign codegen`" in check.text and len(check.text) < 300


def test_a_version_of_any_length_and_any_characters_fits_a_message(firmware_folder):
    seal(firmware_folder, lambda manifest: manifest["tool"].update(version="9" * 10_000 + "\x1b[2J\n"))
    text = regenerated(firmware_folder).text
    assert len(text) < 300 and text.isprintable()


@pytest.mark.slow
@pytest.mark.usefixtures("each_core_once")
def test_of_another_version_all_else_holds_and_the_function_says_so(firmware_folder, tmp_path, monkeypatch):
    monkeypatch.setattr(verification, "verify", partial(verification.verify, sequence=QUICK))
    always_60000(firmware_folder)
    seal(firmware_folder, lambda manifest: manifest["tool"].update(version="0.0.9"))
    result = api.verify(firmware_folder, output=tmp_path / "evidence")
    assert result.holds is False and result.verdict == f"NOT CHECKED: {REGENERATED.title}"
    html = (tmp_path / "evidence/report.html").read_text(encoding="utf-8")
    assert 'class="verdict open"' in html and "dzdesign 0.0.9" in html


@pytest.mark.slow
@pytest.mark.usefixtures("each_core_once")
def test_the_command_and_the_function_say_so(firmware_folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(verification, "verify", partial(verification.verify, sequence=QUICK))
    edit(firmware_folder, "f28335/dz_isr.c", "{", "{ /* another */")
    seal(firmware_folder)
    assert main(["verify", str(firmware_folder), "-o", str(tmp_path / "evidence")]) == 1
    out = capsys.readouterr().out
    assert f"DOES NOT HOLD  {REGENERATED.title}: otherwise than generated now: f28335/dz_isr.c" in out
    assert out.splitlines()[-2] == f"DOES NOT HOLD: {REGENERATED.title}"  # every other check passes it
    html = (tmp_path / "evidence/report.html").read_text(encoding="utf-8")
    assert 'class="verdict bad"' in html and "DOES NOT HOLD: 1 of" in html
    assert api.verify(firmware_folder).holds is False
