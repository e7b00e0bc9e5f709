"""The files of a firmware that are its user's to fill in: kept by `codegen`, named and not checked by `verify`."""

import re
import shutil
import subprocess

import pytest

from dzdesign import api
from dzdesign.codegen.project import generate, targets
from dzdesign.codegen.writing import write_generated
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import write_folder
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from dzdesign.design.designing import design
from dzdesign.regeneration import regenerated
from dzdesign.verify import compilation
from dzdesign.verify.compilation import BoardCompiled, board_compiles
from dzdesign.verify.folder import changed_board_files, read_firmware_manifest, reproduced, user_files
from dzdesign.verify.verification import not_tried
from tests.conftest import default_options
from tests.support.attacked_firmware import add
from tests.support.evidence import evidence_with
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
BOARD = ["dz_board.c", "dz_board.h", "main.c", "mps2_an386.ld", "startup.c"]
PROJECT = "f28335/dzdesign.projectspec"
needs_arm = pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="apt install gcc-arm-none-eabi")


@pytest.fixture(scope="module")
def compensator(example_valve):
    return design(example_valve, default_options())


@pytest.fixture
def cortex(compensator, tmp_path):
    write_generated(generate(compensator, "cortex-m4"), tmp_path / "firmware")
    return tmp_path / "firmware"


def fill_in(folder, name="cortex_m4/dz_board.c", old="codes[0] = dz_board_u_adc;", new="codes[0] = 7u;"):
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))


def unchanged(folder):
    return reproduced(folder, regenerated(folder))


def test_they_are_marked_in_their_first_lines_and_in_the_manifest(compensator):
    found = {}
    for target in targets():
        try:
            firmware = generate(compensator, target.name)
        except InputError:  # another converter
            continue
        found[target.name] = firmware.manifest.board
        for name, text in firmware.files.items():
            head = " ".join(text.splitlines()[:4])
            assert ("Yours to edit" in head) is (name in target.board) and target.board <= firmware.files.keys()
            bare = ("compensator.json", ".gitattributes")
            assert name in bare or ("Do not edit" in head) is (name not in target.board)
            assert name in bare or not re.search(r"20\d\d-\d\d-\d\d", text), "no date"
    assert found["cortex-m4"] == tuple(f"cortex_m4/{name}" for name in BOARD)
    assert found["f28335"] == ("board/dz_user.c", "f28335/dz_board.h", PROJECT) and found["host"] == ()


def test_the_readme_marks_the_same_files(cortex):
    readme = (cortex / "cortex_m4/README.md").read_text()
    starred = re.findall(r"`([\w.]+)` \*", readme)
    assert sorted(starred) == BOARD
    named = set(re.findall(r"`([\w.]+)`", readme[readme.index("## Your chip") :])) & set(BOARD)
    assert named and named <= set(starred)


def test_nothing_of_a_compensator_stands_in_them(compensator):
    """A file that was kept would say it of the next one."""
    one, other = generate(compensator, "cortex-m4"), generate(compensator, "cortex-m4", b"another spacing")
    for name in one.manifest.board:
        assert one.files[name] == other.files[name] and one.files[name].isascii()


# ---- generated again ----


@pytest.mark.slow
def test_what_was_filled_in_is_kept_and_said(compensator, cortex, tmp_path, capsys, wording):
    fill_in(cortex)
    (cortex / "cortex_m4/main.c").unlink()  # wanted anew
    mine = (cortex / "cortex_m4/dz_board.c").read_bytes()
    path = tmp_path / "compensator.json"
    path.write_bytes(to_json_bytes(compensator))
    assert main(["codegen", str(path), "--target", "cortex-m4", "-o", str(cortex)]) == 0
    wording.of_test(capsys.readouterr().err)
    assert (cortex / "cortex_m4/dz_board.c").read_bytes() == mine and (cortex / "cortex_m4/main.c").is_file()
    assert unchanged(cortex).holds
    wording.of_test(unchanged(cortex).text)
    manifest = read_firmware_manifest(cortex)
    assert changed_board_files(cortex, manifest) == ("cortex_m4/dz_board.c",)  # known as changed again
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


def test_what_was_filled_in_is_not_lost_to_another_target(compensator, cortex, wording):
    fill_in(cortex)
    with wording.refusal(InputError):
        write_generated(generate(compensator, "host"), cortex)
    assert "codes[0] = 7u;" in (cortex / "cortex_m4/dz_board.c").read_text()


def test_so_does_one_whose_drive_is_not_mounted_and_one_that_nobody_edited_yet(compensator, cortex, tmp_path, wording):
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
    with wording.refusal(InputError):
        write_folder(cortex, *_parts(generate(compensator, "cortex-m4")))


def _parts(firmware):
    return firmware.files, firmware.manifest


def test_a_link_in_its_place_stays_a_link(compensator, cortex, tmp_path):
    mine = tmp_path / "my_board.c"
    mine.write_text("/* mine */\n")
    (cortex / "cortex_m4/dz_board.c").unlink()
    (cortex / "cortex_m4/dz_board.c").symlink_to(mine)
    write_generated(generate(compensator, "cortex-m4"), cortex)
    assert (cortex / "cortex_m4/dz_board.c").is_symlink() and mine.read_text() == "/* mine */\n"


