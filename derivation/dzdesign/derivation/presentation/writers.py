"""Writes words and formulas as plain text, 100 columns of ASCII, or as one page for a browser: MathML, no scripts.

Each fills the template that holds the structure of its document.
"""

import re
import textwrap
from collections.abc import Callable, Collection, Mapping
from html import escape
from typing import TYPE_CHECKING, Any

import sympy

from dzdesign.core.display import strict_templates
from dzdesign.derivation.account.statement import Outcome
from dzdesign.derivation.presentation.content import PARTS, DerivationReport, Entry, Formula, Line, Words
from dzdesign.derivation.presentation.formulas import to_latex, to_mathml, to_text
from dzdesign.derivation.symbols import QUANTITIES

if TYPE_CHECKING:
    from markupsafe import Markup


def _render(template: str, filters: Mapping[str, Callable[..., Any]], report: DerivationReport, **syntax: Any) -> str:
    environment = strict_templates("dzdesign.derivation.presentation", lstrip_blocks=True, **syntax)
    environment.filters.update(filters)
    return str(environment.get_template(template).render(content=report))


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


def write_text(report: DerivationReport) -> str:
    """Return the whole document as plain text."""
    filters: dict[str, Callable[..., Any]] = {"display": _display, "line": _line, "wrap": wrap}
    return _render("derivation.txt.jinja", {**filters, "head": _head, "labelled": _labelled}, report)


def _display(formula: Formula, indent: str = "") -> str:
    """Return a formula on a line of its own; a chain has one member a line."""
    first, *members = map(to_text, formula.sides)
    if not members:
        return wrap(first, indent)
    left, rows = f"{indent}{first} = ", []
    for member in members:
        for row in member.split("\n"):
            rows.append(wrap(row, left, " " * len(left)))
            left = " " * len(left)
        left = " " * (len(left) - 2) + "= "
    return "\n".join(rows)


def _line(line: Line, indent: str) -> str:
    """Return a sentence, and below it the formula that it leads to."""
    words = wrap(line.words, indent)
    return words if line.formula is None else f"{words}\n{_display(line.formula, 2 * indent)}"


