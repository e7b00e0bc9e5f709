"""Recordings as loggers write them: init says what is what, identify finds the valve."""

import gzip
import json
import logging
from pathlib import Path

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.errors import InputError
from dzdesign.identify.reading.columns import propose_columns
from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.dzdesign.command_line.test_bad_input import csv
from tests.identify.reading.logger_files import (
    DP,
    FILES,
    ROWS,
    START,
    TIME,
    Q,
    U,
    excel_english,
    milliseconds,
    rows,
    stamps,
    text,
)

L_MIN = 1e-3 / 60


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def read(content, **keywords):
    Path("ramp.csv").write_bytes(content)
    return read_ramp_file(Path("ramp.csv"), **keywords)


def refusal(content, **keywords):
    with pytest.raises(InputError) as caught:
        read(content, **keywords)
    assert "\n" not in str(caught.value) and "ramp.csv" in str(caught.value)
    return str(caught.value)


def assert_is_the_ramp(test, rows=slice(None)):
    np.testing.assert_allclose(test.time - test.time[0], TIME[rows], atol=6e-4)
    np.testing.assert_allclose(test.u, U[rows], atol=6e-5)
    np.testing.assert_allclose(test.dp, 1e6 * DP[rows], rtol=1e-4)
    np.testing.assert_allclose(test.q, L_MIN * Q[rows], atol=L_MIN * 1e-4)


@pytest.mark.parametrize("name", FILES)
def test_read_as_it_is_and_packed(here, name):
    make, options = FILES[name]
    Path("ramp.csv").write_bytes(make())
    columns = {name: column.label for name, column in propose_columns(Path("ramp.csv"), {}).proposed.items()}
    if options:
        from dzdesign.identify.reading.column_labels import parse_columns

        columns = parse_columns(options[1])
    test = read(make(), columns=columns)
    assert_is_the_ramp(test)
    again = read(gzip.compress(make()), columns=columns)
    for one in ("time", "u", "q", "dp"):
        np.testing.assert_array_equal(getattr(again, one), getattr(test, one))


# encodings


@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "utf-16", "utf-8-sig"])
def test_an_encoding_is_told_and_logged(here, caplog, encoding):
    with caplog.at_level(logging.DEBUG, "dzdesign"):
        test = read(text("Öl: 40 °C, µm²", "t_s;u_V;dP_bar;Q [dm³/min]", *rows(TIME, U, 10 * DP, Q), encoding=encoding))
    assert_is_the_ramp(test)
    said = {"cp1252": "Windows-1252", "latin-1": "Windows-1252", "utf-16": "UTF-16"}.get(encoding)
    assert (f"is text in {said}" in caplog.text) == (said is not None)
    assert "the header was found in row 2" in caplog.text


def test_an_encoding_that_shows_late(here):
    plain = csv(ROWS).encode()
    assert_is_the_ramp(read(plain + "# Öl\n".encode("cp1252")))
    assert_is_the_ramp(read(plain + "# Öl\n".encode()))


# what stands above, between and below


def test_the_number_of_rows_above_the_header_may_be_told(here, wording):
    lines = ["A1;A2;A3;A4", "e;f;g;h", "i;j;k;l", *rows(TIME, U, DP, Q)]
    wording.of_test(refusal(text(*lines)))
    columns = {"time": "e:s", "u": "f:V", "dP": "g:MPa", "Q": "h:L/min"}
    with_labels = text(lines[0], lines[1], *lines[3:])
    assert_is_the_ramp(read(with_labels, columns=columns, skip_rows=1))
    Path("dzdesign.toml").write_text('skip-rows = 1\ncolumns = "time=e:s, u=f:V, dP=g:MPa, Q=h:L/min"')
    assert main(["-q", "identify", "ramp.csv", "--config", "dzdesign.toml"]) == 0
    assert main(["identify", "ramp.csv", "--skip-rows", "two"]) == 2
    for skipped in (5000, 2):
        wording.of_test(refusal(with_labels, skip_rows=skipped))


