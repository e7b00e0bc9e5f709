"""The main job as a user runs it, and that the same input gives the same bytes."""

import contextlib
import io
import json
import re
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from dzdesign.example import example_folder
from dzdesign.verify.requirements import AS_STATED, RAMPS
from tests.support.paths import ROOT
from tests.support.synthetic import needs_compiler

pytestmark = pytest.mark.slow

#: Every command at every difference of valid pressure codes, of either sign.
INPUTS = 4096 * (2 * (4014 - 688) + 1)
RECORD = ("--record", "valve = simulated by dzdesign, no measurement")


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """The folder of a demo, and what it printed."""
    folder, out = tmp_path_factory.mktemp("demo") / "out", io.StringIO()
    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(out):
        patch.setenv("COLUMNS", "80")
        assert main(["demo", str(folder)]) == 0
    return folder, out.getvalue()


@pytest.fixture(scope="module")
def demo(printed):
    return printed[0]


@needs_compiler
def test_demo_leaves_every_artefact_with_its_origin(demo):
    valve, compensator = (json.loads((demo / name).read_text()) for name in ("valve.json", "compensator.json"))
    evidence = json.loads((demo / "evidence" / "verification.json").read_text())
    assert valve["schema"] == "dzdesign.valve/1" and len(valve["made_from"]) == 18
    # The example shows how to record: nothing is left open that a bench can do about.
    assert not {warning["code"] for warning in valve["warnings"]} & {"assumed-scatter", "few-repeats", "order", "drift"}
    assert compensator["made_from"][0]["source"] == "valve.json"
    assert evidence["holds"] is True
    (again,) = [check for check in evidence["checks"] if check["id"] == RAMPS.id]
    assert again["holds"] is True and "in this run" in again["text"]
    assert [(each["inputs"], each["wrong"]) for each in evidence["inputs"]] == [(INPUTS, 0)]
    assert (demo / "evidence" / "closed_loop_positive.csv").read_text().startswith("time_s,command_percent,")


@needs_compiler
def test_demo_leaves_the_recordings_for_the_steps_of_the_tutorial(demo):
    bundled, left = example_folder(), demo / "example"
    names = {file.relative_to(bundled) for file in bundled.rglob("*") if file.is_file()}
    assert {file.relative_to(left) for file in left.rglob("*") if file.is_file()} == {*names, Path("manifest.json")}
    assert len(names) >= 20 and all((left / name).read_bytes() == (bundled / name).read_bytes() for name in names)


@needs_compiler
def test_demo_prints_the_table_and_where_things_are(printed):
    demo, out = printed
    for words in (
        "opens without (%)",
        "flow at zero (L/min)",
        f"{INPUTS} inputs checked, 0 wrong",
        "the certificate covers the valve as recorded and the declared machine",
    ):
        assert words in out
    assert f"Open first: {demo}/evidence/report.html" in out and AS_STATED not in out
    assert (demo / "evidence/report.html").is_file()
    # What README.md says of the example in words.
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    assert sum(len(line) // 80 + 1 for line in out.splitlines()) <= 24  # one screen
    rows = re.findall(r"^ +\d\.\d\d +([\d.]+) +([\d.]+) ", out, re.MULTILINE)
    without, left = zip(*(map(float, row) for row in rows), strict=True)
    assert len(rows) == 6 and all(45 < share < 55 for share in without) and {round(share) for share in left} == {1}
    assert "the first half of the command gives no flow" in readme
    assert "flow starts at about 1 % of full command" in readme
    assert f"all {round(INPUTS / 1e6)} million inputs" in readme


@needs_compiler
def test_the_chain_of_commands_gives_the_same_bytes_as_the_demo(demo, example_folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    ramps = sorted(str(path) for path in (example_folder / "ramps").glob("*.csv.gz"))
    assert main(["identify", *ramps, "--meter-lag", "0.1 s", "--meter-floor", "0.6 L/min", *RECORD]) == 0
    assert main(["design", "valve.json", "--amplifier", "2 %"]) == 0
    assert main(["codegen", "compensator.json", "--target", "f28335"]) == 0
    assert (tmp_path / "valve.json").read_bytes() == (demo / "valve.json").read_bytes()
    assert (tmp_path / "firmware/manifest.json").read_bytes() == (demo / "firmware/manifest.json").read_bytes()
    assert "No such" not in capsys.readouterr().err


def test_example_is_marked_as_simulated_and_can_be_made_again(example_folder):
    import gzip

    from dzdesign.verify.closed_loop.plant import read_plant

    manifest = json.loads((example_folder / "ramps" / "manifest.json").read_text())
    assert manifest["simulated"] is True
    assert manifest["plant"] == asdict(read_plant(example_folder / "plant.toml"))
    for path in (example_folder / "ramps").glob("*.csv.gz"):
        assert gzip.decompress(path.read_bytes()).startswith(b"# SIMULATED")


@needs_compiler
def test_simulate_same_seed_same_bytes(tmp_path, example_folder):
    from dzdesign.identify.reading.ramp_files import read_ramp_file

    arguments = ["--dp", "1 MPa", "--ramp-time", "100 s", "--plant", str(example_folder / "plant.toml")]
    arguments += ["--repeats", "3", "--repeatability", "0.05 %"]
    assert main(["simulate", "-o", str(tmp_path / "again"), *arguments]) == 0
    for number in (1, 2, 3):
        again = read_ramp_file(tmp_path / "again" / f"ramp_dP1_{number}.csv.gz")
        bundled = read_ramp_file(example_folder / "ramps" / f"ramp_dP1_{number}.csv.gz")
        # Another compiler may round the last bit of the plant differently; the file has four decimals.
        assert abs(again.q - bundled.q).max() < 2e-4 / 60000


def test_the_series_is_in_random_order_and_its_time_stamps_tell_it(example_folder):
    from dzdesign.identify.reading.ramp_files import read_ramp_file

    ramps = [read_ramp_file(path) for path in sorted((example_folder / "ramps").glob("*.csv.gz"))]
    assert len(ramps) == 18
    ramps.sort(key=lambda ramp: ramp.started)
    pressures = [round(2e-6 * float(ramp.dp[:50].mean())) / 2 for ramp in ramps]
    assert sorted(pressures) == sorted([0.5, 1, 2, 3, 4, 5] * 3)
    assert abs(np.corrcoef(pressures, np.arange(18))[0, 1]) < 0.5
    ends = [ramp.started + ramp.time[-1] for ramp in ramps]
    assert all(after.started - end == pytest.approx(60, abs=1) for end, after in zip(ends, ramps[1:], strict=False))
