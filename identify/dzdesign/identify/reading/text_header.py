"""The header of a table among the lines of a text: its labels, what parts its cells, and where its samples begin.

A logger writes about itself above the table: operator, date, a line a channel. Rows of numbers tell where the table
begins, and the header is the line above them that has as many cells and reads best as labels of a ramp test.
"""

import csv
import logging
import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, final

from dzdesign.core.errors import InputError
from dzdesign.core.units import measures
from dzdesign.identify.reading.column_labels import QUANTITIES, names_a_quantity, split_label
from dzdesign.identify.reading.missing_values import OF_A_SPREADSHEET, is_no_value
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, clean_label, numbered
from dzdesign.identify.reading.text_table import is_number

if TYPE_CHECKING:
    import polars as pl

#: What a pattern such as ``ramps/*`` catches beside recordings, by its first character.
DOCUMENTS = {"{": "JSON, such as a file that dzdesign wrote", "<": "HTML or XML"}
#: A recording has some ten columns; a header beyond this is not a table, and would take minutes to be searched.
MOST_COLUMNS, LONGEST_HEADER = 4096, 1 << 20
#: Lines in which the header is looked for, and the longest of them.
MOST_LINES, LONGEST_LINE = 1000, 1 << 16
#: Lines among which a cell in quotes is looked for that goes on in the next one, and of how many it may be.
MOST_BROKEN = 40
#: Rows below the header, without any number, that say the columns' types and units.
MOST_BELOW = 4
#: Rows of numbers, one after the other, that are a table and no lines of a preamble; and their share of numbers.
FEWEST_ROWS, SHARE_OF_NUMBERS = 5, 0.6
#: What may stand between cells; where none of them is in the header, blanks do.
SEPARATORS, BLANKS = ",;\t|", " "
#: The same in the order in which rows of numbers are tried: a comma may be a decimal one, a blank part of a date.
IN_DOUBT = ";\t|, "
#: A comment, a blank line, and what names the separator to a spreadsheet; a cell without a value is no comment.
ASIDE = re.compile(
    rf'[ \t"]*#(?!{OF_A_SPREADSHEET[1:]} *(?:[,;\t|"]|$))|[ \t"]*[sS][eE][pP]=.?"?$|[ \t,;"]*$'
)
#: Lines that stand aside for certain.
ASIDE_AT_ONCE = r'^(?:[ \t]*#[ \t]|[ \t,;"]*$)'
#: The column that LabVIEW announces, and leaves out of rows that have no comment.
COMMENT = "comment"
logger = logging.getLogger(__name__)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A line that may belong to the table, or several that a cell in quotes makes one; places count from zero."""

    first: int
    last: int
    text: str

    @property
    def number(self) -> int:
        """As an editor counts."""
        return self.first + 1


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """The header row."""

    #: Its number in the file.
    line: int
    #: Of the columns.
    labels: tuple[str, ...]
    #: What stands between two cells.
    separator: str
    #: Label -> unit, by a row of units beside it.
    units: Mapping[str, str]
    #: The header's line and that of the units: where they stand once more, they are no samples.
    repeats: frozenset[str]
    #: Place of the first line below it, words and units aside.
    rows: int


# a line as cells


def cells_of(line: str, separator: str, where: str = "") -> list[str]:
    """Return the cells of a line without blanks and quotes around them; inside quotes the separator parts none.

    Where the quotes can't be read there is none; that is refused in a line whose place `where` names.
    """
    if separator == BLANKS:
        # A unit in brackets belongs to the word before it. Of a bracket that is never closed only so much is looked
        # at: a long header of them would take hours. A line of blanks that only Unicode knows has a cell, too.
        cells = re.findall(r"[^\s\[(]+(?:\s{0,40}[\[(][^\])]{0,80}[\])])?", line) or [line]
    elif '"' in line:
        try:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
        except csv.Error as error:  # a cell longer than 128 KiB, as after a quote that is never closed
            if where:
                raise InputError(f"{where} has a cell that can't be read ({error}); mind its quotes") from error
            return []
    else:
        cells = line.split(separator)
    return [clean_label(cell) for cell in cells]


def is_value(cell: str) -> bool:
    """Tell whether a cell is a number, or what stands for none."""
    return is_number(cell) or is_no_value(cell)


# the header


def find_header(
    lines: "pl.Series", start: int, path: Path, skip_rows: int | None, *, at_first_line: bool
) -> Header:
    """Return the header, which stands in the line `start` or below it.

    `at_first_line`: that line is the header by the engineer's word, comments and blank lines aside.

    Raises
    ------
    InputError
        If there is none, or two lines could each be it.
    """
    first = _joined(_first_lines(lines, start))
    if not first:
        skipped = f" below its first {skip_rows} rows (--skip-rows)" if skip_rows else ""
        raise InputError(
            f"'{path}' is empty{skipped}, comments and blank lines apart; expected a header row such as "
            "time_s,u_V,dP_MPa,Q_Lmin and samples"
        )
    if document := DOCUMENTS.get(first[0].text.lstrip()[:1]):
        raise InputError(f"'{path}' is {document}, expected a table of numbers; export the recording as CSV")
    found = None if at_first_line or len(first[0].text) > LONGEST_LINE else _best_header(first, path)
    at, separator = found or (0, _usual_separator(first[0].text))
    line, below = first[at], first[at + 1 :]
    if found is None and (commented := _commented_header(lines, start, line, separator)):
        line, below = commented, first
    labels = _labels(line, separator, path)
    words = _rows_of_words(below, separator)
    rows = [cells_of(row.text, separator) for row in below[len(words) : len(words) + 1]]
    units = next((row for row in (*words, *first[max(at - 1, 0) : at]) if _is_units(row, separator)), None)
    for row in words:
        if row is not units:
            text_of_row = row.text[:QUOTED_CHARACTERS]
            logger.debug("'%s' row %d, below the header, is passed over: %s", path, row.number, text_of_row)
    if skip_rows is None and line.first > first[0].first:
        logger.debug("'%s': the header was found in row %d; what stands above it is passed over", path, line.number)
    stated: dict[str, str] = {}
    for label, cell in zip(labels, cells_of(units.text, separator) if units else [], strict=False):
        if _bare_unit(cell):
            stated.setdefault(label, _bare_unit(cell))
    return Header(
        line=line.number,
        labels=_fitted(labels, rows[0] if rows else []),
        separator=separator,
        units=stated,
        repeats=frozenset({line.text} | ({units.text} if units else set())),
        rows=(words[-1] if words else line).last + 1,
    )


def _first_lines(lines: "pl.Series", start: int) -> list[Line]:
    """Return the first lines that do not stand aside."""
    found: list[Line] = []
    for begin in range(start, lines.len(), LONGEST_LINE):
        piece = lines.slice(begin, LONGEST_LINE)
        likely = (~piece.str.contains(ASIDE_AT_ONCE)).arg_true()
        for place, text in zip(likely, piece.gather(likely), strict=True):
            if found and (len(found) == MOST_LINES or len(text) > LONGEST_LINE):
                return found
            if not ASIDE.match(text):
                found.append(Line(first=begin + place, last=begin + place, text=text))
    return found


def _joined(lines: list[Line]) -> list[Line]:
    """Return lines, of which those are one that are broken inside quotes: a cell of two lines."""
    for first, line in enumerate(lines[:MOST_BROKEN]):
        if line.text.count('"') % 2 == 0 or len(line.text) > LONGEST_LINE:
            continue
        for last in range(first + 1, min(first + MOST_BROKEN, len(lines))):
            joined = " ".join(each.text for each in lines[first : last + 1])
            if joined.count('"') % 2 == 0:
                whole = Line(first=line.first, last=lines[last].last, text=joined)
                return [*lines[:first], whole, *lines[last + 1 :]]
    return lines


def _best_header(lines: list[Line], path: Path) -> tuple[int, str] | None:
    """Return which line is the header, and what parts its cells; None if no rows of numbers tell."""
    for separator in IN_DOUBT:
        rows = _first_row(lines, separator)
        if rows is None:
            continue
        width = len(cells_of(lines[rows].text, separator))
        fitting = [
            (_score(cells, lines[index + 1], separator), index)
            for index in range(rows)
            if _fits(cells := cells_of(lines[index].text, separator), width)
            and _could_be_labels(cells)
            and not (index and _is_units(lines[index], separator))
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
        cells = cells_of(line.text, separator) if separator in line.text else []
        if not _is_row_of_numbers(cells):
            run = 0
            continue
        run, width = (run + 1 if len(cells) == width else 1), len(cells)
        if run == FEWEST_ROWS:
            return index - run + 1
    return None


def _is_row_of_numbers(cells: list[str]) -> bool:
    """Tell whether cells are a row of samples: mostly numbers, the first one too."""
    filled = [cell for cell in cells if cell]
    numbers = sum(map(is_value, filled))
    return numbers >= 2 and is_number(filled[0]) and numbers >= SHARE_OF_NUMBERS * len(filled)


def _could_be_labels(cells: list[str]) -> bool:
    """Tell whether cells may be labels: mostly words, and not all the same."""
    texts = sum(bool(cell) and not is_number(cell) for cell in cells)
    return texts >= 2 and 2 * texts >= len(cells) and len(set(filter(None, cells))) > 1


def _fits(cells: list[str], width: int) -> bool:
    """Tell whether labels fit rows of some width: one cell more or less may be blank, or LabVIEW's comment."""
    if len(cells) == width + 1:
        return cells[-1].lower() in ("", COMMENT)
    return len(cells) in (width, width - 1)