def wrap(text: object, first: str = "", others: str | None = None) -> str:
    """Break a text into lines; `first` begins the first one and, unless `others` is given, the others too."""
    lines = textwrap.wrap(
        str(text),
        _WIDTH,
        initial_indent=first,
        subsequent_indent=first if others is None else others,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(lines)


def _head(entry: Entry, indent: str = "") -> str:
    """Return a statement's number and title, with its verdict at the right end where there is room."""
    left = f"{indent}{entry.number}  {entry.title}"
    line = f"{left:<{_WIDTH - len(entry.mark) - 4}}  [{entry.mark}]"
    return line if len(line) <= _WIDTH else wrap(line, "", 2 * indent)


def _labelled(text: object, label: str, indent: str) -> str:
    """Return a text behind a label."""
    return wrap(text, f"{indent}{label}: ", " " * len(f"{indent}{label}: "))


# --- a page for a browser -----------------------------------------------------------------------------------

#: A formula in a sentence that is shorter than this is not broken.
_LONG = 28
#: Stands beside each verdict, so that its colour is not the only carrier; the word does the rest.
_SIGNS = {Outcome.GIVEN: "▫", Outcome.FOLLOWS: "✓", Outcome.FOLLOWS_IF: "◐", Outcome.DOES_NOT_FOLLOW: "✗"}
#: What a keyboard has, and what print has in its place.
_PRINTED = (
    (re.compile(r"&lt;="), "≤"),
    (re.compile(r"&gt;="), "≥"),
    (re.compile(r"!="), "≠"),
    (re.compile(r" - "), " − "),
    (re.compile(r"(?<![\w)-])-(?=[\w(]|$)"), "−"),
    (re.compile(r"(?<=[\d)])-(?=[\d(])"), "–"),
    (re.compile(r"(?<=[a-z])\^(\d)"), r"<sup>\1</sup>"),
)
_NAME = re.compile(r"(?P<base>[A-Za-z]\w*'?)(?:\((?:s|0|dP)\))?")
_BY_NAME, _FUNCTIONS = {str(name): name for name in QUANTITIES}, {"sqrt": "√", "log": "ln "}


def write_html(report: DerivationReport) -> str:
    """Return the whole document as one page."""
    writer = HtmlWriter({entry.number for entry in report.statements})
    filters: dict[str, Callable[..., Any]] = {
        "words": writer.words, "display": writer.display, "name": writer.name, "anchor": anchor,
        "css": lambda outcome: outcome.replace(" ", "-"), "sign": lambda outcome: _SIGNS[Outcome(outcome)],
    }  # fmt: skip
    return _render("derivation.html.jinja", filters, report, autoescape=True)


class HtmlWriter:
    """HTML with MathML; its words are markup that a template does not escape again.

    `linked` are the numbers of the statements in the document: those that can be pointed to.
    """

    def __init__(self, linked: Collection[str] = ()) -> None:
        self.linked = linked

    def words(self, words: Words | Formula | str) -> "Markup":
        text = f"${words}$" if isinstance(words, Formula) else words.text if isinstance(words, Words) else words
        return _markup(self._sentence(text))

    def _sentence(self, text: str) -> str:
        parts, end = [], 0
        for found in PARTS.finditer(text):
            parts += [_printed(text[end : found.start()]), self._part(found)]
            end = found.end()
        return "".join((*parts, _printed(text[end:])))

    def name(self, number: str) -> "Markup":
        """Return a statement's number, or what it is called, without a link."""
        return _markup(_symbols(number) if number in _BY_NAME else escape(number))

    def _part(self, found: re.Match[str]) -> str:
        if found["code"]:
            return f"<code>{escape(found['code'])}</code>"
        if found["formula"]:
            # A browser would break the line between a formula and the punctuation beside it.
            symbols = f"{found['before']}{_symbols(found['formula'])}{found['behind']}"
            return f'<span class="tied">{symbols}</span>' if len(found["formula"]) < _LONG else symbols
        number = found["to"] or found["number"]
        words = self._sentence(found["words"]) if found["words"] else number
        return f'<a href="#{anchor(number)}">{words}</a>' if number in self.linked else words

    def display(self, formula: Formula) -> "Markup":
        """Return a formula on a line of its own; a chain has one member a line."""
        first, *members = (to_mathml(to_latex(side)) for side in formula.sides)
        rows = [["" if n else first, "<mo>=</mo>", member] for n, member in enumerate(members)] or [[first]]
        table = "".join(f"<mtr>{''.join(f'<mtd>{cell}</mtd>' for cell in row)}</mtr>" for row in rows)
        return _markup(f'<math display="block"><mtable class="chain" displaystyle="true">{table}</mtable></math>')


def _markup(html: str) -> "Markup":
    from markupsafe import Markup

    return Markup(html)


def _printed(text: str) -> str:
    text = escape(text)
    for keyboard, printed in _PRINTED:
        text = keyboard.sub(printed, text)
    return text


def _symbols(formula: str) -> str:
    """Typeset each symbol of a formula in a sentence; the rest stands as it is."""
    parts, end = [], 0
    for found in _NAME.finditer(formula):
        name = found[0] if found[0] in _BY_NAME else found["base"]
        symbol = _FUNCTIONS.get(name) or f"<math>{to_mathml(to_latex(_BY_NAME.get(name, sympy.Symbol(name))))}</math>"
        parts += [_printed(formula[end : found.start()].replace("*", "\N{THIN SPACE}")), symbol]
        end = found.start() + len(name)
    return "".join((*parts, _printed(formula[end:].replace("*", "\N{THIN SPACE}"))))
