"""Whether a statement is one equation in every system of units: a check that knows nothing of the derivations."""

import math
from functools import cache

import pint
import sympy
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational

from dzdesign.derivation import symbols
from dzdesign.derivation.account.statement import Statement
from dzdesign.derivation.symbols import QUANTITIES, Name

#: In a system of units of its own, each base unit is another number of ours.
_BASES = {"[length]": 2.0, "[mass]": 3.0, "[time]": 5.0, "[current]": 7.0, "[code]": 11.0}


def print_unit(name: Name) -> str:
    """Return the unit of a symbol, or of one of its functions of another argument, as a person writes it.

    Examples
    --------
    >>> print_unit(symbols.Q), print_unit(symbols.beta)
    ('m^3/s', '1')
    """
    unit = f"{_registry().Unit(QUANTITIES[_as_declared(name)].unit):~C}".replace("**", "^")
    return unit.replace("code", "counts").replace("Ω", "ohm") or "1"


def find_unit_error(statement: Statement) -> str:
    """Say what is wrong with the units of a statement: nothing if each side scales as its symbol does."""
    try:
        wanted = _factor(statement.symbol)
        for member in statement.members:
            for relation in member.atoms(Relational):
                margin = relation.lhs - relation.rhs
                sides = [side for side in relation.args if not side.is_number]
                if any(not math.isclose(_scaling(side), _scaling(margin)) for side in sides):
                    return f"{sympy.sstr(relation)} compares two units"
            for branch in [value for value, _ in member.args] if isinstance(member, sympy.Piecewise) else [member]:
                if branch != 0 and not math.isclose(_scaling(branch), wanted):  # zero is of every unit
                    return f"the right-hand side is not in {print_unit(statement.symbol)}"
    except KeyError as error:
        return f"the unit of {error.args[0]} is not known"
    return ""


def _scaling(expression: sympy.Expr) -> float:
    """Return an expression in the other system of units over itself, at values without a pattern."""
    names = sorted(expression.free_symbols | expression.atoms(AppliedUndef), key=str)
    stand_ins = {name: sympy.Dummy() for name in names if isinstance(name, AppliedUndef)}
    names = [name for name in names if name in stand_ins or expression.xreplace(stand_ins).has(name)]
    compute = sympy.lambdify([stand_ins.get(name, name) for name in names], expression.xreplace(stand_ins), "math")
    values = [1 + math.sqrt(2 + position) for position in range(len(names))]
    scaled = [value * _factor(name) for name, value in zip(names, values, strict=True)]
    return float(compute(*scaled) / compute(*values))


@cache
def _factor(name: Name) -> float:
    """Return how many of the other system's units one of ours is."""
    if _as_declared(name) not in QUANTITIES:
        raise KeyError(str(name))
    dimensions = _registry().Unit(QUANTITIES[_as_declared(name)].unit).dimensionality
    return float(math.prod(_BASES[base] ** power for base, power in dimensions.items()))


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
