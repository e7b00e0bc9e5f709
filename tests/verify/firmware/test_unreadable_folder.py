"""What can't be looked at in a firmware folder is refused: of it nothing could be said to hold."""

import os
import shutil
from pathlib import Path

import pytest

from dzdesign.core.errors import InputError
from dzdesign.verify.folder import check_firmware_inside, read_firmware_manifest
from tests.support.attacked_firmware import add


@pytest.fixture
def folder(tmp_path):
    for name in ("compensator.json", "core/dz_comp.c", "board/my.c"):
        add(tmp_path, name)
    return tmp_path


@pytest.mark.parametrize("name", ["core/dz_comp.c", "board/my.c"])
def test_a_file_without_permission_is_refused(folder, monkeypatch, name):
    allowed = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: allowed(path, mode) and not str(path).endswith(name))
    with pytest.raises(InputError, match=f"{name}' can't be read"):
        check_firmware_inside(folder)


def test_a_folder_without_permission_is_refused_and_not_passed_over(folder, monkeypatch):
    listed = os.scandir

    def scandir(path):
        if str(path).endswith("board"):
            raise PermissionError(13, "Permission denied", str(path))
        return listed(path)

    monkeypatch.setattr(os, "scandir", scandir)
    with pytest.raises(InputError, match="board' can't be read: Permission denied"):
        check_firmware_inside(folder)


@pytest.mark.skipif(os.name != "posix", reason="names are bytes")
@pytest.mark.parametrize("place", ["core", "board"])
def test_a_name_that_is_no_text_is_refused(folder, place):
    try:
        (folder / place / os.fsdecode(b"my\xff.c")).touch()
    except OSError:
        pytest.skip("this file system takes no such name")
    with pytest.raises(InputError, match=r"my\?\.c' has a name that is no text"):
        check_firmware_inside(folder)


def enlarge(path: Path, octets: int = 1 << 40) -> None:
    """Make a file huge that takes no room on the disk."""
    with open(path, "r+b" if path.exists() else "xb") as file:
        file.truncate(octets)


@pytest.mark.skipif(os.name == "nt", reason="such a file takes room there")
@pytest.mark.parametrize("name", ["compensator.json", "f28335/more.h"])
def test_a_file_larger_than_any_of_dzdesign_is_refused_before_it_is_read(firmware_folder, tmp_path, name):
    folder = tmp_path / "enlarged"
    shutil.copytree(firmware_folder, folder)
    enlarge(folder / name, 1 << 29)
    with pytest.raises(InputError, match=f"{name}.* is larger than 16 MiB"):
        read_firmware_manifest(folder)