def _is_units(line: Line, separator: str) -> bool:
    """Tell whether a row says the units of the columns, such as ``s;V;l/min;bar`` or ``(ms),(V),(V)``."""
    filled = [_bare_unit(cell) for cell in cells_of(line.text, separator) if cell]
    known = sum(map(names_a_quantity, filled)) + sum(measures(unit, "current") for unit in filled)
    return known >= 2 and 2 * known >= len(filled) and not any(map(is_number, filled))


def _bare_unit(unit: str) -> str:
    return unit.strip(" \t[](){}")


def _score(cells: list[str], below: Line, separator: str) -> int:
    """Return how many quantities and units the labels of a line say, and whether units stand below it."""
    known = set()
    for label in cells[:MOST_COLUMNS]:
        quantity, unit = split_label(label)
        known |= {quantity} if quantity else {unit} if unit != label and names_a_quantity(unit) else set()
    return len(known) + (len(QUANTITIES) if _is_units(below, separator) else 0)


def _usual_separator(line: str) -> str:
    """Return what is most often in a line; in a row of numbers with decimal commas that is not what parts its cells."""
    for separator in IN_DOUBT[:3]:
        if len(line) <= LONGEST_LINE and separator in line and _is_row_of_numbers(cells_of(line, separator)):
            return separator
    separator = max(SEPARATORS, key=line.count)
    return separator if separator in line else BLANKS


