"""The report as one page for a browser: MathML, no scripts, nothing loaded from elsewhere."""

import re
from html import escape
from typing import TYPE_CHECKING

from dzdesign.derivation.account.statement import Outcome
from dzdesign.derivation.presentation import content as report_content
from dzdesign.derivation.presentation.content import Content, Entry
from dzdesign.derivation.presentation.prose import Code, Formula, Quantity, Raised, Reference, Words
from dzdesign.derivation.presentation.text import plain
from dzdesign.derivation.presentation.typeset import MATHML, typeset

if TYPE_CHECKING:
    import markupsafe

#: A browser would break the line between a formula and the punctuation beside it.
_TIED = re.compile(r"(\(?)(<math(?:(?!</math>).)*</math>)([,.;:)]*)")
#: A formula in a sentence that is longer than this, as plain text, scrolls by itself where the page is narrow.
_LONG = 28
#: Stands beside each verdict, so that its colour is not the only carrier; the word does the rest.
_SIGNS = {Outcome.GIVEN: "▫", Outcome.FOLLOWS: "✓", Outcome.FOLLOWS_IF: "◐", Outcome.DOES_NOT_FOLLOW: "✗"}


def write_html(content: Content) -> str:
    """Return the report as an HTML page.

    Parameters
    ----------
    content : Content

    Returns
    -------
    str
    """
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dzdesign.derivation.presentation", "templates"),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
    )
    page = Page({entry.number for _, entries in content.sections for entry in entries})
    environment.filters.update(words=page.words, display=page.display, anchor=anchor, css=_css_class)
    template = environment.get_template("derivation.html.jinja")
    return template.render(
        content=content,
        shown=page.shown,
        signs=_SIGNS,
        lists=((report_content.WRONG, content.wrong), (report_content.CONDITIONAL, content.conditional)),
        legend=report_content.LEGEND,
        table_heading=report_content.TABLE,
        glossary_heading=report_content.GLOSSARY,
        outcomes=Outcome,
    )


def anchor(number: str) -> str:
    """Return the name by which a statement can be linked to: ``eq-18``, ``T3b``.

    Parameters
    ----------
    number : str

    Returns
    -------
    str

    Examples
    --------
    >>> anchor("(18)"), anchor("T3b"), anchor("Fig. 3, line")
    ('eq-18', 'T3b', 'Fig-3-line')
    """
    slug = re.sub(r"\W+", "-", number).strip("-")
    return f"eq-{slug}" if number.startswith("(") else slug


def _tie(found: re.Match) -> str:
    return f'<span class="tied">{found[0]}</span>' if found[1] or found[3] else found[0]


def _css_class(entry: Entry) -> str:
    return entry.verdict.outcome.value.replace(" ", "-")


class Page:
    """Writes words and formulas; knows which statements there are to point to.

    Parameters
    ----------
    shown : set of str
        Numbers of the statements on the page.
    """

    def __init__(self, shown: set[str]) -> None:
        self.shown = shown

    def words(self, words: Words) -> "markupsafe.Markup":
        """Return words as HTML.

        Parameters
        ----------
        words : Words
        """
        from markupsafe import Markup

        return Markup(_TIED.sub(_tie, "".join(map(self._part, words))))

    def display(self, formula: Formula) -> "markupsafe.Markup":
        """Return a formula on a line of its own; a chain has one member a line.

        Parameters
        ----------
        formula : Formula
        """
        from markupsafe import Markup

        first, *members = (typeset(side, MATHML) for side in formula.sides)
        rows = f"<mtr><mtd>{first}</mtd></mtr>"
        if members:
            left = [first, *["<mrow></mrow>"] * (len(members) - 1)]
            cells = (
                f"<mtr><mtd>{side}</mtd><mtd><mo>=</mo></mtd><mtd>{member}</mtd></mtr>"
                for side, member in zip(left, members, strict=True)
            )
            rows = "".join(cells)
        return Markup(f'<math display="block"><mtable class="chain" displaystyle="true">{rows}</mtable></math>')

    def _part(self, part: object) -> str:
        match part:
            case Quantity(name):
                return f"<math>{typeset(name, MATHML)}</math>"
            case Formula(sides):
                chain = "<mo>=</mo>".join(typeset(side, MATHML) for side in sides)
                style = ' displaystyle="true"' if "<mfrac" in chain else ""
                math = f"<math{style}>{chain}</math>"
                return f'<span class="long">{math}</span>' if len(plain((part,))) > _LONG else math
            case Reference(number, words):
                text = self.words(words) or escape(number)
                return f'<a href="#{anchor(number)}">{text}</a>' if number in self.shown else str(text)
            case Code(text):
                return f"<code>{escape(text)}</code>"
            case Raised(text):
                return f"<sup>{escape(text)}</sup>"
        return escape(str(part))
