"""Code that dzdesign does not generate is neither compiled nor run: a constructor in it leaves no mark."""

import shutil
from io import BytesIO
from zipfile import ZipFile

import pytest

from dzdesign import api
from dzdesign.changed_code import code_of_firmware, code_of_output, refuse_changed_firmware
from dzdesign.codegen.fmu import files as binaries
from dzdesign.codegen.fmu.files import archive
from dzdesign.codegen.other_targets import generate_output, write_output
from dzdesign.codegen.project import generate, write_firmware
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_files import sha256_of
from dzdesign.core.errors import InputError, RequirementError
from dzdesign.regeneration import output_again
from dzdesign.verify import verification
from dzdesign.verify.outputs import dispatch
from tests.support.attacked_firmware import add, change_json, edit, seal
from tests.support.host_fmus import fmus_of, full_compensator, host_platforms
from tests.support.synthetic import needs_compiler

pytestmark = needs_compiler


def constructor(mark):
    """Return C that makes a file as soon as it is loaded."""
    return (
        f'\n#include <stdio.h>\n__attribute__((constructor)) static void dz_mark(void)\n{{\n'
        f'    FILE *file = fopen("{mark.as_posix()}", "w");\n    if (file) {{\n        fclose(file);\n    }}\n}}\n'
    )


def append(path, text):
    path.write_bytes(path.read_bytes() + text.encode())


@pytest.fixture
def mark(tmp_path):
    """The file that code makes where it runs."""
    return tmp_path / "it_ran"


def as_it_is(folder):
    """Leave the manifest alone: its hash of the file no longer fits."""


def of_another_version(folder):
    seal(folder, lambda manifest: manifest["tool"].update(version="0.0.9"))


def as_the_users(folder):
    seal(folder, lambda manifest: manifest["board"].append("core/dz_drive.c"))


def of_another_target(folder):
    seal(folder, lambda manifest: manifest.update(target="mychip"))


#: How the manifest is made to go with the change.
MANIFESTS = (as_it_is, seal, of_another_version, as_the_users, of_another_target)


@pytest.mark.parametrize("manifest", MANIFESTS)
@pytest.mark.parametrize("command", ["verify", "simulate"])
def test_an_appended_constructor_does_not_run(firmware_folder, tmp_path, mark, capsys, manifest, command):
    append(firmware_folder / "core/dz_drive.c", constructor(mark))
    manifest(firmware_folder)
    given = ["--firmware", str(firmware_folder)] if command == "simulate" else [str(firmware_folder)]
    assert main([command, *given, "-o", str(tmp_path / "made")]) == 1
    said = capsys.readouterr().err
    assert "was neither compiled nor run" in said and "`dzdesign codegen`" in said
    assert {of_another_version: "0.0.9", of_another_target: "mychip"}.get(manifest, "core/dz_drive.c") in said
    assert "write a target" in said
    assert not mark.exists() and not (tmp_path / "made").exists()


#: Files that come in beside the generated ones.
ADDED = ("core/another.c", "core/stdint.h", "core/ANOTHER.C", "core/more/another.h")


@pytest.mark.parametrize("listed", [False, True])
@pytest.mark.parametrize("name", ADDED)
def test_a_file_beside_the_core_does_not_run(firmware_folder, tmp_path, mark, capsys, name, listed):
    add(firmware_folder, name, constructor(mark))
    if listed:
        seal(firmware_folder, lambda it: (it["files"].update({name: "0" * 64}), it["core"].append(name)))
    assert main(["verify", str(firmware_folder), "-o", str(tmp_path / "made")]) == 1
    assert f"run: {name} is not what" in capsys.readouterr().err
    assert not mark.exists() and not (tmp_path / "made").exists()


def test_the_block_as_c_is_code_too_wherever_the_manifest_says_it_lies(example_compensator, tmp_path, mark, capsys):
    folder = tmp_path / "firmware"
    write_firmware(generate(example_compensator, "host", calibration="block"), folder)
    add(folder, "board/dz_block.c", (folder / "host/dz_block.c").read_text() + constructor(mark))
    add(folder, "board/dz_block.h", (folder / "host/dz_block.h").read_text())
    code = refuse_changed_firmware(folder)
    assert {"host/dz_block.c", "core/dz_comp.c", "calibration.bin"} <= set(code) and "board/dz_block.c" not in code

    def say_so(manifest):
        del manifest["files"]["host/dz_block.c"]
        manifest["files"]["board/dz_block.c"] = "0" * 64

    seal(folder, say_so)
    assert main(["verify", str(folder), "-o", str(tmp_path / "made")]) == 1
    assert "run: board/dz_block.c is not what" in capsys.readouterr().err and not mark.exists()


def test_a_file_that_is_missing_is_named(firmware_folder):
    (firmware_folder / "core/dz_comp.h").unlink()
    with pytest.raises(RequirementError, match=r"run: core/dz_comp\.h is not what"):
        refuse_changed_firmware(firmware_folder)


def test_a_compensator_that_is_none_is_bad_input(firmware_folder):
    (firmware_folder / "compensator.json").write_text("{}")
    with pytest.raises(InputError):
        refuse_changed_firmware(firmware_folder)


def test_a_compensator_that_no_firmware_is_made_of_is_a_change(firmware_folder):
    change_json(firmware_folder / "compensator.json", lambda document: document["target"].update(name="mychip"))
    with pytest.raises(RequirementError, match="mychip"):
        refuse_changed_firmware(firmware_folder)


def test_what_is_no_code_of_this_machine_does_not_count(firmware_folder):
    """It has a verdict of its own; nothing of it is run here."""
    edit(firmware_folder, "f28335/dz_isr.c", "{", "{ /* another */")
    add(firmware_folder, "f28335/stdint.h", "int x;\n")
    add(firmware_folder, "Makefile", "all:\n\tfalse\n")
    assert refuse_changed_firmware(firmware_folder)