def test_told_that_nothing_stands_above_the_first_line_is_the_header(here):
    content = text("note;to;all;x", "t_s;u_V;dP_MPa;Q_Lmin", *rows(TIME, U, DP, Q))
    assert_is_the_ramp(read(content))
    assert "no column of time (columns found: note, to, all, x)" in refusal(content, skip_rows=0)
    assert_is_the_ramp(read(content, skip_rows=1))


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        ("X_Value;u (V);dP (bar);Q (l/min)", 'give its unit, for example --columns "time=LABEL:s"'),
        ("timestamp;path;value;unit", "row for each variable (path, value): export a column for each"),
        ("Time;signal;Value;unit", "row for each variable (signal, Value): export a column for each"),
        ("time_s;u_V;dP_MPa;Total_L", "'Total_L' is a volume and no flow: differentiate it"),
        ("time_s;u_V;dP_MPa;V [cm³]", "'V [cm³]' is a volume and no flow: differentiate it"),
        ("time_s;u_V;dP_MPa;pulses", "'pulses' counts pulses and is no flow: differentiate it"),
        ("time_s;u_V;dP_MPa;pos_mm", "'pos_mm' is a position and no flow: differentiate it; of a cylinder,"),
        ("time_s;u_V;dP_MPa;speed_mm_per_s", '"Q=speed_mm_per_s:0..100 mm/s = 0..12 L/min"'),
        ("time_s;u_V;dP_MPa;v (m/s)", "'v (m/s)' is a speed: of a cylinder, the flow is area x speed"),
        ("VarName;TimeString;VarValue;Time_ms", "row for each variable (VarName, VarValue): export a column for each"),
    ],
)
def test_init_says_how_to_go_on_with_a_bare_time_or_a_row_a_variable(here, capsys, labels, words):
    Path("ramp.csv").write_bytes(text(labels, *rows(TIME, U, 10 * DP, Q)))
    assert main(["-q", "init", "ramp.csv"]) == 1
    assert words in capsys.readouterr().out


def test_statistics_below_the_samples_are_said(here, caplog):
    lines = ["t_s;u_V;dP_MPa;Q_Lmin", *rows(TIME, U, DP, Q)]
    with caplog.at_level(logging.DEBUG, "dzdesign"):
        assert_is_the_ramp(read(text(*lines, "Mittelwert;5,0;2,0;9,9", "Max;10,0;2,1;21")))
    assert "row 1002 is passed over: Mittelwert 5,0 2,0 9,9" in caplog.text and "row 1003" in caplog.text


@pytest.mark.parametrize("cell", ["#N/A", "#NV", "#DIV/0!", "#WERT!", '"#N/A"', " #NAME?"])
@pytest.mark.parametrize("separator", [";", ","])
def test_what_a_spreadsheet_writes_for_no_value_is_a_blank_cell_and_no_comment(here, cell, separator):
    lines = rows(np.zeros(TIME.size), TIME, U, DP, Q, separator=separator, comma=False)
    spoiled = [cell + line[line.index(separator) :] if index % 3 == 0 else line for index, line in enumerate(lines)]
    labels = separator.join(["note", "t_s", "u_V", "dP_MPa", "Q_Lmin"])
    assert_is_the_ramp(read(text(labels, *spoiled)))
    spoiled = [line.rpartition(separator)[0] + separator + cell if n == 9 else line for n, line in enumerate(lines)]
    assert_is_the_ramp(read(text(labels, "# a comment", *spoiled)), np.arange(TIME.size) != 9)


def test_a_header_that_begins_with_a_digit_may_stand_there_again(here):
    lines = rows(TIME, U, DP, Q)
    head = "1st Zeit [s];u_V;dP_MPa;Q_Lmin"
    content = text(head, *lines[:500], head, *lines[500:])
    assert_is_the_ramp(read(content, columns={"time": "1st Zeit [s]"}))


def test_a_row_of_units_is_no_first_sample_and_may_say_what_labels_say(here):
    assert_is_the_ramp(read(text("t_s;u;dP_MPa;Q_Lmin", "sec;V;MPa;l/min", *rows(TIME, U, DP, Q))))


@pytest.mark.parametrize(
    ("labels", "units", "words"),
    [
        ("t_s;u;dP_MPa;Q_Lmin", "s;V;MPa;l/h", "'Q_Lmin' says 'Lmin' in its label, and 'l/h' is stated as its unit"),
        ("t_s;u;dP_bar;Q_Lmin", "s;V;MPa;l/min", "'dP_bar' says 'bar' in its label, and 'MPa' is stated as its unit"),
        ("t_s;u_V;dP_MPa;Q_Lmin", "ms;%;MPa;mA", "'t_s' says 's' in its label, and 'ms' is stated as its unit"),
        ("t_s;u_V;dP_MPa;Q_Lmin", "s;%;MPa;l/min", "'u_V' says 'V' in its label, and '%' is stated as its unit"),
        ("t_s;u_V;dP_MPa;Q_Lmin", "s;V;MPa;mA", "'Q_Lmin' says 'Lmin' in its label, and 'mA' is stated as its unit"),
    ],
)
def test_units_that_contradict_each_other(here, labels, units, words):
    content = text(labels, units, *rows(TIME, U, DP, Q))
    assert words in refusal(content)
    label, own = words.split("'")[1:4:2]
    quantity = {"t_s": "time"}.get(label, label.partition("_")[0])
    assert words in refusal(content, columns={quantity: label})
    if quantity in ("dP", "Q"):  # no other label is contradicted
        assert read(content, columns={quantity: f"{label}:{own}"}).dp.max() > 0


