"""`dzdesign init`: the file that it writes is accepted, and identify runs with it on these recordings as they are."""

import json
import os
import re
import shlex
import shutil
import textwrap
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dzdesign.codegen.project import target_named
from dzdesign.command_line.cli import main
from dzdesign.design.options import options_of as design_options
from dzdesign.identify import identification
from dzdesign.identify.data_quality.catalogue import catalogue
from dzdesign.identify.identification import identify
from dzdesign.identify.valve.model import Warning_
from tests.support.synthetic import L_MIN, MPA, Truth, synthetic_ramp

LABELS = "Zeit (s),AO0 [V],Durchfluss [L/min],Temp [degC]"


def columns_of(dp_MPa, *, sign=1, ramp_s=20, knee=5.4, rate_Hz=25):
    test = synthetic_ramp(dp_MPa, Truth(noise=0.02, knee_rising=knee), ramp_s=ramp_s, rate_Hz=rate_Hz)
    return test.time, sign * test.u, test.dp / MPA, sign * test.q / L_MIN


def write(path, labels, *columns):
    rows = "\n".join(",".join(f"{value:.4f}" for value in row) for row in np.column_stack(columns))
    Path(path).parent.mkdir(exist_ok=True)
    Path(path).write_text(f"{labels}\n{rows}\n")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def options_of(text):
    """What a proposed file says beside the recordings, which stand in every one."""
    options = tomllib.loads(text)
    assert options.pop("ramps")
    return options


def init_then_identify(*ramps, more=()):
    """Run init, then identify with its file; return init's report and the valve."""
    assert main(["-q", "init", *ramps, *more]) == 0
    text = Path("dzdesign.toml").read_text("utf-8")
    assert main(["-q", "identify", *ramps, "--config", "dzdesign.toml"]) == 0
    return text, json.loads(Path("valve.json").read_text())


def test_the_bundled_recordings(here, example_folder, capsys):
    for path in (example_folder / "ramps").glob("*.csv.gz"):
        if any(dp in path.name for dp in ("dP1_", "dP4_")):
            shutil.copy(path, here)
    text, valve = init_then_identify("*.csv.gz")
    said = capsys.readouterr().out
    assert options_of(text) == {"u-max": "10 V"}  # what identify finds by itself stays a comment
    assert "positive commands: 6 ramps at 1, 4 MPa, up to 24.9 L/min" in text and "negative" not in text
    for warning in valve["warnings"]:
        assert f"# warning [{warning['code']}] " in text
    assert f"identify finds {valve['meter']['floor_L_min']:.2f} L/min" in text
    assert "the recordings can't tell it (it takes ramps of two rates)" in text
    assert '# u = "u_V"  (in V; understood by its label)' in text
    assert tomllib.loads(text)["ramps"] == ["*.csv.gz"]
    assert "Written: dzdesign.toml" in said and "dzdesign run dzdesign.toml" in said


def test_labels_of_another_program_and_pressures_in_the_names(here):
    for dp_MPa, knee in ((1.0, 5.4), (4.0, 5.2)):
        time, u, _, q = columns_of(dp_MPa, knee=knee)
        write(f"ramp_{10 * dp_MPa:.0f}bar.csv", LABELS, time, u, q, 0 * q + 40)
    text, valve = init_then_identify("ramp_*.csv")
    assert options_of(text) == {
        "u-max": "10 V",
        "columns": {"time": "Zeit (s)", "u": "AO0 [V]", "Q": "Durchfluss [L/min]"},
        "dp": {"ramp_10bar.csv": "10 bar", "ramp_40bar.csv": "40 bar"},
    }
    assert [test["dp_MPa"] for test in valve["sides"]["positive"]["tests"]] == [1.0, 4.0]


def test_both_signs_and_a_smaller_command(here):
    for sign, name in ((1, "up.csv"), (-1, "down.csv")):
        time, u, dp, q = columns_of(1.0, sign=sign, knee=5.0)
        write(name, "t_s,u_V,dP_MPa,Q_Lmin", time, u / 2, dp, q)
    text, valve = init_then_identify("up.csv", "down.csv")
    assert options_of(text) == {"u-max": "5 V"}
    assert "# Full command: the ramps end at 5.00 V." in text
    assert "positive commands: 1 ramp at 1 MPa" in text and "negative commands: 1 ramp at 1 MPa" in text
    assert set(valve["sides"]) == {"positive", "negative"}


