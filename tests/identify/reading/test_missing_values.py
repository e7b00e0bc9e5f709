"""Numbers that loggers write where they have no value: missing samples, which are said; a measurement stays one."""

from pathlib import Path

import numpy as np
import pytest

from dzdesign.command_line.cli import main
from dzdesign.core.errors import InputError
from dzdesign.identify.reading.missing_values import PLACEHOLDERS, describe_missing, without_placeholders
from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.dzdesign.command_line.test_bad_input import csv, ramp
from tests.support.repeatable_valves import identify

COLUMNS = {"time_s": 0, "u_V": 1, "dP_MPa": 2, "Q_Lmin": 3}
LOST = slice(350, 360)


def with_texts(text: str) -> str:
    """Return a recording with a text in place of ten flows."""
    lines = csv(ramp()).split("\n")
    for row in range(*LOST.indices(400)):
        lines[row + 1] = lines[row + 1].rpartition(",")[0] + f",{text}"
    return "\n".join(lines)


def read(folder: Path, rows: np.ndarray, header: str = "time_s,u_V,dP_MPa,Q_Lmin"):
    (folder / "ramp.csv").write_text(csv(rows, header))
    return read_ramp_file(folder / "ramp.csv")


@pytest.mark.parametrize(
    ("label", "number"),
    # A clock may go on at 9999 s after a pause.
    [(label, number) for label in COLUMNS for number in (-999.0, -999.25, 9999.0) if label != "time_s" or number < 0],
)
def test_those_rows_are_left_out_and_named(tmp_path, label, number):
    rows = ramp()
    rows[LOST, COLUMNS[label]] = number
    test = read(tmp_path, rows)
    assert test.missing == {"number": f"{number:g} in 10 rows of '{label}'"} and test.time.size == len(rows) - 10
    (warning,) = (warning for warning in identify([test]).warnings if warning.code == "missing-samples")
    assert test.missing["number"] in warning.text


def test_a_port_without_a_value_makes_no_pressure_drop(tmp_path):
    rows = ramp()
    both = np.column_stack([rows[:, :2], 10 * rows[:, 2] + 20, np.full(len(rows), 20.0), rows[:, 3]])
    both[LOST, 3] = -999
    test = read(tmp_path, both, "time_s,u_V,pA_bar,pB_bar,Q_Lmin")
    assert test.dp.max() == pytest.approx(1e6) and test.missing == {"number": "-999 in 10 rows of 'pB_bar'"}


def test_a_column_of_nothing_else_leaves_no_row_and_says_why(tmp_path, wording):
    rows = ramp()
    rows[:, 2] = -9999
    with wording.refusal(InputError):
        read(tmp_path, rows)


@pytest.mark.parametrize(
    "numbers",
    [
        pytest.param([999.0] * 9, id="a constant pressure in kPa"),
        pytest.param([0.0, 600, 9999, 10000], id="among others of its size"),
        pytest.param([-600.0, -999, 400], id="a command in mV"),
        pytest.param([np.nan] * 9, id="no number at all"),
        pytest.param([], id="no row"),
        pytest.param([0.0, 1.0, 998.0], id="none of them"),
    ],
)
def test_a_measurement_stays_one(numbers):
    left, found = without_placeholders(np.array(numbers), rises=False)
    np.testing.assert_array_equal(left, numbers)
    assert describe_missing({"x": found}) == {}


@pytest.mark.parametrize("number", PLACEHOLDERS)
def test_every_one_is_found_among_small_numbers(number):
    left, found = without_placeholders(np.array([1.0, number, 2.0]), rises=False)
    assert np.isnan(left).tolist() == [False, True, False]
    assert describe_missing({"x": found}) == {"number": f"{number:g} in 1 row of 'x'"}
    assert np.isnan(without_placeholders(np.array([1.0, number, 2.0]), rises=True)[0]).any() == (number < 0)


def test_two_kinds_in_one_column():
    left, found = without_placeholders(np.array([1.0, -999, 9999, -9999, 2.0, -9999]), rises=False)
    assert np.isnan(left).tolist() == [False, True, True, True, False, True]
    assert describe_missing({"x": found}) == {
        "number": "-9999 in 2 rows of 'x', -999 in 1 row of 'x', 9999 in 1 row of 'x'"
    }