def test_thousands_are_read_as_they_are_meant(here):
    assert read(excel_english()).dp[0] == pytest.approx(2e6)


def test_thousands_that_the_same_column_shows_further_down(here):
    pressures = [f"{2000 + index % 7:,.1f}".translate(str.maketrans(",.", ".,")) for index in range(TIME.size)]
    lines = text("t_s;u_V;dP_kPa;Q_Lmin", *rows(TIME, U, pressures, Q)).decode().split("\n")
    first = [line.replace(",0;", ";") if index > 500 else line for index, line in enumerate(lines)]
    last = [line.replace(",0;", ";") if index < 500 else line for index, line in enumerate(lines)]
    assert read(text(*first[:-1])).dp[[0, -1]] == pytest.approx([2e6, 2.005e6])
    assert read(text(*last[:-1])).dp[[0, -1]] == pytest.approx([2e6, 2.005e6])
    whole = [f"{n};5;2.001;3" for n in range(2000)]
    halves = [f"{n};5;2.000,5;3" for n in range(2000, 4000)]
    labels = "t_s;u_V;dP_kPa;Q_Lmin"
    assert read(text(labels, *whole, *halves)).dp[[0, -1]] == pytest.approx([2001e3, 2000.5e3])
    later = [line.replace(";2.000,5;", ";2.001;") for line in halves[1000:]]
    assert read(text(labels, *halves[:1000], *later)).dp[[0, -1]] == pytest.approx([2000.5e3, 2001e3])


@pytest.mark.parametrize("cells", [("1.999", "2", "2.001"), ("150", "150.125", "149.875"), ("2.001", "2.000", "2.002")])
def test_whole_numbers_beside_decimals_of_their_size_stay(here, cells):
    pressures = [cells[index % 3] for index in range(TIME.size)]
    test = read(text("t_s;u_V;dP_bar;Q_Lmin", *rows(TIME, U, pressures, Q, comma=False)))
    np.testing.assert_allclose(test.dp[:3], [1e5 * float(cell) for cell in cells])


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_three_digits_behind_a_point_stay_decimals(here, separator):
    labels = separator.join(["t_s", "u_V", "dP_MPa", "Q_Lmin"])
    lines = rows(TIME, U, [f"{2.001:.3f}"] * TIME.size, Q, separator=separator, comma=False)
    np.testing.assert_allclose(read(text(labels, *lines)).dp, 2.001e6)


# clocks


@pytest.mark.parametrize(
    ("first", "second", "seconds"),
    [
        ("2026-11-22 03:04:05.5", "2026-11-22 03:04:06.25", 0.75),
        ("2026-11-22T03:04:05Z", "2026-11-22T03:04:06Z", 1),
        ("2026-10-25T02:59:59.5+02:00", "2026-10-25T02:00:00+01:00", 0.5),
        ("31.12.2026 23:59:59,5", "01.01.2027 00:00:00", 0.5),
        ("11/12/2026 11:59:59 PM", "11/13/2026 12:00:00 AM", 1),
        ("12/11/2026 23:59:59", "13/11/2026 00:00:00", 1),
        ("11:59:59.5 a.m.", "12:00:00 p.m.", 0.5),
        ("23:59:59", "00:00:01", 2),
        ("26.11.22 23:59:59", "26.11.23 00:00:01", 2),
        ("22.11.26 23:59:59", "23.11.26 00:00:01", 2),
        ("30.11.26 23:59:59", "01.12.26 00:00:01", 2),
        ("99:59:59", "100:00:00", 1),
        ("03:04:05:250", "03:04:05:500", 0.25),
    ],
)
def test_stamps(here, first, second, seconds):
    lines = [f"{clock};{u:.4f};{q:.4f}" for clock, u, q in zip([first] * 30 + [second] * 30, U, Q, strict=False)]
    test = read(text("time;u [V];Q [l/min]", *lines))
    np.testing.assert_allclose(test.time, np.repeat([0.0, seconds], 30), atol=1e-6)


def test_milliseconds_beside_a_time_of_day_are_not_passed_over(here):
    clock = [stamp.partition(".")[0] for stamp in stamps("%H:%M:%S.")]
    parts = [stamp.partition(".")[2] for stamp in stamps("%H:%M:%S.")]
    content = text("Time;ms;u [V];dP [MPa];Q [l/min]", *rows(clock, parts, U, DP, Q))
    assert_is_the_ramp(read(content))
    assert_is_the_ramp(read(content, columns={"time": "Time"}))
    wrong = text("Time;ms;u [V];dP [MPa];Q [l/min]", *rows(clock, [*parts[:-1], "1000"], U, DP, Q))
    assert "row 1001, column 'ms': 1000 is no part of a second, expected 0 to 999" in refusal(wrong)
    whole = text("Time;ms;u [V];dP [MPa];Q [l/min]", *rows(stamps("%H:%M:%S."), parts, U, DP, Q))
    assert_is_the_ramp(read(whole))


