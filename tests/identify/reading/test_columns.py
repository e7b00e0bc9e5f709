"""Columns by the engineer's word, and pressure drops that are declared: `--columns`, `--dp`, the tables of a config."""

import json
import shlex
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


@pytest.fixture
def twice(bench):
    """Rows of a recording that has two columns of one label, the first without flow."""
    rows = ramp()
    rows = np.column_stack([rows, rows[:, 3]])
    rows[:, 3] = 0.0
    Path("twice.csv").write_text(csv(rows, "time_s,u_V,dP_MPa,Q_Lmin,Q_Lmin"))
    return rows


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
        ("logger.csv --columns u=A00:V", "", "has no column 'A00', which --columns names for u"),
        ("logger.csv --columns u=A00:V", "", "(did you mean 'AO0'?)"),
        ("logger.csv --columns u=AO0", "", "column 'AO0' has no unit; write for example --columns \"u=AO0:V\""),
        ("logger.csv --columns 'time=Zeit (ms),u=AO0:bar,Q=Flow (L/min)'", "",
         "column 'AO0': 'bar' is not a unit of voltage"),
        ("logger.csv --columns 'time=Zeit (ms),u=AO0:V,Q=Flow (L/min):V'", "",
         "column 'Flow (L/min)': 'V' is not a unit of flow"),
        ("logger.csv --columns 'u=AO0:V,pA=p1 - p2:bar,time=Zeit (ms)'", "", "a column of pA but none of pB"),
        ("twice.csv", "", '--columns "Q=Q_Lmin#2"'),
        ("twice.csv --columns Q=Q_Lmin", "", '--columns "Q=Q_Lmin#2"'),
        *((f"twice.csv --columns Q=Q_Lmin#{one}", "", f"no column 'Q_Lmin#{one}'") for one in "03x"),
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
def test_columns_and_pressure_drops_that_cannot_be_taken(bench, twice, capsys, argv, config, words):
    Path("options.toml").write_text(config)
    assert words in refusal(capsys, *shlex.split(argv), "--config", "options.toml")


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


class TestEqualLabels:
    """Labels that stand twice are chosen by their number: ``Q_Lmin#2``."""

    def test_the_message_proposes_what_chooses_one(self, twice, capsys):
        proposed = '--columns "Q=Q_Lmin#2"'
        assert main(["init", "twice.csv", "-o", "o.toml"]) == 2 and proposed in capsys.readouterr().err
        found = identified("twice.csv", "--columns", "Q=Q_Lmin#2, u=u_V#1")
        assert knees(found) == pytest.approx(knees(identified("plain.csv")), abs=1e-6)
        Path("valve.json").unlink()
        assert "does not show the valve opening" in refusal(capsys, "twice.csv", "--columns", "Q=Q_Lmin#1")

    def test_each_of_them_has_its_own_unit(self, twice):
        twice[:, 3] = 1000 * twice[:, 4]
        lines = [";".join(f"{value:.4f}" for value in row).replace(".", ",") for row in twice]
        Path("units.csv").write_text("\n".join(["time;u;dP;Q;Q", "s;V;MPa;ml/min;l/min", *lines]))
        for number in (1, 2):
            found = identified("units.csv", "--columns", f"Q=Q#{number}")
            assert knees(found) == pytest.approx(knees(identified("plain.csv")), abs=1e-3)

    def test_a_label_that_ends_so_in_the_file_goes_first(self, twice):
        twice = np.column_stack([twice[:, :4], twice[:, 3], twice[:, 4]])
        Path("named.csv").write_text(csv(twice, "time_s,u_V,dP_MPa,Q_Lmin,Q_Lmin,Q_Lmin#2"))
        found = identified("named.csv", "--columns", "Q=Q_Lmin#2")
        assert knees(found) == pytest.approx(knees(identified("plain.csv")), abs=1e-6)


