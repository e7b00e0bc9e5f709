"""One ramp test as loggers and spreadsheets write it: name -> bytes, and what the engineer has to say of the columns.

Formats are imitated from what such programs are known to write, not copied: what matters is what stands around the
table, between its cells and in its clock.
"""

import datetime
import io
from collections.abc import Callable

import numpy as np

from tests.dzdesign.command_line.test_bad_input import ramp

#: Time in s, command in V, pressure drop in MPa, flow in L/min; 40 ms from row to row.
ROWS = ramp(2.0)
TIME, U, DP, Q = ROWS.T
START = datetime.datetime(2026, 11, 22, 3, 4, 5, 123000)


def rows(*columns, separator=";", comma=True, form="{:.4f}", end=""):
    """Return lines of a table; a column of texts stays as it is."""
    texts = [
        [cell if isinstance(cell, str) else form.format(cell).replace(".", "," if comma else ".") for cell in column]
        for column in columns
    ]
    return [separator.join(cells) + end for cells in zip(*texts, strict=True)]


def stamps(form, start=START, step=0.04):
    times = [start + datetime.timedelta(seconds=step * index) for index in range(TIME.size)]
    return [f"{time.strftime(form)}{time.microsecond // 1000:03d}" for time in times]


def text(*lines, end="\n", encoding="utf-8"):
    return (end.join(lines) + end).encode(encoding)


def catman():
    """A measuring amplifier's program in German: a long preamble of tabs, names, units, decimal commas, cp1252."""
    head = ["HBM_CATMAN_ASCII\t1.0", "Datei:\tC:\\Prüfstand\\Öl 46\\1.bin", "Datum:\t22.11.2026\tUhrzeit:\t03:04:05",
            "Messrate\t25\tHz", "Kanäle\t4", "", "Kommentar:\tÖltemperatur 40 °C", "Kanal\tTyp\tBereich\tFilter",
            "1\tDC\t10\t0", "2\tSG\t250\t10", "3\tFB\t50\t10"]  # fmt: skip
    names = ["Zeit\tSollwert\tDruckdifferenz\tDurchfluss", "s\tV\tbar\tl/min"]
    table = rows(TIME, U, 10 * DP, Q, separator="\t")
    return text(*head, *names, *table, end="\r\n", encoding="cp1252")


def labview():
    """A measurement file with two headers that end in words of their own, and a column of comments that rows lack."""
    head = ["LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", "Decimal_Separator\t.",
            "Multi_Headings\tNo", "X_Columns\tOne", "Time_Pref\tRelative", "Operator\tBench 3", "Date\t2026/11/22",
            "Time\t03:04:05.1234567890123", "***End_of_Header***\t", "\t", "Channels\t3\t\t\t",
            "Samples\t1000\t1000\t1000\t", "Date\t2026/11/22\t2026/11/22\t2026/11/22\t",
            "Time\t03:04:05.123\t03:04:05.123\t03:04:05.123\t", "Y_Unit_Label\tVolts\tbar\tl/min\t",
            "X_Dimension\tTime\tTime\tTime\t", "X0\t0.0\t0.0\t0.0\t", "Delta_X\t0.040000\t0.040000\t0.040000\t",
            "***End_of_Header***\t\t\t\t", "X_Value\tCommand (V)\tDelta P (bar)\tFlow (l/min)\tComment"]  # fmt: skip
    return text(*head, *rows(TIME, U, 10 * DP, Q, separator="\t", comma=False), end="\r\n")


def labview_unicode():
    """What a spreadsheet calls Unicode text: UTF-16 with a mark, tabs."""
    return text("Zeit [s]\tu [V]\tΔp [bar]\tQ [l/min]", *rows(TIME, U, 10 * DP, Q, separator="\t"),
                end="\r\n", encoding="utf-16")  # fmt: skip


