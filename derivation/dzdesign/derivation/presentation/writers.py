"""Writes words and formulas as plain text, 100 columns of ASCII, or as one page for a browser: MathML, no scripts.

Each fills the template that holds the structure of its document.
"""

import itertools
import re
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

from dzdesign.core.strict_templates import strict_templates
from dzdesign.derivation.account.statement import Outcome
from dzdesign.derivation.presentation.content import DerivationReport, Entry, Figure, Line
from dzdesign.derivation.presentation.formulas import to_latex, to_mathml, to_text
from dzdesign.derivation.presentation.prose import Code, Formula, Part, Reference, Words

if TYPE_CHECKING:
    from markupsafe import Markup


class Writer(ABC):
    """A notation; `linked` are the numbers of the statements in the document: those that can be pointed to."""

    #: The template of a whole document.
    TEMPLATE: ClassVar[str]
    #: What sets this template's syntax apart.
    SYNTAX: ClassVar[Mapping[str, Any]] = {}

    def __init__(self, linked: Collection[str] = ()) -> None:
        self.linked = linked

    def words(self, *parts: Part) -> str:
        """Return words in this notation."""
        return "".join(map(self._part, Words(*parts).parts))

    def _part(self, part: str | Formula | Reference | Code) -> str:
        match part:
            case Formula():
                return self.formula(part)
            case Code(text):
                return self.code(text)
            case Reference(number, words):
                return self.link(number, self.words(words)) if number in self.linked else self.words(words)
        return self.text(part)

    @abstractmethod
    def text(self, text: str) -> str:
        """Return plain words, escaped."""

    @abstractmethod
    def formula(self, formula: Formula) -> str:
        """Return a formula within a sentence."""

    @abstractmethod
    def display(self, formula: Formula) -> str:
        """Return a formula on a line of its own; a chain has one member a line."""

    @abstractmethod
    def code(self, text: str) -> str:
        """Return a word of the command line or of a file."""

    @abstractmethod
    def link(self, number: str, text: str) -> str:
        """Return a text that leads to a statement of the document."""

    def filters(self) -> dict[str, Callable[..., Any]]:
        """Return what the template may apply."""
        return {"words": self.words, "display": self.display, "references": self.references, "anchor": anchor}

    def references(self, references: Collection[Reference], by_number: bool = False) -> str:
        """Return references with commas between, by their numbers alone or by the words that name them."""
        return self.words(Words.join(Reference(one.number) if by_number else one for one in references))


def write(kind: type[Writer], report: DerivationReport) -> str:
    """Return a whole document in a notation."""
    environment = strict_templates("dzdesign.derivation.presentation", lstrip_blocks=True, **kind.SYNTAX)
    environment.filters.update(kind({entry.number for entry in report.statements}).filters())
    return str(environment.get_template(kind.TEMPLATE).render(content=report))


def anchor(number: str) -> str:
    """Return the name by which a statement can be linked to: ``eq-18``, ``T3b``.

    Examples
    --------
    >>> anchor("(18)"), anchor("T3b"), anchor("Fig. 3, line")
    ('eq-18', 'T3b', 'Fig-3-line')
    """
    slug = re.sub(r"\W+", "-", number).strip("-")
    return f"eq-{slug}" if number.startswith("(") else slug


# --- plain text ---------------------------------------------------------------------------------------------

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


# --- a page for a browser -----------------------------------------------------------------------------------

#: A browser would break the line between a formula and the punctuation beside it.
_TIED = re.compile(r"(\(?)(<math(?:(?!</math>).)*</math>)([,.;:)]*)")
#: A formula in a sentence that is longer than this, as plain text, scrolls by itself where the page is narrow.
_LONG = 28
#: Stands beside each verdict, so that its colour is not the only carrier; the word does the rest.
_SIGNS = {Outcome.GIVEN: "▫", Outcome.FOLLOWS: "✓", Outcome.FOLLOWS_IF: "◐", Outcome.DOES_NOT_FOLLOW: "✗"}


class HtmlWriter(Writer):
    """HTML with MathML; its words are markup that a template does not escape again."""

    TEMPLATE = "derivation.html.jinja"
    SYNTAX: ClassVar = {"autoescape": True}

    def words(self, *parts: Part) -> "Markup":
        return _markup(_TIED.sub(_tie, super().words(*parts)))

    def text(self, text: str) -> str:
        return escape(text)

    def formula(self, formula: Formula) -> str:
        chain = " = ".join(map(to_latex, formula.sides))
        style = ' displaystyle="true"' if r"\frac" in chain else ""
        math = f"<math{style}>{to_mathml(chain)}</math>"
        return f'<span class="long">{math}</span>' if len(str(formula)) > _LONG else math

    def display(self, formula: Formula) -> "Markup":
        first, *members = (to_mathml(to_latex(side)) for side in formula.sides)
        rows = [[first]]
        if members:
            left = [first, *["<mrow></mrow>"] * (len(members) - 1)]
            rows = [[side, "<mo>=</mo>", member] for side, member in zip(left, members, strict=True)]
        table = "".join(f"<mtr>{''.join(f'<mtd>{cell}</mtd>' for cell in row)}</mtr>" for row in rows)
        return _markup(f'<math display="block"><mtable class="chain" displaystyle="true">{table}</mtable></math>')

    def code(self, text: str) -> str:
        return f"<code>{escape(text)}</code>"

    def link(self, number: str, text: str) -> str:
        return f'<a href="#{anchor(number)}">{text}</a>'

    def filters(self) -> dict[str, Callable[..., Any]]:
        return {**super().filters(), "css": _css_class, "sign": _sign}


def _markup(html: str) -> "Markup":
    from markupsafe import Markup

    return Markup(html)


def _tie(found: re.Match[str]) -> str:
    return f'<span class="tied">{found[0]}</span>' if found[1] or found[3] else found[0]


def _css_class(outcome: str) -> str:
    return outcome.replace(" ", "-")


def _sign(outcome: str) -> str:
    return _SIGNS[Outcome(outcome)]
