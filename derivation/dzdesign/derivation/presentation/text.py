"""The report as plain text: ASCII, 100 columns."""

import itertools
import re
import textwrap
from collections.abc import Callable, Collection, Sequence
from typing import Any

from dzdesign.derivation.presentation.content import Entry, Figure, Line
from dzdesign.derivation.presentation.formulas import to_text
from dzdesign.derivation.presentation.prose import Formula, Words
from dzdesign.derivation.presentation.writer import Writer

_WIDTH = 100  # columns
_COLUMNS = (5, 45, 17, 9, 20)  # of the table of equations
#: Stands for a blank at which a line may not be broken.
_FIXED = "\0"


class TextWriter(Writer):
    """Plain text; a formula in it may be broken before a sign only, and a short one not at all."""

    TEMPLATE = "derivation.txt.jinja"

    def text(self, text: str) -> str:
        return str(Words(text))

    def formula(self, formula: Formula) -> str:
        return _fixed(str(formula))

    def code(self, text: str) -> str:
        return f"`{text}`"

    def link(self, number: str, text: str) -> str:
        return text

    def display(self, formula: Formula, indent: str = "") -> str:
        first, *members = map(to_text, formula.sides)
        if not members:
            return wrap(_fixed(first), indent, indent)
        left, rows = f"{indent}{first} = ", []
        for member in members:
            for row in member.split("\n"):
                rows.append(wrap(_fixed(row), left, " " * len(left)))
                left = " " * len(left)
            left = " " * (len(left) - 2) + "= "
        return "\n".join(rows)

    def filters(self) -> dict[str, Callable[..., Any]]:
        lines: dict[str, Callable[..., Any]] = {"wrap": wrap, "head": _head, "line": self.line, "labelled": _labelled}
        return {**super().filters(), **lines, "equations": _equations, "figures": self.figures}

    def line(self, line: Line, indent: str) -> str:
        """Return a sentence, and below it the formula that it leads to."""
        words = wrap(self.words(line.words), indent)
        return words if line.formula is None else f"{words}\n{self.display(line.formula, 2 * indent)}"

    def figures(self, figures: Sequence[Figure], indent: str) -> str:
        """Return our numbers beside the paper's, each with its remark below."""
        rows = [("number", "ours", "paper")]
        rows += [(str(one.label), one.ours, self.text(one.paper) or "-") for one in figures]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = []
        for row, remark in zip(rows, ["", *(self.words(one.remark) for one in figures)], strict=True):
            lines.append(indent + _columns(row, widths, "  "))
            lines += [wrap(remark, 2 * indent)] if remark else []
        return "\n".join(lines)


def wrap(text: str, first: str = "", others: str | None = None) -> str:
    """Break a text into lines; `first` begins the first one and, unless `others` is given, the others too."""
    lines = textwrap.wrap(
        text,
        _WIDTH,
        initial_indent=first,
        subsequent_indent=first if others is None else others,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines).replace(_FIXED, " ")


def _equations(entries: Sequence[Entry]) -> str:
    """Return the table of the paper's equations."""
    rows = [("", "title", "verdict", "corrected", "see")]
    for entry in entries:
        corrected, see = (", ".join(one.number for one in found) for found in (entry.corrected_by, entry.see))
        rows.append((entry.number, str(entry.title), entry.mark, corrected, see))
    lines = []
    for row in rows:
        cells = [textwrap.wrap(cell, width) or [""] for cell, width in zip(row, _COLUMNS, strict=True)]
        lines += [_columns(parts, _COLUMNS, " ") for parts in itertools.zip_longest(*cells, fillvalue="")]
    return "\n".join(lines)


def _head(entry: Entry) -> str:
    """Return a statement's number and title, with its verdict at the right end where there is room."""
    room = _WIDTH - len(entry.number) - len(entry.mark) - 6
    line = f"{entry.number}  {entry.title!s:<{room}}  [{entry.mark}]"
    return line if len(line) <= _WIDTH else wrap(line)


def _labelled(text: str, label: str, indent: str) -> str:
    """Return a text behind a label."""
    return wrap(text, f"{indent}{label}: ", " " * len(f"{indent}{label}: "))


def _fixed(formula: str) -> str:
    if len(formula) < _WIDTH // 3:
        return formula.replace(" ", _FIXED)
    return re.sub(r" ([-+<>=]+) ", rf" \1{_FIXED}", formula)


def _columns(cells: Collection[str], widths: Sequence[int], gap: str) -> str:
    return gap.join(f"{cell:<{width}}" for cell, width in zip(cells, widths, strict=True)).rstrip()
