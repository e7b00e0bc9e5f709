"""Dates and times of day in a column of text, as seconds since the first row.

``2026-11-22T03:04:05.123+01:00``, ``22.11.2026 03:04:05,123``, ``11/22/2026 03:04:05:123``, ``3:04:05.1 PM``,
``03:04:05``; an apostrophe before it, by which loggers keep a spreadsheet from reading it, counts for nothing. Which
part of a date is the day and which the month matters only where a recording goes over midnight.
"""

import datetime
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.errors import InputError

if TYPE_CHECKING:
    import polars as pl

#: A stamp: date (may lack), hours, minutes, seconds with their fraction, half of the day, zone.
STAMP = (
    r"^'?(?:(\d{1,4}[-./]\d{1,2}[-./]\d{1,4})[T ,]\s?)?(\d{1,3}):([0-5]?\d):([0-6]?\d(?:[.,:]\d{1,9})?)"
    r"(?:\s?([AaPp])\.?[Mm]\.?)?\s?(Z|UTC|[-+]\d\d:?\d\d)?$"
)
#: What looks like one and lacks seconds or the time: which of the two numbers are minutes can't be told.
UNCLEAR = re.compile(r"\d{1,3}:[0-5]?\d(?:[.,]\d+)?|\d{1,4}[-./]\d{1,2}[-./]\d{1,4}(?:[T ]\d{1,2}:\d\d)?")
#: A date with its year first or last, and what begins as one.
DATE = re.compile(r"'?(?:\d{4}[-./]\d{1,2}[-./]\d{1,2}|\d{1,2}[-./]\d{1,2}[-./](?:\d{4}|\d{2}))")
START_OF_DATE = re.compile(r"'?\d{1,4}[-./]")
LONGEST_STAMP = 48
DAY = 86_400.0
#: A time of day that goes back by more than this is one of the next day, s.
MIDNIGHT = DAY / 2
#: Days that no recording goes on for: a reading of two dates with more between them is not what was meant.
LONGEST_RECORDING = 300
EXAMPLE = "2026-11-22 03:04:05.123, 22.11.2026 03:04:05,123 or 03:04:05.123"


@dataclass(frozen=True, slots=True)
class Start:
    """Date and time at which a clock counts zero."""

    #: s since the first day of the calendar; UTC where the zone is stated, else on the logger's own clock.
    seconds: float
    has_zone: bool


def is_stamp(cell: str) -> bool:
    """Tell whether a cell holds a time of day, with a date or without.

    Examples
    --------
    >>> is_stamp("22.11.2026 03:04:05,123"), is_stamp("03:04:05"), is_stamp("03:04"), is_stamp("3.04")
    (True, True, False, False)
    """
    return len(cell) <= LONGEST_STAMP and re.match(STAMP, cell) is not None


def is_time_of_day(cell: str) -> bool:
    """Tell whether a cell holds a time of day without a date.

    Examples
    --------
    >>> is_time_of_day("03:04:05,123"), is_time_of_day("22.11.2026 03:04:05,123")
    (True, False)
    """
    return is_stamp(cell) and START_OF_DATE.match(cell) is None


def is_date(cell: str) -> bool:
    """Tell whether a cell holds a date and nothing else.

    Examples
    --------
    >>> is_date("22.11.2026"), is_date("2026/11/22"), is_date("22.11.2026 03:04"), is_date("31.31.2026")
    (True, True, False, False)
    """
    return DATE.fullmatch(cell) is not None and bool(_days(cell.lstrip("'")))


def is_unclear(cell: str) -> bool:
    """Tell whether a cell looks like a time whose parts can't be told: ``03:04``, or a date without a time."""
    return len(cell) <= LONGEST_STAMP and UNCLEAR.fullmatch(cell) is not None


def seconds_of_stamps(cells: "pl.Series", where: str) -> np.ndarray:
    """Return stamps, without blanks around them, as seconds since the first of a file; NaN where a cell is empty.

    Raises
    ------
    InputError
        If a date can't be told.
    """
    import polars as pl

    parts = cells.str.extract_groups(STAMP).struct.unnest()
    date, hour, minute, second, half, zone = (parts.to_series(index) for index in range(6))
    number = pl.Float64
    hours = hour.cast(number, strict=False)
    if half.null_count() < half.len():  # 12 AM is midnight, 12 PM noon
        afternoon = half.str.to_lowercase() == "p"
        hours = (hours % 12) + 12.0 * afternoon.cast(number).fill_null(0.0)
    point = second.str.replace(r"[,:]", ".").cast(number, strict=False)
    of_day = 3600.0 * hours + 60.0 * minute.cast(number, strict=False) + point
    seconds: np.ndarray = of_day.fill_null(np.nan).to_numpy()
    if zone.null_count() < zone.len():
        seconds = seconds - _replaced(zone, {text: _zone(text) for text in _different(zone)})
    if date.null_count() < date.len():
        seconds = seconds + _replaced(date, _days_since_the_first(_different(date), where))
    else:
        seconds = _over_midnight(seconds)
    known = seconds[np.isfinite(seconds)]
    return seconds - known[0] if known.size else seconds


