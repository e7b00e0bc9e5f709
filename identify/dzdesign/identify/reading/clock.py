"""The clock of a recording: its column and whose it is, by labels; numbers or stamps, never going back; its unit."""

import logging
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.core.units import measures
from dzdesign.identify.reading.column_labels import (
    LONGEST_NAME,
    Column,
    fits,
    names_a_quantity_or_current,
    quantity_named,
    split_label,
)
from dzdesign.identify.reading.missing_values import Missing, without_placeholders
from dzdesign.identify.reading.scaling import in_SI, no_unit, scaling_of
from dzdesign.identify.reading.table import Table, clean_label
from dzdesign.identify.reading.time_stamps import DAY, MIDNIGHT, Start, start_of

#: Clocks are one where no sample is off by this share of a step: the jitter of a clock.
SAME = 1e-3
#: A column of time, and the quantity that it may name before or behind: Time, t_u, X_Value, time of Q, Flow Time.
CLOCK_OF = re.compile(
    r"((?i:time[ _]?stamp|time|zeit|x_?value)|[tT])(?:[\s_.:-]+|(?=[A-Z0-9]|d[pP]|$))(?:(?:of|for)\s)?(.*)"
)
ELAPSED_LABEL = re.compile(r"elapsed|relative|clock|uhr", re.IGNORECASE)
OF_CLOCK = re.compile(r"(.*?)[\s_.:-]+(time[ _]?stamp|time|zeit|t)", re.IGNORECASE)
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
#: By so much a column of dates may depart from the clock that it runs with: stamps of whole seconds, s.
WHOLE_SECONDS = 2.0
logger = logging.getLogger(__name__)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class _Kind:
    """What a column of time says of itself: its word, its unit, and what it is the time of.

    `unit` is empty for stamps, ``-`` where it is not known, and ``?`` for what may be a temperature as well.
    """

    word: str
    unit: str
    of: str


@final
class ClockColumns:
    """The columns of time of one table."""

    def __init__(self, table: Table) -> None:
        self._table = table
        self._kinds = {label: kind for label in table.labels if (kind := _kind_of_clock(table, label))}
        self._sure = {label: kind for label, kind in self._kinds.items() if kind.unit != "?"}
        self._places = {label: place for place, label in enumerate(table.labels)}

    @cached_property
    def labels(self) -> list[str]:
        """Those that are a time by label and unit, by their cells, or by whose they are."""
        in_doubt = len(self._sure) < len(self._kinds)
        claimed = {self.of("", label) for label in self._table.labels} if in_doubt else set()
        return [label for label in self._kinds if label in self._sure or label in claimed]

    def column(self, label: str) -> Column:
        """Return a column of time with its unit, which is empty if nobody knows it."""
        table, unit = self._table, _name_and_unit(self._table, label)[1]
        unit = unit if fits(unit, "time") else "s" if table.is_clock(label) else ""
        return Column(label=table.dated(label), unit=unit)

    def counted(self, label: str) -> Column | None:
        """Return a column that counts time by its label, be it elapsed, a sensor's or a lone t; with a known unit."""
        name, unit = _name_and_unit(self._table, label)
        if label not in self._kinds and not (ELAPSED_LABEL.fullmatch(name) and (not unit or fits(unit, "time"))):
            return None
        return Column(label=label, unit=unit if fits(unit, "time") else "")

    def of(self, quantity: str, label: str) -> str:
        """Return the column of time of a quantity's column, in a file that has several; empty where nothing tells.

        What the file states for each channel goes first. Else the time that names the quantity or its column
        (``t_u_s``, ``Flow Time``), then the only one of its group, then the one before it where all are alike.
        """
        table, times = self._table, self._kinds
        if table.clocks:
            return table.clocks.get(label, "")
        if len(times) < 2 or label in times:
            return ""
        names = {_name_and_unit(table, label)[0].casefold(), table.in_file(label).casefold(), quantity.casefold()}
        named = [
            each
            for each, kind in times.items()
            if kind.of.casefold() in names or quantity_named(kind.of) == quantity
        ]
        group = table.group(label)
        named = [each for each in named if table.group(each) == group] or named
        if named:
            return named[0] if len(named) == 1 else ""
        while len({table.group(each) for each in self._sure}) > 1:
            inside = [each for each in self._sure if table.group(each) == group]
            inside = [each for each in inside if not self._sure[each].of] or inside
            if len(inside) == 1:
                return inside[0]
            if not group:
                break
            group = group.rpartition("/")[0]
        return next((each for each in self._before_quantities if self._places[each] < self._places[label]), "")

    def are_alike(self, one: str, other: str) -> bool:
        """Tell whether the labels of two columns of time differ in nothing but the quantity or number they name."""
        kinds = [self._kinds.get(label) for label in (one, other)]
        return len({kind and (kind.word, kind.unit, bool(kind.of)) for kind in kinds}) == 1

    @cached_property
    def _before_quantities(self) -> list[str]:
        """The columns of time, the last first, of a table in which each such column stands before quantities."""
        at = [self._places[each] for each in self._sure]
        ends = [*at[1:], len(self._table.labels)]
        apart = len(at) > 1 and at[0] == 0 and all(end - index > 1 for index, end in zip(at, ends, strict=True))
        alike = all(self.are_alike(each, next(iter(self._sure))) for each in self._sure)
        if not (apart and alike) or sorted(self._table.labels) == list(self._table.labels):
            return []  # in the order of HDF5, which is the alphabet's
        return list(reversed(self._sure))


