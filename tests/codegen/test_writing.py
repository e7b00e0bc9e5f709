"""`codegen` over the firmware of another design, or another kind of output, asks for `--replace` and says what goes."""

import json
from dataclasses import replace

import pytest

from dzdesign import api
from dzdesign.codegen.fmu.files import note_of
from dzdesign.codegen.other_targets import generate_output, settings_of
from dzdesign.codegen.project import generate
from dzdesign.codegen.writing import write_generated
from dzdesign.command_line.cli import main
from dzdesign.core import artefact_files
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.documents import to_json
from dzdesign.core.errors import InputError
from dzdesign.design.compensator import Compensator
from tests.support.golden_firmware import golden_valve
from tests.support.paths import GOLDENS_FULL
from tests.support.synthetic import with_side

#: A valve with both sides, and options of a drive for both with 4-20 mA sensors.
BOTH_SIDES = GOLDENS_FULL / "valve.json"
BIPOLAR = (
    "--command-signal=-10..10 V x 0.15 + 1.5 V", "--command-error", "1.9 % + 1 code",
    "--pressure-a", "4..20 mA on 120 ohm = 25 MPa", "--pressure-b", "4..20 mA on 120 ohm = 25 MPa",
)  # fmt: skip


@pytest.fixture
def valve_file(example_valve, tmp_path):
    path = tmp_path / "valve.json"
    path.write_bytes(to_json_bytes(example_valve))
    return path


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def codegen(capsys, tmp_path):
    """Run `design`, and `codegen` into one folder; returns its status and what it says beside the files."""

    def run(source, *options, replace=()):
        made = str(tmp_path / "compensator.json")
        assert main(["design", str(source), "-o", made, *options]) == 0
        capsys.readouterr()
        status = main(["codegen", made, "--target", "host", "-o", str(tmp_path / "firmware"), *replace])
        return status, capsys.readouterr().err

    return run


def test_the_default_design_does_not_go_over_a_bipolar_one(codegen, tmp_path):
    """Seeded: a firmware for two solenoids, then of the same valve for one into the same folder."""
    status, said = codegen(BOTH_SIDES, *BIPOLAR)
    assert status == 0 and "left out" not in said
    before = contents(tmp_path / "firmware")
    one = ("--command-signal", "0..10 V x 0.3")
    status, said = codegen(BOTH_SIDES, *one)
    assert status == 2 and contents(tmp_path / "firmware") == before
    assert "two solenoids, this one one solenoid" in said and "--command-signal '-10..10 V" in said
    assert "--replace" in said and "-o" in said
    status, said = codegen(BOTH_SIDES, *one, replace=["--replace"])
    assert status == 0 and "warning: the valve's negative side is left out" in said
    assert "dz_comp_negative" not in (tmp_path / "firmware/core/dz_comp.h").read_text()
    assert codegen(BOTH_SIDES, *one)[0] == 0  # now it is the same design


def test_another_option_is_named(valve_file, codegen, tmp_path):
    assert codegen(valve_file, "--guard", "mean")[0] == 0
    before = contents(tmp_path / "firmware")
    status, said = codegen(valve_file)
    assert status == 2 and "with --guard 'mean', this one with --guard 'closing'" in said
    assert contents(tmp_path / "firmware") == before


def test_another_valve_is_named(example_compensator, tmp_path):
    write_generated(generate(example_compensator, "host"), tmp_path / "firmware")
    other = replace(example_compensator.valve, made_from=example_compensator.valve.made_from[:2])
    with pytest.raises(InputError, match="its valve is another one"):
        write_generated(generate(replace(example_compensator, valve=other), "host"), tmp_path / "firmware")


def test_other_numbers_of_the_same_options_are_another_design(example_compensator, tmp_path):
    write_generated(generate(example_compensator, "host"), tmp_path / "firmware")
    beta = tuple(max(value - 1, 1) for value in example_compensator.positive.beta)
    with pytest.raises(InputError, match="its sides is another"):
        write_generated(generate(with_side(example_compensator, beta=beta), "host"), tmp_path / "firmware")


def test_the_same_design_is_written_again_also_of_another_version_and_for_another_target(example_compensator, tmp_path):
    firmware = generate(example_compensator, "host")
    write_generated(firmware, tmp_path / "firmware")
    write_generated(firmware, tmp_path / "firmware")
    older = json.loads(to_json_bytes(example_compensator))
    older["tool"]["version"] = "0.0.9"
    older = read_artefact(to_json(older).encode(), Compensator, "compensator.json")
    write_generated(generate(older, "host"), tmp_path / "older")
    write_generated(firmware, tmp_path / "older")
    note = write_generated(generate(example_compensator, "cortex-m4"), tmp_path / "older").note
    assert "was replaced by this for cortex-m4" in note


def test_a_firmware_whose_compensator_is_gone_is_not_written_over(example_compensator, tmp_path):
    firmware = generate(example_compensator, "host")
    write_generated(firmware, tmp_path / "firmware")
    (tmp_path / "firmware/compensator.json").unlink()
    with pytest.raises(InputError, match="can't be read"):
        write_generated(firmware, tmp_path / "firmware")
    write_generated(firmware, tmp_path / "firmware", over_another=True)
    assert (tmp_path / "firmware/compensator.json").is_file()


def test_of_two_at_once_the_later_one_does_not_go_over_the_other(example_compensator, tmp_path, monkeypatch):
    """Between the look into the folder and the writing another process writes its design there."""
    folder, ours = tmp_path / "firmware", generate(example_compensator, "host")
    other = replace(example_compensator, valve=replace(example_compensator.valve, record={"serial": "another"}))
    theirs = write_generated(generate(other, "host"), tmp_path / "theirs")
    monkeypatch.setattr(artefact_files, "bring_back", lambda _: (tmp_path / "theirs").rename(folder))
    with pytest.raises(InputError, match="holds another firmware"):
        write_generated(ours, folder)
    assert json.loads((folder / "manifest.json").read_text())["files"] == dict(theirs.manifest.files)


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
