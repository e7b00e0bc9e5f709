"""The report as one page for a browser: MathML, no scripts, nothing loaded from elsewhere."""

import re
from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

from dzdesign.derivation.account.statement import Outcome
from dzdesign.derivation.presentation.formulas import to_latex, to_mathml
from dzdesign.derivation.presentation.prose import Formula, Part
from dzdesign.derivation.presentation.writer import Writer, anchor

if TYPE_CHECKING:
    from markupsafe import Markup

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
