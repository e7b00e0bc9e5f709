"""The report as plain text: ASCII, 100 columns."""

import itertools
import re
import textwrap
from collections.abc import Iterator

from dzdesign.derivation.presentation.content import (
    CONDITIONAL,
    GLOSSARY,
    LEGEND,
    TABLE,
    WRONG,
    Content,
    Entry,
    Figure,
    Line,
)
from dzdesign.derivation.presentation.prose import Code, Formula, Quantity, Raised, Reference, Words
from dzdesign.derivation.presentation.typeset import TEXT, typeset

_WIDTH = 100  # columns
_COLUMNS = (5, 45, 17, 9, 20)
_INDENT = "    "
_KEYBOARD = str.maketrans({"−": "-", "–": "-", "≤": "<=", "≥": ">=", "→": "->", "“": '"', "”": '"'})
#: Stands for a blank at which a line may not be broken.
_FIXED = "\0"


def write_text(content: Content) -> str:
    """Return the report as plain text.

    Parameters
    ----------
    content : Content

    Returns
    -------
    str
    """
    return "\n".join([*_lines(content), ""])


def _lines(content: Content) -> Iterator[str]:
    yield from (content.title, "=" * len(content.title), content.source, "")
    for words in content.summary:
        yield from _wrapped(_tied(words))
    for heading, items in ((WRONG, content.wrong), (CONDITIONAL, content.conditional)):
        if items:
            yield from ("", f"{heading}:")
            for words in items:
                yield from _wrapped("- " + _tied(words), "  ", "    ")
    yield from ("", "Verdicts:")
    for mark, words in LEGEND:
        yield from _wrapped(f"{mark:<16}{words.translate(_KEYBOARD)}", "  ", " " * 18)
    if content.table:
        yield from ("", TABLE, "-" * len(TABLE), *_table(content.table))
    yield from ("", GLOSSARY, "-" * len(GLOSSARY))
    for term in content.glossary:
        name = plain((term.symbol,))
        yield from _wrapped(f"{name:<12}{_tied(term.meaning)} [{term.unit}]", "  ", " " * 14)
    for section, entries in content.sections:
        yield from ("", "", section, "-" * len(section))
        for entry in entries:
            yield from ("", *_entry(entry))
    yield ""
    for words in content.summary:
        yield from _wrapped(_tied(words))


def _table(entries: tuple[Entry, ...]) -> Iterator[str]:
    rows = [("", "title", "verdict", "corrected", "see")]
    for entry in entries:
        see = ", ".join(reference.number for reference in entry.see)
        rows.append((entry.number, plain(entry.title), entry.mark, entry.verdict.statement.corrected_by, see))
    for row in rows:
        cells = [textwrap.wrap(cell, width) or [""] for cell, width in zip(row, _COLUMNS, strict=True)]
        for parts in itertools.zip_longest(*cells, fillvalue=""):
            yield " ".join(f"{part:<{width}}" for part, width in zip(parts, _COLUMNS, strict=True)).rstrip()


def _entry(entry: Entry) -> Iterator[str]:
    room = _WIDTH - len(entry.number) - len(entry.mark) - 6
    if len(plain(entry.title)) <= room:
        yield f"{entry.number}  {plain(entry.title):<{room}}  [{entry.mark}]"
    else:
        yield from _wrapped(f"{entry.number}  {_tied(entry.title)}  [{entry.mark}]")
    yield from _formula(entry.chain, _INDENT)
    if entry.judgement:
        yield from _wrapped(_tied(entry.judgement), _INDENT)
    if entry.scope:
        yield from _wrapped(_tied(entry.scope), _INDENT)
    if entry.premises:
        yield from _labelled("from", "; ".join(map(_tied, entry.premises)))
    for derivation in entry.derivations:
        if derivation.where:
            yield from _wrapped(_tied(derivation.where).strip() + ":", _INDENT)
        for line in derivation.lines:
            yield from _line(line)
    for line in (*entry.differences, *([entry.correction] if entry.correction else [])):
        yield from _line(line)
    yield from _figures(entry.figures)
    for label, text in (("signs", _tied(entry.sign_words)), ("note", _tied(entry.note))):
        if text:
            yield from _labelled(label, text)
    if entry.see:
        yield from _labelled("see", ", ".join(_tied((reference,)) for reference in entry.see))


def _line(line: Line) -> Iterator[str]:
    yield from _wrapped(_tied(line.words), _INDENT)
    if line.display is not None:
        yield from _formula(line.display, _INDENT * 2)


def _figures(figures: tuple[Figure, ...]) -> Iterator[str]:
    if not figures:
        return
    rows = [("number", "ours", "paper")]
    rows += [(plain(figure.label), figure.ours, figure.paper.translate(_KEYBOARD) or "-") for figure in figures]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    remarks = ["", *(_tied(figure.remark) for figure in figures)]
    for row, remark in zip(rows, remarks, strict=True):
        cells = (f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))
        yield (_INDENT + "  ".join(cells)).rstrip()
        if remark:
            yield from _wrapped(remark, _INDENT * 2)


def plain(words: Words) -> str:
    """Return words as ASCII text.

    Parameters
    ----------
    words : Words

    Returns
    -------
    str
    """
    return _tied(words).replace(_FIXED, " ")


def _tied(words: Words) -> str:
    """Return words as ASCII text whose formulas are not broken between lines."""
    return "".join(map(_plain, words))


def _plain(part: object) -> str:
    match part:
        case Quantity(name):
            return name
        case Formula(sides):
            return _fixed(" = ".join(typeset(side, TEXT) for side in sides))
        case Reference(number, words):
            return _tied(words) or number
        case Code(text):
            return f"`{text}`"
        case Raised(text):
            return f"^{text}"
    return str(part).translate(_KEYBOARD)


def _formula(formula: Formula, indent: str) -> Iterator[str]:
    """Yield a chain of equal expressions, one member a line; long ones break before a sign."""
    first, *members = (typeset(side, TEXT) for side in formula.sides)
    if not members:
        yield from _wrapped(_fixed(first), indent, indent)
        return
    left = indent + first + " = "
    for member in members:
        for row in member.split("\n"):
            yield from _wrapped(_fixed(row), left, " " * len(left))
            left = " " * len(left)
        left = " " * (len(left) - 2) + "= "


def _fixed(formula: str) -> str:
    """Let a formula break before a sign only, and a short one not at all."""
    if len(formula) < _WIDTH // 3:
        return formula.replace(" ", _FIXED)
    return re.sub(r" ([-+<>=]+) ", rf" \1{_FIXED}", formula)


def _labelled(label: str, text: str) -> list[str]:
    return _wrapped(text, f"{_INDENT}{label}: ", " " * len(f"{_INDENT}{label}: "))


def _wrapped(text: str, first: str = "", others: str | None = None) -> list[str]:
    lines = textwrap.wrap(
        text,
        _WIDTH,
        initial_indent=first,
        subsequent_indent=first if others is None else others,
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [line.replace(_FIXED, " ") for line in lines]
