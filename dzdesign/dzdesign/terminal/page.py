"""Stdout as a page, by rich: lines wrapped at blanks, tables in which no number is broken in two."""

import os
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

from dzdesign.core.documents import to_json
from dzdesign.core.errors import one_line

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.segment import Segment

Row = TypeVar("Row")
#: Columns of a page when stdout is a file or a pipe, and COLUMNS does not say.
FILE_WIDTH = 140
#: Blanks between the columns of a table, where there is room and where there is none; one more stands at its left.
WIDE_GAP, NARROW_GAP = 3, 1


def new_console() -> "Console":
    """Return stdout as a page: as wide as the terminal, or as COLUMNS says, or `FILE_WIDTH` columns."""
    from rich.console import Console

    columns = os.environ.get("COLUMNS", "")
    width = int(columns) if columns.isdecimal() and int(columns) > 0 else FILE_WIDTH
    return Console(highlight=False, width=None if sys.stdout.isatty() else width)


def print_json(result: object) -> None:
    """Print an artefact, or an object of JSON values, as --json asks for it."""
    from dzdesign.core.artefact_types import as_document

    print(to_json(as_document(result)), end="")


def put_line(console: "Console", text: str) -> None:
    """Print a sentence: on a terminal wrapped at blanks, in a file or a pipe as one line, for grep."""
    text = one_line(text)  # a name from a file steers no terminal
    if console.is_terminal:
        indent = " " * (len(text) - len(text.lstrip()) + 2)
        text = textwrap.fill(
            text, console.width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
        )
    console.print(text, markup=False, soft_wrap=True)


def put_table(console: "Console", table: "Table") -> None:
    """Print a table: one that is wider than the page is not cut."""
    console.print(table, crop=False)


def volts(value: float | None) -> str:
    """Return a voltage for a cell."""
    return "-" if value is None else f"{value:.3f}"


def put_rows(
    console: "Console", title: str, rows: Iterable[Row], columns: Mapping[str, Callable[[Row], str]],
    words: Sequence[int] = (0,),
) -> None:  # fmt: skip
    """Print results as a table: each column is its header and what makes the cell of a result; `words` as for Table."""
    table = Table(title, *columns, words=words)
    for row in rows:
        table.add_row(*(cell(row) for cell in columns.values()))
    put_table(console, table)


class Table:
    """A table that rich prints: headers and words are wrapped at blanks; one that is still too wide is not cut.

    `words` are the columns of words; the others hold numbers, which are not wrapped.
    """

    def __init__(self, title: str, *headers: str, words: Sequence[int] = (0,)) -> None:
        self.title, self.headers, self.words = one_line(title), tuple(map(one_line, headers)), words
        self.rows: list[tuple[str, ...]] = []

    def add_row(self, *cells: str) -> None:
        """Add a row."""
        self.rows.append(tuple(map(one_line, cells)))  # a name from a file steers no terminal

    def _least(self, column: int) -> int:
        """Return the longest word of a column's header and of its words, or its longest number."""
        cells = [row[column] for row in self.rows]
        unbroken = [word for cell in cells for word in cell.split()] if column in self.words else cells
        return max((len(word) for word in (*self.headers[column].split(), *unbroken)), default=0)

    def _widths(self, room: int) -> list[int]:
        """Return a width for each column: what can't be broken, and of the room that is left words before headers."""
        widths = [self._least(column) for column in range(len(self.headers))]
        for column in sorted(range(len(widths)), key=lambda column: column not in self.words):
            wanted = max(map(len, (self.headers[column], *(row[column] for row in self.rows))))
            widths[column] += max(0, min(wanted - widths[column], room - sum(widths)))
        return widths

    def __rich_console__(self, console: "Console", options: "ConsoleOptions") -> "Iterator[Segment]":
        """Yield the lines, without the blanks to which rich fills each up."""
        from rich import box
        from rich import table as rich_table
        from rich.segment import Segment
        from rich.text import Text

        least = sum(map(self._least, range(len(self.headers))))
        gap = WIDE_GAP if least + WIDE_GAP * len(self.headers) < options.max_width else NARROW_GAP
        widths = self._widths(options.max_width - 1 - gap * len(self.headers))
        table = rich_table.Table(
            title=Text(self.title), title_justify="left", title_style="bold", box=box.SIMPLE_HEAD,
            padding=(0, gap // 2), collapse_padding=False,
        )  # fmt: skip
        for column, (header, width) in enumerate(zip(self.headers, widths, strict=True)):
            table.add_column(Text(header), justify="left" if column in self.words else "right", width=width)
        for row in self.rows:
            table.add_row(*map(Text, row))
        wide = max(options.max_width, 1 + sum(widths) + gap * len(widths))
        for line in console.render_lines(table, options.update(width=wide), pad=False):
            while line and not line[-1].text.strip():
                line.pop()
            yield from line[:-1]
            yield from [Segment(line[-1].text.rstrip(), line[-1].style)] if line else []
            yield Segment.line()
