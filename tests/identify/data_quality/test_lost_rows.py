"""Rows that a logger lost are counted in one warning for all recordings; a pause between ramps is none."""

import dataclasses

import numpy as np
import pytest
from corpus import cases, write

from dzdesign.identify.data_quality.recordings import about_lost_rows, find_gaps
from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.dzdesign.command_line.test_bad_input import csv, ramp
from tests.support.bench_recordings import Valve, record
from tests.support.repeatable_valves import identify


def without(test, start_s, stop_s):
    """Lose the rows between two times."""
    return test.part((test.time <= start_s) | (test.time >= stop_s))


def holed(start_s, stop_s):
    """Return the lengths of the gaps that are found in a recording that lacks a time."""
    return [gap.seconds for gap in find_gaps(without(record(Valve()), start_s, stop_s))]


def test_one_warning_counts_them_and_names_the_longest():
    whole = [record(Valve(), dp) for dp in (1.0, 3.0, 5.0)]
    tests = [without(whole[0], 34.01, 34.61), without(without(whole[1], 44.01, 45.21), 130.01, 130.41), whole[2]]
    (warning,) = (each for each in identify(tests).warnings if each.code == "lost-rows")
    assert warning.source is None
    assert "110 rows are missing in 2 of 3 recordings. The longest gap is 1.22 s in 'p_3_1.csv'" in warning.text
    assert "from 4.001 to 4.123 V" in warning.text


@pytest.mark.parametrize("lost", ["rows", "flows"])
def test_blank_cells_and_missing_rows_are_the_same(tmp_path, lost):
    lines = csv(ramp()).splitlines()
    rows = range(200, 230)
    for row in reversed(rows):
        if lost == "rows":
            del lines[1 + row]
        else:
            lines[1 + row] = lines[1 + row].rpartition(",")[0] + ","
    (tmp_path / "ramp.csv").write_text("\n".join(lines))
    (gap,) = find_gaps(read_ramp_file(tmp_path / "ramp.csv"))
    assert gap.rows == 30 and gap.source == "ramp.csv"


@pytest.mark.parametrize(
    ("start_s", "stop_s", "why"),
    [
        (0.51, 3.5, "at rest before the ramp"),
        (104.41, 105.6, "in a hold at the top"),
        (3.0, 104.2, "the rise of a saw-tooth, between two ramps"),
        (34.01, 34.15, "a few rows"),
    ],
)
def test_a_pause_is_no_loss(start_s, stop_s, why):
    assert holed(start_s, stop_s) == [], why


@pytest.mark.parametrize(("start_s", "stop_s"), [(34.01, 34.61), (3.0, 50.0), (98.0, 99.5), (50.0, 150.0)])
def test_a_gap_in_a_sweep_is_one(start_s, stop_s):
    assert holed(start_s, stop_s) == pytest.approx([stop_s - start_s], abs=0.03)


def test_a_clock_of_whole_seconds_counts_rows():
    test = record(Valve())
    test = without(dataclasses.replace(test, time=np.floor(test.time)), 33, 57)
    (gap,) = find_gaps(test)
    assert gap.seconds == 24 and abs(gap.rows - 23 * 50) <= 2 * 50  # a second has 50


def test_of_a_thinned_recording_its_own_rows_count():
    (gap,) = find_gaps(dataclasses.replace(without(record(Valve()), 34.01, 34.61), run=3))
    assert gap.rows == 3 * 30


@pytest.mark.parametrize("seed", range(3))
def test_uneven_clocks_have_no_gaps(seed):
    """A logger that writes what has changed, and one that loses a row in ten."""
    test = record(Valve())
    random = np.random.default_rng(seed)
    assert not list(find_gaps(dataclasses.replace(test, time=np.cumsum(random.exponential(0.02, test.time.size)))))
    assert not list(find_gaps(test.part(random.random(test.time.size) > 0.1)))


def test_a_clean_recording_has_none(example_tests, tmp_path):
    assert not list(about_lost_rows(example_tests))
    for case in cases():
        folder = tmp_path / case.name
        folder.mkdir()
        read = [read_ramp_file(path) for path in write(case, 909, folder)]
        assert not list(about_lost_rows(read)), case.name
