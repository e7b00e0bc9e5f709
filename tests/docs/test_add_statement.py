"""The page on adding a statement, followed to the letter in a copy of the room: it is proved; a wrong one is not."""

import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.support.paths import ROOT

pytestmark = pytest.mark.slow  # a copy of a room, and processes that import it anew

PAGE = (ROOT / "docs" / "howto" / "add-statement.md").read_text("utf-8")
ACCOUNT = "derivation/dzdesign/derivation/account/account.py"
#: The file that the page shows: its path, and its content.
FILE = re.compile(r"^`([\w/]+\.py)`:\n\n```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)
DIFF = re.compile(rf"`{ACCOUNT}`:\n\n```diff\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def with_diff(text, diff):
    """Return a text with the lines of a diff: of each of its parts one line is new, the other one is there."""
    for part in diff.strip("\n").split("\n\n"):
        old = "".join(f"{line[1:]}\n" for line in part.splitlines() if line.startswith(" "))
        new = "".join(f"{line[1:]}\n" for line in part.splitlines())
        assert text.count(old) == 1 and new != old
        text = text.replace(old, new)
    return text


@pytest.fixture
def derive(tmp_path):
    """Run `dzdesign derive` with the room that has one statement more, its formula with a change."""
    shutil.copytree(ROOT / "derivation", tmp_path / "derivation", ignore=shutil.ignore_patterns("__pycache__"))
    [(place, content)] = FILE.findall(PAGE)
    [diff] = DIFF.findall(PAGE)
    account = tmp_path / ACCOUNT
    account.write_text(with_diff(account.read_text("utf-8"), diff), encoding="utf-8")

    def run(right="", wrong=""):
        assert right in content
        (tmp_path / place).write_text(content.replace(right, wrong, 1) if right else content, encoding="utf-8")
        code = "import sys; from dzdesign.command_line.cli import main; sys.exit(main())"
        command = [sys.executable, "-c", code, "derive", "--equation", "T11a"]
        environment = {**os.environ, "PYTHONPATH": str(tmp_path / "derivation"), "PYTHONDONTWRITEBYTECODE": "1"}
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr

    return run


def test_the_statement_is_proved(derive):
    status, account = derive()
    assert status == 0, account
    assert re.search(r"^T11a .*\[follows\]$", account, re.MULTILINE)


@pytest.mark.parametrize(
    ("right", "wrong"),
    [("u_O - beta", "u_O + beta"), ('"(18)"', '"(14)"'), ("(u_O - beta * u_min0)", "u_max * (u_O - beta * u_min0)")],
)
def test_a_seeded_fault_of_sign_ground_or_unit_is_found(derive, right, wrong):
    status, account = derive(right, wrong)
    assert status == 1 and "T11a should be found to be" in account, account
