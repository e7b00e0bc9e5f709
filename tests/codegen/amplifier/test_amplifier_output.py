"""`codegen --target amplifier`: the folder has the file that `export` writes, and its table what `export` prints."""

import csv
import io
import json

import pytest

from dzdesign import api
from dzdesign.codegen.other_targets import generate_output, settings_of
from dzdesign.command_line.cli import main
from dzdesign.core.artefact_types import to_json_bytes
from dzdesign.core.errors import InputError
from tests.support.golden_firmware import FULL, golden_compensator, golden_valve

BESIDE = {".gitattributes", "dead_zones.csv", "compensator.json"}


@pytest.fixture(scope="module")
def compensator():
    return api.design(golden_valve())


@pytest.fixture
def here(tmp_path, monkeypatch, compensator):
    """A folder with a compensator.json."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "compensator.json").write_bytes(to_json_bytes(compensator))
    return tmp_path


def output_of(compensator, **given):
    return generate_output(compensator, "amplifier", settings_of("amplifier", given))


def run(*words):
    return main(["codegen", "compensator.json", "--target", *words])


def test_the_folder_has_the_file_that_export_writes_and_is_the_same_again(here, capsys):
    for options in (
        ("--device", "west", "--threshold", "1 %"),
        ("--device", "csv", "--table-dp", "20 bar"),
    ):
        assert run("amplifier", *options, "-o", "made", "-q") == 0
        [name] = {path.name for path in (here / "made").iterdir()} - BESIDE - {"manifest.json"}
        before = {path.name: path.read_bytes() for path in (here / "made").iterdir()}
        assert run("amplifier", *options, "-o", "made", "-q") == 0
        assert before == {path.name: path.read_bytes() for path in (here / "made").iterdir()}
        assert main(["export", "compensator.json", "--to", *options[1:], "-o", f"alone_{name}", "-q"]) == 0
        assert (here / f"alone_{name}").read_bytes() == before[name]
        assert name == {"west": "west.txt", "csv": "csv.csv"}[options[1]]
    manifest = json.loads(before["manifest.json"])
    assert manifest["settings"] == {"device": "csv", "table_dp": "20 bar", "threshold": ""}
    assert set(manifest["files"]) == {"csv.csv"} | BESIDE
    assert "device csv, table-dp 20 bar" in capsys.readouterr().out


@pytest.mark.parametrize("device", ["west", "rmc75", "csv"])
def test_the_table_has_what_export_prints(device, compensator):
    files = output_of(compensator, device=device).files
    rows = list(csv.DictReader(io.StringIO(files["dead_zones.csv"].decode("ascii"))))
    exported = api.export(compensator, to=device).dead_zones
    expected = [(zone, branch) for zone in exported for branch in zone.fixed]
    assert len(rows) == len(expected) == 6
    for row, (zone, branch) in zip(rows, expected, strict=True):
        assert (row["side"], row["branch"], float(row["dp_MPa"])) == (zone.side, branch, zone.dp_MPa)
        assert float(row["dead_zone_fixed"]) == pytest.approx(zone.fixed[branch], abs=5.1e-7)
        assert float(row["dead_zone_law"]) == pytest.approx(zone.law[branch], abs=5.1e-7)


def test_both_sides_stand_in_the_table():
    both = golden_compensator(root=FULL)
    table = output_of(both, device="west").files["dead_zones.csv"].decode("ascii")
    counts = [2 * len(both.valve.sides[side].tests) for side in ("positive", "negative")]
    expected = ["positive"] * counts[0] + ["negative"] * counts[1]
    assert [line.partition(",")[0] for line in table.splitlines()[1:]] == expected and min(counts)


@pytest.mark.parametrize(
    "words",
    [
        ("amplifier",),
        ("amplifier", "--device", "wset"),
        ("amplifier", "--device", "csv", "--table-dp", "2"),
        ("amplifier", "--device", "west", "--threshold", "31 %"),
        ("matlab", "--device", "west"),
        ("f28335", "--threshold", "1 %"),
        ("iec61131", "--interface", "bar"),
        ("iec61131", "--vectors", "4000"),
        ("iec61130",),
    ],
    ids=" ".join,
)
def test_bad_input_is_one_sentence_and_nothing_is_written(words, here, capsys, wording):
    assert run(*words, "-o", "made") == 2
    printed = capsys.readouterr()
    assert not printed.out and printed.err.count("\n") == 1
    assert [path.name for path in here.iterdir()] == ["compensator.json"]
    wording(f"amplifier output: {' '.join(words)}", printed.err)


def test_another_option_is_named_where_it_chose_the_output():
    with pytest.raises(InputError, match="--outputs amplifier needs --device"):
        settings_of("amplifier", {}, "--outputs")
