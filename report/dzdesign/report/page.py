"""A page of a report: from a verdict and sections to HTML that needs no network and no script.

Figures are SVG in it, their numbers are data: addresses. Every text that comes from a file is escaped by the template
engine; only figures and formulas, made here, are markup.
"""

import re
from base64 import b64encode
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from dzdesign.core.artefact_files import TOOL
from dzdesign.core.display import strict_templates, verdict_words
from dzdesign.core.documents import read_bytes
from dzdesign.core.errors import InputError
from dzdesign.core.recorded_units import RecordedUnits
from dzdesign.derivation.presentation.writers import anchor
from dzdesign.report.artefacts import MadeOutputs
from dzdesign.report.figure import PALETTE, ReportFigure, data_uri

if TYPE_CHECKING:
    import markupsafe

#: Characters of an English word; what is longer is a name or a hash.
LONGEST_WORD = 18
#: An option of the command line, and a command between backticks.
OPTION, COMMAND = r"(?<![\w-])--[a-z][\w-]*", r"`([^`<>\s][^`<>]*)`"
#: First bytes of a format -> its media type. SVG is none of them: it can hold scripts and addresses.
SIGNATURES = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg", b"GIF87a": "image/gif",
              b"GIF89a": "image/gif"}  # fmt: skip
#: Bytes of a logo: a page is sent by mail.
LARGEST_LOGO = 512 * 1024
#: Pressure drops with a column of their own; all of them stand in the CSV.
COLUMNS = 6
#: The sign beside a verdict, so that its colour is not its only carrier, and its kind.
VERDICTS = {True: ("✓", "good"), False: ("✗", "bad"), None: ("?", "open")}
SIGNS = {kind: sign for sign, kind in VERDICTS.values()}
Item = TypeVar("Item")


# --- tables: cells with a meaning, not with markup -----------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """One cell, `more` on a second line, smaller.

    Its kind is text, finding (a sentence, in which backticks stand about commands), number, code, symbol (code on one
    line), hash (on two), or the verdict good, bad or open.
    """

    text: str
    kind: str = "text"
    more: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table; `csv` holds all its rows, to be downloaded under its name, `notes` what marks in its cells point to."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    csv: str = ""
    name: str = ""
    notes: tuple[str, ...] = ()


def table_of(
    caption: str,
    items: Iterable[Item],
    *columns: tuple[str, Callable[[Item], Cell | str]],
    csv: str = "",
    name: str = "",
    notes: Sequence[str] = (),
) -> Table:
    """Return a table with a row an item; a column is its heading and what makes a cell of an item."""
    return Table(
        caption=caption,
        columns=tuple(heading for heading, _ in columns),
        rows=tuple(tuple(_as_cell(made(item)) for _, made in columns) for item in items),
        csv=csv,
        name=name,
        notes=tuple(notes),
    )


def table_of_rows(caption: str, columns: Sequence[str], rows: Iterable[Sequence[Cell | str]]) -> Table:
    """Return a table of rows whose cells are there already."""
    return Table(caption=caption, columns=tuple(columns), rows=tuple(tuple(map(_as_cell, row)) for row in rows))


def _as_cell(cell: Cell | str) -> Cell:
    return cell if isinstance(cell, Cell) else Cell(text=cell)


def shown_places(count: int) -> tuple[int, ...]:
    """Return which of so many pressure drops have a column: all, or some from the lowest to the highest.

    Examples
    --------
    >>> shown_places(3), shown_places(11)
    ((0, 1, 2), (0, 2, 4, 6, 8, 10))
    """
    if count <= COLUMNS:
        return tuple(range(count))
    return tuple(round(place * (count - 1) / (COLUMNS - 1)) for place in range(COLUMNS))


def number(value: float | None, digits: int, sign: str = "") -> Cell:
    """Return a number with so many decimals, ``+`` before it to show its sign always; a dash for None.

    Examples
    --------
    >>> number(1.25, 1).text, number(None, 1).text, number(-0.01, 1).text
    ('1.2', '–', '0.0')
    """
    if value is None:
        return in_number_font("–")
    text = f"{value:{sign}.{digits}f}"
    if float(text) == 0:
        text = f"{0.0:{sign}.{digits}f}"
    return in_number_font(text.replace("-", "−"))


def recorded(value: float | None, form: str, units: RecordedUnits) -> Cell:
    """Return a number in the unit of the recordings; `form` is that of `RecordedUnits.number`.

    Examples
    --------
    >>> recorded(1.25, ".1f V", RecordedUnits()).text, recorded(None, ".1f V", RecordedUnits()).text
    ('1.2', '–')
    """
    if value is None:
        return in_number_font("–")
    text = units.number(value, form)
    return in_number_font(text.replace("-", "−") if text.strip("-0.") else text.removeprefix("-"))


def in_units(heading: str, attribute: str, form: str, units: RecordedUnits) -> tuple[str, Callable[[Any], Cell]]:
    """Return a column of numbers in the unit of the recordings, which stands in its heading."""
    label = units.label(form.partition(" ")[2])
    return f"{heading} ({label})", lambda item: recorded(getattr(item, attribute), form, units)


def percent(heading: str, attribute: str, digits: int = 1) -> tuple[str, Callable[[Any], Cell]]:
    """Return a column of shares, in percent."""
    return f"{heading} (%)", lambda item: number(100 * getattr(item, attribute), digits)


def finding(text: str) -> Cell:
    """Return a sentence that states a finding: what stands between backticks is a command."""
    return Cell(text=text, kind="finding")


def in_number_font(text: str) -> Cell:
    """Return a text set as numbers are: such as a number with its unit, or a range."""
    return Cell(text=text, kind="number")


def whole(value: int) -> str:
    """Return a whole number with a thin gap at each thousand.

    Examples
    --------
    >>> whole(33550336)
    '33\\u202f550\\u202f336'
    """
    return f"{value:,}".replace(",", "\u202f")


def counted(count: int, noun: str) -> str:
    """Return a count with its noun, in the plural where it is not one.

    Examples
    --------
    >>> counted(1, "ramp test"), counted(6, "ramp test")
    ('1 ramp test', '6 ramp tests')
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def for_both_sides(lines: Iterable[str]) -> tuple[str, ...]:
    """Return lines of which two that differ in the side alone are one.

    Examples
    --------
    >>> for_both_sides(["positive side, no flow", "Negative commands: 2 V", "negative side, no flow"])
    ('both sides, no flow', 'Negative commands: 2 V')
    """
    of_side = r"(positive|negative) (side|commands)"
    found: dict[str, list[str]] = {}
    for line in lines:
        found.setdefault(re.sub(of_side, "", line, flags=re.IGNORECASE), []).append(line)

    def merged(alike: Sequence[str]) -> str:
        if len({word.lower() for line in alike for word, _ in re.findall(of_side, line, re.IGNORECASE)}) < 2:
            return alike[0]
        text = re.sub(of_side, "both sides", alike[0], flags=re.IGNORECASE)
        return text[:1].upper() + text[1:] if alike[0][:1].isupper() else text

    return tuple(merged(alike) for alike in found.values())


