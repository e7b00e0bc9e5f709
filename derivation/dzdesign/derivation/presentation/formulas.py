"""Writes formulas as plain text, as LaTeX and by it as MathML, and for SymPy."""

import keyword
import re
from functools import cache

import sympy
from sympy.core.alphabets import greeks
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational
from sympy.printing.latex import LatexPrinter
from sympy.printing.printer import Printer
from sympy.printing.str import StrPrinter

from dzdesign.derivation import symbols
from dzdesign.derivation.symbols import QUANTITIES, Name

_LOW_PARENTHESES = re.compile(r"\\left\(((?:(?!\\left|\\frac|\\sqrt|\\right).)*?) ?\\right\)")


_HALF = sympy.Rational(1, 2)
_RANK = {name: rank for rank, name in enumerate(QUANTITIES)}


class Root(sympy.Function):  # type: ignore[misc]
    """A square root that SymPy does not split into the roots of its factors."""


def _with_roots(formula: sympy.Basic) -> sympy.Basic:
    """Put the square roots of a product under one root, and -(a - b) c as (b - a) c."""
    if not formula.args or isinstance(formula, AppliedUndef):
        return formula
    if not formula.is_Mul and not (formula.is_Pow and abs(formula.exp) == _HALF):
        return formula.func(*map(_with_roots, formula.args))
    factors = sympy.Mul.make_args(formula)
    sums = [factor for factor in factors if factor.is_Add]
    if len(sums) == 1 and formula.could_extract_minus_sign():
        turned = formula.xreplace({sums[0]: -sums[0]})
        # Which of them SymPy gives may change from run to run.
        if not turned.could_extract_minus_sign():
            return -_with_roots(turned)
    halves = [factor for factor in factors if abs(factor.as_base_exp()[1]) == _HALF]
    others = [_with_roots(factor) for factor in factors if factor not in halves]
    roots = [Root(sympy.Mul(*(factor**2 for factor in halves)))] if halves else []
    return sympy.Mul(*sorted((*others, *roots), key=_place), evaluate=False)


def _place(factor: sympy.Expr) -> tuple[bool, bool, int]:
    """A number first, then symbols in their order, sums and functions last."""
    base = factor.as_base_exp()[0]
    return not factor.is_number, bool(base.args), _RANK.get(base, 0)


class _Order(Printer):  # type: ignore[misc]
    """Begins a sum with what is not subtracted, and ends it with a number; writes a <= u and u < b as a <= u < b."""

    def _as_ordered_terms(self, expr: sympy.Add, order: str | None = None) -> list[sympy.Expr]:
        return sorted(expr.args, key=lambda term: (term.could_extract_minus_sign(), term.is_number))

    def _print_And(self, expr: sympy.And) -> str:
        parts = [part if part.lhs == part.lts else part.reversed for part in expr.args]
        lower, upper = sorted(parts, key=lambda part: any(part.lts == other.gts for other in parts))
        return f"{self._print(lower)}{str(self._print(upper)).removeprefix(self._print(upper.lts))}"


class _Ascii(StrPrinter):  # type: ignore[misc]
    def _print_Relational(self, relation: Relational) -> str:
        sign = {"==": "="}.get(relation.rel_op, relation.rel_op)
        return f"{self._print(relation.lhs)} {sign} {self._print(relation.rhs)}"


class _Text(_Order, _Ascii):
    """ASCII that a person can read and a computer algebra system too, but for cases, one on a line."""

    def _print_Pow(self, expr: sympy.Pow, rational: bool = False) -> str:
        return str(super()._print_Pow(expr, rational)).replace("**", "^")

    def _print_Root(self, root: Root) -> str:
        return f"sqrt({self._print(root.args[0])})"

    def _print_Piecewise(self, expr: sympy.Piecewise) -> str:
        rows = [(self._print(value), when) for value, when in expr.args]
        width = max(len(value) for value, _ in rows)
        return "\n".join(f"{{ {value:<{width}}  {self._condition(when)}" for value, when in rows)

    def _condition(self, when: sympy.Basic) -> str:
        return "otherwise" if when == sympy.true else f"if {self._print(when)}"


class _Latex(_Order, LatexPrinter):  # type: ignore[misc]
    """LaTeX for math mode, with amsmath."""

    def _print_Root(self, root: Root) -> str:
        return rf"\sqrt{{{self._print(root.args[0])}}}"

    def _print_Piecewise(self, expr: sympy.Piecewise) -> str:
        return str(super()._print_Piecewise(expr)).replace(r"\text{for}\:", r"\text{if }")

    def _deal_with_super_sub(self, string: str, style: str = "plain") -> str:
        bare = string.rstrip("'")
        base, _, index = bare.partition("_")
        parts = "".join(_latex_word(part) for part in re.findall(r"[^\W\d]+|\d+", index))
        return _latex_word(base) + (f"_{{{parts}}}" if parts else "") + string[len(bare) :]


class _Python(_Ascii):
    """What SymPy reads back, by the names in `symbols.py`."""

    def _print_Symbol(self, symbol: sympy.Symbol) -> str:
        return _python_names().get(symbol, str(symbol.name))

    def _print_AppliedUndef(self, function: AppliedUndef) -> str:
        name = _python_names().get(function.func, function.func.__name__)
        return f"{name}({self.stringify(function.args, ', ')})"


@cache
def _python_names() -> dict[sympy.Basic, str]:
    """Return the names of what Python can't read by its own name, and of transforms: Q(s) is not Q."""
    known = {value: name for name, value in vars(symbols).items() if isinstance(value, Name)}
    functions = {value.func: name for value, name in known.items() if isinstance(value, AppliedUndef)}
    plain = {value: name for value, name in known.items() if isinstance(value, sympy.Symbol)}
    return functions | {
        value: name for value, name in plain.items() if not value.name.isidentifier() or keyword.iskeyword(value.name)
    }


def _latex_word(word: str) -> str:
    if word in greeks:
        return "\\" + word
    return word if len(word) == 1 or word.isdigit() else rf"\text{{{word}}}"


@cache
def to_text(formula: sympy.Basic) -> str:
    """Return an expression as ASCII text.

    Examples
    --------
    >>> from dzdesign.derivation import symbols as s
    >>> to_text((s.k * s.x_max / s.u_max - 1) * s.u_i + s.u_min0)
    'u_min0 + u_i*(k*x_max/u_max - 1)'
    """
    return str(_Text({"order": "none", "full_prec": False}).doprint(_with_roots(formula)))


@cache
def to_latex(formula: sympy.Basic) -> str:
    r"""Return an expression as LaTeX for math mode.

    Examples
    --------
    >>> from dzdesign.derivation import symbols as s
    >>> to_latex(s.beta * s.u_min0)
    '\\beta \\, u_{\\text{min}0}'
    """
    names = {name: known.latex for name, known in QUANTITIES.items() if known.latex}
    settings = {"order": "none", "ln_notation": True, "mul_symbol": r" \, ", "symbol_names": names}
    latex, low = "", _Latex(settings).doprint(_with_roots(formula))
    while latex != low:  # parentheses grow around what is tall only
        latex, low = low, _LOW_PARENTHESES.sub(r"(\1)", low)
    return latex


@cache
def to_python(formula: sympy.Basic) -> str:
    """Return an expression as SymPy reads it back."""
    return str(_Python().doprint(formula))


@cache
def to_mathml(latex: str) -> str:
    """Return LaTeX of math mode as the inside of an element ``math``, for a browser."""
    from latex2mathml.converter import convert

    return convert(latex).partition(">")[2].removesuffix("</math>")
