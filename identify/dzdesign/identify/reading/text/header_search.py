"""Which line of a text is the header.

A logger writes about itself above the table: operator, date, a line a channel. Rows of numbers tell where the table
begins, and the header is the line above them that has as many cells and reads best as labels of a ramp test.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import final

from dzdesign.core.errors import InputError
from dzdesign.core.units import measures
from dzdesign.identify.reading.column_labels import QUANTITIES, names_a_quantity, split_label
from dzdesign.identify.reading.table import QUOTED_CHARACTERS
from dzdesign.identify.reading.text.cells import BLANKS, cells_of, is_number, is_value

#: A recording has some ten columns; a header beyond this is not a table, and would take minutes to be searched.
MOST_COLUMNS, LONGEST_HEADER = 4096, 1 << 20
#: Lines in which the header is looked for, and the longest of them.
MOST_LINES, LONGEST_LINE = 1000, 1 << 16
#: Rows of numbers, one after the other, that are a table and no lines of a preamble; and their share of numbers.
FEWEST_ROWS, SHARE_OF_NUMBERS = 5, 0.6
#: What may stand between cells; where none of them is in the header, blanks do.
SEPARATORS = ",;\t|"
#: The same in the order in which rows of numbers are tried: a comma may be a decimal one, a blank part of a date.
IN_DOUBT = ";\t|, "
#: The column that LabVIEW announces, and leaves out of rows that have no comment.
COMMENT = "comment"


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A line that may belong to the table: its number in the file, its text, and where it ends in it all."""

    number: int
    text: str
    end: int


def best_header(lines: list[Line], path: Path) -> tuple[int, str] | None:
    """Return which line is the header, and what parts its cells; None if no rows of numbers tell."""
    first = usual_separator(lines[0].text)
    if len(lines) > 1 and could_be_labels(cells := cells_of(lines[0].text, first)):
        second = cells_of(lines[1].text, first)
        if len(cells) == len(second) and is_row_of_numbers(second):
            return 0, first
    for separator in IN_DOUBT:
        rows = _first_row(lines, separator)
        if rows is None:
            continue
        width = len(cells_of(lines[rows].text, separator))
        fitting = [
            (_score(cells, lines, index, separator), index)
            for index in range(rows)
            if _fits(cells := cells_of(lines[index].text, separator), width)
            and could_be_labels(cells)
            and not (index and is_row_of_units(cells))
        ]
        best = [index for score, index in fitting if score == max(fitting)[0]]
        if len(best) > 1:
            one, other = lines[best[0]], lines[best[-1]]
            raise InputError(
                f"'{path}': rows {one.number} ('{one.text[:QUOTED_CHARACTERS]}') and {other.number} "
                f"('{other.text[:QUOTED_CHARACTERS]}') could each be the header; say how many rows stand above it by "
                f"--skip-rows, for example --skip-rows {other.number - 1}"
            )
        return (best[0], separator) if best else None
    return None


def _first_row(lines: list[Line], separator: str) -> int | None:
    """Return the first of `FEWEST_ROWS` rows of numbers that have the same number of cells."""
    run, width = 0, 0
    for index, line in enumerate(lines):
        cells = cells_of(line.text, separator)
        if not is_row_of_numbers(cells):
            run = 0
            continue
        run, width = (run + 1 if len(cells) == width else 1), len(cells)
        if run == FEWEST_ROWS:
            return index - run + 1
    return None


def is_row_of_numbers(cells: list[str]) -> bool:
    """Tell whether cells are a row of samples: mostly numbers, the first one too."""
    filled = [cell for cell in cells if cell]
    numbers = sum(map(is_value, filled))
    return numbers >= 2 and is_number(filled[0]) and numbers >= SHARE_OF_NUMBERS * len(filled)


def could_be_labels(cells: list[str]) -> bool:
    """Tell whether cells may be labels: mostly words, and not all the same."""
    texts = sum(bool(cell) and not is_number(cell) for cell in cells)
    return texts >= 2 and 2 * texts >= len(cells) and len(set(filter(None, cells))) > 1


def _fits(cells: list[str], width: int) -> bool:
    """Tell whether labels fit rows of some width: one cell more or less may be blank, or LabVIEW's comment."""
    if len(cells) == width + 1:
        return cells[-1].lower() in ("", COMMENT)
    return len(cells) in (width, width - 1)


def is_row_of_units(cells: list[str]) -> bool:
    """Tell whether a row says the units of the columns, such as ``s;V;l/min;bar`` or ``(ms),(V),(V)``."""
    filled = [bare_unit(cell) for cell in cells if cell]
    known = sum(map(names_a_quantity, filled)) + sum(measures(unit, "current") for unit in filled)
    return known >= 2 and 2 * known >= len(filled) and not any(map(is_number, filled))


def bare_unit(unit: str) -> str:
    """Return a unit without brackets and blanks around it."""
    return unit.strip(" \t[](){}")


def _score(cells: list[str], lines: list[Line], index: int, separator: str) -> int:
    """Return how many quantities and units the labels of a line say, and whether units stand below it."""
    known = set()
    for label in cells[:MOST_COLUMNS]:
        quantity, unit = split_label(label)
        known |= {quantity} if quantity else {unit} if unit != label and names_a_quantity(unit) else set()
    return len(known) + (len(QUANTITIES) if is_row_of_units(cells_of(lines[index + 1].text, separator)) else 0)


def usual_separator(line: str) -> str:
    """Return what is most often in a line; in a row of numbers with decimal commas that is not what parts its cells."""
    for separator in IN_DOUBT[:3]:
        if len(line) <= LONGEST_LINE and separator in line and is_row_of_numbers(cells_of(line, separator)):
            return separator
    separator = max(SEPARATORS, key=line.count)
    return separator if separator in line else BLANKS
