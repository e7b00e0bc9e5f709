"""Writes formulas as plain text, LaTeX and MathML, in the order in which the paper writes them.

SymPy's printers order sums and products by their own rules, each its own way, and split the roots of positive symbols.
Here an expression is first arranged, once for all notations: constants in the order of `symbols.py`, then a root, a
sum, and what varies with time; a sum begins with a term that is not subtracted. The printers then keep that order.
"""

import re
from functools import cache

import sympy
from sympy.core.alphabets import greeks
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational
from sympy.functions.elementary.piecewise import ExprCondPair
from sympy.printing.latex import LatexPrinter
from sympy.printing.str import StrPrinter

from dzdesign.derivation.symbols import QUANTITIES, dP, dP0, dP1, s, u_min

_RANK = {name: rank for rank, name in enumerate(QUANTITIES)}
_PRESSURES = {dP, dP0, dP1}
_HALF = sympy.Rational(1, 2)
_LOW_PARENTHESES = re.compile(r"\\left\(((?:(?!\\left|\\frac|\\sqrt|\\right).)*?) ?\\right\)")


class Root(sympy.Function):
    """A square root that SymPy does not split into the roots of its factors."""


# --- order ----------------------------------------------------------------------------------------------------


@cache
def arrange(expression: sympy.Basic) -> sympy.Basic:
    """Put the terms and factors of an expression in the paper's order.

    Parameters
    ----------
    expression : sympy.Basic

    Returns
    -------
    sympy.Basic
        The same function of its symbols, unevaluated, with `Root` for square roots.
    """
    if isinstance(expression, sympy.Add):
        return _sum(expression)
    if isinstance(expression, sympy.Mul | sympy.Pow):
        return _product(_with_positive_sign(expression))
    if isinstance(expression, sympy.GreaterThan | sympy.LessThan | sympy.StrictGreaterThan | sympy.StrictLessThan):
        # What a condition is about stands on its left.
        expression = expression if _rank(expression.lhs) >= _rank(expression.rhs) else expression.reversed
    if isinstance(expression, AppliedUndef) or not expression.args:
        return expression
    parts = [arrange(part) for part in expression.args]
    return expression.func(*parts) if isinstance(expression, ExprCondPair) else expression.func(*parts, evaluate=False)


def _rank(name: sympy.Basic) -> int:
    return _RANK.get(name, -1)


def _varies(base: sympy.Basic) -> bool:
    return isinstance(base, AppliedUndef) or (base in QUANTITIES and QUANTITIES[base].varies)


def _sum(expression: sympy.Add) -> sympy.Add:
    terms = sorted((_product(term) for term in expression.args), key=_term_key)
    # Numbers stand last, unless no other term can begin the sum.
    if any(not term.is_number and not term.could_extract_minus_sign() for term in terms):
        terms.sort(key=lambda term: term.is_number)
    return sympy.Add(*terms, evaluate=False)


def _term_key(term: sympy.Expr) -> tuple:
    powers = [factor.as_base_exp() for factor in sympy.Mul.make_args(term)]
    varying = [_rank(name) for name in term.atoms(sympy.Symbol, AppliedUndef) if _varies(name)]
    return (
        term.could_extract_minus_sign(),
        term.is_number,
        -next((int(exponent) for base, exponent in powers if base == s), 0),
        min(varying, default=len(_RANK)),
        len(powers),
        sorted(map(_factor_key, powers)),
    )


def _with_positive_sign(product: sympy.Expr) -> sympy.Expr:
    """Turn -(a - b) c into (b - a) c."""
    sums = [factor for factor in sympy.Mul.make_args(product) if isinstance(factor, sympy.Add)]
    if product.could_extract_minus_sign() and sums:
        return -product.xreplace({sums[0]: -sums[0]})
    return product


def _product(product: sympy.Expr) -> sympy.Expr:
    if not isinstance(product, sympy.Mul | sympy.Pow):
        return arrange(product)
    coefficient, factors = product.as_coeff_mul()
    roots = [factor for factor in factors if abs(factor.as_base_exp()[1]) == _HALF]
    coefficient, powers = _under_one_root(coefficient, roots)
    powers += [factor.as_base_exp() for factor in factors if factor not in roots]
    arranged = [(_power(*power), power) for power in sorted(powers, key=_factor_key)]
    # What varies stands behind a fraction of constants: (k x_max/u_max) u_i.
    signals = [factor for factor, (base, exponent) in arranged if _varies(base) and exponent.is_positive]
    constants = [factor for factor, _ in arranged if factor not in signals]
    if abs(coefficient) != 1:
        constants.insert(0, abs(coefficient))
    is_fraction = [factor.as_base_exp()[1].could_extract_minus_sign() for factor in constants]
    if signals and any(is_fraction) and not all(is_fraction) and not any(map(_varies_below, arranged)):
        constants = [sympy.Mul(*constants, evaluate=False)]
    sign = [sympy.S.NegativeOne] if coefficient < 0 else []
    written = [*sign, *constants, *signals] or [sympy.S.One]
    return written[0] if len(written) == 1 else sympy.Mul(*written, evaluate=False)


def _varies_below(arranged: tuple[sympy.Expr, tuple[sympy.Expr, sympy.Expr]]) -> bool:
    base, exponent = arranged[1]
    return _varies(base) and not exponent.is_positive


def _power(base: sympy.Expr, exponent: sympy.Expr) -> sympy.Expr:
    base = base if isinstance(base, Root) else arrange(base)
    return base if exponent == 1 else sympy.Pow(base, arrange(exponent), evaluate=False)


