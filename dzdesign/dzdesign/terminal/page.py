"""Stdout as a page, by rich: lines wrapped at blanks, tables in which no number is broken in two."""

import os
import sys
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dzdesign.core.errors import one_line

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.segment import Segment

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


def new_table(title: str, *columns: str, words: Sequence[int] = (0,)) -> "Table":
    """Return an empty table.

    Parameters
    ----------
    title : str
        Above it.
    *columns : str
        Headers.
    words : sequence of int
        Columns of words, which may be wrapped at blanks; the others are numbers, which are not.
    """
    return Table(title=one_line(title), headers=tuple(map(one_line, columns)), words=tuple(words))


@dataclass(slots=True, kw_only=True)
class Table:
    """A table that rich prints: headers and words are wrapped at blanks; one that is still too wide is not cut.

    Attributes
    ----------
    title, headers, words
        As for `new_table`.
    rows : list of tuple of str
        Cells, as many as headers.
    """

    title: str
    headers: tuple[str, ...]
    words: tuple[int, ...]
    rows: list[tuple[str, ...]] = field(default_factory=list)

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
