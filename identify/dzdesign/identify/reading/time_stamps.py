"""Dates, times of day and durations in a column of text, as seconds since the first row.

``2026-11-22T03:04:05.123+01:00``, ``22.11.2026 03:04:05,123``, ``11/22/2026 03:04:05:123``, ``3:04:05.1 PM``,
``03:04:05``, ``22-Nov-2026 03:04:05``, ``20261122T030405``, ``DT#2026-11-22-03:04:05``; ``0.020 sec``, ``T#1s20ms``,
``0 days 00:00:00.02``. An apostrophe before it, by which loggers keep a spreadsheet from reading it, counts for
nothing. Which part of a date is the day and which the month matters only where a recording goes over midnight.
"""

import datetime
import re
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from dzdesign.core.errors import InputError

if TYPE_CHECKING:
    import polars as pl

#: How the names of months begin in English, German, French, Spanish, Italian, Portuguese and Dutch.
MONTHS = {
    **dict.fromkeys(("jan", "ene", "gen"), 1), **dict.fromkeys(("feb", "fév", "fev"), 2),
    **dict.fromkeys(("mar", "mär", "mrz", "mrt"), 3), **dict.fromkeys(("apr", "avr", "abr"), 4),
    **dict.fromkeys(("may", "mai", "mag", "mei"), 5), **dict.fromkeys(("jun", "juin", "giu"), 6),
    **dict.fromkeys(("jul", "juil", "lug"), 7), **dict.fromkeys(("aug", "aoû", "aou", "ago"), 8),
    **dict.fromkeys(("sep", "set"), 9), **dict.fromkeys(("oct", "okt", "ott", "out"), 10), "nov": 11,
    **dict.fromkeys(("dec", "dez", "déc", "dic"), 12),
}  # fmt: skip
MONTH = rf"(?i:{'|'.join(MONTHS)})[^\W\d_]{{0,7}}\.?"
NAMED_DATE = rf"\d{{1,4}}\.?[-/ ]?{MONTH}[-/ ,]\s?\d{{1,4}}|{MONTH}[-/ ]\d{{1,2}}[-/ ,]\s?\d{{4}}"
#: Other spellings of a stamp, and the usual one: of IEC 61131, and with no mark between the parts.
SPELLINGS = (
    (r"^(?:'|(?i:L?DT|L?DATE_AND_TIME|L?TOD|L?TIME_OF_DAY)#)", ""),
    (r"^(\d{4}-\d{1,2}-\d{1,2})-(\d)", "${1} ${2}"),
    (r"^((?:19|20)\d\d)(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])[T _-]?([01]\d|2[0-3])([0-5]\d)([0-5]\d)",
     "${1}-${2}-${3} ${4}:${5}:${6}"),
)  # fmt: skip
#: A stamp: days or a date (both may lack), hours, minutes, seconds with their fraction, half of the day, zone.
STAMP = (
    rf"^(?:(-?\d{{1,4}}) days?,? \+?|(\d{{1,4}}[-./]\d{{1,2}}[-./]\d{{1,4}}|{NAMED_DATE})[T ,]\s?)?"
    r"(\d{1,3}):([0-5]?\d):([0-6]?\d(?:[.,:]\d{1,9})?)"
    r"(?:\s?([AaPp])\.?[Mm]\.?)?\s?(Z|UTC|[-+]\d\d:?\d\d)?$"
)
#: Units of a duration, in s: as IEC 61131 writes several in one (``T#1m2s``), or one with a blank before it (MATLAB).
_PART = r"\d+(?:[.,]\d+)?\s?"
DURATION_UNITS = {
    "d|days?": 86_400.0, "h|hrs?|hours?": 3600.0, "m|mins?|minutes?": 60.0, "s|secs?|seconds?": 1.0, "ms": 1e-3,
    "us|µs|μs": 1e-6, "ns": 1e-9,
}  # fmt: skip
DURATION = (
    rf"^(?i:L?T(?:IME)?#-?(?:{_PART}(?:d|h|m|s|ms|us|ns)_?)+"
    rf"|-?{_PART}(?:days|hrs?|min|secs?|s|ms|us|µs|μs|ns))$"
)
#: What looks like one and lacks seconds or the time: which of the two numbers are minutes can't be told.
UNCLEAR = re.compile(r"\d{1,3}:[0-5]?\d(?:[.,]\d+)?|\d{1,4}[-./]\d{1,2}[-./]\d{1,4}(?:[T ]\d{1,2}:\d\d)?")
#: A date with its year first or last.
DATE = re.compile(r"'?(?:\d{4}[-./]\d{1,2}[-./]\d{1,2}|\d{1,2}[-./]\d{1,2}[-./](?:\d{4}|\d{2}))")
#: Orders of day, month and year, behind each other: of a date with points, with other marks, and with the month's name,
#: that in the midst or first.
DOTTED = ("%Y-%m-%d", "%d-%m-%Y", "%d-%m-%y", "%y-%m-%d")
FORMATS = (*DOTTED, "%m-%d-%Y", "%m-%d-%y")
OF_NAMED_MONTH = (("%Y-%m-%d", "%d-%m-%Y", "%d-%m-%y"), ("%m-%d-%Y",))
#: What may be a date or a time, in whatever form; what a spreadsheet makes of a number such as 5.3: 05. Mrz, Mar-05.
LIKE_A_DATE = re.compile(rf"\d[-/.:]\d+[-/.:]\d|\d\W{{0,3}}{MONTH}|{MONTH}\W{{0,3}}\d|\d\s?[年月日時]")
DATE_OF_A_NUMBER = re.compile(rf"\d{{1,2}}\W{{1,2}}{MONTH}|{MONTH}\W{{1,2}}\d{{1,2}}")
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
    """Tell whether a cell holds a time of day, with a date or without, or a duration with its unit.

    Examples
    --------
    >>> is_stamp("22.11.2026 03:04:05,123"), is_stamp("03:04:05"), is_stamp("03:04"), is_stamp("3.04")
    (True, True, False, False)
    >>> is_stamp("03-Feb-2026 08:00:00"), is_stamp("20260203T080000"), is_stamp("T#1s20ms"), is_stamp("0.020 sec")
    (True, True, True, True)
    """
    return len(cell) <= LONGEST_STAMP and (_parts(cell) is not None or re.match(DURATION, cell) is not None)


