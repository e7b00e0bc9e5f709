"""The unit of every symbol, and whether a statement adds and equates only what has one unit.

A check that knows nothing of the derivations: each side is evaluated with pint quantities.
"""

import math
from functools import cache
from typing import Any

import pint
import sympy
from sympy.core.function import AppliedUndef

from dzdesign.derivation import symbols
from dzdesign.derivation.account.statement import Name, Statement

_FLOW, _ADC = "m**3/s", "code"
_UNITS_OF = {
    "V": "u_i u_O u_0 u_no u_i_prime u_max u_min u_min0 u_min1 headroom excess guard drive_left fall jump u_above "
    "u_below u_dz u_seen u_seen0 u_seen1 q_x y rest u_1 u_2 u_e u_if V_pin V_adc",
    "m": "x x_max x_e x_ov x_init W",
    "dimensionless": "C_d beta kappa n slope duty scale",
    "V/m": "k",
    "kg/m**3": "rho",
    "Pa": "dP dP0 dP1 above below",
    _FLOW: "Q Q_O Q_O_prime Q_neg Q_max Q_max0 Q_max1 Q_floor Q_scaled Q_1 Q_2 dQ_dC_d",
    f"{_FLOW}/V": "K_e K_0 K_1 s_flow s_flow0 s_flow1 G G_0",
    "m**2/s": "gamma_0 gamma_1 dQ_dx_max",
    f"{_FLOW}*m/V": "dQ_dk",
    _ADC: "n_i n_0 n_no n_pwm n_adc n_full",
    f"{_ADC}/V": "n_V",
    f"V/{_ADC}": "K_c",
    "A": "i i_init",
    "A/s": "di_dt",
    "N": "f_e f_eL",
    "m/s": "dx_e_dt v v_init",
    "m/s**2": "dv_dt",
    "V/V": "K_a",
    "V/A": "K_fi",
    "N/A": "K_i",
    "ohm": "R_c r_p",
    "H": "L_c",
    "kg": "m_e",
    "N*s/m": "B_e",
    "N/m": "K_et",
    "s": "t",
    "1/s": "s a",
    # A transform is an integral over time.
    "V*s": "U_e U_i U_if",
    "A*s": "I_s",
    "N*s": "F_e F_eL",
    "m*s": "X_e",
    "m**3": "Q_s",
}


@cache
def unit_table() -> dict[Name, str]:
    """Return the unit of each symbol of the account, as pint reads it; counts are ``code``.

    Returns
    -------
    dict of symbol to str

    Examples
    --------
    >>> unit_table()[symbols.k]
    'V/m'
    """
    return {getattr(symbols, name): unit for unit, names in _UNITS_OF.items() for name in names.split()}


def print_unit(name: Name) -> str:
    """Return the unit of a symbol as a person writes it.

    Parameters
    ----------
    name : symbol or applied function
        One of `symbols.py`; ``f(dP)`` is a threshold.

    Returns
    -------
    str

    Examples
    --------
    >>> print_unit(symbols.Q), print_unit(symbols.beta)
    ('m^3/s', '1')
    """
    known = symbols.u_min if name.func == symbols.f else name
    unit = _plain(_registry().Unit(unit_table()[known])).replace("code", "counts").replace("Ω", "ohm")
    return "1" if unit == "a number" else unit


def find_unit_error(statement: Statement) -> str:
    """Say what is wrong with the units of a statement.

    Parameters
    ----------
    statement : Statement

    Returns
    -------
    str
        Empty if all its sides have one unit and no sum mixes units.
    """
    left = _quantity_of(statement.symbol)
    if left is None:
        return f"the unit of {statement.symbol} is not known"
    for member in statement.members:
        try:
            branches = _branches(member)
        except pint.DimensionalityError as error:
            return f"a comparison of {_plain(error.units1)} with {_plain(error.units2)}"
        for branch in branches:
            error = _error(left, branch)
            if error:
                return error
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
    # Transforms at shifted arguments, X_e(s + a), have the unit of the transform; f(dP) is a threshold.
    transforms = {
        function: symbols.u_min if function.func == symbols.f else function.func(symbols.s)
        for function in expression.atoms(AppliedUndef)
    }
    stand_ins = {name: sympy.Dummy() for name in transforms}
    plain = expression.xreplace(stand_ins)
    names = {stand_ins[function]: known for function, known in transforms.items()}
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
    unit = unit_table().get(name)
    # Values without a pattern, so that no sum is zero by chance.
    return None if unit is None else _registry().Quantity(1 + math.sqrt(2 + position), unit)


@cache
def _registry() -> pint.UnitRegistry:
    registry = pint.UnitRegistry()
    registry.define("code = [code] = code")
    return registry