def verdict(holds: bool | None) -> Cell:
    """Return a verdict with its sign; None: not checked."""
    sign, kind = VERDICTS[holds]
    return Cell(text=f"{sign} {verdict_words(holds)}", kind=kind)


# --- what a page holds ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Headline:
    """The verdict: good if all holds, bad if something does not, open if something was not checked.

    `basis` says on what a good one rests; `reasons` name what does not hold or was not checked, `unrequired` what
    passes at zero command at most where no requirement forbids it, `untried` what nobody asked for and the command that
    tries it, `cautions` what the verdict is not about, and what somebody accepted; `some_failed`: valves of a lot are
    not calibrated.
    """

    kind: str
    text: str
    basis: str = ""
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
    """One number that matters: its label, the number itself, one to compare it with, and what it is of."""

    label: str
    value: str
    note: str
    beside: str = ""
    kind: str = "text"


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """What a section holds, in the order in which it is shown.

    None stands for a figure or a table of which there is nothing to show. `groups` are further lines, each group under
    a heading of its own. `missing` says what the section lacks and which command makes it; the page is whole without an
    `optional` one.
    """

    figures: Sequence[ReportFigure | None] = ()
    tables: Sequence[Table | None] = ()
    lines: tuple[str, ...] = ()
    groups: tuple[tuple[str, tuple[str, ...]], ...] = ()
    missing: str = ""
    optional: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to show, and nothing missing."""
        shown = (*self.figures, *self.tables, *self.lines, *(line for _, lines in self.groups for line in lines))
        return not any(shown) and not self.missing


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """What a page holds.

    `template` has the heading of every section, and what no report proves; `sections` by anchor what this one found;
    `missing` what is not there or not used, and which command makes it; `record` who and what, in the engineer's words.
    `of_figures` says what the figures are of, `not_counted` what of a machine no certificate here counts. Of a lot
    setting `lot` stands before all other figures, and `carrier` is the one valve that `record` and `figures` are of.
    `subtitle` says what the report is of, where the title names the valve; `lead` is the figure of the first page,
    `logo` a data: address. A `full` page has no appendix folded, on a screen and on paper.
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
    of_figures: str = ""
    not_counted: Sequence[str] = ()
    subtitle: str = ""
    lead: ReportFigure | None = None
    logo: str = ""
    full: bool = False


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
    outputs: MadeOutputs = field(default_factory=MadeOutputs)


def report_of(page: Page) -> Report:
    """Return the finished report of a page."""
    verdict = page.verdict
    return Report(
        html=render(page),
        kind=verdict.kind,
        holds=verdict.holds,
        verdict=". ".join(filter(None, (verdict.text, verdict.basis))),
        missing=tuple(page.missing),
    )


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
