"""A line of text as cells: what parts them, quotes around them, and which of them are numbers."""

import csv
import re
from pathlib import Path

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.missing_values import is_no_value
from dzdesign.identify.reading.table import clean_label
from dzdesign.identify.reading.text.decimal_marks import BETWEEN_THOUSANDS
from dzdesign.identify.reading.time_stamps import is_stamp, is_unclear

#: Parts cells where nothing else does.
BLANKS = " "
#: A number with any decimal mark, or with blanks or the like between thousands.
NUMBER = re.compile(
    rf"[-+\u2212]?\s?(?:\d{{1,3}}(?:[{BETWEEN_THOUSANDS}]\d{{3}})+(?:[.,]\d*)?|[\d.,]*\d[.,]?(?:[eE][-+]?\d+)?)|nan",
    re.IGNORECASE,
)


def cells_of(line: str, separator: str) -> list[str]:
    """Return the cells of a line without blanks and quotes around them; never an error."""
    if separator == BLANKS:
        return _words(line)
    if '"' in line:
        try:
            return [clean_label(cell) for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True))]
        except csv.Error:
            return []
    return [clean_label(cell) for cell in line.split(separator)]


def _words(line: str) -> list[str]:
    """Return the words of a line; a unit in brackets belongs to the word before it."""
    # Of a bracket that is never closed only so much is looked at: a long header of them would take hours.
    return re.findall(r"[^\s\[(]+(?:\s{0,40}[\[(][^\])]{0,80}[\])])?", line)


def is_number(cell: str) -> bool:
    """Tell whether a cell is a number, with any decimal mark, a date or a time of day."""
    return NUMBER.fullmatch(cell) is not None or is_stamp(cell) or is_unclear(cell)


def is_value(cell: str) -> bool:
    """Tell whether a cell is a number, or what stands for none."""
    return is_number(cell) or is_no_value(cell)


def labels_of(header: str, separator: str, number: int, path: Path) -> list[str]:
    """Return the labels of a header."""
    return _words(header) if separator == BLANKS else split_line(header, separator, number, path)


def split_line(line: str, separator: str, number: int, path: Path) -> list[str]:
    """Return the cells of a line; inside quotes the separator is a character as any other.

    Raises
    ------
    InputError
        If a quote is never closed.
    """
    if separator == BLANKS:
        return line.split() or [line]  # a line of blanks that only Unicode knows has a cell, too
    if '"' not in line:
        return line.split(separator)
    try:
        return next(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error as error:  # a cell longer than 128 KiB, as after a quote that is never closed
        raise InputError(f"'{path}' row {number} has a cell that can't be read ({error}); mind its quotes") from error
