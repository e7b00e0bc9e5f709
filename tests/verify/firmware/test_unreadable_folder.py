"""What can't be looked at in a firmware folder is refused: of it nothing could be said to hold."""

import os

import pytest

from dzdesign.core.errors import InputError
from dzdesign.verify.firmware.folder import check_firmware_inside
from tests.support.attacked_firmware import add


@pytest.fixture
def folder(tmp_path):
    for name in ("compensator.json", "core/dz_comp.c", "board/my.c"):
        add(tmp_path, name)
    return tmp_path


def test_a_folder_that_can_be_read_is_taken(folder):
    check_firmware_inside(folder)


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
@pytest.mark.parametrize("place", ["core", "board", "."])
def test_a_name_that_is_no_text_is_refused(folder, place):
    try:
        (folder / place / os.fsdecode(b"my\xff.c")).touch()
    except OSError:
        pytest.skip("this file system takes no such name")
    with pytest.raises(InputError, match=r"my\?\.c' has a name that is no text"):
        check_firmware_inside(folder)
