"""Channels with clocks of their own: laid on the command's clock by linear interpolation, or refused by name.

Channels of separate tasks, devices or rates stand beside one another row by row without belonging together; at 0.3 V/s
a flow that is 0.24 s late moves a threshold by 80 mV. Nothing is extrapolated, nor interpolated over a pause.
"""

import logging
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.clock import SAME, Clock, ClockColumns, never_back, read_clock
from dzdesign.identify.reading.column_labels import Column
from dzdesign.identify.reading.table import AND, Table

#: Two times of one row are one where their usual difference is within this share of a step: the last digit of one.
ROUNDED = 0.1
#: A column that may be a time or not is one if it goes as far, within this share.
ALIKE_SPANS = 0.1
#: Over a pause of more than so many of its own usual steps a channel has no reading.
PAUSE = 3.0
#: Rows at the end in which a column may be blank beside others, or show something again: they were written in part.
LAST_ROWS, SHARE_OF_LAST = 2, 1e-3
#: Rows at the end of a flow that repeat one value, so many times as long as any before, within so many standard
#: deviations of the readings before, which turn so often: the column was filled up. A gap before the last rows that is
#: so many times as long as any other is its end.
HELD, LONGER_HELD, NEAR_HELD, TURNS = 10, 5, 4.0, 3
#: A channel that has no reading in more than this share of the command's rows is said in any case.
LOST = 0.1
logger = logging.getLogger(__name__)


def lay_on_one_clock(
    table: Table, found: Mapping[str, Column], data: dict[str, np.ndarray], reference: Clock, u_max: float,
    *, time_is_chosen: bool,
) -> None:  # fmt: skip
    """Lay the channels that have a clock of their own on the command's, in place; NaN where there is no reading.

    With `time_is_chosen` the user has named the column of time, which then goes for all that has none of its own.

    Raises
    ------
    InputError
        If clocks differ and have no common zero, or no time in common; if one goes back.
    """
    time = found["time"]
    clocks = ClockColumns(table)
    _refuse_another_time(table, clocks, found, reference, u_max, time_is_chosen=time_is_chosen)
    others = {column.clock.label: read_clock(table, column.clock, u_max) for column in found.values() if column.clock}
    differ = False
    for quantity, column in found.items():
        if column.clock is None:
            continue
        clock = others[column.clock.label]
        ahead = clock.ahead_of(reference)
        if clock.is_the_same(reference) and not (ahead and abs(ahead) > SAME * reference.step):
            data[quantity] = np.where(np.isfinite(clock.seconds) | np.isnan(reference.seconds), data[quantity], np.nan)
            continue
        if ahead is None:
            raise InputError(
                f"'{table.path}': '{column.label}' has a clock of its own, and from when it counts is not stated as it "
                f"is for '{found['u'].label}' ({time.label}); export both with date and time, or both from one zero"
            )
        differ = True
        data[quantity] = _laid(table, column, clock, ahead, found["u"], reference, data[quantity])
    clockless = [each.label for name, each in found.items() if name != "time" and each.label not in table.clocks]
    if differ and table.clocks and clockless:
        raise InputError(
            f"'{table.path}': '{clockless[0]}' states no time of its own, and the clocks of the other channels differ; "
            "export every channel with its start and step"
        )


def _laid(
    table: Table, column: Column, clock: Clock, ahead: float, command: Column, reference: Clock, samples: np.ndarray
) -> np.ndarray:
    """Return a channel at the times of the command's clock."""
    known = np.isfinite(clock.seconds) & np.isfinite(samples)
    its = never_back(table, clock.seconds[known], known) + ahead
    times = reference.seconds
    where = f"'{table.path}': '{column.label}' has a clock of its own ('{clock.label}')"
    ours = times[np.isfinite(times)]
    none_in_common = InputError(
        f"{where}, which begins {its[0] - ours[0] if its.size and ours.size else np.nan:.6g} s after that of "
        f"'{command.label}', so they have no time in common; export one recording with one clock, and check the units"
    )
    if its.size < 2 or ours.size < 2:
        raise none_in_common
    inner = np.searchsorted(its, times, side="right").clip(1, its.size - 1)
    tolerance = SAME * clock.step
    before, after = times - its[inner - 1], its[inner] - times
    with np.errstate(invalid="ignore"):
        on_it = (np.abs(before) <= tolerance) | (np.abs(after) <= tolerance)
        within = (before >= 0) & (after >= 0) & (before + after <= PAUSE * clock.step)
    laid = np.where(on_it | within, np.interp(times, its, samples[known]), np.nan)
    if np.isnan(laid).all():
        raise none_in_common
    missing = np.count_nonzero(np.isnan(laid) & np.isfinite(times))
    alike = np.isclose(clock.step, reference.step, rtol=1e-4)
    steps = "" if alike else f" and has a step of {clock.step:.6g} s, not {reference.step:.6g} s"
    logger.log(
        logging.WARNING if missing > LOST * times.size else logging.INFO,
        "%s: it begins %.6g s after that of '%s'%s; laid on the command's clock, with no reading in %d of %d rows",
        where, its[0] - ours[0], command.label, steps, missing, times.size,
    )  # fmt: skip
    return laid


