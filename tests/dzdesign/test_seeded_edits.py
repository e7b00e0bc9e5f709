"""A folder that is no longer what `codegen` made, by accident: `verify` ends with 1 or 2 and names the place."""

import json
import shutil

import pytest

from dzdesign.codegen.other_targets import generate_output, settings_of
from dzdesign.codegen.project import generate
from dzdesign.codegen.writing import write_generated
from dzdesign.command_line.cli import main
from dzdesign.core.errors import RequirementError
from dzdesign.regeneration import generated_code, regenerated
from dzdesign.verify.folder import reproduced
from dzdesign.verify.outputs.verification import Given
from tests.support.attacked_firmware import add, change_json, edit, take_the_rest_as_held
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler
PROJECT = "f28335/dzdesign.projectspec"


@pytest.fixture(scope="module")
def folder_of(example_compensator, tmp_path_factory):
    """The example's folder of each target, made once, to be copied."""
    root = tmp_path_factory.mktemp("seeded")
    for target in ("f28335", "cortex-m4", "host"):
        write_generated(generate(example_compensator, target, vectors=700 if target == "host" else 0), root / target)
    write_generated(generate(example_compensator, "host", "block"), root / "block")
    for target in ("iec61131", "matlab"):
        write_generated(generate_output(example_compensator, target, settings_of(target, {})), root / target)
    return root


@pytest.fixture
def verify(folder_of, tmp_path, monkeypatch, capsys):
    """Copy a target's folder, edit it, verify it; returns exit status and all that was printed of what is amiss."""
    take_the_rest_as_held(monkeypatch)

    def run(target, change=lambda folder: None, *options):
        folder = tmp_path / target
        shutil.copytree(folder_of / target, folder)
        change(folder)
        status = main(["-v", "verify", str(folder), "-o", str(tmp_path / "evidence"), *options])
        out, err = capsys.readouterr()
        return status, "\n".join(line for line in (out + err).splitlines() if not line.startswith("HOLDS"))

    return run


def less_beta(compensator):
    beta = compensator["sides"]["positive"]["beta"]
    compensator["sides"]["positive"]["beta"] = [max(value - 100, 1) for value in beta]


def lower_threshold(compensator):
    compensator["valve"]["sides"]["positive"]["tests"][0]["u_knee_falling_V"] -= 0.01


def in_json(name, change):
    return lambda folder: change_json(folder / name, change)


def cut_short(name):
    """As a full disk or a power cut leaves a file."""
    return lambda folder: (folder / name).write_bytes((folder / name).read_bytes()[:2000])


def one_octet(name):
    def change(folder):
        content = bytearray((folder / name).read_bytes())
        content[40] ^= 1
        (folder / name).write_bytes(content)

    return change


def twice(folder):
    """Merge two versions of a file, both lines of a key kept."""
    text = (folder / "compensator.json").read_text(encoding="utf-8")
    add(folder, "compensator.json", text.replace("{", f'{{\n "law": {json.dumps("target")},', 1))


def in_c(name, old, new):
    return lambda folder: edit(folder, name, old, new)