def is_time_of_day(cell: str) -> bool:
    """Tell whether a cell holds a time of day without a date.

    Examples
    --------
    >>> is_time_of_day("03:04:05,123"), is_time_of_day("22.11.2026 03:04:05,123")
    (True, False)
    """
    parts = _parts(cell) if len(cell) <= LONGEST_STAMP else None
    return parts is not None and parts[1] is None and parts[2] is None


def _parts(cell: str) -> re.Match[str] | None:
    """Return the parts of a stamp, however it is spelled."""
    for pattern, usual in SPELLINGS:
        cell = re.sub(pattern, re.sub(r"\$\{(\d)\}", r"\\g<\1>", usual), cell)
    return re.match(STAMP, cell)


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

    parts = _all_parts(cells)
    days, date = parts.to_series(0), parts.to_series(1)
    seconds = np.asarray((_of_day(parts) + DAY * days.cast(pl.Float64).fill_null(0.0)).fill_null(np.nan).to_numpy())
    if date.null_count() < date.len():
        different = list(date.unique(maintain_order=True).drop_nulls())  # the first of the file first; there are few
        days_of = _days_since_the_first(different, where)
        seconds = seconds + date.replace_strict(days_of, default=0.0, return_dtype=pl.Float64).fill_null(0.0).to_numpy()
    else:
        seconds = _over_midnight(seconds)
    if np.isnan(seconds).any():
        seconds = np.where(np.isnan(seconds), _durations(cells), seconds)
    known = seconds[np.isfinite(seconds)]
    return seconds - known[0] if known.size else seconds


def _all_parts(cells: "pl.Series") -> "pl.DataFrame":
    """Return the parts of stamps, however they are spelled, a column each; null where a cell is none."""
    for pattern, usual in SPELLINGS:
        cells = cells.str.replace(pattern, usual)
    return cells.str.extract_groups(STAMP).struct.unnest()


