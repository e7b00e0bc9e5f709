"""Renders verdicts for a terminal, for machines, for LaTeX and for a browser."""

import textwrap
from collections.abc import Callable, Iterator, Sequence
from html import escape
from typing import Any

import sympy

from dzdesign.core.artefacts import TOOL, to_json
from dzdesign.core.errors import InputError, nearest
from dzdesign.derivation.proof import Kind, Verdict
from dzdesign.derivation.typeset import latex, mathml, text_rows

SCHEMA = "dzdesign.derivation/1"
TITLE = "Derivation of the dead-zone compensation law"
_WIDTH = 100  # columns of the text report

_SECTIONS = (
    ("Taken as given", tuple(kind for kind in Kind if kind.is_given)),
    ("The paper's equations, derived", (Kind.PAPER,)),
    ("The law of this tool against the paper's", (Kind.LAW,)),
    ("Beyond the paper", (Kind.BEYOND,)),
)


def render(verdicts: Sequence[Verdict], format: str) -> str:
    """Render verdicts as one document.

    Parameters
    ----------
    verdicts : sequence of Verdict
        What `verify_equations` returns.
    format : str
        One of `FORMATS`: ``text``, ``json`` (schema ``dzdesign.derivation/1``), ``latex`` (a document that
        compiles by itself) or ``html`` (one page without scripts that needs no network).

    Returns
    -------
    str
        The document, with a newline at its end.

    Raises
    ------
    InputError
        If there is no such format.
    """
    if format not in _RENDERERS:
        known = ", ".join(FORMATS)
        raise InputError(f"unknown format {format!r}{nearest(format, FORMATS)}: choose one of {known}")
    return _RENDERERS[format](verdicts)


def _sections(verdicts: Sequence[Verdict]) -> Iterator[tuple[str, list[Verdict]]]:
    for heading, kinds in _SECTIONS:
        members = [verdict for verdict in verdicts if verdict.kind in kinds]
        if members:
            yield heading, members


def _summary(verdicts: Sequence[Verdict]) -> str:
    derived = [verdict for verdict in verdicts if not verdict.kind.is_given]
    failed = [verdict.number for verdict in derived if not verdict.holds]
    given = len(verdicts) - len(derived)
    if failed:
        return f"{len(failed)} of {len(derived)} statements do not hold: {', '.join(failed)}."
    return f"All {len(derived)} statements follow from the {given} taken as given."


# --- text ---------------------------------------------------------------------------------------------------


def _text(verdicts: Sequence[Verdict]) -> str:
    lines = [TITLE, "=" * len(TITLE)]
    for heading, members in _sections(verdicts):
        lines += ["", heading, "-" * len(heading)]
        for verdict in members:
            lines += ["", *_text_statement(verdict)]
    return "\n".join([*lines, "", _summary(verdicts), ""])


def _text_statement(verdict: Verdict) -> Iterator[str]:
    room = _WIDTH - len(verdict.number) - len(verdict.verdict) - 4
    yield f"{verdict.number}  {verdict.title:<{room}}  {verdict.verdict}"
    left = f"    {verdict.symbol} "
    for member in verdict.members:
        left += "= "
        for row in text_rows(member):
            yield left + row
            left = " " * len(left)
        left = left[:-2]
    if verdict.discrepancy is not None:
        yield f"    derived: {verdict.symbol} = {'; '.join(text_rows(verdict.derived))}"
        yield f"    derived minus published: {'; '.join(text_rows(verdict.discrepancy))}"
    if verdict.premises:
        yield from _wrapped("from: ", "; ".join(verdict.premises))
    if verdict.note:
        yield from _wrapped("note: ", verdict.note)


def _wrapped(label: str, text: str) -> list[str]:
    indent = "    " + " " * len(label)
    return textwrap.wrap(text, _WIDTH, initial_indent="    " + label, subsequent_indent=indent)


# --- json ---------------------------------------------------------------------------------------------------


def _json(verdicts: Sequence[Verdict]) -> str:
    document = {
        "schema": SCHEMA,
        "tool": TOOL,
        "holds": all(verdict.holds for verdict in verdicts),
        "statements": [_json_statement(verdict) for verdict in verdicts],
    }
    return to_json(document)


def _json_statement(verdict: Verdict) -> dict[str, Any]:
    return {
        "number": verdict.number,
        "title": verdict.title,
        "kind": verdict.kind.value,
        "statement": verdict.statement,
        "latex": _latex_chain(verdict),
        "premises": [{"number": ground.number, "where": ground.where} for ground in verdict.grounds],
        "verdict": verdict.verdict,
        "holds": verdict.holds,
        "derived": None if verdict.derived is None else sympy.sstr(verdict.derived),
        "discrepancy": None if verdict.discrepancy is None else sympy.sstr(verdict.discrepancy),
        "note": verdict.note,
    }


# --- latex --------------------------------------------------------------------------------------------------