def test_a_command_in_per_cent_says_that_full_command_was_not_seen(here, capsys):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", "t_s,u_%,dP_MPa,Q_Lmin", time, 10 * u, dp, q)
    text, _ = init_then_identify("ramp.csv")
    assert "# Full command, what 100 % means: recordings in per cent don't say it. A guess: correct it." in text
    assert 'full command: in per cent, so not recorded; u-max = "10 V" is a guess' in capsys.readouterr().out


def test_ramps_that_stop_short_make_full_command_a_guess(here):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", "t_s,u_V,dP_MPa,Q_Lmin", *(column[u <= 8] for column in (time, u, dp, q)))
    text, _ = init_then_identify("ramp.csv")
    assert options_of(text) == {"u-max": "10 V"}
    assert "# Full command: a guess, for the ramps end at 8.00 V." in text


def test_two_rates_tell_the_lag(here):
    for ramp_s in (20, 60):
        time, u, dp, q = columns_of(1.0, ramp_s=ramp_s)
        write(f"ramp_{ramp_s}.csv", "t_s,u_V,dP_MPa,Q_Lmin", time, u, dp, q)
    text, valve = init_then_identify("ramp_20.csv", "ramp_60.csv")
    assert valve["meter"]["lag_is"] == "identified"
    assert "from ramps of two rates." in text
    assert "2 ramps at 1 MPa" in text


@pytest.mark.parametrize(
    ("labels", "reason"),
    [
        ("t_s,u_V,Q1 [L/min],Q2 [L/min]", "Q: 'Q1 [L/min]' and 'Q2 [L/min]' could each be it"),
        ("t_s,AO0,p [bar],Q_Lmin", "u: no column has a unit of voltage"),
        ("t_s,I_valve [mA],dP [bar],Q_Lmin", "u: no column has a unit of voltage; if 'I_valve [mA]' is it, say"),
        (
            "t_s,u_V,dP_bar,Q [Hz]",
            "Q: 'ramp.csv' column 'Q [Hz]': 'Hz' is not a unit of flow that dzdesign knows; expected for ex",
        ),
        (
            "t_s,u [v],dP_bar,Q_Lmin",
            "u: 'ramp.csv' column 'u [v]': 'v' is not a unit of voltage that dzdesign knows (did you mean 'V'?)",
        ),
        ("t_s,u_V,dP_bar,Q_mA", "Q: 'ramp.csv' column 'Q_mA': 'mA' is not a unit of flow"),
    ],
)
def test_what_can_not_be_told_is_left_open_with_the_reason(here, capsys, labels, reason):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", labels, time, u, dp, q)
    assert main(["init", "ramp.csv"]) == 1
    said = capsys.readouterr().out
    assert f"open: column of {reason}" in said
    assert ("say what the signal means, for example" in said) == ("Q_mA" in labels)
    text = Path("dzdesign.toml").read_text()
    assert f"# OPEN: column of {reason}" in text and f'# {reason[0]} = "LABEL:UNIT"' in text
    assert reason[0] not in options_of(text).get("columns", {})


@pytest.mark.parametrize(
    ("label", "full", "range_form"),
    [
        ("duty", 0.9, "duty:0..0.9 = 0..100 %"),
        ("Duty cycle [-]", 1.0, "Duty cycle [-]:0..1 = 0..100 %"),
        ("PWM", 4095, "PWM:0..4095 = 0..100 %"),
        ("Tastverhaeltnis", 1.0, "Tastverhaeltnis:0..1 = 0..100 %"),
        ("u", 0.9, "u:0..0.9 = 0..100 %"),
    ],
)
def test_of_a_duty_cycle_the_range_form_is_proposed(here, capsys, label, full, range_form):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", f"t_s,{label},dP [bar],Q_Lmin", time, full * u / 10, dp, q)
    assert main(["init", "ramp.csv"]) == 1
    assert f'--columns "u={range_form}"' in capsys.readouterr().out
    text = Path("dzdesign.toml").read_text()
    assert f'# u = "{range_form}"' in text and "(in ;" not in text
    Path("dzdesign.toml").write_text(text.replace("# [columns]", "[columns]").replace("# u = ", "u = "))
    assert main(["identify", "ramp.csv", "--config", "dzdesign.toml"]) == 0


