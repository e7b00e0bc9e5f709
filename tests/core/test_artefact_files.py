"""Artefact files: written whole or not at all, nothing of anybody's lost, and documents checked key by key."""

import json
import os
import stat
import sys
from pathlib import Path

import pytest

from dzdesign.core.artefact_files import (
    MANIFEST_NAME,
    check_file_may_be_written,
    check_folder_may_be_written,
    write_file,
    write_folder,
)
from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import InputError, one_line
from dzdesign.core.units import parse_quantity, si_factor

FIRMWARE, EVIDENCE = {"schema": "dzdesign.firmware/1"}, {"schema": "dzdesign.evidence/1"}
FILES = {"core/a.c": "int a;\n", "README.md": "read me\n"}


def tree(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()
    }


@pytest.fixture
def folder(tmp_path):
    """A firmware folder as dzdesign leaves it."""
    folder = tmp_path / "firmware"
    write_folder(folder, FILES, FIRMWARE)
    return folder


def test_a_file_is_written_in_utf_8(tmp_path):
    write_file(tmp_path / "valve.json", "Δp\n")
    assert (tmp_path / "valve.json").read_bytes() == "Δp\n".encode()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no modes")
@pytest.mark.parametrize(("umask", "file", "inside"), [(0o022, 0o644, 0o755), (0o027, 0o640, 0o750), (0, 0o666, 0o777)])
def test_modes_follow_the_umask_for_files_and_folders_alike(tmp_path, umask, file, inside):
    before = os.umask(umask)
    try:
        write_file(tmp_path / "valve.json", "{}")
        write_folder(tmp_path / "firmware", FILES, FIRMWARE)
        write_folder(tmp_path / "firmware", FILES, FIRMWARE)
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "valve.json").stat().st_mode) == file
    for path in [tmp_path / "firmware", *(tmp_path / "firmware").rglob("*")]:
        assert stat.S_IMODE(path.stat().st_mode) == (inside if path.is_dir() else file), path


@pytest.mark.parametrize("name", ["", "missing/valve.json", "file/valve.json", "x" * 300, "a\0b"])
def test_a_place_where_no_file_can_go(tmp_path, name):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="-o"):
        write_file(tmp_path / name, "text")
    assert tree(tmp_path) == {"file": b""}


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no device files")
def test_a_device_is_not_replaced_by_a_file(wording):
    with pytest.raises(InputError) as caught:
        write_file(Path(os.devnull), "text")
    wording("artefact files: a device", str(caught.value))
    assert not Path(os.devnull).is_file()


def test_an_artefact_takes_the_place_of_its_own_kind_only(tmp_path, wording):
    path = tmp_path / "out.json"
    for content in ("time_s,u_V\n", "[1]", '{"schema": "dzdesign.compensator/1"}', '{"schema": "valve"}', "[" * 5000):
        path.write_text(content)
        with pytest.raises(InputError) as caught:
            write_file(path, "{}", "dzdesign.valve/1")
        wording("artefact files: a file of another kind", str(caught.value))
        assert path.read_text() == content
    for content in ("", '{"schema": "dzdesign.valve/1"}', '{"schema": "dzdesign.valve/2"}'):
        path.write_text(content)
        check_file_may_be_written(path, "dzdesign.valve/1")


def test_a_folder_is_written_with_the_hash_of_every_file(folder):
    manifest = json.loads((folder / MANIFEST_NAME).read_text())
    assert set(manifest["files"]) == set(FILES) and manifest["schema"] == FIRMWARE["schema"]
    assert {name: text.encode() for name, text in FILES.items()}.items() <= tree(folder).items()


def test_a_folder_written_again_drops_what_it_no_longer_has(folder):
    write_folder(folder, {"README.md": "new\n"}, FIRMWARE)
    assert set(tree(folder)) == {"README.md", MANIFEST_NAME}
    assert [path.name for path in folder.parent.iterdir()] == ["firmware"]


def test_what_a_person_added_stays(folder):
    (folder / "core" / "notes.txt").write_text("mine")
    (folder / "build" / "empty").mkdir(parents=True)
    (folder / ".git" / "refs" / "heads").mkdir(parents=True)
    linked = hasattr(os, "symlink") and sys.platform != "win32"
    if linked:
        (folder / "link").symlink_to("core")
        (folder / "dangling").symlink_to("nowhere")
    write_folder(folder, {**FILES, "README.md": "new\n"}, FIRMWARE)
    assert (folder / "core" / "notes.txt").read_text() == "mine"
    assert (folder / "README.md").read_text() == "new\n"
    assert (folder / "build" / "empty").is_dir() and (folder / ".git" / "refs" / "heads").is_dir()
    assert not linked or ((folder / "link").is_symlink() and os.readlink(folder / "dangling") == "nowhere")


def test_what_a_person_changed_is_not_overwritten(folder, wording):
    (folder / "core" / "a.c").write_text("int a = 1;\n")
    before = tree(folder)
    with pytest.raises(InputError) as caught:
        write_folder(folder, FILES, FIRMWARE)
    wording("artefact files: a file that was changed", str(caught.value))
    assert tree(folder) == before


