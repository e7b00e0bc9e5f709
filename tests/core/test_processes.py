"""Programs are those of PATH that are named in full, never of the working folder; they end with their children."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from dzdesign.core.processes import find_program, program_environment, run_program, search_folders

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


needs_groups = pytest.mark.skipif(os.name == "nt", reason="Windows has no groups of processes")
#: A program that starts another one; both write their numbers and sleep.
PARENT = """
import os, subprocess, sys, time
from pathlib import Path
Path(sys.argv[1], str(os.getpid())).touch()
if len(sys.argv) == 2:
    subprocess.Popen([sys.executable, __file__, sys.argv[1], "child"])
time.sleep(60)
"""
RUN = "import sys; from dzdesign.core.processes import run_program; run_program(sys.argv[1:], timeout=60)"
PATIENCE_S = 20.0


@pytest.fixture
def program(tmp_path):
    (tmp_path / "numbers").mkdir()
    path = tmp_path / "program.py"
    path.write_text(PARENT, encoding="utf-8")
    return [sys.executable, str(path), str(tmp_path / "numbers")]


def running(folder: Path) -> list[int]:
    return [int(path.name) for path in folder.iterdir() if is_running(int(path.name))]


def is_running(number: int) -> bool:
    try:
        return psutil.Process(number).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def wait_for(count: int, folder: Path) -> None:
    end = time.monotonic() + PATIENCE_S
    while len(running(folder)) != count and time.monotonic() < end:
        time.sleep(0.05)
    assert len(running(folder)) == count


@needs_groups
def test_an_interrupt_leaves_no_program(program):
    process = subprocess.Popen([sys.executable, "-c", RUN, *program], stderr=subprocess.DEVNULL)
    wait_for(2, Path(program[-1]))
    process.send_signal(signal.SIGINT)
    process.wait()
    wait_for(0, Path(program[-1]))


@needs_groups
def test_a_late_program_ends_with_what_it_has_started(program):
    begin = time.monotonic()
    with pytest.raises(subprocess.TimeoutExpired):
        run_program(program, timeout=2.0)
    assert time.monotonic() - begin < PATIENCE_S
    wait_for(0, Path(program[-1]))


def test_what_a_program_says_and_how_it_ends(tmp_path):
    words = "import os, sys; print(os.getcwd(), os.environ.get('A')); print('no', file=sys.stderr); sys.exit(3)"
    done = run_program([sys.executable, "-c", words], timeout=60, cwd=tmp_path, env={"A": "b"})
    assert (done.returncode, done.stdout, done.stderr) == (3, f"{tmp_path} b\n", "no\n")
    with pytest.raises(OSError):
        run_program([str(tmp_path / "absent")], timeout=60)
