"""Programs are those of PATH's folders that are named in full: one in the working folder is never run."""

import os
import sys

import pytest

from dzdesign.core.processes.programs import find_program, program_environment, search_folders, with_full_name
from dzdesign.core.processes.running import run_program

NAME = "dz-planted"


def plant(folder, name=NAME):
    """Put a program into a folder and return its path."""
    folder.mkdir(exist_ok=True)
    path = folder / (f"{name}.bat" if os.name == "nt" else name)
    path.write_text("@echo planted\n" if os.name == "nt" else "#!/bin/sh\necho planted\n")
    path.chmod(0o755)
    return path


@pytest.mark.parametrize("entries", [[], [""], ["."], ["sub"], ["", ".", "sub"]])
def test_the_working_folder_has_no_programs(entries, tmp_path, monkeypatch):
    plant(tmp_path)
    plant(tmp_path / "sub")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.pathsep.join(["", *entries, str(tmp_path / "empty")]))
    assert find_program(NAME) is None and search_folders() == [str(tmp_path / "empty")]
    with pytest.raises(FileNotFoundError):
        run_program([NAME], timeout=20.0)
    assert program_environment()["PATH"] == str(tmp_path / "empty")


def test_a_folder_of_the_path_has_them(tmp_path, monkeypatch):
    path = plant(tmp_path / "programs")
    plant(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", os.pathsep.join([".", str(tmp_path / "none"), str(path.parent)]))
    assert os.path.samefile(find_program(NAME), path)
    assert run_program([NAME], timeout=20.0).stdout.strip() == "planted"
    assert with_full_name([NAME, "-v"])[1:] == ["-v"]


def test_a_name_with_a_folder_is_what_the_user_wrote(tmp_path, monkeypatch):
    path = plant(tmp_path / "sub")
    monkeypatch.chdir(tmp_path)
    assert os.path.samefile(find_program(os.path.join("sub", path.name)), path)
    assert find_program(os.path.join("sub", "no-such-program")) is None


def test_what_is_no_program_is_passed_over(tmp_path, monkeypatch):
    (tmp_path / "a" / path_name()).mkdir(parents=True)
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / NAME).write_text("no program")
    last = plant(tmp_path / "c")
    monkeypatch.setenv("PATH", os.pathsep.join(str(tmp_path / each) for each in "abc"))
    assert os.path.samefile(find_program(NAME), last)


def path_name():
    return f"{NAME}.bat" if os.name == "nt" else NAME


@pytest.mark.skipif(sys.platform == "win32", reason="a script of sh")
def test_a_program_finds_no_other_in_its_folder_either(tmp_path, monkeypatch):
    """The compiler works in a folder of sources: what it starts by name comes from elsewhere."""
    plant(tmp_path)
    monkeypatch.setenv("PATH", os.pathsep.join([".", os.environ["PATH"]]))
    done = run_program(["sh", "-c", f"command -v {NAME} || echo none"], timeout=20.0, cwd=tmp_path)
    assert done.stdout.strip() == "none"
