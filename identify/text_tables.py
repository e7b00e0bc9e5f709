"""Text tables: CSV of any delimiter, plain or gzip, with decimal point or comma; bytes in, a `Table` out."""

import csv
import gzip
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np

from dzdesign.core.errors import InputError
from dzdesign.identify.table import QUOTED_CHARACTERS, Table

if TYPE_CHECKING:
    import polars as pl

#: The number of a line in its file (1 is the first), and the line.
Lines = list[tuple[int, str]]

#: Joins the cells of a line inside: no cell of a text file holds it.
CELL_END = "\x1f"
#: What may stand between cells; where none of them is in the header, blanks do.
SEPARATORS, BLANKS = ",;\t|", " "
#: Lines before the header that are looked at for the fast way.
MOST_COMMENTS = 1000


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TextTable(Table):
    """A table of text: `cells` holds every column as strings, `lines` the numbers of its lines, the header first."""

    cells: "pl.DataFrame"
    lines: Sequence[int]

    @property
    def header(self) -> str:
        """Where the labels stand."""
        return f" row {self.lines[0]}"

    def place(self, row: int) -> str:
        """Return ``row 8``, as an editor counts."""
        return f"row {self.lines[row + 1]}"

    def cell(self, label: str, row: int) -> str:
        """Return a cell as it stands in the file."""
        return self._texts(label)[row]

    def numbers(self, label: str) -> np.ndarray:
        """Return a column as float64, NaN where the cell is blank."""
        import polars as pl

        column = self._texts(label)
        numbers = column.cast(pl.Float64, strict=False)
        bad = (~(column.is_null() | (column == "")) & numbers.is_null()).arg_true()
        if len(bad):
            row = int(bad[0])
            raise InputError(
                f"'{self.path}' {self.place(row)}, column '{label}': '{column[row][:QUOTED_CHARACTERS]}' is not a "
                "number; correct it, or leave the cell blank if the sample is missing"
            )
        return numbers.fill_null(np.nan).to_numpy().copy()

    def _texts(self, label: str) -> "pl.Series":
        column = self.cells.to_series(self.labels.index(label)).str.strip_chars(' \t"')
        # A decimal comma can only stand where the comma does not separate the cells.
        return column.str.replace(",", ".", literal=True)


def text_table(content: bytes, path: Path) -> TextTable:
    """Read a table of text.

    Parameters
    ----------
    content : bytes
        UTF-8, plain or gzip: a header row, then samples; lines that start with ``#`` are comments. Cells are parted
        by comma, semicolon, tab or ``|``, or by blanks where the header has none of these.
    path : Path
        For messages.

    Raises
    ------
    InputError
        If it is no such text, or a row has not as many cells as the header.
    """
    text = _decode(content, path)
    start, lines = _plain_rows(text)
    if not lines:
        lines = _table_lines(text)
    if not lines:
        raise InputError(f"'{path}' is empty; expected a header row such as time_s,u_V,dP_MPa,Q_Lmin and samples")
    number, header = lines[0]
    separator = max(SEPARATORS, key=header.count)
    separator = separator if separator in header else BLANKS
    labels = tuple(clean_label(label) for label in _labels(header, separator))
    if all(re.fullmatch(r"[-+\d.,eE\s]*", label) for label in labels):
        raise InputError(
            f"'{path}' has no header row (row {number} is '{header[:QUOTED_CHARACTERS]}'); "
            "expected names with units such as time_s,u_V,dP_MPa,Q_Lmin"
        )
    if start and (cells := _plain_cells(text[start:], separator, len(labels))) is not None:
        return TextTable(path=path, labels=labels, cells=cells, lines=range(number, number + 1 + cells.height))
    lines = _table_lines(text)
    cells = _read_cells(lines[1:], separator, len(labels), path)
    return TextTable(path=path, labels=labels, cells=cells, lines=tuple(number for number, _ in lines))