#: Target, edit, exit status, and what is printed of it.
SEEDED = {
    "a number": ("f28335", in_c("core/dz_valve.h", "UINT32_C(", "1u + UINT32_C("), 1, "core/dz_valve.h, line"),
    "half a file": ("host", cut_short("core/dz_comp.c"), 1, "core/dz_comp.c, line"),
    "no file": ("cortex-m4", lambda folder: (folder / "core/dz_comp.h").unlink(), 1, "core/dz_comp.h is missing"),
    "a file more in the core": ("cortex-m4", lambda f: add(f, "core/dz_old.c", "int x;\n"), 1, "core/dz_old.c"),
    "swapped channels": ("f28335", in_c("f28335/dz_hardware.c", "CONV02 = DZ_", "CONV01 = DZ_"), 1, "dz_hardware.c"),
    "an option of the compiler": ("f28335", in_c("f28335/Makefile", "-O2", "-O3"), 1, "f28335/Makefile, line"),
    "a copy of ours in board": ("cortex-m4", lambda f: add(f, "board/DZ_DRIVE.H"), 1, "board/DZ_DRIVE.H"),
    "an octet of the block": ("block", one_octet("calibration.bin"), 1, "calibration.bin differs from octet 40 on"),
    "a coefficient": ("f28335", in_json("compensator.json", less_beta), 1, "follows from its valve"),
    "a threshold": ("f28335", in_json("compensator.json", lower_threshold), 2, "'valve.content_sha256' is"),
    "a key twice": ("f28335", twice, 2, "'law' is there twice"),
    "another version's": (
        "f28335", in_json("manifest.json", lambda m: m["tool"].update(version="0.0.9")), 1, "dzdesign 0.0.9",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", SEEDED)
def test_an_accidental_edit_is_named_and_nothing_of_it_is_run(verify, fault):
    target, change, expected, named = SEEDED[fault]
    status, said = verify(target, change)
    assert status == expected and named in said, said


def test_a_file_that_is_missing_is_reported_too(folder_of, tmp_path, capsys):
    """The report is of a folder as it was verified: without that file."""
    shutil.copytree(folder_of / "host", tmp_path / "host")
    (tmp_path / "host" / "core" / "dz_drive.c").unlink()
    assert main(["verify", str(tmp_path / "host"), "-o", str(tmp_path / "evidence")]) == 1
    assert "core/dz_drive.c is missing" in capsys.readouterr().out
    assert (tmp_path / "evidence" / "report.html").is_file()


#: Of an output other than a C firmware, and what the verdict names.
OUTPUTS = {
    "a digit of the text": ("iec61131", lambda f: edit(f, "FB_DeadZone.st", "1", "2"), "FB_DeadZone.st, line"),
    "a text more": ("iec61131", lambda f: add(f, "FB_Old.st"), "FB_Old.st"),
    "a function": ("matlab", lambda f: edit(f, "dz_comp.m", "\n", "\n\n"), "dz_comp.m, line"),
    "its settings": (
        "iec61131", in_json("manifest.json", lambda m: m["settings"].update(dialect="twincat")), "FB_DeadZone",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", OUTPUTS)
def test_an_edit_of_another_output_is_named(verify, fault, monkeypatch):
    monkeypatch.setattr(Given, "run_by", lambda *_: pytest.fail("it was tried"))
    target, change, named = OUTPUTS[fault]
    status, said = verify(target, change)
    assert status == 1 and named in said, said


def test_an_edited_valve_json_is_named_when_it_is_read(example_valve, tmp_path, capsys):
    from dzdesign.core.artefact_types import to_json_bytes

    path = tmp_path / "valve.json"
    path.write_bytes(to_json_bytes(example_valve))
    assert main(["design", str(path), "-o", str(tmp_path / "compensator.json")]) == 0
    change_json(path, lambda valve: valve["sides"]["positive"]["tests"][0].update(u_knee_falling_V=5.0))
    assert main(["design", str(path), "-o", str(tmp_path / "compensator.json")]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "'content_sha256' is" in said and "dzdesign identify" in said


#: Target, what its user fills in there, and whose names the verdict lists as not checked.
FILLED_IN = {
    "f28335": {PROJECT: ("C:/ti/c2000/C2000Ware_26_01_00_00", "D:/ti/C2000Ware_5_04")},
    "cortex-m4": {
        "cortex_m4/dz_board.h": ("UINT32_C(9999)", "6399u"),
        "cortex_m4/mps2_an386.ld": ("LENGTH = 4M", "LENGTH = 512K"),
    },
    "host": {},
    "block": {},
}


@pytest.mark.parametrize("target", FILLED_IN)
@pytest.mark.parametrize("filled_in", [False, True])
def test_the_untouched_firmware_holds_and_what_is_the_users_is_listed(verify, target, filled_in):
    theirs = [*FILLED_IN[target], "board/my.c"] if filled_in else []

    def fill_in(folder):
        for name in theirs[:-1]:
            edit(folder, name, *FILLED_IN[target][name])
        for name in ("notes.txt", "board/README.md", "board/my.c", "build_RAM/dz_comp.obj", "measured.csv"):
            add(folder, name if filled_in else "notes.txt")

    status, said = verify(target, fill_in)
    assert status == 0 and "Every requirement holds" in said
    assert all(f"{name}, which is yours" in said for name in theirs) and ("which is yours" in said) is filled_in


def test_what_is_compiled_and_run_is_the_text_that_is_generated_now(folder_of, tmp_path, monkeypatch):
    folder = tmp_path / "firmware"
    shutil.copytree(folder_of / "f28335", folder)
    with generated_code(folder) as code:
        edit(folder, "core/dz_drive.c", "{", "{ /* another */")
        assert b"another" not in (code / "core/dz_drive.c").read_bytes() and code != folder
    named = r"nothing of .* was compiled or run: core/dz_drive\.c, line"
    with pytest.raises(RequirementError, match=named), generated_code(folder):
        pass


def test_numbers_of_which_nobody_knows_whether_they_follow_are_not_checked(example_valve, tmp_path):
    """Designed in Python without options: the same text, but no design to compare it with."""
    from dzdesign.design.designing import design

    write_generated(generate(design(example_valve), "host"), tmp_path / "firmware")
    again = regenerated(tmp_path / "firmware")
    check = reproduced(tmp_path / "firmware", again)
    assert again.files and check.holds is None and "with which options" in check.text
    edit(tmp_path / "firmware", "core/dz_drive.c", "{", "{ /* another */")
    assert reproduced(tmp_path / "firmware", again).holds is False


def test_of_a_design_of_another_version_a_difference_is_no_fault(folder_of, tmp_path):
    """It may have chosen other tables, and none the worse."""
    folder = tmp_path / "firmware"
    shutil.copytree(folder_of / "f28335", folder)
    change_json(folder / "compensator.json", less_beta)
    assert "follows from its valve" in regenerated(folder).fault
    change_json(folder / "compensator.json", lambda it: it["tool"].update(version="0.0.9"))
    again = regenerated(folder)
    assert not again.fault and again.unknown.startswith("designed by dzdesign '0.0.9'")
