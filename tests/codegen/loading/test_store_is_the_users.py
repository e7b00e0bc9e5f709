"""The memory's functions are the user's to fill in: what else a firmware of block form has is generated as it is."""

from dzdesign.codegen.loading.protocol import LOAD_FILES, STORE
from dzdesign.codegen.project import generate, write_firmware
from tests.support.loading.files import compensator


def test_only_the_store_is_a_board_file_and_stays_as_it_was_changed(tmp_path):
    firmware = generate(compensator(), "f28335", "block")
    board = {path for path in firmware.manifest.board if path != "f28335/dzdesign.projectspec"}
    assert board == {f"f28335/{name}" for name in STORE}
    write_firmware(firmware, tmp_path / "fw")
    assert {f"f28335/{name}" for name in LOAD_FILES} <= firmware.files.keys()
    path = tmp_path / "fw" / "f28335" / "dz_store.c"
    ours = path.read_text("utf-8").replace("Two copies", "OUR FLASH: two copies")
    path.write_text(ours, encoding="utf-8")
    assert "dz_store.c" in write_firmware(firmware, tmp_path / "fw").note
    assert path.read_text("utf-8") == ours


def test_the_fixed_form_and_targets_without_a_line_have_none_of_it():
    for target, form in (("f28335", "fixed"), ("host", "block")):
        files = generate(compensator(), target, form).files
        assert not {path for path in files if path.rpartition("/")[2] in LOAD_FILES}
