"""What a working folder holds changes no plot."""

import os
import subprocess
import sys

import pytest

DRAW = "from dzdesign.identify.plots.style import plot_style\nwith plot_style():\n    import matplotlib.style"


@pytest.mark.skipif(os.name == "nt", reason="pipes that have a name in a folder")
@pytest.mark.parametrize("kind", ["pipe", "no text"])
def test_matplotlibrc_of_the_working_folder_is_not_read(tmp_path, kind):
    if kind == "pipe":
        os.mkfifo(tmp_path / "matplotlibrc")
    else:
        (tmp_path / "matplotlibrc").write_bytes(b"\xff\n")
    done = subprocess.run(
        [sys.executable, "-P", "-c", DRAW], cwd=tmp_path, timeout=60, stderr=subprocess.PIPE, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