def _of_day(parts: "pl.DataFrame") -> "pl.Series":
    """Return the seconds of the day at which stamps are, in UTC where they state a zone; null where a cell is none."""
    import polars as pl

    hour, minute, second, half, zone = (parts.to_series(index) for index in range(2, 7))
    hours = hour.cast(pl.Float64)
    afternoon = (half.str.to_lowercase() == "p").cast(pl.Float64).fill_null(0.0)
    hours = hours.zip_with(half.is_null(), hours % 12 + 12 * afternoon)  # 12 AM is midnight, 12 PM noon
    ahead, minutes = (zone.str.extract(part).cast(pl.Float64).fill_null(0.0) for part in (r"^([-+]\d\d)", r"(\d\d)$"))
    zone_minutes = minutes.zip_with(~zone.str.starts_with("-").fill_null(False), -minutes)
    hours, minute = hours - ahead, minute.cast(pl.Float64) - zone_minutes
    return 3600.0 * hours + 60.0 * minute + second.str.replace(r"[,:]", ".").cast(pl.Float64)


def start_of(cell: str) -> Start | None:
    """Return the date and time in a cell; None where it has no date, or one whose day and month can't be told apart.

    Examples
    --------
    >>> start_of("2026-11-22 03:04:05").seconds - start_of("22.11.2026 03:04:04,5").seconds, start_of("03:04:05")
    (0.5, None)
    """
    import polars as pl

    found = _parts(cell) if len(cell) <= LONGEST_STAMP else None
    days = set(_days(found[2]).values()) if found and found[2] else set()
    if found is None or len(days) != 1:
        return None
    of_day = float(_of_day(_all_parts(pl.Series([cell])))[0])
    return Start(DAY * days.pop() + of_day, has_zone=bool(found[7]))


def _durations(cells: "pl.Series") -> np.ndarray:
    """Return durations with their units in s; NaN where a cell is none."""
    import polars as pl

    texts = cells.str.to_lowercase()
    seconds = np.zeros(texts.len())
    for units, factor in DURATION_UNITS.items():
        part = texts.str.extract(rf"(\d+(?:[.,]\d+)?)\s?(?:{units})(?:[^a-z]|$)").str.replace(",", ".")
        seconds += factor * part.cast(pl.Float64, strict=False).fill_null(0.0).to_numpy()
    sign = np.where(texts.str.contains("^(?:[a-z]+#)?-").fill_null(False).to_numpy(), -1.0, 1.0)
    return np.where(cells.str.contains(DURATION).fill_null(False).to_numpy(), sign * seconds, np.nan)


def _over_midnight(seconds: np.ndarray) -> np.ndarray:
    """Return times of day that go on where they go back by more than half a day."""
    known = np.flatnonzero(np.isfinite(seconds))
    steps = np.diff(seconds[known], prepend=seconds[known[:1]])
    seconds = seconds.copy()
    seconds[known] += DAY * np.cumsum(steps < -MIDNIGHT)
    return seconds


def _days_since_the_first(dates: list[str], where: str) -> dict[str, float]:
    """Return the seconds from the first date of the file to the midnight of each."""
    first, began = dates[0], _days(dates[0])
    if not began:
        raise InputError(f"{where}: '{first}' is no date; write dates as 2026-11-22, or the time in seconds")
    seconds = {first: 0.0}
    for text in dates[1:]:
        both = sorted({day - began[form] for form, day in _days(text).items() if form in began})
        both = [days for days in both if abs(days) <= LONGEST_RECORDING] or both
        if len(both) != 1:
            count = " or ".join(map(str, both)) or "an unknown number of"
            raise InputError(
                f"{where}: from '{first}' to '{text}' it is {count} days, as it can't be told which number is "
                "the month; write dates as 2026-11-22, or the time in seconds"
            )
        seconds[text] = DAY * both[0]
    return seconds


def _days(date: str) -> dict[str, int]:
    """Return format -> days, for each format that a date can be read in."""
    month = re.search(MONTH, date)
    formats: tuple[str, ...] = DOTTED if date.count(".") == 2 else FORMATS
    if month:
        of_name = MONTHS[max((name for name in MONTHS if month[0].lower().startswith(name)), key=len)]
        date, formats = f"{date[: month.start()]}-{of_name}-{date[month.end() :]}", OF_NAMED_MONTH[month.start() == 0]
    numbers, found = "-".join(re.findall(r"\d+", date)), {}
    for form in formats:
        with suppress(ValueError):
            found[form] = datetime.datetime.strptime(numbers, form).toordinal()
    return found