class TestTwoSolenoids:
    """A command column for each solenoid: their difference is one signed command."""

    @pytest.fixture(params=["volts", "pwm", "letters", "mA"])
    def both(self, request, bench):
        """A file, its columns' labels, and what --columns says of them."""
        rows = ramp(ramp_s=40)
        other = rows * [1, 1, 1, -1] + [rows[-1, 0] + 0.04, 0, 0, 0]
        zero = np.zeros(len(rows))
        first, second = np.concatenate([rows[:, 1], zero]), np.concatenate([zero, rows[:, 1]])
        labels, unit, scale = {
            "volts": ("uA_V,uB_V", "", lambda u: u),
            "pwm": ("PWM_A,PWM_B", ":0..255 = 0..100 %", lambda u: np.round(25.5 * u)),
            "letters": ("u_A,u_B", ":0..10 = 0..100 %", lambda u: u),
            "mA": ("i A (mA),i B (mA)", ":4..20 mA = 0..10 V", lambda u: 4 + 1.6 * u),
        }[request.param]
        every = np.vstack([rows, other])
        table = np.column_stack([every[:, 0], scale(first), scale(second), every[:, 2:]])
        Path("both.csv").write_text(csv(table, f"time_s,{labels},dP_MPa,Q_Lmin"))
        return labels.split(","), unit, request.param

    def test_it_has_the_thresholds_of_both_sides(self, both):
        (one, other), unit, kind = both
        for text in (f"u={one}{unit} - {other}{unit}", f"u={one} - {other}{unit}"):
            identified("both.csv", "--columns", text, "--meter-lag", "0 s")
            sides = json.loads(Path("valve.json").read_text())["sides"]
            for name in ("positive", "negative"):
                (test,) = sides[name]["tests"]
                within = 0.03 if kind == "pwm" else 0.015
                assert (test["u_knee_rising_V"], test["u_knee_falling_V"]) == pytest.approx((5.0, 4.9), abs=within)
                assert test["u_guard_lower_V"] < 4.9

    def test_init_and_the_refusal_propose_it(self, both, capsys):
        (one, other), unit, kind = both
        if kind == "mA":
            return  # nothing says that a current is a command
        proposed = f"u={one} - {other}{unit}"
        assert f'{proposed}"' in refusal(capsys, "both.csv")
        assert main(["init", "both.csv", "-o", "o.toml"]) == 1
        assert f'--columns "{proposed}"' in capsys.readouterr().out
        assert main(["init", "both.csv", "-o", "p.toml", "--columns", proposed]) == 0
        assert f'u = "{one} - {other}{unit}"' in Path("p.toml").read_text()

    def test_units_that_differ_are_refused(self, both, capsys):
        (one, other), _, _ = both
        assert "give both one unit" in refusal(capsys, "both.csv", "--columns", f"u={one}:V - {other}:mV")

    def test_a_command_and_its_feedback_are_no_pair(self, bench, capsys):
        rows = ramp()
        table = np.column_stack([rows[:, :2], 1.01 * rows[:, 1], rows[:, 2:]])
        Path("fed.csv").write_text(csv(table, "time_s,u_set [V],u_act [V],dP_MPa,Q_Lmin"))
        assert "u=LABEL:V" in refusal(capsys, "fed.csv")

    def test_a_label_with_a_minus_goes_first(self, bench):
        Path("minus.csv").write_text(csv(ramp(), "time_s,a - b,dP_MPa,Q_Lmin"))
        found = identified("minus.csv", "--columns", "u=a - b:V")
        assert knees(found) == pytest.approx(knees(identified("plain.csv")), abs=1e-6)


class TestGaugeAndAbsolute:
    """A drop of a gauge and an absolute pressure is off by the ambient one."""

    @staticmethod
    def written(labels, bar=10.0, absolute=0.0):
        rows = ramp()
        ports = [(rows[:, 2] + 0.2 + absolute) * bar, np.full(len(rows), 0.2 * bar)]
        table = np.column_stack([rows[:, :2], *ports, rows[:, 3]])
        Path("ports.csv").write_text(csv(table, f"time_s,u_V,{labels},Q_Lmin"))

    @pytest.mark.parametrize(
        "labels",
        [
            "pA [bara],pB [barg]", "pA [barg],pB [bara]", "pA (bar(a)),pB (bar(g))", "pA_psia,pB_psig",
            "pA [bara],pB [bar]", "pA_bar,pB_bara",
        ],
    )  # fmt: skip
    def test_the_two_are_refused(self, bench, capsys, labels):
        self.written(labels)
        said = refusal(capsys, "ports.csv")
        assert "an absolute pressure, and" in said
        assert all(repr(label) in said for label in labels.split(","))

    @pytest.mark.parametrize(
        "labels", ["pA [bara],pB [bara]", "pA [barg],pB [bar]", "pA [bar],pB [bar]", "pA [bar(a)],pB [bara]"]
    )
    def test_two_alike_are_taken(self, bench, labels):
        self.written(labels)
        assert [test["dp_MPa"] for test in identified("ports.csv")] == pytest.approx([1.0])

    @pytest.mark.parametrize(("unit", "bar"), [("bar", 10.0), ("psi", 145.0377)])
    def test_the_advice_gives_the_drop(self, bench, capsys, unit, bar):
        self.written(f"pA [{unit}a],pB [{unit}g]", bar, absolute=0.101325)
        advice = refusal(capsys, "ports.csv").rpartition('--columns "')[2].partition('"')[0]
        found = identified("ports.csv", "--columns", advice)
        assert [test["dp_MPa"] for test in found] == pytest.approx([1.0], abs=1e-4)

    def test_beside_one_that_does_not_say_either_advice_does(self, bench, capsys):
        self.written("pA [bara],pB [bar]", absolute=0.101325)
        first, second = refusal(capsys, "ports.csv").split('--columns "')[1:]
        for advice, dp in ((first, 1.101325), (second, 1.0)):
            found = identified("ports.csv", "--columns", advice.partition('"')[0])
            assert [test["dp_MPa"] for test in found] == pytest.approx([dp], abs=1e-4)
            Path("valve.json").unlink()

    @pytest.mark.parametrize("unit", ["bara", "barg", "psia"])
    def test_a_single_drop_may_be_called_so(self, bench, unit):
        rows = ramp() * [1, 1, 10 if unit != "psia" else 145.0377, 1]
        Path("drop.csv").write_text(csv(rows, f"time_s,u_V,dP [{unit}],Q_Lmin"))
        assert [test["dp_MPa"] for test in identified("drop.csv")] == pytest.approx([1.0], rel=1e-4)
