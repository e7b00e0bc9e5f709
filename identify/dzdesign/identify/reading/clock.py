"""The clock of a recording: numbers or stamps, never going back; and whether its unit is plain."""

import logging
import re

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.table import Table, clean_label
from dzdesign.identify.reading.time_stamps import DAY, MIDNIGHT, Start

#: No ramp takes longer than this, s: a clock of whole numbers by which one does counts milliseconds,
LONGEST_RAMP = 3600.0
#: if its steps are of these lengths and a ramp then takes at least so long, s.
STEPS_MS, SHORTEST_RAMP = (1.0, 1000.0), 0.5
#: Shares of the largest command between which it goes in a ramp.
LOW, HIGH = 0.25, 0.75
#: A column of the milliseconds of a time of day, and a time of day that has them itself.
MILLISECONDS = re.compile(r"[\[(]?(?:ms|msec|millis|milli-?se[ck]\w{0,6})[\])]?", re.IGNORECASE)
FRACTION = re.compile(r":\d\d:\d\d[.,:]\d")
#: What is doubtful about a clock: its column has no unit and was taken as ms; or it states another, and is like ms.
ASSUMED_MS, LIKE_MS = "taken as ms", "like ms"
#: By how much a clock is set back, s, and why.
SET_BACK = {
    3600.0: "as of a clock that is set back from daylight saving time; export the time in UTC or in seconds",
    MIDNIGHT: "as of a 12-hour clock without AM and PM; export the time with 24 hours or in seconds",
}
#: Times of day of a recording that begins within so many seconds after midnight are counted from its own beginning.
ELAPSED = 1.0
logger = logging.getLogger(__name__)


def read_times_of_day(table: Table, label: str) -> tuple[np.ndarray, Start | None]:
    """Return the seconds since the first row, of a column of dates or times of day, and when that was.

    Of a pair of columns the dates are left out where they do not change just as the times pass midnight, as those of an
    export or of another time zone do not, and where the times count from zero.
    """
    seconds, start, pair = seconds_of_day_times(table, label), table.started(label), table.pair(label)
    if pair is None:
        return seconds, start
    jumps = np.any(np.abs(np.diff(seconds[np.isfinite(seconds)])) > MIDNIGHT)
    elapsed = start is not None and start.seconds % DAY < ELAPSED
    if not (jumps or elapsed):
        return seconds, start
    dates, times = pair
    why = f"'{times}' counts from zero" if elapsed else f"'{dates}' does not change just as '{times}' passes midnight"
    logger.info("'%s': %s, so the dates are not used", table.path, why)
    return seconds_of_day_times(table, times), None


def seconds_of_day_times(table: Table, label: str) -> np.ndarray:
    """Return the seconds since the first row, of a column of dates or times of day, or of a pair of them.

    Milliseconds that stand in a column of their own, as some loggers part them, are added.

    Raises
    ------
    InputError
        If a cell is no such time.
    """
    seconds = table.seconds(label)
    beside = next((other for other in table.labels if is_milliseconds(other)), None)
    if beside is None or FRACTION.search(table.cell(label, 0)):
        return seconds
    thousandths = table.numbers(beside)
    wrong = np.flatnonzero((thousandths < 0) | (thousandths >= 1000))
    if wrong.size:
        row = int(wrong[0])
        raise InputError(
            f"'{table.path}' {table.place(row)}, column '{beside}': {thousandths[row]:g} is no part of a second, "
            "expected 0 to 999 beside times in whole seconds; give that column another name if it is something else"
        )
    return seconds + thousandths / 1000


def is_milliseconds(label: str) -> bool:
    """Tell whether a label is nothing but the unit: of a clock, or of the rest of one in whole seconds.

    Examples
    --------
    >>> is_milliseconds("[ms]"), is_milliseconds("time_ms")
    (True, False)
    """
    return MILLISECONDS.fullmatch(clean_label(label)) is not None


def may_count_ms(numbers: np.ndarray, longest_step: float = STEPS_MS[1]) -> bool:
    """Tell whether the numbers of a clock may be milliseconds: whole ones, and in steps as of a logger."""
    known = numbers[np.isfinite(numbers)]
    return bool(np.all(known == np.round(known))) and STEPS_MS[0] <= _usual_step(known) <= longest_step


def _usual_step(time: np.ndarray) -> float:
    steps = np.diff(time)
    steps = steps[steps > 0]
    return float(np.median(steps)) if steps.size else 0.0


def never_back(table: Table, time: np.ndarray, complete: np.ndarray) -> np.ndarray:
    """Return times that stand still where they jitter back by less than a sample; refuse a clock that was set back.

    The times are those of the table's complete rows.
    """
    latest = np.maximum.accumulate(time)
    step = _usual_step(time)
    backwards = np.flatnonzero(latest - time > step)
    if backwards.size:
        row = int(np.flatnonzero(complete)[backwards[0]])
        back = float(latest[backwards[0]] - time[backwards[0]])
        cause = next((cause for size, cause in SET_BACK.items() if abs(back + step - size) < 1 + step), "")
        how = f"by {back / 3600:.3g} h, {cause}" if cause else (
            "; expected one recording in the order it was taken; where ramps with clocks of their own follow one "
            "another, make a file of each"
        )  # fmt: skip
        raise InputError(f"'{table.path}' {table.place(row)}: the time goes back{' ' if cause else ''}{how}")
    return latest


def clock_doubt(time: np.ndarray, u: np.ndarray, *, unit_stated: bool) -> str:
    """Return what is doubtful about the unit of a clock that `may_count_ms`: one of the two above, or nothing.

    That it is in ms is plain where a ramp would take longer than any does in seconds, and takes long enough in
    milliseconds.

    The time is as read, in s where a unit is stated.
    """
    size = np.abs(u)
    level = np.where(size > HIGH * size.max(), 1, np.where(size < LOW * size.max(), -1, 0))
    level = level[level != 0]
    ramps = int(np.count_nonzero(np.diff(level)))
    a_ramp = float(time[-1] - time[0]) / max(ramps, 1)
    if not (ramps > 0 and a_ramp > LONGEST_RAMP and a_ramp / 1000 > SHORTEST_RAMP):
        return ""
    return LIKE_MS if unit_stated else ASSUMED_MS
