"""Numbers that loggers write where they have no value: missing samples, which are said; a measurement stays one."""

from pathlib import Path

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.missing_values import PLACEHOLDERS, describe_placeholders, without_placeholders
from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.dzdesign.command_line.test_bad_input import csv, ramp
from tests.support.repeatable_valves import identify

COLUMNS = {"time_s": 0, "u_V": 1, "dP_MPa": 2, "Q_Lmin": 3}
LOST = slice(350, 360)


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
    assert test.no_values == f"{number:g} in 10 rows of '{label}'" and test.time.size == len(rows) - 10
    (warning,) = (warning for warning in identify([test]).warnings if warning.code == "missing-samples")
    assert test.no_values in warning.text


def test_a_port_without_a_value_makes_no_pressure_drop(tmp_path):
    rows = ramp()
    both = np.column_stack([rows[:, :2], 10 * rows[:, 2] + 20, np.full(len(rows), 20.0), rows[:, 3]])
    both[LOST, 3] = -999
    test = read(tmp_path, both, "time_s,u_V,pA_bar,pB_bar,Q_Lmin")
    assert test.dp.max() == pytest.approx(1e6) and test.no_values == "-999 in 10 rows of 'pB_bar'"


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
    assert describe_placeholders({"x": found}) == ""


@pytest.mark.parametrize("number", PLACEHOLDERS)
def test_every_one_is_found_among_small_numbers(number):
    left, found = without_placeholders(np.array([1.0, number, 2.0]), rises=False)
    assert np.isnan(left).tolist() == [False, True, False]
    assert describe_placeholders({"x": found}) == f"{number:g} in 1 row of 'x'"
    assert np.isnan(without_placeholders(np.array([1.0, number, 2.0]), rises=True)[0]).any() == (number < 0)


def test_two_kinds_in_one_column():
    left, found = without_placeholders(np.array([1.0, -999, 9999, -9999, 2.0, -9999]), rises=False)
    assert np.isnan(left).tolist() == [False, True, True, True, False, True]
    assert describe_placeholders({"x": found}) == "-9999 in 2 rows of 'x', -999 in 1 row of 'x', 9999 in 1 row of 'x'"
