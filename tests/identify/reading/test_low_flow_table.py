"""A table typed by hand: what is read of it, and what is refused, with its row and column."""

import gzip
from pathlib import Path

import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.low_flow_table import read_low_flow, readings_of_side

HEADER = "u_V,dP_MPa,Q [mL/min],Q_error [mL/min],branch"
ROW = "5.10,3.0,12,3,closing"


def table(tmp_path, *lines, name="low.csv"):
    path = tmp_path / name
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return read_low_flow(path, 10.0)


def test_a_row_is_read_in_its_units(tmp_path):
    (row,) = table(tmp_path, "# by a glass", HEADER, ROW).rows
    assert (row.u_V, row.dp_MPa, row.branch) == (5.1, 3.0, "falling")
    assert (row.q_L_min, row.q_error_L_min) == (pytest.approx(0.012), pytest.approx(0.003))
    assert row.source == "low.csv, row 3"


@pytest.mark.parametrize(
    ("header", "cells"),
    [
        ("u [%];dP_bar;Q (L/h);Q_error (L/h);branch", "51;30;0,72;0,18;falling"),
        ("branch\tQ error [L/min]\tQ [L/min]\tdP [kPa]\tu [mV]\tremark", "CLOSING\t0.003\t0.012\t3000\t5100\tcold"),
        ("command (V),dP_MPa,flow (mL/min),flow error (mL/min),Branch", '"5.10","3.0",12,3,"closing"'),
    ],
    ids=["semicolons and decimal commas", "tabs, another order, a remark", "quotes and words"],
)
def test_it_may_be_written_in_many_ways(tmp_path, header, cells):
    (row,) = table(tmp_path, header, cells).rows
    assert row.u_V == pytest.approx(5.1) and row.dp_MPa == pytest.approx(3.0) and row.branch == "falling"
    assert row.q_L_min == pytest.approx(0.012) and row.q_error_L_min == pytest.approx(0.003)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_spreadsheet_writes_marks_of_its_encoding_and_ends_of_lines(tmp_path, encoding):
    path = tmp_path / "low.csv"
    path.write_bytes("u [V];dP [MPa];Q [mm³/s];Q_error [mm³/s];branch\r\n5,10;3,0;200;50;closing\r\n".encode(encoding))
    (row,) = read_low_flow(path, 10.0).rows
    assert (row.u_V, row.q_L_min, row.q_error_L_min) == (5.1, pytest.approx(0.012), pytest.approx(0.003))


def test_it_may_be_compressed(tmp_path):
    path = tmp_path / "low.csv.gz"
    path.write_bytes(gzip.compress(f"{HEADER}\n{ROW}\n".encode()))
    assert len(read_low_flow(path, 10.0).rows) == 1


@pytest.mark.parametrize("sign", ["-", ""], ids=["as the command", "as an amount"])
def test_negative_commands_are_of_the_negative_side_whichever_sign_their_flows_have(tmp_path, sign):
    rows = f"-5.10,3.0,{sign}12,3,closing", f"-5.20,3.0,{sign}14,3,closing", "-4.90,3.0,1,3,closing"
    read = table(tmp_path, HEADER, ROW, *rows)
    assert [row.u_V for row in readings_of_side([read], -1)] == [5.1, 5.2, 4.9]
    assert [row.q_L_min for row in readings_of_side([read], -1)] == pytest.approx([0.012, 0.014, 0.001])
    assert [row.u_V for row in readings_of_side([read], 1)] == [5.1]


def test_a_little_less_than_none_within_its_error_is_none(tmp_path):
    (row,) = table(tmp_path, HEADER, "5.1,3.0,-1,3,closing").rows
    assert row.q_L_min == 0.0 and row.at_most_L_min == pytest.approx(0.003)


@pytest.mark.parametrize(
    "case",
    {
        "nothing": [""],
        "no rows": [HEADER],
        "no error": ["u_V,dP_MPa,Q [mL/min],branch", "5.1,3,12,closing"],
        "no branch": ["u_V,dP_MPa,Q [mL/min],Q_error [mL/min]", "5.1,3,12,3"],
        "no pressure drop": ["u_V,Q [mL/min],Q_error [mL/min],branch", "5.1,12,3,closing"],
        "two flows": [HEADER + ",Q [L/min]", ROW + ",0.012"],
        "no unit": ["u_V,dP_MPa,Q,Q_error [mL/min],branch", ROW],
        "another unit": ["u_V,dP_MPa,Q [mm],Q_error [mL/min],branch", ROW],
        "a cell too few": [HEADER, "5.1,3,12,3"],
        "a million columns": [HEADER + "," * 999_995, ROW],
        "no number": [HEADER, "5.1,3,a few,3,closing"],
        "a number without an end": [HEADER, "5.1,3,inf,3,closing"],
        "an error of zero": [HEADER, "5.1,3,12,0,closing"],
        "an error below zero": [HEADER, "5.1,3,12,-3,closing"],
        "another branch": [HEADER, "5.1,3,12,3,up"],
        "no pressure": [HEADER, "5.1,0,12,3,closing"],
        "more than full command": [HEADER, "51,3,12,3,closing"],
        "flow against the command": [HEADER, "5.1,3,-12,3,closing"],
        "a row twice": [HEADER, ROW, ROW],
        "a mark of thousands": [HEADER.replace(",", ";"), "5.10;3.0;1,200;300;closing"],
        "negative commands with flows of both signs": [HEADER, "-5.1,3,-12,3,closing", "-5.2,3,14,3,closing"],
    }.items(),
    ids=lambda case: case[0],
)
def test_what_is_no_table_of_low_flows_is_refused(tmp_path, monkeypatch, wording, case):
    monkeypatch.chdir(tmp_path)
    Path("low.csv").write_text("\n".join(case[1]) + "\n", encoding="utf-8")
    with wording.refusal(InputError):
        read_low_flow(Path("low.csv"), 10.0)


def test_a_recording_in_place_of_a_table_is_refused(example_folder):
    with pytest.raises(InputError, match="has no column of"):
        read_low_flow(example_folder / "ramps" / "ramp_dP1_1.csv.gz", 10.0)
