"""A new target is one folder: docs/howto/add-target.md as a reader follows it, from ramp tests to the report."""

import json
import os
import re
import shutil
import subprocess

import pytest

from dzdesign.verify.toolchain.host_compiler import STRICT, host_compiler
from tests.support.documented_commands import try_page
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

PAGE = ROOT / "docs" / "howto" / "add-target.md"
FOLDER = "codegen/dzdesign/codegen/mychip/"
#: A paragraph that begins with a file's name, then the file.
FILE = re.compile(r"^`([^`\n]+)`[^`]*?\n\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)


@pytest.fixture
def clone(tmp_path, monkeypatch):
    """The room of a clone, with the files of the page, found before the installed one."""
    files = dict(FILE.findall(PAGE.read_text(encoding="utf-8")))
    assert len(files) == 5 and all(name.startswith(FOLDER) for name in files), "one folder, nothing else"
    shutil.copytree(ROOT / "codegen", tmp_path / "codegen", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path / 'codegen'}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
    return tmp_path


@pytest.mark.slow
@needs_compiler
@pytest.mark.skipif(shutil.which("bash") is None, reason="the page's commands need bash")
def test_the_page_adds_a_target_that_goes_through_the_whole_chain(clone, request):
    assert try_page(PAGE, clone, request.config.getoption("--update-docs")) == []
    manifest = json.loads((clone / "firmware" / "manifest.json").read_text())
    assert manifest["target"] == "mychip" and manifest["board"] == ["mychip/pins.c"]
    evidence = json.loads((clone / "evidence" / "verification.json").read_text())
    assert evidence["target"] == "mychip" and evidence["holds"] is True
    assert "mychip" in (clone / "evidence" / "report.html").read_text(encoding="utf-8")
    firmware = clone / "firmware"
    sources = [*firmware.glob("core/*.c"), *firmware.glob("mychip/*.c")]
    command = [host_compiler(), *STRICT, "-I", str(firmware / "core"), *map(str, sources), "-o", str(clone / "mychip")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert len(sources) == 4 and done.returncode == 0, done.stderr
