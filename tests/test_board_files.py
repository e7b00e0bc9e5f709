"""The files of a firmware that are its user's to fill in: kept by `codegen`, named and not checked by `verify`."""

import json
import re
import shutil

import pytest
from conftest import default_options
from synthetic import needs_compiler

from dzdesign import api
from dzdesign.cli import main
from dzdesign.codegen.project import generate, targets, write_firmware
from dzdesign.core.artefacts import MANIFEST_NAME, to_json, write_folder
from dzdesign.core.errors import InputError
from dzdesign.design.compensator_file import compensator_document
from dzdesign.design.designing import design
from dzdesign.verify import board_files
from dzdesign.verify.board_files import board_compiles
from dzdesign.verify.checks import files_unchanged
from dzdesign.verify.closed_loop import RampSequence
from dzdesign.verify.firmware_folder import read_firmware_manifest
from dzdesign.verify.report import REPORT_NAME, report_of_folder, with_report
from dzdesign.verify.required import untried_of
from dzdesign.verify.verification import SCHEMA, evidence_files, verify

pytestmark = needs_compiler
BOARD = ["dz_board.c", "dz_tick.h", "main.c", "mps2_an386.ld", "startup.c"]
PROJECT = "f28335/dzdesign.projectspec"
needs_arm = pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="apt install gcc-arm-none-eabi")


@pytest.fixture(scope="module")
def compensator(example_valve):
    return design(example_valve, default_options())


@pytest.fixture
def cortex(compensator, tmp_path):
    write_firmware(generate(compensator, "cortex-m4"), tmp_path / "firmware")
    return tmp_path / "firmware"


def fill_in(folder, name="cortex_m4/dz_board.c", old="return dz_board_u_adc;", new="return 7u;"):
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))


def unchanged(folder):
    return files_unchanged(folder, json.loads((folder / MANIFEST_NAME).read_text()))


def test_they_are_marked_in_their_first_lines_and_in_the_manifest(compensator):
    found = {}
    for target in targets():
        try:
            firmware = generate(compensator, target.name)
        except InputError:  # another converter
            continue
        found[target.name] = firmware.manifest["board"]
        for name, text in firmware.files.items():
            head = " ".join(text.splitlines()[:4])
            assert ("Yours to edit" in head) is (name in target.board) and target.board <= firmware.files.keys()
            assert name == "compensator.json" or ("Do not edit" in head) is (name not in target.board)
    assert found["cortex-m4"] == [f"cortex_m4/{name}" for name in BOARD]
    assert found["f28335"] == [PROJECT] and found["host"] == []


def test_the_readme_marks_the_same_files(cortex):
    readme = (cortex / "cortex_m4/README.md").read_text()
    starred = re.findall(r"`([\w.]+)` \*", readme)
    assert sorted(starred) == BOARD
    assert set(re.findall(r"`([\w.]+)`", readme[readme.index("## Your chip") :])) & set(BOARD) <= set(starred)


def test_nothing_of_a_compensator_stands_in_them(compensator):
    """A file that was kept would say it of the next one."""
    one, other = generate(compensator, "cortex-m4"), generate(compensator, "cortex-m4", b"another spacing")
    for name in one.manifest["board"]:
        assert one.files[name] == other.files[name] and one.files[name].isascii()


# ---- generated again ----


def test_what_was_filled_in_is_kept_and_said(compensator, cortex, tmp_path, capsys):
    fill_in(cortex)
    (cortex / "cortex_m4/main.c").unlink()  # wanted anew
    mine = (cortex / "cortex_m4/dz_board.c").read_bytes()
    path = tmp_path / "compensator.json"
    path.write_text(to_json(compensator_document(compensator)))
    assert main(["codegen", str(path), "--target", "cortex-m4", "-o", str(cortex)]) == 0
    assert "kept as you changed it: cortex_m4/dz_board.c; for what is generated now" in capsys.readouterr().err
    assert (cortex / "cortex_m4/dz_board.c").read_bytes() == mine and (cortex / "cortex_m4/main.c").is_file()
    assert unchanged(cortex).holds and "cortex_m4/dz_board.c" in unchanged(cortex).text  # known as changed again
    (cortex / "cortex_m4/dz_board.c").unlink()
    firmware = api.generate(path, target="cortex-m4", output=cortex)
    assert firmware.note.count("kept") == 0
    assert (cortex / "cortex_m4/dz_board.c").read_text() == firmware.files["cortex_m4/dz_board.c"]