def start_of(cell: str) -> Start | None:
    """Return the date and time in a cell; None where it has no date, or one whose day and month can't be told apart.

    Examples
    --------
    >>> start_of("2026-11-22 03:04:05").seconds - start_of("22.11.2026 03:04:04,5").seconds, start_of("03:04:05")
    (0.5, None)
    """
    found = re.match(STAMP, cell)
    days = set(_days(found[1]).values()) if found and found[1] else set()
    if found is None or len(days) != 1:
        return None
    _, hour, minute, second, half, zone = found.groups()
    hours = int(hour) % 12 + 12 * (half in ("P", "p")) if half else int(hour)
    of_day = 3600.0 * hours + 60.0 * int(minute) + float(re.sub("[,:]", ".", second))
    return Start(DAY * days.pop() + of_day - (_zone(zone) if zone else 0.0), has_zone=bool(zone))


def _different(texts: "pl.Series") -> list[str]:
    """Return the different texts, the first of the file first; there are few."""
    return list(texts.unique(maintain_order=True).drop_nulls())


def _replaced(texts: "pl.Series", numbers: dict[str, float]) -> np.ndarray:
    """Return the number that each text means, 0 where there is none."""
    import polars as pl

    return np.asarray(texts.replace_strict(numbers, default=0.0, return_dtype=pl.Float64).fill_null(0.0).to_numpy())


def _over_midnight(seconds: np.ndarray) -> np.ndarray:
    """Return times of day that go on where they go back by more than half a day."""
    known = np.flatnonzero(np.isfinite(seconds))
    steps = np.diff(seconds[known], prepend=seconds[known[:1]])
    seconds = seconds.copy()
    seconds[known] += DAY * np.cumsum(steps < -MIDNIGHT)
    return seconds


def _days_since_the_first(dates: list[str], where: str) -> dict[str, float]:
    """Return the seconds from the first date of the file to the midnight of each."""
    first = dates[0]
    if not _days(first):
        raise InputError(f"{where}: '{first}' is no date; write dates as 2026-11-22, or the time in seconds")
    seconds = {first: 0.0}
    for text in dates[1:]:
        both = sorted({other - one for one, other in _alike(first, text)})
        both = [days for days in both if abs(days) <= LONGEST_RECORDING] or both
        if len(both) != 1:
            count = " or ".join(map(str, both)) or "an unknown number of"
            raise InputError(
                f"{where}: from '{first}' to '{text}' it is {count} days, as it can't be told which number is "
                "the month; write dates as 2026-11-22, or the time in seconds"
            )
        seconds[text] = DAY * both[0]
    return seconds


def _alike(one: str, other: str) -> list[tuple[int, int]]:
    """Return two dates as days, in each order of their parts that both can have."""
    first, second = _days(one), _days(other)
    return [(first[order], second[order]) for order in first if order in second]


def _days(date: str) -> dict[str, int]:
    """Return order of day, month and year -> days, for each order that a date can be read in."""
    numbers = [int(part) for part in re.split(r"[-./]", date)]
    if len(date.split(".")) == 3 and numbers[0] <= 31:
        orders: tuple[str, ...] = ("dmy",) if numbers[2] > 31 else ("dmy", "ymd")
    elif numbers[0] > 31:
        orders = ("ymd",)
    elif numbers[2] > 31:
        orders = ("dmy", "mdy")
    else:
        orders = ("dmy", "mdy", "ymd")
    found = {}
    for order in orders:
        part = dict(zip(order, numbers, strict=True))
        year = part["y"] + (2000 if part["y"] < 100 else 0)
        try:
            found[order] = datetime.date(year, part["m"], part["d"]).toordinal()
        except ValueError:
            continue
    return found


def _zone(text: str) -> float:
    """Return by how many seconds a zone is ahead of UTC."""
    if text[0] not in "+-":
        return 0.0
    digits = text[1:].replace(":", "")
    return (1 if text[0] == "+" else -1) * (3600.0 * int(digits[:2]) + 60.0 * int(digits[2:]))
