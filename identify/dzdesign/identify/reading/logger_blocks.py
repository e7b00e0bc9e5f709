"""Text with a block of its own per channel or segment: LabVIEW measurement files (.lvm), TwinCAT Scope's CSV.

Such blocks are made comments, which keeps the numbers of the lines, and one row of labels stays. What they say of units
and times goes into the table: a LabVIEW file may state only start and step of each channel, for each segment anew.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, clean_label
from dzdesign.identify.reading.text_table import TextTable
from dzdesign.identify.reading.time_stamps import start_of

if TYPE_CHECKING:
    import polars as pl

#: The column that LabVIEW announces, and leaves out of rows that have no comment.
COMMENT = "comment"
LABVIEW, END_OF_HEADER, X_VALUE = "LabVIEW Measurement", "***End_of_Header***", "X_Value"
#: First cells of a line that stands above a segment's header.
WORD = re.compile(r"[^\W\d]|\*\*\*")
#: A block of TwinCAT Scope: it begins with the channels' names, ends with their steps, and samples follow the words.
SCOPE_NAMES, SCOPE_STEP, SCOPE_WORD = re.compile(r"Name[\t;,]"), "SampleTime[ms]", re.compile(r"[^\W\d]|\s|$")
SCOPE_NAME, SCOPE_TIME = "Name", "Time (ms)"
#: Lines in which it is looked for, and lines that it has at most.
SCOPE_LINES, SCOPE_BLOCK = 1000, 42


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A segment of a LabVIEW file: the line of its labels, and what its header says, a cell a column."""

    line: int
    header: Mapping[str, list[str]]

    def cell(self, key: str, column: int) -> str:
        """Return what the header says of a column of values, or nothing."""
        cells = self.header.get(key, [])
        return cells[column].strip() if column < len(cells) else ""

    def start(self, column: int) -> str:
        """Return the date and time at which a channel begins to count, or nothing."""
        date, time = self.cell("Date", column), self.cell("Time", column)
        time = re.sub(r"([.,]\d{1,6})\d*$", r"\1", time)
        return f"{date} {time}" if date and time else ""

    def number(self, key: str, column: int) -> float:
        """Return a number for a channel; NaN where there is none."""
        try:
            return float(self.cell(key, column).replace(",", "."))
        except ValueError:
            return np.nan


def without_blocks(lines: "pl.Series", start: int, path: Path) -> "tuple[pl.Series, tuple[Segment, ...], bool]":
    """Return lines whose blocks are comments, the segments of a LabVIEW file, and whether there were any blocks.

    The file begins with the line `start`.

    Raises
    ------
    InputError
        If the segments of a LabVIEW file have other columns.
    """
    first = lines.slice(start, SCOPE_LINES).to_list()
    if first and first[0].startswith(LABVIEW):
        plain, segments = _of_labview(lines.to_list(), start, path)
        return plain, tuple(segments), bool(segments)
    names = next((place for place, line in enumerate(first) if place and SCOPE_NAMES.match(line)), 0)
    block = range(names + 1, min(names + SCOPE_BLOCK, len(first))) if names else ()
    times = next((place for place in block if first[place].startswith(SCOPE_STEP)), 0)
    if not times:
        return lines, (), False
    end = next((place for place in range(times + 1, len(first)) if not SCOPE_WORD.match(first[place])), len(first))
    separator = first[names][len(SCOPE_NAME)]
    labels = [cell.strip() for cell in first[names].split(separator)]
    pairs = [SCOPE_TIME if index % 2 == 0 and cell == SCOPE_NAME else cell for index, cell in enumerate(labels)]
    commented = [f"# {line}" if line.strip() else line for line in first[:end]]
    commented[names] = separator.join(pairs)
    return lines.scatter(range(start, start + end), commented), (), True