def _kind_of_clock(table: Table, label: str) -> _Kind | None:
    """Return what a column of time says of itself; None for any other."""
    name, unit = _name_and_unit(table, label)
    found, after = CLOCK_OF.fullmatch(name), OF_CLOCK.fullmatch(name)
    if unit and not measures(unit, "time"):
        return None
    if found:
        word, of = found.groups()
    elif after:
        of, word = after.groups()
    else:
        return None
    if not unit:
        try:
            unit = "" if table.is_clock(label) else "?" if len(word) == 1 else "-"
        except InputError:  # a date without a time of day
            return None
    return _Kind(word=word.lower(), unit=unit, of=of)


def _name_and_unit(table: Table, label: str) -> tuple[str, str]:
    """Return a column's label without group and unit, and the unit if it is known."""
    bare = table.in_file(label).removeprefix(f"{table.group(label)}/")[:LONGEST_NAME]
    in_label = split_label(bare)[1]
    bracket = re.compile(r"[\[(]").search(bare, 1)
    if bracket:
        return bare[: bracket.start()].rstrip(" _/"), table.units.get(label, "") or in_label
    if in_label != bare and names_a_quantity_or_current(in_label):
        return bare[: -len(in_label)].rstrip(" _/,").removesuffix(" in"), in_label
    return bare, table.units.get(label, "")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """The times of a channel, in s, NaN where one is missing, and from when they count.

    `stamp` is the date and time of zero; without a date, `of_day` is its time of day. Without a unit the numbers are as
    they stand in the file.
    """

    label: str
    seconds: np.ndarray
    stamp: Start | None
    of_day: float | None = None
    #: It counts, and is no column of dates or times of day; whether its unit is known.
    counts: bool = False
    has_unit: bool = True
    missing: Missing = field(default_factory=Missing)

    @property
    def step(self) -> float:
        """The usual step."""
        return _usual_step(self.seconds[np.isfinite(self.seconds)])

    def is_the_same(self, other: "Clock") -> bool:
        """Tell whether two clocks have the same numbers, whatever they count from."""
        one, its = self.seconds, other.seconds
        return one.size == its.size and bool(np.all(np.abs(one - its)[np.isfinite(one - its)] <= SAME * self.step))

    def ahead_of(self, other: "Clock") -> float | None:
        """Return by how much later the zero of this clock is than that of another, s; None if nobody knows."""
        if self.stamp and other.stamp and self.stamp.has_zone == other.stamp.has_zone:
            return round(self.stamp.seconds - other.stamp.seconds, 5)  # a float of seconds since year 1 has no more
        if self.of_day is not None and other.of_day is not None:
            return (self.of_day - other.of_day + DAY / 2) % DAY - DAY / 2
        counted = (self.stamp, self.of_day, other.stamp, other.of_day)
        return 0.0 if counted == (None,) * 4 else None


