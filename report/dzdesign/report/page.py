"""A page of a report: from a verdict and sections to HTML that needs no network and no script.

Figures are SVG in it, their numbers are data: addresses. Every text that comes from a file is escaped by the template
engine; only figures and formulas, made here, are markup.
"""

import re
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from dzdesign.core.artefact_files import TOOL, read_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.strict_templates import strict_templates
from dzdesign.core.verdicts import verdict_words
from dzdesign.derivation.presentation.writers import anchor
from dzdesign.report.cells import Table
from dzdesign.report.figure import PALETTE, ReportFigure, data_uri

if TYPE_CHECKING:
    import markupsafe

#: Characters of an English word; what is longer is a name or a hash.
LONGEST_WORD = 18
#: An option of the command line, and a command between backticks.
OPTION, COMMAND = r"(?<![\w-])--[a-z][\w-]*", r"`([^`<>\s][^`<>]*)`"
#: Kind of a verdict -> the sign before it.
SIGNS = {"good": "✓", "bad": "✗", "open": "?"}
#: First bytes of a format -> its media type. SVG is none of them: it can hold scripts and addresses.
SIGNATURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg", b"GIF87a": "image/gif",
              b"GIF89a": "image/gif"}  # fmt: skip
#: Bytes of a logo: a page is sent by mail.
LARGEST_LOGO = 512 * 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class Headline:
    """The verdict: good if all holds, bad if something does not, open if something was not checked.

    `reasons` name what does not hold or was not checked, `unrequired` what passes at zero command at most where no
    requirement forbids it, `untried` what nobody asked for and the command that tries it, `cautions` what the verdict
    is not about, and what somebody accepted; `some_failed`: valves of a lot are not calibrated.
    """

    kind: str
    text: str
    reasons: tuple[str, ...] = ()
    unrequired: str = ""
    untried: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()
    some_failed: bool = False

    @property
    def sign(self) -> str:
        """What stands before it, so that its colour is not its only carrier."""
        return "!" if self.some_failed and self.kind == "open" else SIGNS[self.kind]

    @property
    def holds(self) -> bool | None:
        """None where something was not checked, or is not there."""
        return False if self.some_failed else {"good": True, "bad": False}.get(self.kind)


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One number that matters: its label, the number itself and what it is of."""

    label: str
    value: str
    note: str
    kind: str = "text"


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """What a section holds, in the order in which it is shown.

    None stands for a figure or a table of which there is nothing to show. `groups` are further lines, each group under
    a heading of its own. `missing` says what the section lacks and which
    command makes it; the page is whole without an `optional` one. Of a lot setting a section may be of one valve, the
    carrier.
    """

    figures: Sequence[ReportFigure | None] = ()
    tables: Sequence[Table | None] = ()
    lines: tuple[str, ...] = ()
    groups: tuple[tuple[str, tuple[str, ...]], ...] = ()
    missing: str = ""
    optional: bool = False
    of_valve: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """What a page holds.

    `template` has the heading of every section, and what no report proves; `sections` by anchor what this one found;
    `missing` what is not there or not used, and which command makes it; `record` who and what, in the engineer's words.
    `not_counted` is what of a machine no certificate here counts. Of a lot setting `lot` stands before all other
    figures, and `carrier` is the one valve that `record` and `figures` are of. `subtitle` says what the report is of,
    where the title names the valve; `lead` is the figure of the first page, `logo` a
    data: address.
    """

    title: str
    verdict: Headline
    figures: Sequence[Figure]
    template: str
    sections: Mapping[str, Section]
    missing: Sequence[str] = ()
    law: object | None = None
    record: Sequence[tuple[str, str]] = ()
    lot: Sequence[Figure] = ()
    carrier: str = ""
    not_counted: Sequence[str] = ()
    subtitle: str = ""
    lead: ReportFigure | None = None
    logo: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeOutput:
    """One output of the compensator that a report is of."""

    #: "C firmware", or the target of another output.
    kind: str
    #: What was chosen of it, in words; empty if nothing is to be chosen.
    settings: str
    #: Folder, below the folder of the report.
    place: str
    #: SHA-256 of its manifest.json.
    sha256: str
    #: What evidence about these bytes says; None without such evidence, or where a requirement was not checked.
    holds: bool | None = None
    #: How many inputs were compared with the exact law.
    inputs: int = 0
    #: Where that evidence stands; empty without one.
    evidence: str = ""
    #: Which requirement does not hold, or was not checked.
    fault: str = ""
    #: What differs from the manifest: the files are no longer those that were generated.
    changed: str = ""

    @property
    def verdict(self) -> str:
        """In words, as the terminal prints it."""
        if self.changed:
            return "CHANGED"
        return verdict_words(self.holds) if self.evidence or self.holds is not None else "NOT VERIFIED"

    @property
    def is_wrong(self) -> bool:
        """Whether nobody should use it: it was changed, or its evidence says that it does not hold."""
        return bool(self.changed) or self.holds is False


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeOutputs:
    """The outputs of one compensator in a folder; `others` are sentences on those that were not listed."""

    listed: tuple[MadeOutput, ...] = ()
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """A finished report.

    Attributes
    ----------
    html : str
        The page.
    kind : {"good", "bad", "open"}
        Kind of the verdict.
    holds : bool or None
        Verdict; None if something was not checked, or is missing.
    verdict : str
        Verdict in words.
    missing : tuple of str
        What is missing, and which command makes it.
    outputs : MadeOutputs
        For the report of a valve: the outputs made from its compensator.
    """

    html: str
    kind: str
    holds: bool | None
    verdict: str
    missing: tuple[str, ...]
    outputs: MadeOutputs = MadeOutputs()


def report_of(page: Page) -> Report:
    """Return the finished report of a page."""
    verdict = page.verdict
    return Report(
        html=render(page), kind=verdict.kind, holds=verdict.holds, verdict=verdict.text, missing=tuple(page.missing)
    )  # fmt: skip


def render(page: Page) -> str:
    """Return a page as HTML."""
    environment = strict_templates("dzdesign.report", lstrip_blocks=True, autoescape=True)
    environment.filters.update(
        data_uri=data_uri, anchor=anchor, words=_words, cell=_cell, css_text=_css_text, tied=_tied, finding=_finding
    )
    content = {each.name: getattr(page, each.name) for each in fields(page)}
    html: str = environment.get_template(page.template).render(tool=TOOL, palette=PALETTE, **content)
    return html


def _css_text(text: str) -> "markupsafe.Markup":
    """Return a text as a string of a style sheet, in which no sign of it has a meaning."""
    from markupsafe import Markup

    plain = " ".join(text.split())
    return Markup('"{}"').format(
        Markup("").join(sign if sign.isascii() and sign.isalnum() else Markup(f"\\{ord(sign):x} ") for sign in plain)
    )


def _tied(text: str) -> "markupsafe.Markup":
    """Return a text for the page; the name of an option stays on one line."""
    from markupsafe import Markup, escape

    return Markup(re.sub(OPTION, r'<span class="tied">\g<0></span>', str(escape(text))))


def _words(text: str, plain: "Callable[[str], markupsafe.Markup]" = _tied) -> "markupsafe.Markup":
    """Return a sentence for the page: what stands between backticks is a command."""
    from markupsafe import Markup

    parts = re.split(COMMAND, text)
    return Markup("").join(
        Markup("<code>{}</code>").format(_tied(part)) if place % 2 else plain(part) for place, part in enumerate(parts)
    )


def _finding(text: str) -> "markupsafe.Markup":
    """Return a sentence for a cell: as `_words`, and a word too long for a column may be broken."""
    return _words(text, _cell)


def _cell(text: str) -> "markupsafe.Markup":
    """Return the text of a cell, in which only a word too long for a column may be broken: after a sign, if it can."""
    from markupsafe import Markup, escape

    def broken(word: str) -> Markup:
        return Markup("<wbr>").join(escape(part) for part in re.findall(r"[^/._,=]*[/._,=]*", word) if part)

    return Markup("").join(
        Markup('<span class="breaks">{}</span>').format(broken(word)) if len(word) > LONGEST_WORD else escape(word)
        for word in re.split(r"(\s+)", text)
    )


def logo_uri(path: Path) -> str:
    """Return a logo as a data: address.

    Raises
    ------
    InputError
        If it can't be read, is too large, or is no PNG, JPEG or GIF.
    """
    content = read_bytes(path, "logo")
    if len(content) > LARGEST_LOGO:
        raise InputError(f"--logo '{path}' has {len(content)} bytes, expected at most {LARGEST_LOGO}; scale it down")
    kind = next((kind for start, kind in SIGNATURES.items() if content.startswith(start)), None)
    if kind is None:
        raise InputError(
            f"--logo '{path}' is no PNG, JPEG or GIF, expected one of these; SVG can hold scripts: save it as PNG"
        )
    return f"data:{kind};base64,{b64encode(content).decode()}"
