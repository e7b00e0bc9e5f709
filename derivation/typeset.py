"""Prints expressions as the paper prints them: as plain text, as LaTeX and as MathML."""

from collections.abc import Iterator
from typing import Any

import sympy
from sympy.printing.mathml import MathMLPresentationPrinter

from dzdesign.derivation.symbols import LATEX_NAMES, dP, dP0, dP1, rho

_HTML_NAMES = {dP: sympy.Symbol("ΔP"), dP0: sympy.Symbol("ΔP_0"), dP1: sympy.Symbol("ΔP_1")}


class _OrificeRoot(sympy.Function):
    """sqrt(2 dP / rho) as the paper prints it; SymPy splits the root of a product of positive symbols."""

    def _print_as_root(self, printer: Any, **_: Any) -> Any:
        pressure_drop, density = self.args
        ratio = sympy.Mul(2, pressure_drop, sympy.Pow(density, -1), evaluate=False)
        return printer._print(sympy.Pow(ratio, sympy.S.Half, evaluate=False))

    _sympystr = _latex = _mathml_presentation = _print_as_root


def _as_published(expression: sympy.Expr) -> sympy.Expr:
    return expression.replace(
        lambda part: part.is_Pow and part.base in (dP, dP0, dP1) and abs(part.exp) == sympy.S.Half,
        lambda part: (_OrificeRoot(part.base, rho) * sympy.sqrt(rho / 2)) ** (2 * part.exp),
    )


def text_rows(expression: sympy.Expr) -> Iterator[str]:
    """Yield the lines of an expression as plain text: one, or one per case.

    Parameters
    ----------
    expression : sympy.Expr

    Yields
    ------
    str
    """
    member = _as_published(expression)
    if not isinstance(member, sympy.Piecewise):
        yield sympy.sstr(member)
        return
    values = [sympy.sstr(value) for value, _ in member.args]
    width = max(map(len, values))
    for value, (_, condition) in zip(values, member.args, strict=True):
        parts = sorted(map(sympy.sstr, condition.args if isinstance(condition, sympy.And) else (condition,)))
        when = "otherwise" if condition == sympy.true else "if " + " and ".join(parts)
        yield f"{{ {value:<{width}}  {when}"


def latex(expression: sympy.Expr) -> str:
    """Return an expression as LaTeX, without delimiters.

    Parameters
    ----------
    expression : sympy.Expr

    Returns
    -------
    str
    """
    return sympy.latex(_as_published(expression), symbol_names=LATEX_NAMES)


class _MathMLPrinter(MathMLPresentationPrinter):
    """SymPy's printer, with cases as a table behind a brace and with strict inequalities escaped."""

    def mathml_tag(self, expression: Any) -> str:
        tag = super().mathml_tag(expression)
        return {"<": "&lt;", ">": "&gt;"}.get(tag, tag)

    def _print_Piecewise(self, expression: sympy.Piecewise) -> Any:
        table = self.dom.createElement("mtable")
        for value, condition in expression.args:
            when = self.dom.createElement("mtext")
            when.appendChild(self.dom.createTextNode("otherwise" if condition == sympy.true else "if\u00a0"))
            cells = [[self._print(value)], [when]]
            if condition != sympy.true:
                cells[1].append(self._print(condition))
            row = self.dom.createElement("mtr")
            for content in cells:
                cell = self.dom.createElement("mtd")
                for node in content:
                    cell.appendChild(node)
                row.appendChild(cell)
            table.appendChild(row)
        brace = self.dom.createElement("mo")
        brace.appendChild(self.dom.createTextNode("{"))
        group = self.dom.createElement("mrow")
        group.appendChild(brace)
        group.appendChild(table)
        return group


def mathml(expression: sympy.Expr) -> str:
    """Return an expression as presentation MathML, without the enclosing ``math`` element.

    Parameters
    ----------
    expression : sympy.Expr

    Returns
    -------
    str
    """
    return _MathMLPrinter().doprint(_as_published(expression).xreplace(_HTML_NAMES))
