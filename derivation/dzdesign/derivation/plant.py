"""The plant, Eqs. (19)-(24), and by solving them the form that a simulation integrates.

The derivatives of Eqs. (20) and (23) are symbols here, and the second one is brought to first order by
v = dx_e/dt. Eq. (24) as published has no dead zone: the overlap of the spool is for the simulation to add.
"""

from functools import cache
from typing import NamedTuple

import sympy

from dzdesign.derivation.symbols import *

# u_i is the amplifier's input here, as printed; behind a compensator it is the compensator's output u_O.
PLANT_EQUATIONS = {
    "(19)": sympy.Eq(u_e, K_a * (u_i - u_if)),
    "(20)": sympy.Eq(u_e, (R_c + r_p) * i + L_c * di_dt),
    "(21)": sympy.Eq(u_if, K_fi * i),
    "(22)": sympy.Eq(f_e, K_i * i),
    "(23)": sympy.Eq(f_e, m_e * dv_dt + B_e * dx_e_dt + K_et * x_e + f_eL),
    "(24)": sympy.Eq(Q, C_d * W * x_e * sympy.sqrt(2 * dP / rho)),
}

STATE = (i, x_e, v)
INPUTS = (u_i, f_eL)
PARAMETERS = (K_a, K_fi, K_i, R_c, r_p, L_c, m_e, B_e, K_et)
FLOW_PARAMETERS = (C_d, W, rho, dP)


class StateDerivatives(NamedTuple):
    """Right-hand sides of the plant, in the order of `STATE`: A/s, m/s, m/s^2."""

    di_dt: sympy.Expr
    dx_e_dt: sympy.Expr
    dv_dt: sympy.Expr


@cache
def state_derivatives() -> StateDerivatives:
    """Solve Eqs. (19)-(23) for the derivatives of the state, in `STATE`, `INPUTS` and `PARAMETERS`.

    `u_i` [V] is the amplifier's input, `f_eL` [N] the load force.

    Examples
    --------
    >>> state_derivatives().dx_e_dt
    v
    """
    equations = [PLANT_EQUATIONS[number] for number in ("(19)", "(20)", "(21)", "(22)", "(23)")]
    order_reduction = sympy.Eq(dx_e_dt, v)
    unknowns = (di_dt, dx_e_dt, dv_dt, u_e, u_if, f_e)
    solution = sympy.solve([*equations, order_reduction], unknowns, dict=True)[0]
    return StateDerivatives(solution[di_dt], solution[dx_e_dt], solution[dv_dt])


@cache
def flow() -> sympy.Expr:
    """Return the flow of Eq. (24) [m^3/s] in `x_e` and `FLOW_PARAMETERS`."""
    return sympy.solve(PLANT_EQUATIONS["(24)"], Q)[0]


@cache
def steady_state_current() -> sympy.Expr:
    """Return the coil current [A] at rest, in `u_i` and `PARAMETERS`."""
    return sympy.solve(state_derivatives().di_dt, i)[0]


@cache
def current_time_constant() -> sympy.Expr:
    """Return the time constant [s] of the current loop, in `PARAMETERS`.

    Examples
    --------
    >>> current_time_constant()
    L_c/(K_a*K_fi + R_c + r_p)
    """
    return sympy.simplify(-1 / sympy.diff(state_derivatives().di_dt, i))
