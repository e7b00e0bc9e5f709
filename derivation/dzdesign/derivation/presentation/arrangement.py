"""Puts an expression in the order in which the paper writes it, once for all notations.

SymPy's printers order sums and products by their own rules, each its own way, and split the roots of positive symbols.
Here constants come in the order of `symbols.py`, then a root, a sum, commands, and what varies with time; a sum begins
with a term that is not subtracted.
"""

from functools import cache
from typing import Any

import sympy
from sympy.core.function import AppliedUndef
from sympy.functions.elementary.piecewise import ExprCondPair

from dzdesign.derivation.symbols import QUANTITIES, dP, dP0, dP1, s, u_min

_RANK = {name: rank for rank, name in enumerate(QUANTITIES)}
_PRESSURES = {dP, dP0, dP1}
_HALF = sympy.Rational(1, 2)


class Root(sympy.Function):  # type: ignore[misc]
    """A square root that SymPy does not split into the roots of its factors."""


@cache
def arrange(expression: sympy.Basic) -> sympy.Basic:
    """Put the terms and factors of an expression in the paper's order.

    The result is the same function of its symbols, unevaluated, with `Root` for square roots.
    """
    if isinstance(expression, sympy.Add):
        return _sum(expression)
    if isinstance(expression, sympy.Mul | sympy.Pow):
        return _product(with_positive_sign(expression))
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


def _term_key(term: sympy.Expr) -> tuple[Any, ...]:
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


def with_positive_sign(product: sympy.Expr) -> sympy.Expr:
    """Turn -(a - b) c into (b - a) c; which of them SymPy gives may change from run to run."""
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
    below = [base for _, (base, exponent) in arranged if exponent.could_extract_minus_sign()]
    if signals and below and len(below) < len(constants) and not any(map(_varies, below)):
        constants = [sympy.Mul(*constants, evaluate=False)]
    sign = [sympy.S.NegativeOne] if coefficient < 0 else []
    written = [*sign, *constants, *signals] or [sympy.S.One]
    return written[0] if len(written) == 1 else sympy.Mul(*written, evaluate=False)


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