def national_instruments():
    """A logger's CSV: words above, a blank line, brackets."""
    head = ['"Start time","11/22/2026 3:04:05 AM"', '"Operator","K. Muster"', '"Description","ramp, 0-10 V, and down"',
            ""]  # fmt: skip
    labels = '"Time (s)","Dev1/ai0 (V)","Dev1/p_diff (bar)","Dev1/flow (L/min)"'
    return text(*head, labels, *rows(TIME, U, 10 * DP, Q, separator=",", comma=False), end="\r\n")


def excel_german():
    """A spreadsheet's export: a mark, quotes where a cell has a blank, a separator at each end, thousands by points."""
    thousands = [f"{value:,.1f}".translate(str.maketrans(",.", ".,")) for value in 1000 * DP]
    lines = rows(TIME, U, thousands, Q, end=";")
    return text("Prüfprotokoll;;;;", ";;;;", '"Zeit [s]";"u [V]";"dP [kPa]";"Q [l/min]";', *lines, end="\r\n",
                encoding="utf-8-sig")  # fmt: skip


def excel_english():
    """Thousands by commas, in quotes."""
    quoted = [f'"{value:,.2f}"' for value in 1000 * DP]
    return text("t (s),u (V),dP (kPa),Q (L/min)", *rows(TIME, U, quoted, Q, separator=",", comma=False))


def keysight():
    """A data logger: a number and a stamp with milliseconds after a colon in each row, alarms between the channels."""
    clock = stamps("%m/%d/%Y %H:%M:%S:")
    head = ["Instrument:,34980A,Address:,GPIB0::9", "Name:,ramp", "Sweep #,Time,101 <u> (VDC),Alarm 101,dP (bar),Alarm "
            "102,Q (L/min),Alarm 103"]  # fmt: skip
    numbers, alarms = [str(index) for index in range(1, TIME.size + 1)], ["0"] * TIME.size
    return text(*head, *rows(numbers, clock, U, alarms, 10 * DP, alarms, Q, alarms, separator=",", comma=False))


def picoscope():
    """An oscilloscope: names, units in brackets below, a blank line; time in ms."""
    table = rows(1000 * TIME, U, 10 * DP, Q, separator=",", comma=False, form="{:.8f}")
    return text("Time,Channel A,Channel B,Channel C", "(ms),(V),(bar),(L/min)", "", *table, end="\r\n")


def stamped(form, separator=";", comma=True):
    return lambda: text("Zeit;u [V];dP [bar];Q [l/min]".replace(";", separator),
                        *rows(stamps(form), U, 10 * DP, Q, separator=separator, comma=comma))  # fmt: skip


def over_midnight():
    return text("time;u [V];dP [bar];Q [l/min]",
                *rows(stamps("%H:%M:%S.", START.replace(hour=23, minute=59, second=50)), U, 10 * DP, Q))  # fmt: skip


def with_a_foot():
    """Words, sums and a star below the table; a program's end-of-file mark."""
    table = rows(TIME, U, 10 * DP, Q)
    return text("Zeit;u;dP;Q", "[s];[V];[bar];[l/min]", *table, "", "Ende der Messung;;;", "Datei geschlossen", "\x1a")


def with_statistics():
    """What a measuring program sums up below the samples, in numbers and in their columns."""
    words = ("Mittelwert", "Min.", "Maximum:", "StdAbw", "Std. Dev.", "Effektivwert [RMS]", "peak-to-peak")
    sums = [f"{word};5,0;20,1;9,9" for word in words]
    return text("t_s;u_V;dP_bar;Q_Lmin", *rows(TIME, U, 10 * DP, Q), "", *sums, ";;;;")


def header_again():
    """A logger that writes its heading again whenever a page is full."""
    head, units, table = "t;u;dP;Q", "s;V;bar;l/min", rows(TIME, U, 10 * DP, Q)
    return text(head, units, *table[:300], "", head, units, *table[300:700], head, units, *table[700:])


