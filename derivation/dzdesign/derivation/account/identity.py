"""Whether two expressions are the same function of their symbols."""

import hashlib

import sympy
from sympy.core.function import AppliedUndef

#: Values at a point are computed to this many digits from symbols near 1, so a difference above the second number is
#: no rounding error.
_DIGITS, _CLEARLY_DIFFERENT = 50, 1e-25


def agree(left: sympy.Expr, right: sympy.Expr) -> bool:
    """Decide whether two expressions are identical.

    Exact for rational functions of symbols, of roots of single symbols, and of logarithms and applied functions,
    which count as symbols of their own; logarithms of products are expanded first.

    Examples
    --------
    >>> from dzdesign.derivation.symbols import dP, rho
    >>> agree(sympy.sqrt(2 * dP / rho), sympy.sqrt(2) * sympy.sqrt(dP) / sympy.sqrt(rho))
    True
    """
    if left == right:
        return True
    if left.has(sympy.Piecewise, sympy.nan) or right.has(sympy.Piecewise, sympy.nan):
        return False
    if _differ_at_a_point(left, right):
        return False
    difference = left - right
    if difference.has(sympy.log):
        difference = sympy.expand_log(difference)
    # A root and its symbol are two generators to `cancel`; writing each symbol as a square makes them one.
    squares = {symbol: sympy.Dummy(symbol.name, positive=True) ** 2 for symbol in _under_root(difference)}
    return bool(sympy.cancel(difference.xreplace(squares)) == 0)


def _differ_at_a_point(left: sympy.Expr, right: sympy.Expr) -> bool:
    """Whether one numeric point already tells them apart: most wrong statements need no algebra."""
    names = left.free_symbols | right.free_symbols | left.atoms(AppliedUndef) | right.atoms(AppliedUndef)
    point = {name: _place(name) for name in names}
    values = [side.xreplace(point) for side in (left, right)]
    if not all(value.is_number and value.is_finite for value in values):
        return False
    return bool(abs(values[0] - values[1]) > _CLEARLY_DIFFERENT)


def _place(name: sympy.Expr) -> sympy.Float:
    digest = hashlib.sha256(sympy.sstr(name).encode()).digest()
    return sympy.Float(sympy.Rational(1, 2) + sympy.Rational(int.from_bytes(digest[:6]), 2**48), _DIGITS)


def _under_root(expression: sympy.Expr) -> set[sympy.Symbol]:
    roots = (power for power in expression.atoms(sympy.Pow) if not power.exp.is_Integer and power.exp.is_Rational)
    return {root.base for root in roots if root.base.is_Symbol and root.base.is_nonnegative}
