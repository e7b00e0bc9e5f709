"""From an expression to a function for numbers of any kind; design, codegen and verify compute by these."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from typing import Any

import sympy

_ONE = sympy.S.One


def lower(
    expression: sympy.Expr | Sequence[sympy.Expr],
    arguments: Sequence[sympy.Symbol],
    functions: Mapping[str, Callable[[Any], Any]] | None = None,
) -> Callable[..., Any]:
    """Return the function that computes an expression by bare arithmetic; its arguments decide in what numbers.

    It is made once: whoever lowers the same again gets the same.

    Parameters
    ----------
    expression : sympy.Expr, or a sequence of them
        Sums, products and whole powers of `arguments` and rational numbers, and `functions` of such, integers inside.
    arguments : sequence of sympy.Symbol
        What the function takes, in this order.
    functions : mapping, optional
        Name -> implementation, for the kind of number that will come: ``{"sqrt": casadi.sqrt}``.

    Returns
    -------
    callable
        Gives a number, or a tuple for a sequence. Fractions stay exact, and so do ints, which are taken as fractions
        where all arguments are ints or fractions; arrays and CasADi expressions stay what they are.

    Raises
    ------
    ValueError
        If `expression` holds a number that is not rational, a symbol that is not an argument, or a root, power or
        function without an implementation.

    Examples
    --------
    >>> a, b = sympy.symbols("a b")
    >>> lower(a / b, (a, b))(1, 3)
    Fraction(1, 3)
    """
    one = isinstance(expression, sympy.Expr)
    return _lowered(
        (expression,) if one else tuple(expression), tuple(arguments), tuple((functions or {}).items()), one
    )


@cache
def _lowered(
    expressions: tuple[sympy.Expr, ...],
    arguments: tuple[sympy.Symbol, ...],
    implemented: tuple[tuple[str, Callable[[Any], Any]], ...],
    one: bool,
) -> Callable[..., Any]:
    functions = dict(implemented)
    # Above and below a fraction bar: a coefficient 1/2 as it stands would be printed as a division of ints to a float.
    sides = [side for each in expressions for side in (_as_fraction(each) if _has_fraction(each) else (each, _ONE))]
    for each, side in zip((one for one in expressions for _ in range(2)), sides, strict=True):
        for complaint in _complaints(side, set(arguments), functions):
            raise ValueError(f"{each} can't be lowered: {complaint}")
    # No numeric module: whatever is not in `functions` would be a NameError, never silently a float.
    compute = sympy.lambdify(arguments, sides, modules=[functions])

    def lowered(*values: Any) -> Any:
        # Python divides two ints to a float.
        if all(isinstance(value, int | Fraction) for value in values):
            values = tuple(map(Fraction, values))
        found = compute(*values)
        results = tuple(
            above if side == 1 else (Fraction(above) if isinstance(above, int) else above) / below
            for above, below, side in zip(found[::2], found[1::2], sides[1::2], strict=True)
        )
        return results[0] if one else results

    return lowered


def _has_fraction(expression: sympy.Expr) -> bool:
    if isinstance(expression, sympy.Rational):
        return not expression.is_Integer
    return any(map(_has_fraction, expression.args[:1] if isinstance(expression, sympy.Pow) else expression.args))


def _as_fraction(expression: sympy.Expr) -> tuple[sympy.Expr, sympy.Expr]:
    above, below = sympy.fraction(sympy.together(expression))
    return above, below


def _complaints(node: sympy.Basic, arguments: set[sympy.Symbol], functions: Mapping[str, Any]) -> Iterator[str]:
    """Yield what keeps an expression from being lowered exactly."""
    parts = node.args
    if isinstance(node, sympy.Symbol):
        if node not in arguments:
            yield f"{node} is not among the arguments"
    elif isinstance(node, sympy.Pow) and not node.exp.is_Integer:
        parts = (node.base,)
        # Printed as sqrt(x) and 1/sqrt(x); any other power would be one of floats.
        if abs(node.exp) != sympy.Rational(1, 2):
            yield f"{node} is not a whole power"
        elif "sqrt" not in functions:
            yield f"{node} needs an implementation of sqrt"
    elif isinstance(node, sympy.Function):
        if node.func.__name__ not in functions:
            yield f"{node} needs an implementation of {node.func.__name__}"
    elif node.is_Number or node.is_NumberSymbol:
        # A fraction would be printed as a division of ints, which is one of floats.
        if not node.is_Integer:
            yield f"expected integer coefficients, got {node}"
    elif not isinstance(node, sympy.Add | sympy.Mul | sympy.Pow):
        yield f"{node} is no sum, product or power"
    for part in parts:
        yield from _complaints(part, arguments, functions)
