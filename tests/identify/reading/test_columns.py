"""Columns by the engineer's word, and pressure drops that are declared: `--columns`, `--dp`, the tables of a config."""

import json
from pathlib import Path

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.errors import InputError
from dzdesign.identify.reading.column_labels import parse_columns
from tests.dzdesign.command_line.test_bad_input import csv, ramp

LOGGER = "Zeit (ms),AO0,p1 - p2,Flow (L/min),u_V"


@pytest.fixture
def bench(tmp_path, monkeypatch, capsys):
    """A folder with one ramp test as it should be, and as a logger wrote it; a wrong u_V stands beside the command."""
    rows = ramp()
    (tmp_path / "plain.csv").write_text(csv(rows))
    zero = np.zeros(len(rows))
    logged = np.column_stack([1000 * rows[:, 0], rows[:, 1], 10 * rows[:, 2], rows[:, 3], zero])
    (tmp_path / "logger.csv").write_text(csv(logged, LOGGER))
    (tmp_path / "no_dp_1.csv").write_text(csv(rows[:, [0, 1, 3]], "time_s,u_V,Q_Lmin"))
    (tmp_path / "no_dp_4.csv").write_text(csv(ramp(4.0, knee=4.8)[:, [0, 1, 3]], "time_s,u_V,Q_Lmin"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def identified(*argv, status=0):
    assert main(["identify", *argv, "-o", "valve.json"]) == status
    return json.loads(Path("valve.json").read_text())["sides"]["positive"]["tests"]


def knees(tests):
    return [test[key] for test in tests for key in ("dp_MPa", "u_knee_rising_V", "u_knee_falling_V")]


def refusal(capsys, *argv):
    assert main(["identify", *argv]) == 2
    assert not Path("valve.json").exists()
    return capsys.readouterr().err


MAP = "time=Zeit (ms), u=AO0:V, dP=p1 - p2:bar, Q=Flow (L/min)"


def test_columns_are_taken_by_name_and_unit(bench):
    assert knees(identified("logger.csv", "--columns", MAP)) == pytest.approx(knees(identified("plain.csv")), abs=1e-3)


def test_columns_from_the_file_of_options(bench):
    config = 'columns = { t = "Zeit (ms)", u = "AO0:V", dP = "p1 - p2:bar", Q = "Flow (L/min)" }'
    for text in (config, f'columns = "{MAP}"'):
        Path("options.toml").write_text(text)
        found = knees(identified("logger.csv", "--config", "options.toml"))
        assert found == pytest.approx(knees(identified("plain.csv")), abs=1e-3)


def test_a_comma_or_a_colon_in_a_label_is_no_end_of_it():
    assert parse_columns("u=data(:,2):V; Q = a, b (L/min),dp=x") == {"u": "data(:,2):V", "Q": "a, b (L/min)", "dP": "x"}


@pytest.mark.parametrize("text", ["uu=AO0:V", "dP1=AO0:V", "AO0", "u=", "u=a:V,U=b:V"])
def test_what_is_no_map_of_columns(text, wording):
    with wording.refusal(InputError):
        parse_columns(text)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("u=A00:V", "has no column 'A00', which --columns names for u"),
        ("u=A00:V", "(did you mean 'AO0'?)"),
        ("u=AO0", "column 'AO0' has no unit; write for example --columns \"u=AO0:V\""),
        ("time=Zeit (ms),u=AO0:bar,Q=Flow (L/min)", "column 'AO0': 'bar' is not a unit of voltage"),
        ("time=Zeit (ms),u=AO0:V,Q=Flow (L/min):V", "column 'Flow (L/min)': 'V' is not a unit of flow"),
        ("u=AO0:V,pA=p1 - p2:bar,time=Zeit (ms)", "a column of pA but none of pB"),
    ],
)
def test_a_map_that_does_not_fit_the_file(bench, capsys, text, words):
    assert words in refusal(capsys, "logger.csv", "--columns", text)


def test_a_declared_pressure_drop_stands_in_for_the_column_and_is_said(bench):
    found = identified("no_dp_1.csv", "--dp", "10 bar")
    assert knees(found) == pytest.approx(knees(identified("plain.csv")), abs=1e-6)
    identified("no_dp_1.csv", "--dp", "10 bar")
    warnings = json.loads(Path("valve.json").read_text())["warnings"]
    assert "declared-pressure" in {warning["code"] for warning in warnings}