def blank_lines():
    """A file that was copied in text mode too often: a blank line after each."""
    return text("t_s,u_V,dP_bar,Q_Lmin", *rows(TIME, U, 10 * DP, Q, separator=",", comma=False), end="\r\r\n")


def saved_by_numpy():
    out = io.BytesIO()
    np.savetxt(out, np.column_stack([TIME, U, DP, Q]), delimiter=",", header="bench 3\ntime_s,u_V,dP_MPa,Q_Lmin")
    return out.getvalue()


def milliseconds():
    return text("time,u [V],dP [bar],Q [l/min]", *rows([f"{1000 * time:.0f}" for time in TIME], U, 10 * DP, Q,
                separator=",", comma=False))  # fmt: skip


def currents():
    """Transmitters of 4 to 20 mA, and a valve that is driven by a current."""
    return text("t [s],I1 (mA),I2 (mA),I3 (mA)",
                *rows(TIME, 4 + 1.6 * U, 4 + 16 * 10 * DP / 250, 4 + 16 * Q / 50, separator=",", comma=False,
                      form="{:.6f}"))  # fmt: skip


def yokogawa():
    """Date and time of day in columns of their own, units in a row, blanks around all cells."""
    date, clock = ["2026/11/22"] * TIME.size, stamps("%H:%M:%S.")
    head = ['"Model","GP10"', '"Serial No.","S5T900001"', "Data Count, 1000", "", "Date, Time, u, dP, Q"]
    return text(*head, " , , V, bar, L/min", *rows(date, clock, U, 10 * DP, Q, separator=" , ", comma=False))


def by_blanks():
    """A program of a lab: blanks between the cells, per cent signs before the preamble."""
    table = rows(TIME, U, 10 * DP, Q, separator="   ", comma=False)
    return text("%% ramp of 2026-11-22", "%% bench 3, oil 40 degC", "t[s] u[V] dP[bar] Q[L/min]", *table)


def din():
    """Labels as German standards write them."""
    return text("t/s;U/V;p_diff/bar;Q/(l/min)", *rows(TIME, U, 10 * DP, Q))


def cells_of_two_lines():
    """A spreadsheet whose headings have a line break inside."""
    return text('"Zeit\n[s]";"u\n[V]";"dP\n[bar]";"Q\n[l/min]"', *rows(TIME, U, 10 * DP, Q), end="\r\n")


def rows_that_end_in_a_separator():
    """Rows that end in a separator below a header that does not, and one padded word at the end."""
    return text("t_s;u_V;dP_bar;Q_Lmin", *rows(TIME, U, 10 * DP, Q, end=";"), "Ende;;;;")


def units_above():
    return text("s;V;bar;l/min", "t;u;dP;Q", *rows(TIME, U, 10 * DP, Q))


def many_words():
    """Sixty lines about the channels, each with as many cells as the table."""
    head = [f"Kanal {n};Typ {n};Bereich {n};Notiz {n}" for n in range(60)]
    return text(*head, "Zeit [s];u [V];dP [bar];Q [l/min]", *rows(TIME, U, 10 * DP, Q), encoding="cp1252")


def graphtec():
    """Whole seconds and their milliseconds in two columns, a blank behind each sign."""
    times = [START + datetime.timedelta(seconds=float(time)) for time in TIME]
    cells = [
        [f"{time:%Y/%m/%d %H:%M:%S}" for time in times],
        [f"{time.microsecond // 1000}" for time in times],
        *([f"{value:+.4f}".replace("+", "+ ").replace("-", "- ") for value in each] for each in (U, 10 * DP, Q)),
    ]
    head = ['"Vendor","GRAPHTEC Corporation"', "NO.,Date&Time,ms,CH1,CH2,CH3", "NO.,Time,ms,V,bar,L/min"]
    return text(*head, *rows([str(index) for index in range(TIME.size)], *cells, separator=","), end="\r\n")


