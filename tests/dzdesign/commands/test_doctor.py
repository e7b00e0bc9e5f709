"""`dzdesign doctor`: what is there, what is not, and a verdict on the main job: a C compiler that works."""

import json
import shutil
import stat
import sys

import pytest

from dzdesign.command_line.cli import main
from dzdesign.commands import doctor
from tests.support.synthetic import needs_compiler


def said(capsys, status):
    assert main(["doctor", "--json"]) == status
    return json.loads(capsys.readouterr().out)


@pytest.fixture
def bare(tmp_path, monkeypatch):
    """A machine with an empty path, and no package with a compiler."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    return tmp_path


@needs_compiler
def test_a_compiler_that_works_is_the_main_job(capsys):
    report = said(capsys, 0)
    assert report["compiles"] and shutil.which(report["compiler"])
    there = {name for name, found in report["programs"].items() if found}
    assert there & {"gcc", "clang", "zig"}
    assert there == {name for name in report["programs"] if shutil.which(name)} | (there & {"zig"})
    assert not {tool["name"] for tool in report["to_get"]} & (there | {"gcc", "clang", "zig"})


def test_nothing_there_is_exit_status_1_with_what_to_do(bare, capsys):
    report = said(capsys, 1)
    assert not report["compiles"] and "no C compiler was found" in report["compiler"]
    assert not any(report["programs"].values())
    assert {tool["name"] for tool in report["to_get"]} == set(report["programs"])
    for tool in report["to_get"]:
        assert all(tool[system] for system in ("debian", "macos", "windows"))
    assert main(["doctor"]) == 1
    page = capsys.readouterr().out
    assert "NO C COMPILER WORKS" in page and "pip install ziglang" in page
    assert doctor.SYSTEMS.get(sys.platform, ("Debian, Ubuntu",))[0] in page and "qemu-system-arm" in page


@pytest.mark.skipif(sys.platform == "win32", reason="a program here is a script of sh")
def test_a_compiler_that_does_not_work_is_found_out(bare, capsys):
    program = bare / "gcc"
    program.write_text("#!/bin/sh\necho 'gcc (broken) 99.1.2'\nexit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    report = said(capsys, 1)
    assert report["programs"]["gcc"]["version"] == "99.1.2" and not report["compiles"]
    assert "does not compile" in report["compiler"]
