"""The codes of Eqs. (29)-(32), corrected and stated once, and the law in counts that follows from them.

As printed, Eq. (29) divides a command of 0-10 V by the 3 V of the converter's pin, and Eqs. (30) and (31) add u_min0 in
volts to counts. Here full command is the converter's largest code, and every voltage goes through the same scaling.

The zero band and the transition: from the closing threshold, held about zero command, to the opening one.
Hysteresis parts the two thresholds: a single offset at the opening threshold leaks at zero command, one at the closing
threshold leaves a dead zone on opening. So commands up to u_z, the zero band, count as zero; and from u_z to u_t, the
transition, the drive runs straight from the certified closing offset to the law of the opening threshold::

    share = (u_i - u_z)/(u_t - u_z), held between 0 and 1
    u_O = u_O(beta_o; u) - (beta_o - beta) u_min0 (1 - share),  u = share u_t for u_i < u_t, u_i beyond

u_O(beta_o; u) being the law of the opening threshold. In the zero band that is beta u_min0, the certified offset, at
u_t the opening law, and beyond it the law as if there were no band: full command stays full command.
"""

from functools import cache
from typing import Any, NamedTuple

import sympy

from dzdesign.derivation import symbols as s
from dzdesign.derivation.law import Law
from dzdesign.derivation.lowering import lower

mu = sympy.Symbol("mu", positive=True)  # u_min0 / u_max: dimensionless
n_p, n_dp = sympy.symbols("n_p n_dp", integer=True)  # code of a pressure, difference of two such codes: counts
n_span = sympy.Symbol("n_span", positive=True)  # code of a sensor's full span: counts
p_span, dp = sympy.symbols("p_span dp", real=True)  # sensor's span, pressure drop: both in Pa, or both in MPa

#: n_i, code of the command: Eq. (29), full command u_max being the converter's largest code n_adc.
COMMAND_CODE = s.n_adc * s.u_i / s.u_max
#: n_pwm, compare value of the output: stands for Eq. (32), full drive being n_full counts.
COMPARE_VALUE = s.n_full * s.u_O / s.u_max
#: Pressure of a code, with both sensors alike; the text below Eq. (29) subtracts two of them.
PRESSURE = p_span * n_p / n_span
PRESSURE_DROP = sympy.expand(PRESSURE.subs(n_p, n_p + n_dp) - PRESSURE)
_PRESSURE_DROP_CODE = sympy.solve(sympy.Eq(dp, PRESSURE_DROP), n_dp)[0]
_DRIVE = sympy.solve(sympy.Eq(s.n_pwm, COMPARE_VALUE), s.u_O)[0] / s.u_max


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
    command = sympy.solve(sympy.Eq(s.n_i, COMMAND_CODE), s.u_i)[0]
    output = law.output.subs(s.u_i, command).subs({s.k: s.kappa * s.u_max / s.x_max, s.u_min0: mu * s.u_max})
    compare = COMPARE_VALUE.subs(s.u_O, output)
    return Line(slope=sympy.diff(compare, s.n_i), start=compare.subs(s.n_i, 0))


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
    in_counts = lower(law_in_counts(law), (s.beta, s.kappa, mu, s.n_adc, s.n_full))
    return Line(*in_counts(beta, kappa, u_min0_over_u_max, n_adc, n_full))


def drive(counts: Any, n_full: Any) -> Any:
    """Return u_O/u_max of a compare value, rounded or not, for numbers of any kind.

    Examples
    --------
    >>> drive(15000, 60000)
    Fraction(1, 4)
    """
    return lower(_DRIVE, (s.n_pwm, s.n_full))(counts, n_full)


def pressure_drop(dp_code: Any, *, span: Any, code_max: Any) -> Any:
    """Return the pressure drop that a difference of pressure codes, A minus B, stands for, for numbers of any kind.

    It is in the unit of `span`, which both sensors have; `code_max` is the code of the full span.

    Examples
    --------
    >>> pressure_drop(819, span=20, code_max=4095)
    Fraction(4, 1)
    """
    return lower(PRESSURE_DROP, (n_dp, p_span, n_span))(dp_code, span, code_max)


def pressure_drop_code(pressure_drop: Any, *, span: Any, code_max: Any) -> Any:
    """Return the difference of pressure codes that a pressure drop makes: the inverse of `pressure_drop`, not rounded.

    Examples
    --------
    >>> pressure_drop_code(4, span=20, code_max=4095)
    Fraction(819, 1)
    """
    return lower(_PRESSURE_DROP_CODE, (dp, p_span, n_span))(pressure_drop, span, code_max)


# --- zero band and transition ----------------------------------------------------------------------------------

#: What the transition takes from the opening law, V.
LOWERED_BY = (s.beta_o - s.beta) * s.u_min0 * (1 - s.share)
_LOWERED_COUNTS = sympy.cancel(COMPARE_VALUE.subs(s.u_O, LOWERED_BY).subs(s.u_min0, mu * s.u_max))
#: Share of the transition that a command within it has passed.
SHARE = (s.u_i - s.u_z) / (s.u_t - s.u_z)
#: The command that the opening law is given within the transition.
LAW_COMMAND = s.share * s.u_t


def evaluate_share(command: Any, *, zero_band: Any, end: Any) -> Any:
    """Return the share of the transition that a command has passed, 0 to 1, for numbers of one unit.

    `zero_band` is where the transition begins, `end` where it ends.

    Examples
    --------
    >>> evaluate_share(21, zero_band=19, end=51)
    Fraction(1, 16)
    """
    return min(max(lower(SHARE, (s.u_i, s.u_z, s.u_t))(command, zero_band, end), 0), 1)


def evaluate_law_command(share_of_transition: Any, *, end: Any) -> Any:
    """Return the command that the opening law is given within the transition: from 0 on, at its end the command itself.

    Examples
    --------
    >>> evaluate_law_command(evaluate_share(21, zero_band=19, end=51), end=51)
    Fraction(51, 16)
    """
    return lower(LAW_COMMAND, (s.share, s.u_t))(share_of_transition, end)


def evaluate_transition(
    *, beta_opening: Any, beta_closing: Any, u_min0_over_u_max: Any, share_of_transition: Any, n_full: Any
) -> Any:
    """Return by how many counts the transition lowers the opening law, for numbers of any kind.

    The betas are the offsets of the two thresholds over the law's u_min0; `share_of_transition` is what
    `evaluate_share` gives. Full drive is `n_full` counts.

    Examples
    --------
    >>> evaluate_transition(beta_opening=1, beta_closing=0, u_min0_over_u_max=1, share_of_transition=0, n_full=600)
    Fraction(600, 1)
    """
    lowered = lower(_LOWERED_COUNTS, (s.beta_o, s.beta, mu, s.share, s.n_full))
    return lowered(beta_opening, beta_closing, u_min0_over_u_max, share_of_transition, n_full)