def test_it_is_said_where_another_text_would_be_generated_now(compensator, cortex):
    fill_in(cortex)
    firmware = generate(compensator, "cortex-m4")
    newer = {**firmware.files, "cortex_m4/dz_board.c": firmware.files["cortex_m4/dz_board.c"] + "/* more */\n"}
    kept = write_folder(cortex, newer, firmware.manifest)
    assert kept == {"cortex_m4/dz_board.c": True}


def test_a_notebook_shows_what_was_kept(compensator, cortex):
    fill_in(cortex)
    shown = str(write_firmware(generate(compensator, "cortex-m4"), cortex))
    assert "kept as you changed it: cortex_m4/dz_board.c" in shown


@pytest.mark.parametrize("name", ["cortex_m4/dz_tick.c", "core/dz_drive.c", "cortex_m4/Makefile", "compensator.json"])
def test_any_other_file_that_was_changed_is_not_overwritten(compensator, cortex, name):
    (cortex / name).write_text((cortex / name).read_text() + "\n")
    before = {path: path.read_bytes() for path in cortex.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match=f"{name}' was changed since dzdesign wrote it and would be lost"):
        write_firmware(generate(compensator, "cortex-m4"), cortex)
    assert before == {path: path.read_bytes() for path in cortex.rglob("*") if path.is_file()}


def test_what_was_filled_in_is_not_lost_to_another_target(compensator, cortex):
    fill_in(cortex)
    with pytest.raises(InputError, match=r"dz_board\.c' was changed since dzdesign wrote it and would be lost"):
        write_firmware(generate(compensator, "host"), cortex)
    assert "return 7u;" in (cortex / "cortex_m4/dz_board.c").read_text()


def test_so_does_one_whose_drive_is_not_mounted_and_one_that_nobody_edited_yet(compensator, cortex, tmp_path):
    """A stub in its place would compile, and read no converter."""
    board, mine = cortex / "cortex_m4/dz_board.c", tmp_path / "my_board.c"
    board.rename(mine)
    board.symlink_to(mine)
    kept = write_folder(cortex, *_parts(generate(compensator, "cortex-m4")))
    assert kept == {"cortex_m4/dz_board.c": False} and board.is_symlink()
    mine.rename(tmp_path / "elsewhere.c")
    kept = write_folder(cortex, *_parts(generate(compensator, "cortex-m4")))
    assert kept == {"cortex_m4/dz_board.c": False} and board.is_symlink() and not board.exists()
    core = cortex / "core/dz_comp.c"
    core.rename(tmp_path / "dz_comp.c")
    core.symlink_to(tmp_path / "gone.c")
    with pytest.raises(InputError, match=r"dz_comp\.c' was changed since dzdesign wrote it and would be lost"):
        write_folder(cortex, *_parts(generate(compensator, "cortex-m4")))


def _parts(firmware):
    return firmware.files, firmware.manifest


def test_a_link_in_its_place_stays_a_link(compensator, cortex, tmp_path):
    mine = tmp_path / "my_board.c"
    mine.write_text("/* mine */\n")
    (cortex / "cortex_m4/dz_board.c").unlink()
    (cortex / "cortex_m4/dz_board.c").symlink_to(mine)
    write_firmware(generate(compensator, "cortex-m4"), cortex)
    assert (cortex / "cortex_m4/dz_board.c").is_symlink() and mine.read_text() == "/* mine */\n"


# ---- verified ----


@pytest.mark.parametrize("name", ["cortex_m4/dz_tick.c", "cortex_m4/dz_board.h", "core/dz_comp.c", "compensator.json"])
def test_an_edited_file_that_is_not_the_users_still_fails(cortex, name):
    fill_in(cortex)
    (cortex / name).write_text((cortex / name).read_text() + "\n")
    assert unchanged(cortex).holds is False and f"changed or missing: {name}" in unchanged(cortex).text


