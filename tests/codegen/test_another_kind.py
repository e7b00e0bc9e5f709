"""`codegen` over another kind of output asks for `--replace`, and says what is gone then."""

import pytest

from dzdesign import api
from dzdesign.codegen.fmu.files import note_of
from dzdesign.codegen.other_targets import generate_output, settings_of
from dzdesign.codegen.writing import write_generated
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from tests.support.golden_firmware import golden_valve


@pytest.fixture(scope="module")
def compensator():
    return api.design(golden_valve())


@pytest.fixture
def run(tmp_path, monkeypatch, compensator):
    """Return what runs `codegen` in a folder with a function block in plc."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "compensator.json").write_bytes(to_json_bytes(compensator))
    write_generated(generate_output(compensator, "iec61131", settings_of("iec61131", {})), tmp_path / "plc")
    return lambda *words: main(["codegen", "compensator.json", "--target", *words, "-o", "plc"])


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("words", [("matlab",), ("amplifier", "--device", "west")], ids=" ".join)
def test_another_kind_of_output_is_left_as_it_is(run, words, tmp_path, capsys, wording):
    before = contents(tmp_path / "plc")
    assert run(*words) == 2
    assert contents(tmp_path / "plc") == before
    wording(f"another kind of output: {' '.join(words)}", capsys.readouterr().err)


def test_with_replace_it_is_written_over_and_said(run, tmp_path, capsys):
    assert run("matlab", "--replace") == 0
    assert not (tmp_path / "plc" / "FB_DeadZone.st").exists() and (tmp_path / "plc" / "dz_comp.m").is_file()
    assert "what 'plc' held for iec61131 was replaced by this for matlab" in capsys.readouterr().err


def test_the_same_kind_with_other_settings_is_written_again(run, tmp_path):
    assert run("iec61131", "--dialect", "twincat") == 0
    assert (tmp_path / "plc" / "FB_DeadZone.TcPOU").is_file()


def test_fmus_without_a_plant_say_how_to_have_one(compensator):
    assert "--plant PLANT.toml" in note_of(compensator, {"plant": ""})
    assert note_of(compensator, {"plant": "{}"}) == ""
