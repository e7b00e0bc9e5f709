"""`identify --from` and `--to`, and what `-v` and valve.json say of what was left out."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from corpus import cases, write

from dzdesign import api
from dzdesign.command_line.cli import main
from tests.support import bench_recordings as bench

CASES = {case.name: case for case in cases()}


@pytest.fixture
def recording(tmp_path, monkeypatch):
    """Two ramps with the pump off from 49 to 69 s."""
    monkeypatch.chdir(tmp_path)
    (path,) = write(CASES["rest_pump_off_between"], 909, tmp_path)
    return path.name


def left_out():
    (test,) = json.loads(Path("valve.json").read_text())["sides"]["positive"]["tests"]
    return test["ramps"], [
        (part["reason"], round(part["from_s"], 1), round(part["to_s"], 1)) for part in test["left_out"]
    ]


def test_a_part_is_read_and_the_rest_said(recording, capsys):
    assert main(["identify", recording, "--from", "60 s", "-v"]) == 0
    ramps, parts = left_out()
    assert ramps == [recording] and parts[0] == ("option", 0.0, 60.0)
    assert [part[0] for part in parts] == ["option", "pressure"]
    assert f"'{recording}', 0.0 to 60.0 s left out" in capsys.readouterr().err


def test_without_them_the_rest_is_found(recording, capsys):
    assert main(["identify", recording]) == 0
    ramps, parts = left_out()
    assert len(ramps) == 2 and parts == [("pressure", 49.0, pytest.approx(70.5, abs=0.5))]
    assert "left out" not in capsys.readouterr().err


def test_tables_name_recordings_or_patterns(recording):
    Path("options.toml").write_text('to = "48 s"\n[from]\n"rest_*.csv" = "1000 ms"\n')
    assert main(["identify", recording, "--config", "options.toml"]) == 0
    assert left_out()[1] == [("option", 0.0, 1.0), ("option", 48.0, 124.0)]


def test_the_command_line_goes_before_the_file(recording):
    Path("options.toml").write_text('from = "1 s"\n')
    assert main(["identify", recording, "--config", "options.toml", "--from", "2 s"]) == 0
    assert left_out()[1][0] == ("option", 0.0, 2.0)


def test_python_writes_it_with_an_underscore(recording):
    assert api.identify(recording, from_="60 s").positive.tests[0].left_out[0].reason == "option"


@pytest.mark.parametrize(
    ("options", "file", "says"),
    [
        (["--from", "600 s"], "", ["runs from 0.0 to 124.0 s", "--from 600 s", "0 rows"]),
        (["--from", "60"], "", ["--from is '60' without a unit"]),
        ([], 'from = "60"', ["'options.toml': from is '60' without a unit", 'from = "60 s"']),
        ([], '[to]\n"rest.csv" = "60 s"', ["[to] names 'rest.csv'"]),
        (["--from", "60 s", "--to", "50 s"], "", ["--from 60 s and --to 50 s", "0 rows"]),
        (["--from", "110 s"], "", ["--from 110 s cuts a ramp at 110.0 s", "not at rest"]),
        (["--to", "8 s"], "", ["--to 8 s cuts a ramp at 8.0 s", "not at rest"]),
        (["--from", "40 MPa"], "", ["--from"]),
    ],
)
def test_what_leaves_nothing_is_refused(options, file, says, recording, capsys):
    Path("options.toml").write_text(file)
    assert main(["identify", recording, *options, "--config", "options.toml"]) == 2
    error = capsys.readouterr().err
    assert all(words in error for words in says) and not Path("valve.json").exists()


@pytest.mark.parametrize(
    ("from_", "says"),
    [
        ("600 s", ": from_ 600 s leaves 0 rows"),
        ("60", "from_ is '60' without a unit"),
        ({"rest.csv": "60 s"}, "from_ names 'rest.csv'"),
        ({"rest*.csv": "60"}, "from_ 'rest*.csv' is '60' without a unit"),
    ],
)
def test_messages_in_python_name_its_keyword(recording, from_, says):
    with pytest.raises(api.InputError) as caught:
        api.identify(recording, from_=from_)
    assert says in str(caught.value) and "[from]" not in str(caught.value) and "--" not in str(caught.value)


@pytest.mark.parametrize("cut", [{"from_": "20 s"}, {"to": "30 s"}, {"from_": "1 s", "to": "100 s"}])
def test_a_cut_within_a_ramp_is_refused(recording, cut, wording, request):
    """A knee would be laid through what is left of it."""
    with wording.refusal(api.InputError, f"parts of recordings: {' '.join(cut)}"):
        api.identify(recording, **cut)


def test_ramps_without_a_rest_between_them_can_be_parted(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    taken = [bench.record(bench.Valve(), seed=seed, rate_Hz=20.0, hold_s=0.0) for seed in range(2)]
    length = taken[0].time[-1]
    time = np.concatenate([test.time + place * (length + 0.05) for place, test in enumerate(taken)])
    u, q, dp = (np.concatenate([getattr(test, name) for test in taken]) for name in ("u", "q", "dp"))
    bench.write(tmp_path / "two.csv", replace(taken[0], time=time, u=u, q=q, dp=dp))
    assert main(["-q", "identify", "two.csv", "--from", f"{length:.2f} s", "--meter-lag", "0 s +- 0.01 s"]) == 0
    (test,) = json.loads(Path("valve.json").read_text())["sides"]["positive"]["tests"]
    assert len(test["ramps"]) == 1
    assert test["u_knee_falling_V"] == pytest.approx(bench.Valve().closing, abs=0.003)
