"""Stdout as a page: lines wrapped at blanks, tables that fit its width with no word broken in two."""

import os
import sys
import textwrap
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from dzdesign.core.errors import one_line

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rich.console import Console, ConsoleOptions, RenderableType
    from rich.segment import Segment

#: Columns of a page when stdout is a file or a pipe, and COLUMNS does not say.
FILE_WIDTH = 140
#: Blanks between the columns of a table, where there is room and where there is none; one more stands at its left.
WIDE_GAP, NARROW_GAP = 3, 1
#: The narrowest column whose words are folded, because they are longer than the page.
NARROWEST = 12


def new_console() -> "Console":
    """Return stdout as a page: as wide as the terminal, or as COLUMNS says, or `FILE_WIDTH` columns."""
    from rich.console import Console

    columns = os.environ.get("COLUMNS", "")
    told = int(columns) if columns.isdecimal() and int(columns) > 0 else FILE_WIDTH
    return Console(highlight=False, width=None if sys.stdout.isatty() else told)


def put_line(console: "Console", text: str) -> None:
    """Print a sentence: on a terminal wrapped at blanks, in a file or a pipe as one line, for grep.

    Parameters
    ----------
    console : Console
        Of `new_console`.
    text : str
        One line.
    """
    text = one_line(text)  # a name from a file steers no terminal
    if sys.stdout.isatty():
        indent = " " * (len(text) - len(text.lstrip()) + 2)
        text = textwrap.fill(
            text, console.width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
        )
    console.print(text, markup=False, soft_wrap=True)


def new_table(title: str, *columns: str, words: "Sequence[int]" = (0,), keys: int = 1) -> "Grid":
    """Return an empty table.

    Parameters
    ----------
    title : str
        Above it.
    *columns : str
        Headers.
    words : sequence of int
        Columns of words, which may be wrapped at blanks; the others are numbers, which are not.
    keys : int
        Columns, from the first on, that tell the rows apart.
    """
    headers = tuple(one_line(column) for column in columns)
    return Grid(title=one_line(title), headers=headers, words=tuple(words), keys=keys)


@dataclass(slots=True, kw_only=True)
class Grid:
    """A table that rich prints to fit: headers are wrapped at blanks; what is still too wide becomes two tables.

    The second repeats the columns that tell the rows apart, as R and pandas do it: nothing is lost, no word broken.

    Attributes
    ----------
    title, headers, words, keys
        As for `new_table`.
    rows : list of tuple of str
        Cells, as many as headers.
    """

    title: str
    headers: tuple[str, ...]
    words: tuple[int, ...]
    keys: int = 1
    rows: list[tuple[str, ...]] = field(default_factory=list)

    def add_row(self, *cells: str) -> None:
        """Add a row."""
        self.rows.append(tuple(one_line(cell) for cell in cells))  # a name from a file steers no terminal

    def __rich_console__(self, console: "Console", options: "ConsoleOptions") -> "Iterator[RenderableType | Segment]":
        """Yield the lines of one table of rich, or of several."""
        from rich.text import Text

        blocks = self._blocks(options.max_width)
        for number, (columns, gap, widths) in enumerate(blocks, 1):
            if number > 1:
                yield Text("  (the same rows, further columns)")
            yield from _without_trailing_blanks(
                console, options, self._rendered(columns, gap, widths, self.title if number == 1 else None)
            )

    def _blocks(self, room: int) -> list[tuple[list[int], int, list[int]]]:
        """Return the columns of each table, the gap between them and their widths."""
        every = list(range(len(self.headers)))
        for gap in (WIDE_GAP, NARROW_GAP):
            if self._least_width(every, gap) <= room:
                return [(every, gap, self._widths(every, gap, room))]
        wide, narrow = (self._parted(gap, room) for gap in (WIDE_GAP, NARROW_GAP))
        fits = all(self._least_width(columns, WIDE_GAP) <= room for columns in wide)
        gap, parts = (WIDE_GAP, wide) if fits and len(wide) == len(narrow) else (NARROW_GAP, narrow)
        return [(columns, gap, self._widths(columns, gap, room)) for columns in parts]

    def _parted(self, gap: int, room: int) -> list[list[int]]:
        """Return the columns of each table: the keys in all of them, and as many others as there is room for."""
        keys = list(range(self.keys))
        # Words in few columns fill many lines: where there is a choice, up to a third of the page is theirs.
        comfort = max(0, min(self._wanted(0), room // 3) - self._least(0))
        parts = [[*keys]]
        for column in range(self.keys, len(self.headers)):
            if len(parts[-1]) > self.keys and self._least_width([*parts[-1], column], gap) + comfort > room:
                parts.append([*keys])
            parts[-1].append(column)
        return parts

    def _least_width(self, columns: list[int], gap: int) -> int:
        return sum(self._least(column) + gap for column in columns) + 1

    def _widths(self, columns: list[int], gap: int, room: int) -> list[int]:
        """Return a width for each column: no less than its longest word, and of what is left all the same."""
        widths = [self._least(column) for column in columns]
        wanted = [self._wanted(column) for column in columns]
        spare = room - sum(widths) - gap * len(columns) - 1
        if spare < 0:  # one word is longer than the page, such as a path: it alone is folded
            longest = widths.index(max(widths))
            widths[longest] = max(widths[longest] + spare, NARROWEST)
        if spare > 0 and 0 in self.words:
            more = min(spare, max(0, min(wanted[0], room // 3) - widths[0]))
            widths[0] += more
            spare -= more
        while spare > 0 and widths != wanted:
            for index, width in enumerate(widths):
                if spare > 0 and width < wanted[index]:
                    widths[index] += 1
                    spare -= 1
        return widths

    def _cells(self, column: int) -> list[str]:
        return [self.headers[column], *(row[column] for row in self.rows)]

    def _wanted(self, column: int) -> int:
        """Return the longest header or cell of a column."""
        return max(map(len, self._cells(column)))

    def _least(self, column: int) -> int:
        """Return the longest word of a header or of words, or the longest number."""
        header, *cells = self._cells(column)
        unbroken = [word for cell in cells for word in cell.split()] if column in self.words else cells
        return max((len(word) for word in (*header.split(), *unbroken)), default=0)

    def _rendered(self, columns: list[int], gap: int, widths: list[int], title: str | None) -> "RenderableType":
        from rich import box
        from rich.table import Table
        from rich.text import Text

        table = Table(
            title=None if title is None else Text(title),
            box=box.SIMPLE_HEAD,
            title_justify="left",
            title_style="bold",
            padding=(0, gap // 2),
            collapse_padding=False,
        )
        for column, width in zip(columns, widths, strict=True):
            justify = "left" if column in self.words else "right"
            table.add_column(Text(self.headers[column]), justify=justify, overflow="fold", width=width)
        for row in self.rows:
            table.add_row(*(Text(row[column]) for column in columns))
        return table


def _without_trailing_blanks(
    console: "Console", options: "ConsoleOptions", table: "RenderableType"
) -> "Iterator[Segment]":
    """Yield the lines of a table as they are to stand in a file: rich fills each up with blanks."""
    from rich.segment import Segment

    for line in console.render_lines(table, options, pad=False):
        while line and not line[-1].text.strip():
            line.pop()
        if line:
            line[-1] = Segment(line[-1].text.rstrip(), line[-1].style)
        yield from line
        yield Segment.line()
