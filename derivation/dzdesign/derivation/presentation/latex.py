"""The report as a LaTeX document that compiles by itself."""

import re
from collections.abc import Collection, Iterator

from dzdesign.derivation.presentation.content import (
    CONDITIONAL,
    GLOSSARY,
    LEGEND,
    TABLE,
    WRONG,
    Content,
    Derivation,
    Entry,
    Line,
)
from dzdesign.derivation.presentation.prose import Code, Formula, Quantity, Raised, Reference, Words
from dzdesign.derivation.presentation.typeset import LATEX, typeset

_PREAMBLE = r"""\documentclass[10pt,a4paper]{article}
\usepackage[margin=22mm]{geometry}
\usepackage{amsmath,graphicx,longtable}
\usepackage[hidelinks]{hyperref}
\setlength{\parindent}{0pt}
\setlength{\parskip}{2pt}
\setlength{\emergencystretch}{6em}
\allowdisplaybreaks
\AtBeginDocument{\abovedisplayskip=5pt plus 2pt\belowdisplayskip=5pt plus 2pt}
\renewcommand{\labelitemi}{$\bullet$}
\newsavebox{\wide}
% A formula that is too wide for the page is made smaller.
\newcommand{\fit}[1]{\sbox{\wide}{$\displaystyle #1$}%
  \ifdim\wd\wide>\dimexpr\linewidth-6em\relax\resizebox{\dimexpr\linewidth-6em}{!}{\usebox{\wide}}%
  \else\usebox{\wide}\fi}
\begin{document}
\raggedright"""

_ESCAPES = str.maketrans(
    {
        "\\": r"\textbackslash{}",
        "~": r"\textasciitilde{}",
        "^": r"\textasciicircum{}",
        "<": "$<$",
        ">": "$>$",
        "−": "$-$",
        "≤": r"$\le$",
        "≥": r"$\ge$",
        "→": r"$\to$",
        "–": "--",
        "“": "``",
        "”": "''",
        **{character: "\\" + character for character in "&%$#_{}"},
    }
)


def write_latex(content: Content) -> str:
    """Return the report as LaTeX.

    Parameters
    ----------
    content : Content

    Returns
    -------
    str
    """
    return "\n".join([*_Document(content).lines(), ""])


