"""What reaches the disk, in which order, and what a power cut or a kill left is made again; nobody's file is lost."""

import os
import sys
import time
from pathlib import Path

import pytest

from dzdesign.core.artefact_files import MANIFEST_NAME, write_file, write_files, write_folder
from dzdesign.core.placing import ABANDONED_S, UNPLACED

FILES = {"core/a.c": "int a;\n", "README.md": "read\n"}
FIRMWARE = {"schema": "dzdesign.firmware/1", "target": "host"}
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="folders are not synced there")


@pytest.fixture
def steps(monkeypatch):
    """The calls that decide what a power cut leaves: the inode that is synced, and the one that is renamed."""
    seen: list[tuple[str, int]] = []
    real_sync, real_replace = os.fsync, os.replace

    def sync(descriptor: int) -> None:
        seen.append(("sync", os.fstat(descriptor).st_ino))
        real_sync(descriptor)

    def replace(source, target) -> None:
        seen.append(("rename", os.stat(source).st_ino))
        real_replace(source, target)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(os, "replace", replace)
    return seen


def test_a_file_is_synced_before_its_rename_and_its_folder_after_it(tmp_path, steps):
    write_file(tmp_path / "valve.json", "{}")
    number = (tmp_path / "valve.json").stat().st_ino
    assert steps == [("sync", number), ("rename", number), ("sync", tmp_path.stat().st_ino)]


def test_all_files_of_a_folder_are_synced_then_it_then_its_rename(tmp_path, steps):
    folder = tmp_path / "firmware"
    write_folder(folder, FILES, FIRMWARE)
    inside = [folder / name for name in (*FILES, MANIFEST_NAME, "core", ".")]
    before = steps[: steps.index(("rename", folder.stat().st_ino))]
    assert {("sync", path.stat().st_ino) for path in inside} <= set(before)
    assert before.index(("sync", (folder / "core/a.c").stat().st_ino)) < before.index(
        ("sync", (folder / "core").stat().st_ino)
    )
    assert before[-1] == ("sync", folder.stat().st_ino)
    assert steps[-1] == ("sync", tmp_path.stat().st_ino)


def test_the_names_of_new_folders_above_it_are_synced(tmp_path, steps):
    write_folder(tmp_path / "a" / "b" / "firmware", FILES, FIRMWARE)
    write_files(tmp_path / "c" / "plots", {"a.svg": b"a"}, "--plots")
    synced = [number for step, number in steps if step == "sync"]
    for place in (tmp_path, tmp_path / "a", tmp_path / "c"):
        assert place.stat().st_ino in synced, place


def test_what_lies_beside_a_folder_under_a_like_name_is_somebodys_own(tmp_path):
    notes = tmp_path / ".firmware.old" / "notes.txt"
    notes.parent.mkdir()
    notes.write_text("mine")
    for text in ("old\n", "new\n"):
        write_folder(tmp_path / "firmware", {**FILES, "README.md": text}, FIRMWARE)
    assert notes.read_text() == "mine" and sorted(os.listdir(tmp_path)) == [".firmware.old", "firmware"]


def test_a_folder_may_have_the_longest_name(tmp_path):
    for text in ("old\n", "new\n"):
        write_folder(tmp_path / ("x" * 255), {**FILES, "README.md": text}, FIRMWARE)
    assert (tmp_path / ("x" * 255) / "README.md").read_text() == "new\n"


def test_a_replaced_folder_is_removed_only_after_the_new_name_is_on_the_disk(tmp_path, steps, monkeypatch):
    folder = tmp_path / "firmware"
    write_folder(folder, FILES, FIRMWARE)
    monkeypatch.setattr("shutil.rmtree", lambda *_, **__: steps.append(("remove", 0)))
    write_folder(folder, {**FILES, "README.md": "new\n"}, FIRMWARE)
    new_name = steps.index(("rename", folder.stat().st_ino))
    assert new_name < steps.index(("sync", tmp_path.stat().st_ino), new_name) < steps.index(("remove", 0))


@pytest.mark.parametrize("write", [
    lambda place: write_file(place / "valve.json", "{}"),
    lambda place: write_folder(place / "firmware", FILES, FIRMWARE),
])  # fmt: skip
def test_what_a_killed_run_began_goes_with_a_later_one(tmp_path, write):
    (tmp_path / f"{UNPLACED}0a1b").mkdir()
    (tmp_path / f"{UNPLACED}0a1b/half").write_text("half")
    (tmp_path / f"{UNPLACED}file").write_text("half")
    (tmp_path / f"{UNPLACED}young").write_text("another process writes it")
    long_ago = time.time() - 2 * ABANDONED_S
    for name in ("0a1b", "file"):
        os.utime(tmp_path / f"{UNPLACED}{name}", (long_ago, long_ago))
    write(tmp_path)
    assert [path.name for path in tmp_path.glob(f"{UNPLACED}*")] == [f"{UNPLACED}young"]


def test_the_artefact_that_a_link_leads_to_is_replaced_and_the_link_stays(tmp_path):
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept/valve.json").write_text('{"schema": "dzdesign.valve/1"}')
    (tmp_path / "valve.json").symlink_to("kept/valve.json")
    write_file(tmp_path / "valve.json", "new", "dzdesign.valve/1")
    assert (tmp_path / "valve.json").readlink() == Path("kept/valve.json")
    assert (tmp_path / "kept/valve.json").read_text() == "new"


def test_a_link_to_what_is_no_artefact_gives_way(tmp_path):
    (tmp_path / "work.txt").write_text("years of work")
    (tmp_path / "plot.svg").symlink_to("work.txt")
    write_file(tmp_path / "plot.svg", "new")
    assert (tmp_path / "work.txt").read_text() == "years of work" and not (tmp_path / "plot.svg").is_symlink()


def test_a_read_only_file_that_windows_can_not_sync_is_carried_over(tmp_path, monkeypatch):
    folder = tmp_path / "firmware"
    write_folder(folder, FILES, FIRMWARE)
    (folder / "object").write_text("mine")
    real = os.open

    def windows(path, flags, *rest, **more):
        if flags == os.O_RDWR and str(path).endswith("object"):
            raise PermissionError(13, "Permission denied")
        return real(path, flags, *rest, **more)

    monkeypatch.setattr("dzdesign.core.placing.FOLDERS_OPEN", False)
    monkeypatch.setattr(os, "open", windows)
    write_folder(folder, FILES, FIRMWARE)
    assert (folder / "object").read_text() == "mine"
