"""A page of a report: from a verdict and sections to HTML that needs no network and no script.

Figures are SVG in it, their numbers are data: addresses. Every text that comes from a file is escaped by the template
engine; only figures and formulas, made here, are markup.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import TOOL
from dzdesign.derivation.presentation.writer import anchor
from dzdesign.report.figures.figure import PALETTE, ReportFigure, data_uri
from dzdesign.report.sections.cells import Table

if TYPE_CHECKING:
    import markupsafe

    from dzdesign.report.sections.law import LawAccount
    from dzdesign.report.summary import Figure, Headline

#: Characters of a word of the language; what is longer is a name or a hash.
LONGEST_WORD = 18


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """What a section holds, in the order in which it is shown.

    `groups` are further lines, each group under a heading of its own. `missing` says what the section lacks and which
    command makes it; the page is whole without an `optional` one. In a `note` a command stands between backticks. Of a
    lot setting a section may be of one valve, the carrier.
    """

    figures: tuple[ReportFigure, ...] = ()
    tables: tuple[Table, ...] = ()
    lines: tuple[str, ...] = ()
    groups: tuple[tuple[str, tuple[str, ...]], ...] = ()
    missing: str = ""
    optional: bool = False
    note: str = ""
    of_valve: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """What a page holds.

    `headings` has anchor and heading of every section, in their order, ``provenance`` and ``warnings`` among them;
    `missing` what is not there or not used, and which command makes it; `record` who and what, in the engineer's words.
    Of a lot setting `lot` stands before all other figures, and `carrier` is the one valve that `record` and `figures`
    are of.
    """

    title: str
    verdict: "Headline"
    figures: "Sequence[Figure]"
    headings: Sequence[tuple[str, str]]
    sections: Mapping[str, Section]
    missing: Sequence[str] = ()
    law: "LawAccount | None" = None
    record: Sequence[tuple[str, str]] = ()
    lot: "Sequence[Figure]" = ()
    carrier: str = ""


def render(page: Page) -> str:
    """Return a page as HTML."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("dzdesign.report", "templates"),
        undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
    )
    environment.filters.update(data_uri=data_uri, anchor=anchor, words=_words, cell=_cell)
    content = {each.name: getattr(page, each.name) for each in fields(page)}
    html: str = environment.get_template("report.html.jinja").render(tool=TOOL, palette=PALETTE, **content)
    return html


def _words(text: str) -> "markupsafe.Markup":
    """Return a sentence for the page: what stands between backticks is a command."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`<>]+)`", r"<code>\1</code>", str(escape(text))))


def _cell(text: str) -> "markupsafe.Markup":
    """Return the text of a cell, in which only a word too long for a column may be broken: after a sign, if it can."""
    from markupsafe import Markup, escape

    def broken(word: str) -> Markup:
        return Markup("<wbr>").join(escape(part) for part in re.findall(r"[^/._,=]*[/._,=]*", word) if part)

    return Markup("").join(
        Markup('<span class="breaks">{}</span>').format(broken(word)) if len(word) > LONGEST_WORD else escape(word)
        for word in re.split(r"(\s+)", text)
    )