_LATEX_ESCAPES = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": r"\textless{}",
        ">": r"\textgreater{}",
        **{character: "\\" + character for character in "&%$#_{}"},
    }
)


def _latex(verdicts: Sequence[Verdict]) -> str:
    lines = [
        r"\documentclass{article}",
        r"\usepackage[T1]{fontenc}",
        r"\usepackage{amsmath}",
        r"\setlength{\parindent}{0pt}",
        r"\begin{document}",
        rf"\section*{{{TITLE}}}",
        _summary(verdicts).translate(_LATEX_ESCAPES),
    ]
    for heading, members in _sections(verdicts):
        lines.append(rf"\subsection*{{{heading}}}")
        for verdict in members:
            lines += _latex_statement(verdict)
    return "\n".join([*lines, r"\end{document}", ""])


def _latex_statement(verdict: Verdict) -> Iterator[str]:
    title = f"{verdict.number} {verdict.title}".translate(_LATEX_ESCAPES)
    yield rf"\paragraph{{{title}}} \emph{{{verdict.verdict.translate(_LATEX_ESCAPES)}}}"
    rows = r" \\ ".join(f"&= {latex(member)}" for member in verdict.members)
    yield rf"\begin{{align*}} {latex(verdict.symbol)} {rows} \end{{align*}}"
    if verdict.discrepancy is not None:
        yield rf"Derived minus published: \[ {latex(verdict.discrepancy)} \]"
    if verdict.premises:
        yield "From " + "; ".join(verdict.premises).translate(_LATEX_ESCAPES) + r".\par"
    if verdict.note:
        yield verdict.note.translate(_LATEX_ESCAPES)


def _latex_chain(verdict: Verdict) -> str:
    return " = ".join(latex(side) for side in (verdict.symbol, *verdict.members))


# --- html ---------------------------------------------------------------------------------------------------

_STYLE = """\
body { font: 16px/1.5 system-ui, sans-serif; max-width: 52rem; margin: 2rem auto; padding: 0 1rem;
  color: #222; background: #fff; }
section.statement { border-left: 4px solid #8a94a0; padding: .2rem 1rem; margin: 1.2rem 0; }
section.follows { border-color: #2e7d32; }
section.fails { border-color: #c62828; background: #fdecea; }
h3 { font-size: 1rem; margin: 0; display: flex; gap: 1rem; }
h3 .verdict { margin-left: auto; font-weight: normal; }
math { margin: .6rem 0; font-size: 1.15em; }
p { margin: .2rem 0; }
.note { color: #555; }
@media (prefers-color-scheme: dark) {
  body { background: #16191d; color: #ddd; } .note { color: #aaa; }
  section.fails { background: #3a1c1c; } a { color: #8ab4f8; }
}"""


def _html(verdicts: Sequence[Verdict]) -> str:
    body = [f"<h1>{escape(TITLE)}</h1>", f"<p>{escape(_summary(verdicts))}</p>"]
    anchors = {verdict.number: f"s{index}" for index, verdict in enumerate(verdicts)}
    for heading, members in _sections(verdicts):
        body.append(f"<h2>{escape(heading)}</h2>")
        for verdict in members:
            body += _html_statement(verdict, anchors)
    head = f'<meta charset="utf-8"><title>{escape(TITLE)}</title>\n<style>\n{_STYLE}\n</style>'
    return "\n".join(["<!DOCTYPE html>", f'<html lang="en"><head>{head}</head><body>', *body, "</body></html>", ""])


def _html_statement(verdict: Verdict, anchors: dict[str, str]) -> Iterator[str]:
    outcome = "given" if verdict.kind.is_given else "follows" if verdict.holds else "fails"
    yield f'<section class="statement {outcome}" id="{anchors[verdict.number]}">'
    yield (
        f"<h3><span>{escape(verdict.number)}</span> <span>{escape(verdict.title)}</span>"
        f'<span class="verdict">{escape(verdict.verdict)}</span></h3>'
    )
    yield _html_math(verdict.symbol, *verdict.members)
    if verdict.discrepancy is not None:
        yield f"<p>Derived minus published:</p>{_html_math(verdict.discrepancy)}"
    if verdict.grounds:
        links = (
            f'<a href="#{anchors[ground.number]}">{escape(ground.number)}</a> {escape(ground.where)}'.rstrip()
            for ground in verdict.grounds
        )
        yield f"<p>from {'; '.join(links)}</p>"
    if verdict.note:
        yield f'<p class="note">{escape(verdict.note)}</p>'
    yield "</section>"


def _html_math(*sides: sympy.Expr) -> str:
    return f'<math display="block">{"<mo>=</mo>".join(map(mathml, sides))}</math>'


_RENDERERS: dict[str, Callable[[Sequence[Verdict]], str]] = {
    "text": _text,
    "json": _json,
    "latex": _latex,
    "html": _html,
}
FORMATS = tuple(_RENDERERS)