MARKERS = (
    "---", "--", "-", "—", "-----", "N/A", "NA", "n.a.", "NULL", "(null)", "Bad", "Error", "ungültig", "***", "?",
    "no data", "1.#QNAN", "-1.#IND00", "-nan(ind)", "#N/A", "#DIV/0!", "#WERT!", "#####",
)  # fmt: skip
OVERLOADS = (
    "OL", "-OL", "O.L", "OVER", "+OVER", "- OVER", "Overload", "over range", "Überlauf", "HI", "LO", "+++++", "∞",
    "Inf", "-Infinity", "1.#INF", "9.9E+37", "-9.90E+37", "3.4E+38", "3.4028235E+38", "1E+300", "32767", "-32768",
)  # fmt: skip


@pytest.mark.parametrize(
    ("text", "kind"),
    [*((each, "marker") for each in MARKERS), *((each, "overload") for each in OVERLOADS), ("9.91e37", "number")],
)
def test_texts_of_no_value_are_counted_by_column(tmp_path, text, kind):
    (tmp_path / "ramp.csv").write_text(with_texts(text))
    test = read_ramp_file(tmp_path / "ramp.csv")
    assert test.time.size == len(ramp()) - len(range(*LOST.indices(400)))
    assert set(test.missing) == {kind} and test.missing[kind].endswith(" in 10 rows of 'Q_Lmin'")


@pytest.mark.parametrize("text", ["", " ", "nan", "NaN"])
def test_a_blank_cell_is_not_counted(tmp_path, text):
    (tmp_path / "ramp.csv").write_text(with_texts(text))
    test = read_ramp_file(tmp_path / "ramp.csv")
    assert test.time.size == len(ramp()) - 10 and not test.missing


@pytest.mark.parametrize("separator", [";", "\t", "|"])
@pytest.mark.parametrize("text", ["#N/A", "---", "OL"])
def test_a_row_may_begin_with_one(tmp_path, text, separator):
    """Also one that begins as a comment does, and a rule below header and samples is none."""
    columns = [3, 0, 1, 2]
    lines = [[line[column] for column in columns] for line in (row.split(",") for row in with_texts(text).split())]
    body = [separator.join(line) for line in lines]
    rule = separator.join(["------"] * 4)
    (tmp_path / "ramp.csv").write_text("\n".join(["# bench 3", body[0], rule, *body[1:], "------", "End"]))
    test = read_ramp_file(tmp_path / "ramp.csv")
    assert test.time.size == len(ramp()) - 10 and "Q_Lmin" in str(test.missing)


def test_an_overload_at_the_top_of_a_ramp_is_said(tmp_path):
    """Seeded: without a word the largest flow that was read would pass for the valve's own."""
    rows = ramp()
    text = csv(rows).split("\n")
    top = {row for row in range(len(rows)) if rows[row, 3] > 0.7 * rows[:, 3].max()}
    lines = [line.rpartition(",")[0] + ",OL" if row - 1 in top else line for row, line in enumerate(text)]
    (tmp_path / "ramp.csv").write_text("\n".join(lines))
    codes = {warning.code: warning.text for warning in identify([read_ramp_file(tmp_path / "ramp.csv")]).warnings}
    assert f"OL in {len(top)} rows of 'Q_Lmin'" in codes["missing-samples"] and "flow-clipped" in codes


@pytest.mark.parametrize(("text", "declared"), [("Sensor off", "sensor off"), ("-500", "-500.0")])
def test_a_text_or_number_that_is_declared(tmp_path, text, declared):
    (tmp_path / "ramp.csv").write_text(with_texts(text))
    test = read_ramp_file(tmp_path / "ramp.csv", missing=["none of it", declared])
    assert test.time.size == len(ramp()) - 10 and "Q_Lmin" in str(test.missing)


def test_the_option_names_others(tmp_path, monkeypatch, wording, capsys):
    monkeypatch.chdir(tmp_path)
    Path("ramp.csv").write_text(with_texts("Sensor off"))
    assert main(["-q", "identify", "ramp.csv", "--meter-lag", "0 s"]) == 2
    wording.of_test(capsys.readouterr().err)
    for options in (["--missing", "OFF, Sensor off"], ["--missing", "OFF", "--missing", "sensor off"]):
        assert main(["-q", "identify", "ramp.csv", "--meter-lag", "0 s", *options, "-o", "v.json"]) == 0
        assert "Sensor off in 10 rows of 'Q_Lmin'" in capsys.readouterr().out
    assert main(["-q", "init", "ramp.csv", "--missing", "Sensor off"]) == 0
    assert 'missing = ["Sensor off"]' in Path("dzdesign.toml").read_text()
    assert main(["-q", "identify", "ramp.csv", "--config", "dzdesign.toml", "-o", "v.json"]) == 0
    assert main(["-q", "identify", "ramp.csv", "--missing", "OFF,,x"]) == 2


