"""The report as a LaTeX document that compiles by itself."""

from typing import ClassVar

from dzdesign.derivation.presentation.formulas import to_latex
from dzdesign.derivation.presentation.prose import Formula
from dzdesign.derivation.presentation.writer import Writer, anchor

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


class LatexWriter(Writer):
    """LaTeX; a formula too wide for the page is made smaller."""

    TEMPLATE = "derivation.tex.jinja"
    SYNTAX: ClassVar = {
        "block_start_string": "<%",
        "block_end_string": "%>",
        "variable_start_string": "<<",
        "variable_end_string": ">>",
    }

    def text(self, text: str) -> str:
        return text.translate(_ESCAPES)

    def formula(self, formula: Formula) -> str:
        chain = " = ".join(map(to_latex, formula.sides))
        return rf"$\displaystyle {chain}$" if r"\frac" in chain else f"${chain}$"

    def display(self, formula: Formula) -> str:
        first, *members = map(to_latex, formula.sides)
        if not members:
            return rf"\[ \fit{{{first}}} \]"
        rows = r" \\ ".join(rf"&= \fit{{{member}}}" for member in members)
        return rf"\begin{{align*}} {first} {rows} \end{{align*}}"

    def code(self, text: str) -> str:
        return rf"\texttt{{{self.text(text)}}}"

    def link(self, number: str, text: str) -> str:
        return rf"\hyperlink{{{anchor(number)}}}{{{text}}}"
