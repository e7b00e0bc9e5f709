"""`dzdesign export`: an amplifier's file, the dead zones that are printed, what is refused and what is left alone."""

import io
import json
import re
from dataclasses import replace

import pytest
from rich.console import Console

from dzdesign import api
from dzdesign.codegen.amplifier.device import DEVICE_NAMES
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_reading import read_artefact
from dzdesign.core.documents import sha256_of
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import PressureUnit, RecordedUnits
from dzdesign.design.compensator import Compensator
from dzdesign.terminal.output_tables import print_export
from tests.support.paths import GOLDENS

#: Without the proof of the compensator's numbers, which takes a second.
UNPROVEN = ("dzdesign.design.redesign.prove_derived", lambda compensator: None)
FILES = {"west": "valve.txt", "cia408": "valve.dcf", "rmc75": "valve.rmc", "beckhoff": "valve.st", "csv": "valve.csv"}


@pytest.fixture(scope="module")
def compensator(tmp_path_factory):
    path = tmp_path_factory.mktemp("export") / "compensator.json"
    api.design(GOLDENS / "valve.json", output=path)
    return path


@pytest.fixture
def unproven(monkeypatch):
    monkeypatch.setattr(*UNPROVEN)


def run(*words):
    return main(["export", *map(str, words)])


def printed_shares(text):
    """Return the rows of the printed table: pressure drop and the shares behind it, of command."""
    rows = re.findall(r"^ +(\d+\.\d\d)((?: +\d+\.\d\d%)+)", text, flags=re.MULTILINE)
    return [(float(dp), [float(share) / 100 for share in re.findall(r"[\d.]+(?=%)", rest)]) for dp, rest in rows]


@pytest.mark.parametrize("device", FILES)
def test_what_is_printed_is_what_the_file_makes_of_the_valve(device, compensator, tmp_path, capsys, unproven):
    file = tmp_path / FILES[device]
    assert run(compensator, "--to", device, "-o", file, "-q") == 0
    printed = capsys.readouterr().out
    rows, exported = printed_shares(printed), api.export(compensator, to=device)
    assert len(rows) == len(exported.dead_zones) == 3
    for (dp_MPa, shares), zone in zip(rows, exported.dead_zones, strict=True):
        assert dp_MPa == pytest.approx(zone.dp_MPa, abs=0.006) and len(shares) == 4
        for share, branch in zip(shares, ("opening", "closing"), strict=False):
            assert share == pytest.approx(zone.fixed[branch], abs=1.1e-4)
    assert sha256_of(compensator.read_bytes()) in printed and f"Written: {file}" in printed
    assert exported.content == file.read_bytes()


def test_json_says_what_was_set_and_what_it_leaves(compensator, tmp_path, capsys, unproven):
    assert run(compensator, "--to", "west", "-o", tmp_path / "valve.txt", "--json", "-q") == 0
    found = json.loads(capsys.readouterr().out)
    lines = dict(line.split() for line in (tmp_path / "valve.txt").read_text().splitlines())
    assert {name: int(value) for name, value in lines.items()} == found["parameters"]
    assert found["unit"] == "0.01 %" and found["compensator_sha256"] == sha256_of(compensator.read_bytes())
    assert [set(row["fixed"]) for row in found["dead_zones"]] == [{"opening", "closing"}] * 3


def test_without_a_file_nothing_is_written(compensator, tmp_path, monkeypatch, capsys, unproven):
    monkeypatch.chdir(tmp_path)
    assert run(compensator, "--to", "csv") == 0
    assert "Nothing is written" in capsys.readouterr().out and not any(tmp_path.iterdir())


def test_its_own_file_is_written_again_and_another_is_left_alone(compensator, tmp_path, capsys, unproven):
    for name, (device, file) in enumerate(FILES.items()):
        path = tmp_path / file
        assert run(compensator, "--to", device, "-o", path, "-q") == 0
        assert run(compensator, "--to", device, "-o", path, "-q", "--json") == 0
        path.write_text(f"time_s,u_V\n{name},1\n")
        assert run(compensator, "--to", device, "-o", path) == 2
        assert path.read_text() == f"time_s,u_V\n{name},1\n"
    assert "is left alone" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("--to", "wset"),
        ("--to", "rmc"),
        ("--to", "west", "--table-dp", "1 MPa"),
        ("--to", "csv", "--table-dp", "1 kg"),
        ("--to", "csv", "--table-dp", "0.2 MPa"),
        ("--to", "west", "--threshold", "0.01"),
        ("--to", "west", "--threshold", "31 %"),
        ("--to", "beckhoff", "--threshold", "30 %", "-o", "no/such/folder.st"),
        ("--to", "west", "-o", "."),
    ],
    ids=" ".join,
)
def test_bad_input_is_one_sentence_and_nothing_is_written(
    words, compensator, tmp_path, monkeypatch, capsys, unproven, wording
):
    monkeypatch.chdir(tmp_path)
    file = () if "-o" in words else ("-o", "valve.out")
    assert run(compensator, *words, *file) == 2
    printed = capsys.readouterr()
    assert not printed.out and printed.err.count("\n") == 1 and not any(tmp_path.iterdir())
    wording(f"export: {' '.join(words)}", printed.err)


def test_a_compensator_whose_numbers_do_not_follow_is_refused(compensator, tmp_path, wording):
    document = json.loads(compensator.read_text())
    document["sides"]["positive"]["beta"][3] += 40
    changed = tmp_path / "compensator.json"
    changed.write_text(json.dumps(document))
    with wording.refusal(InputError, "export: a changed beta"):
        api.export(changed, to="west")


def test_a_larger_threshold_and_another_pressure_change_the_file(compensator, unproven):
    law = {text: api.export(compensator, to="beckhoff", table_dp=text).content for text in ("1 MPa", "30 bar")}
    assert law["1 MPa"] != law["30 bar"] == api.export(compensator, to="beckhoff", table_dp="3 MPa").content
    near, at = (api.export(compensator, to="csv", table_dp=text).content for text in ("5.04 MPa", "5 MPa"))
    assert near == at
    for device in ("west", "cia408", "beckhoff"):
        assert all(check.holds for check in api.export(compensator, to=device, threshold="0 %").checks)
    wide = api.export(compensator, to="west", threshold="2 %")
    assert wide.setting.parameters["TRIGGER"] == 200
    assert wide.dead_zones[0].fixed["opening"] > api.export(compensator, to="west").dead_zones[0].fixed["opening"]


def test_what_is_said_is_in_the_units_of_the_recordings(compensator, unproven):
    made = read_artefact(compensator.read_bytes(), Compensator, "compensator.json")
    units = RecordedUnits(pressure=PressureUnit(unit="bar", factor=10.0))
    in_bar = replace(made, valve=replace(made.valve, recorded_units=units))
    with pytest.raises(InputError, match="is 80 bar, outside the tests from 10 bar to 50 bar"):
        api.export(in_bar, to="csv", table_dp="80 bar")
    found = api.export(in_bar, to="csv")
    assert "above 50.0 bar" in found.notes[0]
    console = Console(file=io.StringIO(), width=200)
    print_export(found, console)
    assert "from 10.0 to 50.0 bar" in console.file.getvalue() and "dP (bar)" in console.file.getvalue()


def test_every_device_stands_in_the_help(capsys):
    with pytest.raises(SystemExit):
        run("--help")
    words = capsys.readouterr().out.split()
    assert all(any(word.strip(".,") == name for word in words) for name in DEVICE_NAMES)