def _rows_of_words(rows: list[Line], separator: str) -> list[Line]:
    """Return the rows directly below a header that hold no number, if numbers follow: units, types of the columns."""
    first = rows[: MOST_BELOW + 1]
    words = list(takewhile(lambda row: not any(map(is_number, cells_of(row.text, separator))), first))
    return words if len(words) < len(first) else [row for row in words[:1] if _is_units(row, separator)]


def _commented_header(lines: "pl.Series", start: int, row: Line, separator: str) -> Line | None:
    """Return the last comment above a table without a header, if it can be one: numpy.savetxt writes it so."""
    cells = cells_of(row.text, separator)
    if not all(not cell or is_number(cell) for cell in cells):
        return None
    for place in range(row.first - 1, start - 1, -1):
        comment = lines[place].strip()
        bare = comment.lstrip('" \t#')
        names = cells_of(bare, separator)
        if comment.startswith("#") and len(names) == len(cells) and _could_be_labels(names):
            return Line(first=place, last=place, text=bare)
        if comment:
            return None
    return None


def _labels(line: Line, separator: str, path: Path) -> tuple[str, ...]:
    """Return the labels that a line holds; refuse a line of numbers."""
    columns = len(line.text.split()) if separator == BLANKS else line.text.count(separator) + 1
    if columns > MOST_COLUMNS or len(line.text) > LONGEST_HEADER:
        raise InputError(
            f"'{path}' row {line.number} has {columns} cells, expected the columns of a ramp test, at most "
            f"{MOST_COLUMNS}; export only those"
        )
    labels = cells_of(line.text, separator, f"'{path}' row {line.number}")
    if all(not label or is_number(label) for label in labels):
        raise InputError(
            f"'{path}' has no header row (row {line.number} is '{line.text[:QUOTED_CHARACTERS]}'); "
            "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
        )
    return numbered(labels)


def _fitted(labels: tuple[str, ...], cells: list[str]) -> tuple[str, ...]:
    """Return labels, one more or less where the rows end in a separator and the header does not, or the reverse."""
    if not _is_row_of_numbers(cells):
        return labels
    if len(cells) == len(labels) - 1 and labels[-1].lower() in ("", COMMENT):
        return labels[:-1]
    return (*labels, "") if len(cells) == len(labels) + 1 and not cells[-1] else labels
