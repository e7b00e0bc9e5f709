"""The header of a table of text: its labels, and a row of units below it."""

import logging
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import final

from dzdesign.core.errors import InputError
from dzdesign.identify.reading.missing_values import OF_A_SPREADSHEET
from dzdesign.identify.reading.table import QUOTED_CHARACTERS, clean_label, numbered
from dzdesign.identify.reading.text.cells import BLANKS, cells_of, is_number, labels_of
from dzdesign.identify.reading.text.header_search import (
    COMMENT,
    LONGEST_HEADER,
    LONGEST_LINE,
    MOST_COLUMNS,
    MOST_LINES,
    Line,
    bare_unit,
    best_header,
    could_be_labels,
    is_row_of_numbers,
    is_row_of_units,
    usual_separator,
)

#: Lines among which a cell in quotes is looked for that goes on in the next one, and of how many it may be.
MOST_BROKEN = 40
#: Rows below the header, without any number, that say the columns' types and units.
MOST_BELOW = 4
#: How a comment begins, and what names the separator to a spreadsheet. A cell without a value is no comment.
COMMENT_LINE = re.compile(rf'[ \t"]*(?:#(?!{OF_A_SPREADSHEET[1:]} *(?:[,;\t|"]|$))|[sS][eE][pP]=.?"?$)')
COMMENTS = re.compile(rb"^(?:%b)" % COMMENT_LINE.pattern.encode(), re.MULTILINE)
#: A line that is neither a comment nor blank; what a spreadsheet makes of either has quotes or separators.
TABLE_LINE = re.compile(rb'^(?![ \t,;"]*$)(?!%b).+' % COMMENT_LINE.pattern.encode(), re.MULTILINE)
#: An artefact of dzdesign begins with its schema.
ARTEFACT = re.compile(rb'\s*\{\s*"(?:[^"{}]*"\s*:\s*"[^"]*",?\s*")*?schema"\s*:\s*"(dzdesign\.[\w.-]+/\d+)"')
#: First characters of text that is not a table.
DOCUMENTS = {b"{": "JSON", b"<": "HTML or XML"}
logger = logging.getLogger(__name__)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class Header:
    """The header row.

    Attributes
    ----------
    line : int
        Its number in the file.
    labels : tuple of str
        Of the columns.
    separator : str
        What stands between two cells.
    units : mapping
        Label -> unit, by a row of units below it.
    repeats : frozenset of str
        The header's line and that of the units: where they stand once more, they are no samples.
    """

    line: int
    labels: tuple[str, ...]
    separator: str
    units: Mapping[str, str] = field(default_factory=dict)
    repeats: frozenset[str] = frozenset()


def find_header(text: bytes, number: int, path: Path, *, at_first_line: bool) -> tuple[Header, int] | None:
    """Return the header and where in a text its rows begin; None if all is comments and blank lines.

    `at_first_line`: the first line is the header by the engineer's word, comments and blank lines aside.

    Raises
    ------
    InputError
        If there is none, or two lines could each be it.
    """
    lines = _lines(text, number)
    if not lines:
        return None
    _refuse_a_document(text, path)
    found = None if at_first_line or len(lines[0].text) > LONGEST_LINE else best_header(lines, path)
    at = found[0] if found else 0
    line = lines[at]
    separator = found[1] if found else usual_separator(line.text)
    if found is None and _is_numbers(labels_of(line.text, separator, line.number, path)):
        commented = _commented_header(text, number, line)
        if commented is not None:
            header = _header(commented.number, commented.text, separator, path)
            return _fitted(header, lines), commented.end + 1
    header = _header(line.number, line.text, separator, path)
    end, rows = line.end, lines[at + 1 :]
    above = lines[at - 1] if at else None
    below = _rows_of_words(rows, separator)
    units = next((row for row in below if is_row_of_units(cells_of(row.text, separator))), None)
    if below:
        for row in below:
            if row is not units:
                words = row.text[:QUOTED_CHARACTERS]
                logger.debug("'%s' row %d, below the header, is passed over: %s", path, row.number, words)
        end, rows = below[-1].end, rows[len(below) :]
    if units:
        header = _with_units(header, units.text)
    elif above and is_row_of_units(cells_of(above.text, separator)):
        header = _with_units(header, above.text)
    return _fitted(header, rows), end + 1


def _rows_of_words(rows: list[Line], separator: str) -> list[Line]:
    """Return the rows directly below a header that hold no number, if numbers follow: units, types of the columns."""
    below: list[Line] = []
    for row in rows[: MOST_BELOW + 1]:
        cells = cells_of(row.text, separator)
        if any(map(is_number, cells)):
            return below
        below.append(row)
    return below[:1] if below and is_row_of_units(cells_of(below[0].text, separator)) else []