def test_a_duty_cycle_of_both_signs_and_one_that_may_be_two(here, capsys):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", "t_s,duty,dP [bar],Q_Lmin", [*time, 1000.0], [*u / 10, -1.0], [*dp, dp[0]], [*q, 0.0])
    assert main(["init", "ramp.csv"]) == 1 and "u=duty:-1..1 = -100..100 %" in capsys.readouterr().out
    write("ramp.csv", "t_s,duty A,dP [bar],Q_Lmin,duty B", time, u / 10, dp, q, u / 10)
    assert main(["init", "ramp.csv", "-o", "second.toml"]) == 1 and "= 0..100 %" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("labels", "declared"),
    [
        ("t_s,u_V,p_1,p_2,Q_Lmin", "pA=p_1:bar, pB=p_2:bar"),
        ("t_s,u_V,Druck vor,Druck nach,Q_Lmin", "pA=Druck vor:bar, pB=Druck nach:bar"),
        ("t_s,u_V,pos,PWM,Q_Lmin", ""),
        ("t_s,u_V,power (W),x,Q_Lmin", ""),
    ],
)
def test_pressures_without_a_unit_are_seen_and_can_be_declared_as_said(here, capsys, labels, declared):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", labels, time, u, 10 * dp + 3, 0 * dp + 3, q)
    assert main(["-q", "init", "ramp.csv"]) == 0
    said, text = capsys.readouterr().out, Path("dzdesign.toml").read_text("utf-8")
    assert ("without a unit" in said) == ("without a unit" in text) == bool(declared)
    assert "unknown MPa" not in said and "at an unknown pressure drop" in said
    if declared:
        assert f'declare by --columns "{declared}"' in said
        Path("dzdesign.toml").unlink()
        init_then_identify("ramp.csv", more=("--columns", declared))
        assert "at 10 bar" in capsys.readouterr().out


FOREIGN = ("Druckdifferenz [bar]", "Delta P (bar)", "p_diff/bar", "p1 [bar]", "Druck in bar", "Diff. pressure (bar)")


@pytest.mark.parametrize("label", FOREIGN)
@pytest.mark.parametrize("others", ["t_s,u_V", "Zeit/s,Sollwert [V]"])
def test_a_pressure_with_a_foreign_name_is_used_and_not_that_of_the_files_name(here, capsys, label, others):
    for dp_MPa, knee in ((1.0, 5.4), (4.0, 5.2)):
        time, u, dp, q = columns_of(dp_MPa, knee=knee)
        write(f"ramp_{10.5 * dp_MPa:.0f}bar.csv", f"{others},{label},Q_Lmin", time, u, 10 * dp, q)
    text, valve = init_then_identify("ramp_*.csv")
    table = options_of(text)
    assert [test["dp_MPa"] for test in valve["sides"]["positive"]["tests"]] == pytest.approx([1.0, 4.0], rel=1e-3)
    if label != "Delta P (bar)":  # that one is understood
        assert table["columns"]["dP"] == label and "dp" not in table
        assert "check that it is the drop over the valve" in text
        assert f"pressure drop: '{label}', the only column in a unit of pressure" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("labels", "reason"),
    [
        ("t_s,u_V,p1 [bar],p2 [bar],Q_Lmin", "'p1 [bar]' and 'p2 [bar]': a pressure, but is it the drop, pA or pB?"),
        ("Zeit [s],u_V,p1 [bar],p2 [bar],Q_Lmin", "'p1 [bar]' and 'p2 [bar]': a pressure, but is it the drop"),
        ("t_s,u_V,pA [bar],x,Q_Lmin", "'pA [bar]' is the pressure of one port; which column is that of the other"),
        ("t_s,u_V,Druck [mA],x,Q_Lmin", "'Druck [mA]' is a current; say what it means, for example --columns"),
        ("t_s,u_V,Tank [bar],x,Q_Lmin", "'ramp_40bar.csv' says 40 bar in its name, and 1 MPa in 'Tank [bar]'"),
    ],
)
def test_a_pressure_that_may_be_another_is_open(here, capsys, labels, reason):
    time, u, dp, q = columns_of(1.0)
    write("ramp_40bar.csv", labels, time, u, 10 * dp, 0 * dp + 3, q)
    assert main(["init", "ramp_40bar.csv"]) == 1
    assert f"open: column of dP: {reason}" in capsys.readouterr().out
    assert "dp" not in tomllib.loads(Path("dzdesign.toml").read_text("utf-8"))
    Path("dzdesign.toml").unlink()
    if "pA" not in labels:
        assert main(["init", "ramp_40bar.csv", "--dp", "40 bar"]) == 0  # the engineer's word
        assert tomllib.loads(Path("dzdesign.toml").read_text("utf-8"))["dp"] == {"ramp_40bar.csv": "40 bar"}


