"""A table of text: its columns as numbers, as times, and as they stand in the file.

A cell such as ``2.001`` or ``2,001`` may be a decimal or a number with a mark between its thousands. It is read as a
decimal, unless other cells of the file show the other mark as the decimal one, or stand beside it without a mark and
are far larger: then it is refused, for nothing tells which it is, but where the same column shows it (``2.000,5``).
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.missing_values import NO_VALUE, without_markers
from dzdesign.identify.reading.table import AND, QUOTED_CHARACTERS, Table, clean_label
from dzdesign.identify.reading.time_stamps import (
    DATE_OF_A_NUMBER,
    EXAMPLE,
    LIKE_A_DATE,
    Start,
    is_date,
    is_stamp,
    is_time_of_day,
    is_unclear,
    seconds_of_stamps,
    start_of,
)

if TYPE_CHECKING:
    import polars as pl

#: What a column of the dates of its rows is called.
DATE_LABEL = re.compile(r"(?:log|mess|test)?[ _-]?(?:date|datum)|day|tag|fecha|data", re.IGNORECASE)
#: What stands between thousands and is no decimal mark anywhere: a blank, a narrow or hard one, an apostrophe.
BETWEEN_THOUSANDS = " \u00a0\u202f'\u2019"
#: A number with any decimal mark, or with blanks or the like between thousands.
NUMBER = re.compile(
    rf"[-+\u2212]?\s?(?:\d{{1,3}}(?:[{BETWEEN_THOUSANDS}]\d{{3}})+(?:[.,]\d*)?|[\d.,]*\d[.,]?(?:[eE][-+]?\d+)?)|nan",
    re.IGNORECASE,
)
#: By decimal mark: numbers with the other mark between thousands.
GROUPED = {
    ",": r"^[-+]?(?:\d{1,3}(?:\.\d{3})+|\d+)(?:,\d*)?$",
    ".": r"^[-+]?(?:\d{1,3}(?:,\d{3})+|\d+)(?:\.\d*)?$",
}
#: Numbers with one mark, and those of them whose mark may be one between thousands; 0.123 can't.
WITH_MARK = {".": r"^[-+]?\d*\.\d*(?:[eE][-+]?\d+)?$", ",": r"^[-+]?\d*,\d*(?:[eE][-+]?\d+)?$"}
DOUBTFUL = {".": r"^[-+]?[1-9]\d{0,2}(?:\.\d{3})+$", ",": r"^[-+]?[1-9]\d{0,2}(?:,\d{3})+$"}
OTHER = {".": ",", ",": "."}
NAMES = {".": "points", ",": "commas"}
#: Rows at the beginning of a file that mostly tell.
FEW_ROWS = 200
#: A whole number without a mark that is at least so large, and by so much larger than one with it, tells thousands.
LEAST_WHOLE, FAR_LARGER = 100.0, 20.0
ADVICE = "export numbers with one mark and no separator of thousands"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TextTable(Table):
    """A table of text: its cells as they stand in the file, and where they stand in it."""

    #: A column of texts for each label, in their order; of numbers where a header states times by start and step, and
    #: where they were read.
    cells: "pl.DataFrame"
    #: Number of the header's line.
    header_line: int
    #: Numbers of the rows' lines; (N,).
    lines: np.ndarray
    #: Label of a column of time -> date and time at which it counts zero, where a header states it.
    starts: Mapping[str, str] = field(default_factory=dict)
    #: What stands for no value by the engineer's word.
    missing: Collection[str] = ()
    #: What columns that were read have shown: label -> decimal mark, a cell that shows it; and label -> mark that may
    #: be one between thousands, a cell with it, where that stands.
    _certain: dict[str, tuple[str, str]] = field(default_factory=dict)
    _doubtful: dict[str, tuple[str, str, str]] = field(default_factory=dict)
    #: First cells of columns that were looked at.
    _firsts: dict[str, str] = field(default_factory=dict)

    @property
    def header(self) -> str:
        """Where the labels stand."""
        return f" row {self.header_line}"

    def length(self, label: str) -> int:
        """Return how many rows the table has, whatever the column."""
        return len(self.lines)

    def place(self, row: int) -> str:
        """Return ``row 8``, as an editor counts."""
        return f"row {self.lines[row]}"

    def cell(self, label: str, row: int) -> str:
        """Return a cell as it stands in the file."""
        cell = self.cells[row, self.labels.index(label)] if label in self.labels else self._texts(label)[row]
        return clean_label(cell) if isinstance(cell, str) else f"{cell:g}"

    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64, NaN where the cell is blank."""
        import polars as pl

        place = self.labels.index(label)
        if self.cells.to_series(place).dtype == pl.Float64:
            return np.asarray(self.cells.to_series(place).to_numpy())
        texts = self._texts(label)
        numbers = texts.cast(pl.Float64, strict=False)
        if (numbers.is_null() & (texts != "")).any():
            texts, self.marked[label] = without_markers(texts, self.missing)
            # Before anything is said of its decimal mark: 05. Mrz, 5.0 mV.
            strange = texts.str.contains(r"[\p{L}--[eE]]") & ~texts.str.contains("(?i)^[-+]?nan$")
            self._refuse_one(label, texts, strange)
        column = self._with_points(label, texts)
        if column is not texts:
            numbers = column.cast(pl.Float64, strict=False)
        if (numbers.is_null() & (column != "")).any():
            numbers = numbers.fill_null(_plainly_written(column).cast(pl.Float64, strict=False))
            self._refuse_one(label, texts, numbers.is_null() & (column != ""))
        self.cells.replace_column(place, numbers.fill_null(np.nan))  # both would double the memory of a long recording
        return np.asarray(self.cells.to_series(place).to_numpy())

    def is_clock(self, label: str) -> bool:
        """Tell whether the first cell of a column that is not blank holds a time of day."""
        cell = self._first(label)
        if is_unclear(cell):
            raise InputError(
                f"'{self.path}' column '{label}': '{cell}' is ambiguous, as it may be hours and minutes, minutes and "
                f"seconds, or a date; expected seconds as a number, or a time such as {EXAMPLE}"
            )
        if not is_number(cell) and LIKE_A_DATE.search(cell):
            raise InputError(
                f"'{self.path}' column '{label}': '{cell[:QUOTED_CHARACTERS]}' looks like a date or time, in a form "
                f"that is not read; export it such as {EXAMPLE}, or as seconds"
            )
        return is_stamp(cell)

    def dated(self, label: str) -> str:
        """Return a column of times of day together with the only one of dates that is called so; else the label itself.

        Any other date, as of a calibration, would give the recordings a false order.
        """
        if label not in self.labels or not is_time_of_day(self._first(label)):
            return label
        dates = [each for each in self.labels if DATE_LABEL.fullmatch(each) and is_date(self._first(each))]
        both = f"{dates[0]}{AND}{label}" if len(dates) == 1 else label
        return label if both in self.labels else both

    def pair(self, text: str) -> tuple[str, str] | None:
        """Return the labels of dates and of times of day, in this order, that a text names in either.

        None where it names no such columns, or is a label itself.
        """
        if text in self.labels:
            return None
        parts = text.split(AND)
        for at in range(1, len(parts)):
            pair = AND.join(parts[:at]), AND.join(parts[at:])
            for dates, times in (pair, pair[::-1]) if set(pair) <= set(self.labels) else ():
                if is_date(self._first(dates)) and is_time_of_day(self._first(times)):
                    return dates, times
        return None

    def started(self, label: str) -> Start | None:
        """Return the date and time of the first row; None where the column has no dates."""
        if label in self.starts:
            return start_of(self.starts[label])
        return start_of(self._first(label)) if self.is_clock(label) else None

    def seconds(self, label: str) -> np.ndarray:
        """Return a column of dates or times of day as seconds since the first row of the file."""
        texts, self.marked[label] = without_markers(self._texts(label), self.missing)
        seconds = seconds_of_stamps(texts, f"'{self.path}' column '{label}'")
        bad = np.flatnonzero((texts != "").to_numpy() & np.isnan(seconds))
        if bad.size:
            row = int(bad[0])
            raise InputError(
                f"'{self.path}' {self.place(row)}, column '{label}': '{texts[row][:QUOTED_CHARACTERS]}' is no time, "
                f"expected one such as {EXAMPLE}, as above; correct it, or leave the cell blank if it is missing"
            )
        return seconds

    def _first(self, label: str) -> str:
        """Return the first cell of a column that is not blank, nor stands for no value."""
        for rows in (FEW_ROWS, None) if label not in self._firsts else ():
            texts = self._texts(label, rows)
            filled = texts.filter((texts != "") & ~texts.str.contains(NO_VALUE)).head(1)
            self._firsts[label] = str(filled[0]) if len(filled) else ""
            if len(filled):
                break
        return self._firsts[label]

    def _texts(self, label: str, rows: int | None = None) -> "pl.Series":
        """Return the cells of a column, or the first ones, as they stand in the file, without blanks and quotes."""
        import polars as pl

        pair = self.pair(label)
        if pair is None:
            cells = self.cells.to_series(self.labels.index(label)).head(self.cells.height if rows is None else rows)
            return cells.cast(pl.String).str.strip_chars(' \t"')
        dates, times = (self._texts(each, rows).str.replace("^'", "") for each in pair)
        # A date that is written once holds for the rows below it.
        dates = dates.set(dates == "", None).fill_null(strategy="forward").fill_null(strategy="backward")
        return (dates + " " + times).zip_with(times != "", times)

    def _with_points(self, label: str, texts: "pl.Series") -> "pl.Series":
        """Return numbers with a decimal point, whatever their decimal mark is, and without one between thousands.

        Raises
        ------
        InputError
            If which mark is the decimal one can't be told.
        """
        point, comma = (texts.str.contains(mark, literal=True) for mark in ".,")
        if point.any() and comma.any():
            both = texts.filter(comma & point)
            cell = both[0] if len(both) else texts.filter(comma)[0]
            mark = max(",.", key=cell.rfind)
            wrong = (~texts.str.contains(GROUPED[mark]) & (texts != "")).arg_true()
            if not len(both) or len(wrong):
                row = int(wrong[0]) if len(wrong) else int(point.arg_true()[0])
                why = f"stands in one column with '{cell[:QUOTED_CHARACTERS]}', so which mark is the decimal one can't"
                raise self._doubt(label, self.place(row), texts[row], f"{why} be told")
            self._certain[label] = mark, cell
            texts = texts.str.replace_all(OTHER[mark], "", literal=True)
        else:
            mark = "," if comma.any() else "."
            for some in (texts.head(FEW_ROWS), texts):
                marked = some.str.contains(WITH_MARK[mark])
                plain = (marked & ~some.str.contains(DOUBTFUL[mark])).arg_true()
                if len(plain):
                    break
            if len(plain):
                self._certain[label] = mark, texts[int(plain[0])]
            elif marked.any():  # several points or commas in a number are left to whoever reads it to refuse
                row = int(marked.arg_true()[0])
                self._doubtful[label] = mark, texts[row], self.place(row)
                self._refuse_whole_numbers_beside(label, texts, marked, mark)
        for doubtful, (its, cell, place) in self._doubtful.items():
            for other, (decimal, example) in self._certain.items():
                if decimal != its:
                    of_other = f"decimal {NAMES[decimal]} ('{example[:QUOTED_CHARACTERS]}')"
                    why = f"or a decimal, as column '{other[:QUOTED_CHARACTERS]}' has {of_other}"
                    raise self._doubt(doubtful, place, cell, f"may be {re.sub('[.,]', '', cell)} {why}")
        return texts.str.replace(",", ".", literal=True) if mark == "," else texts

    def _refuse_whole_numbers_beside(self, label: str, texts: "pl.Series", marked: "pl.Series", mark: str) -> None:
        """Refuse a column in which 998 and 1.001 stand: nothing measured goes from one to the other."""
        import polars as pl

        numbers = texts.str.replace(mark, ".", literal=True).cast(pl.Float64, strict=False).abs()
        row = int(numbers.set(~marked, None).arg_min() or 0)
        whole = numbers.set(marked | ~texts.str.contains(r"^[-+]?\d+$"), None).arg_max()
        if whole is not None and numbers[whole] >= max(LEAST_WHOLE, FAR_LARGER * numbers[row]):
            beside = f"stands in one column with '{texts[whole][:QUOTED_CHARACTERS]}'"
            why = f"{beside}, so it may be {re.sub('[.,]', '', texts[row])} or a decimal"
            raise self._doubt(label, self.place(row), texts[row], why)

    def _doubt(self, label: str, place: str, cell: str, why: str) -> InputError:
        return InputError(f"'{self.path}' {place}, column '{label}': '{cell[:QUOTED_CHARACTERS]}' {why}; {ADVICE}")

    def _refuse_one(self, label: str, texts: "pl.Series", wrong: "pl.Series") -> None:
        """Refuse the first cell that is no number, if there is one."""
        for row in wrong.arg_true().head(1):
            cell = texts[row]
            advice = "write a plain number; if it stands for no value, leave the cell blank, or name it by --missing"
            if DATE_OF_A_NUMBER.fullmatch(cell):
                advice = "a spreadsheet makes such dates of numbers; export the recording again, do not save it there"
            elif LIKE_A_DATE.search(cell):
                advice = f"correct it; a column of the time may hold stamps such as {EXAMPLE}"
            place = f"'{self.path}' {self.place(row)}, column '{label}'"
            raise InputError(f"{place}: '{cell[:QUOTED_CHARACTERS]}' is not a number; {advice}")


def is_number(cell: str) -> bool:
    """Tell whether a cell is a number, with any decimal mark, a date or a time of day."""
    return NUMBER.fullmatch(cell) is not None or is_stamp(cell) or is_unclear(cell)


def _plainly_written(numbers: "pl.Series") -> "pl.Series":
    """Return numbers with a decimal point without blanks behind a sign or between thousands, and with a plain minus."""
    signed = numbers.str.replace("^\u2212", "-").str.replace(r"^([-+])\s", "${1}")
    grouped = signed.str.contains(rf"^[-+]?\d{{1,3}}(?:[{BETWEEN_THOUSANDS}]\d{{3}})+(?:\.\d*)?$")
    return signed.str.replace_all(f"[{BETWEEN_THOUSANDS}]", "").zip_with(grouped, signed)