@pytest.mark.parametrize(
    "name", ["core/dz_comp.c", "core/dz_drive.h", "compensator.json", "cortex_m4/missing.c", "../other.c", ""]
)
def test_a_manifest_can_not_hand_over_the_core(cortex, name):
    manifest = json.loads((cortex / MANIFEST_NAME).read_text())
    manifest["board"].append(name)
    (cortex / MANIFEST_NAME).write_text(to_json(manifest))
    check = files_unchanged(cortex, read_firmware_manifest(cortex)[1])
    assert check.holds is False and f"calls {name} the user's to fill in" in check.text


def test_a_manifest_whose_board_is_no_list_is_bad_input(cortex):
    manifest = json.loads((cortex / MANIFEST_NAME).read_text())
    (cortex / MANIFEST_NAME).write_text(to_json({**manifest, "board": 3}))
    with pytest.raises(InputError, match="'board' is 3, expected a list"):
        read_firmware_manifest(cortex)


@needs_arm
@pytest.mark.parametrize(
    ("new", "holds"), [("return 7u;", True), ("return seven;", False), ("return 7u;\n}\n#include <my_chip.h>\n{", None)]
)
def test_it_is_compiled_if_that_can_be_done(cortex, new, holds):
    _, manifest = read_firmware_manifest(cortex)
    assert board_compiles(cortex, manifest) == []
    fill_in(cortex, new=new)
    checks = board_compiles(cortex, manifest)
    assert [check.holds for check in checks] == ([] if holds is None else [holds])
    assert holds is not False or ("cortex_m4/dz_board.c" in checks[0].text and "seven" in checks[0].text)


def test_without_the_compiler_nothing_is_said_of_it(cortex, monkeypatch):
    monkeypatch.setitem(board_files.COMPILERS, "cortex-m4", ("no-such-gcc",))
    fill_in(cortex, new="return seven;")
    assert board_compiles(cortex, read_firmware_manifest(cortex)[1]) == []


def test_verify_holds_and_says_that_it_was_not_checked(cortex, tmp_path):
    fill_in(cortex)
    result = verify(cortex, sequence=RampSequence(rest=0.5, ramp=4.0, top=0.5))
    assert result.holds and result.document["yours"] == ["cortex_m4/dz_board.c"]
    said = "cortex_m4/dz_board.c, which is yours and was changed: review it, and try it on the machine"
    assert said in untried_of(result.document)
    assert "NOT TRIED: cortex_m4/dz_board.c, which is yours" in str(result)
    manifest = {"schema": SCHEMA, "made_from": result.document["made_from"]}
    write_folder(tmp_path / "evidence", with_report(evidence_files(result), cortex, tmp_path / "evidence"), manifest)
    html = (tmp_path / "evidence" / REPORT_NAME).read_text(encoding="utf-8")
    assert 'class="verdict good"' in html and "which is yours and was changed" in html
    assert report_of_folder(tmp_path / "evidence").kind == "good"
    fill_in(cortex, "cortex_m4/startup.c", "#include <stdint.h>", "#include <stdint.h> ")  # after the evidence
    report = report_of_folder(tmp_path / "evidence")
    said = "cortex_m4/startup.c: yours, and no longer as generated"
    assert report.kind == "good" and any(said in line for line in report.missing)
    fill_in(cortex, "cortex_m4/dz_tick.c", "drive", "drive ")
    assert report_of_folder(tmp_path / "evidence").kind == "bad"


def test_a_project_file_of_code_composer_studio_is_the_users(compensator, tmp_path):
    write_firmware(generate(compensator, "f28335"), tmp_path)
    fill_in(tmp_path, PROJECT, "C:/ti/c2000", "D:/ti/c2000")
    check = unchanged(tmp_path)
    assert check.holds and check.text.endswith(f"yours, changed, and not checked: {PROJECT}")