def test_a_declared_pressure_goes_before_a_column_with_a_foreign_name(here, capsys):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", "t_s,u_V,Tank [bar],Q_Lmin", time, u, dp, q)
    _, valve = init_then_identify("ramp.csv", more=("--dp", "40 bar"))
    assert "not used: 'Tank [bar]', as --dp says the pressure drop" in capsys.readouterr().out
    assert valve["sides"]["positive"]["tests"][0]["dp_MPa"] == 4.0


def test_a_command_in_per_cent_under_another_name(here):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", "t_s,Sollwert [%],dP_MPa,Q_Lmin", time, 10 * u, dp, q)
    text, _ = init_then_identify("ramp.csv")
    assert options_of(text)["columns"] == {"u": "Sollwert [%]"} and "recordings in per cent don't say it" in text
    write("current.csv", "t_s,I [mA],dP_MPa,Q_Lmin", time, 4 + 1.6 * u, dp, q)
    Path("dzdesign.toml").unlink()
    text, _ = init_then_identify("current.csv", more=("--columns", "u=I [mA]:4..20 mA = 0..100 %"))
    assert "recordings in per cent don't say it" in text


@pytest.mark.parametrize(
    ("labels", "open_ones", "declared"),
    [
        ("dP,x", ["dP"], "dP=dP:MPa"),
        ("pA,pB", ["pA", "pB"], "pA=pA:MPa, pB=pB:MPa"),
        ("pA (MPa),pB", ["pB"], "pB=pB:MPa"),
    ],
)
def test_a_pressure_whose_label_says_which_is_open_without_a_unit(here, capsys, labels, open_ones, declared):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", f"t_s,u_V,{labels},Q_Lmin", time, u, dp + (0 if "dP" in labels else 3), 0 * dp + 3, q)
    assert main(["init", "ramp.csv"]) == 1
    said, text = capsys.readouterr().out, Path("dzdesign.toml").read_text()
    for name in open_ones:
        assert f"column '{name}' has no unit; write for example --columns" in said
        assert name == "dP" or f'# {name} = "LABEL:UNIT"' in text
    Path("dzdesign.toml").unlink()
    init_then_identify("ramp.csv", more=("--columns", declared))
    assert "at 1 MPa" in capsys.readouterr().out


def test_of_two_pressures_the_file_has_the_lines_and_identify_says_what_to_declare(here, capsys):
    for pressure in (1.0, 4.0):
        time, u, dp, q = columns_of(pressure, rate_Hz=10)
        labels = "Zeit [s],u_V,Druck 1 [bar],Druck 2 [bar],Q_Lmin"
        write(f"r{pressure:g}.csv", labels, time, u, 10 * dp + 5, 0 * dp + 5, q)
    assert main(["init", "r*.csv"]) == 1
    said, text = capsys.readouterr().out, Path("dzdesign.toml").read_text()
    assert '# pA = "Druck 1 [bar]"\n# pB = "Druck 2 [bar]"\n' in text
    assert "Until that is settled, full command" in said
    declared = "pA=Druck 1 [bar], pB=Druck 2 [bar]"
    assert main(["identify", "r*.csv", "--config", "dzdesign.toml"]) == 2
    assert f'--columns "{declared}"' in capsys.readouterr().err
    # On top of the columns in the file, which has that of the time.
    assert 'time = "Zeit [s]"' in text
    assert main(["identify", "r*.csv", "--config", "dzdesign.toml", "--columns", declared]) == 0
    Path("dzdesign.toml").write_text(text.replace("# pA", "pA").replace("# pB", "pB"))
    assert main(["identify", "r*.csv", "--config", "dzdesign.toml"]) == 0