def _with_units(header: Header, line: str) -> Header:
    """Return a header with what a row of units says."""
    units: dict[str, str] = {}
    for label, cell in zip(header.labels, cells_of(line, header.separator), strict=False):
        if bare_unit(cell):
            units.setdefault(label, bare_unit(cell))
    return replace(header, units=units, repeats=header.repeats | {line})


def _lines(text: bytes, number: int) -> list[Line]:
    """Return the first lines that are neither a comment nor blank."""
    lines: list[Line] = []
    before = 0
    for match in TABLE_LINE.finditer(text):
        if lines and (len(lines) == MOST_LINES or match.end() - match.start() > LONGEST_LINE):
            break
        number += text.count(b"\n", before, match.start())
        before = match.start()
        lines.append(Line(number=number, text=match[0].decode(), end=match.end()))
    return _with_broken_ones_joined(lines)


def _with_broken_ones_joined(lines: list[Line]) -> list[Line]:
    """Return lines, of which those above the first row of numbers may be broken inside quotes: a cell of two lines."""
    for first, line in enumerate(lines[:MOST_BROKEN]):
        if line.text.count('"') % 2 == 0 or len(line.text) > LONGEST_LINE:
            continue
        for last in range(first + 1, min(first + MOST_BROKEN, len(lines))):
            text = " ".join(each.text for each in lines[first : last + 1])
            if text.count('"') % 2 == 0:
                joined = Line(number=line.number, text=text, end=lines[last].end)
                return [*lines[:first], joined, *lines[last + 1 :]]
    return lines


def _refuse_a_document(text: bytes, path: Path) -> None:
    """Refuse what a pattern such as ``ramps/*`` catches beside recordings."""
    artefact = ARTEFACT.match(text[:LONGEST_LINE])
    if artefact:
        raise InputError(
            f"'{path}' is no recording but a file that dzdesign wrote ({artefact[1].decode()}); leave it out, for "
            "example by a pattern such as *.csv"
        )
    document = DOCUMENTS.get(text[:LONGEST_HEADER].lstrip()[:1])
    if document:
        raise InputError(f"'{path}' is {document}, expected a table of numbers; export the recording as CSV")


def _is_numbers(labels: list[str]) -> bool:
    return all(not label.strip() or is_number(clean_label(label)) for label in labels)


def _commented_header(text: bytes, number: int, row: Line) -> Line | None:
    """Return the last comment above a table without a header, if it can be one: numpy.savetxt writes it so."""
    above = text[: row.end].split(b"\n")[: row.number - number]
    for back, line in enumerate(reversed(above), start=1):
        comment = line.decode(errors="replace").strip()
        if not comment:
            continue
        bare = comment.lstrip('" \t#')
        separator = usual_separator(row.text)
        names = cells_of(bare, separator)
        as_many = len(names) == len(cells_of(row.text, separator))
        if not (comment.startswith("#") and as_many and could_be_labels(names)):
            return None
        end = sum(len(each) + 1 for each in above[: len(above) - back + 1]) - 1
        return Line(number=row.number - back, text=bare, end=end)
    return None


def _header(number: int, line: str, separator: str, path: Path) -> Header:
    """Return the header that a line holds; refuse a line of numbers."""
    columns = len(line.split()) if separator == BLANKS else line.count(separator) + 1
    if columns > MOST_COLUMNS or len(line) > LONGEST_HEADER:
        raise InputError(
            f"'{path}' row {number} has {columns} cells, expected the columns of a ramp test, at most {MOST_COLUMNS}; "
            "export only those"
        )
    labels = [clean_label(label) for label in labels_of(line, separator, number, path)]
    if _is_numbers(labels):
        raise InputError(
            f"'{path}' has no header row (row {number} is '{line[:QUOTED_CHARACTERS]}'); "
            "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
        )
    return Header(line=number, labels=numbered(labels), separator=separator, repeats=frozenset({line}))


def _fitted(header: Header, rows: list[Line]) -> Header:
    """Return the header with a label more or less where its rows end in a separator and it does not, or the reverse."""
    cells = cells_of(rows[0].text, header.separator) if rows else []
    labels, few = header.labels, len(cells) == len(header.labels) - 1
    if few and labels[-1].lower() in ("", COMMENT) and is_row_of_numbers(cells):
        labels = labels[:-1]
    elif len(cells) == len(labels) + 1 and not cells[-1] and is_row_of_numbers(cells):
        labels = (*labels, "")
    return replace(header, labels=labels)
