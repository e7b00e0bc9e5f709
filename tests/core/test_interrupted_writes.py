"""Interrupted at any call of any write, the old artefact stands or the new one; the next run succeeds."""

import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from pathlib import Path

import pytest

from dzdesign.core.artefact_files import write_file, write_files, write_folder
from dzdesign.core.errors import InputError
from dzdesign.core.placing import RETIRED, UNPLACED

HERE = Path(__file__).parent
COMPILER = next((path for name in ("cc", "gcc", "clang") if (path := shutil.which(name))), None)
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="calls are intercepted by a Linux loader's means"),
]
#: What a kill may leave behind: hidden, and in nobody's way.
LITTER = UNPLACED


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    """Every write of `interrupted_writer`, failed at every one of its calls in every way."""
    if COMPILER is None:
        pytest.skip("no C compiler (cc, gcc, clang) on the path")
    folder = tmp_path_factory.mktemp("interrupted")
    shim = folder / "failing_calls.so"
    subprocess.run([COMPILER, "-shared", "-fPIC", "-O1", HERE / "failing_calls.c", "-o", shim, "-ldl"], check=True)
    quick = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None  # a disk takes its time for every fsync
    with tempfile.TemporaryDirectory(prefix="dzdesign-", dir=quick) as scratch:
        done = subprocess.run(
            [sys.executable, HERE / "interrupted_writer.py", scratch],
            env={**os.environ, "LD_PRELOAD": str(shim)}, capture_output=True, text=True, timeout=300, check=True,
        )  # fmt: skip
    found = defaultdict(list)
    for line in done.stdout.splitlines():
        row = json.loads(line)
        found[row["job"]].append(row)
    return found


def without_litter(tree: dict[str, str]) -> dict[str, str]:
    return {name: text for name, text in tree.items() if not name.split("/")[-1].startswith(LITTER)
            and not name.startswith(LITTER)}  # fmt: skip


def judged(rows: list[dict]) -> Counter:
    """Return how often the old and the new stood after what, and assert that nothing else ever did."""
    first, *rest = rows
    found: Counter = Counter()
    for row in rest:
        after, status = without_litter(row["after"]), row["status"]
        where = f"{row['job']}, {row['way']} at call {row['at']} of {first['calls']}"
        whole = "old" if after == first["old"] else "new" if after == first["new"] else None
        found[row["way"], whole] += 1
        assert whole, f"{where} left {sorted(after)}"
        if row["way"] == "SIGKILL":
            assert os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGKILL, where
        elif row["way"] == "SIGINT":
            assert os.waitstatus_to_exitcode(status) in (0, 4), where
        else:  # an error that is told means that nothing was done; none, that all was
            assert os.waitstatus_to_exitcode(status) == (2 if whole == "old" else 0), where
        assert row["status_again"] == 0 and without_litter(row["again"]) == first["new"], f"the run after {where}"
    return found


@pytest.mark.parametrize("job", ["file", "first file", "first folder"])
def test_the_old_stands_or_the_new_whatever_call_fails(rows, job):
    assert rows[job][0]["calls"] >= (5 if "file" in job else 10), "the calls were not seen"
    found = judged(rows[job])
    assert found["ENOSPC", "old"] and found["SIGKILL", "old"] and found["SIGINT", "old"], found


def test_each_of_several_files_is_whole(rows):
    first, *rest = rows["plots"]
    assert first["calls"] >= 8
    for row in rest:
        after = without_litter(row["after"])
        assert after["plots/a.svg"] in ("old a", "new a") and after.get("plots/b.svg", "new b") == "new b", row
        assert row["status_again"] == 0 and without_litter(row["again"]) == first["new"]


def test_the_next_run_brings_an_old_folder_back(rows):
    """Killed between two renames, the old folder lies beside; what a person added to it is not lost."""
    first, *rest = rows["folder"]
    beside = 0
    for row in rest:
        after = without_litter(row["after"])
        retired = {name.partition("/")[2]: text for name, text in after.items() if name.startswith(RETIRED)}
        stands = {name: text for name, text in after.items() if name.startswith("firmware/")}
        assert stands in (first["old"], first["new"]) or (
            row["way"] in ("SIGKILL", "SIGINT")
            and {f"firmware/{name}": text for name, text in retired.items()} == first["old"]
        ), row
        beside += not stands
        assert row["status_again"] == 0 and without_litter(row["again"]) == first["new"], row
    assert beside >= 1, "the kill between the two renames was not tried"


def test_a_seeded_fault_is_seen(rows):
    """The judge itself: half a folder, a lost note, an error after all was written."""
    first, row = rows["first folder"][0], dict(rows["first folder"][1])
    for change in (
        {"after": {"firmware/core/a.c": "new a"}},
        {"after": {k: v for k, v in first["new"].items() if "b.c" not in k}},
        {"after": first["new"], "status": 2 << 8},
        {"status_again": 2 << 8},
    ):
        with pytest.raises(AssertionError):
            judged([first, {**row, **change}])


# a disk that is full


def disks(tmp_path: Path):
    """Yield places where no more than 64 KiB go: by a limit, and on a small disk where one may be mounted."""
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    (tmp_path / "limited").mkdir()
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 16, limit[1]))
    try:
        yield tmp_path / "limited"
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk]
    if shutil.which("mount") and subprocess.run(mount, capture_output=True, check=False).returncode == 0:
        try:
            yield disk
        finally:
            subprocess.run(["umount", disk], check=True)


def test_a_disk_that_is_full(tmp_path):
    for place in disks(tmp_path):
        write_file(place / "valve.json", "old")
        write_folder(place / "firmware", {"a.c": "old"}, {"schema": "dzdesign.firmware/1"})
        before = sorted(path.relative_to(place) for path in place.rglob("*"))
        with pytest.raises(InputError, match=r"valve\.json' can't be written: (No space|File too large).*-o"):
            write_file(place / "valve.json", "new" * 100_000)
        with pytest.raises(InputError, match=r"firmware' can't be written: (No space|File too large).*-o"):
            write_folder(place / "firmware", {"a.c": "new", "b.c": "new" * 100_000}, {"schema": "dzdesign.firmware/1"})
        with pytest.raises(InputError, match="--plots"):
            write_files(place / "plots", {"a.svg": b"a" * 300_000}, "--plots")
        assert sorted(path.relative_to(place) for path in place.rglob("*") if path.name != "plots") == before
        assert (place / "valve.json").read_text() == "old" and (place / "firmware" / "a.c").read_text() == "old"