def hioki():
    """An apostrophe before the stamp, so that a spreadsheet leaves it alone."""
    clock = [f"'{stamp}" for stamp in stamps("%y-%m-%d %H:%M:%S.")]
    return text('"HIOKI 8431","Ver 1.0"', '"Date Time","CH1-1[V]","CH1-2[bar]","CH1-3[L/min]"',
                *rows(clock, U, 10 * DP, Q, separator=",", comma=False))  # fmt: skip


def inca():
    """Three rows of words above the samples: names, types, units."""
    return text("timestamps\tu\tdP\tQ", "f8\tf8\tf8\tf8", "s\tV\tbar\tl/min",
                *rows(TIME, U, 10 * DP, Q, separator="\t", comma=False))  # fmt: skip


def dspace():
    """Rows that begin with what they say, as samples do not."""
    table = rows(TIME, U, 10 * DP, Q, separator=",", comma=False)
    head = ["version,1.0", "path,Model/time,Model/u,Model/dP,Model/Q", "name,time,u,dP,Q", "unit,s,V,bar,L/min"]
    return text(*head, "trace_values", *(f",{row}" for row in table))


def extremes_above():
    """The least and the largest value of each column between header and samples."""
    return text("t;u;dP;Q", "s;V;bar;l/min", "Min;0,0;20,0;-0,1", "Max;10,0;20,0;28,3", *rows(TIME, U, 10 * DP, Q))


def grouped(mark):
    """Thousands parted by what is no decimal mark, and a minus as typesetters write it."""
    pressures = [f"{1000 * value:,.2f}".replace(",", mark) for value in DP]
    flows = [f"{value:.4f}".replace("-", "\N{MINUS SIGN}") for value in Q]
    return lambda: text("t [s];u [V];dP [kPa];Q [l/min]", *rows(TIME, U, pressures, flows, comma=False))


#: Name -> what makes it, and options of `init` and `identify` that it takes beside.
FILES: dict[str, tuple[Callable[[], bytes], tuple[str, ...]]] = {
    "catman": (catman, ()),
    "LabVIEW": (labview, ("--columns", "time=X_Value:s")),
    "LabVIEW Unicode": (labview_unicode, ()),
    "National Instruments": (national_instruments, ()),
    "Excel, German": (excel_german, ()),
    "Excel, English": (excel_english, ()),
    "Keysight": (keysight, ()),
    "PicoScope": (picoscope, ()),
    "ISO stamps": (stamped("%Y-%m-%dT%H:%M:%S."), ()),
    "ISO stamps with a blank": (stamped("%Y-%m-%d %H:%M:%S.", ",", False), ()),
    "German stamps": (stamped("%d.%m.%Y %H:%M:%S,"), ()),
    "times of day": (stamped("%H:%M:%S."), ()),
    "over midnight": (over_midnight, ()),
    "a foot": (with_a_foot, ()),
    "statistics": (with_statistics, ()),
    "the header again": (header_again, ()),
    "blank lines": (blank_lines, ()),
    "numpy.savetxt": (saved_by_numpy, ()),
    "currents": (currents, ("--columns", "u=I1 (mA):4..20 mA = 0..10 V, dP=I2 (mA):4..20 mA = 0..250 bar, "
                            "Q=I3 (mA):4..20 mA = 0..50 L/min")),
    "Yokogawa": (yokogawa, ()),
    "blanks": (by_blanks, ()),
    "DIN": (din, ()),
    "cells of two lines": (cells_of_two_lines, ()),
    "units above": (units_above, ()),
    "rows that end in a separator": (rows_that_end_in_a_separator, ()),
    "many words": (many_words, ()),
    "Graphtec": (graphtec, ()),
    "Hioki": (hioki, ()),
    "INCA": (inca, ()),
    "dSPACE": (dspace, ()),
    "extremes above": (extremes_above, ()),
    "Swiss": (grouped("'"), ()),
    "blanks between thousands": (grouped(" "), ()),
    "narrow blanks between thousands": (grouped("\N{NARROW NO-BREAK SPACE}"), ()),
}  # fmt: skip