def test_one_column_in_a_unit_of_pressure_is_named_where_recordings_have_no_drop(here, capsys):
    for pressure in (1.0, 4.0):
        time, u, dp, q = columns_of(pressure, rate_Hz=10)
        write(f"r{pressure:g}.csv", "t_s,u_V,Druck [bar],Q_Lmin", time, u, 10 * dp, q)
    assert main(["identify", "r*.csv"]) == 2
    said = capsys.readouterr().err
    assert "'r1.csv' has no column of dP" in said and '--columns "dP=Druck [bar]"' in said
    assert main(["identify", "r*.csv", "--columns", "dP=Druck [bar]"]) == 0


def test_every_commented_line_of_an_option_may_be_uncommented(here):
    """Seeded: a remark behind a value, which TOML does not read."""
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", "t_s,u_V,dP_MPa,Q_Lmin", time, u, dp, q)
    assert main(["-q", "init", "ramp.csv"]) == 0
    text = Path("dzdesign.toml").read_text("utf-8")
    lines = [line.removeprefix("# ") for line in text.splitlines() if re.match(r"(# )?(\[|[a-z0-9-]+ = )", line)]
    unread = [line for line in lines if line.endswith("(in V; understood by its label)")]
    options = tomllib.loads("\n".join(line for line in lines if " (in " not in line))
    assert {"pressure-span", "order", "meter-lag", "machine", "record"} <= set(options) and len(unread) <= 1
    assert "amplifier" in options["machine"]
    names = ("drive", "coil", "rated-current", "current-signal", "supply-signal")
    texts = {name.replace("-", "_"): options[name] for name in names} | {"supply": options["machine"]["supply"]}
    assert design_options(texts, target_named("f28335").inputs()).current is not None