@pytest.mark.parametrize(
    "table", ['"no_dp_1.csv" = "1 MPa"\n"no_dp_4.csv" = "40 bar"', '"*_4.csv" = "4 MPa"\n"*" = "1 MPa"']
)
def test_pressure_drops_by_file_name(bench, table):
    Path("options.toml").write_text(f"[dp]\n{table}\n")
    found = identified("no_dp_1.csv", "no_dp_4.csv", "--config", "options.toml")
    assert [test["dp_MPa"] for test in found] == pytest.approx([1, 4])


@pytest.mark.parametrize(
    ("argv", "config", "words"),
    [
        ("plain.csv --dp 2MPa", "", "a column of the pressure drop ('dP_MPa'), and --dp or [dp] declares"),
        ("plain.csv", "[dp]\n'plain.csv' = '2 MPa'", "declares it as 2 MPa too; leave one of them out"),
        ("plain.csv", "dp = '2 MPa'", "declares it as 2 MPa too; leave one of them out"),
        ("no_dp_1.csv", "[dp]\n'no_dp1.csv' = '2 MPa'", "no name in [dp] is its own (did you mean 'no_dp1.csv'?)"),
        ("no_dp_1.csv", "[dp]\n'no_dp_1.csv' = '2'", "[dp] 'no_dp_1.csv' is '2' without a unit"),
        ("no_dp_1.csv", "[dp]\n'no_dp_1.csv' = ['2 MPa']", "option 'dp' is"),
        ("no_dp_1.csv --dp=-1MPa", "", "the declared pressure drop is -1 MPa, expected a positive one"),
        ("no_dp_1.csv no_dp_4.csv", "", "declare it by --dp or [dp]"),
        ("no_dp_1.csv", "[columns]\nuu = 'u_V'", "--columns names 'uu'"),
        ("no_dp_1.csv", "[colums]\nu = 'u_V'", "there is no option 'colums' (did you mean 'columns'?)"),
    ],
)  # fmt: skip
def test_pressure_drops_that_cannot_be_taken(bench, capsys, argv, config, words):
    Path("options.toml").write_text(config)
    assert words in refusal(capsys, *argv.split(), "--config", "options.toml")


def test_a_list_of_pressure_drops_is_for_simulate_a_table_for_identify(bench):
    from dzdesign.command_line.invocation import parse

    Path("options.toml").write_text("dp = ['1 MPa', '2 MPa']")
    assert parse(["identify", "plain.csv", "--config", "options.toml"]).arguments.dp is None
    Path("options.toml").write_text("[dp]\n'a.csv' = '1 MPa'")
    assert parse(["simulate", "--config", "options.toml"]).arguments.dp == ()


class TestToPaste:
    """A file whose labels are not known: the refusal prints the option that reads it."""

    GERMAN = "Zeit [s],Sollwert [V],Druck A [bar],Druck B [bar],Durchfluss [l/min]"

    @pytest.fixture
    def german(self, bench):
        rows = ramp()
        ports = 10 * (rows[:, 2] + 0.2), np.full(len(rows), 2.0)
        (bench / "german.csv").write_text(csv(np.column_stack([rows[:, :2], *ports, rows[:, 3]]), self.GERMAN))
        return bench / "german.csv"

    def test_what_it_prints_reads_the_file(self, german, capsys, wording):
        assert main(["identify", "german.csv", "-o", "none.json"]) == 2
        line = capsys.readouterr().err
        wording("columns: the option to paste", line)
        option = line.partition('--columns "')[2].partition('"')[0]
        assert main(["identify", "german.csv", "--columns", option, "-o", "valve.json"]) == 0
        edges = json.loads(Path("valve.json").read_text())["sides"]["positive"]["tests"][0]
        assert edges["dp_MPa"] == pytest.approx(1.0, rel=0.01)

    def test_a_label_that_nothing_tells_is_left_to_the_engineer(self, german, capsys):
        german.write_text(german.read_text().replace("Sollwert [V]", "AO0"))
        assert main(["identify", "german.csv", "-o", "none.json"]) == 2
        assert "u=LABEL:V" in capsys.readouterr().err

    def test_two_pressures_that_are_not_a_and_b_are_not_guessed(self, german, capsys):
        german.write_text(german.read_text().replace("Druck A", "Druck vor").replace("Druck B", "Druck nach"))
        assert main(["identify", "german.csv", "-o", "none.json"]) == 2
        assert "Durchfluss [l/min]" in (line := capsys.readouterr().err) and "pA=" not in line