def read_clock(table: Table, column: Column, u_max: float, no_numbers: Sequence[float] = ()) -> Clock:
    """Return a column of time; `no_numbers` stand for no value.

    Raises
    ------
    InputError
        If it is none, or nobody knows in what its numbers are.
    """
    label = column.label
    if table.is_clock(label):
        seconds, stamp = read_times_of_day(table, label)
        known = np.flatnonzero(np.isfinite(seconds))
        day = start_of(f"2000-01-01 {table.cell(label, int(known[0]))}") if known.size and not stamp else None
        of_day = day.seconds % DAY if day else None
        missing = table.marked.get(label, Missing())
        return Clock(label=label, seconds=seconds, stamp=stamp, of_day=of_day, missing=missing)
    numbers, placeholders = without_placeholders(table.numbers(label), rises=True, declared=no_numbers)
    if column.unit or not may_count_ms(numbers):  # else the whole recording tells what they count
        numbers = in_SI(table, "time", column, numbers, scaling_of(table.path, "time", column, u_max))
    return Clock(
        label=label, seconds=numbers, stamp=table.started(label), counts=True, has_unit=bool(column.unit),
        missing=table.marked.get(label, Missing()) + placeholders,
    )  # fmt: skip


def stamp_beside(table: Table, label: str, seconds: np.ndarray) -> Start | None:
    """Return when a column that counts time is zero, by dates and times in another one; None where no such is found.

    `seconds` are the column's times, (N,), NaN where one is missing. The dates must run with them: one of a calibration
    or of an export stands still, and would give the recordings a false order.
    """
    for other in table.labels:
        if other == label:
            continue
        with suppress(InputError):  # a column that nobody chose may hold anything
            if not table.is_clock(other):
                continue
            stamps, start = read_times_of_day(table, table.dated(other))
            if start is None or stamps.size != seconds.size:
                continue
            later = (stamps - seconds)[np.isfinite(stamps - seconds)]
            if later.size and np.ptp(later) <= WHOLE_SECONDS:
                return replace(start, seconds=start.seconds + float(np.median(later)))
    return None


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


def doubt_of_clock(path: Path, clock: Clock, read: np.ndarray, time: np.ndarray, u: np.ndarray) -> str:
    """Return what is doubtful about the unit of a clock: one of the two above, or nothing; refuse one without a unit.

    `read` are the times of all rows; `time` and `u` what is left of them after thinning, in s where a unit is stated.
    That the clock is in ms is plain where a ramp would take longer than any does in seconds, and takes long enough in
    milliseconds.
    """
    doubt = ""
    if clock.counts and may_count_ms(read, longest_step=np.inf):
        size = np.abs(u)
        level = np.where(size > HIGH * size.max(), 1, np.where(size < LOW * size.max(), -1, 0))
        ramps = int(np.count_nonzero(np.diff(level[level != 0])))
        a_ramp = float(time[-1] - time[0]) / max(ramps, 1)
        is_long = ramps > 0 and a_ramp > LONGEST_RAMP and a_ramp / 1000 > SHORTEST_RAMP
        doubt = (LIKE_MS if clock.has_unit else ASSUMED_MS) if is_long else ""
    if not clock.has_unit and doubt != ASSUMED_MS:
        raise no_unit(path, "time", clock.label)
    return doubt