def test_what_is_run_is_a_copy_that_no_change_of_the_folder_reaches(firmware_folder, mark):
    add(firmware_folder, "f28335/stdint.h", "int x;\n")
    with code_of_firmware(firmware_folder) as code:
        append(firmware_folder / "core/dz_comp.c", constructor(mark))
        assert code != firmware_folder and b"dz_mark" not in (code / "core/dz_comp.c").read_bytes()
        assert not list(code.rglob("stdint.h")) and not list(code.rglob("manifest.json"))
    assert not code.exists()


def test_the_function_of_python_asks_too(example_compensator, firmware_folder, mark, monkeypatch):
    append(firmware_folder / "core/dz_comp.c", constructor(mark))
    monkeypatch.setattr(verification, "verify", lambda *_, **__: pytest.fail("run"))
    with pytest.raises(RequirementError, match="write a target"):
        api.verify(firmware_folder)


# ---- outputs that are no C firmware ----


@pytest.fixture
def matlab(example_compensator, tmp_path):
    write_output(generate_output(example_compensator, "matlab", {}), tmp_path / "matlab")
    return tmp_path / "matlab"


def seal_output(folder):
    """Make the hashes in an output's manifest those of the files as they are, and name those that were added."""
    there = [path for path in folder.rglob("*") if path.is_file() and path.name != "manifest.json"]
    digests = {path.relative_to(folder).as_posix(): sha256_of(path.read_bytes()) for path in there}
    change_json(folder / "manifest.json", lambda manifest: manifest.update(files=digests))


@pytest.mark.parametrize("name", ["core/dz_comp.c", "core/dz_comp.h", "dz_comp.m", "setup_c_caller.m", "core/mine.h"])
def test_a_function_of_matlab_and_its_c_are_code(matlab, tmp_path, mark, capsys, name):
    comment = "%" if name.endswith(".m") else "//"
    (matlab / name).touch()
    append(matlab / name, f"{comment} mine\n" if name.endswith(".m") else constructor(mark))
    seal_output(matlab)
    assert main(["verify", str(matlab), "-o", str(tmp_path / "made")]) == 1
    assert f"run: {name} is not what" in capsys.readouterr().err
    assert not mark.exists() and not (tmp_path / "made").exists()


def test_notes_are_no_code(matlab):
    add(matlab, "notes.txt", "mine\n")
    with code_of_output(matlab, output_again(matlab)) as code:
        assert (code / "dz_comp.m").is_file() and not (code / "notes.txt").exists()


def test_structured_text_is_read_and_has_its_verdict(example_compensator, tmp_path, monkeypatch):
    folder = tmp_path / "plc"
    write_output(generate_output(example_compensator, "iec61131", {"dialect": "codesys", "interface": "codes"}), folder)
    (text,) = folder.glob("*.st")
    append(text, "(* mine *)\n")

    class Verified(Exception):
        pass

    def verify_output(given, options, say, code, forms):
        raise Verified(given, code)

    monkeypatch.setattr(dispatch, "verify_output", verify_output)
    with pytest.raises(Verified) as found:
        api.verify(folder)
    assert found.value.args == (folder, folder)


@pytest.fixture(scope="module")
def fmus():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(binaries, "PLATFORMS", host_platforms())
        return fmus_of(full_compensator(), None)


FMU = "dz_compensator.fmu"


@pytest.mark.parametrize("compiler", [True, False])
def test_a_foreign_binary_in_an_fmu_does_not_run(fmus, tmp_path, mark, capsys, monkeypatch, compiler):
    """Nor does a right one that no compiler here can make again."""
    monkeypatch.setattr(binaries, "PLATFORMS", host_platforms())
    folder = tmp_path / "fmus"
    write_output(fmus, folder)
    if compiler:
        with ZipFile(BytesIO((folder / FMU).read_bytes())) as packed:
            files = {each: packed.read(each) for each in packed.namelist()}
        name = next(each for each in files if each.startswith("binaries/"))
        files[name] = _foreign_binary(tmp_path, mark)
        (folder / FMU).write_bytes(archive(files))
        seal_output(folder)
    else:
        monkeypatch.setattr(binaries, "FLAGS", ("--no-such-flag",))
    assert main(["verify", str(folder), "-o", str(tmp_path / "made")]) == 1
    said = capsys.readouterr().err
    assert "was neither compiled nor run" in said and (FMU if compiler else "ziglang") in said
    assert not mark.exists() and not (tmp_path / "made").exists()


def _foreign_binary(folder, mark):
    from dzdesign.verify.toolchain.host_compiler import build, host_compiler, words_of

    (folder / "foreign.c").write_text(constructor(mark))
    library = folder / "foreign.so"
    build([*words_of(host_compiler()), "-shared", "-fPIC", "foreign.c", "-o", str(library)], "it", folder)
    return library.read_bytes()


def test_what_is_generated_is_not_refused(matlab, fmus, tmp_path, monkeypatch, firmware_folder):
    monkeypatch.setattr(binaries, "PLATFORMS", host_platforms())
    write_output(fmus, tmp_path / "fmus")
    for folder in (matlab, tmp_path / "fmus"):
        with code_of_output(folder, output_again(folder)) as code:
            names = sorted(path.relative_to(code).as_posix() for path in code.rglob("*") if path.is_file())
            assert names and all((code / name).read_bytes() == (folder / name).read_bytes() for name in names)
    shutil.rmtree(firmware_folder / "f28335")
    assert "core/dz_comp.c" in refuse_changed_firmware(firmware_folder)
