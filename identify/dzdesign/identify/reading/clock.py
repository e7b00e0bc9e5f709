"""The clock of a recording, from block to block: numbers or stamps, never going back; and whether its unit is plain."""

import re
from typing import final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.column_labels import Column
from dzdesign.identify.reading.table import Table, clean_label
from dzdesign.identify.reading.time_stamps import Stamps

#: No ramp takes longer than this, s: a clock of whole numbers by which one does counts milliseconds,
LONGEST_RAMP = 3600.0
#: if its steps are of these lengths and a ramp then takes at least so long, s.
STEPS_MS, SHORTEST_RAMP = (1.0, 1000.0), 0.5
#: Shares of the largest command between which it goes in a ramp.
LOW, HIGH = 0.25, 0.75
#: A column of the milliseconds of a time of day, and a time of day that has them itself.
MILLISECONDS = re.compile(r"[\[(]?(?:ms|msec|millis|milli-?se[ck]\w{0,6})[\])]?", re.IGNORECASE)
FRACTION = re.compile(r":\d\d:\d\d[.,:]\d")
ASSUMED_MS, LIKE_MS = "taken as ms", "like ms"


@final
class Clock:
    """The clock of one recording; where it jitters back by less than a sample it stands still."""

    def __init__(self) -> None:
        self._latest = np.empty(0)  # the last time of the block before, if there was one
        self._usual = 0.0
        self._stamps: Stamps | None = None
        self._beside: str | None = None  # label of the milliseconds, where the stamps have whole seconds
        self._is_begun = False
        self._whole = True
        self._stated = True

    def stamps(self, table: Table, column: Column) -> np.ndarray | None:
        """Return the seconds since the first row of the recording, where the column holds dates or times of day.

        Parameters
        ----------
        table : Table
            The next rows.
        column : Column
            Of the time.
        """
        if not self._is_begun:
            self._is_begun, self._stated = True, bool(column.unit)
            self._stamps = Stamps() if table.is_clock(column.label) else None
            self._beside = _milliseconds_beside(table, column.label) if self._stamps else None
        if self._stamps is None:
            return None
        seconds = table.seconds(column.label, self._stamps)
        return seconds if self._beside is None else seconds + self._fractions(table, self._beside)

    def _fractions(self, table: Table, label: str) -> np.ndarray:
        """Return the fractions of seconds that stand in a column of their own."""
        thousandths = table.numbers(label)
        wrong = np.flatnonzero((thousandths < 0) | (thousandths >= 1000))
        if wrong.size:
            row = int(wrong[0])
            raise InputError(
                f"'{table.path}' {table.place(row)}, column '{label}': {thousandths[row]:g} is no part of a second, "
                "expected 0 to 999 beside times in whole seconds; give that column another name if it is something else"
            )
        return thousandths / 1000

    def may_be_ms(self, numbers: np.ndarray) -> bool:
        """Tell whether the numbers of a column without a unit may be milliseconds, as far as their steps tell."""
        told = numbers[np.isfinite(numbers)]
        steps = np.diff(told)
        steps = steps[steps > 0]
        whole = bool(np.all(told == np.round(told)))
        return whole and steps.size > 0 and STEPS_MS[0] <= np.median(steps) <= STEPS_MS[1]

    def steady(self, table: Table, time: np.ndarray, complete: np.ndarray) -> np.ndarray:
        """Return the times of the complete rows of a block, never going back; refuse a clock that was set back.

        Parameters
        ----------
        table : Table
            The block.
        time : (M,) array
            Of its complete rows.
        complete : (N,) array of bool
            Which of its rows they are.
        """
        self._whole = self._whole and bool(np.all(time[:1000] == np.round(time[:1000])))
        time = np.concatenate([self._latest, time])
        latest = np.maximum.accumulate(time)
        steps = np.diff(time)
        self._usual = float(np.median(steps[steps > 0])) if np.any(steps > 0) else self._usual
        backwards = np.flatnonzero(latest - time > self._usual)
        if backwards.size:
            row = int(np.flatnonzero(complete)[backwards[0] - self._latest.size])
            raise InputError(
                f"'{table.path}' {table.place(row)}: the time goes back; expected one recording in the order it was "
                "taken; where ramps with clocks of their own follow one another, make a file of each"
            )
        carried, self._latest = self._latest.size, latest[-1:]
        return latest[carried:]

    def doubt(self, time: np.ndarray, u: np.ndarray) -> str:
        """Return what is doubtful about the unit of a whole recording's time, or an empty string.

        Parameters
        ----------
        time : (N,) array
            As read, in s where a unit is stated.
        u : (N,) array
            Command, V.
        """
        plain = self._stamps is None and self._whole and self._usual >= STEPS_MS[0] and _is_plainly_ms(time, u)
        if not plain:
            return ""
        return LIKE_MS if self._stated else ASSUMED_MS


def _milliseconds_beside(table: Table, label: str) -> str | None:
    """Return the column of milliseconds beside times of day in whole seconds, as some loggers part them."""
    beside = next((other for other in table.labels if is_milliseconds(other)), None)
    return None if beside is None or FRACTION.search(table.cell(label, 0)) else beside


def is_milliseconds(label: str) -> bool:
    """Tell whether a label is nothing but the unit: of a clock, or of the rest of one in whole seconds.

    Examples
    --------
    >>> is_milliseconds("[ms]"), is_milliseconds("time_ms")
    (True, False)
    """
    return MILLISECONDS.fullmatch(clean_label(label)) is not None


def _is_plainly_ms(time: np.ndarray, u: np.ndarray) -> bool:
    """Tell whether a ramp takes longer than any does in seconds, and in milliseconds long enough for one."""
    size = np.abs(u)
    level = np.where(size > HIGH * size.max(), 1, np.where(size < LOW * size.max(), -1, 0))
    level = level[level != 0]
    ramps = int(np.count_nonzero(np.diff(level)))
    a_ramp = float(time[-1] - time[0]) / max(ramps, 1)
    return ramps > 0 and a_ramp > LONGEST_RAMP and a_ramp / 1000 > SHORTEST_RAMP