def _of_labview(lines: list[str], start: int, path: Path) -> "tuple[pl.Series, list[Segment]]":
    import polars as pl

    separator = "," if any(line.startswith("Separator,Comma") for line in lines[:SCOPE_LINES]) else "\t"
    segments: list[Segment] = []
    header: dict[str, list[str]] = {}
    samples, ended, labels = False, False, [""]
    for index, line in enumerate(lines[start:], start=start):
        cells = line.split(separator)
        word = clean_label(cells[0])
        if samples and not WORD.match(word):
            if len(cells) > len(labels):  # a comment behind it
                lines[index] = separator.join(cells[: len(labels)])
            continue
        samples = False
        if word == END_OF_HEADER:
            ended = True
        elif ended and word == X_VALUE:
            segments.append(Segment(line=index + 1, header=header))
            header, samples, ended = {}, True, False
            cells = cells[: len(cells) - (clean_label(cells[-1]).lower() == COMMENT)]
            if len(segments) == 1:
                labels, lines[index] = cells, separator.join(cells)
                continue
            if cells != labels:
                raise InputError(
                    f"'{path}' row {index + 1} begins a segment with other columns ('{line[:QUOTED_CHARACTERS]}') than "
                    f"row {segments[0].line}; make a file of each segment"
                )
        elif word:
            header, ended = ({} if ended else header), False
            header.setdefault(word, cells)
        if line.strip():
            lines[index] = f"# {line}"
    return pl.Series(lines, dtype=pl.String), segments


def with_stated_times(table: TextTable, segments: tuple[Segment, ...]) -> TextTable:
    """Return the table of a LabVIEW file with the units and the times that its headers state."""
    import polars as pl

    if not segments:
        return table
    units, starts, cells = dict(table.units), {}, table.cells
    clocks: dict[str, str] = {}
    waveforms: dict[tuple[str, str], str] = {}
    labels, first, clock = list(table.labels), segments[0], ""
    for column, label in enumerate(table.labels):
        if table.in_file(label) == X_VALUE:
            clock = label
            continue
        if unit := first.cell("Y_Unit_Label", column):
            units.setdefault(label, unit)
        stated = tuple(
            (each.start(column), each.number("X0", column), each.number("Delta_X", column)) for each in segments
        )
        own = waveforms.setdefault((clock, str(stated)), clock if clock not in clocks.values() else f"time of {label}")
        clocks[label] = own
        if own in starts:
            continue
        units[own], starts[own] = "s", first.start(column)
        times = _times(table, clock if own == clock else "", segments, column)
        if own not in labels:
            labels.append(own)
        if times is not None:  # a new column, or in place of that which the file left blank
            name = f"field_{labels.index(own)}"
            cells = cells.with_columns(pl.Series(name, times))
    return replace(table, labels=tuple(labels), units=units, clocks=clocks, starts=starts, cells=cells)


def _times(table: TextTable, label: str, segments: tuple[Segment, ...], column: int) -> np.ndarray | None:
    """Return the times of a channel, s; None where they are what stands in the file.

    Where the numbers of a segment begin anew, the date and time in its header say by how much it is later.
    """
    count = len(table.lines)
    segment = np.searchsorted([each.line for each in segments], np.asarray(table.lines), side="right") - 1
    begins = np.searchsorted(segment, np.arange(len(segments)))
    numbers = table.numbers(label) if label else np.full(count, np.nan)
    blank = bool(np.all(np.isnan(numbers)))
    if len(segments) == 1 and not blank:
        return None
    if blank:
        zero, step = (np.array([each.number(key, column) for each in segments]) for key in ("X0", "Delta_X"))
        if np.isnan(step).any():
            raise InputError(
                f"'{table.path}' states no Delta_X for '{table.labels[column]}', and no X_Value; export it with X_Value"
            )
        numbers = np.nan_to_num(zero)[segment] + (np.arange(count) - begins[segment]) * step[segment]
    moments = [start_of(each.start(column)) for each in segments]
    shift, before = 0.0, 0.0
    times = numbers.copy()
    for index, (begin, end) in enumerate(zip(begins, [*begins[1:], count], strict=True)):
        start, moment = moments[0], moments[index]
        if index and end > begin and numbers[begin] <= before and start and moment:
            shift = moment.seconds - start.seconds
            times[begin:end] += round(shift, 5)
        before = numbers[end - 1] if end > begin else before
    return times
