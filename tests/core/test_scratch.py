"""Folders of a process: they go with it, and those of a killed one go with a later one."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from dzdesign.core.placing import ABANDONED_S, SCRATCH, is_scratch, scratch_folder

HOLDS = """
import sys
from dzdesign.core.placing import process_folder, scratch_folder
with scratch_folder() as folder:
    (folder / "big.o").write_text("x")
    print(process_folder(), folder, flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def holder(place: Path) -> tuple[subprocess.Popen, list[Path]]:
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDS], env={**os.environ, "TMPDIR": str(place)}, text=True,
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    return process, [Path(word) for word in process.stdout.readline().split()]


def test_a_folder_goes_at_the_end_of_its_context(place):
    with scratch_folder() as folder:
        assert folder.parent == place and is_scratch(folder / "a/b") and not is_scratch(place)
    assert not list(place.iterdir()) and not is_scratch(folder)


@pytest.mark.skipif(sys.platform == "win32", reason="no such kill")
def test_folders_of_a_killed_process_go_with_a_later_one_and_those_of_a_living_one_stay(place):
    killed, abandoned = holder(place)
    killed.kill()
    killed.communicate()
    long_ago = time.time() - 2 * ABANDONED_S
    for folder in abandoned:
        os.utime(folder, (long_ago, long_ago))
    living, used = holder(place)
    assert all(path.is_dir() for path in used)
    assert not any(path.exists() for path in abandoned), "the living one removed them"
    with scratch_folder():
        assert all(path.is_dir() for path in used)
    living.communicate("\n", timeout=30)
    assert not list(place.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="no such links")
def test_nothing_is_removed_through_a_link(place, tmp_path_factory):
    other = tmp_path_factory.mktemp("others")
    (other / "file").write_text("kept")
    long_ago = time.time() - 2 * ABANDONED_S
    os.utime(other, (long_ago, long_ago))
    (place / f"{SCRATCH}link").symlink_to(other)
    os.utime(place / f"{SCRATCH}link", (long_ago, long_ago), follow_symlinks=False)
    with scratch_folder() as folder:
        folder.rename(place / "moved")
        folder.symlink_to(other)
    assert (other / "file").read_text() == "kept"