#: A column of a ramp test as the current of a transmitter: its place, label, range, and current from its SI-like unit.
SIGNALS = {
    "u": (1, "u (mA)", "4..20 mA = 0..10 V", lambda u: 4 + 1.6 * u),
    "both signs": (1, "u (mA)", "4..20 mA = -10..10 V", lambda u: 12 + 0.8 * u),
    "dP": (2, "dP (mA)", "4..20 mA = 0..25 MPa", lambda dp: 4 + 0.64 * dp),
    "Q": (3, "Q (A)", "0.004..0.020 A = 0..50 L/min", lambda q: 0.004 + 0.00032 * q),
    "shunt": (1, "u [V]", "4..20 mA on 150 ohm = 0..10 V", lambda u: 0.6 + 0.24 * u),
    "backwards": (1, "u (mA)", "20..4 mA = 0..10 V", lambda u: 20 - 1.6 * u),
}


def transmitted(folder: Path, which: str, share: float | None):
    """Return the recording of `SIGNALS` in which some rows have that share of a signal of 4 mA, and their label."""
    column, label, meaning, current = SIGNALS[which]
    rows, labels = ramp(), list(COLUMNS)
    rows[:, column], labels[column] = current(rows[:, column]), label
    live_zero = current(0) if which not in ("both signs", "backwards") else 4
    if share is not None:
        rows[LOST, column] = share * live_zero
    lines = [",".join(f"{value:.6f}" for value in row) for row in rows]
    (folder / "ramp.csv").write_text("\n".join([",".join(labels), *lines]))
    quantity = which if which in ("dP", "Q") else "u"
    return read_ramp_file(folder / "ramp.csv", columns={quantity: f"{label}:{meaning}"}), label


@pytest.mark.parametrize(
    ("share", "words"), [(0.0, "below 2 mA"), (0.49, "below 2 mA"), (0.51, ""), (0.89, ""), (5.3, "")]
)
@pytest.mark.parametrize("which", SIGNALS)
def test_a_failed_transmitter_gives_no_sample(tmp_path, which, share, words):
    whole, _ = transmitted(tmp_path, which, None)
    assert not whole.missing and whole.time.size == len(ramp())
    test, label = transmitted(tmp_path, which, share)
    assert test.missing == ({"signal": f"a current {words} in 10 rows of '{label}'"} if words else {})
    assert test.time.size == whole.time.size - (10 if words else 0)
    assert (bool(words) or which in ("dP", "Q")) is bool(np.all(np.isin(test.u, whole.u)))
    if words and which == "u":
        (warning,) = (each for each in identify([test]).warnings if each.code == "missing-samples")
        assert test.missing["signal"] in warning.text


@pytest.mark.parametrize("meaning", ["0..20 mA = 0..10 V", "4..20 V = 0..10 V"])
def test_a_signal_without_a_live_zero_may_be_zero(tmp_path, meaning):
    (tmp_path / "ramp.csv").write_text(csv(ramp(), "time_s,u,dP_MPa,Q_Lmin"))
    test = read_ramp_file(tmp_path / "ramp.csv", columns={"u": f"u:{meaning}"})
    assert test.time.size == len(ramp()) and not test.missing


def test_noise_about_the_live_zero_is_not_cut_off(tmp_path):
    """Seeded: without the readings below 3.6 mA the noise of a meter has one side, and thresholds come out too high."""
    noise = np.random.default_rng(1).normal(0, 0.03, len(ramp()))
    rows = ramp()
    rows[:, 3] = 3.6 + noise
    (tmp_path / "ramp.csv").write_text(csv(rows, "time_s,u_V,dP_MPa,I [mA]"))
    test = read_ramp_file(tmp_path / "ramp.csv", columns={"Q": "I [mA]:4..20 mA = 0..80 L/min"})
    assert test.time.size == len(rows) and not test.missing
