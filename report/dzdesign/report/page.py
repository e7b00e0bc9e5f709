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

    Attributes
    ----------
    figures : tuple of ReportFigure
    tables : tuple of Table
    lines : tuple of str
        Sentences of figures.
    groups : tuple of (str, tuple of str)
        Further sentences, each group under a heading of its own.
    missing : str
        What it lacks and which command makes that; empty if nothing.
    optional : bool
        Whether the page is whole without it.
    note : str
        What to do with it; what stands between backticks is a command.
    of_valve : bool
        Whether it is of one valve: of a lot setting, of its carrier.
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

    Attributes
    ----------
    title : str
        Its first heading.
    verdict : Headline
        What it leads with.
    figures : sequence of Figure
        The numbers that matter.
    headings : sequence of (str, str)
        Anchor and heading of every section, in their order; ``provenance`` and ``warnings`` among them.
    sections : mapping of str to Section
        By anchor.
    missing : sequence of str
        What is not there or not used, and which command makes it.
    law : LawAccount, optional
        The derivation, for the section ``law``.
    record : sequence of (str, str)
        Who and what, in the engineer's words.
    lot : sequence of Figure
        Of a lot setting, before all others.
    carrier : str
        Of a lot setting: the one valve that `record` and `figures` are of.
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
