"""What is no recording, or not a whole one, is refused in one sentence, which names the file and the place in it.

One table holds what; `tests/goldens/messages.txt` holds the sentences.
"""

import datetime
import gzip
import re

import numpy as np
import pytest

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.ramp_files import read_ramp_file
from tests.identify.reading import test_channel_clocks as clocks
from tests.identify.reading.logger_files import DP, TIME, Q, U, rows, text
from tests.identify.reading.test_date_and_time import two_columns
from tests.identify.reading.test_file_formats import COLUMNS, PLAIN, frame, hdf5, mat, tdms, with_a_table
from tests.identify.reading.test_ramp_files import HEADER, spoiled, table, zipped

LABELS = "t_s;u_V;dP_MPa;Q_Lmin"
LINES = [LABELS, *rows(TIME, U, DP, Q)]


def with_line(where, line):
    """Return a recording of a logger with one line more."""
    return text(*LINES[:where], line, *LINES[where:])


def with_lines(*lines, before=""):
    """Return a short recording with some lines more, far below its header."""
    short = table().splitlines()
    return before + "\n".join([*short[:25], *lines, *short[25:]])


def kilopascals(separator=";", comma=True, quotes=""):
    """Return a recording whose pressure drops in kPa have a mark between thousands: 2.000, or 2,000 with points."""
    swap = str.maketrans(",.", ".,") if comma else {}
    pressures = [quotes + f"{2000 + index % 7:,.0f}".translate(swap) + quotes for index in range(TIME.size)]
    lines = rows(TIME, U, pressures, Q, separator=separator, comma=comma)
    return text(separator.join(["t_s", "u_V", "dP_kPa", "Q_Lmin"]), *lines)


def pressures(first, second):
    """Return a recording whose first two pressure drops, in kPa, are these cells, and the others have a comma."""
    column = [f"{value:.1f}".replace(".", ",") for value in 1000 * DP]
    column[:2] = first, second
    return text("t_s;u_V;dP_kPa;Q_Lmin", *rows(TIME, U, column, Q))


def clocked(*cells):
    """Return a recording whose times are these cells, the last of them in all rows that follow."""
    column = [cells[min(index, len(cells) - 1)] for index in range(TIME.size)]
    return text("time;u [V];Q [l/min]", *rows(column, U, Q))


def spelled(form):
    return text("time;u [V];dP [MPa];Q [l/min]", *rows([form(float(second)) for second in TIME], U, DP, Q))


def set_back(hours, form):
    """Return a recording during which the clock is set back."""
    start = datetime.datetime(2026, 10, 25, 12 if hours == 12 else 2, 59, 50)
    stamps = [start + datetime.timedelta(seconds=0.04 * row) for row in range(TIME.size)]
    cells = [f"{at.strftime(form)}{at.microsecond // 1000:03d}" for at in stamps]
    cells = [cell.replace("03:00:", "02:00:") for cell in cells] if hours == 1 else cells
    return text("time;u [V];dP [MPa];Q [l/min]", *rows(cells, U, DP, Q))


def with_cell(cell):
    """Return a recording with one cell of the flow, in row 10, replaced."""
    lines = text("time_s;u [V];dP [MPa];Q [l/min]", *rows(TIME, U, DP, Q)).split(b"\n")
    lines[9] = lines[9].rpartition(b";")[0] + b";" + cell.encode()
    return b"\n".join(lines)


def two_dates(first, second):
    """Return a recording whose dates change with its midnight, to be read with its times of day."""
    at = datetime.datetime(2026, 11, 22, 23, 59, 50)
    times = [(at + datetime.timedelta(seconds=0.04 * row)).strftime("%H:%M:%S,%f")[:-3] for row in range(TIME.size)]
    dates = [first] * 300 + [second] * (TIME.size - 300)
    return text("Datum;Uhrzeit;u [V];dP [MPa];Q [l/min]", *rows(dates, times, U, DP, Q))


def a_current(unit):
    """Return a recording whose flow is a current, and how --columns tells its range."""
    content = text("t_s,u_V,dP_MPa,F (mA)", *rows(TIME, U, DP, 4 + 0.32 * Q, separator=",", comma=False))
    return content, {"columns": {"Q": f"F (mA):{unit}" if unit else "F (mA)"}}


def plain(content, **keywords):
    return content, keywords


def of_two_solenoids():
    """Return a recording with a command for each solenoid, of which the first ends before the others."""
    whole = [f"{line},0" for line in clocks.csv().decode().splitlines()]
    return "\n".join([whole[0].replace("u_V", "uA_V")[:-1] + "uB_V", *whole[1:-9], *(line[:-1] for line in whole[-9:])])


