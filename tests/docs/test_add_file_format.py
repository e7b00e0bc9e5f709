"""The page on adding a file format, followed to the letter in a copy: two files, and `identify` takes it."""

import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.support.paths import ROOT
from tests.support.synthetic import L_MIN

pytestmark = pytest.mark.slow  # a copy of a room, and processes that import it anew

PAGE = ROOT / "docs" / "howto" / "add-file-format.md"
#: A file that the page shows: its path, and its content.
FILE = re.compile(r"^`([\w/]+\.py)`.*?\n\n```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """The environment of a copy of identify to which the page's reader was added; the page's test stands beside it."""
    copy = tmp_path_factory.mktemp("copy")
    shutil.copytree(ROOT / "identify", copy / "identify", ignore=shutil.ignore_patterns("__pycache__"))
    shown = dict(FILE.findall(PAGE.read_text("utf-8")))
    assert len(shown) == 2
    for place, content in shown.items():
        (copy / place).parent.mkdir(parents=True, exist_ok=True)
        (copy / place).write_text(content, encoding="utf-8")
    # The copy stands before the installed one, whose other rooms it shares.
    return {**os.environ, "PYTHONPATH": str(copy / "identify"), "PYTHONSAFEPATH": "1"}, copy


def test_the_test_of_the_page_holds(environment):
    variables, copy = environment
    test = copy / "tests" / "identify" / "reading" / "test_numpy_array.py"
    options = ["-q", "-p", "no:cacheprovider", f"--rootdir={ROOT}", f"-c{ROOT}/pyproject.toml"]
    command = [sys.executable, "-m", "pytest", *options, test]
    done = subprocess.run(command, env=variables, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "2 passed" in done.stdout, done.stdout + done.stderr


def test_the_command_line_takes_the_format(environment, tmp_path):
    variables, _ = environment
    ramps = sorted((ROOT / "examples" / "paper_valve" / "ramps").glob("*.csv*"))[:2]
    for ramp in ramps:
        test = read_ramp_file(ramp)
        columns = {"time_s": test.time, "u_V": test.u, "dP_MPa": test.dp / 1e6, "Q_Lmin": test.q / L_MIN}
        name = ramp.name.partition(".")[0] + ".npy"
        np.save(tmp_path / name, np.rec.fromarrays(list(columns.values()), names=list(columns)), allow_pickle=False)
    start = "import sys; from dzdesign.command_line.cli import main; sys.exit(main())"
    command = [sys.executable, "-c", start, "identify", "*.npy", "-o", "valve.json"]
    done = subprocess.run(command, env=variables, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert all(f"{ramp.name.partition('.')[0]}.npy" in (tmp_path / "valve.json").read_text() for ramp in ramps)
