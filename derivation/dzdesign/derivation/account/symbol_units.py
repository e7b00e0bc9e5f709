"""Whether a statement adds and equates only what has one unit.

A check that knows nothing of the derivations: each side is evaluated with pint quantities.
"""

import math
from functools import cache
from typing import Any

import pint
import sympy
from sympy.core.function import AppliedUndef

from dzdesign.derivation import symbols
from dzdesign.derivation.account.statement import Statement
from dzdesign.derivation.symbols import QUANTITIES, Name


def print_unit(name: Name) -> str:
    """Return the unit of a symbol, or of one of its functions of another argument, as a person writes it.

    Examples
    --------
    >>> print_unit(symbols.Q), print_unit(symbols.beta)
    ('m^3/s', '1')
    """
    unit = _plain(_registry().Unit(QUANTITIES[_as_declared(name)].unit)).replace("code", "counts").replace("Ω", "ohm")
    return "1" if unit == "a number" else unit


def find_unit_error(statement: Statement) -> str:
    """Say what is wrong with the units of a statement; nothing if all sides have one and no sum mixes them."""
    left = _quantity_of(statement.symbol)
    if left is None:
        return f"the unit of {statement.symbol} is not known"
    for member in statement.members:
        try:
            branches = _branches(member)
        except pint.DimensionalityError as error:
            return f"a comparison of {_plain(error.units1)} with {_plain(error.units2)}"
        for branch in branches:
            wrong = _error(left, branch)
            if wrong:
                return wrong
    return ""


def _branches(member: sympy.Expr) -> list[sympy.Expr]:
    if not isinstance(member, sympy.Piecewise):
        return [member]
    # A comparison needs one unit just as a sum does.
    compared = [relation.lhs - relation.rhs for relation in member.atoms(sympy.core.relational.Relational)]
    for margin in compared:
        if not margin.is_number:
            _evaluate(margin)
    return [value for value, _ in member.args]


def _error(left: Any, side: sympy.Expr) -> str:
    if side.is_number:
        # Zero is of every unit.
        return "" if side == 0 or left.dimensionless else f"a bare number where {_plain(left.units)} is meant"
    try:
        right = _evaluate(side)
    except pint.DimensionalityError as error:
        return f"a sum of {_plain(error.units1)} and {_plain(error.units2)}"
    except KeyError as error:
        return f"the unit of {error.args[0]} is not known"
    if not left.is_compatible_with(right):
        return f"{_plain(left.units)} on the left, {_plain(getattr(right, 'units', 'a number'))} on the right"
    return ""


def _plain(units: Any) -> str:
    if isinstance(units, str):
        return units
    text = f"{_registry().Unit(units):~C}".replace("**", "^")
    return {"": "a number", "code": "counts"}.get(text, text)


def _evaluate(expression: sympy.Expr) -> Any:
    stand_ins = {function: sympy.Dummy() for function in expression.atoms(AppliedUndef)}
    plain = expression.xreplace(stand_ins)
    names = {stand_in: function for function, stand_in in stand_ins.items()}
    arguments = sorted(plain.free_symbols, key=str)
    quantities = []
    for position, name in enumerate(arguments):
        quantity = _quantity_of(names.get(name, name), position)
        if quantity is None:
            raise KeyError(str(name))
        quantities.append(quantity)
    functions = {"sqrt": lambda value: value**0.5, "log": lambda value: math.log(value.to("").magnitude)}
    return sympy.lambdify(arguments, plain, modules=[functions])(*quantities)


def _quantity_of(name: Name, position: int = 0) -> Any:
    known = QUANTITIES.get(_as_declared(name))
    # Values without a pattern, so that no sum is zero by chance.
    return None if known is None else _registry().Quantity(1 + math.sqrt(2 + position), known.unit)


def _as_declared(name: Name) -> Name:
    """Return a function at its declared argument: X_e(s + a) has the unit of X_e(s), and f(dP1) that of f(dP)."""
    if not isinstance(name, AppliedUndef):
        return name
    return name.func(symbols.dP if name.func == symbols.f else symbols.s)


@cache
def _registry() -> pint.UnitRegistry:
    registry = pint.UnitRegistry()
    registry.define("code = [code] = code")
    return registry