def _refuse_another_time(
    table: Table, clocks: ClockColumns, found: Mapping[str, Column], reference: Clock, u_max: float,
    *, time_is_chosen: bool,
) -> None:  # fmt: skip
    """Refuse a second time that no channel claims and that differs: which channels were sampled by it is not known.

    Either it is labelled as the first one is, or it rises from row to row and has times in common with it: one from
    another zero, such as an uptime, tells nothing. Where the time was chosen the first kind is refused only.
    """
    time, claimed = found["time"], {clocks.of("-", label) for label in table.labels}
    claimed |= {each.clock.label for each in found.values() if each.clock} | set(time.label.split(AND))
    alone = [each.label for name, each in found.items() if name not in ("time", "u") and not each.clock]
    for label in table.labels if alone and not table.clocks else ():
        alike = clocks.are_alike(time.label, label)
        column = clocks.counted(label) if label not in claimed and (alike or not time_is_chosen) else None
        if column is None or table.length(label) != reference.seconds.size:
            continue
        try:
            if table.is_clock(label) != table.is_clock(time.label):
                continue
            clock = read_clock(table, column if column.unit else replace(column, unit=time.unit), u_max)
        except InputError:  # text, or a time that can't be read
            continue
        its = clock.seconds + (clock.ahead_of(reference) or 0.0)
        both = np.isfinite(its) & np.isfinite(reference.seconds)
        its, ours = its[both], reference.seconds[both]
        rises = its.size > 1 and np.all(np.diff(its) > 0) and its[0] <= ours[-1] and its[-1] >= ours[0]
        if not column.unit:  # it may be a temperature, or the number of the row
            rises = rises and abs(np.ptp(its) - np.ptp(ours)) <= ALIKE_SPANS * np.ptp(ours)
        far = rises and abs(float(np.median(its - ours))) > ROUNDED * reference.step
        if far or (alike and its.size and not clock.is_the_same(reference)):
            choose = "" if alike else f', or choose one for all: --columns "time={time.label}"'
            raise InputError(
                f"'{table.path}' has times '{time.label}' and '{label}' that differ, by {its[0] - ours[0]:.6g} s at "
                f"first and {its[-1] - ours[-1]:.6g} s at last, and which is that of '{alone[-1]}' can't be told; name "
                f"each by its quantity, such as t_u_s and t_Q_s{choose}"
            )


def _held_to_the_end(values: np.ndarray) -> int:
    """Return how many rows at the end repeat one value, of a column whose readings scatter up to there; else 0.

    A meter that jumps to zero below its floor does not scatter about what it repeats.
    """
    if not np.isfinite(values[-HELD:]).all() or values.size < 4 * HELD:
        return 0
    ends = np.flatnonzero(np.diff(values, append=np.nan) != 0)
    runs = np.diff(ends, prepend=-1)
    tail = int(runs[-1])
    before = values[: values.size - tail][-HELD:]
    if tail < HELD or tail < LONGER_HELD * runs[:-1].max(initial=1) or before.size < HELD:
        return 0
    near = abs(values[-1] - np.median(before)) <= NEAR_HELD * np.std(before)
    turns = np.count_nonzero(np.diff(np.sign(np.diff(before))))
    return tail if near and turns >= TURNS and np.isfinite(before).all() else 0


def _last_before_a_gap(known: np.ndarray) -> int:
    """Return which of the rows with a reading is the last one, if those behind a gap unlike any other don't count."""
    gaps = np.diff(known)
    for behind in range(1, min(LAST_ROWS, gaps.size - 1) + 1):
        if gaps[-behind] > LONGER_HELD * gaps[:-behind].max():
            return known.size - 1 - behind
    return known.size - 1


def refuse_an_early_end(table: Table, found: Mapping[str, Column], data: Mapping[str, np.ndarray]) -> None:
    """Refuse a column without a time of its own that is blank to the end while others go on.

    It may have been laid beside them from its first row on with another clock. One that a logger wrote in part in its
    last row is none, nor one with a reading in every tenth row. A flow that is filled up to the end has ended as well,
    and so has a column that shows something once more in its last rows, as of a final record.
    """
    flow = found["Q"]
    for size in range(data["Q"].size, data["Q"].size - LAST_ROWS - 1, -1) if flow.clock is None else ():
        if held := _held_to_the_end(data["Q"][:size]):
            raise InputError(
                f"'{table.path}' column '{flow.label}' repeats its last value to the last digit from "
                f"{table.place(size - held)} on, {held} rows, as nowhere else, so it may have ended before the "
                "others; export it with its own time, or cut these rows if the meter was switched off there"
            )
    last = {}
    for quantity, column in found.items():
        known = np.flatnonzero(np.isfinite(data[quantity]))
        if column.clock is None and known.size > 1:
            until, usual = _last_before_a_gap(known), float(np.median(np.diff(known)))
            last[quantity] = int(known[until]), usual, known[until + 1 :][:1]
    end = max((row for quantity, (row, _, _) in last.items() if quantity != "time"), default=0)
    for quantity, (row, usual, again) in last.items():
        allowed = max(1, min(LAST_ROWS, int(SHARE_OF_LAST * end))) * usual
        blank = slice(row + 1, int(again[0]) if again.size else None)
        ended = (np.isnan(table.numbers(each.label)[blank]).all() for each in found[quantity].every)
        if end - row <= allowed or not any(ended):
            continue  # what stands there is a number that means no value: the row is one
        time = data["time"]
        seconds = time[end] - time[row] if "time" in found and np.isfinite(time[[row, end]]).all() else np.nan
        rows = f"{end - row} rows" + (f" ({seconds:.4g} s)" if np.isfinite(seconds) else "")
        raise InputError(
            f"'{table.path}' column '{found[quantity].label}' ends at {table.place(row)}, {rows} before the others, so "
            "its rows may not be theirs; export it with its own time, or cut these rows if they are"
        )
