"""The page on adding a law, followed to the letter in a copy of the room: one file, and the chain runs with it."""

import json
import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.support.paths import GOLDENS, ROOT
from tests.support.synthetic import needs_compiler

pytestmark = pytest.mark.slow  # a copy of a room, and processes that import it anew

PAGE = ROOT / "docs" / "howto" / "add-law.md"
#: The file that the page shows: its path, and its content.
FILE = re.compile(r"^`([\w/]+\.py)`.*?\n\n```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("law")
    shutil.copytree(ROOT / "derivation", folder / "derivation", ignore=shutil.ignore_patterns("__pycache__"))
    laws = folder / "derivation/dzdesign/derivation/laws"
    assert {path.stem for path in laws.glob("*.py")} == {"__init__", "paper", "target"}
    [(place, content)] = FILE.findall(PAGE.read_text("utf-8"))
    (folder / place).write_text(content, encoding="utf-8")
    shutil.copy(GOLDENS / "valve.json", folder)
    return folder


@pytest.fixture(scope="module")
def run(folder):
    """Run `dzdesign` with the room that has one law more."""
    code = "import sys; from dzdesign.command_line.cli import main; sys.exit(main())"

    def dzdesign(*words, status=0):
        command = [sys.executable, "-c", code, *words]
        environment = {**os.environ, "PYTHONPATH": str(folder / "derivation")}
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == status, done.stdout + done.stderr
        return done.stdout + done.stderr

    return dzdesign


@pytest.fixture(scope="module")
def firmware(run, folder):
    run("design", "valve.json", "--law", "scaled", "-o", "compensator.json")
    assert json.loads((folder / "compensator.json").read_text())["law"] == "scaled"
    run("codegen", "compensator.json", "--target", "host", "-o", "firmware")
    return folder / "firmware"


def test_the_command_line_knows_the_law(run):
    assert "scaled" in run("design", "--help")
    assert "did you mean 'scaled'?" in run("design", "valve.json", "--law", "scaledd", status=2)


def test_the_account_proves_it(run):
    account = run("derive", "--equation", "scaled")
    assert "the law `scaled`" in account
    assert "u_O = beta*(u_min0 + k*x_max*u_i/u_max)" in account


def test_the_firmware_says_which_law_it_is(firmware):
    numbers = (firmware / "core/dz_valve.h").read_text()
    assert "Eq. (14) times beta" in numbers
    assert "two's complement: k x_max/u_max =" in " ".join(numbers.replace(" * ", " ").split())


@needs_compiler
def test_every_input_follows_it_and_the_report_derives_it(run, firmware, folder):
    run("verify", "firmware", "-o", "evidence")
    evidence = json.loads((folder / "evidence/verification.json").read_text())
    assert evidence["holds"] is True
    page = (folder / "evidence/report.html").read_text(encoding="utf-8")
    assert "Less gain where the dead zone is smaller." in page
    assert "<code>scaled</code>" in page
