"""Stdout as a page, by rich: lines wrapped at blanks, tables in which no number is broken in two."""

import os
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, TypeVar

from dzdesign.core.documents import to_json
from dzdesign.core.errors import one_line

if TYPE_CHECKING:
    from rich.console import Console, ConsoleOptions
    from rich.segment import Segment

    from dzdesign.report.page import Table as PageTable

Row = TypeVar("Row")
#: What makes the cell of a result.
Column = Callable[[Row], str]
#: Columns of a page when stdout is a file or a pipe, and COLUMNS does not say.
FILE_WIDTH = 140
#: Blanks between the columns of a table, where there is room and where there is none; one more stands at its left.
WIDE_GAP, NARROW_GAP = 3, 1
#: Characters of a word, such as a file's name, that is not broken in a table.
LONGEST_WORD = 20
#: Kinds of a cell of the report that are words.
WORDS = ("text", "finding", "good", "bad", "open")


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


def say_results(*lines: str) -> None:
    """Print sentences on stdout, see `put_line`."""
    console = new_console()
    for line in lines:
        put_line(console, line)


def put_table(console: "Console", table: "Table") -> None:
    """Print a table."""
    console.print(table, crop=False)


def put_rows(
    console: "Console", title: str, rows: Iterable[Row], columns: Mapping[str, Column[Row]],
    words: Sequence[int] = (0,),
) -> None:  # fmt: skip
    """Print results as a table: each column is its header and what makes the cell of a result; `words` as for Table."""
    table = Table(title, *columns, words=words)
    for row in rows:
        table.add_row(*(cell(row) for cell in columns.values()))
    put_table(console, table)


def put_facts(console: "Console", *tables: "PageTable | None") -> None:
    """Print tables of the report; what a cell has more than its text stands below, where the text alone tells which."""
    for table in filter(None, tables):
        words = [at for at in range(len(table.columns)) if all(row[at].kind in WORDS for row in table.rows)]
        printed, below = Table(table.caption, *table.columns, words=words), dict[str, list[str]]()
        names = [row[0].text for row in table.rows]
        for row in table.rows:
            alone = names.count(row[0].text) == 1
            printed.add_row(*(cell.text if alone or not cell.more else f"{cell.text} ({cell.more})" for cell in row))
            for cell in row:
                if alone and cell.more:
                    below.setdefault(cell.more, []).append(cell.text)
        put_table(console, printed)
        for line in (*(f"{', '.join(texts)} ({more})" for more, texts in below.items()), *table.notes):
            put_line(console, line)


class Table:
    """A table that rich prints: headers and words are wrapped at blanks, a number is not.

    `words` are the columns of words. One that is too wide for the page goes on below, under its first column.
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
        if column not in self.words:
            return max((len(word) for word in (*self.headers[column].split(), *cells)), default=0)
        words = [word for cell in (self.headers[column], *cells) for word in cell.split()]
        return min(max(map(len, words), default=0), LONGEST_WORD)

    def _wanted(self, column: int) -> int:
        """Return the width of a column without a wrapped line."""
        return max(map(len, (self.headers[column], *(row[column] for row in self.rows))))

    def _parts(self, width: int) -> list[list[int]]:
        """Return the columns that fit side by side, all of them if they can; the first stands in each part."""
        parts: list[list[int]] = [[0]]
        for column in range(1, len(self.headers)):
            together = [*parts[-1], column]
            if len(parts[-1]) > 1 and 1 + sum(self._least(each) + NARROW_GAP for each in together) > width:
                parts.append([0, column])
            else:
                parts[-1] = together
        return parts

    def _widths(self, columns: Sequence[int], room: int) -> list[int]:
        """Return a width for each column: what can't be broken, and of the room that is left words before headers."""
        widths = {column: self._least(column) for column in columns}
        for column in sorted(columns, key=lambda column: column not in self.words):
            widths[column] += max(0, min(self._wanted(column) - widths[column], room - sum(widths.values())))
        widest = max(columns, key=lambda column: (column in self.words, widths[column]))
        widths[widest] = max(1, widths[widest] - max(0, sum(widths.values()) - room))  # a path longer than the page
        return list(widths.values())

    def __rich_console__(self, console: "Console", options: "ConsoleOptions") -> "Iterator[Segment]":
        """Yield the lines, without the blanks to which rich fills each up."""
        from rich import box
        from rich import table as rich_table
        from rich.segment import Segment
        from rich.text import Text

        for columns in self._parts(options.max_width):
            unwrapped = sum((self._wanted if each in self.words else self._least)(each) for each in columns)
            gap = WIDE_GAP if unwrapped + WIDE_GAP * len(columns) < options.max_width else NARROW_GAP
            widths = self._widths(columns, options.max_width - 1 - gap * len(columns))
            table = rich_table.Table(
                title=Text(self.title) if columns[1:2] in ([], [1]) else None, title_justify="left", title_style="bold",
                box=box.SIMPLE_HEAD, padding=(0, gap // 2), collapse_padding=False,
            )  # fmt: skip
            for column, width in zip(columns, widths, strict=True):
                justify: Literal["left", "right"] = "left" if column in self.words else "right"
                table.add_column(Text(self.headers[column]), justify=justify, width=width, overflow="fold")
            for row in self.rows:
                table.add_row(*(Text(row[column]) for column in columns))
            for line in console.render_lines(table, options, pad=False):
                while line and not line[-1].text.strip():
                    line.pop()
                yield from line[:-1]
                yield from [Segment(line[-1].text.rstrip(), line[-1].style)] if line else []
                yield Segment.line()