def test_stamps_count_from_the_first_row_of_the_file(here):
    content = text("time;u [V];dP [MPa];Q [l/min]", *rows(stamps("%d.%m.%Y %H:%M:%S,"), U, DP, Q))
    assert_is_the_ramp(read(content))
    blank = content.replace(START.strftime("\n%d.%m.%Y %H:%M:%S,163").encode(), b"\n", 1)
    assert_is_the_ramp(read(blank), np.arange(TIME.size) != 1)


def test_whole_numbers_without_a_unit_that_can_only_be_milliseconds(here, capsys):
    assert_is_the_ramp(read(milliseconds()))
    assert main(["-v", "identify", "ramp.csv"]) == 0
    assert "warning [time-unit] ramp.csv: the time column holds whole numbers without a unit" in capsys.readouterr().out
    # As seconds these are ramps of 25 minutes: nothing is plain.
    few = milliseconds().split(b"\n")
    slow = b"\n".join([few[0], *(b"%d,%s" % (3 * n, line.split(b",", 1)[1]) for n, line in enumerate(few[1:-1]))])
    assert "column 'time' has no unit" in refusal(slow)
    assert read(milliseconds().replace(b"time", b"time_ms", 1)).clock_doubt == ""
    stated = read(milliseconds().replace(b"time", b"time_s", 1))
    assert stated.clock_doubt and stated.time[-1] == pytest.approx(1000 * TIME[-1])
    assert read(csv(ROWS).encode()).clock_doubt == ""


# transmitters


def test_a_range_in_the_unit_of_the_label(here):
    content = text("t_s,u_V,dP_MPa,Q_mV", *rows(TIME, U, DP, 200 * Q, separator=",", comma=False))
    assert_is_the_ramp(read(content, columns={"Q": "Q_mV:0..10000 mV = 0..50 L/min"}))


def test_a_range_may_fall_and_hold_other_signals(here):
    table = rows(TIME, 20 - 1.6 * U, DP, 0.2 * Q, separator=",", comma=False, form="{:.6f}")
    columns = {"u": "I:20..4 mA = 0..100 %", "Q": "F:0..10 V = 0..50 L/min"}
    assert_is_the_ramp(read(text("t_s,I,dP_MPa,F", *table), columns=columns))


@pytest.mark.parametrize(
    ("quantity", "label", "meaning", "numbers"),
    [
        ("u", "pulse_us", "1500..1900 us = 0..10 V", 1500 + 40 * U),
        ("u", "pulse", "1500..1900 µs = 0..10 V", 1500 + 40 * U),
        ("Q", "speed_mm_per_s", "0..100 mm/s = 0..20 L/min", 5 * Q),
        ("Q", "f (Hz)", "0..500 Hz = 0..60 L/min", Q / 0.12),
        ("Q", "Q_Lmin", "0..-1 L/min = 0..1 L/min", -Q),
        ("u", "u [‰]", "0..1000 ‰ = 0..10 V", 100 * U),
    ],
)
def test_a_signal_may_have_any_unit(here, quantity, label, meaning, numbers):
    labels = {"u": "u_V", "Q": "Q_Lmin"} | {quantity: label}
    columns = {"u": U, "Q": Q} | {quantity: numbers}
    table = rows(TIME, columns["u"], DP, columns["Q"], separator=",", comma=False, form="{:.6f}")
    content = text(f"t_s,{labels['u']},dP_MPa,{labels['Q']}", *table)
    assert_is_the_ramp(read(content, columns={quantity: f"{label}:{meaning}"}))


# what is no recording


def test_artefacts_beside_recordings(here, capsys):
    Path("a.csv").write_text(csv(ROWS))
    assert main(["identify", "a.csv"]) == 0
    Path("manifest.json").write_text(json.dumps({"schema": "dzdesign.simulation/1"}))
    capsys.readouterr()
    assert main(["identify", "*.csv", "manifest.json", "-o", "b.json"]) == 0
    assert "'manifest.json' is left out: a manifest that dzdesign writes" in capsys.readouterr().err
    for name in ("manifest.json", "valve.json"):
        assert main(["identify", name, "-o", "c.json"]) == 2
        assert f"'{name}' is JSON, such as a file that dzdesign wrote" in capsys.readouterr().err
    assert main(["identify", "a.csv", "valve.json", "-o", "c.json"]) == 2