def with_segments(of_another_clock=False):
    """Return a LabVIEW file whose second segment begins at the first one's time, or has another column."""
    if not of_another_clock:
        before, _, last = clocks.labview(segments=2).rpartition(b"AI3")
        return before + b"AI9" + last
    lines = clocks.labview(segments=2, runs_on=False).split(b"\r\n")
    return b"\r\n".join(b"Time" + 3 * b"\t08:00:00,0" if line.startswith(b"Time") else line for line in lines)


IN_LABVIEW = {"u": "AO0", "dP": "AI7", "Q": "AI3"}
#: Of a maker, the label of the time of another channel than the command.
TIMES_OF_Q = {"mat names": "t_Q_s", "csv equal labels": "Time (s)#3", "tdms": "time of Q", "hdf5 groups": "Q/time_s"}


#: Name -> content and keywords; the place that the sentence names.
REFUSED = {
    # what is no text
    "nothing": (plain(b""), ""),
    "comments only": (plain(b"\n# only this\n\n"), ""),
    "gzip, its end cut off": (plain(gzip.compress(table().encode(), mtime=0)[:-20]), ""),
    "gzip of zeros": (plain(gzip.compress(table().encode(), mtime=0)[:15] + b"\0" * 40), ""),
    "the mark of gzip": (plain(b"\x1f\x8b"), ""),
    "half of UTF-16": (plain(table().encode("utf-16")[:-1]), ""),
    "UTF-16 without a mark": (plain(table().encode("utf-16-le")), ""),
    "no text in any encoding": (plain(b"# \x81l\n" + table().encode()), "byte 3"),
    "UTF-8 in part": (plain(b"\xef\xbb\xbf# \xd6l\n" + table().encode()), "byte 6"),
    "UTF-8 and Windows-1252": (plain("# Öl\n".encode() + table().encode() + "# Öl\n".encode("cp1252")), "byte"),
    "xlsx": (plain(zipped("[Content_Types].xml")), ""),
    "ods": (plain(zipped("mimetype", "application/vnd.oasis.opendocument.spreadsheet")), ""),
    "npz": (plain(zipped("u_V.npy")), ""),
    "zip": (plain(zipped("ramp.csv")), ""),
    "xls": (plain(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"), ""),
    "MDF": (plain(b"MDF     4.10    TGT 15.0"), ""),
    "MDF, not finished": (plain(b"UnFinMF 4.10    TGT 15.0"), ""),
    "BLF": (plain(b"LOGG\x90\0\0\0\x01"), ""),
    "imc": (plain(b"|CF,2,1,1;|CK,1,3,1,1;"), ""),
    "SQLite": (plain(b"SQLite format 3\0\x10"), ""),
    "npy": (plain(b"\x93NUMPY\x01\0v\0"), ""),
    "7z": (plain(b"7z\xbc\xaf\x27\x1c\0\x04"), ""),
    "JSON": (plain(b'{"a": 1}'), ""),
    "HTML": (plain(b"<html>"), ""),
    # the header
    "a sentence above the header": (plain("Logger 3, made by hand\n" + HEADER + "\n0,0,1,0\n"), "row 3"),
    "no header": (plain(table().partition("\n")[2]), "row 1"),
    "no samples": (plain(HEADER + "\n"), ""),
    "two columns of u": (plain(table("time_s,u_V,u [V],Q_Lmin")), "row 1"),
    "pA alone": (plain(table("time_s,u_V,pA_MPa,Q_Lmin")), "row 1"),
    "pB alone": (plain(table("time_s,u_V,pB_MPa,Q_Lmin")), "row 1"),
    "a command mistyped": (plain(table("time_s,comand_V,dP_MPa,Q_Lmin")), "u=comand_V"),
    "a command by another name": (plain(table("time_s,voltage_V,dP_MPa,Q_Lmin")), "u=voltage_V"),
    "a time mistyped": (plain(table("tme_s,u_V,dP_MPa,Q_Lmin")), ""),
    "a flow by another name": (plain(table("time_s,u_V,dP_MPa,through_Lmin")), "Q=through_Lmin"),
    # units
    "time without a unit": (plain(table("time,u,dP,Q")), "column 'time'"),
    "dP without a unit": (plain(table("time_s,u_V,dP,Q_Lmin")), "column 'dP'"),
    "Q without a unit": (plain(table("time_s,u_V,dP_MPa,Q")), "column 'Q'"),
    "mpa": (plain(table("time_s,u_V,dP_mpa,Q_Lmin")), "column 'dP_mpa'"),
    "barr": (plain(table("time_s,u_V,dP [barr],Q_Lmin")), "column 'dP [barr]'"),
    "a pressure in Lmin": (plain(table("time_s,u_V,dP [Lmin],Q_Lmin")), "column 'dP [Lmin]'"),
    "a command in mA": (plain(table("time_s,u [mA],dP_MPa,Q_Lmin")), "column 'u [mA]'"),
    "a unit of powers": (plain(table("time_s,u [9**9**9**9],dP_MPa,Q_Lmin")), "column 'u [9**9**9**9]'"),
    "a flow in mA": (a_current(""), "column 'F (mA)'"),
    "a signal without a meaning": (a_current("4..20 mA"), "column 'F (mA)'"),
    "a flow in bar": (a_current("4..20 mA = 0..50 bar"), "column 'F (mA)'"),
    "a range in V of mV": (
        plain(text("t_s,u_V,dP_MPa,Q_mV", *rows(TIME, U, DP, 200 * Q, separator=",", comma=False)),
              columns={"Q": "Q_mV:0..10 V = 0..50 L/min"}), "column 'Q_mV'",
    ),
    "a range in us of ms": (
        plain(text("t_s,pulse_ms,dP_MPa,Q_Lmin", *rows(TIME, 1.5 + 0.04 * U, DP, Q, separator=",", comma=False)),
              columns={"u": "pulse_ms:1500..1900 us = 0..10 V"}), "column 'pulse_ms'",
    ),
    "a range in s": (a_current("4..20 s = 0..50 L/min"), "column 'F (mA)'"),
    "a range in ma": (a_current("4..20 ma = 0..50 L/min"), "column 'F (mA)'"),
    "a range without width": (a_current("4..4 mA = 0..50 L/min"), "column 'F (mA)'"),
    "25.000 mL/min": (a_current("4..20 mA = 0..25.000 mL/min"), "column 'F (mA)'"),
    "25,000 mL/min": (a_current("4..20 mA = 0..25,000 mL/min"), "column 'F (mA)'"),
    # rows
    "a short last row": (plain(table() + "1,2,3\n"), "row 32"),
    "a long last row": (plain("#\n" + table() + "1,2,3,4,5\n"), "row 33"),
    "decimal commas between commas": (plain(HEADER + "\n0,1,2,3,4,5,6,7\n"), "row 2"),
    "a word amid samples, padded": (plain(with_line(400, "Pause;;;")), "row 401"),
    "a word amid samples": (plain(with_line(400, "Pause")), "row 401"),
    "a word in a sample": (plain(with_line(900, "x;1,0;2,0;3,0")), "row 901"),
    "one cell at the end": (plain(with_line(1001, "40,0")), "row 1002"),
    "half a row at the beginning": (plain(with_line(1, "0,0;1,0")), "row 2"),
    "half a row at the end": (plain(with_line(1001, "40,0;1,0")), "row 1002"),
    "statistics amid samples": (plain(text(*LINES, "Mittelwert;5,0;2,0;9,9", *LINES[-3:], "Ende")), "row 1002"),
    "a word like a statistic": (plain(text(*LINES, "Mitte;5,0;2,0;9,9")), "row 1002, column 't_s'"),
    "a letter far below": (plain(with_lines("1,x,3,4")), "row 26, column 'u_V'"),
    "a letter far below, behind a comment": (plain(with_lines("1,x,3,4", before="# one\r\n\r\n")), "row 28"),
    "a short row far below": (plain(with_lines("1,2,3")), "row 26"),
    "a short row and a long one": (plain(with_lines("1,2,3", "# two", "1,2,3,4,5")), "row 26"),
    "a time far below": (plain(with_lines("0,1,2,3")), "row 26"),
    "1e9 V far below": (plain(with_lines("1,1e9,2,3")), "row 26, column 'u_V'"),
    "a long number far below": (plain(with_lines("9" * 500)), "row 26"),
    "a short row beside a long one": (
        plain("\n".join(["time_s,u_V,Q_Lmin", *(["0,1,2"] * 30), "0,1,2,", "1,2"])), "row 32",
    ),
    # cells
    **{f"{cell!r} as a number": (plain(spoiled(4, 1, cell, before="# one\n\n# two\n")), "row 8, column 'u_V'")
       for cell in ("soon", "1.2.3", "1e", "0x10", "1_0")},
    **{f"{cell} MPa": (plain(spoiled(4, 2, cell)), "row 5, column 'dP_MPa'") for cell in ("1e20", "-1e10")},
    **{f"{cell} of a spreadsheet": (plain(with_cell(cell)), "row 10, column 'Q [l/min]'")
       for cell in ("05. Mrz", "1. Jan", "Mrz 05", "5-Mar", "Mar-05", "3 mai")},
    **{f"{cell} with its unit": (plain(with_cell(cell)), "row 10, column 'Q [l/min]'")
       for cell in ("0.0 mV", "12,5 l/min", "3 %", "1.5e-3V")},
    # decimal marks
    "1.000,5 and 2000.5": (plain(pressures("1.000,5", "2000.5")), "column 'dP_kPa'"),
    "1.000 and 999,5": (plain(pressures("1.000", "999,5")), "column 'dP_kPa'"),
    "1.00,5 and 2,5": (plain(pressures("1.00,5", "2,5")), "column 'dP_kPa'"),
    "2.000 beside commas": (plain(kilopascals()), "row 2, column 'dP_kPa'"),
    "2,000 beside points": (plain(kilopascals("\t", comma=False)), "row 2, column 'dP_kPa'"),
    "2,000 in quotes": (plain(kilopascals(",", comma=False, quotes='"')), "row 2, column 'dP_kPa'"),
    **{f"998 and 1{mark}001": (
        plain(text("n;t_s;u_V;dP_kPa;Q_Lmin", *(
            f"{row};{10 * row};{row % 300};{996 + row % 9:,};{row % 300}".replace(",", mark) for row in range(900)))),
        "column 'dP_kPa'",
    ) for mark in ".,"},
    # times
    "a stamp below seconds": (plain(spoiled(2, 0, "2024-05-01 12:00:00")), "row 3, column 'time_s'"),
    "a time that goes back": (plain(spoiled(7, 0, "0.1")), "row 8"),
    "03:04": (plain(clocked("03:04")), "column 'time'"),
    "04:05,5": (plain(clocked("04:05,5")), "column 'time'"),
    "a date alone": (plain(clocked("2026-11-22")), "column 'time'"),
    "a day or a month": (plain(clocked("01/02/2026 23:59:59", "02/02/2026 00:00:00")), "column 'time'"),
    "a word for a time": (plain(clocked("03:04:05", "soon")), "row 3, column 'time'"),
    "no date": (plain(clocked("99/99/2026 03:04:05")), "column 'time'"),
    "a time of day that goes back": (plain(clocked("03:04:05", "03:03:05")), "row 3"),
    "a day or a month, in its own column": (
        plain(two_dates("01/02/2026", "02/02/2026"), columns={"time": "Datum + Uhrzeit"}), "column 'Datum + Uhrzeit'",
    ),
    "a pair that is none": (plain(two_columns(), columns={"time": "Uhrzeit + u [V]"}), "'Uhrzeit + u [V]'"),
    "a word for a date": (
        plain(two_dates("22.11.2026", "soon"), columns={"time": "Datum + Uhrzeit"}), "row 302, column 'Datum +",
    ),
    "a date with its day of the week": (plain(spelled(lambda t: f"Tue Feb  3 08:00:{t % 60:06.3f} 2026")), "'time'"),
    "a date in Japanese": (plain(spelled(lambda t: f"2026年2月3日 8時{t:.3f}")), "column 'time'"),
    "a time with points": (plain(spelled(lambda t: f"3/2/2026 8.00.{t % 60:06.3f}")), "column 'time'"),
    "the end of summer time": (plain(set_back(1, "25.10.2026 %H:%M:%S,")), "row"),
    "the end of summer time, without dates": (plain(set_back(1, "%H:%M:%S,")), "row"),
    "a clock of 12 hours": (plain(set_back(12, "%I:%M:%S,")), "row"),
    # clocks of channels
    "starts stated for some": (plain(clocks.tdms(clocks.LATE, stated=("u", "dP"))), "'Q'"),
    "no time in common": (plain(clocks.mat({**clocks.LATE, "Q": clocks.clock() + 1e4})), "'Q_Lmin'"),
    "clocks in other units": (plain(clocks.mat(clocks.LATE).replace(b"t_Q_s", b"t_Q_h")), "'Q_Lmin'"),
    "clocks without units": (plain(clocks.mat(clocks.LATE, "t_{}")), "column"),
    "times behind, equal labels": (
        plain(clocks.side_by_side(clocks.LATE, "Time (s)").replace(b"Time (s),u (V)", b"u (V),Time (s)", 1)), "'u (V)'",
    ),
    "names that tell nothing": (plain(clocks.NAMELESS), ""),
    "names that tell nothing, one declared": (plain(clocks.NAMELESS, columns={"time": "t_x_s"}), "'Q_Lmin'"),
    "a name that tells nothing": (plain(clocks.mat(clocks.EVEN).replace(b"t_Q_s", b"t_y_s")), "'Q_Lmin'"),
    "a channel without a time": (plain(clocks.tdms(clocks.LATE, timeless="dP")), "'dP'"),
    **{f"a sample rate, {maker}": (plain(clocks.MAKERS[maker](clocks.LATE), sample_rate=20.0), "--sample-rate")
       for maker in TIMES_OF_Q},
    "a sample rate, mat without units": (plain(clocks.mat(clocks.LATE, "t_{}"), sample_rate=20.0), "--sample-rate"),
    **{f"the time of Q, {maker}": (plain(clocks.MAKERS[maker](clocks.LATE), columns={"time": label}), "of time of 'u")
       for maker, label in TIMES_OF_Q.items()},
    **{f"{name} ends {rows} rows early": (plain(clocks.csv(**{name: rows})), f"'{clocks.LABELS[name]}' ends at row")
       for name, rows in (("Q", 7), ("Q", 280), ("u", 140), ("dP", 14), ("time", 9))},
    "dP and Q end early": (plain(clocks.csv(dP=700, Q=700)), "'dP_MPa' ends at row"),
    "a solenoid that ends early": (plain(of_two_solenoids(), columns={"u": "uA_V - uB_V"}), "'uA_V' ends at row"),
    **{f"LabVIEW {columns}, no command": (plain(clocks.labview(columns)), "has no column of u")
       for columns in ("One", "No", "Multi")},
    "segments of one time": (plain(with_segments(of_another_clock=True), columns=IN_LABVIEW), "row"),
    "segments of other columns": (plain(with_segments(), columns=IN_LABVIEW), "row"),
    # binary files
    "no columns of numbers": (plain(mat({"note": "none"})), ""),
    "unequal lengths": (plain(mat({**COLUMNS, "Q_Lmin": COLUMNS["Q_Lmin"][:-1]})), "column 'Q_Lmin'"),
    "a flow of no valve": (
        plain(frame("write_parquet", {**COLUMNS, "Q_Lmin": COLUMNS["Q_Lmin"] * 1e9})), "sample 16, column 'Q_Lmin'",
    ),
    "an endless pressure": (plain(frame("write_parquet", {**COLUMNS, "dP_MPa": COLUMNS["dP_MPa"] * np.inf})), ""),
    "t without a unit": (
        plain(frame("write_parquet", {"t" if name == "time_s" else name: data for name, data in COLUMNS.items()})),
        "column 't'",
    ),
    "a unit of another quantity": (plain(tdms({**PLAIN, "u": (PLAIN["u"][0], "bar")})), "column 'u'"),
    "one name in two groups": (
        plain(mat({"a": {name: COLUMNS[name] for name in ("u_V", "time_s", "Q_Lmin")},
                      "b": {"u_V": COLUMNS["u_V"]}})), "a/u_V",
    ),
    "two MATLAB tables": (plain(with_a_table({"x": TIME})), "table2struct"),
    "a MATLAB table": (plain(with_a_table({"x": TIME}, ["T"])), "table2struct"),
    "MATLAB tables beside a text": (plain(with_a_table({"note": "a"})), "table2struct"),
    "two commands": (plain(hdf5({**COLUMNS, "u [V]": COLUMNS["u_V"]})), "'u_V'"),
    "text for a command": (
        plain(frame("write_parquet", {**COLUMNS, "note": ["ok"] * 30}), columns={"u": "note:V"}), "column 'note'",
    ),
    "no Parquet": (plain(b"PAR1 this is none"), ""),
    "no Feather": (plain(b"ARROW1 this is none"), ""),
    "no TDMS": (plain(b"TDSm this is none"), ""),
    "no MATLAB": (plain(b"MATLAB 5.0 MAT-file, this is none"), ""),
    "no MATLAB 7.3": (plain(b"MATLAB 7.3 MAT-file, this is none"), ""),
    "no HDF5": (plain(b"\x89HDF\r\n\x1a\n this is none"), ""),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_it_is_refused(tmp_path, wording, name):
    (content, keywords), place = REFUSED[name]
    path = tmp_path / "ramp.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as caught:
        read_ramp_file(path, **keywords)
    sentence = str(caught.value)
    assert place in sentence and "ramp.csv'" in sentence and "\n" not in sentence
    # What a library says of a file is its own.
    wording(f"reading refuses: {name}", re.sub(r"(can be read|whole gzip file) \(.+\);", r"\1 (...);", sentence))
