"""Puts a situation's numbers into expressions and comparisons of SymPy."""

import math
from collections.abc import Callable
from functools import lru_cache

import sympy
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational
from sympy.logic.boolalg import Boolean

from dzdesign.derivation.account.referee.situations import Situation

#: Equal up to this, of numbers near 1; sensitivities are difference quotients.
_TOLERANCE = 1e-7


class NoNumberError(Exception):
    """A situation has no number for a symbol, or a formula has none at its numbers."""


def agree(left: float, right: float) -> bool:
    """Return whether two numbers are one, to the rounding of doubles through a formula."""
    return math.isclose(left, right, rel_tol=_TOLERANCE, abs_tol=_TOLERANCE)


def evaluate(expression: sympy.Expr, situation: Situation) -> float:
    """Return an expression's number in a situation.

    Raises
    ------
    NoNumberError
        If there is none: the situation says nothing of it.
    """
    compiled, names = _compiled(expression)
    try:
        value = compiled(*(_number(name, situation) for name in names))
    except (ZeroDivisionError, ValueError, OverflowError) as error:
        raise NoNumberError(f"{expression}: {error}") from error
    if value is None or isinstance(value, complex) or not math.isfinite(value):
        raise NoNumberError(f"{expression} has no value")
    return float(value)


def holds(condition: Boolean, situation: Situation) -> bool:
    """Whether a comparison, or several joined by and, or, not, holds in a situation."""
    if condition in (sympy.true, sympy.false):
        return bool(condition)
    if isinstance(condition, sympy.And):
        return all(holds(one, situation) for one in condition.args)
    if isinstance(condition, sympy.Or):
        return any(holds(one, situation) for one in condition.args)
    if isinstance(condition, sympy.Not):
        return not holds(condition.args[0], situation)
    if not isinstance(condition, Relational):
        raise TypeError(f"{condition} is no comparison")
    left, right = evaluate(condition.lhs, situation), evaluate(condition.rhs, situation)
    if isinstance(condition, sympy.Eq | sympy.Ne):
        return agree(left, right) == isinstance(condition, sympy.Eq)
    if agree(left, right):
        return condition.rel_op in ("<=", ">=")
    return (left < right) == (condition.rel_op in ("<", "<="))


def _number(name: sympy.Expr, situation: Situation) -> float:
    if isinstance(name, AppliedUndef):
        if name.func not in situation.functions:
            raise NoNumberError(f"{name} has no number")
        return situation.functions[name.func](evaluate(name.args[0], situation))
    if name not in situation.numbers:
        raise NoNumberError(f"{name} has no number")
    return situation.numbers[name]


@lru_cache(maxsize=16384)
def _compiled(expression: sympy.Expr) -> tuple[Callable[..., float | None], tuple[sympy.Expr, ...]]:
    stand_ins = {function: sympy.Dummy() for function in expression.atoms(AppliedUndef)}
    plain = expression.xreplace(stand_ins)
    functions = {stand_in: function for function, stand_in in stand_ins.items()}
    arguments = sorted(plain.free_symbols, key=str)
    names = tuple(functions.get(name, name) for name in arguments)
    return sympy.lambdify(arguments, plain, modules="math"), names
