"""`identify --from` and `--to`, and what `-v` and valve.json say of what was left out."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from corpus import cases, write

import dzdesign.identify.ramps.cut_ramps
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
        (["--from", "110 s"], "", ["--from 110 s leaves no whole branch", "ramp 1, ", "; ramp 2, ", "at rest"]),
        (["--to", "8 s"], "", ["--to 8 s leaves no whole branch", "ramp 1, ", "; ramp 2, ", "at rest"]),
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


def cut_ramps(capsys) -> list[str]:
    capsys.readouterr()
    warnings = json.loads(Path("valve.json").read_text())["warnings"]
    return [each["text"] for each in warnings if each["code"] == "cut-ramp"]


class TestCutRamps:
    @staticmethod
    def three(tmp_path: Path, dp_MPa: float = 1.0, source: str = "three.csv") -> str:
        """Write three ramps, 30 s up and 30 s down, each with rests of 3 s before and after it."""
        taken = [bench.record(bench.Valve(), dp_MPa, seed=seed, rate_Hz=20.0, hold_s=10.0) for seed in range(3)]
        length = 0.3 * taken[0].time[-1]
        time = np.concatenate([0.3 * test.time + place * (length + 0.015) for place, test in enumerate(taken)])
        u, q, dp = (np.concatenate([getattr(test, name) for test in taken]) for name in ("u", "q", "dp"))
        return bench.write(tmp_path / source, replace(taken[0], time=time, u=u, q=q, dp=dp))

    @pytest.fixture
    def name(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        return Path(self.three(tmp_path)).name

    @pytest.mark.parametrize(
        ("options", "ramps", "lost"),
        [
            (["--from", "20 s"], 3, "ramp 1, 3.3 to 63.3 s (rising)"),
            (["--from", "50 s"], 2, "ramp 1, 3.3 to 63.3 s (rising and falling)"),
            (["--to", "150 s"], 2, "ramp 3, 136.5 to 196.5 s (rising and falling)"),
            (["--to", "180 s"], 3, "ramp 3, 136.5 to 196.5 s (falling)"),
            (["--from", "1 s", "--to", "66 s"], 1, ""),
            (["--from", "3.6 s"], 3, ""),
            (["--from", "6 s", "--to", "134 s"], 2, ""),
        ],
    )
    def test_the_whole_ones_count_and_the_cut_one_is_named(self, name, options, ramps, lost, capsys):
        known = ["--meter-lag", "0 s +- 0.01 s", "--repeatability", "0.1 %"]
        assert main(["-q", "identify", name, *options, *known]) == 0
        texts = cut_ramps(capsys)
        assert [lost in text for text in texts] == ([True] if lost else [])
        (test,) = json.loads(Path("valve.json").read_text())["sides"]["positive"]["tests"]
        assert len(test["ramps"]) == ramps
        assert test["u_knee_rising_V"] == pytest.approx(bench.Valve().opening, abs=0.003)
        assert test["u_knee_falling_V"] == pytest.approx(bench.Valve().closing, abs=0.003)

    def test_one_side_of_two(self, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        taken = [bench.record(bench.Valve(), seed=1, rate_Hz=20.0, sign=sign) for sign in (1, -1, 1, -1)]
        time = np.concatenate([test.time + 210.0 * place for place, test in enumerate(taken)])
        u, q, dp = (np.concatenate([getattr(test, name) for test in taken]) for name in ("u", "q", "dp"))
        bench.write(tmp_path / "both.csv", replace(taken[0], time=time, u=u, q=q, dp=dp))
        assert main(["-q", "identify", "both.csv", "--from", "250 s", "--meter-lag", "0 s"]) == 0
        (text,) = cut_ramps(capsys)
        assert "ramp 1 (negative side), 215.0 to 414.9 s (rising)" in text
        sides = json.loads(Path("valve.json").read_text())["sides"]
        assert [len(sides[name]["tests"][0]["ramps"]) for name in ("positive", "negative")] == [1, 2]

    def test_a_branch_that_others_have_is_missing_by_them(self, name, tmp_path, wording):
        other = self.three(tmp_path, 4.0, "other.csv")
        with wording.refusal(api.InputError, "parts of recordings: one branch"):
            api.identify([name, other], to={name: "40 s"})

    def test_nothing_left(self, name, wording):
        with wording.refusal(api.InputError, "parts of recordings: nothing"):
            api.identify(name, from_="170 s")

    def test_the_warning(self, name, capsys, wording):
        assert main(["-q", "identify", name, "--from", "20 s"]) == 0
        wording("parts of recordings: cut", "\n".join(cut_ramps(capsys)))

    def test_a_check_that_sees_no_ramps(self, name, capsys, monkeypatch):
        """Seeded: then a fragment counts as a ramp, and nothing is said."""
        monkeypatch.setattr(dzdesign.identify.ramps.cut_ramps, "parts_of_ramps", lambda *_: [])
        assert main(["-q", "identify", name, "--from", "40 s"]) == 0
        assert not cut_ramps(capsys)
        (test,) = json.loads(Path("valve.json").read_text())["sides"]["positive"]["tests"]
        assert len(test["ramps"]) == 3