# ---- verified ----


@needs_arm
@pytest.mark.parametrize(
    ("new", "holds"), [("return 7u;", True), ("return seven;", False), ("return 7u;\n}\n#include <my_chip.h>\n{", None)]
)
def test_it_is_compiled_if_that_can_be_done(cortex, new, holds):
    manifest = read_firmware_manifest(cortex)
    assert board_compiles(cortex, manifest) == BoardCompiled()
    fill_in(cortex, new=new)
    found = board_compiles(cortex, manifest)
    checks = found.checks
    assert bool(found.not_compiled) is (holds is None)
    assert [check.holds for check in checks] == ([] if holds is None else [holds])
    assert holds is not False or ("cortex_m4/dz_board.c" in checks[0].text and "seven" in checks[0].text)


def test_without_the_compiler_it_is_said_why(cortex, monkeypatch):
    monkeypatch.setitem(compilation.COMPILERS, "cortex-m4", ("no-such-gcc",))
    fill_in(cortex, new="return seven;")
    found = board_compiles(cortex, read_firmware_manifest(cortex))
    assert found == BoardCompiled(not_compiled="no-such-gcc is not on the path; install it, then `verify`")


@needs_arm
def test_a_vendors_header_is_named_and_found_by_an_option(cortex, tmp_path, wording):
    fill_in(cortex, old="#include", new='#include "stm32_chip.h"\n#include')
    manifest = read_firmware_manifest(cortex)
    missing = "stm32_chip.h, which cortex_m4/dz_board.c includes, was not found in the firmware; `verify --include DIR`"
    assert missing in board_compiles(cortex, manifest).not_compiled
    headers = [tmp_path / "device", tmp_path / "cmsis"]
    add(headers[0], "stm32_chip.h", '#include "core_cm4.h"\n')
    add(headers[1], "core_cm4.h", "int narrow(long x);\n")
    found = board_compiles(cortex, manifest, headers[:1])
    missing = "core_cm4.h, which cortex_m4/dz_board.c includes, was not found in the firmware nor in"
    assert found.checks == () and f"{missing} {headers[0]}" in found.not_compiled
    add(cortex, "board/adc.c", "int adc(void);\nint adc(void) { return 1; }\n")
    (check,) = board_compiles(cortex, manifest, headers).checks
    assert check.holds
    wording.of_test(check.text)
    add(cortex, "board/adc.c", "#error broken\n")
    (check,) = board_compiles(cortex, manifest, headers).checks
    assert check.holds is False
    wording.of_test(check.text)


def test_include_of_what_is_no_folder_or_not_compiled_here_is_refused(compensator, cortex, tmp_path, wording):
    with wording.refusal(InputError):
        api.verify(cortex, include=[tmp_path / "nowhere"])
    write_generated(generate(compensator, "f28335"), tmp_path / "other")
    with wording.refusal(InputError):
        api.verify(tmp_path / "other", include=[tmp_path])


# ---- files of the user's own beside them ----


def test_files_in_the_folder_for_them_are_named_kept_and_not_checked(compensator, cortex, wording):
    add(cortex, "board/adc.c", "this is no C")
    add(cortex, "board/my_chip.ld", "/* mine */")
    check = unchanged(cortex)
    assert check.holds
    wording.of_test(check.text)
    found = user_files(cortex, read_firmware_manifest(cortex).files)
    assert sorted(found) == ["board/adc.c", "board/my_chip.ld"]
    write_generated(generate(compensator, "cortex-m4"), cortex)
    assert (cortex / "board/adc.c").read_text() == "this is no C"
    said = not_tried(evidence_with(user_files=("board/adc.c",), changed_board_files=("cortex_m4/dz_board.c",)))
    assert "board/adc.c, which is yours: review it, and try it on the machine" in said
    assert "cortex_m4/dz_board.c, which is yours and was changed: review it, and try it on the machine" in said


@pytest.mark.slow
@needs_arm
def test_make_takes_renamed_copies_of_board_files_and_finds_what_lies_in_board(cortex):
    place, own = cortex / "cortex_m4", cortex / "board"
    own.mkdir()
    script, board = (place / "mps2_an386.ld").read_text(), (place / "dz_board.c").read_text()
    (own / "my_chip.ld").write_text(script.replace("LENGTH = 4M", "LENGTH = 2M"))
    (own / "my_board.c").write_text('#include "my_adc.h"\n' + board)
    (own / "my_adc.h").write_text("uint16_t my_adc(void);\n".replace("uint16_t", "unsigned short"))
    (own / "my_adc.c").write_text('#include "my_adc.h"\nunsigned short my_adc(void)\n{\n    return 7u;\n}\n')
    own_files = ["LDSCRIPT=../board/my_chip.ld", "DZ_BOARD=../board/my_board.c"]
    done = subprocess.run(["make", "-C", place, *own_files], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "-T ../board/my_chip.ld" in done.stdout and done.stdout.count("my_board.c") == 1
    assert "../board/my_adc.c" in done.stdout and " dz_board.c" not in done.stdout
    named = subprocess.run(
        ["make", "-B", "-C", place, *own_files, "BOARD=../board/my_adc.c"], capture_output=True, text=True, check=False
    )
    assert named.returncode == 0, named.stderr
    assert unchanged(cortex).holds