@pytest.mark.parametrize("without_pressure", [False, True])
def test_the_screen_has_24_rows_at_most_and_the_file_has_the_rest(here, capsys, monkeypatch, without_pressure):
    """Twenty recordings of a valve with two solenoids, with every warning that there is."""
    for number in range(20):
        time, u, dp, q = columns_of(1.0 + number % 5, sign=(-1) ** (number // 10), rate_Hz=10, knee=5 + number / 50)
        labels, pressure = ("t_s,u_V,Q_Lmin", ()) if without_pressure else ("t_s,u_V,dP_MPa,Q_Lmin", (dp,))
        write(f"r{number}.csv", labels, time, u, *pressure, q)
    warnings = tuple(Warning_(code=code, text="a text " * 30, source="r1.csv") for code in catalogue())
    warned = {"warnings": warnings, "simulated": True}
    monkeypatch.setattr(identification, "identify", lambda *arguments: replace(identify(*arguments), **warned))
    assert main(["init", "r*.csv"]) == int(without_pressure)
    rows = [row for line in capsys.readouterr().out.splitlines() for row in textwrap.wrap(line, 78)]
    text = Path("dzdesign.toml").read_text()
    assert len(rows) <= 24, "\n".join(rows)
    assert text.count("# OPEN: pressure drop of") == (20 if without_pressure else 0)
    assert text.count("# warning [") == (0 if without_pressure else len(warnings))


def test_a_pressure_from_a_name_is_said_and_units_as_people_write_them(here, capsys):
    time, u, _, q = columns_of(4.0)
    write("ramp_4MPa.csv", "t_s,u_V,Q_Lmin", time, u, q)
    text, valve = init_then_identify("ramp_4MPa.csv")
    said = capsys.readouterr().out
    assert "pressure drop by the files' names: 4 MPa" in said and "1 ramp at 4 MPa" in said
    assert options_of(text)["dp"] == {"ramp_4MPa.csv": "4 MPa"}
    assert valve["sides"]["positive"]["tests"][0]["dp_MPa"] == 4.0
    assert '# Q = "Q_Lmin"  (in L/min; understood by its label)' in text


def test_without_a_pressure_the_template_has_lines_for_a_drop_and_for_two_sensors(here):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", "t_s,u_V,x,y,Q_Lmin", time, u, 10 * dp + 20, 0 * dp + 20, q)
    text, _ = init_then_identify("ramp.csv")
    assert text.count('# [columns]\n# dP = "LABEL:UNIT"\n# or, of a sensor on either side') == 1
    assert '# pA = "LABEL:UNIT"\n# pB = "LABEL:UNIT"\n' in text


@pytest.mark.parametrize("dither", [0.0, 0.006])
def test_names_that_contradict_the_column_are_said(here, capsys, dither):
    """A sensor that is stuck at 1 MPa: by one recording the name tells it, by several the flows."""
    for number in (1, 2, 5):
        time, u, _, q = columns_of(float(number))
        stuck = 1.0 + dither * np.random.default_rng(number).integers(-1, 2, u.size)
        write(f"ramp_{number}MPa.csv", "t_s,u_V,dP_MPa,Q_Lmin", time, u, stuck, q * number**0.5)
    assert main(["init", "ramp_5MPa.csv", "-o", "one.toml"]) == 0
    said = capsys.readouterr().out
    told = "CHECK: a name says another pressure drop than the column: 'ramp_5MPa.csv' holds 1 MPa; the sensor"
    told = told if dither else "warning [pressure-stuck] ramp_5MPa.csv: the pressure drop is 1 MPa"
    assert told in said and f"# {told}" in Path("one.toml").read_text()
    assert main(["init", "ramp_5MPa.csv", "ramp_1MPa.csv", "ramp_2MPa.csv", "-o", "three.toml"]) == 1
    said = capsys.readouterr().out  # flows of three pressures taken for one test have no line
    assert "identify would refuse these recordings" in said and "CHECK" not in said
    assert said.count("a stuck sensor") == 1
    assert main(["init", "ramp_1MPa.csv", "-o", "right.toml"]) == 0
    assert "CHECK" not in capsys.readouterr().out


def test_a_p_stands_for_a_point(here):
    name = "Rampe_0p5MPa.txt"
    for dp_MPa, path in ((0.5, name), (1.0, "Rampe_1MPa.txt")):
        time, u, dp, q = columns_of(dp_MPa)
        write(path, "t_s,u_V,Q_Lmin", time, u, q * dp_MPa**0.5)
        write(f"with_{path}", "t_s,u_V,dP_MPa,Q_Lmin", time, u, 0.99 * dp, q * dp_MPa**0.5)
    text, valve = init_then_identify("Rampe_*.txt")
    assert options_of(text)["dp"] == {name: "0.5 MPa", "Rampe_1MPa.txt": "1 MPa"}
    assert [test["dp_MPa"] for test in valve["sides"]["positive"]["tests"]] == [0.5, 1.0]
    assert main(["init", "with_*", "-o", "with.toml"]) == 0 and "CHECK" not in Path("with.toml").read_text()


def test_a_valve_nought_is_no_decimal_number(here, capsys):
    """V0_1MPa: a tenth of the pressure would go into the certificate."""
    for number in (1, 3, 5):
        time, u, _, q = columns_of(float(number))
        write(f"V0_{number}MPa.csv", "t_s,u_V,Q_Lmin", time, u, q * number**0.5)
    assert main(["init", *(f"V0_{number}MPa.csv" for number in (1, 3, 5))]) == 1
    assert "its name may say 0.1 MPa or 1 MPa" in capsys.readouterr().out
    assert "dp" not in tomllib.loads(Path("dzdesign.toml").read_text())


@pytest.mark.parametrize("others", [(), ("Rampe_1MPa.txt",)])
def test_a_name_that_can_be_read_in_two_ways_is_asked(here, capsys, others):
    time, u, _, q = columns_of(1.0)
    for path in ("Rampe_2_5MPa.txt", *others):
        write(path, "t_s,u_V,Q_Lmin", time, u, q)
    assert main(["init", "Rampe_2_5MPa.txt", *others]) == 1
    said = capsys.readouterr().out
    assert "open: pressure drop of 'Rampe_2_5MPa.txt': its name may say 2.5 MPa or 5 MPa; declare the right one" in said
    text = Path("dzdesign.toml").read_text()
    assert '# "Rampe_2_5MPa.txt" = "2.5 MPa"\n# "Rampe_2_5MPa.txt" = "5 MPa"\n' in text
    assert options_of(text).get("dp", {}) == {path: "1 MPa" for path in others}


def test_one_stuck_sensor_and_flows_that_differ_are_said(here, capsys):
    for name, dp_MPa in (("a.csv", 1.0), ("b.csv", 2.0), ("c.csv", 2.0)):
        time, u, dp, q = columns_of(dp_MPa)
        noise = 0 if name == "a.csv" else np.random.default_rng(1).integers(-9, 9, u.size)
        write(name, "t_s,u_V,dP_MPa,Q_Lmin", time, u, dp + 0.001 * noise, q * (2 if name == "b.csv" else 1))
    assert main(["init", "a.csv", "b.csv", "c.csv"]) == 0
    said = capsys.readouterr().out
    assert "warning [pressure-stuck] a.csv: the pressure drop is 1 MPa" in said
    assert "warning [flow-contradicts-dp] recordings that are taken as one" in said


def test_several_recordings_without_a_pressure_are_open(here, capsys):
    for number in (1, 2):
        time, u, _, q = columns_of(float(number))
        write(f"r{number}.csv", "t_s,u_V,Q_Lmin", time, u, q)
    assert main(["init", "r1.csv", "r2.csv"]) == 1
    assert "open: pressure drop of 'r1.csv': no column, and none in its name" in capsys.readouterr().out
    text = Path("dzdesign.toml").read_text()
    assert '# "r2.csv" = "1 MPa"' in text and options_of(text) == {"u-max": "10 V"}


def test_a_file_that_exists_stays(here, capsys):
    Path("dzdesign.toml").write_text("mine")
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", "t_s,u_V,dP_MPa,Q_Lmin", time, u, dp, q)
    assert main(["init", "ramp.csv"]) == 2
    assert "'dzdesign.toml' exists, and init never writes over a file" in capsys.readouterr().err
    assert Path("dzdesign.toml").read_text() == "mine"
    assert main(["-q", "init", "ramp.csv", "-o", "other.toml"]) == 0


def test_without_names_it_looks_in_ramps_then_here(here, capsys):
    assert main(["init"]) == 2
    assert "there are no recordings in ./ramps or in this folder" in capsys.readouterr().err
    time, u, dp, q = columns_of(1.0)
    write("ramps/ramp.csv", "t_s,u_V,dP_MPa,Q_Lmin", time, u, dp, q)
    write("other.csv", "nothing", time)
    assert main(["init", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["recordings"] == ["ramps/ramp.csv"] and said["open"] == []
    assert list(said["valve"]["sides"]) == ["positive"]


def test_hostile_labels_stay_strings_of_toml(here):
    time, u, dp, q = columns_of(1.0)
    write("ramp.csv", 't_s,"A ""0\\x\x7f [V]",dP_MPa,Q_Lmin,"] = 1\x1b[2J #"', time, u, dp, q, q)
    text, _ = init_then_identify("ramp.csv")
    assert set(options_of(text)) == {"u-max", "columns"} and "\x1b" not in text


@pytest.mark.skipif(os.name == "nt", reason="names that Windows has not")
@pytest.mark.parametrize("name", ["$(touch x).toml", ";touch x;.toml", "`id` a.toml", "a'b.toml", "a b.toml", "&.toml"])
def test_the_command_to_give_next_is_one_that_a_shell_reads_as_it_is_meant(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ramp.csv").write_text("time_s,u_V\n0,1\n", encoding="utf-8")
    main(["init", "ramp.csv", "-o", name])
    last = capsys.readouterr().out.splitlines()[-1]
    assert shlex.split(last) == ["dzdesign", "run", name]