def test_an_added_file_in_the_place_of_a_new_one_is_not_overwritten(folder, wording):
    (folder / "new.c").write_text("mine")
    before = tree(folder)
    with pytest.raises(InputError) as caught:
        write_folder(folder, {**FILES, "new.c": "theirs"}, FIRMWARE)
    wording("artefact files: a file where a new one goes", str(caught.value))
    assert tree(folder) == before
    assert [path.name for path in folder.parent.iterdir()] == ["firmware"]


def test_a_folder_of_another_kind_is_not_replaced(folder, wording):
    before = tree(folder)
    with pytest.raises(InputError) as caught:
        write_folder(folder, {"verification.json": "{}"}, EVIDENCE)
    wording("artefact files: a folder of another kind", str(caught.value))
    assert tree(folder) == before


@pytest.mark.parametrize(
    "manifest", [None, "no JSON", "[]", '{"schema": "other/1", "files": {}}', '{"schema": "dzdesign.x/1"}', "[" * 5000]
)
def test_a_folder_that_is_not_ours_is_left_alone(tmp_path, manifest, wording):
    (tmp_path / "thesis.tex").write_text("years of work")
    if manifest is not None:
        (tmp_path / MANIFEST_NAME).write_text(manifest)
    before = tree(tmp_path)
    with pytest.raises(InputError) as caught:
        write_folder(tmp_path, FILES, FIRMWARE)
    wording("artefact files: a folder that dzdesign did not make", str(caught.value))
    assert tree(tmp_path) == before


@pytest.mark.parametrize("name", ["file", "file/below", "file/below/deep", "x" * 300, "a\0b"])
def test_a_place_where_no_folder_can_go(tmp_path, name):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="-o"):
        write_folder(tmp_path / name, FILES, FIRMWARE)
    if "\0" not in name:  # the others are known before anything is computed
        with pytest.raises(InputError, match="-o"):
            check_folder_may_be_written(tmp_path / name)
    assert tree(tmp_path) == {"file": b""}


def test_an_empty_folder_may_be_written_and_parents_are_made(tmp_path):
    (tmp_path / "empty").mkdir()
    for name in ("empty", "a/b/c"):
        write_folder(tmp_path / name, FILES, FIRMWARE)
        assert (tmp_path / name / "core" / "a.c").is_file()


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege on Windows")
def test_a_link_to_a_folder_stays_a_link(folder):
    link = folder.parent / "link"
    link.symlink_to(folder, target_is_directory=True)
    write_folder(link, {"README.md": "new\n"}, FIRMWARE)
    assert link.is_symlink() and (folder / "README.md").read_text() == "new\n"


@pytest.mark.parametrize("name", ["nowhere", "file/below", ".", "a\0b"])
def test_a_file_that_cannot_be_read(tmp_path, name, wording):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError) as caught:
        read_bytes(tmp_path / name, "ramp file")
    wording(f"artefact files: reading {name!r}", str(caught.value))


@pytest.mark.parametrize(
    ("text", "quantity", "si"),
    [
        ("1 MPa", "pressure", 1e6),
        ("1MPa", "pressure", 1e6),
        ("1,5 bar", "pressure", 1.5e5),
        ("2.000 bar", "pressure", 2e5),
        ("0,125 bar", "pressure", 0.125e5),
        ("1,2500 bar", "pressure", 1.25e5),
        ("1e-5 m3/s", "flow", 1e-5),
        ("1 m³/h", "flow", 1 / 3600),
        ("3600 LPH", "flow", 1e-3),
        ("2 Bar", "pressure", 2e5),
        ("1 psig", "pressure", 6894.757293168361),
        ("1 psid", "pressure", 6894.757293168361),
        ("1 bar(g)", "pressure", 1e5),
        ("6 ltr/min", "flow", 1e-4),
        ("1 PSI", "pressure", 6894.757293168361),
        ("6e1 l/min", "flow", 1e-3),
        (".1 s", "time", 0.1),
        ("100 ms", "time", 0.1),
        ("1.8 mm", "length", 1.8e-3),
        ("50 %", "ratio", 0.5),
        ("-1 V", "voltage", -1.0),
    ],
)
def test_quantities(text, quantity, si):
    assert parse_quantity(text, quantity, "--option") == pytest.approx(si, rel=1e-12)


@pytest.mark.parametrize(
    "text", ["", "V", "ten V", "1", "1e", "1.2.3 V", "inf V", "nan V", "1e999 V", "1 A", "1 V V", "²"]
)
def test_quantities_that_are_none(text):
    with pytest.raises(InputError, match="--option is '"):
        parse_quantity(text, "voltage", "--option")


@pytest.mark.parametrize("text", ["2,000 V", "-12,345V"])
def test_a_comma_before_three_digits_may_stand_between_thousands(text, wording):
    with pytest.raises(InputError) as caught:
        parse_quantity(text, "voltage", "--option")
    wording(f"quantity: {text}", str(caught.value))


@pytest.mark.parametrize("unit", ["9**9**9**9", "V**9**9**9**9", "V" * 10_000, "(V)", "V; import os", "", "1 V"])
def test_a_unit_is_a_name_and_not_a_computation(unit):
    with pytest.raises(InputError, match="is not a unit of voltage") as caught:
        si_factor(unit, "voltage")
    assert len(str(caught.value)) < 200


def test_a_message_stays_on_its_line():
    assert one_line("a\nb\rc\x1b[2Jd\u2028e\ud800f°Δ") == "a b c [2Jd e f°Δ"