def _factor_key(power: tuple[sympy.Expr, sympy.Expr]) -> tuple[int, int, int, str]:
    """Numbers, constants, a root, sums, commands, and last what varies."""
    base, _ = power
    if isinstance(base, AppliedUndef) or not base.args:
        kind = 0 if base.is_number else 5 if _varies(base) else 4 if _rank(base) >= _RANK[u_min] else 1
    else:
        kind = 2 if isinstance(base, Root) else 3
    return kind, _rank(base), base.count_ops(), str(base)


def _under_one_root(
    coefficient: sympy.Rational, roots: list[sympy.Expr]
) -> tuple[sympy.Rational, list[tuple[sympy.Expr, sympy.Expr]]]:
    """Put all roots under one, sqrt(2 dP/rho), which stands above or below as its pressure drop is to stand above."""
    if not roots:
        return coefficient, []
    inside = sympy.Mul(*(root**2 for root in roots))
    above, below = inside.as_numer_denom()
    if not below.free_symbols & _PRESSURES or above.free_symbols & _PRESSURES:
        return coefficient, [(Root(arrange(inside)), sympy.S.One)]
    number = inside.as_coeff_Mul()[0]  # sqrt(2)/2 is 1/sqrt(2)
    return coefficient * number, [(Root(arrange(number**2 / inside)), sympy.S.NegativeOne)]


# --- notations ------------------------------------------------------------------------------------------------


class _Text(StrPrinter):
    """ASCII that a person can read and a computer algebra system too, but for cases, one on a line."""

    def _print_Pow(self, expr: sympy.Pow, rational: bool = False) -> str:
        return super()._print_Pow(expr, rational).replace("**", "^")

    def _print_Root(self, root: Root) -> str:
        return f"sqrt({self._print(root.args[0])})"

    def _print_Relational(self, relation: Relational) -> str:
        sign = {"==": "="}.get(relation.rel_op, relation.rel_op)
        return f"{self._print(relation.lhs)} {sign} {self._print(relation.rhs)}"

    def _print_And(self, expr: sympy.And) -> str:
        return _chain([(self._print(side.lts), self._print(side)) for side in _ascending(expr)])

    def _print_Piecewise(self, expr: sympy.Piecewise) -> str:
        rows = [(self._print(value), when) for value, when in expr.args]
        width = max(len(value) for value, _ in rows)
        return "\n".join(f"{{ {value:<{width}}  {self._condition(when)}" for value, when in rows)

    def _condition(self, when: sympy.Basic) -> str:
        return "otherwise" if when == sympy.true else f"if {self._print(when)}"


class _Latex(LatexPrinter):
    """LaTeX for math mode, with amsmath."""

    def _print_Root(self, root: Root) -> str:
        return rf"\sqrt{{{self._print(root.args[0])}}}"

    def _print_And(self, expr: sympy.And) -> str:
        return _chain([(self._print(side.lts), self._print(side)) for side in _ascending(expr)])

    def _print_Piecewise(self, expr: sympy.Piecewise) -> str:
        return super()._print_Piecewise(expr).replace(r"\text{for}\:", r"\text{if }")

    def _deal_with_super_sub(self, string: str, style: str = "plain") -> str:
        bare = string.rstrip("'")
        base, _, index = bare.partition("_")
        parts = "".join(_latex_word(part) for part in re.findall(r"[^\W\d]+|\d+", index))
        return _latex_word(base) + (f"_{{{parts}}}" if parts else "") + string[len(bare) :]


def _latex_word(word: str) -> str:
    if word in greeks:
        return "\\" + word
    return word if len(word) == 1 or word.isdigit() else rf"\text{{{word}}}"


def _ascending(condition: sympy.And) -> list[Relational]:
    """Return a <= u and u < b in that order, each with the smaller side on its left."""
    ordered = [part if part.lhs == part.lts else part.reversed for part in condition.args]
    return sorted(ordered, key=lambda part: any(part.lts == other.gts for other in ordered))


def _chain(relations: list[tuple[str, str]]) -> str:
    """Write a <= u and u < b as a <= u < b; each relation comes with its left side."""
    first, *others = relations
    return first[1] + "".join(relation.removeprefix(left) for left, relation in others)


@cache
def to_text(formula: sympy.Basic) -> str:
    """Return an expression as ASCII text.

    Parameters
    ----------
    formula : sympy.Basic

    Returns
    -------
    str

    Examples
    --------
    >>> from dzdesign.derivation import symbols as s
    >>> to_text((s.k * s.x_max / s.u_max - 1) * s.u_i + s.u_min0)
    '(k*x_max/u_max - 1)*u_i + u_min0'
    """
    return _Text({"order": "none", "full_prec": False}).doprint(arrange(formula))


@cache
def to_latex(formula: sympy.Basic) -> str:
    r"""Return an expression as LaTeX for math mode.

    Parameters
    ----------
    formula : sympy.Basic

    Returns
    -------
    str

    Examples
    --------
    >>> from dzdesign.derivation import symbols as s
    >>> to_latex(s.beta * s.u_min0)
    '\\beta \\, u_{\\text{min}0}'
    """
    names = {name: known.latex for name, known in QUANTITIES.items() if known.latex}
    settings = {"order": "none", "ln_notation": True, "mul_symbol": r" \, ", "symbol_names": names}
    latex, low = "", _Latex(settings).doprint(arrange(formula))
    while latex != low:  # parentheses grow around what is tall only
        latex, low = low, _LOW_PARENTHESES.sub(r"(\1)", low)
    return latex


@cache
def to_mathml(latex: str) -> str:
    """Return LaTeX of math mode as the inside of an element ``math``, for a browser.

    Parameters
    ----------
    latex : str

    Returns
    -------
    str
    """
    from latex2mathml.converter import convert

    return convert(latex).partition(">")[2].removesuffix("</math>")