class _Document:
    """Writes the parts; knows which statements there are to point to."""

    def __init__(self, content: Content) -> None:
        self.content = content
        self.shown = {entry.number for _, entries in content.sections for entry in entries}

    def lines(self) -> Iterator[str]:
        content = self.content
        yield _PREAMBLE
        yield rf"\section*{{{_escape(content.title)}}}"
        yield _escape(content.source) + r"\par"
        yield from (self.words(words) + r"\par" for words in content.summary)
        for heading, items in ((WRONG, content.wrong), (CONDITIONAL, content.conditional)):
            yield from _list(heading, [self.words(words) for words in items])
        yield from _list("Verdicts", [rf"\textbf{{{mark}}}: {_escape(words)}" for mark, words in LEGEND])
        if content.table:
            yield from self.table()
        yield rf"\subsection*{{{GLOSSARY}}}"
        yield r"\begin{longtable}{@{}lp{95mm}l@{}}"
        for term in content.glossary:
            yield f"{self.part(term.symbol)} & {self.words(term.meaning)} & {_escape(term.unit)}" + r" \\"
        yield r"\end{longtable}"
        for section, entries in content.sections:
            yield rf"\section*{{{_escape(section)}}}"
            for entry in entries:
                yield from self.entry(entry)
        yield r"\end{document}"

    def table(self) -> Iterator[str]:
        yield rf"\subsection*{{{TABLE}}}"
        yield r"\begin{longtable}{@{}lp{66mm}lll@{}}"
        yield r"& \textbf{title} & \textbf{verdict} & \textbf{corrected} & \textbf{see} \\ \hline \endhead"
        for entry in self.content.table:
            corrected = entry.verdict.statement.corrected_by
            cells = (
                self.link(entry.number, entry.number),
                self.words(entry.title),
                entry.mark,
                self.link(corrected, corrected),
                ", ".join(self.link(reference.number, reference.number) for reference in entry.see),
            )
            yield " & ".join(cells) + r" \\"
        yield r"\end{longtable}"

    def entry(self, entry: Entry) -> Iterator[str]:
        target = rf"\hypertarget{{{_anchor(entry.number)}}}{{}}"
        yield rf"\subsection*{{{target}{self.words(entry.name)}\quad {self.words(entry.title)}}}"
        yield rf"\textbf{{{_escape(entry.mark)}}}{_display(entry.chain)}"
        if entry.judgement:
            yield self.words(entry.judgement) + r"\par"
        if entry.scope:
            yield self.words(entry.scope) + r"\par"
        if entry.premises:
            yield r"\emph{From:} " + "; ".join(map(self.words, entry.premises)) + r".\par"
        for derivation in entry.derivations:
            yield from self.derivation(derivation)
        for line in (*entry.differences, *([entry.correction] if entry.correction else [])):
            yield self.line(line)
        yield from self.figures(entry)
        for label, words in (("Signs", entry.sign_words), ("Note", entry.note)):
            if words:
                yield rf"\emph{{{label}:}} {self.words(words)}\par"
        if entry.see:
            yield r"\emph{See:} " + ", ".join(self.words((reference,)) for reference in entry.see) + r".\par"

    def derivation(self, derivation: Derivation) -> Iterator[str]:
        if derivation.where:
            yield self.words(derivation.where) + r":\par"
        yield from map(self.line, derivation.lines)

    def line(self, line: Line) -> str:
        return self.words(line.words) + (r"\par" if line.display is None else _display(line.display))

    def figures(self, entry: Entry) -> Iterator[str]:
        if not entry.figures:
            return
        yield r"\begin{longtable}{@{}p{62mm}lp{32mm}p{38mm}@{}}"
        yield r"\textbf{number} & \textbf{ours} & \textbf{paper} & \textbf{remark} \\ \hline"
        for figure in entry.figures:
            cells = self.words(figure.label), _escape(figure.ours), _escape(figure.paper), self.words(figure.remark)
            yield " & ".join(cells) + r" \\"
        yield r"\end{longtable}"

    def words(self, words: Words) -> str:
        return "".join(map(self.part, words))

    def part(self, part: object) -> str:
        match part:
            case Quantity(name):
                return f"${typeset(name, LATEX)}$"
            case Formula(sides):
                chain = " = ".join(typeset(side, LATEX) for side in sides)
                return rf"$\displaystyle {chain}$" if r"\frac" in chain else f"${chain}$"
            case Reference(number, words):
                return self.link(number, self.words(words) or _escape(number))
            case Code(text):
                return rf"\texttt{{{_escape(text)}}}"
            case Raised(text):
                return f"$^{{{text}}}$"
        return _escape(str(part))

    def link(self, number: str, text: str) -> str:
        return rf"\hyperlink{{{_anchor(number)}}}{{{text}}}" if number in self.shown else text


def _list(heading: str, items: Collection[str]) -> Iterator[str]:
    if items:
        yield rf"\subsection*{{{heading}}}"
        yield r"\begin{itemize}"
        yield from (rf"\item {item}" for item in items)
        yield r"\end{itemize}"


def _escape(text: str) -> str:
    return text.translate(_ESCAPES)


def _anchor(number: str) -> str:
    return re.sub(r"\W+", "-", number).strip("-")


def _display(formula: Formula) -> str:
    first, *members = (typeset(side, LATEX) for side in formula.sides)
    if not members:
        return rf"\[ \fit{{{first}}} \]"
    rows = r" \\ ".join(rf"&= \fit{{{member}}}" for member in members)
    return rf"\begin{{align*}} {first} {rows} \end{{align*}}"
