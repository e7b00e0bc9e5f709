"""Whether a statement is one equation in every system of units: a check that knows nothing of the derivations."""

from functools import cache
from typing import Any

import numpy as np
import pint
import sympy
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational

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
    unit = f"{_unit(name):~C}".replace("**", "^")
    return unit.replace("code", "counts").replace("Ω", "ohm") or "1"


def find_unit_error(statement: Statement) -> str:
    """Say what is wrong with the units of a statement: nothing if pint computes each side in its symbol's unit."""
    try:
        wanted = _unit(statement.symbol)
        for member in statement.members:
            for relation in member.atoms(Relational):
                if not _is_in_one_unit(relation.lhs - relation.rhs):
                    return f"{sympy.sstr(relation)} compares two units"
            for branch in [value for value, _ in member.args] if isinstance(member, sympy.Piecewise) else [member]:
                if branch != 0 and not _is_in_one_unit(branch, wanted):  # zero is of every unit
                    return f"the right-hand side is not in {print_unit(statement.symbol)}"
    except KeyError as error:
        return f"the unit of {error.args[0]} is not known"
    return ""


def _is_in_one_unit(expression: sympy.Expr, wanted: pint.Unit | None = None) -> bool:
    names = sorted(expression.free_symbols | expression.atoms(AppliedUndef), key=str)
    stand_ins = {name: sympy.Dummy() for name in names}
    compute: Any = sympy.lambdify(list(stand_ins.values()), expression.xreplace(stand_ins), "numpy")
    # All different, so that nothing is divided by zero.
    values = [_registry().Quantity(np.sqrt(2 + n), _unit(name)) for n, name in enumerate(names)]
    try:
        found = _registry().Quantity(compute(*values))
    except pint.DimensionalityError:
        return False
    return wanted is None or bool(found.check(wanted))


@cache
def _unit(name: Name) -> pint.Unit:
    """Return a symbol's unit; X_e(s + a) has that of X_e(s), and f(dP1) that of f(dP)."""
    if isinstance(name, AppliedUndef):
        name = name.func(symbols.dP if name.func == symbols.f else symbols.s)
    if name not in QUANTITIES:
        raise KeyError(str(name))
    return _registry().Unit(QUANTITIES[name].unit)


@cache
def _registry() -> pint.UnitRegistry:
    registry = pint.UnitRegistry()
    registry.define("code = [code] = code")
    return registry
