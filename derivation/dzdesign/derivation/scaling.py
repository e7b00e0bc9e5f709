"""The codes of Eqs. (29)-(32), corrected and stated once, and the law in counts that follows from them.

As printed, Eq. (29) divides a command of 0-10 V by the 3 V of the converter's pin, and Eqs. (30) and (31) add u_min0 in
volts to counts. Here full command is the converter's largest code, and every voltage goes through the same scaling.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import sympy

from dzdesign.derivation.law import Law
from dzdesign.derivation.lowering import lower
from dzdesign.derivation.symbols import beta, k, kappa, n_adc, n_full, n_i, n_pwm, u_i, u_max, u_min0, u_O, x_max

mu = sympy.Symbol("mu", positive=True)  # u_min0 / u_max: dimensionless
n_p, n_dp = sympy.symbols("n_p n_dp", integer=True)  # code of a pressure, difference of two such codes: counts
n_span = sympy.Symbol("n_span", positive=True)  # code of a sensor's full span: counts
p_span, dp = sympy.symbols("p_span dp", real=True)  # sensor's span, pressure drop: both in Pa, or both in MPa

#: n_i, code of the command: Eq. (29), full command u_max being the converter's largest code n_adc.
COMMAND_CODE = n_adc * u_i / u_max
#: n_pwm, compare value of the output: stands for Eq. (32), full drive being n_full counts.
COMPARE_VALUE = n_full * u_O / u_max
#: Pressure of a code, with both sensors alike; the text below Eq. (29) subtracts two of them.
PRESSURE = p_span * n_p / n_span
PRESSURE_DROP = sympy.expand(PRESSURE.subs(n_p, n_p + n_dp) - PRESSURE)


class Line(NamedTuple):
    """The law at one beta, ``n_pwm = slope n_i + start``: counts per code, and counts at code 0; not rounded."""

    slope: Any
    start: Any


@cache
def law_in_counts(law: Law) -> Line:
    """Put the scaling into the output of a law, stated in volts: from the command's code to the compare value.

    The expressions are in `beta`, `kappa` (k x_max/u_max), `mu` (u_min0/u_max), `n_adc` and `n_full`.

    Examples
    --------
    >>> from dzdesign.derivation.law import law
    >>> law_in_counts(law("paper")).start
    beta*mu*n_full
    """
    command = sympy.solve(sympy.Eq(n_i, COMMAND_CODE), u_i)[0]
    output = law.output.subs(u_i, command).subs({k: kappa * u_max / x_max, u_min0: mu * u_max})
    compare = COMPARE_VALUE.subs(u_O, output)
    return Line(slope=sympy.diff(compare, n_i), start=compare.subs(n_i, 0))


def evaluate_line(law: Law, *, beta: Any, kappa: Any, u_min0_over_u_max: Any, n_adc: Any, n_full: Any) -> Line:
    """Return the law in counts for numbers of any kind; not rounded, not limited to 0...n_full.

    `beta` is Eq. (5) at the present pressure drop; `kappa` and `u_min0_over_u_max` are dimensionless; `n_adc` is the
    code of full command, `n_full` the compare value of full drive.

    Examples
    --------
    >>> from fractions import Fraction
    >>> from dzdesign.derivation.law import law
    >>> half = Fraction(1, 2)
    >>> evaluate_line(law("paper"), beta=1, kappa=half, u_min0_over_u_max=half, n_adc=4095, n_full=60000)
    Line(slope=Fraction(2000, 273), start=Fraction(30000, 1))
    """
    return Line(*_lowered_line(law_in_counts(law))(beta, kappa, u_min0_over_u_max, n_adc, n_full))


@cache
def _lowered_line(line: Line) -> Callable[..., Any]:
    return lower(line, (beta, kappa, mu, n_adc, n_full))


def drive(counts: Any, n_full: Any) -> Any:
    """Return u_O/u_max of a compare value, rounded or not, for numbers of any kind.

    Examples
    --------
    >>> drive(15000, 60000)
    Fraction(1, 4)
    """
    return _lowered_drive()(counts, n_full)


@cache
def _lowered_drive() -> Callable[..., Any]:
    output = sympy.solve(sympy.Eq(n_pwm, COMPARE_VALUE), u_O)[0]
    return lower(output / u_max, (n_pwm, n_full))


def pressure_drop(dp_code: Any, *, span: Any, code_max: Any) -> Any:
    """Return the pressure drop that a difference of pressure codes, A minus B, stands for, for numbers of any kind.

    It is in the unit of `span`, which both sensors have; `code_max` is the code of the full span.

    Examples
    --------
    >>> pressure_drop(819, span=20, code_max=4095)
    Fraction(4, 1)
    """
    return _lowered_pressure_drop()(dp_code, span, code_max)


@cache
def _lowered_pressure_drop() -> Callable[..., Any]:
    return lower(PRESSURE_DROP, (n_dp, p_span, n_span))


def pressure_drop_code(pressure_drop: Any, *, span: Any, code_max: Any) -> Any:
    """Return the difference of pressure codes that a pressure drop makes: the inverse of `pressure_drop`, not rounded.

    Examples
    --------
    >>> pressure_drop_code(4, span=20, code_max=4095)
    Fraction(819, 1)
    """
    return _lowered_pressure_drop_code()(pressure_drop, span, code_max)


@cache
def _lowered_pressure_drop_code() -> Callable[..., Any]:
    return lower(sympy.solve(sympy.Eq(dp, PRESSURE_DROP), n_dp)[0], (dp, p_span, n_span))