def _plain_rows(text: str) -> tuple[int, Lines]:
    """Return where the rows begin and the header, if nothing but rows follows it: no comment, quote or old line end."""
    start = 0
    for number in range(1, MOST_COMMENTS):
        end = text.find("\n", start)
        if end < 0:
            break
        header = _table_lines(text[start:end].removesuffix("\r"))
        start = end + 1
        if header:
            plain = not any(text.find(mark, start) >= 0 for mark in '#"\r')
            return (start, [(number, header[0][1])]) if plain and "\r" not in header[0][1] else (0, [])
    return 0, []


def _plain_cells(rows: str, separator: str, width: int) -> "pl.DataFrame | None":
    """Return the cells of rows that all have as many as the header, without a look at each; None if one has not."""
    import polars as pl

    rows = rows.rstrip("\n")
    if separator == BLANKS or not rows or width < 2:
        return None
    data = rows.encode()
    characters = np.frombuffer(data, np.uint8)
    starts = np.concatenate([[0], np.flatnonzero(characters == ord("\n")) + 1])
    if np.any(np.add.reduceat(characters == ord(separator), starts, dtype=np.int32) != width - 1):
        return None
    schema = {f"c{index}": pl.String for index in range(width)}
    return pl.read_csv(data, separator=separator, has_header=False, schema=schema, quote_char=None)


def _decode(content: bytes, path: Path) -> str:
    try:
        plain = gzip.decompress(content) if content[:2] == b"\x1f\x8b" else content
        text = plain.decode("utf-8-sig")
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"'{path}' is not a whole gzip file ({error}); copy it again") from error
    except UnicodeDecodeError as error:
        raise InputError(
            f"'{path}' is not a text file in UTF-8 (byte {error.start + 1}); save the table as 'CSV UTF-8'"
        ) from error
    if "\0" in text:
        raise InputError(f"'{path}' is UTF-16 or no text at all, expected UTF-8; save the table as 'CSV UTF-8'")
    return text


def _table_lines(text: str) -> Lines:
    """Return every line that is neither a comment nor blank; the first is the header.

    A spreadsheet that has saved a file again leaves comments in quotes, and blank lines as a row of separators.
    """
    # Not splitlines(): to an editor, whose line numbers the messages give, a form feed or U+0085 ends no line.
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return [
        (number, line)
        for number, line in enumerate(lines, start=1)
        if line.strip(' \t,;"') and not line.lstrip(' \t"').startswith("#")
    ]


def clean_label(label: str) -> str:
    """Return a column's label without the blanks and quotes around it."""
    return label.strip(' \t"')


def _labels(header: str, separator: str) -> list[str]:
    """Return the labels of the header; between blanks, a unit in brackets belongs to the label before it."""
    if separator == BLANKS:
        return re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", header)
    return _split(header, separator)


def _split(line: str, separator: str) -> list[str]:
    """Return the cells of a line; inside quotes the separator is a character as any other."""
    if separator == BLANKS:
        return line.split()
    if '"' not in line:
        return line.split(separator)
    return next(csv.reader([line], delimiter=separator, skipinitialspace=True))


def _read_cells(lines: Lines, separator: str, width: int, path: Path) -> "pl.DataFrame":
    """Return all cells as strings: numbers are read column by column, so that an error can name its row."""
    import polars as pl

    table = [CELL_END.join(f"c{index}" for index in range(width))]
    for number, line in lines:
        cells = _split(line, separator) if '"' in line or separator == BLANKS else None
        count = line.count(separator) + 1 if cells is None else len(cells)
        if count != width:
            comma = separator == "," and count == 2 * width
            hint = "; decimal commas need ';' or a tab between the cells" if comma else ""
            raise InputError(f"'{path}' row {number} has {count} cells, expected {width} as in the header{hint}")
        table.append(line.replace(separator, CELL_END) if cells is None else CELL_END.join(cells))
    try:
        return pl.read_csv("\n".join(table).encode(), separator=CELL_END, infer_schema=False, quote_char=None)
    except pl.exceptions.PolarsError as error:
        raise InputError(f"'{path}' can't be read as a table: {str(error).splitlines()[0]}") from error
